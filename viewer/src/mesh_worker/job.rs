//! What the mesh worker does: a state machine that takes requests and works a little at a time.

use super::message::{DeviationFigures, ReferenceInfo, Reply, Request};
use super::placement::{Extent, Mismatch};
use super::reference::Reference;
use crate::opened::{OpenError, OpenedFile, OpenedModel};
use semascan_geometry::measure::percentile;
use semascan_geometry::mesh::{MeshOptions, Mesher};
use semascan_model::SemanticCloud;
use std::sync::Arc;

/// Tiles meshed in one go: some milliseconds.
const TILES: usize = 8;
/// Vertices compared in one go.
const VERTICES: usize = 20_000;

/// The worker's work.
#[derive(Debug, Default)]
pub struct Job {
    mesher: Option<(f32, Mesher)>,
    /// Tiles of the meshing in progress.
    meshing: Option<usize>,
    reference: Option<Reference>,
    /// Vertices of the last mesh, and those compared so far.
    vertices: Vec<[f32; 3]>,
    compared: Option<Vec<f32>>,
}

impl Job {
    /// Takes a request; what there is to reply at once.
    pub fn handle(&mut self, request: Request) -> Vec<Reply> {
        match request {
            Request::Clear => {
                self.mesher = None;
                self.meshing.take().map(|_| Reply::Cancelled).into_iter().collect()
            }
            Request::Chunk { id, voxel, cloud } => {
                // A voxel of another size belongs to another model.
                if self.mesher.as_ref().is_none_or(|(of_mesher, _)| *of_mesher != voxel) {
                    match Mesher::new(voxel, MeshOptions::default()) {
                        Ok(mesher) => self.mesher = Some((voxel, mesher)),
                        Err(error) => return vec![Reply::Failed(error.to_string())],
                    }
                }
                if let Some((_, mesher)) = &mut self.mesher {
                    mesher.set_chunk(id, &cloud);
                }
                Vec::new()
            }
            Request::Gone(id) => {
                if let Some((_, mesher)) = &mut self.mesher {
                    mesher.set_chunk(id, &SemanticCloud::default());
                }
                Vec::new()
            }
            Request::Mesh => {
                let total = self.mesher.as_ref().map_or(0, |(_, mesher)| mesher.pending());
                self.meshing = Some(total);
                vec![Reply::Progress { done: 0, total: total as u32 }]
            }
            Request::Cancel => self.meshing.take().map(|_| Reply::Cancelled).into_iter().collect(),
            Request::Reference { name, unit, bytes } => match Reference::read(&name, &bytes, unit) {
                Ok(reference) => {
                    let info = ReferenceInfo {
                        name,
                        triangles: reference.triangles as u32,
                        points: reference.points as u32,
                        unit: reference.unit,
                        is_guess: reference.is_guess,
                        warnings: reference.warnings.clone(),
                    };
                    self.reference = Some(reference);
                    self.compare();
                    vec![Reply::Reference(info)]
                }
                Err(error) => vec![Reply::NoReference(error.to_string())],
            },
            Request::Open { name, bytes, beside } => {
                let model = OpenedFile::read(&name, &bytes, &beside).and_then(|file| file.model(&[]));
                self.open(model)
            }
            Request::Forget => {
                self.reference = None;
                self.compared = None;
                Vec::new()
            }
        }
    }

    /// Takes the content of a file in the place of the model; what there is to reply.
    pub fn open(&mut self, model: Result<OpenedModel, OpenError>) -> Vec<Reply> {
        let model = match model {
            Ok(model) => model,
            Err(error) => return vec![Reply::NotOpened(error.to_string())],
        };
        self.mesher = None;
        let mut replies: Vec<Reply> = self.meshing.take().map(|_| Reply::Cancelled).into_iter().collect();
        let mesh = (!model.mesh.triangles.is_empty()).then(|| Arc::new(model.mesh.clone()));
        replies.push(Reply::Opened(Box::new(model)));
        if let Some(mesh) = mesh {
            self.vertices.clone_from(&mesh.vertices.positions);
            self.compare();
            replies.push(Reply::Mesh(mesh));
        }
        replies
    }

    /// Whether there is work to be done.
    pub fn is_busy(&self) -> bool {
        self.meshing.is_some() || self.compared.is_some()
    }

    /// Works for some milliseconds; what there is to reply then.
    pub fn work(&mut self) -> Vec<Reply> {
        if let Some(total) = self.meshing {
            return self.mesh_slice(total);
        }
        self.compare_slice()
    }

