// The area of cap.wgsl in a pick; see pick.wgsl. No surface lies there, and what the area hides is not to be found.

@group(1) @binding(0) var<uniform> window: vec4<f32>;

@vertex
fn vs_cap_pick(@location(0) position: vec3<f32>) -> @builtin(position) vec4<f32> {
    return in_window(frame.clip_from_table * vec4<f32>(position, 1.0), window);
}

@fragment
fn fs_cap_pick() -> @location(0) vec4<u32> {
    return vec4<u32>(0u);
}
