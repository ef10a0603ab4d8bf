//! The way of one view: acquire -> segment -> register -> fuse, on bounded queues, as [Remanufacturing paper] runs its
//! steps beside the robot's motion. A view is registered against the model that the views before it made, so these two
//! stages share a thread; capture and segmentation of the next views go on beside them. After the last view all poses
//! are refined together and the map is made anew with them.
//!
//! A view that fails in any stage is reported with its reason and left out; the inspection goes on.

mod fusion;
mod plan;
mod region;

pub(crate) use region::Region;

use crate::bus::EventBus;
use crate::event::{EventKind, SharedModel, StageStatus};
use crate::planning::{ViewPlanner, Viewpoint};
use crate::source::Source;
use fusion::{Finished, Fusion};
use nalgebra::Matrix6;
use plan::Plan;
use semascan_model::record::{Stage, StageTime};
use semascan_perception::fuse::{AssociationTest, FuseError, OutlierFilter, UncertaintyRule};
use semascan_perception::organized::OrganizedCloud;
use semascan_perception::register::Registrar;
use semascan_perception::segment::{Segmentation, Segmenter};
use semascan_perception::view::{View, sharpness};
use std::collections::BTreeMap;
use std::fmt::Display;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::{Duration, Instant};

/// Views that may wait between two stages: enough to overlap them, few enough that memory stays small.
const QUEUE: usize = 1;

/// What the stages are run with.
#[derive(Clone, Debug)]
pub(crate) struct PipelineConfig {
    /// Voxel edge in metres; chosen from the first view if absent.
    pub(crate) voxel: Option<f64>,
    /// Outlier filters.
    pub(crate) filter: OutlierFilter,
    /// How objects of a view are found in the model; `None` where views number them alike already.
    pub(crate) association: Option<AssociationTest>,
    /// When a pixel's label is too uncertain, and what becomes of the pixel.
    pub(crate) uncertainty: UncertaintyRule,
    /// Least time between two captures, so that people can watch.
    pub(crate) pace: Duration,
}

/// What does the work of the stages.
pub(crate) struct Stages<'a> {
    /// Labels the pixels.
    pub(crate) segmenter: &'a mut dyn Segmenter,
    /// Leaves out those that are of no interest.
    pub(crate) region: &'a mut Region,
    /// Finds where the view was taken.
    pub(crate) registrar: &'a mut dyn Registrar,
}

/// What the first stage made of one view.
struct Captured {
    index: u32,
    timings: Vec<StageTime>,
    view: Result<View, String>,
}

/// A view on its way to the model, with the time each stage took.
struct Segmented {
    index: u32,
    timings: Vec<StageTime>,
    view: Option<View>,
    result: Result<Surface, String>,
}

/// What a view shows: points with normals, and what they belong to.
struct Surface {
    cloud: OrganizedCloud,
    segmentation: Segmentation,
    /// How sharp the picture is where it shows them; `None` where there is no contrast.
    sharpness: Option<f64>,
}

/// What came of the views.
pub(crate) struct Modelled {
    /// The model; none if no view could be used.
    pub(crate) model: Option<SharedModel>,
    /// Views that went all the way, one way or the other.
    pub(crate) views: usize,
    /// Views that are in the model.
    pub(crate) used: usize,
    /// Whether the model's noisy surfaces were made thin.
    pub(crate) thinned: bool,
    /// The covariance of each view's pose in the model over (rotation, translation), camera frame.
    pub(crate) covariances: BTreeMap<u32, Matrix6<f64>>,
}

/// Takes the views of `source` their way until the last one, the pixels outside the region left out; with a `planner` those
/// that it asks for, one after the other, as each depends on what the views before it made. Once `stop` is set, the
/// views in work are finished and no other is begun, and poses are not refined.
///
/// # Errors
/// [`FuseError`] if the map cannot be set up; failing views are published to `events` instead.
pub(crate) fn run(
    source: &mut dyn Source,
    planner: Option<Box<dyn ViewPlanner>>,
    stages: Stages<'_>,
    config: &PipelineConfig,
    events: &EventBus,
    stop: &AtomicBool,
) -> Result<Modelled, FuseError> {
    let info = source.info().clone();
    let Stages { segmenter, region, registrar } = stages;
    let (captured, to_segment) = sync_channel(QUEUE);
    let (segmented, to_fuse) = sync_channel(QUEUE);
    let (mut plan, orders) = planner.map(|planner| Plan::new(planner, events)).unzip();
    std::thread::scope(|scope| {
        // What the stages say belongs to the same inspection.
        let [acquiring, segmenting] = [tracing::Span::current(), tracing::Span::current()];
        scope.spawn(move || {
            acquiring.in_scope(|| acquire(source, orders.as_ref(), config.pace, events, stop, &captured))
        });
        scope.spawn(move || {
            segmenting.in_scope(|| segment(segmenter, region, events, stop, &to_segment, &segmented));
        });
        let mut fusion = Fusion::new(&info, config, events, registrar);
        let mut views = 0;
        plan = plan.and_then(|plan| plan.ask(None));
        for view in to_fuse {
            if stop.load(Ordering::Relaxed) {
                break;
            }
            fusion.add(view)?;
            views += 1;
            plan = plan.and_then(|plan| plan.ask(fusion.model()));
        }
        let used = fusion.used();
        let (model, thinned, covariances) = match fusion.finish(stop.load(Ordering::Relaxed)) {
            Some(Finished { model, thinned, covariances }) => (Some(model), thinned, covariances),
            None => (None, false, BTreeMap::new()),
        };
        Ok(Modelled { model, views, used, thinned, covariances })
    })
}

