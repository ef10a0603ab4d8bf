//! The virtual cell: a simulated inspection station in the manner of [Remanufacturing paper], with truth for
//! everything.
//!
//! A part (a parametric starter motor, or any mesh) stands on a turntable; a robot carries a structured-light camera
//! around it. Views come one by one with the chain that the station reports, noisy depth, shaded colour, exact labels
//! and the true pose. Good enough to train and test on: the same seed gives the same bytes on any number of threads.
//!
//! [`TurntableRecording`] is another setting: a fixed depth camera of the consumer class before a turntable in a room.

mod appearance;
mod backdrop;
mod camera;
mod datum;
mod defects;
mod develop;
mod domain;
mod dual_contour;
mod lighting;
mod mesh_import;
mod noise;
mod part;
mod random;
mod randomisation;
pub mod raycast;
mod sampling;
mod scene;
mod sensor;
mod shape;
mod solid;
mod spec;
mod starter_motor;
mod station;
mod stereo_camera;
mod training;
mod turntable;

pub use datum::{Datum, DatumSurface};
pub use domain::Domain;
pub use randomisation::{Randomisation, Range};
pub use sampling::Sampling;
pub use sensor::SensorModel;
pub use spec::{KEYS, Key, PARTS, PartSpec, VirtualCellSpec};
pub use station::ErrorModel;
pub use training::{GENERATOR, TrainingCell, TrainingOptions};
pub use turntable::{TurntableDisc, TurntableOptions, TurntablePart, TurntableRecording};

use camera::Camera;
use part::Scene;
use random::Stream;
use sampling::{Target, viewpoint};
use semascan_inspection::planning::{SteeredCamera, Viewpoint};
use semascan_inspection::source::{Source, SourceError, SourceInfo, TrueMesh};
use semascan_perception::view::{Intrinsics, PoseEvidence, View, ViewTruth};
use station::Station;
use std::sync::Arc;

/// Seconds between two captures: the robot's way and the exposure.
const CYCLE: f64 = 3.0;

/// A simulated inspection of one part, as a source of views.
#[derive(Debug)]
pub struct VirtualCell {
    spec: VirtualCellSpec,
    info: SourceInfo,
    scene: Scene,
    truth: TrueMesh,
    datums: Vec<Datum>,
    station: Station,
    camera: Camera,
    target: Target,
    next: u32,
    /// Where the next view is taken from, if somebody said so.
    ordered: Option<Viewpoint>,
}

impl VirtualCell {
    /// Builds part, station and camera; views are rendered when they are asked for.
    ///
    /// # Errors
    /// A mesh file that cannot be read or is not what it should be.
    pub fn open(spec: &VirtualCellSpec) -> Result<Self, SourceError> {
        let set = match &spec.part {
            PartSpec::StarterMotor { cell } => scene::starter_motor(spec.part_seed.unwrap_or(spec.seed), *cell),
            PartSpec::Mesh { path, scale } => scene::imported(path, *scale, spec.seed)?,
        };
        let camera = spec.domain.camera(spec.seed, spec.size, spec.noise);
        let target = Target::around(set.part_bounds, &camera.intrinsics);
        let mut taxonomy_settings = set.settings;
        taxonomy_settings.splice(0..0, settings(spec));
        let info = SourceInfo {
            uri: spec.uri.clone(),
            part: set.name,
            taxonomy: set.taxonomy.clone(),
            view_count: Some(spec.views),
            turntable: Some(set.turntable),
            volume: Some(set.volume),
            no_labels: None,
            settings: taxonomy_settings,
        };
        let mut truth = set.scene.truth(set.volume.0.z as f32);
        truth.taxonomy = Some(set.taxonomy);
        Ok(Self {
            info,
            truth,
            datums: set.datums,
            scene: set.scene,
            station: Station::new(spec.seed, spec.errors),
            camera,
            target,
            next: 0,
            ordered: None,
            spec: spec.clone(),
        })
    }

    /// View `index`, whether its turn has come or not; `None` past the last.
    pub fn view(&self, index: u32) -> Option<View> {
        if index >= self.spec.views {
            return None;
        }
        Some(self.view_from(&self.viewpoint(index), index))
    }

    /// Where view `index` is taken from, unless somebody says otherwise.
    pub fn viewpoint(&self, index: u32) -> Viewpoint {
        viewpoint(self.spec.sampling, self.spec.seed, index, self.spec.views, &self.target)
    }

    /// The view from `viewpoint` as number `index`, with the errors and the noise of that number.
    pub fn view_from(&self, viewpoint: &Viewpoint, index: u32) -> View {
        let pose = self.station.move_to(viewpoint, index);
        let seed = Stream::new(self.spec.seed, &format!("picture {index}")).word();
        let picture = self.camera.capture(&self.scene, &pose.table_from_camera, pose.table_angle, seed);
        View {
            index,
            stamp: Some(f64::from(index) * CYCLE),
            intrinsics: self.camera.intrinsics,
            rgb: Arc::new(picture.rgb),
            depth: Arc::new(picture.depth),
            pose: PoseEvidence::Chain { chain: pose.chain, covariance: pose.covariance },
            labels: Some(Arc::new(picture.labels)),
            truth: Some(ViewTruth { table_from_camera: pose.table_from_camera }),
        }
    }

    /// The planes and cylinders that the part was built of; none of a mesh from a file.
    pub fn datums(&self) -> &[Datum] {
        &self.datums
    }

    /// The true defect class at a point of the surface of `component` (metres, table frame); 0 is none. Pictures and the
    /// vertices of the true mesh have the same.
    pub fn defect_at(&self, position: [f32; 3], component: u16) -> u16 {
        self.scene.defect_at(position, component)
    }
}

impl Source for VirtualCell {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_view(&mut self) -> Option<Result<View, SourceError>> {
        let view = match self.ordered.take() {
            Some(viewpoint) => self.view_from(&viewpoint, self.next),
            None => self.view(self.next)?,
        };
        self.next += 1;
        Some(Ok(view))
    }

    fn steered(&mut self) -> Option<&mut dyn SteeredCamera> {
        Some(self)
    }

    fn truth(&self) -> Option<&TrueMesh> {
        Some(&self.truth)
    }
}

impl SteeredCamera for VirtualCell {
    fn intrinsics(&self) -> Intrinsics {
        self.camera.intrinsics
    }

    fn move_to(&mut self, viewpoint: &Viewpoint) -> Result<(), SourceError> {
        self.ordered = Some(viewpoint.clone());
        Ok(())
    }
}

fn settings(spec: &VirtualCellSpec) -> Vec<(String, String)> {
    let mut settings = vec![
        ("seed", spec.seed.to_string()),
        ("views", spec.views.to_string()),
        ("size", format!("{}x{}", spec.size.0, spec.size.1)),
        (
            "errors",
            match spec.errors {
                ErrorModel::NONE => "none".to_owned(),
                ErrorModel::ROUGH => "rough".to_owned(),
                _ => "default".to_owned(),
            },
        ),
        (
            "noise",
            match spec.noise {
                None => "none".to_owned(),
                Some(n) if n == SensorModel::ZIVID => "zivid".to_owned(),
                Some(n) if n == SensorModel::STEREO => "stereo".to_owned(),
                Some(_) => "default".to_owned(),
            },
        ),
        ("sampling", format!("{:?}", spec.sampling).to_lowercase()),
    ];
    if spec.domain != Domain::Standard {
        settings.push(("domain", format!("{:?}", spec.domain).to_lowercase()));
    }
    settings.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
}

#[cfg(test)]
mod color_tests;
#[cfg(test)]
mod tests;
