//! Perspective cameras that show the whole part from a named direction, or one place on it.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use semascan_perception::view::Intrinsics;

/// Half the angle of view along the shorter edge of a picture of the whole part, as its tangent: about 12 degrees, so that
/// parallel edges stay nearly parallel.
const HALF_VIEW: f64 = 0.21;
/// Part of the picture that the part fills.
const FILLED: f64 = 0.9;

/// A camera at its place.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    /// Its picture.
    pub intrinsics: Intrinsics,
    /// Where it stands: optical frame, x right, y down, z forward.
    pub table_from_camera: Isometry3<f64>,
}

/// Where a fixed view looks from, in the table frame (z up).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// From front, right and above.
    Isometric,
    /// From -y.
    Front,
    /// From +x.
    Right,
    /// From +y.
    Back,
    /// From -x.
    Left,
    /// From +z; +y is up in the picture.
    Top,
    /// From -z; +y is down in the picture.
    Bottom,
}

impl Direction {
    /// For people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Isometric => "isometric",
            Self::Front => "front (from -y)",
            Self::Right => "right (from +x)",
            Self::Back => "back (from +y)",
            Self::Left => "left (from -x)",
            Self::Top => "top (from +z)",
            Self::Bottom => "bottom (from -z)",
        }
    }

    /// Unit vector from the part to the camera, and what is up in the picture.
    pub fn axes(self) -> (Vector3<f64>, Vector3<f64>) {
        let (toward, up) = match self {
            Self::Isometric => (Vector3::new(1.0, -1.0, 0.8), Vector3::z()),
            Self::Front => (-Vector3::y(), Vector3::z()),
            Self::Right => (Vector3::x(), Vector3::z()),
            Self::Back => (Vector3::y(), Vector3::z()),
            Self::Left => (-Vector3::x(), Vector3::z()),
            Self::Top => (Vector3::z(), Vector3::y()),
            Self::Bottom => (-Vector3::z(), -Vector3::y()),
        };
        (toward.normalize(), up)
    }
}

/// A place that a picture shows, and how far around it.
#[derive(Clone, Copy, Debug)]
pub struct Framing {
    /// The place, table frame, metres.
    pub centre: Point3<f64>,
    /// Half of the shorter edge of the picture there, metres.
    pub half_extent: f64,
    /// Distance of the camera, metres.
    pub distance: f64,
}

impl Camera {
    /// A camera that sees all of `points` (table frame, metres) from `toward`, in a picture of `width` by `height` pixels; `None`
    /// without points.
    pub fn of_all(
        points: &[[f32; 3]],
        (toward, up): (Vector3<f64>, Vector3<f64>),
        (width, height): (u32, u32),
    ) -> Option<Self> {
        let turn = rotation(&toward, &up);
        let (mut low, mut high) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        let camera_from_table = turn.inverse().to_rotation_matrix().into_inner();
        let turned = |p: &[f32; 3]| camera_from_table * Vector3::from(p.map(f64::from));
        for p in points.iter().filter(|p| p.iter().all(|c| c.is_finite())) {
            let q = turned(p);
            (low, high) = (low.inf(&q), high.sup(&q));
        }
        if low.x > high.x {
            return None;
        }
        let centre = (low + high) / 2.0;
        let [tangent_x, tangent_y] = half_tangents((width, height), HALF_VIEW).map(|t| t * FILLED);
        // Every point lies within the picture: its offset by its depth is at most the tangent.
        let mut distance = 1e-3_f64;
        for p in points.iter().filter(|p| p.iter().all(|c| c.is_finite())) {
            let q = turned(p) - centre;
            distance = distance.max(-q.z + (q.x.abs() / tangent_x).max(q.y.abs() / tangent_y));
        }
        let eye = turn * (centre - Vector3::new(0.0, 0.0, distance));
        Some(Self {
            intrinsics: pinhole((width, height), HALF_VIEW),
            table_from_camera: Isometry3::from_parts(eye.into(), turn),
        })
    }

    /// A camera that looks at one place from `toward`.
    pub fn at(framing: &Framing, (toward, up): (Vector3<f64>, Vector3<f64>), size: (u32, u32)) -> Self {
        let turn = rotation(&toward, &up);
        let eye = framing.centre.coords - turn * Vector3::new(0.0, 0.0, framing.distance);
        Self {
            intrinsics: pinhole(size, framing.half_extent / framing.distance),
            table_from_camera: Isometry3::from_parts(eye.into(), turn),
        }
    }

