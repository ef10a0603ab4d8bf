//! How large the files will be, from counts of points and triangles.

use super::format::{Format, MeshFormat, PointFormat};
use crate::state::AppState;
use crate::state::export_choice::{Content, ExportChoice, Solids};
use semascan_model::{LengthUnit, ModelFigures, POINT_COLUMNS};

/// What the size of a file follows from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Amounts {
    /// Points or vertices.
    pub(super) points: u64,
    /// Triangles.
    pub(super) triangles: u64,
    /// Components that occur.
    pub(super) components: u64,
    /// Numbers at each vertex of a scene that say what it belongs to.
    pub(super) ids: u64,
}

/// About how many bytes the files of an export will have as `state` is; `None` where that cannot be known: nobody counts what a cut
/// leaves, and some files do not say the normals of their points.
pub fn estimate(state: &AppState, format: Format) -> Option<u64> {
    let choice = state.export;
    let is_cut = choice.content == Content::Kept && state.display.cut.is_on();
    let may_lack_normals = state.connection.is_file() && format == Format::Points(PointFormat::Glb);
    let amounts = match format {
        Format::Points(_) => of_points(state),
        Format::Mesh(_) => of_mesh(state),
    };
    if is_cut || may_lack_normals || amounts.points == 0 {
        return None;
    }
    Some(bytes_of(format, amounts, choice) + header(state, format))
}

/// Bytes of all vertices and triangles, and of what is said of each component.
pub(super) fn bytes_of(format: Format, amounts: Amounts, choice: ExportChoice) -> u64 {
    let Amounts { points, triangles, components, ids } = amounts;
    // Positions, normals and colours.
    let scene = points * (12 + 12 + 8 + 4 * ids) + 1500 + 2000 * ids + 1300 * components;
    match format {
        Format::Points(PointFormat::Ply) => points * row(),
        Format::Points(PointFormat::Glb) => scene,
        Format::Mesh(MeshFormat::Ply) => points * row() + 13 * triangles,
        Format::Mesh(MeshFormat::Glb) => scene + 12 * triangles,
        Format::Mesh(MeshFormat::Stl) if choice.solids == Solids::One => 84 + 50 * triangles,
        Format::Mesh(MeshFormat::Stl) => 84 * components + 50 * triangles,
        Format::Mesh(MeshFormat::Obj) => {
            // Coordinates have the digits that single precision needs; those of a part below one have zeros before them.
            let coordinate = if choice.frame.unit == LengthUnit::Metres { 11 } else { 10 };
            let digits = u64::from(points.max(1).ilog10()) + 1;
            points * (26 + 3 * coordinate + 29) + triangles * (11 + 6 * digits) + 100 * components
        }
    }
}

/// Bytes of a point in a PLY.
fn row() -> u64 {
    POINT_COLUMNS.iter().map(|column| (column.number_names.len() * column.number_type.size()) as u64).sum()
}

/// Bytes before the first point.
fn header(state: &AppState, format: Format) -> u64 {
    match format {
        // A line for each property and class.
        Format::Points(PointFormat::Ply) | Format::Mesh(MeshFormat::Ply) => {
            700 + 36 * (state.legend.rows.len() + state.legend.defects.len()) as u64
        }
        _ => 0,
    }
}

fn of_points(state: &AppState) -> Amounts {
    let (legend, all) = (&state.legend, state.export.content == Content::All);
    let points = if all { legend.held_points() } else { legend.visible_points() };
    let occurring = legend.rows.iter().filter(|row| (all || row.visible) && row.count.held > 0).count();
    Amounts { points, triangles: 0, components: occurring as u64, ids: ids(state) }
}

fn of_mesh(state: &AppState) -> Amounts {
    let all = state.export.content == Content::All;
    let mut amounts = Amounts { points: 0, triangles: 0, components: 0, ids: ids(state) };
    for (class, part) in (0..).zip(&state.features.mesh.parts) {
        if part.triangles > 0 && (all || state.legend.visible(class)) {
            amounts.points += part.vertices;
            amounts.triangles += part.triangles;
            amounts.components += 1;
        }
    }
    if let Some(most) = state.export.detail.most(amounts.triangles as usize) {
        // A surface has a vertex for each two triangles, however fine.
        amounts.points = amounts.points * most as u64 / amounts.triangles.max(1);
        amounts.triangles = most as u64;
    }
    amounts
}

/// Component; defect and instance, where the model is known to have such.
fn ids(state: &AppState) -> u64 {
    let figures = state.measured.as_ref().or(state.features.mesh.figures.as_ref());
    let of = |ModelFigures { findings, instances, .. }: &ModelFigures| {
        u64::from(!findings.is_empty()) + u64::from(!instances.is_empty())
    };
    1 + figures.map_or(0, of)
}
