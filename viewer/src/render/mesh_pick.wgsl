// The triangles of the mesh as numbers in place of colours; see pick.wgsl. WebGL2 does not number triangles: a pixel gets
// the number of one of its triangle's vertices (which one depends on the interface), and the page finds the triangle among
// the few that have it.

@group(1) @binding(0) var<uniform> window: vec4<f32>;

struct NumberedSurface {
    @builtin(position) position: vec4<f32>,
    @location(0) distance: f32,
    @location(1) @interpolate(flat, either) number: u32,
    @location(2) place: vec3<f32>,
}

@vertex
fn vs_mesh_pick(@builtin(vertex_index) vertex: u32, @location(0) position: vec3<f32>) -> NumberedSurface {
    var surface: NumberedSurface;
    surface.position = in_window(frame.clip_from_table * vec4<f32>(position, 1.0), window);
    surface.distance = -(frame.view_from_table * vec4<f32>(position, 1.0)).z;
    surface.number = vertex + 1u;
    surface.place = position;
    return surface;
}

@fragment
fn fs_mesh_pick(surface: NumberedSurface) -> @location(0) vec4<u32> {
    if is_cut_away(surface.place) {
        discard;
    }
    return vec4<u32>(surface.number, bitcast<u32>(surface.distance), 0u, 0u);
}