    fn compare_slice(&mut self) -> Vec<Reply> {
        let (Some(done), Some(reference)) = (&mut self.compared, &self.reference) else {
            self.compared = None;
            return Vec::new();
        };
        let rest = &self.vertices[done.len()..];
        done.extend(reference.deviations(&rest[..rest.len().min(VERTICES)]));
        if done.len() < self.vertices.len() {
            return Vec::new();
        }
        let of_vertices = self.compared.take().unwrap_or_default();
        let mut figures = figures(&of_vertices);
        figures.mismatch = mismatch(&self.vertices, reference, &of_vertices);
        vec![Reply::Deviation { of_vertices, figures }]
    }

    fn mesh_slice(&mut self, total: usize) -> Vec<Reply> {
        let left = self.mesher.as_mut().map_or(0, |(_, mesher)| mesher.step(TILES));
        if left > 0 {
            // Chunks that came in between add to the work.
            let total = total.max(left);
            self.meshing = Some(total);
            return vec![Reply::Progress { done: (total - left) as u32, total: total as u32 }];
        }
        self.meshing = None;
        let mesh = self.mesher.as_ref().map(|(_, mesher)| mesher.mesh()).unwrap_or_default();
        self.vertices.clone_from(&mesh.vertices.positions);
        self.compare();
        vec![Reply::Mesh(Arc::new(mesh))]
    }

    /// Starts to compare the last mesh with the reference, if there are both.
    fn compare(&mut self) {
        self.compared = (self.reference.is_some() && !self.vertices.is_empty()).then(Vec::new);
    }
}

/// Whether the mesh lies on the reference at all.
fn mismatch(vertices: &[[f32; 3]], reference: &Reference, deviations: &[f32]) -> Option<Mismatch> {
    let mut sizes: Vec<f64> = deviations.iter().filter(|d| d.is_finite()).map(|d| f64::from(d.abs())).collect();
    let median = percentile(&mut sizes, 0.5)?;
    Mismatch::of(&Extent::of(vertices)?, &reference.extent, reference.unit, median)
}

/// Deviations in figures, those that are not numbers left out.
fn figures(deviations: &[f32]) -> DeviationFigures {
    let all = || deviations.iter().copied().filter(|d| d.is_finite());
    let n = all().count();
    if n == 0 {
        return DeviationFigures::default();
    }
    let sum = |of: fn(f64) -> f64| all().map(|d| of(d.into())).sum::<f64>() / n as f64;
    let mut sizes: Vec<f64> = all().map(|d| f64::from(d.abs())).collect();
    DeviationFigures {
        mean: sum(|d| d) as f32,
        rms: sum(|d| d * d).sqrt() as f32,
        p95: percentile(&mut sizes, 0.95).unwrap_or(0.0) as f32,
        mismatch: None,
        range: [all().fold(f32::INFINITY, f32::min), all().fold(f32::NEG_INFINITY, f32::max)],
    }
}

#[cfg(test)]
#[allow(clippy::expect_used)]
mod tests {
    use super::*;
    use semascan_geometry::mesh::mesh_cloud;
    use semascan_model::LengthUnit;
    use semascan_model::{PointFlags, SemanticMesh, SemanticPoint};

    const VOXEL: f32 = 0.001;

    /// A plate of 96 x 30 voxels at height `z`, as chunks.
    fn plate(z: f32) -> Vec<Request> {
        let point = |x: u32, y: u32| SemanticPoint {
            position: [(x as f32 + 0.5) * VOXEL, (y as f32 + 0.5) * VOXEL, z],
            normal: [0.0, 0.0, 1.0],
            color: [9; 3],
            label: 1,
            confidence: 1.0,
            defect: 0,
            defect_confidence: 1.0,
            sigma: 0.0,
            defect_sigma: 0.0,
            instance: 0,
            views: 1,
            flags: PointFlags(0),
        };
        let chunk = |i: u32| Request::Chunk {
            id: [i as i32, 0, 0],
            voxel: VOXEL,
            cloud: Box::new((i * 32..i * 32 + 32).flat_map(|x| (0..30).map(move |y| point(x, y))).collect()),
        };
        (0..3).map(chunk).collect()
    }

    fn finish(job: &mut Job) -> Vec<Reply> {
        let mut said = Vec::new();
        while job.is_busy() {
            said.extend(job.work());
        }
        said
    }

    fn mesh_of(replies: &[Reply]) -> &SemanticMesh {
        replies.iter().find_map(|r| if let Reply::Mesh(m) = r { Some(m) } else { None }).expect("a mesh")
    }

