//! Whether the camera's given numbers hold, and where in the picture corners were seen.

use super::{CalibrationReport, CameraFigures};
use crate::figure::plain;
use maud::{Markup, html};

pub(super) fn camera(report: &CalibrationReport<'_>) -> Markup {
    let Some(camera) = &report.camera else { return html! {} };
    html! {
        section #camera {
            h2 { "Camera" }
            p .warning[camera.is_contradicted] { (camera.verdict) "." }
            p {
                "Corners are " (plain(camera.rms, 3)) " pixels off with the given camera"
                @if let Some(own) = camera.own_rms { " and " (plain(own, 3)) " with their own" }
                " (root mean square). They cover " (plain(100.0 * camera.coverage, 0)) " % of the picture."
            }
            div.columns {
                @if !camera.numbers.is_empty() { (numbers(camera)) }
                (rings(camera))
            }
            (coverage(report))
        }
    }
}

fn numbers(camera: &CameraFigures) -> Markup {
    html! {
        table {
            thead { tr { th { "Number" } th.number { "Given" } th.number { "By the corners" } th.number { "Within" br; "k = 2" } } }
            tbody {
                @for (name, given, own, uncertainty) in &camera.numbers {
                    @let digits = if *uncertainty > 0.01 { 2 } else { 5 };
                    tr {
                        td { (name) } td.number { (plain(*given, digits)) } td.number { (plain(*own, digits)) }
                        td.number { (plain(*uncertainty, digits)) }
                    }
                }
            }
        }
    }
}

fn rings(camera: &CameraFigures) -> Markup {
    html! {
        table {
            thead { tr {
                th { "Radius" br; "pixels" } th.number { "Corners" } th.number { "Root mean square" br; "pixels" }
                th.number { "Outwards" br; "pixels" }
            } }
            tbody {
                @for (radius, corners, rms, outwards) in &camera.rings {
                    tr {
                        td { "to " (plain(*radius, 0)) } td.number { (corners) } td.number { (plain(*rms, 3)) }
                        td.number { (plain(*outwards, 3)) }
                    }
                }
            }
        }
    }
}

fn coverage(report: &CalibrationReport<'_>) -> Markup {
    let pictures = || report.captures.iter().filter_map(|shown| shown.picture.as_ref());
    let Some((width, height)) = pictures().map(|picture| picture.size).next() else { return html! {} };
    html! {
        figure {
            svg.coverage viewBox=(format!("-0.5 -0.5 {width} {height}")) role="img" aria-label="corners of all captures in the picture" {
                @for ([u, v], _) in pictures().flat_map(|picture| &picture.corners) {
                    circle.seen cx=(format!("{u:.0}")) cy=(format!("{v:.0}")) r=(format!("{:.1}", f64::from(width) / 320.0)) {}
                }
            }
            figcaption { "The corners of all captures. What they do not cover, the camera's numbers are not tested for." }
        }
    }
}
