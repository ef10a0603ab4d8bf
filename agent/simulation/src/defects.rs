//! Defects of a used part as functions of the surface point: corrosion patches, wear, cracks.
//!
//! The label is a function of position alone, so pictures, per-pixel truth and per-vertex truth agree exactly.
//! Corrosion is a noise-edged patch, wear is polished metal where parts rub, a crack is a thin polyline that walks over
//! the surface of one component. Part's frame, millimetres.

use glam::Vec3;

use super::appearance::Appearance;
use super::noise::{Noise, smoothstep};
use super::random::Stream;
use super::shape::segment;
use super::starter_motor::{Component, StarterMotor};

/// Defect classes.
pub(super) const CORROSION: u16 = 1;
/// See [`CORROSION`].
pub(super) const WEAR: u16 = 2;
/// See [`CORROSION`].
pub(super) const CRACK: u16 = 3;

#[derive(Clone, Debug)]
struct Patch {
    centre: Vec3,
    radius: f32,
}

#[derive(Clone, Debug)]
struct Crack {
    class: u16,
    points: Vec<Vec3>,
    half_width: f32,
    low: Vec3,
    high: Vec3,
}

/// All defects of one part.
#[derive(Clone, Debug)]
pub(super) struct Defects {
    corrosion: Vec<Patch>,
    scuffs: Vec<Patch>,
    /// Worn teeth: rear and front face of the pinion and the radius above which they are bright.
    teeth: Option<(f32, f32, f32)>,
    cracks: Vec<Crack>,
    /// What rust's colour is multiplied with.
    tint: Vec3,
    noise: Noise,
}

impl Defects {
    /// A part without any.
    pub(super) fn none() -> Self {
        Self {
            corrosion: Vec::new(),
            scuffs: Vec::new(),
            teeth: None,
            cracks: Vec::new(),
            tint: Vec3::ONE,
            noise: Noise::new(0),
        }
    }

    /// The defects of a starter motor.
    pub(super) fn draw(motor: &StarterMotor, seed: u64) -> Self {
        let mut s = Stream::new(seed, "defects");
        let parts: Vec<&Component> = motor.components.iter().filter(|c| c.class != 0).collect();
        let spots = |s: &mut Stream, n: u32, low: f32, high: f32| -> Vec<Patch> {
            (0..n)
                .filter_map(|_| Some(Patch { centre: surface_point(&parts, s)?.1, radius: s.range(low, high) }))
                .collect()
        };
        let n = s.count(3, 8);
        let corrosion = spots(&mut s, n, 8.0, 26.0);
        let n = s.count(2, 5);
        let scuffs = spots(&mut s, n, 5.0, 13.0);
        let (rear, front, tip) = motor.pinion;
        let teeth = s.chance(0.7).then(|| (rear, front, tip - s.range(0.8, 2.2)));
        let n = s.count(1, 4);
        let cracks = (0..n).filter_map(|_| crack(&parts, &mut s)).collect();
        Self { corrosion, scuffs, teeth, cracks, tint: Vec3::ONE, noise: Noise::new(s.word()) }
    }

    /// The same defects with rust of another shade: its colour is multiplied with `tint`, at most 1.5.
    pub(super) fn tinted(mut self, tint: Vec3) -> Self {
        self.tint = tint;
        self
    }

    /// The defect class at `p` on component `class`; 0 = none.
    pub(super) fn class_at(&self, p: Vec3, class: u16) -> u16 {
        if class == 0 {
            0
        } else if self.cracks.iter().any(|c| c.class == class && c.holds(p)) {
            CRACK
        } else if self.patch_at(&self.corrosion, p, 0.16) {
            CORROSION
        } else if self.is_worn(p, class) {
            WEAR
        } else {
            0
        }
    }

    fn patch_at(&self, patches: &[Patch], p: Vec3, frequency: f32) -> bool {
        patches.iter().any(|c| {
            let near = 1.0 - c.centre.distance(p) / c.radius;
            near > -0.6 && near + 0.75 * self.noise.fbm(p * frequency + c.centre, 3) > 0.28
        })
    }