    #[test]
    fn the_mesh_is_that_of_the_agent_and_progress_is_reported() {
        let mut job = Job::default();
        let chunks = plate(0.0004);
        let mut cloud = SemanticCloud::default();
        for chunk in &chunks {
            let Request::Chunk { cloud: part, .. } = chunk else { panic!("not a chunk") };
            cloud.extend_from(part);
            assert!(job.handle(chunk.clone()).is_empty());
        }
        assert!(!job.is_busy());
        let started = job.handle(Request::Mesh);
        assert!(matches!(started[..], [Reply::Progress { done: 0, total }] if total > 8));
        let said = finish(&mut job);
        assert!(said.iter().filter(|r| matches!(r, Reply::Progress { .. })).count() > 1);
        let whole = mesh_cloud(&cloud, VOXEL, &MeshOptions::default(), &()).expect("usual settings");
        assert!(*mesh_of(&said) == whole && !whole.is_empty());
    }

    #[test]
    fn meshing_can_be_cancelled_and_goes_on_where_it_was() {
        let mut job = Job::default();
        plate(0.0004).into_iter().for_each(|c| drop(job.handle(c)));
        job.handle(Request::Mesh);
        job.work();
        assert_eq!(job.handle(Request::Cancel), [Reply::Cancelled]);
        assert!(!job.is_busy() && job.handle(Request::Cancel).is_empty());
        job.handle(Request::Mesh);
        assert!(!mesh_of(&finish(&mut job)).is_empty());
        job.handle(Request::Clear);
        job.handle(Request::Mesh);
        assert!(mesh_of(&finish(&mut job)).is_empty());
    }

    #[test]
    fn every_mesh_is_compared_with_the_reference() {
        let mut job = Job::default();
        let square = b"v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n".to_vec();
        let loaded = job.handle(Request::Reference { name: "plate.obj".into(), unit: None, bytes: square.into() });
        assert!(matches!(
            &loaded[..],
            [Reply::Reference(ReferenceInfo { triangles: 2, unit: LengthUnit::Metres, is_guess: true, .. })]
        ));
        for z in [0.0004, -0.0002] {
            plate(z).into_iter().for_each(|c| drop(job.handle(c)));
            job.handle(Request::Mesh);
            let said = finish(&mut job);
            let Some(Reply::Deviation { of_vertices, figures }) = said.last() else { panic!("{said:?}") };
            assert_eq!(of_vertices.len(), mesh_of(&said).len());
            for value in [figures.mean, figures.range[0], figures.range[1]] {
                assert!((value - z).abs() < 1e-5, "{figures:?}");
            }
            assert!((figures.p95 - z.abs()).abs() < 1e-5 && (figures.rms - z.abs()).abs() < 1e-5);
        }
        // The same plate in the numbers of another unit, and in another place.
        let file = |x: f32, unit: f32| {
            let corners = [[0.0, 0.0], [0.096, 0.0], [0.096, 0.03], [0.0, 0.03]];
            let line = |[a, b]: [f32; 2]| format!("v {} {} 0\n", (a + x) * unit, b * unit);
            (corners.map(line).concat() + "f 1 2 3 4\n").into_bytes()
        };
        for (file, unit, expected) in [
            (file(0.0, 1.0), None, "none"),
            (file(0.0, 1.0), Some(LengthUnit::Inches), "unit m"),
            (file(0.0, 100.0), None, "unit cm"),
            (file(0.0, 1000.0), None, "none"),
            (file(0.4, 1.0), None, "place"),
        ] {
            job.handle(Request::Reference { name: "plate.obj".into(), unit, bytes: file.into() });
            let said = finish(&mut job);
            let Some(Reply::Deviation { figures, .. }) = said.last() else { panic!("{said:?}") };
            let found = match figures.mismatch {
                None => "none".to_owned(),
                Some(Mismatch::Unit { fits, .. }) => format!("unit {}", fits.name()),
                Some(Mismatch::Place { .. }) => "place".to_owned(),
                other => format!("{other:?}"),
            };
            assert_eq!(found, expected);
        }
        job.handle(Request::Forget);
        job.handle(Request::Mesh);
        assert!(!finish(&mut job).iter().any(|r| matches!(r, Reply::Deviation { .. })));
        assert!(matches!(
            job.handle(Request::Reference { name: "a.xyz".into(), unit: None, bytes: [].into() })[..],
            [Reply::NoReference(_)]
        ));
    }
}
