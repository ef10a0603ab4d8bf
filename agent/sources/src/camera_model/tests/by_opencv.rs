//! The same lenses by OpenCV: `fixtures/by_opencv.py`, in the Python that `SEMASCAN_FOREIGN_PYTHON` names.

use super::{AZURE_KINECT, FREIBURG1, K, SIZE, T265, camera};
use crate::camera_model::{Distortion, Rectification};
use crate::foreign_python;
use image::{Rgb, RgbImage};
use nalgebra::Point3;
use serde_json::{Value, json};

#[test]
fn opencv_sees_the_same_pixels_rays_and_pictures() {
    let folder = tempfile::tempdir().expect("a folder");
    let picture = RgbImage::from_fn(SIZE.0, SIZE.1, |u, v| {
        let wave = |frequency: f64, at: u32| (127.0 + 120.0 * (frequency * f64::from(at)).sin()) as u8;
        Rgb([wave(0.11, u), wave(0.17, v), wave(0.07, u + v)])
    });
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).expect("written");
    write("taken.rgb", picture.as_raw());
    let lenses = [("brown", FREIBURG1), ("rational", AZURE_KINECT), ("fisheye", T265)];
    let cases: Vec<Value> = lenses
        .iter()
        .map(|(name, distortion)| {
            let camera = camera(*distortion);
            let rectification = Rectification::of(&camera).expect("a lens");
            write(&format!("{name}.rgb"), rectification.color(&picture).expect("its size").as_raw());
            let rays: Vec<[f64; 2]> =
                (0..300).map(|i| [-0.55 + 0.05 * f64::from(i % 23), -0.45 + 0.07 * f64::from(i / 23)]).collect();
            let pixels: Vec<(f64, f64)> =
                rays.iter().map(|[x, y]| camera.pixel_of_point(&Point3::new(*x, *y, 1.0)).expect("a pixel")).collect();
            let back: Vec<[f64; 2]> = pixels
                .iter()
                .map(|(u, v)| camera.ray_of_pixel(*u, *v).map(|ray| [ray.x, ray.y]).expect("a ray"))
                .collect();
            json!({
                "name": name, "fisheye": matches!(distortion, Distortion::Fisheye { .. }),
                "coefficients": in_order(distortion), "rays": rays, "pixels": pixels, "back": back,
            })
        })
        .collect();
    let all = json!({ "size": SIZE, "k": [K.fx, K.fy, K.cx, K.cy], "cases": cases });
    write("cases.json", all.to_string().as_bytes());
    if let Err(why) = foreign_python::run("by_opencv.py", folder.path()) {
        eprintln!("SKIPPED: {why}: lenses are not compared with OpenCV");
    }
}

/// Coefficients in OpenCV's order.
fn in_order(distortion: &Distortion) -> Vec<f64> {
    match *distortion {
        Distortion::None => Vec::new(),
        Distortion::BrownConrady { radial: [k1, k2, k3], tangential: [p1, p2] } => vec![k1, k2, p1, p2, k3],
        Distortion::Rational { radial: [k1, k2, k3], divisor: [k4, k5, k6], tangential: [p1, p2] } => {
            vec![k1, k2, p1, p2, k3, k4, k5, k6]
        }
        Distortion::Fisheye { radial } => radial.to_vec(),
    }
}