    /// Pixel and depth of a point of the table frame; `None` behind the camera.
    pub fn project(&self, point: &[f64; 3]) -> Option<(f64, f64, f64)> {
        let p = self.table_from_camera.inverse_transform_point(&Point3::from(*point));
        self.intrinsics.project(&p).map(|(u, v)| (u, v, p.z))
    }

    /// Edge of a pixel at the depth of `point`, metres; `None` behind the camera.
    pub fn footprint(&self, point: &[f64; 3]) -> Option<f64> {
        self.project(point).map(|(.., z)| self.intrinsics.footprint(z))
    }
}

/// Rotation of a camera whose picture shows what lies in the direction `-toward`, with `up` upwards.
fn rotation(toward: &Vector3<f64>, up: &Vector3<f64>) -> UnitQuaternion<f64> {
    let forward = -toward.normalize();
    // Where the direction of view is that of up, another one has to do.
    let up = if forward.cross(up).norm() > 1e-6 * up.norm() { *up } else { forward.yzx() };
    UnitQuaternion::face_towards(&forward, &-up)
}

/// Tangents of half the angle of view along both edges.
fn half_tangents((width, height): (u32, u32), shorter: f64) -> [f64; 2] {
    let least = f64::from(width.min(height).max(1));
    [width, height].map(|size| shorter * f64::from(size) / least)
}

fn pinhole((width, height): (u32, u32), half_tangent: f64) -> Intrinsics {
    let f = f64::from(width.min(height)) / (2.0 * half_tangent);
    let middle = |size: u32| (f64::from(size) - 1.0) / 2.0;
    Intrinsics { width, height, fx: f, fy: f, cx: middle(width), cy: middle(height) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_points_lie_in_the_picture_and_up_is_up() {
        let points: Vec<[f32; 3]> = (0..8).map(|i| [i & 1, i >> 1 & 1, i >> 2].map(|bit| bit as f32 * 0.1)).collect();
        use Direction::{Back, Bottom, Front, Isometric, Left, Right, Top};
        for direction in [Isometric, Front, Right, Back, Left, Top, Bottom] {
            let camera = Camera::of_all(&points, direction.axes(), (200, 120)).expect("points");
            let seen: Vec<(f64, f64, f64)> =
                points.iter().map(|p| camera.project(&p.map(f64::from)).expect("ahead")).collect();
            let (mut low, mut high) = ((f64::MAX, f64::MAX), (f64::MIN, f64::MIN));
            for (u, v, _) in &seen {
                low = (low.0.min(*u), low.1.min(*v));
                high = (high.0.max(*u), high.1.max(*v));
            }
            assert!(low.0 > 0.0 && low.1 > 0.0 && high.0 < 199.0 && high.1 < 119.0, "{direction:?}: {low:?} {high:?}");
            assert!(high.1 - low.1 > 60.0, "{direction:?} fills the picture: {low:?} {high:?}");
            if !matches!(direction, Top | Bottom) {
                // Point 4 lies above point 0.
                assert!(seen[4].1 < seen[0].1 - 1.0, "{direction:?}");
            }
        }
        // From the front x grows to the right, from the back to the left.
        let front = Camera::of_all(&points, Front.axes(), (200, 120)).expect("points");
        let u = |camera: &Camera, p: [f64; 3]| camera.project(&p).expect("ahead").0;
        assert!(u(&front, [0.1, 0.0, 0.0]) > u(&front, [0.0; 3]));
        let back = Camera::of_all(&points, Back.axes(), (200, 120)).expect("points");
        assert!(u(&back, [0.1, 0.0, 0.0]) < u(&back, [0.0; 3]));
        assert!(Camera::of_all(&[[f32::NAN; 3]], Front.axes(), (200, 120)).is_none());
    }

    #[test]
    fn a_place_is_in_the_middle_at_the_wanted_size() {
        let framing = Framing { centre: Point3::new(0.1, 0.2, 0.3), half_extent: 0.01, distance: 0.5 };
        let camera = Camera::at(&framing, (Vector3::z(), Vector3::z()), (300, 200));
        let (u, v, z) = camera.project(&[0.1, 0.2, 0.3]).expect("ahead");
        assert!((u - 149.5).abs() < 1e-9 && (v - 99.5).abs() < 1e-9 && (z - 0.5).abs() < 1e-12);
        assert!((camera.footprint(&[0.1, 0.2, 0.3]).expect("ahead") - 1e-4).abs() < 1e-12);
    }
}
