//! The way of one view: acquire -> segment -> register -> fuse, on bounded queues, as [Remanufacturing paper] runs its
//! steps beside the robot's motion. A view is registered against the model that the views before it made, so these two
//! stages share a thread; capture and segmentation of the next views go on beside them. After the last view all poses
//! are refined together and the map is made anew with them.
//!
//! A view that fails in any stage is reported with its reason and left out; the inspection goes on. What happens is
//! told to an [`InspectionSink`]: the live stream, a progress bar, a record on disk.

mod fusion;

use crate::source::Source;
use fusion::Fusion;
use semascan_perception::fuse::{
    AssociationTest, FuseError, Integration, Misidentification, OutlierFilter, SemanticMap, TouchedChunk,
    UncertaintyRule,
};
use semascan_perception::organized::OrganizedCloud;
use semascan_perception::register::{JointRefinement, Registrar, Registration};
use semascan_perception::segment::{Segmentation, Segmenter};
use semascan_perception::view::View;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::{Duration, Instant};

/// Views that may wait between two stages: enough to overlap them, few enough that memory stays small.
const QUEUE: usize = 1;

/// The stages of the way of one view.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Stage {
    /// Capture or read.
    Acquire,
    /// Class probabilities.
    Segment,
    /// Camera pose.
    Register,
    /// Integration into the map.
    Fuse,
    /// Hand-over to the sink.
    Publish,
    /// All poses together, after the last view.
    Refine,
}

impl Stage {
    /// Lower-case name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Acquire => "acquire",
            Self::Segment => "segment",
            Self::Register => "register",
            Self::Fuse => "fuse",
            Self::Publish => "publish",
            Self::Refine => "refine",
        }
    }
}

/// How a stage of one view stands.
#[derive(Clone, Debug, PartialEq)]
pub enum StageStatus {
    /// It began.
    Started,
    /// It ended well.
    Finished(Duration),
    /// It failed, and why.
    Failed(String),
}

/// What became of one view.
#[derive(Clone, Debug)]
pub struct ViewOutcome {
    /// Position in the capture order.
    pub index: u32,
    /// The view itself, unless it could not be acquired.
    pub view: Option<View>,
    /// Its labels, if it was segmented.
    pub segmentation: Option<Segmentation>,
    /// Its pose, if it was registered.
    pub registration: Option<Registration>,
    /// Objects in it that are not what their labels say.
    pub misidentified: Vec<Misidentification>,
    /// What it added to the map, or why it was left out.
    pub result: Result<Integration, String>,
    /// Time of each stage it went through.
    pub timings: Vec<(Stage, Duration)>,
}

/// Hears everything that happens in an inspection. Calls come from several threads.
pub trait InspectionSink: Sync {
    /// A stage of view `view` began, ended or failed.
    fn stage(&self, view: u32, stage: Stage, status: &StageStatus);
    /// The map changed. `last` is true once, after the last view and the filters.
    fn map_changed(&self, map: &SemanticMap, touched: &[TouchedChunk], last: bool);
    /// A view is through, one way or the other.
    fn view_done(&self, outcome: &ViewOutcome);
    /// All accepted views (`views`, in order) have new poses; the map that follows is made with them.
    fn refined(&self, views: &[u32], refinement: &JointRefinement);
}

/// What an inspection is run with.
#[derive(Clone, Debug, Default)]
pub struct PipelineConfig {
    /// Voxel edge in metres; chosen from the first view if absent.
    pub voxel: Option<f64>,
    /// Outlier filters.
    pub filter: OutlierFilter,
    /// How objects of a view are found in the model; `None` where views number them alike already.
    pub association: Option<AssociationTest>,
    /// When a pixel's label is too uncertain, and what becomes of the pixel.
    pub uncertainty: UncertaintyRule,
    /// Least time between two captures, so that people can watch.
    pub pace: Duration,
}

/// A finished inspection.
#[derive(Debug)]
pub struct Inspected {
    /// The model; `None` if no view could be used.
    pub map: Option<SemanticMap>,
    /// Views that were captured or attempted.
    pub views: u32,
    /// Views that were left out.
    pub rejected: u32,
}

