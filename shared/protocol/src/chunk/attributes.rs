//! Everything a point knows besides its voxel, predicted from the points before it in raster order.
//!
//! Surfaces are smooth: the voxels around a point that are already coded lie on the same patch, carry nearly the same
//! colour and almost always the same labels. What is coded is the difference, under models chosen by how much the
//! neighbours differ among themselves.

use super::model::{Coder, Model, Plane, ResidualModel};
use super::neighbours::{COLOR, INNER, NORMAL, Neighbours, SHARES, Surroundings, VIEWS};
use super::planes::Planes;
use super::{QUANTA_PER_VOXEL, octahedral};

/// Adaptive state of all attributes; new for each chunk, because chunks are decoded on their own.
struct Models {
    /// By axis and by which of the two face neighbours along it are occupied.
    tangential: [[Model; 4]; 3],
    /// Along the normal, by how much is known around.
    along_normal: [Model; 4],
    /// Whether the normal is known, by whether the nearest neighbour's is.
    normal_known: [Model; 2],
    normal: [[ResidualModel; 2]; 4],
    color: [[ResidualModel; 3]; 6],
    changed: [Model; 3],
    mark: [[ResidualModel; 2]; 4],
    share: [[ResidualModel; 4]; 4],
    views: [[ResidualModel; 2]; 3],
}

impl Models {
    fn new() -> Self {
        let residual = ResidualModel::new;
        Self {
            tangential: repeat(|| repeat(|| Model::flat(QUANTA_PER_VOXEL as usize))),
            along_normal: repeat(|| Model::flat(QUANTA_PER_VOXEL as usize)),
            normal_known: repeat(|| Model::uniform(2)),
            normal: repeat(|| repeat(residual)),
            color: repeat(|| repeat(residual)),
            changed: repeat(|| Model::uniform(16)),
            mark: repeat(|| repeat(residual)),
            share: repeat(|| repeat(residual)),
            views: repeat(|| repeat(residual)),
        }
    }
}

fn repeat<T, const N: usize>(mut make: impl FnMut() -> T) -> [T; N] {
    std::array::from_fn(|_| make())
}

/// What is the same for the whole chunk and then need not be coded point by point.
struct Shape {
    /// Shares that are the same everywhere, and their value.
    constant_shares: [Option<u8>; 4],
    /// Whether the normals are known, if that is the same everywhere.
    normals_known: Option<bool>,
    /// The number of views, if it is the same everywhere.
    constant_views: Option<u16>,
    /// No number of views is over 255.
    few_views: bool,
}

impl Shape {
    fn code<C: Coder>(coder: &mut C, planes: &Planes) -> Self {
        coder.enter(Plane::Shares);
        let first = planes.shares.first().copied().unwrap_or_default();
        let mut constant_shares = [None; 4];
        for (k, constant) in constant_shares.iter_mut().enumerate() {
            let all = planes.shares.iter().all(|s| s[k] == first[k]);
            if coder.bits(all.into(), 1) == 1 {
                *constant = Some(coder.bits(first[k], 8));
            }
        }
        coder.enter(Plane::Normal);
        let known = |n: &[u8; 2]| *n != octahedral::UNKNOWN;
        let normals_known = match (planes.normals.iter().any(known), planes.normals.iter().all(known)) {
            (_, true) => 0,
            (false, _) => 1,
            _ => 2,
        };
        let normals_known = match coder.bits(normals_known, 2) {
            0 => Some(true),
            1 => Some(false),
            _ => None,
        };
        coder.enter(Plane::Views);
        let first = planes.views.first().copied().unwrap_or_default();
        let constant = planes.views.iter().all(|&v| v == first);
        let constant_views = (coder.bits(constant.into(), 1) == 1)
            .then(|| u16::from_le_bytes(first.to_le_bytes().map(|byte| coder.bits(byte, 8))));
        let few_views = coder.bits(planes.views.iter().all(|&v| v < 256).into(), 1) == 1;
        Self { constant_shares, normals_known, constant_views, few_views }
    }
}

