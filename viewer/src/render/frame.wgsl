// What every primitive knows of the frame; put in front of each shader.

struct Frame {
    clip_from_table: mat4x4<f32>,
    view_from_table: mat4x4<f32>,
    // Width and height in pixels; pixels that a metre covers at a distance of one metre; pixels per CSS pixel.
    viewport: vec4<f32>,
    // Clip depth = x + y / distance; z: near plane, w: far plane (metres).
    depth: vec4<f32>,
}

@group(0) @binding(0) var<uniform> frame: Frame;

// sRGB to linear light and back; the exact curve differs from this power by less than a level where it shows.
fn linear_from_srgb(c: vec3<f32>) -> vec3<f32> {
    return pow(c, vec3<f32>(2.2));
}

fn srgb_from_linear(c: vec3<f32>) -> vec3<f32> {
    return pow(clamp(c, vec3<f32>(0.0), vec3<f32>(1.0)), vec3<f32>(1.0 / 2.2));
}
