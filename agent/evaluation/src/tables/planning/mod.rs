//! Planned views against truth: how much of the surface that the cell can reach is seen after so many views, for the next best
//! view, a regular turn, the greedy count of frontiers and random poses; what that does to the model; and the close looks of the
//! second stage.
//!
//! *Reachable* is a point of the true surface in the measuring volume that at least one pose of a fine grid within the limits of the
//! cell sees (`reachable.rs`). Next best and greedy run in a closed loop through the product's pipeline, with the sensor's noise
//! and the station's errors; a regular turn and random poses need no model. *Best* is what a planner could do that knew the part: of the same poses always
//! the one that adds most true surface.

mod close;
mod model_scores;
mod print;
mod reachable;

pub use close::{CloseLooks, FindingReached};
pub use model_scores::ModelScores;
pub use print::print;

use super::{InspectError, inspect_planned};
use nalgebra::Isometry3;
use reachable::{Looked, best_curve, curve};
use semascan_inspection::Inspected;
use semascan_inspection::planning::{Decision, Viewpoint};
use semascan_inspection::record::isometry;
use semascan_inspection::source::{Source, SourceError, SourceInfo};
use semascan_inspection::spec::{InspectionSpec, LabelSource, PlanSpec, PlanStrategy, SpecError};
use semascan_model::record::PlanStop;
use semascan_perception::view::Intrinsics;
use semascan_planning::{Orbit, Reach, candidates, planner};
use semascan_simulation::{VirtualCell, VirtualCellSpec};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The grid of poses that says what is reachable.
const FINE: Orbit = Orbit { table: 48, azimuths: 3, polars: 10, distances: 3 };
/// Coverage that counts as complete.
pub const COMPLETE: f64 = 0.95;
/// Meshes of others, in the folder of data: where, and in which unit.
pub const MESHES: [(&str, &str); 10] = [
    ("objects/ycb/lemon/textured.obj", "m"),
    ("objects/ycb/mug/textured.obj", "cm"),
    ("objects/parts/factory_gear_base.obj", "m"),
    ("cad/parts/motors/NEMA-17_Stepper_Motor_47mm.stl", "mm"),
    ("cad/parts/fans/blower-50x50mm.stl", "mm"),
    ("cad/parts/housings/dual_motor_testbed_base.stl", "mm"),
    ("cad/parts/brackets/SAET200_L64_H83.stl", "mm"),
    ("cad/parts/brackets/PPA150.stl", "mm"),
    ("cad/parts/gears/gear20_40.stl", "mm"),
    ("cad/parts/flanges/DN15_FIG_130.stl", "mm"),
];

/// What is planned.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Config {
    /// Seeds of the motors.
    pub motors: Vec<u64>,
    /// Folder with [`MESHES`]; without it there are motors only.
    pub data: Option<PathBuf>,
    /// How many of them.
    pub meshes: usize,
    /// Most views of each.
    pub views: u32,
    /// Views after which models are compared.
    pub compared: u32,
    /// Columns and rows.
    pub size: (u32, u32),
    /// Where labels come from, for the comparison of models.
    pub labels: LabelSource,
    /// Sequences of random poses, of which the mean is stated.
    pub random: u64,
    /// Points of the true surface.
    pub samples: usize,
    /// Least gain that is worth a view, as a share of the known surface.
    pub least_gain: f64,
}

impl Default for Config {
    /// Ten motors that no network was trained on.
    fn default() -> Self {
        Self {
            motors: (1001..=1010).collect(),
            data: None,
            meshes: MESHES.len(),
            views: 12,
            compared: 6,
            size: (320, 240),
            labels: LabelSource::Source,
            random: 5,
            samples: 8000,
            least_gain: PlanSpec::default().least_gain,
        }
    }
}