/// Codes all columns but the cells, which are known on both sides.
pub(super) fn code<C: Coder>(coder: &mut C, planes: &mut Planes, neighbours: &mut Neighbours) {
    let shape = Shape::code(coder, planes);
    let mut models = Models::new();
    neighbours.begin(&planes.cells);
    for i in 0..planes.len() {
        let around = neighbours.around(planes, i);
        let known = shape.normals_known.unwrap_or_else(|| normal_known(coder, &mut models, planes, i, &around));
        planes.normals[i] = match known {
            true => normal(coder, &mut models, planes.normals[i], &around),
            false => octahedral::UNKNOWN,
        };
        planes.inner[i] = position(coder, &mut models, planes.inner[i], planes.normals[i], &around);
        planes.colors[i] = color(coder, &mut models, planes.colors[i], &around);
        let expected = around.nearest.and_then(|j| planes.marks.get(j)).copied().unwrap_or_default();
        planes.marks[i] = marks(coder, &mut models, planes.marks[i], expected, &around);
        planes.shares[i] = shares(coder, &mut models, planes.shares[i], &shape, &around);
        planes.views[i] = views(coder, &mut models, planes.views[i], &shape, &around);
        neighbours.add(planes, i, &around);
    }
}

fn normal_known<C: Coder>(
    coder: &mut C,
    models: &mut Models,
    planes: &Planes,
    i: usize,
    around: &Surroundings,
) -> bool {
    coder.enter(Plane::Normal);
    let known = |j: usize| planes.normals[j] != octahedral::UNKNOWN;
    let model = &mut models.normal_known[usize::from(around.nearest.is_none_or(known))];
    coder.symbol(model, known(i).into()) == 1
}

fn normal<C: Coder>(coder: &mut C, models: &mut Models, normal: [u8; 2], around: &Surroundings) -> [u8; 2] {
    coder.enter(Plane::Normal);
    let context = match around.spread[NORMAL] + around.spread[NORMAL + 1] {
        0..=5 if around.count > 1 => 0,
        6..=16 => 1,
        17..=44 => 2,
        _ => 3,
    };
    let mut coded = [0; 2];
    for (k, model) in models.normal[context].iter_mut().enumerate() {
        coded[k] = model.code(coder, normal[k], around.mean[NORMAL + k] as u8);
    }
    coded
}

/// Two coordinates as they come, the third from the plane through the neighbours: along the axis nearest to the normal
/// the surface leaves little freedom.
fn position<C: Coder>(
    coder: &mut C,
    models: &mut Models,
    inner: [u8; 3],
    normal: [u8; 2],
    around: &Surroundings,
) -> [u8; 3] {
    coder.enter(Plane::Position);
    let direction = octahedral::direction(normal);
    let steepest = (0..3).max_by_key(|&a| direction[a].abs()).filter(|_| around.count > 0 && direction != [0; 3]);
    let mut coded = [0; 3];
    let mut slope = 0;
    for a in (0..3).filter(|&a| Some(a) != steepest) {
        let [below, above] = around.faces[a];
        let model = &mut models.tangential[a][usize::from(below) * 2 + usize::from(above)];
        coded[a] = coder.symbol(model, inner[a]);
        slope += direction[a] * (i32::from(around.mean[INNER + a]) - i32::from(coded[a]));
    }
    if let Some(a) = steepest {
        let quanta = QUANTA_PER_VOXEL;
        let predicted = (i32::from(around.mean[INNER + a]) + slope / direction[a]).clamp(0, quanta - 1);
        let context = match around.weight {
            0..=2 => 0,
            3..=5 => 1,
            6..=9 => 2,
            _ => 3,
        };
        let residual = (i32::from(inner[a]) - predicted).rem_euclid(quanta) as u8;
        let residual = coder.symbol(&mut models.along_normal[context], residual);
        coded[a] = (i32::from(residual) + predicted).rem_euclid(quanta) as u8;
    }
    coded
}

