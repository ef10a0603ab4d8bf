//! Solids as signed distance fields: what the parametric parts are built from.
//!
//! A [`Solid`] is a list of steps (union, cut) over placed primitives ([`Shape`]), with smooth blends for cast fillets.
//! A field gives holes, ribs, teeth and fillets without any mesh booleans, is exact about inside and outside, and its
//! gradient is the surface normal [Hart 1996]. Units are millimetres; distances are negative inside.

use glam::{Mat3, Vec2, Vec3};

use super::datum::DatumSurface;
use super::shape::Shape;

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
    datums: Vec<(String, DatumSurface)>,
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

    /// Names one of its planes and cylinders; millimetres, the solid's frame.
    pub(super) fn datum(&mut self, name: impl Into<String>, surface: DatumSurface) {
        self.datums.push((name.into(), surface));
    }

    /// Those that were named.
    pub(super) fn datums(&self) -> &[(String, DatumSurface)] {
        &self.datums
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
        let near = self.steps.iter().filter(|s| s.distance(centre) < radius + s.blend);
        Solid { steps: near.cloned().collect(), datums: Vec::new() }
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
