//! The surface as the choice of photographs looks at it: a few hundred places on it, and which cameras see them.

use super::choice::{Candidate, Sample};
use crate::camera::OrbitCamera;
use crate::render::photograph_camera::PhotographCamera;
use glam::{Vec2, Vec3};
use semascan_geometry::occupancy::Occupancy;
use semascan_model::SemanticMesh;
use std::collections::BTreeMap;

/// Places at most.
const SAMPLES: usize = 700;

/// See the module.
pub(super) struct Surface {
    samples: Vec<Sample>,
    occupancy: Option<Occupancy>,
    /// Which samples a view's camera sees, for the cameras that were asked about.
    seen: BTreeMap<u32, (PhotographCamera, Vec<bool>)>,
}

impl Surface {
    /// * `voxel`: how far its vertices lie apart, metres.
    pub(super) fn of(mesh: &SemanticMesh, voxel: f32) -> Self {
        let vertices = &mesh.vertices;
        let every = (vertices.len() / SAMPLES).max(1);
        let all = vertices.positions.iter().zip(&vertices.normals).step_by(every);
        let sample = |(place, normal): (&[f32; 3], &[f32; 3])| Sample {
            place: Vec3::from(*place),
            normal: Vec3::from(*normal).normalize_or_zero(),
        };
        let occupancy = Occupancy::of(&vertices.positions, voxel.into());
        Self { samples: all.map(sample).collect(), occupancy, seen: BTreeMap::new() }
    }

    /// The samples that a camera has before it, by their numbers.
    pub(super) fn before(&self, camera: &OrbitCamera) -> Vec<usize> {
        let eye = camera.eye();
        let is_seen = |sample: &Sample| {
            let at = camera.project(sample.place);
            at.is_some_and(|(at, _)| at.cmpge(Vec2::ZERO).all() && at.cmple(camera.viewport()).all())
                && self.is_free(sample, eye)
        };
        (0..self.samples.len()).filter(|s| is_seen(&self.samples[*s])).collect()
    }

    /// Whether a sample faces `eye` and nothing lies between.
    fn is_free(&self, sample: &Sample, eye: Vec3) -> bool {
        let way = eye - sample.place;
        let (length, toward) = (way.length(), way.normalize_or_zero());
        let double = |v: Vec3| v.as_dvec3().to_array();
        let is_hidden = |surface: &Occupancy| {
            surface.is_hidden(double(sample.place), double(sample.normal), double(toward), length.into())
        };
        toward.dot(sample.normal) > 0.05 && !self.occupancy.as_ref().is_some_and(is_hidden)
    }

    /// Finds out which samples the cameras of these photographs see.
    pub(super) fn look(&mut self, candidates: &[Candidate]) {
        for candidate in candidates {
            let is_known = self.seen.get(&candidate.view).is_some_and(|(camera, _)| *camera == candidate.camera);
            if !is_known {
                let eye = candidate.camera.eye();
                let seen = self.samples.iter().map(|sample| self.is_free(sample, eye)).collect();
                self.seen.insert(candidate.view, (candidate.camera, seen));
            }
        }
    }

    /// Whether the camera of a view sees a sample; [`Surface::look`] has found it out.
    pub(super) fn is_seen(&self, view: u32, sample: usize) -> bool {
        self.seen.get(&view).is_some_and(|(_, seen)| seen.get(sample).copied().unwrap_or(false))
    }

    /// A sample.
    pub(super) fn sample(&self, number: usize) -> Sample {
        self.samples[number]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::features::photo::choice::choose;
    use semascan_model::{SemanticCloud, SemanticPoint};
    use semascan_protocol::{Intrinsics, Pose};

    /// A floor with a roof over one half of it.
    fn mesh() -> SemanticMesh {
        let point = |x: usize, y: usize, z: f32| SemanticPoint {
            position: [x as f32 * 2e-3, y as f32 * 2e-3, z],
            normal: [0.0, 0.0, 1.0],
            ..SemanticPoint::UNKNOWN
        };
        let floor = (0..2500).map(|i| point(i % 50, i / 50, 0.0));
        let roof = (0..2500).filter(|i| i % 50 >= 25).map(|i| point(i % 50, i / 50, 0.05));
        let vertices: SemanticCloud = floor.chain(roof).collect();
        let boundary = vec![false; vertices.len()];
        SemanticMesh { vertices, boundary, triangles: Vec::new() }
    }

    #[test]
    fn what_is_hidden_is_not_before_a_camera() {
        let mut surface = Surface::of(&mesh(), 2e-3);
        let mut camera = OrbitCamera::default();
        camera.set_viewport(800.0, 800.0);
        camera.look_at(Vec3::new(0.05, 0.04, 0.5), Vec3::new(0.05, 0.05, 0.0));
        let before = surface.before(&camera);
        let is_under = |sample: &Sample| sample.place.z < 0.01 && sample.place.x > 0.06;
        let samples: Vec<Sample> = before.iter().map(|s| surface.sample(*s)).collect();
        assert!(samples.len() > 100 && !samples.iter().any(is_under), "{}", samples.len());
        let pose = Pose { qx: 1.0, tx: 0.05, ty: 0.05, tz: 0.5, ..Pose::default() };
        let intrinsics = Intrinsics { width: 640, height: 480, fx: 600.0, fy: 600.0, cx: 319.5, cy: 239.5 };
        let above = PhotographCamera::from_wire(&pose, &intrinsics).expect("a camera");
        let candidates = [Candidate { view: 4, camera: above, quality: 1.0 }];
        surface.look(&candidates);
        assert_eq!(choose(&candidates, &samples, |_, s| surface.is_seen(4, before[s]), camera.eye(), 3), [0]);
        let under: Vec<usize> = (0..surface.samples.len()).filter(|s| is_under(&surface.sample(*s))).collect();
        assert!(!under.is_empty() && !under.iter().any(|s| surface.is_seen(4, *s)));
        assert!(!surface.is_seen(5, 0), "nobody looked");
    }
}
