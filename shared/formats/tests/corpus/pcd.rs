//! PCD: text, binary and packed; every type of coordinate, label and colour.

use super::numbers::Kind;
use super::{LABELS, POSITIONS, Variant, levels};

const STORAGES: [&str; 3] = ["ascii", "binary", "binary_compressed"];

/// Letter of a type.
fn letter(kind: Kind) -> char {
    match kind {
        Kind::I8 | Kind::I16 | Kind::I32 => 'I',
        Kind::U8 | Kind::U16 | Kind::U32 => 'U',
        Kind::F32 | Kind::F64 => 'F',
    }
}

/// A field of a point.
struct Field {
    name: &'static str,
    kind: Kind,
    values: Vec<f64>,
}

fn coordinates(kind: Kind) -> Vec<Field> {
    let axis = |k: usize| Field {
        name: ["x", "y", "z"][k],
        kind,
        values: POSITIONS.iter().map(|p| f64::from(p[k])).collect(),
    };
    (0..3).map(axis).collect()
}

fn bytes(storage: &str, fields: &[Field]) -> Vec<u8> {
    let line = |key: &str, of: &dyn Fn(&Field) -> String| {
        format!("{key} {}\n", fields.iter().map(of).collect::<Vec<_>>().join(" "))
    };
    let points = POSITIONS.len();
    let header = [
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n".to_owned(),
        line("FIELDS", &|f| f.name.to_owned()),
        line("SIZE", &|f| f.kind.size().to_string()),
        line("TYPE", &|f| letter(f.kind).to_string()),
        line("COUNT", &|_| "1".to_owned()),
        format!("WIDTH {points}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {points}\nDATA {storage}\n"),
    ];
    let mut out = header.concat().into_bytes();
    match storage {
        "ascii" => {
            for i in 0..points {
                let words: Vec<String> =
                    fields
                        .iter()
                        .map(|f| {
                            if f.kind == Kind::F32 { (f.values[i] as f32).to_string() } else { f.values[i].to_string() }
                        })
                        .collect();
                out.extend((words.join(" ") + "\n").into_bytes());
            }
        }
        "binary" => {
            for i in 0..points {
                fields.iter().for_each(|f| f.kind.append(f.values[i], &mut out));
            }
        }
        _ => {
            let mut plain = Vec::new();
            fields.iter().for_each(|f| f.values.iter().for_each(|v| f.kind.append(*v, &mut plain)));
            // LZF of literals alone.
            let packed: Vec<u8> = plain.chunks(32).flat_map(|c| [&[c.len() as u8 - 1], c].concat()).collect();
            out.extend((packed.len() as u32).to_le_bytes());
            out.extend((plain.len() as u32).to_le_bytes());
            out.extend(packed);
        }
    }
    out
}

fn variant(what: &str, storage: &str, fields: &[Field]) -> Variant {
    let mut variant = Variant::of_box(format!("{what}-{storage}.pcd"), bytes(storage, fields), false);
    variant.columns = fields.iter().map(|f| (f.name, f.values.clone())).collect();
    variant
}

pub(crate) fn variants() -> Vec<Variant> {
    let mut variants = Vec::new();
    for storage in STORAGES {
        for kind in Kind::ALL {
            variants.push(variant(&format!("coordinate-{kind:?}"), storage, &coordinates(kind)));
            let mut fields = coordinates(Kind::F32);
            fields.push(Field { name: "label", kind, values: LABELS.map(f64::from).to_vec() });
            let mut labelled = variant(&format!("label-{kind:?}"), storage, &fields);
            labelled.labels = LABELS.map(u16::from).to_vec();
            variants.push(labelled);
        }
        let packed = |c: &[u8; 3]| u32::from_be_bytes([0, c[0], c[1], c[2]]);
        for (name, kind) in [("rgb", Kind::F32), ("rgb", Kind::U32), ("rgba", Kind::U32), ("rgb", Kind::I32)] {
            let value = |c: &[u8; 3]| match kind {
                Kind::F32 => f64::from(f32::from_bits(packed(c))),
                _ => f64::from(packed(c)),
            };
            let mut fields = coordinates(Kind::F32);
            fields.push(Field { name, kind, values: levels().iter().map(value).collect() });
            let mut colored = variant(&format!("{name}-{kind:?}"), storage, &fields);
            colored.colors = levels();
            // Denormal numbers do not survive every reader's text.
            colored.foreign = kind != Kind::F32;
            variants.push(colored);
        }
    }
    variants
}
