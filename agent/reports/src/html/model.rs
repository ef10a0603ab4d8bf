//! Pictures of the model with its findings, and the tables of its components and defects.

use super::{data_url, or_dash, swatch};
use crate::figure::{Unit, alone, plain, with_uncertainty};
use crate::pictures::ModelPicture;
use crate::{Report, described, findings};
use maud::{Markup, html};
use semascan_model::finding::{ComponentFigures, Quantity};
use semascan_model::record::{ClassSummary, InspectionRecord, LabelSource};
use semascan_model::{ClassDef, Taxonomy};

/// Edges of the box of a number, in pixels of the page.
const BOX: [f64; 2] = [22.0, 17.0];
/// Width that pictures have on the page, large and small ones.
const SHOWN: [f64; 2] = [800.0, 330.0];
/// Numbers that a picture shows; more would hide it.
const MOST_NUMBERS: usize = 40;

pub(super) fn model(report: &Report<'_>) -> Markup {
    let Report { record, taxonomy, pictures, .. } = report;
    html! {
        section #model {
            h2 { "Model" }
            @if pictures.model.is_empty() {
                p { "There is no picture of the model: it has no surface." }
            } @else {
                @let (first, rest) = pictures.model.split_at(1);
                @for picture in first { (figure(report, picture, "picture large")) }
                (legend(record, taxonomy))
                div.grid.three { @for picture in rest { (figure(report, picture, "picture")) } }
            }
        }
        section #components {
            h2 { "Components and defects" }
            (components(record, taxonomy))
            (defects(record, taxonomy))
        }
    }
}

fn figure(report: &Report<'_>, picture: &ModelPicture, class: &str) -> Markup {
    let (width, height) = picture.size;
    html! {
        figure class=(class) {
            div.frame {
                img src=(data_url(&picture.jpeg)) width=(width) height=(height)
                    alt=(format!("the model, {}", picture.direction.name()));
                svg.overlay viewBox=(format!("0 0 {width} {height}")) aria-hidden="true" {
                    (scale_bar(picture.pixel, picture.size))
                    (finding_numbers(picture))
                }
            }
            figcaption {
                (picture.direction.name())
                @let hidden = findings(report.record).iter().filter(|f| f.region.is_some()).count() - picture.findings.len();
                @if class.contains("large") && hidden > 0 {
                    "; " (hidden) " of the findings are on sides that are not seen from here"
                }
                @if picture.findings.len() > MOST_NUMBERS {
                    "; the first " (MOST_NUMBERS) " of " (picture.findings.len()) " are numbered"
                }
            }
        }
    }
}

/// Pixels of a picture for one of the page: what lies over it is as large in every picture.
fn magnified(width: u32) -> f64 {
    let shown = if f64::from(width) > 600.0 { SHOWN[0] } else { SHOWN[1] };
    f64::from(width) / shown
}

/// A bar of a round length, for the middle of the part.
pub(super) fn scale_bar(pixel: f64, (width, height): (u32, u32)) -> Markup {
    let m = magnified(width);
    let longest = 0.25 * f64::from(width) * pixel * 1e3;
    let power = 10_f64.powf(longest.log10().floor());
    let millimetres = [5.0, 2.0, 1.0].into_iter().map(|n| n * power).find(|mm| *mm <= longest).unwrap_or(power);
    let length = millimetres * 1e-3 / pixel;
    let (x, y) = (9.0 * m, f64::from(height) - 9.0 * m);
    html! {
        @if length.is_finite() && length > 1.0 {
            path.scale d=(format!("M{x:.1} {:.1}V{y:.1}H{:.1}V{:.1}", y - 4.0 * m, x + length, y - 4.0 * m)) {}
            text.scale x=(format!("{:.1}", x + length / 2.0)) y=(format!("{:.1}", y - 5.0 * m)) font-size=(format!("{:.1}", 11.5 * m)) {
                (if millimetres >= 1.0 { format!("{millimetres:.0}") } else { format!("{millimetres}") }) " mm"
            }
        }
    }
}

/// Numbers of findings beside their places, none over another.
fn finding_numbers(picture: &ModelPicture) -> Markup {
    let m = magnified(picture.size.0);
    let [width, height] = BOX.map(|edge| edge * m);
    html! {
        @for (number, at, place) in placed(&picture.findings, picture.size, m) {
            path.leader d=(format!("M{:.1} {:.1}L{:.1} {:.1}", at[0], at[1], place[0], place[1])) {}
            circle.dot cx=(format!("{:.1}", at[0])) cy=(format!("{:.1}", at[1])) r=(format!("{:.1}", 2.0 * m)) {}
            rect.tag x=(format!("{:.1}", place[0] - width / 2.0)) y=(format!("{:.1}", place[1] - height / 2.0))
                width=(format!("{width:.1}")) height=(format!("{height:.1}")) rx=(format!("{:.1}", 3.0 * m)) {}
            text.tag x=(format!("{:.1}", place[0])) y=(format!("{:.1}", place[1] + 4.2 * m))
                font-size=(format!("{:.1}", 12.0 * m)) { (number + 1) }
        }
    }
}