/// Why an inspection could not be run.
#[derive(Debug, thiserror::Error)]
pub enum PipelineError {
    /// The map could not be made.
    #[error(transparent)]
    Fuse(#[from] FuseError),
}

/// What the first stage made of one view.
struct Captured {
    index: u32,
    timings: Vec<(Stage, Duration)>,
    view: Result<View, String>,
}

/// A view on its way, with the time each stage took.
struct InFlight {
    index: u32,
    timings: Vec<(Stage, Duration)>,
    result: Result<Surface, String>,
    view: Option<View>,
}

/// What a view shows: points with normals, and what they belong to.
struct Surface {
    cloud: OrganizedCloud,
    segmentation: Segmentation,
}

/// Runs one inspection to its end, or until `stop` is set.
///
/// # Errors
/// [`PipelineError`] if the map cannot be set up; failing views are reported to the sink instead.
pub fn run(
    source: &mut dyn Source,
    segmenter: &mut dyn Segmenter,
    registrar: &mut dyn Registrar,
    config: &PipelineConfig,
    sink: &dyn InspectionSink,
    stop: &AtomicBool,
) -> Result<Inspected, PipelineError> {
    let info = source.info().clone();
    let (captured, to_segment) = sync_channel(QUEUE);
    let (segmented, to_fuse) = sync_channel(QUEUE);
    std::thread::scope(|scope| {
        scope.spawn(move || acquire(source, config.pace, sink, stop, &captured));
        scope.spawn(move || segment(segmenter, sink, &to_segment, &segmented));
        let mut fusion = Fusion::new(&info, config, sink, registrar);
        let (mut views, mut rejected) = (0, 0);
        for in_flight in to_fuse {
            views += 1;
            rejected += u32::from(!fusion.view(in_flight)?);
        }
        let map = fusion.finish()?;
        Ok(Inspected { map, views, rejected })
    })
}

/// Runs `work` as `stage` of view `index`, telling the sink and noting the time.
fn staged<T, E: std::fmt::Display>(
    sink: &dyn InspectionSink,
    timings: &mut Vec<(Stage, Duration)>,
    index: u32,
    stage: Stage,
    work: impl FnOnce() -> Result<T, E>,
) -> Result<T, String> {
    sink.stage(index, stage, &StageStatus::Started);
    let begun = Instant::now();
    let result = work().map_err(|e| e.to_string());
    let elapsed = begun.elapsed();
    timings.push((stage, elapsed));
    match &result {
        Ok(_) => sink.stage(index, stage, &StageStatus::Finished(elapsed)),
        Err(reason) => sink.stage(index, stage, &StageStatus::Failed(reason.clone())),
    }
    result
}

fn acquire(
    source: &mut dyn Source,
    pace: Duration,
    sink: &dyn InspectionSink,
    stop: &AtomicBool,
    captured: &SyncSender<Captured>,
) {
    for index in 0.. {
        if stop.load(Ordering::Relaxed) {
            return;
        }
        let begun = Instant::now();
        let mut timings = Vec::new();
        // The end of the source shows only when it is asked, so the stage is announced after the fact.
        let Some(view) = source.next_view() else { return };
        let elapsed = begun.elapsed();
        sink.stage(index, Stage::Acquire, &StageStatus::Started);
        timings.push((Stage::Acquire, elapsed));
        let view = view.map_err(|e| e.to_string());
        match &view {
            Ok(_) => sink.stage(index, Stage::Acquire, &StageStatus::Finished(elapsed)),
            Err(reason) => sink.stage(index, Stage::Acquire, &StageStatus::Failed(reason.clone())),
        }
        if captured.send(Captured { index, timings, view }).is_err() {
            return;
        }
        let rest = pace.saturating_sub(begun.elapsed());
        wait(rest, stop);
    }
}

/// Sleeps in short steps so that a stop is heard.
fn wait(mut rest: Duration, stop: &AtomicBool) {
    const STEP: Duration = Duration::from_millis(50);
    while !rest.is_zero() && !stop.load(Ordering::Relaxed) {
        let step = rest.min(STEP);
        std::thread::sleep(step);
        rest -= step;
    }
}

fn segment(
    segmenter: &mut dyn Segmenter,
    sink: &dyn InspectionSink,
    captured: &Receiver<Captured>,
    segmented: &SyncSender<InFlight>,
) {
    for Captured { index, mut timings, view } in captured {
        let in_flight = match view {
            Err(reason) => InFlight { index, timings, result: Err(reason), view: None },
            Ok(view) => {
                let result = staged(sink, &mut timings, index, Stage::Segment, || {
                    let segmentation = segmenter.segment(&view).map_err(|e| e.to_string())?;
                    let cloud = OrganizedCloud::new(view.intrinsics, &view.depth, None);
                    if cloud.is_empty() {
                        return Err("no depth in the whole picture".to_owned());
                    }
                    Ok(Surface { cloud, segmentation })
                });
                InFlight { index, timings, result, view: Some(view) }
            }
        };
        if segmented.send(in_flight).is_err() {
            return;
        }
    }
}
