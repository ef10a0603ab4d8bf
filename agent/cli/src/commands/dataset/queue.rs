//! `semascan dataset queue DIR`: inspections and regions in the order in which a label would teach most.

use super::Failure;
use super::input::{self, Input, LeftOut};
use crate::stdout::print_json;
use clap::Args;
use semascan_labelling::{Basis, QUEUE_CELL, QueuedRegion, corrected_labels, queued_regions};
use semascan_model::record::Outcome;
use semascan_model::{InspectionId, Taxonomy};
use serde::Serialize;
use std::io::{self, Write};
use std::path::PathBuf;

/// Arguments of `semascan dataset queue`.
#[derive(Debug, Args)]
pub(super) struct QueueArgs {
    /// Data folders, or folders of inspections
    #[arg(value_name = "DIR", required = true)]
    from: Vec<PathBuf>,
    /// Regions of each inspection that are listed
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000))]
    regions: u32,
    /// Print the queue as one JSON object on stdout
    #[arg(long)]
    json: bool,
}

/// The queue.
#[derive(Debug, Serialize)]
struct Queue {
    /// How it is ordered.
    convention: String,
    /// The inspection that would teach most first.
    inspections: Vec<QueuedInspection>,
    /// Inspections that say nothing about what a label would teach.
    left_out: Vec<LeftOut>,
}

/// An inspection.
#[derive(Debug, Serialize)]
struct QueuedInspection {
    inspection: InspectionId,
    part: String,
    /// Whole standard uncertainty times area over its surface that nobody labelled, square metres.
    worth: f64,
    /// Regions in all.
    count: usize,
    /// The first of them.
    regions: Vec<NamedRegion>,
}

/// A region with the name of its component.
#[derive(Debug, Serialize)]
struct NamedRegion {
    name: String,
    #[serde(flatten)]
    region: QueuedRegion,
}

impl QueueArgs {
    pub(super) fn run(self) -> Result<(), Failure> {
        let input::Inputs { list, mut left_out } = input::open(&self.from, &[])?;
        let mut inspections = Vec::new();
        for input in &list {
            match self.queued(input)? {
                Ok(queued) => inspections.push(queued),
                Err(reason) => left_out.push(LeftOut { inspection: input.record.id, reason }),
            }
        }
        inspections.sort_by(|a, b| b.worth.total_cmp(&a.worth).then(a.inspection.cmp(&b.inspection)));
        let convention = format!(
            "worth: mean standard uncertainty of the labels (0 to 1) times area; basis model_part: the part of the networks \
             alone, whole: all of it, where the part is not known; surface by cells of {} mm",
            1e3 * QUEUE_CELL
        );
        let queue = Queue { convention, inspections, left_out };
        if self.json {
            print_json(&queue)?;
        } else {
            print(&mut crate::stderr::Stderr::default(), &queue)?;
        }
        Ok(())
    }

    /// An inspection with its regions, or why there is nothing to order by.
    fn queued(&self, input: &Input) -> Result<Result<QueuedInspection, String>, Failure> {
        let record = &input.record;
        if record.outcome == Outcome::Running {
            return Ok(Err("it has not ended".into()));
        }
        if record.points == 0 {
            return Ok(Err("it did not come to a model".into()));
        }
        let (mesh, taxonomy) = input.mesh()?;
        let corrected = corrected_labels(&mesh, &taxonomy, record, &input.entries);
        let regions = queued_regions(&mesh, &corrected, record, &input.entries);
        if regions.is_empty() {
            let reason =
                "its labels have no uncertainty: they come from the source, or people labelled all that has one";
            return Ok(Err(reason.into()));
        }
        let whole = regions.iter().filter(|region| region.basis == Basis::Whole);
        let worth = whole.map(|region| region.worth).sum();
        let count = regions.len();
        let named = |region: QueuedRegion| NamedRegion { name: name(&taxonomy, region.component), region };
        let regions = regions.into_iter().take(self.regions as usize).map(named).collect();
        Ok(Ok(QueuedInspection { inspection: record.id, part: record.part.clone(), worth, count, regions }))
    }
}

fn name(taxonomy: &Taxonomy, component: u16) -> String {
    let class = taxonomy.components.iter().find(|class| class.id == component);
    class.map_or_else(|| format!("class {component}"), |class| class.name.clone())
}

fn print(out: &mut impl Write, queue: &Queue) -> io::Result<()> {
    for QueuedInspection { inspection, part, worth, count, regions } in &queue.inspections {
        writeln!(out, "{inspection}  {part}  worth {:.1} mm2 in {count} regions", worth * 1e6)?;
        for NamedRegion { name, region } in regions {
            let [x, y, z] = region.position.map(|c| 1e3 * c);
            let basis = match region.basis {
                Basis::ModelPart => "model part",
                Basis::Whole => "whole",
            };
            let what = region.finding.map_or_else(|| name.clone(), |finding| format!("{name}, finding {finding}"));
            writeln!(
                out,
                "  {:>8.2} mm2 = {:.3} ({basis}) x {:>8.1} mm2  at {x:.1} {y:.1} {z:.1} mm  {what}",
                region.worth * 1e6,
                region.sigma,
                region.area * 1e6
            )?;
        }
    }
    for LeftOut { inspection, reason } in &queue.left_out {
        writeln!(out, "{inspection}  left out: {reason}")?;
    }
    writeln!(out, "{}", queue.convention)
}
