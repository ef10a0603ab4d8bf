//! PLY: text and both byte orders, clouds and meshes, every type of coordinate, index, list length, label and colour.

use super::numbers::Kind;
use super::{LABELS, POSITIONS, QUADS, Variant, levels};

#[derive(Clone, Copy, PartialEq)]
enum Format {
    Ascii,
    Little,
    Big,
}

const FORMATS: [Format; 3] = [Format::Ascii, Format::Little, Format::Big];

/// Both names of each type.
fn names(kind: Kind) -> [&'static str; 2] {
    match kind {
        Kind::I8 => ["char", "int8"],
        Kind::U8 => ["uchar", "uint8"],
        Kind::I16 => ["short", "int16"],
        Kind::U16 => ["ushort", "uint16"],
        Kind::I32 => ["int", "int32"],
        Kind::U32 => ["uint", "uint32"],
        Kind::F32 => ["float", "float32"],
        Kind::F64 => ["double", "float64"],
    }
}

/// A column of vertices.
struct Column {
    name: &'static str,
    kind: Kind,
    values: Vec<f64>,
}

/// What a file is like.
struct Style {
    format: Format,
    /// Which of the names of each type are used.
    naming: usize,
    coordinate: Kind,
    /// Types of a list's length and of indices, where there are faces.
    faces: Option<(Kind, Kind)>,
    columns: Vec<Column>,
}

impl Style {
    fn plain(format: Format) -> Self {
        Self { format, naming: 0, coordinate: Kind::F32, faces: None, columns: Vec::new() }
    }

    fn bytes(&self) -> Vec<u8> {
        let name = |kind: Kind| names(kind)[self.naming];
        let format = match self.format {
            Format::Ascii => "ascii",
            Format::Little => "binary_little_endian",
            Format::Big => "binary_big_endian",
        };
        let mut header = format!("ply\nformat {format} 1.0\nelement vertex {}\n", POSITIONS.len());
        for axis in ["x", "y", "z"] {
            header += &format!("property {} {axis}\n", name(self.coordinate));
        }
        for column in &self.columns {
            header += &format!("property {} {}\n", name(column.kind), column.name);
        }
        if let Some((length, index)) = self.faces {
            let count = QUADS.len();
            header += &format!("element face {count}\nproperty list {} {} vertex_indices\n", name(length), name(index));
        }
        let mut out = (header + "end_header\n").into_bytes();
        for (i, position) in POSITIONS.iter().enumerate() {
            let coordinates = position.iter().map(|c| (self.coordinate, f64::from(*c)));
            self.record(coordinates.chain(self.columns.iter().map(|c| (c.kind, c.values[i]))), &mut out);
        }
        if let Some((length, index)) = self.faces {
            for quad in QUADS {
                self.record([(length, 4.0)].into_iter().chain(quad.map(|v| (index, f64::from(v)))), &mut out);
            }
        }
        out
    }

    fn record(&self, numbers: impl Iterator<Item = (Kind, f64)>, out: &mut Vec<u8>) {
        if self.format == Format::Ascii {
            let words: Vec<String> = numbers.map(|(kind, value)| kind.rounded(value).to_string()).collect();
            out.extend((words.join(" ") + "\n").into_bytes());
            return;
        }
        for (kind, value) in numbers {
            let start = out.len();
            kind.append(value, out);
            if self.format == Format::Big {
                out[start..].reverse();
            }
        }
    }

    fn variant(&self, what: &str) -> Variant {
        let format = match self.format {
            Format::Ascii => "ascii",
            Format::Little => "little",
            Format::Big => "big",
        };
        let container = if self.faces.is_some() { "mesh" } else { "cloud" };
        let naming = ["", "-sized"][self.naming];
        let name = format!("{what}-{format}-{container}{naming}.ply");
        let mut variant = Variant::of_box(name, self.bytes(), self.faces.is_some());
        for column in &self.columns {
            let values = column.values.iter().map(|v| column.kind.rounded(*v)).collect();
            variant.columns.insert(column.name, values);
        }
        variant
    }
}

pub(crate) fn variants() -> Vec<Variant> {
    let mut variants = Vec::new();
    for format in FORMATS {
        for naming in [0, 1] {
            for coordinate in Kind::ALL {
                for faces in [None, Some((Kind::U8, Kind::I32))] {
                    let style = Style { naming, coordinate, faces, ..Style::plain(format) };
                    variants.push(style.variant(&format!("coordinate-{coordinate:?}")));
                }
            }
        }
        let whole = Kind::ALL.into_iter().filter(|kind| !matches!(kind, Kind::F32 | Kind::F64));
        for index in whole.clone() {
            for length in [Kind::U8, Kind::U16, Kind::I32, Kind::U32] {
                let style = Style { faces: Some((length, index)), ..Style::plain(format) };
                variants.push(style.variant(&format!("index-{index:?}-length-{length:?}")));
            }
        }
        for kind in Kind::ALL {
            for name in ["label", "scalar_label"] {
                let columns = vec![Column { name, kind, values: LABELS.map(f64::from).to_vec() }];
                let mut variant = Style { columns, ..Style::plain(format) }.variant(&format!("{name}-{kind:?}"));
                variant.labels = LABELS.map(u16::from).to_vec();
                variants.push(variant);
            }
        }
        let all = [["red", "green", "blue"], ["r", "g", "b"], ["diffuse_red", "diffuse_green", "diffuse_blue"]];
        for names in all {
            // A level of 255, and what stands for it.
            for (kind, full) in [
                (Kind::U8, 255.0),
                (Kind::U16, 65_535.0),
                (Kind::F32, 1.0),
                (Kind::F64, 1.0),
                (Kind::F32, 255.0),
                (Kind::I32, 255.0),
            ] {
                for faces in [None, Some((Kind::U8, Kind::I32))] {
                    let channel = |k: usize| {
                        let values = levels().iter().map(|c| f64::from(c[k]) / 255.0 * full).collect();
                        Column { name: names[k], kind, values }
                    };
                    let columns = (0..3).map(channel).collect();
                    let what = format!("{}-{kind:?}-{full}", names[0]);
                    let mut variant = Style { faces, columns, ..Style::plain(format) }.variant(&what);
                    variant.colors = levels();
                    variants.push(variant);
                }
            }
        }
    }
    variants
}