/// A place for each number near its point: the nearest that is free, on rings around it. `m` pixels of the picture are one of
/// the page.
fn placed(points: &[(usize, [f64; 2])], (width, height): (u32, u32), m: f64) -> Vec<(usize, [f64; 2], [f64; 2])> {
    let size = BOX.map(|edge| edge * m);
    let mut taken: Vec<[f64; 2]> = Vec::new();
    let mut list = Vec::new();
    for (number, at) in points.iter().take(MOST_NUMBERS) {
        let candidates: Vec<[f64; 2]> = (1..=7)
            .flat_map(|ring| {
                (0..16).map(move |i| {
                    let angle = f64::from(i) / 16.0 * std::f64::consts::TAU - std::f64::consts::FRAC_PI_4;
                    let radius = (10.0 + 11.0 * f64::from(ring)) * m;
                    [at[0] + radius * angle.cos(), at[1] + radius * angle.sin()]
                })
            })
            .collect();
        let inside = |p: &&[f64; 2]| {
            let fits = |c: f64, size: f64, whole: u32| c - size / 2.0 > 2.0 && c + size / 2.0 < f64::from(whole) - 2.0;
            fits(p[0], size[0], width) && fits(p[1], size[1], height)
        };
        let apart =
            |p: &[f64; 2], q: &[f64; 2], share: f64| (0..2).any(|k| (p[k] - q[k]).abs() > share * size[k] + 3.0 * m);
        let free = |p: &&[f64; 2]| {
            taken.iter().all(|q| apart(p, q, 1.0)) && points.iter().all(|(_, other)| apart(p, other, 0.5))
        };
        if let Some(place) = candidates.iter().find(|p| inside(p) && free(p)).or(candidates.iter().find(inside)) {
            taken.push(*place);
            list.push((*number, *at, *place));
        }
    }
    list
}

fn legend(record: &InspectionRecord, taxonomy: &Taxonomy) -> Markup {
    let seen = |class: &&ClassDef, list: &[ClassSummary]| {
        list.iter().any(|summary| summary.class == class.id && summary.points > 0)
    };
    html! {
        p.legend {
            @for class in taxonomy.components.iter().filter(|class| seen(class, &record.components)) {
                span { (swatch(class.color)) (if class.id == 0 { "without a component" } else { class.name.as_str() }) }
            }
            @for class in taxonomy.defects.iter().skip(1).filter(|class| seen(class, &record.defects)) {
                span { (swatch(class.color)) (class.name) " (defect)" }
            }
            span { (swatch([0xad, 0xad, 0xad])) "inside of an open surface" }
            span { "numbers are those of the findings" }
        }
    }
}

fn components(record: &InspectionRecord, taxonomy: &Taxonomy) -> Markup {
    let figures = record.findings.as_ref().map_or(&[][..], |found| &found.components);
    html! {
        table {
            thead { tr {
                th { "Component" } th.number { "Seen area" br; "mm²" } th.number { "Points" }
                th.number { "Confidence" br; "mean (least)" } th.number { "Sigma" br; "mean (most)" }
                th.number { "Not judged" br; "mm²" } th { "Instances" } th.number { "Findings" }
            } }
            tbody {
                @for summary in &record.components {
                    @let own = figures.iter().find(|f| f.component.class == summary.class);
                    tr {
                        td { (class_name(&taxonomy.components, summary, "without a component")) }
                        td.number { (or_dash(area(summary, own))) }
                        td.number { (summary.points) }
                        td.number { (or_dash(confidence(summary, own))) }
                        td.number { (or_dash(sigma(summary, own))) }
                        td.number { (or_dash(own.map(|own| alone(own.unjudged, Unit::SquareMillimetre)))) }
                        td { (or_dash(own.filter(|own| !own.instances.is_empty()).map(|own| listed(&own.instances)))) }
                        td.number {
                            (findings(record).iter().filter(|f| f.component.class == summary.class).count())
                        }
                    }
                }
            }
        }
        @if record.labels == LabelSource::None {
            p.note { "No labels were used: the surface is not divided into components." }
        }
    }
}

fn area(summary: &ClassSummary, own: Option<&ComponentFigures>) -> Option<String> {
    let quantity = own.map(|own| own.area).or(summary.area.map(Quantity::without_uncertainty));
    quantity.map(|area| with_uncertainty(area, Unit::SquareMillimetre))
}

fn confidence(summary: &ClassSummary, own: Option<&ComponentFigures>) -> Option<String> {
    match own {
        Some(own) => own.confidence.map(|c| format!("{} ({})", plain(c.mean, 3), plain(c.least, 2))),
        None => (summary.points > 0).then(|| plain(summary.confidence, 3)),
    }
}

fn sigma(summary: &ClassSummary, own: Option<&ComponentFigures>) -> Option<String> {
    match own {
        Some(own) => own.sigma.map(|s| format!("{} ({})", plain(s.mean, 3), plain(s.greatest, 2))),
        None => summary.sigma.filter(|_| summary.points > 0).map(|s| plain(s, 3)),
    }
}

