//! The tables of [Eye-in-hand 2020] on the virtual cell. [`masks`]: masks of networks before and after fusion (Tables 1
//! and 2). Here, Tables 3 to 5: how four ways of segmenting and registering do on the same views.
//!
//! Every object is seen from `views` sides in each of `seeds` cells; true masks are spoiled as a network would
//! ([`Degradation::network`], one setting for all). Each method then makes the object's cloud by the paper's own
//! stitching, and is judged against the true surface after ICP.

pub mod masks;
mod methods;
mod objects;
mod print;
pub mod published;
mod reconstruction_tables;
mod score;
mod stitching;
mod toys;

pub use methods::{Method, MethodError};
pub use objects::{Dataset, Setting, TableObject, objects};
pub use print::print;
pub use reconstruction_tables::{Aggregate, Difference, ObjectRow, ReconstructionTables, Run, Step};
pub use score::MethodScore;

use methods::{Capture, hard, reconstruct};
use score::TrueSurface;
use semascan_inspection::source::{Source, SourceError};
use semascan_model::choice::possible_instead;
use semascan_perception::segment::Degradation;
use semascan_simulation::VirtualCell;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::channel;

/// What is run.
#[derive(Clone, Debug)]
pub struct Config {
    /// Runs of each object, each in a cell of its own.
    pub seeds: u64,
    /// Views of each run.
    pub views: u32,
    /// Camera and cell.
    pub setting: Setting,
    /// Folder with the YCB meshes; without it those objects are left out.
    pub ycb: Option<PathBuf>,
    /// Only objects whose name contains this.
    pub only: Option<String>,
    /// Runs beside each other; the figures do not depend on it.
    pub workers: usize,
}

/// Why the tables could not be made.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// An object cannot be had.
    #[error(transparent)]
    Acquire(#[from] SourceError),
    /// A method failed.
    #[error("{object}, run {seed}: {source}")]
    Method {
        /// The object.
        object: String,
        /// The run.
        seed: u64,
        /// What went wrong.
        source: MethodError,
    },
    /// The meshes of the toys have no place to be.
    #[error("no folder for temporary files: {0}")]
    Temporary(#[from] std::io::Error),
    /// No thread to run on.
    #[error("no thread pool: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// There is nothing to run.
    #[error("no object's name contains {only:?}: {instead}")]
    NoObject {
        /// What was asked for.
        only: String,
        /// What was possible.
        instead: String,
    },
}

/// Runs the tables; `progress` is called after every run with how many are done, and of how many.
///
/// # Errors
/// [`TableError`]
pub fn run(config: &Config, progress: impl Fn(usize, usize)) -> Result<ReconstructionTables, TableError> {
    let folder = tempfile::tempdir()?;
    let mut objects = objects(folder.path(), config.ycb.as_deref())?;
    if let Some(only) = &config.only {
        if !objects.iter().any(|o| o.name.contains(only.as_str())) {
            let names: Vec<&str> = objects.iter().map(|o| o.name.as_ref()).collect();
            return Err(TableError::NoObject { only: only.clone(), instead: possible_instead(only, &names) });
        }
        objects.retain(|o| o.name.contains(only.as_str()));
    }
    let jobs: Vec<(usize, u64)> = (0..objects.len()).flat_map(|o| (1..=config.seeds).map(move |s| (o, s))).collect();
    let next = AtomicUsize::new(0);
    let (sender, results) = channel();
    let pools = (0..config.workers.max(1)).map(|_| rayon::ThreadPoolBuilder::new().num_threads(1).build());
    let pools = pools.collect::<Result<Vec<_>, _>>()?;
    let mut runs: Vec<Option<Run>> = vec![None; jobs.len()];
    std::thread::scope(|scope| {
        for pool in &pools {
            let (sender, next, jobs, objects) = (sender.clone(), &next, &jobs, &objects);
            scope.spawn(move || {
                while let Some(&(o, seed)) = jobs.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let at = o * config.seeds as usize + seed as usize - 1;
                    // One thread a run, so that its CPU time is its own.
                    let result = pool.install(|| run_one(&objects[o], seed, config));
                    if sender.send((at, result)).is_err() {
                        return;
                    }
                }
            });
        }
        drop(sender);
        let mut done = 0;
        for (at, result) in &results {
            let result = result.inspect_err(|_| next.store(jobs.len(), Ordering::Relaxed))?;
            runs[at] = Some(result);
            done += 1;
            progress(done, jobs.len());
        }
        Ok::<(), TableError>(())
    })?;
    Ok(ReconstructionTables::new(config, &objects, runs.into_iter().flatten().collect()))
}

/// One object in one cell, by all methods.
fn run_one(object: &TableObject, seed: u64, config: &Config) -> Result<Run, TableError> {
    let mut cell = VirtualCell::open(&object.spec(seed, config.views, &config.setting))?;
    let (vertices, triangles) = cell.truth().map(objects::own_surface).unwrap_or_default();
    let surface = TrueSurface::new(vertices, triangles);
    let degradation = Degradation::network(object.classes(), seed);
    let mut captures = Vec::new();
    while let Some(view) = cell.next_view() {
        let view = view?;
        let labels = view.labels.as_ref().map(|l| l.components.as_slice()).unwrap_or_default();
        let class = |&l: &u16| if l != 0 && object.class != 0 { object.class } else { l };
        let truth: Vec<u16> = labels.iter().map(class).collect();
        let mask = degradation.apply(&hard(&truth), view.intrinsics.width as usize, view.index);
        captures.push(Capture { view, truth, mask });
    }
    let mut methods = Vec::new();
    for method in Method::ALL {
        let fail = |source| TableError::Method { object: object.name.clone(), seed, source };
        methods.push(surface.judge(&reconstruct(method, object, &captures).map_err(fail)?));
    }
    Ok(Run { object: object.name.clone(), dataset: object.dataset, seed, methods })
}
