//! What [Eye-in-hand 2020] printed. Its figures come from a RealSense D435 on a UR10, real objects and a trained Mask
//! R-CNN: they stand beside ours for orientation, not for comparison.

use super::Method;

/// C2C in millimetres, the paper's Tables 3 and 4, in the order of [`Method::ALL`]; `None` for objects it does not
/// have.
pub fn c2c(object: &str) -> Option<[f64; 4]> {
    Some(match object {
        "cylinder" => [4.786, 3.534, 3.504, 3.449],
        "half-cylinder" => [5.851, 4.597, 4.250, 4.074],
        "L-block" => [5.622, 4.535, 4.380, 4.142],
        "cuboid" => [4.806, 3.250, 3.262, 2.992],
        "box" => [3.442, 3.083, 3.012, 2.973],
        "lemon" => [3.727, 3.646, 3.121, 2.593],
        "orange" => [4.802, 4.240, 4.106, 3.586],
        "plum" => [4.918, 4.574, 4.421, 3.693],
        "mug" => [3.601, 3.131, 3.110, 2.968],
        _ => return None,
    })
}

/// IoU of the masks in per cent, the paper's Tables 1 and 2: of Mask R-CNN, and after fusion segmentation.
pub fn mask_iou(object: &str) -> Option<[f64; 2]> {
    Some(match object {
        "cylinder" => [92.128, 92.174],
        "half-cylinder" => [90.168, 91.330],
        "L-block" => [92.788, 92.991],
        "cuboid" => [86.498, 92.443],
        "box" => [92.327, 95.852],
        "lemon" => [84.364, 88.194],
        "orange" => [85.868, 91.486],
        "plum" => [81.811, 91.440],
        "mug" => [89.356, 93.085],
        _ => return None,
    })
}

/// CPU milliseconds a view, the paper's Table 5: segmentation (the network included) and 3D mapping.
pub fn cpu_ms(method: Method) -> [f64; 2] {
    match method {
        Method::MaskOnly => [81.0, 12.0],
        Method::MaskIcp => [81.0, 330.0],
        Method::SlicIcp => [784.0, 334.0],
        Method::LcccpSicp => [802.0, 271.0],
    }
}
