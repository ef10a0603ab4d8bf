// The points of points.wgsl as numbers in place of colours; see pick.wgsl.

@group(3) @binding(0) var<uniform> window: vec4<f32>;

struct NumberedSplat {
    @builtin(position) position: vec4<f32>,
    @location(0) disc: vec2<f32>,
    @location(1) @interpolate(flat, either) plane: vec4<f32>,
    @location(2) @interpolate(flat, either) number: u32,
    @location(3) place: vec3<f32>,
}

@vertex
fn vs_points_pick(@builtin(vertex_index) vertex: u32, @builtin(instance_index) page_index: u32) -> NumberedSplat {
    let splat = splat_corner(vertex);
    var numbered: NumberedSplat;
    numbered.position = in_window(splat.position, window);
    numbered.disc = splat.disc;
    numbered.plane = splat.plane;
    numbered.place = splat.place;
    // pick_window.rs: slots of a page take 18 bits.
    numbered.number = ((page_index << 18u) | slot_of(vertex)) + 1u;
    return numbered;
}

struct NumberedPixel {
    @location(0) content: vec4<u32>,
    @builtin(frag_depth) depth: f32,
}

@fragment
fn fs_points_pick(splat: NumberedSplat) -> NumberedPixel {
    if !covers(splat.disc, splat.plane) || is_cut_away(splat.place) {
        discard;
    }
    let distance = surface_distance(splat.disc, splat.plane);
    var pixel: NumberedPixel;
    pixel.content = vec4<u32>(splat.number, bitcast<u32>(distance), 0u, 0u);
    pixel.depth = clamp(frame.depth.x + frame.depth.y / distance, 0.0, 1.0);
    return pixel;
}
