//! A parametric used starter motor: five components as [Remanufacturing paper] labels them, clamped upright in a chuck.

mod body;
mod drive_end;
mod electrical;
pub(super) mod fixture;
mod parameters;

use glam::Vec3;
use rayon::prelude::*;

use super::dual_contour::{self, NetMesh};
use super::solid::Solid;
use parameters::Parameters;

/// Material slot of bolts, nuts, studs and bare inserts; slot 0 is a component's body.
pub(super) const FASTENER: u8 = 1;
/// Material slot of plates, plastics and rubber.
pub(super) const DETAIL: u8 = 2;

/// Names of the components, in the order of their classes from 1 ([Remanufacturing paper], "Dataset generation").
pub(super) const COMPONENTS: [&str; 5] = ["housing", "solenoid", "carrier", "gear", "electrical connection"];
/// Names of the defects, in the order of their classes from 1.
pub(super) const DEFECTS: [&str; 3] = ["corrosion", "wear", "crack"];

/// A component: class, field and mesh, in millimetres in the part's frame (axis +z, rear end at z = 0).
#[derive(Clone, Debug)]
pub(super) struct Component {
    /// Component class; 0 for what holds the part.
    pub(super) class: u16,
    pub(super) solid: Solid,
    pub(super) mesh: NetMesh,
}

/// A starter motor and its chuck.
#[derive(Clone, Debug)]
pub(super) struct StarterMotor {
    /// The five components, then the chuck.
    pub(super) components: Vec<Component>,
    /// A line about what was drawn.
    pub(super) description: String,
    /// Where the pinion's teeth are: z of rear face, z of front face, tip radius.
    pub(super) pinion: (f32, f32, f32),
}

impl StarterMotor {
    /// The motor of `seed`, meshed with cells of `cell` millimetres (gear and terminals twice as fine).
    pub(super) fn new(seed: u64, cell: f32) -> Self {
        let p = Parameters::draw(seed);
        let parts: [(u16, Solid, f32); 6] = [
            (1, body::housing(&p, seed), cell),
            (2, body::solenoid(&p, seed), cell),
            (3, drive_end::carrier(&p, seed), cell),
            (4, drive_end::gear(&p, seed), 0.5 * cell),
            (5, electrical::electrical(&p, seed), 0.6 * cell),
            (0, fixture::chuck(p.cover_radius), 1.5 * cell),
        ];
        let reach = p.solenoid_offset + p.solenoid_radius + 60.0;
        let min = Vec3::new(-reach, -reach, -fixture::CHUCK_HEIGHT - 3.0);
        let max = Vec3::new(reach, reach, p.nose_end() + p.face_width + 20.0);
        let mut components: Vec<Component> = parts
            .into_par_iter()
            .map(|(class, solid, cell)| Component { class, mesh: dual_contour::mesh(&solid, min, max, cell), solid })
            .collect();
        let hidden: Vec<Vec<bool>> =
            (0..components.len()).into_par_iter().map(|i| hidden_vertices(&components, i)).collect();
        for (component, hidden) in components.iter_mut().zip(hidden) {
            component.mesh.triangles.retain(|t| !t.iter().all(|&v| hidden[v as usize]));
        }
        let description = format!(
            "{:.0} x {:.0} mm yoke, {} pinion of {} teeth",
            2.0 * p.yoke_radius,
            p.yoke_length,
            if p.overhung { "overhung" } else { "enclosed" },
            p.teeth
        );
        let pinion = (p.pinion_start(), p.pinion_start() + p.face_width, p.tip_radius());
        Self { components, description, pinion }
    }
}

/// Which vertices of component `i` lie inside another one, where no ray can reach them.
fn hidden_vertices(components: &[Component], i: usize) -> Vec<bool> {
    /// Millimetres a surface may dip into another before it counts as inside: joints stay closed.
    const DIP: f32 = 0.3;
    let others: Vec<(&Solid, Vec3, Vec3)> = components
        .iter()
        .enumerate()
        .filter(|(j, _)| *j != i)
        .map(|(_, c)| {
            let start = (Vec3::INFINITY, Vec3::NEG_INFINITY);
            let (low, high) = c.mesh.positions.iter().fold(start, |(l, h), &p| (l.min(p), h.max(p)));
            (&c.solid, low, high)
        })
        .collect();
    components[i]
        .mesh
        .positions
        .iter()
        .map(|p| {
            others
                .iter()
                .any(|(solid, low, high)| p.cmpge(*low).all() && p.cmple(*high).all() && solid.distance(*p) < -DIP)
        })
        .collect()
}
