//! What people measured on the model and keep with the inspection, with its uncertainty.

use super::or_dash;
use super::summary::time;
use crate::Report;
use crate::described;
use maud::{Markup, html};
use semascan_model::measurement::KeptMeasurement;

pub(super) fn measurements(report: &Report<'_>) -> Markup {
    let kept = report.reviewed.map_or(&[][..], |reviewed| &reviewed.state.measurements);
    html! {
        @if !kept.is_empty() {
            section #measurements {
                h2 { "Measurements" }
                table.lines {
                    thead { tr { th.number { "No." } th { "What" } th.number { "Figure" } th { "Taken from" } th { "Who" } th { "When" } th { "Note" } } }
                    tbody { @for (index, kept) in kept.iter().enumerate() { (row(index + 1, kept)) } }
                }
                p.note {
                    "People measured these on the model and keep them. \u{b1} is the expanded uncertainty, k = 2: of points from the voxel "
                    "grid, of elements from how their points scatter and what all of one side share; the scale of the depth camera is not "
                    "in it."
                }
            }
        }
    }
}

fn row(number: usize, kept: &KeptMeasurement) -> Markup {
    let measurement = &kept.measurement;
    html! {
        tr {
            td.number { (number) }
            td {
                (measurement.kind.label())
                @if kept.is_of_earlier_model { " " span.none { "(of an earlier model)" } }
            }
            td.number { (or_dash(described::measured_figure(measurement))) }
            td { (described::measured_on(measurement)) }
            td { (kept.person) }
            td { (time(kept.at)) }
            td.reason { (kept.note) }
        }
    }
}
