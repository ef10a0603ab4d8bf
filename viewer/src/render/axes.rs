//! The axes of the table frame as a small cross in the corner, lettered so that colour is not needed to read it.

use super::segment::{Segment, polyline};
use glam::Vec3;

/// Length of an axis in the cross's own unit; the picture of it spans -1.5..=1.5.
const LENGTH: f32 = 1.0;

/// The segments, in units of the cross; `right` and `up` are the camera's, so that the letters face it.
pub fn segments(right: Vec3, up: Vec3) -> Vec<Segment> {
    let axes = [
        (Vec3::X, [0xe2, 0x5c, 0x5c, 0xff], letter_x as Letter),
        (Vec3::Y, [0x4f, 0xb0, 0x6a, 0xff], letter_y as Letter),
        (Vec3::Z, [0x4f, 0x8f, 0xe8, 0xff], letter_z as Letter),
    ];
    let mut segments = Vec::new();
    for (axis, color, letter) in axes {
        segments.push(Segment { from: Vec3::ZERO, to: axis * LENGTH, color, width: 2.0 });
        for stroke in letter() {
            let points: Vec<Vec3> =
                stroke.iter().map(|[u, v]| axis * LENGTH * 1.3 + (right * *u + up * *v) * 0.13).collect();
            segments.extend(polyline(&points, color, 1.5));
        }
    }
    segments
}

type Letter = fn() -> Vec<Vec<[f32; 2]>>;

fn letter_x() -> Vec<Vec<[f32; 2]>> {
    vec![vec![[-0.7, -1.0], [0.7, 1.0]], vec![[-0.7, 1.0], [0.7, -1.0]]]
}

fn letter_y() -> Vec<Vec<[f32; 2]>> {
    vec![vec![[-0.7, 1.0], [0.0, 0.1], [0.7, 1.0]], vec![[0.0, 0.1], [0.0, -1.0]]]
}

fn letter_z() -> Vec<Vec<[f32; 2]>> {
    vec![vec![[-0.7, 1.0], [0.7, 1.0], [-0.7, -1.0], [0.7, -1.0]]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_axis_points_along_itself_and_letters_face_the_camera() {
        let segments = segments(Vec3::X, Vec3::Z);
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            assert!(segments.iter().any(|s| s.from == Vec3::ZERO && s.to == axis));
        }
        let letters = segments.iter().filter(|s| s.from != Vec3::ZERO);
        for s in letters {
            assert!((s.from - s.to).y.abs() < 1e-6, "strokes lie in the picture plane");
        }
    }
}
