// The turntable: a disc with rings of known distance and a scale of degrees along its rim.
// Lines are antialiased against the derivative across them, so they stay one pixel wide at any tilt.

struct Turntable {
    // Radius, height, distance of the rings (metres), unused.
    shape: vec4<f32>,
    fill: vec4<f32>,
    line: vec4<f32>,
    // The tick at zero degrees, the table frame's x axis.
    zero: vec4<f32>,
}

@group(1) @binding(0) var<uniform> turntable: Turntable;

struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) at: vec2<f32>,
}

@vertex
fn vs_turntable(@builtin(vertex_index) vertex: u32) -> Corner {
    let side = vec2<f32>(f32(vertex & 1u), f32(vertex >> 1u)) * 2.0 - 1.0;
    var corner: Corner;
    corner.at = side * turntable.shape.x * 1.02;
    corner.position = frame.clip_from_table * vec4<f32>(corner.at, turntable.shape.y, 1.0);
    return corner;
}

// How much of a pixel of size `pixel` a line covers that is `width` pixels wide and `distance` away.
fn stroke(distance: f32, pixel: f32, width: f32) -> f32 {
    return clamp(0.5 * (width + 1.0) - distance / max(pixel, 1e-9), 0.0, 1.0);
}

@fragment
fn fs_turntable(corner: Corner) -> @location(0) vec4<f32> {
    let at = corner.at;
    let radius = turntable.shape.x;
    let along = length(at);
    let pixel_along = max(fwidth(along), 1e-9);
    let tangent = vec2<f32>(-at.y, at.x) / max(along, 1e-6);
    let pixel_across = abs(dot(dpdx(at), tangent)) + abs(dot(dpdy(at), tangent));
    let width = frame.viewport.w;

    let inside = clamp(0.5 - (along - radius) / pixel_along, 0.0, 1.0);
    let ring = round(along / turntable.shape.z) * turntable.shape.z;
    // Rings closer than a few pixels would only grey the disc.
    let calm = clamp(turntable.shape.z / pixel_along / 6.0 - 0.5, 0.0, 1.0);
    var line = 0.45 * calm * stroke(abs(along - ring), pixel_along, width);
    line = max(line, stroke(abs(along - radius), pixel_along, 1.5 * width));

    let angle = degrees(atan2(at.y, at.x));
    let to_metres = radians(1.0) * along;
    let ten = abs(angle - round(angle / 10.0) * 10.0) * to_metres;
    let thirty = abs(angle - round(angle / 30.0) * 30.0) * to_metres;
    let band = along / radius;
    line = max(line, 0.8 * step(0.965, band) * stroke(ten, pixel_across, width));
    line = max(line, step(0.93, band) * stroke(thirty, pixel_across, 1.5 * width));
    let axis = 0.25 * max(stroke(abs(at.x), fwidth(at.x), width), stroke(abs(at.y), fwidth(at.y), width));
    line = max(line, axis);
    let zero = step(0.88, band) * step(0.0, at.x) * stroke(abs(at.y), pixel_across, 3.0 * width);

    var color = mix(turntable.fill, turntable.line, line);
    color = mix(color, turntable.zero, zero);
    return vec4<f32>(color.rgb, color.a * inside);
}
