// Segments of constant width on the screen: each is a rectangle of two triangles, widened by a pixel for soft edges.

struct Corner {
    @builtin(position) position: vec4<f32>,
    // Pixels across the line from its middle, and half its width.
    @location(0) across: vec2<f32>,
    @location(1) color: vec4<f32>,
}

// In front of the near plane: what is behind the eye has no place on the screen.
fn clipped(from_view: vec3<f32>, to_view: vec3<f32>) -> vec3<f32> {
    let near = -frame.depth.z;
    if from_view.z <= near || to_view.z >= from_view.z {
        return from_view;
    }
    return mix(from_view, to_view, (near - from_view.z) / (to_view.z - from_view.z));
}

fn project(view: vec3<f32>) -> vec4<f32> {
    let distance = max(-view.z, 1e-6);
    let eye = frame.viewport.z * 2.0 / frame.viewport.xy;
    return vec4<f32>(view.xy * eye, frame.depth.x * distance + frame.depth.y, distance);
}

@vertex
fn vs_lines(
    @builtin(vertex_index) vertex: u32,
    @location(0) from_table: vec3<f32>,
    @location(1) to_table: vec3<f32>,
    @location(2) color: vec4<f32>,
    @location(3) width: f32,
) -> Corner {
    let from_view = (frame.view_from_table * vec4<f32>(from_table, 1.0)).xyz;
    let to_view = (frame.view_from_table * vec4<f32>(to_table, 1.0)).xyz;
    let start = project(clipped(from_view, to_view));
    let end = project(clipped(to_view, from_view));

    let corner = vertex % 6u;
    let at_end = corner == 1u || corner == 2u || corner == 4u;
    let side = select(-1.0, 1.0, corner == 2u || corner == 4u || corner == 5u);
    let half_viewport = 0.5 * frame.viewport.xy;
    let along = (end.xy / end.w - start.xy / start.w) * half_viewport;
    let direction = along / max(length(along), 1e-4);
    let half_width = 0.5 * width * frame.viewport.w;
    let reach = half_width + 1.0;
    let place = select(start, end, at_end);
    let cap = direction * select(-half_width, half_width, at_end);
    let offset = (vec2<f32>(-direction.y, direction.x) * side * reach + cap) / half_viewport;

    var out: Corner;
    out.position = vec4<f32>(place.xy + offset * place.w, place.zw);
    out.across = vec2<f32>(side * reach, half_width);
    out.color = color;
    return out;
}

@fragment
fn fs_lines(corner: Corner) -> @location(0) vec4<f32> {
    let cover = clamp(corner.across.y + 0.5 - abs(corner.across.x), 0.0, 1.0);
    return vec4<f32>(corner.color.rgb, corner.color.a * cover);
}