    fn is_worn(&self, p: Vec3, class: u16) -> bool {
        let on_teeth = class == 4
            && self.teeth.is_some_and(|(rear, front, radius)| {
                let reach = radius + 0.7 * self.noise.at(p * 0.35);
                (rear - 1.0..front + 1.0).contains(&p.z) && p.truncate().length() > reach
            });
        // Scuffs are made of strokes: the noise is stretched along one direction.
        on_teeth
            || self.scuffs.iter().any(|c| {
                let near = 1.0 - c.centre.distance(p) / c.radius;
                let along = Vec3::new(c.centre.y, -c.centre.x, 0.35 * c.radius).normalize_or(Vec3::X);
                let q = p - along * (p.dot(along) * 0.86);
                near > 0.0 && near + 0.7 * self.noise.at(q * 0.75 + c.centre) > 0.25
            })
    }

    /// Gives `a` the look of defect `class` at `p`.
    pub(super) fn paint(&self, class: u16, a: &mut Appearance, p: Vec3) {
        match class {
            CORROSION => {
                let (fine, broad) = (self.noise.at(p * 0.8), self.noise.fbm(p * 0.25, 2));
                let dark = Vec3::new(0.075, 0.028, 0.014);
                let bright = Vec3::new(0.36, 0.135, 0.040);
                a.base = dark.lerp(bright, smoothstep(-0.6, 0.8, 0.6 * broad + 0.6 * fine)) * self.tint;
                a.metallic = 0.0;
                a.roughness = 0.92;
                a.bump += Vec3::new(fine, self.noise.at(p * 0.8 + 40.0), broad) * 0.22;
            }
            WEAR => {
                let stroke = self.noise.at(p * Vec3::new(0.6, 0.6, 3.0));
                a.base = Vec3::new(0.66, 0.65, 0.63) * (1.0 + 0.12 * stroke);
                a.metallic = 1.0;
                a.roughness = 0.30 + 0.06 * stroke;
                a.bump *= 0.3;
            }
            CRACK => {
                a.base = Vec3::splat(0.006);
                a.metallic = 0.0;
                a.roughness = 0.95;
                a.bump = Vec3::ZERO;
            }
            _ => {}
        }
    }
}

impl Crack {
    fn holds(&self, p: Vec3) -> bool {
        if p.cmplt(self.low).any() || p.cmpgt(self.high).any() {
            return false;
        }
        let last = self.points.len().saturating_sub(1).max(1) as f32;
        self.points.windows(2).enumerate().any(|(i, s)| {
            // Widest where it began, a hair at its end.
            let width = self.half_width * (1.0 - 0.75 * i as f32 / last);
            segment(p, s[0], s[1]) < width
        })
    }
}

/// A random visible surface point: its component and position.
fn surface_point<'a>(parts: &[&'a Component], s: &mut Stream) -> Option<(&'a Component, Vec3)> {
    let part = *parts.get(s.index(parts.len()))?;
    let triangle = part.mesh.triangles.get(s.index(part.mesh.triangles.len()))?;
    Some((part, part.mesh.positions[triangle[0] as usize]))
}

/// A walk over a component's surface: along a tangent, drawn back to the surface, turned a little, and on.
fn crack(parts: &[&Component], s: &mut Stream) -> Option<Crack> {
    let (part, start) = surface_point(parts, s)?;
    let (mut p, steps, stride) = (start, s.count(10, 30), 1.6);
    let tilt = Vec3::new(s.range(-1.0, 1.0), s.range(-1.0, 1.0), s.range(-1.0, 1.0));
    let mut heading = tilt;
    let mut points = vec![p];
    for _ in 0..steps {
        let normal = part.solid.normal(p);
        heading = heading - normal * heading.dot(normal);
        heading = heading.normalize_or(normal.any_orthonormal_vector());
        let turn = s.normal(0.45) as f32;
        heading = heading * turn.cos() + normal.cross(heading) * turn.sin();
        p += heading * stride;
        for _ in 0..3 {
            p -= part.solid.normal(p) * part.solid.distance(p);
        }
        points.push(p);
    }
    let half_width = s.range(0.55, 0.95);
    let bounds = points.iter().fold((start, start), |(l, h), &q| (l.min(q), h.max(q)));
    let margin = Vec3::splat(half_width);
    Some(Crack { class: part.class, points, half_width, low: bounds.0 - margin, high: bounds.1 + margin })
}
