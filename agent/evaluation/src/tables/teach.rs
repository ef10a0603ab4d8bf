//! A network before and after it was trained on views of corrected motors: in the shifted world that these motors were seen in,
//! on motors that nothing was trained or chosen on, and in the world that it was made for.
//!
//! Each network is one alone (of an ensemble the first), asked once about a picture as it is, by the way of an inspection. The
//! gap is what it loses by the change of the world: its mean IoU in its own less that in the shifted one, on the same motors.

use super::Progress;
use crate::network_scores::{Shelf, score_networks, test_source};
use crate::{NetworkError, PixelScores, TestDomain, TestViews};
use semascan_perception::segment::network::SelectError;
use serde::Serialize;
use std::io::{self, Write};
use std::path::PathBuf;

/// Seed of the first motor: neither networks nor their thresholds were made with any from here on.
pub const FIRST_MOTOR: u64 = 3001;

/// What is compared.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Config {
    /// The network before: the name of an installed one, or a folder.
    pub before: PathBuf,
    /// The network after: the same.
    pub after: PathBuf,
    /// Views of motors that neither was trained on.
    pub views: TestViews,
    /// Folder of models; where an inspection looks, if absent.
    pub models: Option<PathBuf>,
}

impl Config {
    /// On five motors, twelve views of 640x480 each.
    pub fn new(before: PathBuf, after: PathBuf) -> Self {
        let motors = (FIRST_MOTOR..FIRST_MOTOR + 5).collect();
        let views = TestViews { motors, views: 12, size: (640, 480), cell: 1.0 };
        Self { before, after, views, models: None }
    }
}

/// A network in a world.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// The network, as it was named.
    pub network: PathBuf,
    /// The world.
    pub domain: TestDomain,
    /// Components.
    pub components: PixelScores,
}

/// The comparison.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// What was compared.
    pub config: Config,
    /// Names of the component classes, none first.
    pub classes: Vec<String>,
    /// Before and after, in the shifted world and in the virtual cell as it is.
    pub rows: Vec<Row>,
    /// Mean IoU that the first network loses by the change of the world.
    pub gap: f64,
    /// Mean IoU that was gained in the shifted world.
    pub gained: f64,
    /// The share of the gap that this is; `None` where there is no gap.
    pub share: Option<f64>,
}

/// Asks both networks; `on_step` gets how many views are done, and of how many.
///
/// # Errors
/// [`NetworkError`] naming the network or the motor.
pub fn run(config: &Config, on_step: &dyn Fn(usize, usize)) -> Result<Report, NetworkError> {
    const DOMAINS: [TestDomain; 2] = [TestDomain::Shifted, TestDomain::VirtualCell];
    let shelf = Shelf::open(config.models.as_deref())?;
    let source = test_source();
    let mut networks = Vec::new();
    for named in [&config.before, &config.after] {
        let installed = named.to_str().and_then(|name| shelf.find(name));
        let is_folder = named.is_dir().then(|| named.clone());
        let unknown = || SelectError::Unknown { name: named.display().to_string(), installed: Vec::new() };
        let folder = is_folder.or(installed).ok_or_else(unknown)?;
        networks.push(shelf.single(&folder, 0, &source)?);
    }
    let mut on_step = |done, all| on_step(done, all);
    let mut progress = Progress::new(&mut on_step);
    progress.expect(DOMAINS.len() * config.views.count());
    let mut rows = Vec::new();
    for domain in DOMAINS {
        let scores = score_networks(&mut networks, &config.views, domain, || progress.step())?;
        for (network, scores) in [&config.before, &config.after].into_iter().zip(scores) {
            let components = scores.components.unfiltered();
            rows.push(Row { network: network.clone(), domain, components });
        }
    }
    let mean_iou = |row: usize| rows[row].components.mean_iou;
    let (gap, gained) = (mean_iou(2) - mean_iou(0), mean_iou(1) - mean_iou(0));
    let share = (gap > 0.0).then(|| gained / gap);
    let classes = TestViews::taxonomy().components.into_iter().map(|class| class.name).collect();
    Ok(Report { config: config.clone(), classes, rows, gap, gained, share })
}

/// Prints the comparison.
///
/// # Errors
/// If `out` fails.
pub fn print(out: &mut impl Write, report: &Report) -> io::Result<()> {
    let TestViews { motors, views, size: (width, height), .. } = &report.config.views;
    writeln!(out, "one network asked once about {} motors, {views} views of {width}x{height} each", motors.len())?;
    write!(out, "{:<40} {:>14} {:>9}", "network", "world", "mean IoU")?;
    for name in report.classes.iter().skip(1) {
        write!(out, " {:>10}", name.chars().take(10).collect::<String>())?;
    }
    writeln!(out)?;
    for Row { network, domain, components } in &report.rows {
        write!(out, "{:<40} {:>14} {:>9.4}", network.display(), domain.name(), components.mean_iou)?;
        for iou in &components.iou {
            write!(out, " {:>10}", iou.map_or_else(|| "-".to_owned(), |iou| format!("{iou:.4}")))?;
        }
        writeln!(out)?;
    }
    let share = report.share.map_or_else(|| "no gap".to_owned(), |share| format!("{:.0} % of it", 100.0 * share));
    writeln!(out, "the gap to the network's own world is {:.4}; gained {:+.4}, {share}", report.gap, report.gained)
}
