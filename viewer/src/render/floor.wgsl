// Where there is no turntable: a square grid under the model that fades out, with every tenth line stronger.

struct Floor {
    // Centre x and y, height, radius at which it has faded (metres).
    place: vec4<f32>,
    // Distance of the lines (metres), unused.
    step: vec4<f32>,
    line: vec4<f32>,
}

@group(1) @binding(0) var<uniform> ground: Floor;

struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) at: vec2<f32>,
}

@vertex
fn vs_floor(@builtin(vertex_index) vertex: u32) -> Corner {
    let side = vec2<f32>(f32(vertex & 1u), f32(vertex >> 1u)) * 2.0 - 1.0;
    var corner: Corner;
    corner.at = ground.place.xy + side * ground.place.w;
    corner.position = frame.clip_from_table * vec4<f32>(corner.at, ground.place.z, 1.0);
    return corner;
}

// How much of a pixel is covered by lines `distance` apart; lines closer than a few pixels fade away.
fn grid(at: vec2<f32>, distance: f32, pixel: vec2<f32>) -> f32 {
    let off = abs(at - round(at / distance) * distance) / pixel;
    let calm = clamp(distance / pixel / 6.0 - 0.5, vec2<f32>(0.0), vec2<f32>(1.0));
    let cover = clamp(0.5 * (frame.viewport.w + 1.0) - off, vec2<f32>(0.0), vec2<f32>(1.0)) * calm;
    return max(cover.x, cover.y);
}

@fragment
fn fs_floor(corner: Corner) -> @location(0) vec4<f32> {
    let pixel = max(fwidth(corner.at), vec2<f32>(1e-9));
    let fine = 0.4 * grid(corner.at, ground.step.x, pixel);
    let coarse = grid(corner.at, ground.step.x * 10.0, pixel);
    let out = length(corner.at - ground.place.xy) / ground.place.w;
    let fade = 1.0 - smoothstep(0.35, 1.0, out);
    return vec4<f32>(ground.line.rgb, ground.line.a * max(fine, coarse) * fade);
}
