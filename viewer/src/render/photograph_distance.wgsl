// The mesh as a photograph's camera sees it, with the bits of the distance along the direction of view (metres) in place of a
// colour; 0 where there is none.

@group(1) @binding(0) var<uniform> photograph: Photograph;

// Planes between which a camera sees, metres: the bits of a float are enough for all that a cell is made of.
const NEAR: f32 = 0.01;
const FAR: f32 = 100.0;

struct DistantSurface {
    @builtin(position) position: vec4<f32>,
    @location(0) distance: f32,
}

@vertex
fn vs_mesh_distance(@location(0) position: vec3<f32>) -> DistantSurface {
    let place = (photograph.camera_from_table * vec4<f32>(position, 1.0)).xyz;
    // Pixels have their centres at whole numbers. Homogeneous, so that what is behind the camera is clipped.
    let edge = photograph.camera.xy * place.xy + (photograph.camera.zw + 0.5) * place.z;
    let clip = 2.0 * edge / photograph.size.xy - place.z;
    let depth = (place.z - NEAR) * FAR / (FAR - NEAR);
    var surface: DistantSurface;
    surface.position = vec4<f32>(clip.x, -clip.y, depth, place.z);
    surface.distance = place.z;
    return surface;
}

@fragment
fn fs_mesh_distance(surface: DistantSurface) -> @location(0) vec4<u32> {
    return vec4<u32>(bitcast<u32>(surface.distance), 0u, 0u, 0u);
}