/// One part.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Part {
    /// For people.
    pub name: String,
    /// Whether it is a motor.
    pub is_motor: bool,
    /// Share of its surface in the measuring volume that is reachable.
    pub reachable: f64,
    /// Share of the reachable surface that was seen after each view, by strategy; `best` is one that knows the part. Of a
    /// regular turn each number of views is a turn of its own; of random poses the mean.
    pub coverage: BTreeMap<String, Vec<f64>>,
    /// Views after which the stop rule of the next best view ends; absent where it does not within all views.
    pub stopped_after: Option<usize>,
    /// Seconds that planning one view took, mean of the next best view.
    pub planning_seconds: f64,
    /// Its model of next best views and that of random poses, after as many views.
    pub models: Option<(ModelScores, ModelScores)>,
    /// The second stage, with the camera as it is and with one that is fine enough.
    pub close: Vec<CloseLooks>,
}

impl Part {
    /// Views that a strategy needs for [`COMPLETE`]; `None` where it does not get there.
    pub fn needed(&self, strategy: &str) -> Option<usize> {
        self.coverage.get(strategy)?.iter().position(|share| *share >= COMPLETE).map(|i| i + 1)
    }
}

/// The table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// What was planned.
    pub config: Config,
    /// By part.
    pub parts: Vec<Part>,
}

/// Why there is no table.
#[derive(Debug, thiserror::Error)]
pub enum PlanningError {
    /// The part cannot be simulated.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// It cannot be planned for.
    #[error("{part}: {source}")]
    Plan {
        /// The part.
        part: String,
        /// Why.
        source: SpecError,
    },
    /// It could not be inspected.
    #[error("{part}: {source}")]
    Inspect {
        /// The part.
        part: String,
        /// Why.
        source: InspectError,
    },
}

/// Plans and judges every part; `on_step` gets how many are done, and of how many.
///
/// # Errors
/// [`PlanningError`] naming the part.
pub fn run(config: &Config, on_step: &dyn Fn(usize, usize)) -> Result<Report, PlanningError> {
    let (width, height) = config.size;
    let size = format!("size={width}x{height}");
    let motors = config.motors.iter().map(|seed| (format!("virtual:starter-motor?seed={seed}&{size}&cell=2"), true));
    let meshes = config.data.iter().flat_map(|folder| {
        MESHES.iter().take(config.meshes).map(|(path, unit)| {
            let path = percent(&folder.join(path));
            (format!("virtual:mesh?path={path}&unit={unit}&{size}"), false)
        })
    });
    let uris: Vec<(String, bool)> = motors.chain(meshes).collect();
    let mut parts = Vec::new();
    for (uri, is_motor) in &uris {
        on_step(parts.len(), uris.len());
        parts.push(part(config, uri, *is_motor)?);
    }
    Ok(Report { config: config.clone(), parts })
}

/// A path as the value of a key in a URI.
fn percent(path: &Path) -> String {
    path.display().to_string().replace('%', "%25").replace('&', "%26")
}