/// Green first; red and blue are expected to differ from their means as green did.
fn color<C: Coder>(coder: &mut C, models: &mut Models, color: [u8; 3], around: &Surroundings) -> [u8; 3] {
    coder.enter(Plane::Color);
    let context = match around.spread[COLOR] + around.spread[COLOR + 1] + around.spread[COLOR + 2] {
        _ if around.count < 2 => 5,
        0..=12 => 0,
        13..=24 => 1,
        25..=48 => 2,
        49..=96 => 3,
        _ => 4,
    };
    let [red_model, green_model, blue_model] = &mut models.color[context];
    let [red, green, blue] = [0, 1, 2].map(|k| around.mean[COLOR + k]);
    let told_green = green_model.code(coder, color[1], green as u8);
    let beyond = i16::from(told_green) - green;
    let shifted = |mean: i16| (mean + beyond).clamp(0, 255) as u8;
    let told_red = red_model.code(coder, color[0], shifted(red));
    let told_blue = blue_model.code(coder, color[2], shifted(blue));
    [told_red, told_green, told_blue]
}

/// One symbol says which of label, defect, instance and flags differ from the nearest neighbour's.
fn marks<C: Coder>(
    coder: &mut C,
    models: &mut Models,
    marks: [u16; 4],
    expected: [u16; 4],
    around: &Surroundings,
) -> [u16; 4] {
    coder.enter(Plane::Label);
    let context = if around.count == 0 { 2 } else { usize::from(around.uniform) };
    let changed = (0..4).fold(0, |bits, k| bits | u8::from(marks[k] != expected[k]) << k);
    let changed = coder.symbol(&mut models.changed[context], changed);
    let mut coded = expected;
    for k in (0..4).filter(|k| changed >> k & 1 == 1) {
        coder.enter(if k == 0 { Plane::Label } else { Plane::Marks });
        let mut bytes = marks[k].to_le_bytes();
        for (byte, model) in bytes.iter_mut().zip(&mut models.mark[k]) {
            *byte = model.code(coder, *byte, 0);
        }
        coded[k] = u16::from_le_bytes(bytes);
    }
    coded
}

fn shares<C: Coder>(
    coder: &mut C,
    models: &mut Models,
    shares: [u8; 4],
    shape: &Shape,
    around: &Surroundings,
) -> [u8; 4] {
    coder.enter(Plane::Shares);
    let mut coded = [0; 4];
    let mut surprise = 0;
    for k in 0..4 {
        if let Some(constant) = shape.constant_shares[k] {
            coded[k] = constant;
            continue;
        }
        let expected = around.mean[SHARES + k] as u8;
        let context = match around.spread[SHARES + k] {
            0 if around.count > 0 => 0,
            0..=8 => 1,
            _ => 2,
        };
        let context = if surprise > 2 { 3 } else { context };
        coded[k] = models.share[context][k].code(coder, shares[k], expected);
        surprise = coded[k].abs_diff(expected);
    }
    coded
}

fn views<C: Coder>(coder: &mut C, models: &mut Models, views: u16, shape: &Shape, around: &Surroundings) -> u16 {
    if let Some(constant) = shape.constant_views {
        return constant;
    }
    coder.enter(Plane::Views);
    let context = match around.spread[VIEWS] {
        0 => 0,
        1..=3 => 1,
        _ => 2,
    };
    let [low, high] = views.to_le_bytes();
    let [low_model, high_model] = &mut models.views[context];
    let expected = around.mean[VIEWS].to_le_bytes();
    let low = low_model.code(coder, low, expected[0]);
    let high = if shape.few_views { 0 } else { high_model.code(coder, high, expected[1]) };
    u16::from_le_bytes([low, high])
}
