//! Solids as signed distance fields: what the parametric parts are built from.
//!
//! A [`Solid`] is a list of steps (union, cut) over placed primitive [`Shape`]s, with smooth blends for cast fillets.
//! A field gives holes, ribs, teeth and fillets without any mesh booleans, is exact about inside and outside, and its
//! gradient is the surface normal (J. C. Hart, "Sphere tracing", 1996; 2D polygon distance after I. Quilez).
//! Units are millimetres; distances are negative inside.

use glam::{Mat3, Vec2, Vec3};

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

    fn distance(&self, p: Vec3) -> f32 {
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
    let Some(&last) = outline.last() else { return f32::INFINITY };
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

/// Where a shape stands in its solid, and how it joins what is there.
#[derive(Clone, Debug)]
pub(super) struct Step {
    shape: Shape,
    origin: Vec3,
    to_local: Mat3,
    copies: u32,
    offset: Vec3,
    to_inner: Mat3,
    blend: f32,
    slot: u8,
    cuts: bool,
}

impl Step {
    /// `shape` at the origin.
    pub(super) fn new(shape: Shape) -> Self {
        Self {
            shape,
            origin: Vec3::ZERO,
            to_local: Mat3::IDENTITY,
            copies: 1,
            offset: Vec3::ZERO,
            to_inner: Mat3::IDENTITY,
            blend: 0.0,
            slot: 0,
            cuts: false,
        }
    }

    /// Moves the shape (and the axis its copies stand around) to `origin`.
    pub(super) fn at(mut self, origin: Vec3) -> Self {
        self.origin = origin;
        self
    }

    /// Turns the shape and its copies: the columns of `axes` are its axes in the solid's frame.
    pub(super) fn turned(mut self, axes: Mat3) -> Self {
        self.to_local = axes.transpose();
        self
    }

    /// Sets the shape off its origin; with [`Step::around`] this is the radius of the circle of copies.
    pub(super) fn offset(mut self, offset: Vec3) -> Self {
        self.offset = offset;
        self
    }

    /// Turns each copy about its own centre.
    pub(super) fn tilted(mut self, axes: Mat3) -> Self {
        self.to_inner = axes.transpose();
        self
    }

    /// `copies` evenly about the z axis, the first at angle 0.
    pub(super) fn around(mut self, copies: u32) -> Self {
        self.copies = copies.max(1);
        self
    }

    /// Blends into what is there over this length.
    pub(super) fn blend(mut self, length: f32) -> Self {
        self.blend = length;
        self
    }

    /// The material slot of its surface; 0 is the body.
    pub(super) fn slot(mut self, slot: u8) -> Self {
        self.slot = slot;
        self
    }

    fn distance(&self, p: Vec3) -> f32 {
        let mut q = self.to_local * (p - self.origin);
        if self.copies > 1 {
            let sector = std::f32::consts::TAU / self.copies as f32;
            let angle = q.y.atan2(q.x);
            let turn = Vec2::from_angle(-sector * (angle / sector).round());
            q = turn.rotate(q.truncate()).extend(q.z);
        }
        self.shape.distance(self.to_inner * (q - self.offset))
    }
}

/// A solid: steps applied in order.
#[derive(Clone, Debug, Default)]
pub(super) struct Solid {
    steps: Vec<Step>,
}

impl Solid {
    /// Adds material.
    pub(super) fn add(&mut self, step: Step) {
        self.steps.push(step);
    }

    /// Takes material away.
    pub(super) fn cut(&mut self, mut step: Step) {
        step.cuts = true;
        self.steps.push(step);
    }

    /// Signed distance and material slot at `p`.
    pub(super) fn sample(&self, p: Vec3) -> (f32, u8) {
        fold(self.steps.iter(), p)
    }

    /// Signed distance at `p`.
    pub(super) fn distance(&self, p: Vec3) -> f32 {
        self.sample(p).0
    }

    /// The steps that can touch the surface within `radius` of `centre`: away from it a union or a cut changes no sign.
    pub(super) fn near(&self, centre: Vec3, radius: f32) -> Solid {
        let touches = |s: &&Step| s.distance(centre) < radius + s.blend;
        Solid { steps: self.steps.iter().filter(touches).cloned().collect() }
    }

    /// Outward unit normal at `p` (tetrahedral differences).
    pub(super) fn normal(&self, p: Vec3) -> Vec3 {
        const TIPS: [Vec3; 4] =
            [Vec3::new(1., -1., -1.), Vec3::new(-1., -1., 1.), Vec3::new(-1., 1., -1.), Vec3::new(1., 1., 1.)];
        TIPS.iter().map(|&t| t * self.distance(p + t * 0.05)).sum::<Vec3>().normalize_or(Vec3::Z)
    }
}

fn fold<'a>(steps: impl Iterator<Item = &'a Step>, p: Vec3) -> (f32, u8) {
    let (mut d, mut slot) = (f32::INFINITY, 0);
    for step in steps {
        let s = step.distance(p);
        if step.cuts {
            d = -blended_min(-d, s, step.blend);
        } else {
            if s < d {
                slot = step.slot;
            }
            d = blended_min(d, s, step.blend);
        }
    }
    (d, slot)
}

fn blended_min(a: f32, b: f32, k: f32) -> f32 {
    if k <= 0.0 || !a.is_finite() {
        return a.min(b);
    }
    let h = (k - (a - b).abs()).max(0.0) / k;
    a.min(b) - h * h * k * 0.25
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

    #[test]
    fn cutting_and_copies_change_inside_and_outside() {
        let mut s = Solid::default();
        s.add(Step::new(Shape::Cylinder { radius: 20.0, half: 5.0, fillet: 0.0 }));
        s.cut(Step::new(Shape::Cylinder { radius: 2.0, half: 9.0, fillet: 0.0 }).around(3).offset(Vec3::X * 12.0));
        assert!(s.distance(Vec3::new(0.0, 0.0, 0.0)) < 0.0);
        for k in 0..3 {
            let hole = Vec2::from_angle(k as f32 * std::f32::consts::TAU / 3.0) * 12.0;
            assert!(s.distance(hole.extend(0.0)) > 1.9);
        }
        let (near, p) = (s.near(Vec3::new(12.0, 0.0, 0.0), 3.0), Vec3::new(13.9, 0.0, 0.5));
        assert!((near.distance(p) - s.distance(p)).abs() < 1e-5);
    }
}
