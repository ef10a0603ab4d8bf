//! Primitive shapes and their signed distances: the bricks of a solid.
//!
//! The 2D polygon's distance is after I. Quilez ("2D distance functions"). Millimetres; negative inside.

use glam::{Vec2, Vec3};

/// A primitive in its own frame, the axis along +z where it has one.
#[derive(Clone, Debug)]
pub(super) enum Shape {
    /// Half edges and rounding of the edges.
    Block { half: Vec3, fillet: f32 },
    /// Radius, half height and rounding of the rims.
    Cylinder { radius: f32, half: f32, fillet: f32 },
    /// A closed outline in (radius, z), turned about z.
    Revolved { outline: Vec<Vec2> },
    /// A closed outline in (x, y), extended to `half` both ways.
    Extruded { outline: Vec<Vec2>, half: f32, fillet: f32 },
    /// A piece of a cylinder's shell, centred on +x: a label or a band.
    Plate { radius: f32, half_thickness: f32, half_angle: f32, half: f32, fillet: f32 },
    /// A round tube along a path.
    Tube { path: Vec<Vec3>, radius: f32 },
    /// A ring about z.
    Torus { major: f32, minor: f32 },
}

impl Shape {
    /// A turned part from (radius, z) corners in order; a corner with radius 0 lies on the axis.
    pub(super) fn turned(corners: &[(f32, f32)]) -> Self {
        // The axis is no surface: corners on it move beyond it, where no point of the half plane comes near.
        let outline = corners.iter().map(|&(r, z)| Vec2::new(if r <= 0.0 { -20.0 } else { r }, z)).collect();
        Self::Revolved { outline }
    }

    /// A prism of `sides` with the given radius across the flats.
    pub(super) fn prism(sides: u32, across_flats: f32, half: f32, fillet: f32) -> Self {
        let step = std::f32::consts::TAU / sides as f32;
        let radius = (across_flats - fillet) / (0.5 * step).cos();
        let outline = (0..sides).map(|i| Vec2::from_angle(i as f32 * step) * radius).collect();
        Self::Extruded { outline, half, fillet }
    }

    /// Signed distance of `p`, in the shape's frame.
    pub(super) fn distance(&self, p: Vec3) -> f32 {
        match self {
            Self::Block { half, fillet } => {
                let q = p.abs() - *half + Vec3::splat(*fillet);
                q.max(Vec3::ZERO).length() + q.max_element().min(0.0) - fillet
            }
            Self::Cylinder { radius, half, fillet } => {
                extrude(p.truncate().length() - radius + fillet, p.z.abs() - half + fillet) - fillet
            }
            Self::Revolved { outline } => polygon(outline, Vec2::new(p.truncate().length(), p.z)),
            Self::Extruded { outline, half, fillet } => {
                extrude(polygon(outline, p.truncate()), p.z.abs() - half + fillet) - fillet
            }
            Self::Plate { radius, half_thickness, half_angle, half, fillet } => {
                let r = p.truncate().length();
                let across = (p.y.atan2(p.x).abs() - half_angle) * r.min(*radius);
                let q = Vec3::new((r - radius).abs() - half_thickness, across, p.z.abs() - half) + Vec3::splat(*fillet);
                q.max(Vec3::ZERO).length() + q.max_element().min(0.0) - fillet
            }
            Self::Tube { path, radius } => {
                path.windows(2).fold(f32::INFINITY, |d, s| d.min(segment(p, s[0], s[1]))) - radius
            }
            Self::Torus { major, minor } => Vec2::new(p.truncate().length() - major, p.z).length() - minor,
        }
    }
}

fn extrude(across: f32, along: f32) -> f32 {
    across.max(along).min(0.0) + Vec2::new(across, along).max(Vec2::ZERO).length()
}

/// Distance of `p` to the segment `a`, `b`.
pub(super) fn segment(p: Vec3, a: Vec3, b: Vec3) -> f32 {
    let (ab, ap) = (b - a, p - a);
    (ap - ab * (ap.dot(ab) / ab.length_squared().max(1e-9)).clamp(0.0, 1.0)).length()
}

fn polygon(outline: &[Vec2], p: Vec2) -> f32 {
    let Some(&last) = outline.last() else {
        return f32::INFINITY;
    };
    let (mut nearest, mut sign, mut previous) = (f32::INFINITY, 1.0_f32, last);
    for &corner in outline {
        let (edge, w) = (previous - corner, p - corner);
        let off = w - edge * (w.dot(edge) / edge.length_squared().max(1e-9)).clamp(0.0, 1.0);
        nearest = nearest.min(off.length_squared());
        let (above, below, left) = (p.y >= corner.y, p.y < previous.y, edge.x * w.y > edge.y * w.x);
        if above == below && below == left {
            sign = -sign;
        }
        previous = corner;
    }
    sign * nearest.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn primitives_measure_distance() {
        let p = Vec3::new(7.0, 0.0, 0.0);
        let close = |s: Shape, d: f32| assert!((s.distance(p) - d).abs() < 1e-4, "{s:?}: {}", s.distance(p));
        close(Shape::Block { half: Vec3::splat(5.0), fillet: 1.0 }, 2.0);
        close(Shape::Cylinder { radius: 5.0, half: 3.0, fillet: 0.5 }, 2.0);
        close(Shape::turned(&[(0.0, -2.0), (4.0, -2.0), (4.0, 2.0), (0.0, 2.0)]), 3.0);
        close(Shape::Torus { major: 5.0, minor: 1.0 }, 1.0);
        close(Shape::Tube { path: vec![Vec3::NEG_Z, Vec3::Z], radius: 2.0 }, 5.0);
        let on_axis = Shape::turned(&[(0.0, -2.0), (4.0, -2.0), (4.0, 2.0), (0.0, 2.0)]).distance(Vec3::ZERO);
        assert!((on_axis + 2.0).abs() < 1e-4, "the axis is no surface: {on_axis}");
    }
}
