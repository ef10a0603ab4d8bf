// A few pixels of the picture around one, drawn into a target of unsigned integers: number of what lies there plus one (0:
// nothing), its distance along the direction of view as the bits of an f32 (metres), unused, unused.

// From the picture's clip space to the window's. `window`: middle of the window in the picture, -1..1; the picture's size
// in windows.
fn in_window(position: vec4<f32>, window: vec4<f32>) -> vec4<f32> {
    return vec4<f32>((position.xy - window.xy * position.w) * window.zw, position.zw);
}
