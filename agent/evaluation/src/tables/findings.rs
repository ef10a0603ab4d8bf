//! The findings of unseen simulated motors against truth: what share of the true regions was found, how many findings are
//! false, how far area and length are off, and how many of the stated intervals hold the truth.

use super::{InspectError, inspect};
use crate::findings::{COUNTED, Compared, FindingScores, Match, score_findings, true_regions};
use semascan_inspection::source::SourceError;
use semascan_inspection::spec::{InspectionSpec, LabelSource};
use semascan_model::finding::FindingId;
use semascan_perception::fuse::FuseError;
use semascan_simulation::{VirtualCell, VirtualCellSpec};
use serde::Serialize;
use std::io::{self, Write};

/// What is inspected.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Config {
    /// Seeds of the motors.
    pub motors: Vec<u64>,
    /// Views of each.
    pub views: u32,
    /// Columns and rows.
    pub size: (u32, u32),
    /// Where labels come from.
    pub labels: LabelSource,
    /// Voxel edge in millimetres; by default that of the inspection.
    pub voxel_mm: Option<f64>,
}

impl Default for Config {
    /// Ten motors that no network was trained on, with voxels of 0.9 millimetres.
    fn default() -> Self {
        Self {
            motors: (1001..=1010).collect(),
            views: 12,
            size: (960, 720),
            labels: LabelSource::Source,
            voxel_mm: None,
        }
    }
}

/// One motor.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Motor {
    /// Its seed.
    pub seed: u64,
    /// Voxel edge, metres.
    pub voxel: f64,
    /// The names of its findings, in order.
    pub ids: Vec<FindingId>,
    /// Against truth.
    pub scores: FindingScores,
}

/// The table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// What was inspected.
    pub config: Config,
    /// By motor.
    pub motors: Vec<Motor>,
    /// Over all motors.
    pub summary: Summary,
}

/// Figures over all motors.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Summary {
    /// True regions of at least 25 square millimetres that were seen.
    pub regions: usize,
    /// Those that were found.
    pub found: usize,
    /// Findings on no true region.
    pub false_findings: usize,
    /// Median of the relative error of the area, without sign, where truth has at least 25 square millimetres.
    pub area_error: Option<f64>,
    /// Median of the same with its sign.
    pub area_bias: Option<f64>,
    /// Median of the relative error of the length, without sign, of the same findings.
    pub length_error: Option<f64>,
    /// Intervals of areas that hold the truth, and all.
    pub area_covered: (usize, usize),
    /// Intervals of lengths that hold the truth, and all.
    pub length_covered: (usize, usize),
}