fn defects(record: &InspectionRecord, taxonomy: &Taxonomy) -> Markup {
    let not_looked = record.findings.as_ref().and_then(|found| found.not_looked.as_ref());
    let looked_for = record.findings.as_ref().map(|found| &found.looked_for);
    html! {
        @if let Some(why) = not_looked {
            p.note { "Nothing is known of defects: " (why) "." }
        } @else if record.findings.is_none() {
            p.note { "Nothing is known of findings: the record holds none, which is no sign that there are none." }
        } @else {
            table {
                thead { tr {
                    th { "Defect" } th.number { "Area in all" br; "mm²" } th.number { "Points" } th.number { "Confidence" }
                    th.number { "Findings" } th.number { "Regions below" br; "the least area" }
                } }
                tbody {
                    @for summary in record.defects.iter().filter(|summary| summary.class != 0) {
                        @let looked = looked_for.is_none_or(|list| list.iter().any(|class| class.class == summary.class));
                        tr {
                            td { (class_name(&taxonomy.defects, summary, "none")) }
                            @if looked {
                                td.number { (or_dash(summary.area.map(|a| alone(a, Unit::SquareMillimetre)))) }
                                td.number { (summary.points) }
                                td.number { (or_dash((summary.points > 0).then(|| plain(summary.confidence, 3)))) }
                                td.number {
                                    (findings(record).iter().filter(|f| f.kind.defect().map(|d| d.class) == Some(summary.class)).count())
                                }
                                td.number { (or_dash(small_regions(record, summary.class))) }
                            } @else {
                                td colspan="5" { "not looked for" }
                            }
                        }
                    }
                }
            }
            @let other = findings(record).iter().filter(|f| f.kind.defect().is_none()).count();
            @if other > 0 {
                p.note { (other) " findings are of other kinds: " (kinds(record)) "." }
            }
        }
    }
}

fn small_regions(record: &InspectionRecord, defect: u16) -> Option<String> {
    let left_out = &record.findings.as_ref()?.left_out;
    let of = left_out.iter().filter(|left_out| left_out.defect.class == defect);
    let (regions, area) = of.fold((0, 0.0), |(n, a), one| (n + one.regions, a + one.area));
    Some(if regions == 0 { "0".into() } else { format!("{regions} ({} mm²)", alone(area, Unit::SquareMillimetre)) })
}

fn kinds(record: &InspectionRecord) -> String {
    let mut list: Vec<String> =
        findings(record).iter().filter(|f| f.kind.defect().is_none()).map(described::finding).collect();
    list.dedup();
    list.join(", ")
}

fn class_name(classes: &[ClassDef], summary: &ClassSummary, none: &str) -> Markup {
    let color = classes.get(usize::from(summary.class)).map(|class| class.color);
    html! {
        @if let Some(color) = color { (swatch(color)) }
        (if summary.class == 0 { none } else { summary.name.as_str() })
    }
}

/// Numbers with commas; runs of more than two as a range.
pub(super) fn listed(numbers: &[u16]) -> String {
    let mut runs: Vec<(u16, u16)> = Vec::new();
    for &n in numbers {
        match runs.last_mut() {
            Some((_, last)) if n == last.saturating_add(1) => *last = n,
            _ => runs.push((n, n)),
        }
    }
    let shown = runs.iter().map(|(first, last)| match last - first {
        0 => first.to_string(),
        1 => format!("{first}, {last}"),
        _ => format!("{first}–{last}"),
    });
    shown.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_lie_beside_their_points_and_apart() {
        let points: Vec<(usize, [f64; 2])> = (0..8).map(|i| (i, [100.0 + i as f64, 80.0])).collect();
        let list = placed(&points, (300, 200), 1.0);
        assert_eq!(list.len(), 8);
        for (i, (_, at, place)) in list.iter().enumerate() {
            assert!((place[0] - at[0]).hypot(place[1] - at[1]) < 90.0);
            for (_, _, other) in &list[..i] {
                assert!(
                    (place[0] - other[0]).abs() > BOX[0] || (place[1] - other[1]).abs() > BOX[1],
                    "{place:?} {other:?}"
                );
            }
        }
    }

    #[test]
    fn a_scale_bar_has_a_round_length() {
        // 0.1 mm a pixel, 400 pixels: up to 10 mm.
        let bar = scale_bar(1e-4, (400, 300)).into_string();
        assert!(bar.contains("10 mm") && bar.contains(&format!("H{:.1}", 9.0 * 400.0 / 330.0 + 100.0)), "{bar}");
        assert!(scale_bar(1.7e-4, (400, 300)).into_string().contains("10 mm"));
        assert!(scale_bar(1e-6, (400, 300)).into_string().contains("0.1 mm"));
        assert_eq!(scale_bar(0.0, (400, 300)).into_string(), "");
    }

    #[test]
    fn runs_of_instances_are_short() {
        assert_eq!(listed(&[1, 2, 3, 5, 7, 8]), "1–3, 5, 7, 8");
    }
}