fn acquire(
    source: &mut dyn Source,
    orders: Option<&Receiver<Viewpoint>>,
    pace: Duration,
    events: &EventBus,
    stop: &AtomicBool,
    captured: &SyncSender<Captured>,
) {
    for index in 0.. {
        if stop.load(Ordering::Relaxed) {
            return;
        }
        // Where views are planned, the source goes where it is sent; no more orders are the end.
        let moved = match orders.map(Receiver::recv) {
            Some(Err(_)) => return,
            Some(Ok(viewpoint)) => source.steered().map_or(Ok(()), |camera| camera.move_to(&viewpoint)),
            None => Ok(()),
        };
        let begun = Instant::now();
        // The end of the source shows only when it is asked, so the stage is announced after the fact.
        let Some(view) = moved.map_or_else(|error| Some(Err(error)), |()| source.next_view()) else { return };
        let seconds = begun.elapsed().as_secs_f64();
        publish_stage(events, index, Stage::Acquire, StageStatus::Started);
        // One count of the views: the inspection's.
        let view = view.map(|view| View { index, ..view }).map_err(|e| e.to_string());
        let view = view.and_then(|view| view.check_sizes().map(|()| view).map_err(|e| e.to_string()));
        let status = match &view {
            Ok(_) => StageStatus::Finished { seconds },
            Err(reason) => StageStatus::Failed { reason: reason.clone() },
        };
        publish_stage(events, index, Stage::Acquire, status);
        let timings = vec![StageTime { stage: Stage::Acquire, seconds }];
        if captured.send(Captured { index, timings, view }).is_err() {
            return;
        }
        sleep_unless_stopped(pace.saturating_sub(begun.elapsed()), stop);
    }
}

/// Sleeps in short steps so that a stop is noticed.
fn sleep_unless_stopped(mut rest: Duration, stop: &AtomicBool) {
    const STEP: Duration = Duration::from_millis(50);
    while !rest.is_zero() && !stop.load(Ordering::Relaxed) {
        let step = rest.min(STEP);
        std::thread::sleep(step);
        rest -= step;
    }
}

fn segment(
    segmenter: &mut dyn Segmenter,
    region: &mut Region,
    events: &EventBus,
    stop: &AtomicBool,
    captured: &Receiver<Captured>,
    segmented: &SyncSender<Segmented>,
) {
    for Captured { index, mut timings, view } in captured {
        if stop.load(Ordering::Relaxed) {
            return;
        }
        let next = match view {
            Err(reason) => Segmented { index, timings, view: None, result: Err(reason) },
            Ok(view) => {
                let result = run_stage(events, &mut timings, index, Stage::Segment, || {
                    if view.depth.metres.iter().all(|z| *z <= 0.0) {
                        return Err("no depth in the whole picture".to_owned());
                    }
                    let segmentation = segmenter.segment(&view).map_err(|e| e.to_string())?;
                    let ignored = region.ignored(&view, &segmentation)?;
                    let cloud = OrganizedCloud::new(view.intrinsics, &view.depth, Some(&ignored));
                    let sharpness = sharpness(&view.rgb, |at| cloud.depth[at] > 0.0);
                    Ok(Surface { cloud, segmentation, sharpness })
                });
                Segmented { index, timings, view: Some(view), result }
            }
        };
        if segmented.send(next).is_err() {
            return;
        }
    }
}

/// Runs `work` as `stage` of view `index`: its begin, its end and its time are published and noted.
fn run_stage<T, E: Display>(
    events: &EventBus,
    timings: &mut Vec<StageTime>,
    index: u32,
    stage: Stage,
    work: impl FnOnce() -> Result<T, E>,
) -> Result<T, String> {
    publish_stage(events, index, stage, StageStatus::Started);
    let begun = Instant::now();
    let result = work().map_err(|e| e.to_string());
    let seconds = begun.elapsed().as_secs_f64();
    timings.push(StageTime { stage, seconds });
    let status = match &result {
        Ok(_) => StageStatus::Finished { seconds },
        Err(reason) => StageStatus::Failed { reason: reason.clone() },
    };
    publish_stage(events, index, stage, status);
    result
}

fn publish_stage(events: &EventBus, view: u32, stage: Stage, status: StageStatus) {
    events.publish(EventKind::Stage { view, stage, status });
}
