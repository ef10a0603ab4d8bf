//! The virtual cell: a simulated inspection station in the manner of P0, with truth for everything.
//!
//! A part (a parametric starter motor, or any mesh) stands on a turntable; a robot carries a structured-light camera
//! around it. Views come one by one with the chain that the station reports, noisy depth, shaded colour, exact labels
//! and the true pose. Good enough to train and test on: the same seed gives the same bytes on any number of threads.

mod camera;
mod defects;
mod develop;
mod dual_contour;
mod lighting;
mod mesh_import;
mod noise;
mod part;
mod random;
pub mod raycast;
mod sampling;
mod scene;
mod sensor;
mod shape;
mod solid;
mod spec;
mod starter_motor;
mod station;
mod surface;

pub use sensor::SensorModel;
pub use spec::{PartSpec, Sampling, VirtualCellSpec};
pub use station::ErrorModel;

use super::{AcquireError, Intrinsics, PoseEvidence, Source, SourceInfo, TrueMesh, View, ViewTruth};
use camera::Camera;
use part::Scene;
use random::Stream;
use sampling::{Target, viewpoint};
use station::Station;

/// Seconds between two captures: the robot's way and the exposure.
const CYCLE: f64 = 3.0;
/// Focal length as a share of the picture's width: 615 pixels at 640, as structured-light cameras of this class have.
const FOCAL: f64 = 0.961;

/// A simulated inspection of one part, as a source of views.
#[derive(Debug)]
pub struct VirtualCell {
    spec: VirtualCellSpec,
    info: SourceInfo,
    scene: Scene,
    truth: TrueMesh,
    station: Station,
    camera: Camera,
    target: Target,
    next: u32,
}

impl VirtualCell {
    /// Builds part, station and camera; views are rendered when they are asked for.
    ///
    /// # Errors
    /// A mesh file that cannot be read or is not what it should be.
    pub fn open(spec: &VirtualCellSpec) -> Result<Self, AcquireError> {
        let set = match &spec.part {
            PartSpec::StarterMotor { cell } => scene::starter_motor(spec.part_seed.unwrap_or(spec.seed), *cell),
            PartSpec::Mesh { path, scale } => scene::imported(path, *scale, spec.seed)?,
        };
        let intrinsics = draw_intrinsics(spec.seed, spec.size);
        let smaller = (f64::from(spec.size.0) / intrinsics.fx).min(f64::from(spec.size.1) / intrinsics.fy);
        let (low, high) = set.part_bounds;
        let target = Target {
            height: f64::from(0.5 * (low.z + high.z)),
            radius: f64::from(0.5 * (high - low).length()),
            half_view: (0.5 * smaller).atan(),
        };
        let mut taxonomy_settings = set.settings;
        taxonomy_settings.splice(0..0, settings(spec));
        let info = SourceInfo {
            uri: spec.uri.clone(),
            part: set.name,
            taxonomy: set.taxonomy.clone(),
            view_count: Some(spec.views),
            turntable: Some(set.turntable),
            volume: Some(set.volume),
            settings: taxonomy_settings,
        };
        let mut truth = set.scene.truth(set.volume.0.z as f32);
        truth.taxonomy = Some(set.taxonomy);
        Ok(Self {
            info,
            truth,
            scene: set.scene,
            station: Station::new(spec.seed, spec.errors),
            camera: Camera {
                intrinsics,
                lighting: lighting::Lighting::draw(spec.seed),
                sensor: spec.noise,
                film: develop::Film::draw(spec.seed),
            },
            target,
            next: 0,
            spec: spec.clone(),
        })
    }

    /// View `index`, whether its turn has come or not; `None` past the last.
    pub fn view(&self, index: u32) -> Option<View> {
        if index >= self.spec.views {
            return None;
        }
        let planned = viewpoint(self.spec.sampling, self.spec.seed, index, self.spec.views, &self.target);
        let pose = self.station.move_to(&planned, index);
        let seed = Stream::new(self.spec.seed, &format!("picture {index}")).word();
        let picture = self.camera.capture(&self.scene, &pose.table_from_camera, pose.table_angle, seed);
        Some(View {
            index,
            stamp: f64::from(index) * CYCLE,
            intrinsics: self.camera.intrinsics,
            rgb: picture.rgb,
            depth: picture.depth,
            pose: PoseEvidence::Chain { chain: pose.chain, covariance: pose.covariance },
            labels: Some(picture.labels),
            truth: Some(ViewTruth { table_from_camera: pose.table_from_camera }),
        })
    }
}

impl Source for VirtualCell {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_view(&mut self) -> Option<Result<View, AcquireError>> {
        let view = self.view(self.next)?;
        self.next += 1;
        Some(Ok(view))
    }

    fn truth(&self) -> Option<&TrueMesh> {
        Some(&self.truth)
    }
}

/// A calibrated lens: focal length within 1 %, centre within 1 % of the picture; they differ from cell to cell.
fn draw_intrinsics(seed: u64, (width, height): (u32, u32)) -> Intrinsics {
    let mut s = Stream::new(seed, "lens");
    let mut vary = |share: f32| 1.0 + f64::from(s.range(-share, share));
    let (w, h) = (f64::from(width), f64::from(height));
    let f = FOCAL * w * vary(0.01);
    Intrinsics {
        width,
        height,
        fx: f,
        fy: f * vary(0.001),
        cx: 0.5 * (w - 1.0) * vary(0.01),
        cy: 0.5 * (h - 1.0) * vary(0.01),
    }
}

fn settings(spec: &VirtualCellSpec) -> Vec<(String, String)> {
    [
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
                Some(_) => "default".to_owned(),
            },
        ),
        ("sampling", format!("{:?}", spec.sampling).to_lowercase()),
    ]
    .map(|(key, value)| (key.to_owned(), value))
    .to_vec()
}

#[cfg(test)]
mod tests;
