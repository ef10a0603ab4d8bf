//! The vertices of a PLY file. Known columns (the table [`POINT_COLUMNS`]) are read whatever the type of their numbers, and
//! under the names that other programs give them.

use super::header::{Element, Kind, Property};
use super::read::PlyModel;
use super::values::Values;
use crate::levels::{Range, largest};
use semascan_model::{NumberType, POINT_COLUMNS, PointColumn, PointFlags, SemanticCloud, SemanticPoint};
use std::collections::BTreeMap;

/// Other names of numbers of the table: those of PCL, of older writers, and of labelled data sets.
const ALIASES: [(&str, &str); 14] = [
    ("normal_x", "nx"),
    ("normal_y", "ny"),
    ("normal_z", "nz"),
    ("r", "red"),
    ("g", "green"),
    ("b", "blue"),
    ("diffuse_red", "red"),
    ("diffuse_green", "green"),
    ("diffuse_blue", "blue"),
    ("labels", "label"),
    ("class", "label"),
    ("classification", "label"),
    ("semantic", "label"),
    ("class_id", "label"),
];

/// Where a property of a vertex goes.
#[derive(Clone, Copy, Debug)]
enum Target {
    /// A coordinate.
    Position(usize),
    /// A channel of the colour.
    Color(usize),
    /// Number `number` of another column.
    Number { column: &'static PointColumn, number: usize },
    /// A colour packed into one number, 0xAARRGGBB.
    Packed,
}

impl Target {
    /// The column that it belongs to, and which number of it.
    fn place(&self) -> (&'static str, usize) {
        match self {
            Self::Position(number) => ("position", *number),
            Self::Color(number) => ("color", *number),
            Self::Number { column, number } => (column.name, *number),
            Self::Packed => ("packed color", 0),
        }
    }
}

/// A property and how well its name fits: 0 as the table has it, 1 with capitals or `scalar_` before it, 2 by another name.
fn target(property: &Property) -> Option<(Target, u8)> {
    if property.list.is_some() {
        return None;
    }
    let find = |name: &str| {
        POINT_COLUMNS.iter().find_map(|column| {
            let number = column.number_names.iter().position(|n| *n == name)?;
            Some(match column.name {
                "position" => Target::Position(number),
                "color" => Target::Color(number),
                _ => Target::Number { column, number },
            })
        })
    };
    let lower = property.name.to_ascii_lowercase();
    // CloudCompare names scalar fields so.
    let bare = lower.strip_prefix("scalar_").unwrap_or(&lower);
    let alias = || ALIASES.iter().find(|(other, _)| *other == bare).and_then(|(_, name)| find(name));
    let packed = || (matches!(bare, "rgb" | "rgba") && property.kind.size() >= 4).then_some(Target::Packed);
    find(&property.name)
        .map(|t| (t, 0))
        .or_else(|| find(bare).map(|t| (t, 1)))
        .or_else(|| alias().map(|t| (t, 2)))
        .or_else(|| packed().map(|t| (t, 3)))
}

/// The property that is read for each number: the one whose name fits best, the first of several such.
fn targets(properties: &[Property]) -> Vec<Option<Target>> {
    let mut found: Vec<Option<(Target, u8)>> = properties.iter().map(target).collect();
    let mut best: BTreeMap<(&str, usize), (u8, usize)> = BTreeMap::new();
    for (i, (target, rank)) in found.iter().enumerate().filter_map(|(i, f)| Some((i, f.as_ref()?))) {
        let this = (*rank, i);
        best.entry(target.place()).and_modify(|b| *b = this.min(*b)).or_insert(this);
    }
    for (i, slot) in found.iter_mut().enumerate() {
        if slot.as_ref().is_some_and(|(target, _)| best.get(&target.place()).is_some_and(|b| b.1 != i)) {
            *slot = None;
        }
    }
    found.into_iter().map(|f| f.map(|(target, _)| target)).collect()
}

/// Reads the vertices into `model`; the names of properties that are not read go to `unread`.
pub(super) fn vertices(
    values: &mut Values<'_>,
    element: &Element,
    model: &mut PlyModel,
    unread: &mut Vec<String>,
) -> Result<(), String> {
    if !model.positions.is_empty() {
        return Err("there are two elements `vertex`".into());
    }
    let mut targets = targets(&element.properties);
    let given = |column: &PointColumn| {
        let mut numbers = 0..column.number_names.len();
        numbers.all(|k| targets.iter().flatten().any(|t| t.place() == (column.name, k)))
    };
    model.columns = POINT_COLUMNS.iter().filter(|c| given(c)).map(|c| c.name).collect();
    let packed = targets.iter().flatten().any(|t| matches!(t, Target::Packed));
    if packed && !model.has("color") {
        model.columns.push("color");
    } else if packed {
        targets.iter_mut().filter(|t| matches!(t, Some(Target::Packed))).for_each(|t| *t = None);
    }
    if element.count == 0 {
        return Ok(());
    }
    if !model.has("position") {
        return Err("vertices have no x, y and z".into());
    }
    let passed = element.properties.iter().zip(&targets).filter(|(_, t)| t.is_none());
    // Alpha says nothing of the surface.
    let passed = passed.filter(|(p, _)| !["alpha", "diffuse_alpha", "a"].contains(&p.name.as_str()));
    unread.extend(passed.map(|(p, _)| format!("vertex {}", p.name)));

    let mut colors = Vec::with_capacity(if model.has("color") { element.count } else { 0 });
    let mut unusable: BTreeMap<&str, usize> = BTreeMap::new();
    model.mesh.vertices = SemanticCloud::with_capacity(element.count);
    model.positions = Vec::with_capacity(element.count);
    for index in 0..element.count {
        let (mut point, mut position, mut color) = (SemanticPoint::UNKNOWN, [0.0; 3], [0.0; 3]);
        values.record(&element.name, index, |values| {
            for (property, target) in element.properties.iter().zip(&targets) {
                let Some(target) = *target else {
                    values.pass(property)?;
                    continue;
                };
                let value = values.next(property.kind)?;
                match target {
                    Target::Packed => color = unpacked(property.kind, value),
                    Target::Color(channel) => color[channel] = unsigned(property.kind, value),
                    Target::Position(axis) => position[axis] = value,
                    Target::Number { column, number } => {
                        let is_class = column.number_type == NumberType::U16;
                        if is_class && !((0.0..=f64::from(u16::MAX)).contains(&value) && value.fract() == 0.0) {
                            *unusable.entry(column.name).or_default() += 1;
                        } else {
                            (column.set)(&mut point, number, value);
                        }
                    }
                }
            }
            Ok(())
        })?;
        point.position = position.map(|c| c as f32);
        model.positions.push(position);
        model.mesh.boundary.push(point.flags.has(PointFlags::BOUNDARY));
        point.flags.0 &= !PointFlags::BOUNDARY;
        model.mesh.vertices.push(point);
        if model.has("color") {
            colors.push(color);
        }
    }
    for (column, count) in unusable {
        let reason = format!("{count} values of {column} are no whole numbers of 0 to 65535 and count as not known");
        model.warnings.push(reason);
    }
    let mut channels = element.properties.iter().zip(&targets).filter(|(_, t)| matches!(t, Some(Target::Color(_))));
    let has_fraction = channels.any(|(p, _)| p.kind.has_fraction());
    let range = Range::of(has_fraction, largest(colors.iter().flatten()));
    for (to, from) in model.mesh.vertices.colors.iter_mut().zip(colors) {
        *to = from.map(|channel| range.level(channel));
    }
    Ok(())
}

/// A colour's channel: languages without unsigned bytes write 255 as -1.
fn unsigned(kind: Kind, value: f64) -> f64 {
    if kind == Kind::I8 && value < 0.0 { value + 256.0 } else { value }
}

/// The channels of a packed colour: the number's bits, as the Point Cloud Library packs them.
fn unpacked(kind: Kind, value: f64) -> [f64; 3] {
    let bits = if kind.has_fraction() { (value as f32).to_bits() } else { value as i64 as u32 };
    [16, 8, 0].map(|shift| f64::from((bits >> shift) as u8))
}
