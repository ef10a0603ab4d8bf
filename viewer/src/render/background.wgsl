// A quiet vertical gradient behind everything, dithered by half a level so that it shows no bands.

struct Background {
    top: vec4<f32>,
    bottom: vec4<f32>,
}

@group(1) @binding(0) var<uniform> background: Background;

struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) height: f32,
}

@vertex
fn vs_background(@builtin(vertex_index) vertex: u32) -> Corner {
    // One triangle that covers the screen.
    let at = vec2<f32>(f32((vertex << 1u) & 2u), f32(vertex & 2u)) * 2.0 - 1.0;
    var corner: Corner;
    corner.position = vec4<f32>(at, 1.0, 1.0);
    corner.height = at.y * 0.5 + 0.5;
    return corner;
}

@fragment
fn fs_background(corner: Corner) -> @location(0) vec4<f32> {
    let color = mix(background.bottom.rgb, background.top.rgb, corner.height);
    // Interleaved gradient noise (Jimenez 2014).
    let noise = fract(52.9829189 * fract(dot(corner.position.xy, vec2<f32>(0.06711056, 0.00583715))));
    return vec4<f32>(color + (noise - 0.5) / 255.0, 1.0);
}
