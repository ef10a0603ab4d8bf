// A photograph on the surface. What the camera did not see is left as it is: outside of its picture, facing away, or behind
// other surface, which is known from the distances of the mesh as that camera sees it.

struct Photograph {
    // From the table frame to the camera's: x right, y down, z forward.
    camera_from_table: mat4x4<f32>,
    // Focal lengths and principal point, pixels.
    camera: vec4<f32>,
    // Columns and rows of the camera's picture; strength, 0: no photograph; metres that a surface may lie behind another's distance.
    size: vec4<f32>,
}

// Pixel of a place in the camera's frame.
fn camera_pixel(photograph: Photograph, place: vec3<f32>) -> vec2<f32> {
    return photograph.camera.xy * place.xy / place.z + photograph.camera.zw;
}

// Metres that surface may lie behind the distance at its pixel, where that pixel is `pixels` wide, counted in those of the camera's
// picture: on a slope the distance changes within a pixel.
fn distance_tolerance(photograph: Photograph, facing: f32, distance: f32, pixels: f32) -> f32 {
    let slope = sqrt(max(1.0 - facing * facing, 0.0)) / max(facing, 0.08);
    return photograph.size.w + slope * distance * pixels / photograph.camera.x;
}
