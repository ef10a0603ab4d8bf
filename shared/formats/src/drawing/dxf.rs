//! DXF of AutoCAD release 12 (AC1009), in ASCII: the form that every program reads. A POLYLINE for each stretch of an outline that is
//! of one component, on a layer of its own; POINTs where outlines are open. The format has no word for units: they are
//! millimetres, as a comment and a text beside the drawing say.

use super::{Drawing, MM, corners};
use semascan_geometry::section::Place;
use semascan_model::Color;
use std::collections::BTreeMap;
use std::fmt::{Display, Write};

/// Longest name of a layer.
const NAME: usize = 31;
/// Height of texts and their distance, millimetres.
const TEXT: f64 = 3.0;
const LEAD: f64 = 4.5;
const NOTES: &str = "NOTES";
const OPEN_ENDS: &str = "OPEN_ENDS";

/// Group codes with their values, a line each.
struct Groups(String);

impl Groups {
    fn add(&mut self, code: u16, value: impl Display) {
        // Writing to a string does not fail. Files of this age end their lines so.
        let _ = write!(self.0, "{code:>3}\r\n{value}\r\n");
    }

    /// A coordinate in millimetres, to a hundred-thousandth.
    fn number(&mut self, code: u16, value: f64) {
        self.add(code, format_args!("{:.5}", value + 0.0));
    }

    fn place(&mut self, [x, y]: Place) {
        self.number(10, x);
        self.number(20, y);
        self.number(30, 0.0);
    }

    fn begin(&mut self, section: &str) {
        self.add(0, "SECTION");
        self.add(2, section);
    }
}

/// The drawing as a text: one byte a letter.
pub fn write(drawing: &Drawing<'_>) -> String {
    let runs: Vec<_> = drawing.runs().collect();
    let [low, high] = corners(runs.iter().flat_map(|run| &run.places));
    let layers = layers(drawing);
    let layer = |label: u16| layers.get(&label).map_or("0", |(name, _)| name.as_str());
    let rims: Vec<Place> = drawing.section.outlines.iter().flat_map(|outline| outline.rims()).collect();

    let mut dxf = Groups(String::new());
    dxf.add(999, "Units: millimetres");
    dxf.begin("HEADER");
    dxf.add(9, "$ACADVER");
    dxf.add(1, "AC1009");
    for (name, [x, y]) in [("$EXTMIN", low), ("$EXTMAX", high)] {
        dxf.add(9, name);
        dxf.place([x, y]);
    }
    dxf.add(0, "ENDSEC");

    dxf.begin("TABLES");
    dxf.add(0, "TABLE");
    dxf.add(2, "LTYPE");
    dxf.add(70, 1);
    dxf.add(0, "LTYPE");
    dxf.add(2, "CONTINUOUS");
    dxf.add(70, 0);
    dxf.add(3, "Solid line");
    dxf.add(72, 65);
    dxf.add(73, 0);
    dxf.number(40, 0.0);
    dxf.add(0, "ENDTAB");
    dxf.add(0, "TABLE");
    dxf.add(2, "LAYER");
    dxf.add(70, layers.len() + 3);
    let others = [("0", 7), (NOTES, 7), (OPEN_ENDS, 30)];
    for (name, color) in layers.values().map(|(name, color)| (name.as_str(), *color)).chain(others) {
        dxf.add(0, "LAYER");
        dxf.add(2, name);
        dxf.add(70, 0);
        dxf.add(62, color);
        dxf.add(6, "CONTINUOUS");
    }
    dxf.add(0, "ENDTAB");
    dxf.add(0, "ENDSEC");

    dxf.begin("ENTITIES");
    for run in &runs {
        let name = layer(run.label);
        dxf.add(0, "POLYLINE");
        dxf.add(8, name);
        dxf.add(66, 1);
        dxf.place([0.0; 2]);
        dxf.add(70, u8::from(run.is_closed));
        for place in &run.places {
            dxf.add(0, "VERTEX");
            dxf.add(8, name);
            dxf.place(*place);
        }
        dxf.add(0, "SEQEND");
        dxf.add(8, name);
    }
    for rim in rims {
        dxf.add(0, "POINT");
        dxf.add(8, OPEN_ENDS);
        dxf.place(rim.map(|c| c * MM));
    }
    let title = format!("Section of {}", drawing.part);
    let units = "Units: millimetres".to_owned();
    for (index, text) in [&title].into_iter().chain(drawing.notes).chain([&units]).enumerate() {
        dxf.add(0, "TEXT");
        dxf.add(8, NOTES);
        dxf.place([low[0], low[1] - LEAD * (index as f64 + 2.0)]);
        dxf.number(40, TEXT);
        dxf.add(1, plain(text));
    }
    dxf.add(0, "ENDSEC");
    dxf.add(0, "EOF");
    dxf.0
}

/// Name and colour of each component's layer; names are unlike each other.
fn layers(drawing: &Drawing<'_>) -> BTreeMap<u16, (String, u8)> {
    let mut layers: BTreeMap<u16, (String, u8)> = BTreeMap::new();
    for label in drawing.labels() {
        let mut name = layer_name(drawing.name(label));
        let is_taken =
            layers.values().any(|(other, _)| *other == name) || [NOTES, OPEN_ENDS, "0"].contains(&name.as_str());
        if is_taken {
            let number = format!("_{label}");
            name.truncate(NAME - number.len());
            name.push_str(&number);
        }
        layers.insert(label, (name, color_index(drawing.color(label))));
    }
    layers
}

/// A name of the letters that layers may have.
fn layer_name(name: &str) -> String {
    let letter = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_uppercase() } else { '_' };
    let name: String = name.chars().take(NAME).map(letter).collect();
    if name.is_empty() { "_".into() } else { name }
}

/// A text of printable ASCII, on one line.
fn plain(text: &str) -> String {
    let letter = |c: char| match c {
        '\u{2212}' | '–' => '-',
        ' '..='~' => c,
        c if c.is_whitespace() => ' ',
        _ => '?',
    };
    text.chars().map(letter).collect()
}

/// The nearest of the format's colours: of 24 hues at full strength, or grey.
fn color_index([r, g, b]: Color) -> u8 {
    let [r, g, b] = [r, g, b].map(f64::from);
    let (most, least) = (r.max(g).max(b), r.min(g).min(b));
    if most - least < 0.15 * most.max(1.0) {
        return 8;
    }
    let sixth = if most == r {
        (g - b) / (most - least)
    } else if most == g {
        2.0 + (b - r) / (most - least)
    } else {
        4.0 + (r - g) / (most - least)
    };
    // Hues are 15 degrees apart, and ten numbers.
    10 + 10 * ((sixth * 4.0).round().rem_euclid(24.0) as u8)
}
