//! The parts that stand on a simulated turntable: simple shapes, some of which look alike from many sides.

use glam::{Mat3, Vec2, Vec3};

use super::TurntablePart;
use crate::part::{SceneMesh, Tag};
use crate::random::Stream;

/// Class of the part.
pub(super) const PART: u16 = 1;

/// A mesh that grows by simple solids, millimetres.
#[derive(Debug, Default)]
pub(super) struct Solids {
    pub(super) mesh: SceneMesh,
}

impl Solids {
    /// A box between two corners, turned by `turn` and then shifted by `shift`.
    pub(super) fn add_box(&mut self, low: Vec3, high: Vec3, turn: Mat3, shift: Vec3, tag: Tag) {
        let corner = |i: usize| {
            let pick = |bit: usize, a: f32, b: f32| if i >> bit & 1 == 0 { a } else { b };
            Vec3::new(pick(0, low.x, high.x), pick(1, low.y, high.y), pick(2, low.z, high.z))
        };
        // Each face counter-clockwise seen from outside.
        for [a, b, c, d] in [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]] {
            let quad = [a, b, c, d].map(|i| turn * corner(i) + shift);
            let normal = (quad[1] - quad[0]).cross(quad[2] - quad[0]).normalize_or(Vec3::Z);
            self.push(&quad, &[normal; 4], tag);
        }
    }

    /// An upright prism with `sides` sides about the point `at`, from `low` to `high`; `radius` of a side by its number.
    /// A round one has the normals of a cylinder.
    pub(super) fn add_prism(
        &mut self,
        at: Vec3,
        (low, high): (f32, f32),
        sides: usize,
        radius: impl Fn(usize) -> f32,
        round: bool,
        tag: Tag,
    ) {
        let angle = |i: usize| std::f32::consts::TAU * i as f32 / sides as f32;
        let out = |i: usize| Vec3::new(angle(i).cos(), angle(i).sin(), 0.0);
        let rim = |i: usize, z: f32| at + out(i) * radius(i % sides) + Vec3::Z * z;
        for i in 0..sides {
            let quad = [rim(i, low), rim(i + 1, low), rim(i + 1, high), rim(i, high)];
            let face = (quad[1] - quad[0]).cross(quad[2] - quad[0]).normalize_or(Vec3::X);
            let normals = if round { [out(i), out(i + 1), out(i + 1), out(i)] } else { [face; 4] };
            self.push(&quad, &normals, tag);
            let top = [at + Vec3::Z * high, rim(i, high), rim(i + 1, high)];
            self.push(&top, &[Vec3::Z; 3], tag);
        }
    }

    /// A convex face as a fan.
    fn push(&mut self, corners: &[Vec3], normals: &[Vec3], tag: Tag) {
        let first = self.mesh.vertices.len() as u32;
        self.mesh.vertices.extend(corners.iter().map(|c| (*c * 1e-3).to_array()));
        for i in 1..corners.len() as u32 - 1 {
            self.mesh.triangles.push([first, first + i, first + i + 1]);
            self.mesh.normals.push([normals[0], normals[i as usize], normals[i as usize + 1]]);
            self.mesh.uvs.push([Vec2::ZERO; 3]);
            self.mesh.tags.push(tag);
        }
    }
}

/// The part of `kind`, standing on z = 0; its finish is that of `tag`. Sizes and place vary with `s`.
pub(super) fn build(kind: TurntablePart, s: &mut Stream, tag: Tag) -> Solids {
    let mut out = Solids::default();
    let scale = s.range(0.85, 1.15);
    let turn = Mat3::from_rotation_z(s.range(0.0, std::f32::consts::TAU));
    let shift = Vec3::new(s.range(-18.0, 18.0), s.range(-18.0, 18.0), 0.0);
    let block = |out: &mut Solids, low: [f32; 3], high: [f32; 3]| {
        out.add_box(Vec3::from_array(low) * scale, Vec3::from_array(high) * scale, turn, shift, tag);
    };
    let at = |p: [f32; 3]| turn * (Vec3::from_array(p) * scale) + shift;
    match kind {
        TurntablePart::Bracket => {
            block(&mut out, [-50.0, -30.0, 0.0], [50.0, 30.0, 14.0]);
            block(&mut out, [-50.0, -30.0, 14.0], [-34.0, 30.0, 80.0]);
            block(&mut out, [20.0, -26.0, 14.0], [46.0, -4.0, 46.0]);
            out.add_prism(at([14.0, 14.0, 14.0]), (0.0, 34.0 * scale), 32, |_| 11.0 * scale, true, tag);
        }
        TurntablePart::Mug => {
            out.add_prism(at([0.0; 3]), (0.0, 90.0 * scale), 48, |_| 38.0 * scale, true, tag);
            block(&mut out, [36.0, -6.0, 18.0], [62.0, 6.0, 30.0]);
            block(&mut out, [36.0, -6.0, 60.0], [62.0, 6.0, 72.0]);
            block(&mut out, [52.0, -6.0, 30.0], [62.0, 6.0, 60.0]);
        }
        TurntablePart::Can => out.add_prism(at([0.0; 3]), (0.0, 110.0 * scale), 48, |_| 36.0 * scale, true, tag),
        TurntablePart::Carton => block(&mut out, [-45.0, -28.0, 0.0], [45.0, 28.0, 95.0]),
        TurntablePart::Gear => {
            let tooth = |i: usize| if i % 4 < 2 { 52.0 * scale } else { 40.0 * scale };
            out.add_prism(at([0.0; 3]), (0.0, 30.0 * scale), 48, tooth, false, tag);
            out.add_prism(at([0.0; 3]), (30.0 * scale, 60.0 * scale), 48, |_| 16.0 * scale, true, tag);
        }
        TurntablePart::Motor => {}
    }
    out
}
