//! SVG 1.1: the section true to scale, a user unit being a millimetre, with a title, a legend and a scale bar.

use super::{Drawing, MM, corners};
use semascan_geometry::section::Place;
use std::fmt::Write;

/// Room around the section, and sizes of what is written beside it, millimetres.
const MARGIN: f64 = 6.0;
const TEXT: f64 = 3.0;
const LEAD: f64 = 4.5;
/// Widths of outlines and of other lines.
const LINE: f64 = 0.25;
const THIN: f64 = 0.1;
/// Least width of the page, for the text.
const LEAST_WIDTH: f64 = 90.0;
/// Length of the scale bar as a share of the section's width, at most.
const BAR: f64 = 0.4;

/// The drawing as a text.
pub fn write(drawing: &Drawing<'_>) -> String {
    let runs: Vec<_> = drawing.runs().collect();
    let [low, high] = corners(runs.iter().flat_map(|run| &run.places));
    let [wide, tall] = [high[0] - low[0], high[1] - low[1]];
    let labels = drawing.labels();
    let head = MARGIN + LEAD * (1.0 + drawing.notes.len() as f64);
    let foot = LEAD * (labels.len() as f64 + 2.0) + MARGIN;
    let (width, height) = ((wide + 2.0 * MARGIN).max(LEAST_WIDTH), head + tall + 2.0 * MARGIN + foot);
    // On the page y goes down.
    let on_page = |place: Place| [place[0] - low[0] + MARGIN, high[1] - place[1] + head + MARGIN];

    let mut svg = String::new();
    let mut line = |text: std::fmt::Arguments<'_>| {
        // Writing to a string does not fail.
        let _ = svg.write_fmt(text);
        svg.push('\n');
    };
    line(format_args!("<?xml version=\"1.0\" encoding=\"UTF-8\"?>"));
    line(format_args!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" version=\"1.1\" width=\"{width:.3}mm\" height=\"{height:.3}mm\" \
         viewBox=\"0 0 {width:.3} {height:.3}\">"
    ));
    line(format_args!("<title>{}</title>", escaped(&format!("Section of {}", drawing.part))));
    line(format_args!("<desc>{}</desc>", escaped(&drawing.notes.join("; "))));
    line(format_args!(
        "<defs><pattern id=\"hatch\" width=\"2\" height=\"2\" patternUnits=\"userSpaceOnUse\" \
         patternTransform=\"rotate(45)\"><rect width=\"2\" height=\"2\" fill=\"#e9edf2\"/>\
         <path d=\"M0 0V2\" stroke=\"#7c8796\" stroke-width=\"{THIN}\"/></pattern></defs>"
    ));
    line(format_args!("<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>"));

    let rings: String = drawing
        .section
        .rings
        .iter()
        .map(|ring| path(ring.iter().map(|place| on_page(place.map(|c| c * MM))), true))
        .collect();
    if !rings.is_empty() {
        line(format_args!(
            "<path id=\"enclosed\" fill=\"url(#hatch)\" fill-rule=\"evenodd\" stroke=\"none\" d=\"{rings}\"/>"
        ));
    }
    for &label in &labels {
        let [r, g, b] = drawing.color(label);
        line(format_args!(
            "<g class=\"component\" data-class=\"{label}\" data-name=\"{}\" fill=\"none\" stroke=\"#{r:02x}{g:02x}{b:02x}\" \
             stroke-width=\"{LINE}\" stroke-linejoin=\"round\">",
            escaped(drawing.name(label))
        ));
        for run in runs.iter().filter(|run| run.label == label) {
            line(format_args!("<path d=\"{}\"/>", path(run.places.iter().map(|place| on_page(*place)), run.is_closed)));
        }
        line(format_args!("</g>"));
    }
    let rims: Vec<Place> = drawing.section.outlines.iter().flat_map(|outline| outline.rims()).collect();
    if !rims.is_empty() {
        line(format_args!("<g class=\"open-ends\" fill=\"#b04a00\">"));
        for [x, y] in rims.iter().map(|place| on_page(place.map(|c| c * MM))) {
            line(format_args!("<rect x=\"{:.3}\" y=\"{:.3}\" width=\"0.8\" height=\"0.8\"/>", x - 0.4, y - 0.4));
        }
        line(format_args!("</g>"));
    }

    line(format_args!("<g font-family=\"sans-serif\" font-size=\"{TEXT}\" fill=\"#161b21\">"));
    let mut y = MARGIN;
    line(format_args!(
        "<text x=\"{MARGIN}\" y=\"{y:.3}\" font-weight=\"bold\">{}</text>",
        escaped(&format!("Section of {}", drawing.part))
    ));
    for note in drawing.notes {
        y += LEAD;
        line(format_args!("<text x=\"{MARGIN}\" y=\"{y:.3}\">{}</text>", escaped(note)));
    }
    y = head + tall + 2.0 * MARGIN + LEAD;
    let bar = round_length(wide.max(10.0) * BAR);
    line(format_args!(
        "<path id=\"scale-bar\" d=\"M{MARGIN} {:.3}v1.5h{bar}v-1.5\" fill=\"none\" stroke=\"#161b21\" stroke-width=\"{LINE}\"/>",
        y - 1.5
    ));
    line(format_args!("<text x=\"{:.3}\" y=\"{y:.3}\">{bar} mm</text>", MARGIN + bar + 1.5));
    for &label in &labels {
        y += LEAD;
        let [r, g, b] = drawing.color(label);
        line(format_args!(
            "<rect x=\"{MARGIN}\" y=\"{:.3}\" width=\"{TEXT}\" height=\"{TEXT}\" fill=\"#{r:02x}{g:02x}{b:02x}\"/>",
            y - 2.6
        ));
        line(format_args!(
            "<text x=\"{:.3}\" y=\"{y:.3}\">{}</text>",
            MARGIN + TEXT + 1.5,
            escaped(drawing.name(label))
        ));
    }
    line(format_args!("</g>"));
    line(format_args!("</svg>"));
    svg
}

/// Places as the commands of a path, to a thousandth of a millimetre.
fn path(places: impl Iterator<Item = Place>, is_closed: bool) -> String {
    let mut path = String::new();
    for (index, [x, y]) in places.enumerate() {
        let _ = write!(path, "{}{x:.3} {y:.3}", if index == 0 { "M" } else { "L" });
    }
    if is_closed {
        path.push('Z');
    }
    path
}

/// 1, 2 or 5 times a power of ten, not above `most`.
fn round_length(most: f64) -> f64 {
    let power = 10_f64.powf(most.log10().floor());
    let digit = [5.0, 2.0, 1.0].into_iter().find(|digit| digit * power <= most * 1.000_001).unwrap_or(1.0);
    digit * power
}

/// A text that says the same between tags and in attributes. What XML has no place for is left out.
fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\t' => escaped.push(' '),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => {}
            c => escaped.push(c),
        }
    }
    escaped
}
