// The area that a section encloses, hatched: one tint without light, so that it is not taken for surface that was seen.

struct Cap {
    fill: vec4<f32>,
    line: vec4<f32>,
    // Distance of the lines, metres; unused.
    hatch: vec4<f32>,
}

@group(1) @binding(0) var<uniform> cap: Cap;

struct Place {
    @builtin(position) position: vec4<f32>,
    @location(0) across: f32,
}

@vertex
fn vs_cap(@location(0) position: vec3<f32>, @location(1) across: f32) -> Place {
    var place: Place;
    place.position = frame.clip_from_table * vec4<f32>(position, 1.0);
    place.across = across;
    return place;
}

@fragment
fn fs_cap(place: Place) -> @location(0) vec4<f32> {
    let pixel = max(fwidth(place.across), 1e-9);
    let gap = cap.hatch.x;
    let off = abs(place.across - round(place.across / gap) * gap);
    let line = clamp(0.5 * (frame.viewport.w + 1.0) - off / pixel, 0.0, 1.0);
    // Lines closer than a few pixels would only flicker.
    let calm = clamp(gap / pixel / 4.0 - 0.5, 0.0, 1.0);
    return vec4<f32>(mix(cap.fill.rgb, cap.line.rgb, line * calm), 1.0);
}