/// Why there is no table.
#[derive(Debug, thiserror::Error)]
pub enum FindingsError {
    /// The motor cannot be simulated.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// It could not be inspected.
    #[error("motor {seed}: {source}")]
    Inspect {
        /// Its seed.
        seed: u64,
        /// Why.
        source: InspectError,
    },
    /// A kept view could not be read back.
    #[error(transparent)]
    View(#[from] FuseError),
    /// Nobody looked for defects.
    #[error("motor {seed}: {why}")]
    NotLooked {
        /// Its seed.
        seed: u64,
        /// Why.
        why: String,
    },
}

/// Inspects and judges every motor; `on_step` gets how many are done, and of how many.
///
/// # Errors
/// [`FindingsError`] naming the motor.
pub fn run(config: &Config, on_step: &dyn Fn(usize, usize)) -> Result<Report, FindingsError> {
    let mut motors = Vec::new();
    for &seed in &config.motors {
        on_step(motors.len(), config.motors.len());
        motors.push(motor(config, seed)?);
    }
    let summary = summarize(motors.iter().map(|m| &m.scores));
    Ok(Report { config: config.clone(), motors, summary })
}

fn motor(config: &Config, seed: u64) -> Result<Motor, FindingsError> {
    let (width, height) = config.size;
    let uri = format!("virtual:starter-motor?seed={seed}&views={}&size={width}x{height}", config.views);
    let cell = VirtualCellSpec::parse(&uri)?;
    let mut spec = InspectionSpec { labels: config.labels, ..InspectionSpec::default() };
    spec.source.voxel_mm = config.voxel_mm;
    let inspected =
        inspect(spec, Box::new(VirtualCell::open(&cell)?)).map_err(|source| FindingsError::Inspect { seed, source })?;
    let truth = true_regions(&inspected, &VirtualCell::open(&cell)?)?;
    let not_looked = |why: &str| FindingsError::NotLooked { seed, why: why.to_owned() };
    let findings = inspected.record.findings.as_ref().ok_or_else(|| not_looked("there is no mesh"))?;
    if let Some(why) = &findings.not_looked {
        return Err(not_looked(why));
    }
    let scores = score_findings(&inspected, &truth).ok_or_else(|| not_looked("there is no mesh"))?;
    let ids = findings.list.iter().map(|f| f.id).collect();
    Ok(Motor { seed, voxel: inspected.record.voxel.unwrap_or_default(), ids, scores })
}

/// Figures over several parts.
pub fn summarize<'a>(scores: impl Iterator<Item = &'a FindingScores> + Clone) -> Summary {
    let sum = |of: fn(&FindingScores) -> usize| scores.clone().map(of).sum();
    let matches: Vec<&Match> = scores.clone().flat_map(|s| &s.matches).collect();
    let counted = || matches.iter().filter(|m| m.area.truth >= COUNTED);
    let covered = |list: Vec<&Compared>| {
        let known: Vec<bool> = list.iter().filter_map(|c| c.is_covered()).collect();
        (known.iter().filter(|c| **c).count(), known.len())
    };
    Summary {
        regions: sum(|s| s.regions),
        found: sum(|s| s.found),
        false_findings: sum(|s| s.false_findings),
        area_error: median(counted().map(|m| m.area.error().abs()).collect()),
        area_bias: median(counted().map(|m| m.area.error()).collect()),
        length_error: median(counted().filter_map(|m| Some(m.length?.error().abs())).collect()),
        area_covered: covered(matches.iter().map(|m| &m.area).collect()),
        length_covered: covered(matches.iter().filter_map(|m| m.length.as_ref()).collect()),
    }
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

/// Prints the table.
///
/// # Errors
/// If `out` fails.
pub fn print(out: &mut impl Write, report: &Report) -> io::Result<()> {
    let Report { config, motors, summary } = report;
    writeln!(
        out,
        "findings of {} motors, {} views of {}x{}, labels: {}; truth is what these views have seen",
        motors.len(),
        config.views,
        config.size.0,
        config.size.1,
        config.labels.name()
    )?;
    writeln!(
        out,
        "{:<8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8}",
        "motor", "voxel mm", "regions", "found", "findings", "false", "unseen"
    )?;
    for Motor { seed, voxel, scores, .. } in motors {
        let FindingScores { findings, false_findings, unseen, regions, found, .. } = scores;
        writeln!(
            out,
            "{seed:<8} {:>8.3} {regions:>8} {found:>8} {findings:>8} {false_findings:>8} {unseen:>8}",
            voxel * 1e3
        )?;
    }
    let percent = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |v| format!("{:+.2} %", 100.0 * v));
    let share =
        |(part, all): (usize, usize)| format!("{part} of {all} ({:.1} %)", 100.0 * part as f64 / all.max(1) as f64);
    writeln!(out, "found, of regions with 25 mm2 or more: {}", share((summary.found, summary.regions)))?;
    writeln!(out, "false findings on a part: {:.2}", summary.false_findings as f64 / motors.len().max(1) as f64)?;
    writeln!(
        out,
        "area: median error {} without sign, {} with it; intervals (k = 2) that hold the truth: {}",
        percent(summary.area_error),
        percent(summary.area_bias),
        share(summary.area_covered)
    )?;
    writeln!(
        out,
        "length: median error {} without sign; intervals that hold the truth: {}",
        percent(summary.length_error),
        share(summary.length_covered)
    )
}