fn part(config: &Config, uri: &str, is_motor: bool) -> Result<Part, PlanningError> {
    let mut cell = VirtualCell::open(&VirtualCellSpec::parse(uri)?)?;
    let info = cell.info().clone();
    let plan_error = |source| PlanningError::Plan { part: info.part.clone(), source };
    let spec = PlanSpec { views: config.views, least_gain: config.least_gain, ..PlanSpec::default() };
    let no_camera = || SpecError { field: "plan".into(), reason: "the cell cannot be steered".into() };
    let no_volume = || SpecError { field: "plan".into(), reason: "the cell knows no measuring volume".into() };
    let camera = cell.steered().map(|camera| camera.intrinsics()).ok_or_else(no_camera).map_err(plan_error)?;
    let volume = info.volume.ok_or_else(no_volume).map_err(plan_error)?;
    let reach = Reach::new(&spec.reach, volume);
    let truth = cell.truth().cloned().unwrap_or_default();
    let looked = Looked::new(&truth, volume, (&camera, &reach), config.samples, 1);
    let reachable = looked.seen_from_any(&candidates(&reach, &FINE));

    let mut coverage = BTreeMap::new();
    let poses = candidates(&reach, &Orbit::OVERALL);
    coverage.insert("best".to_owned(), best_curve(&looked, &reachable, &poses, config.views));
    let turns = (1..=config.views).map(|views| {
        let spec = PlanSpec { views, ..spec.clone() };
        let poses = fixed_poses(PlanStrategy::Uniform, &spec, &info, &camera)?;
        Ok(curve(&looked, &reachable, &poses).last().copied().unwrap_or(0.0))
    });
    coverage.insert("uniform".to_owned(), turns.collect::<Result<Vec<f64>, SpecError>>().map_err(plan_error)?);
    let mut random = vec![0.0; config.views as usize];
    for seed in 0..config.random {
        let spec = PlanSpec { seed, ..spec.clone() };
        let poses = fixed_poses(PlanStrategy::Random, &spec, &info, &camera).map_err(plan_error)?;
        for (sum, share) in random.iter_mut().zip(curve(&looked, &reachable, &poses)) {
            *sum += share / config.random as f64;
        }
    }
    coverage.insert("random".to_owned(), random);

    let inspected = |strategy, views| -> Result<Inspected, PlanningError> {
        let plan = PlanSpec { strategy: Some(strategy), views, ..spec.clone() };
        let spec = InspectionSpec { labels: config.labels, plan, ..InspectionSpec::default() };
        let cell = VirtualCell::open(&VirtualCellSpec::parse(uri)?)?;
        inspect_planned(spec, Box::new(cell))
            .map_err(|source| PlanningError::Inspect { part: info.part.clone(), source })
    };
    let (mut stopped_after, mut planning_seconds) = (None, 0.0);
    let mut close = Vec::new();
    for strategy in [PlanStrategy::NextBest, PlanStrategy::Greedy] {
        let inspected = inspected(strategy, config.views)?;
        let plan = inspected.record.plan.as_ref();
        let views = plan.map_or(&[][..], |plan| plan.views.as_slice());
        let poses: Vec<Isometry3<f64>> = views.iter().map(|view| isometry(&view.table_from_camera)).collect();
        coverage.insert(strategy.name().to_owned(), curve(&looked, &reachable, &poses));
        if strategy == PlanStrategy::NextBest {
            let is_enough = plan.is_some_and(|plan| matches!(plan.stopped, Some(PlanStop::LittleGain { .. })));
            stopped_after = is_enough.then_some(views.len());
            planning_seconds = views.iter().map(|view| view.seconds).sum::<f64>() / views.len().max(1) as f64;
            if is_motor {
                close = close::close_looks(&inspected, &looked, &truth, &reach);
            }
        }
    }
    let models = if is_motor {
        let best = inspected(PlanStrategy::NextBest, config.compared)?;
        let random = inspected(PlanStrategy::Random, config.compared)?;
        Some([best, random].map(|one| model_scores::score(&one, &looked, &reachable, &truth)).into())
    } else {
        None
    };
    let share = reachable.iter().filter(|r| **r).count() as f64 / reachable.len().max(1) as f64;
    Ok(Part { name: info.part, is_motor, reachable: share, coverage, stopped_after, planning_seconds, models, close })
}

/// The poses of a strategy that does not look at the model.
fn fixed_poses(
    strategy: PlanStrategy,
    spec: &PlanSpec,
    info: &SourceInfo,
    camera: &Intrinsics,
) -> Result<Vec<Isometry3<f64>>, SpecError> {
    let mut planner = planner(strategy, spec, info, camera)?;
    let next = || match planner.next(None) {
        Decision::Capture(next) => Some(Viewpoint::table_from_camera(&next.viewpoint)),
        Decision::Stop { .. } => None,
    };
    Ok(std::iter::from_fn(next).collect())
}
