// What every primitive knows of the frame; put in front of each shader.

struct Frame {
    clip_from_table: mat4x4<f32>,
    view_from_table: mat4x4<f32>,
    // Width and height in pixels; pixels that a metre covers at a distance of one metre; pixels per CSS pixel.
    viewport: vec4<f32>,
    // Clip depth = x + y / distance; z: near plane, w: far plane (metres).
    depth: vec4<f32>,
    // What is cut away of the model, table frame, metres: beyond a plane (normal, offset), and outside of a box.
    cut: vec4<f32>,
    low: vec4<f32>,
    high: vec4<f32>,
}

@group(0) @binding(0) var<uniform> frame: Frame;

// Whether a place of the model (table frame) is cut away.
fn is_cut_away(place: vec3<f32>) -> bool {
    return dot(frame.cut.xyz, place) > frame.cut.w || any(place < frame.low.xyz) || any(place > frame.high.xyz);
}

// sRGB to linear light and back; the exact curve differs from this power by less than a level where it shows.
fn linear_from_srgb(c: vec3<f32>) -> vec3<f32> {
    return pow(c, vec3<f32>(2.2));
}

fn srgb_from_linear(c: vec3<f32>) -> vec3<f32> {
    return pow(clamp(c, vec3<f32>(0.0), vec3<f32>(1.0)), vec3<f32>(1.0 / 2.2));
}

// A light at the eye, a little above and to the left, over a sky brighter than the ground; about 1 where the surface
// faces it. `facing` is the cosine between normal and the way to the eye: an inner side seen from behind is darker.
fn light(outward_view: vec3<f32>, normal_table: vec3<f32>, facing: f32) -> f32 {
    let lamp = max(dot(outward_view, normalize(vec3<f32>(-0.25, 0.4, 0.88))), 0.0);
    let sky = 0.5 + 0.5 * normal_table.z;
    // Soft, so that noisy normals along a silhouette do not sparkle.
    let inner = mix(0.6, 1.0, smoothstep(-0.4, -0.1, facing));
    return inner * (0.28 + 0.17 * sky + 0.62 * lamp);
}
