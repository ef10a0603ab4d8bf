//! Background by what the cell knows: pixels whose points lie outside its measuring volume.
//!
//! Where [Wang 2023] looks for the target's outline in the picture, a cell has a calibrated table, and a depth that
//! says for every pixel whether the robot's pose puts it on the part. A pixel without depth is background if its whole
//! ray misses.

use crate::view::View;
use nalgebra::{Isometry3, Point3, Vector3};

/// How far outside the volume a point may lie and still count as inside, metres: the error of a kinematic pose.
const SLACK: f64 = 0.004;

/// True for pixels that show nothing within the box from `low` to `high` (table frame, metres), row-major; `None` where
/// the camera's pose is not known.
pub fn background(view: &View, low: &Point3<f64>, high: &Point3<f64>) -> Option<Vec<bool>> {
    let pose = view.pose.table_from_camera()?;
    let slack = Vector3::repeat(SLACK);
    let (low, high) = (low - slack, high + slack);
    Some(
        (0..view.depth.metres.len())
            .map(|i| {
                let (u, v) = (i % view.depth.width as usize, i / view.depth.width as usize);
                let z = view.depth.metres.get(i).copied().unwrap_or(0.0);
                if z > 0.0 {
                    let p = pose * view.intrinsics.unproject(u as f64, v as f64, z.into());
                    !(0..3).all(|a| (low[a]..=high[a]).contains(&p[a]))
                } else {
                    misses(&pose, &view.intrinsics.unproject(u as f64, v as f64, 1.0), &low, &high)
                }
            })
            .collect(),
    )
}

/// Whether the ray from the camera through `ahead` (camera frame) misses the box: the slab test.
fn misses(pose: &Isometry3<f64>, ahead: &Point3<f64>, low: &Point3<f64>, high: &Point3<f64>) -> bool {
    let (origin, direction) = (pose * Point3::origin(), pose * ahead.coords);
    let (mut near, mut far) = (0.0_f64, f64::INFINITY);
    for a in 0..3 {
        let (t0, t1) = ((low[a] - origin[a]) / direction[a], (high[a] - origin[a]) / direction[a]);
        // A ray along the slab is inside it for all t or for none; min and max drop the NaN of 0 / 0.
        near = near.max(t0.min(t1));
        far = far.min(t0.max(t1));
    }
    near > far
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_that_miss_the_box_are_background() {
        let (low, high) = (Point3::new(-0.1, -0.1, 0.4), Point3::new(0.1, 0.1, 0.6));
        let misses = |x, y| super::misses(&Isometry3::identity(), &Point3::new(x, y, 1.0), &low, &high);
        assert!(!misses(0.0, 0.0) && !misses(0.24, 0.0) && !misses(-0.2, 0.2));
        assert!(misses(0.26, 0.0) && misses(0.0, -0.3) && misses(1.0, 1.0));
    }
}
