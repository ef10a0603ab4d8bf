//! `semascan dataset queue DIR`: inspections and regions in the order in which a label would teach most.

use super::Failure;
use super::input::{self, Input, LeftOut};
use crate::stdout::print_json;
use clap::Args;
use semascan_labelling::{
    Basis, NamedRegion, NothingToTeach, TeachingQueue, check_teachable, queue_convention, teaching_queue,
};
use semascan_model::InspectionId;
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

impl QueueArgs {
    pub(super) fn run(self) -> Result<(), Failure> {
        let input::Inputs { list, mut left_out } = input::open(&self.from, &[])?;
        let mut inspections = Vec::new();
        for input in &list {
            match self.queued(input)? {
                Ok(queued) => inspections.push(queued),
                Err(reason) => left_out.push(LeftOut { inspection: input.record.id, reason: reason.to_string() }),
            }
        }
        inspections.sort_by(|a, b| b.worth.total_cmp(&a.worth).then(a.inspection.cmp(&b.inspection)));
        let queue = Queue { convention: queue_convention(), inspections, left_out };
        if self.json {
            print_json(&queue)?;
        } else {
            print(&mut crate::stderr::Stderr::default(), &queue)?;
        }
        Ok(())
    }

    /// An inspection with its regions, or why there is nothing to order by.
    fn queued(&self, input: &Input) -> Result<Result<QueuedInspection, NothingToTeach>, Failure> {
        let record = &input.record;
        if let Err(reason) = check_teachable(record) {
            return Ok(Err(reason));
        }
        let (mesh, taxonomy) = input.mesh()?;
        Ok(teaching_queue(&mesh, &taxonomy, record, &input.entries).map(|TeachingQueue { worth, mut regions }| {
            let count = regions.len();
            regions.truncate(self.regions as usize);
            QueuedInspection { inspection: record.id, part: record.part.clone(), worth, count, regions }
        }))
    }
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
