//! Each capture against the result, the pictures with their corners drawn in, and captures that verify the result.

use super::{CalibrationReport, ENLARGED, ShownPicture};
use crate::figure::plain;
use crate::html::{data_url, or_dash};
use maud::{Markup, html};

pub(super) fn residuals(report: &CalibrationReport<'_>) -> Markup {
    let rows = report.captures.iter().zip(&report.record.captures);
    html! {
        section #captures {
            h2 { "Captures" }
            table {
                thead { tr {
                    th { "Capture" } th { "Picture" } th.number { "Distance" br; "m" } th.number { "Tilt" br; "°" }
                    th.number { "Corners" } th.number { "Corner noise" br; "pixels" }
                    th.number { "Off the result" br; "°" } th.number { br; "mm" }
                    th.number { "Off that of" br; "the others, °" } th.number { br; "mm" }
                } }
                tbody {
                    @for (shown, capture) in rows {
                        @let picture = shown.picture.as_ref();
                        tr .rejected[!capture.is_used] {
                            td { (shown.number) @if !capture.is_used { " (left out)" } }
                            td { (or_dash(picture.map(|p| p.name.clone()).filter(|name| !name.is_empty()))) }
                            td.number { (plain(shown.distance, 3)) }
                            td.number { (plain(shown.tilt_deg, 1)) }
                            td.number { (or_dash(picture.map(|p| p.corners.len().to_string()))) }
                            td.number { (or_dash(picture.map(|p| plain(p.sigma, 3)))) }
                            td.number { (plain(capture.residual_deg, 4)) }
                            td.number { (plain(capture.residual_mm, 4)) }
                            td.number { (or_dash(capture.left_out_deg.map(|deg| plain(deg, 4)))) }
                            td.number { (or_dash(capture.left_out_mm.map(|mm| plain(mm, 4)))) }
                        }
                    }
                }
            }
            p.note {
                "Off the result: between where the result has the board in the camera and where it was seen. Off that of the others: the "
                "same with the result of all other captures (leave one out); a capture without it leaves too few others."
            }
        }
    }
}

pub(super) fn verified(report: &CalibrationReport<'_>) -> Markup {
    html! {
        @if !report.verified.is_empty() {
            section #verification {
                h2 { "Verification" }
                p { "These captures were not used. The result says where each must see the board." }
                table {
                    thead { tr { th { "Capture" } th.number { "Off the prediction" br; "°" } th.number { br; "mm" } th { "" } } }
                    tbody {
                        @for capture in &report.verified {
                            tr .rejected[!capture.is_within] {
                                td { (capture.number) }
                                td.number { (plain(capture.deg, 4)) }
                                td.number { (plain(capture.mm, 4)) }
                                td { @if capture.is_within { "within the limits" } @else { "beyond the limits" } }
                            }
                        }
                    }
                }
            }
        }
    }
}

pub(super) fn pictures(report: &CalibrationReport<'_>) -> Markup {
    let shown = || report.captures.iter().filter_map(|shown| Some((shown.number, shown.picture.as_ref()?)));
    html! {
        @if shown().next().is_some() {
            section #pictures {
                h2 { "Pictures" }
                p.note {
                    "Circles: corners that were used. Lines: from where the board's pose has each corner to where it was seen, "
                    (ENLARGED) " times as long. Red crosses: corners that were left out."
                }
                div.grid.two { @for (number, picture) in shown() { (figure(number, picture)) } }
            }
        }
    }
}

fn figure(number: usize, picture: &ShownPicture) -> Markup {
    let (width, height) = picture.size;
    // Pixels are counted from the middle of the first one.
    let view_box = format!("-0.5 -0.5 {width} {height}");
    let radius = format!("{:.1}", f64::from(width) / 160.0);
    html! {
        figure {
            div.frame style=(format!("aspect-ratio:{width}/{height}")) {
                @if let Some(jpeg) = &picture.jpeg {
                    img alt=(format!("picture of capture {number}")) src=(data_url(jpeg));
                }
                svg.overlay viewBox=(view_box) preserveAspectRatio="none" aria-hidden="true" {
                    @for ([u, v], [du, dv]) in &picture.corners {
                        @let (u, v) = (*u, *v);
                        circle.seen cx=(format!("{u:.1}")) cy=(format!("{v:.1}")) r=(radius) {}
                        line.residual x1=(format!("{u:.1}")) y1=(format!("{v:.1}"))
                            x2=(format!("{:.1}", u + ENLARGED * du)) y2=(format!("{:.1}", v + ENLARGED * dv)) {}
                    }
                    @for [u, v] in &picture.left_out {
                        @let half = f64::from(width) / 100.0;
                        path.left-out d=(format!("M{:.1} {:.1}l{h:.1} {h:.1}m0 -{h:.1}l-{h:.1} {h:.1}", u - half, v - half, h = 2.0 * half)) {}
                    }
                }
            }
            figcaption {
                "Capture " (number) @if !picture.name.is_empty() { ", " (picture.name) }
                ": " (picture.corners.len()) " corners, noise " (plain(picture.sigma, 3)) " pixels"
                @if !picture.left_out.is_empty() { ", " (picture.left_out.len()) " left out" }
            }
        }
    }
}
