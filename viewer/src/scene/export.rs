//! The visible part of the model as the bytes of a file. The writers are those of `semascan inspect` and
//! `semascan export`.

use crate::state::export_choice::Solids;
use crate::state::{AppState, units};
use semascan_formats::gltf::{self, GlbOptions};
use semascan_formats::{ExportFilter, WriteError, components, file_part, obj, ply, stl};
use semascan_geometry::measure::model_figures;
use semascan_geometry::mesh::decimate;
use semascan_model::{ModelFigures, SemanticCloud, SemanticMesh};

/// A file to export the model's points to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PointFormat {
    /// A point cloud.
    Ply,
    /// A scene with a node by component.
    Glb,
}

impl PointFormat {
    /// Ending of the file's name.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Ply => "ply",
            Self::Glb => "glb",
        }
    }

    /// Media type of the file.
    pub fn mime(self) -> &'static str {
        match self {
            Self::Ply => "application/octet-stream",
            Self::Glb => "model/gltf-binary",
        }
    }
}

/// A file to export the model's mesh to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshFormat {
    /// With all it knows.
    Ply,
    /// Objects and materials by component, in two files.
    Obj,
    /// Solids without more, by component or as one.
    Stl,
    /// A scene with a node by component.
    Glb,
}

impl MeshFormat {
    /// Media type of the files.
    pub fn mime(self) -> &'static str {
        match self {
            Self::Ply => "application/octet-stream",
            Self::Obj => "model/obj",
            Self::Stl => "model/stl",
            Self::Glb => "model/gltf-binary",
        }
    }
}

/// A file that is ready to be saved.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExportFile {
    /// Name of the file, from the part's name.
    pub name: String,
    /// Its content.
    pub bytes: Vec<u8>,
    /// Number of points or triangles in it.
    pub count: usize,
    /// Number of points or triangles of the model that it does not hold, because they are hidden.
    pub left_out: usize,
}

/// Writes the points of the model `whole` (table frame, metres) that `state` shows.
///
/// # Errors
/// [`WriteError`] if the model is too large for the format.
pub fn export_points(whole: &SemanticCloud, state: &AppState, format: PointFormat) -> Result<ExportFile, WriteError> {
    let (filter, count) = (filter(state), whole.len());
    let cloud = filter.apply(whole);
    let taxonomy = state.inspection.taxonomy();
    let inspection = &state.inspection;
    let mut bytes = Vec::new();
    match format {
        PointFormat::Ply => {
            ply::write_cloud(&mut bytes, &cloud, &taxonomy, &comments(state))?;
        }
        PointFormat::Glb => {
            let figures = figures(state, whole);
            let options = GlbOptions { part: inspection.part.clone(), figures, ..GlbOptions::default() };
            gltf::write_points(&mut bytes, &cloud, &taxonomy, &options)?;
        }
    }
    let name = format!("{}.{}", units::file_stem(&inspection.part), format.extension());
    Ok(ExportFile { name, bytes, count: cloud.len(), left_out: count - cloud.len() })
}

/// Writes the visible components of `mesh`, as fine and in the frame that the person chose.
///
/// # Errors
/// [`WriteError`] if the mesh is too large for the format.
pub fn export_mesh(mesh: &SemanticMesh, state: &AppState, format: MeshFormat) -> Result<Vec<ExportFile>, WriteError> {
    let filter = filter(state);
    let all = mesh.triangles.len();
    let mut mesh = mesh.select(|t| !filter.hidden_labels.contains(&mesh.triangle_label(t)));
    let left_out = all - mesh.triangles.len();
    let choice = state.export;
    if let Some(most) = choice.detail.most(mesh.triangles.len())
        && let Ok(simpler) = decimate(&mesh, most, &())
    {
        mesh = simpler;
    }
    let (taxonomy, inspection) = (state.inspection.taxonomy(), &state.inspection);
    let stem = format!("{}-mesh", units::file_stem(&inspection.part));
    let count = mesh.triangles.len();
    let mut bytes = Vec::new();
    Ok(match format {
        MeshFormat::Ply => {
            ply::write_semantic_mesh(&mut bytes, &mesh, &taxonomy, &comments(state))?;
            vec![ExportFile { name: format!("{stem}.ply"), bytes, count, left_out }]
        }
        MeshFormat::Obj => {
            let (library, mut materials) = (format!("{stem}.mtl"), Vec::new());
            obj::write_mesh(&mut bytes, &mesh, &taxonomy, &library, choice.frame)?;
            obj::write_materials(&mut materials, &mesh, &taxonomy)?;
            vec![
                ExportFile { name: format!("{stem}.obj"), bytes, count, left_out },
                ExportFile { name: library, bytes: materials, count, left_out },
            ]
        }
        MeshFormat::Stl if choice.solids == Solids::One => {
            stl::write_mesh(&mut bytes, &mesh, None, &inspection.part, choice.frame)?;
            vec![ExportFile { name: format!("{stem}.stl"), bytes, count, left_out }]
        }
        MeshFormat::Stl => {
            let mut files = Vec::new();
            for component in components(&mesh, &taxonomy)? {
                let mut bytes = Vec::new();
                stl::write_mesh(&mut bytes, &mesh, Some(component.label), &component.name, choice.frame)?;
                let name = format!("{stem}-{}.stl", file_part(&component.name));
                files.push(ExportFile { name, bytes, count: component.triangles.len(), left_out });
            }
            files
        }
        MeshFormat::Glb => {
            let figures = state.measured.as_ref().or(state.features.mesh.figures.as_ref());
            let figures = figures.cloned().unwrap_or_default();
            let options = GlbOptions { part: inspection.part.clone(), figures, ..GlbOptions::default() };
            gltf::write_mesh(&mut bytes, &mesh, &taxonomy, &options)?;
            vec![ExportFile { name: format!("{stem}.glb"), bytes, count, left_out }]
        }
    })
}

/// The figures of the model: those of the agent where it is final, those of an up-to-date mesh, or those of the points
/// alone.
fn figures(state: &AppState, whole: &SemanticCloud) -> ModelFigures {
    let measured = state.measured.as_ref().or(state.features.mesh.figures.as_ref());
    let counted = || model_figures(whole, &SemanticMesh::default(), state.inspection.voxel as f32);
    measured.cloned().unwrap_or_else(counted)
}

/// What a PLY says beside the classes.
fn comments(state: &AppState) -> [(String, String); 4] {
    let inspection = &state.inspection;
    [
        ("part".to_owned(), inspection.part.clone()),
        ("source".to_owned(), inspection.source.clone()),
        ("inspection".to_owned(), inspection.id.clone()),
        ("voxel".to_owned(), inspection.voxel.to_string()),
    ]
}

/// What is hidden on screen is left out of the file.
fn filter(state: &AppState) -> ExportFilter {
    let hidden = state.legend.rows.iter().filter(|row| !row.visible);
    ExportFilter {
        hidden_labels: hidden.map(|row| row.class.id).collect(),
        skip_flags: state.display.hidden_flags().bits(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::LinkEvent;
    use crate::state::Event;
    use crate::state::export_choice::{Detail, ExportChoice};
    use semascan_formats::{FileFrame, UpAxis};
    use semascan_model::{LengthUnit, PointFlags, SemanticPoint, Taxonomy};
    use semascan_protocol::Inspection;

    fn point(label: u16, flags: u16) -> SemanticPoint {
        SemanticPoint {
            position: [0.0, 0.0, f32::from(label)],
            normal: [0.0, 0.0, 1.0],
            color: [200; 3],
            label,
            confidence: 0.9,
            defect: 0,
            defect_confidence: 0.0,
            sigma: 0.1,
            defect_sigma: 0.0,
            instance: 0,
            views: 3,
            flags: PointFlags(flags),
        }
    }

    fn shown() -> AppState {
        let mut state = AppState::default();
        let mut inspection = Inspection { part: "Starter motor 7".into(), voxel: 0.001, ..Inspection::default() };
        inspection.set_taxonomy(&Taxonomy::from_names(&["housing", "pinion gear"], &[]));
        state.reduce(&Event::from(LinkEvent::Cleared(inspection)));
        state
    }

    #[test]
    fn a_file_holds_what_is_seen_and_names_the_classes() {
        let cloud: SemanticCloud =
            [point(1, 0), point(2, 0), point(2, 0), point(1, PointFlags::RADIUS_OUTLIER)].into_iter().collect();
        let mut state = shown();
        let exported = |state: &AppState, format| export_points(&cloud, state, format).expect("a small model fits");
        let all = exported(&state, PointFormat::Ply);
        assert_eq!((all.name.as_str(), all.count, all.left_out), ("starter-motor-7.ply", 3, 1));
        state.reduce(&Event::OnlyComponent(2));
        let pinion = exported(&state, PointFormat::Ply);
        assert_eq!((pinion.count, pinion.left_out), (2, 2));
        let text = String::from_utf8_lossy(&pinion.bytes);
        assert!(text.contains("element vertex 2") && text.contains("comment label 2 pinion gear #"));
        state.reduce(&Event::AllComponents);
        state.reduce(&Event::ShowOutliers(true));
        assert_eq!(exported(&state, PointFormat::Ply).count, 4);
    }

    #[test]
    fn a_mesh_is_written_in_every_format_without_hidden_components() {
        let mesh = SemanticMesh {
            vertices: [1, 1, 1, 2, 2, 2].map(|label| point(label, 0)).into_iter().collect(),
            boundary: vec![false; 6],
            triangles: vec![[0, 1, 2], [3, 4, 5], [3, 5, 4]],
        };
        let mut state = shown();
        let files = |state: &AppState, format| export_mesh(&mesh, state, format).expect("a small mesh fits");
        let named = |files: &[ExportFile]| files.iter().map(|f| (f.name.clone(), f.count)).collect::<Vec<_>>();
        let solid = |name: &str, n| (format!("starter-motor-7-mesh-{name}.stl"), n);
        assert_eq!(named(&files(&state, MeshFormat::Stl)), [solid("housing", 1), solid("pinion_gear", 2)]);
        state.reduce(&Event::ToggleComponent(1));
        assert_eq!(named(&files(&state, MeshFormat::Stl)), [solid("pinion_gear", 2)]);
        let obj = files(&state, MeshFormat::Obj);
        assert_eq!((obj.len(), obj[1].name.as_str()), (2, "starter-motor-7-mesh.mtl"));
        let text = String::from_utf8_lossy(&obj[0].bytes);
        assert!(
            text.contains("mtllib starter-motor-7-mesh.mtl")
                && text.contains("unit mm, z up")
                && text.contains("o pinion_gear")
                && !text.contains("housing")
        );
        state.reduce(&Event::AllComponents);
        let frame = FileFrame { unit: LengthUnit::Inches, up: UpAxis::Y };
        let choice = ExportChoice { frame, solids: Solids::One, ..ExportChoice::default() };
        state.reduce(&Event::ExportChoice(choice));
        let one = files(&state, MeshFormat::Stl);
        assert_eq!(named(&one), [("starter-motor-7-mesh.stl".to_owned(), 3)]);
        assert!(String::from_utf8_lossy(&one[0].bytes[..80]).contains("unit inch, y up"));
        state.reduce(&Event::ToggleComponent(1));
        assert!(String::from_utf8_lossy(&files(&state, MeshFormat::Ply)[0].bytes).contains("element face 2\n"));
        assert_eq!(&files(&state, MeshFormat::Glb)[0].bytes[..4], b"glTF");
    }

    #[test]
    fn a_coarser_mesh_has_the_share_of_triangles_that_was_chosen() {
        let at = |i: u32| SemanticPoint { position: [(i % 21) as f32, (i / 21) as f32, 0.0], ..point(1, 0) };
        let square = |i: u32| i + i / 20;
        let triangles = (0..400).flat_map(|i| {
            let a = square(i);
            [[a, a + 1, a + 22], [a, a + 22, a + 21]]
        });
        let mesh = SemanticMesh {
            vertices: (0..441).map(at).collect(),
            boundary: vec![false; 441],
            triangles: triangles.collect(),
        };
        let mut state = shown();
        for (detail, most) in [(Detail::Full, 800), (Detail::Half, 400), (Detail::Tenth, 80)] {
            state.reduce(&Event::ExportChoice(ExportChoice { detail, ..ExportChoice::default() }));
            let file = export_mesh(&mesh, &state, MeshFormat::Stl).expect("a small mesh fits").remove(0);
            assert!(file.count <= most && file.count * 2 > most && file.left_out == 0, "{detail:?}: {}", file.count);
        }
    }

    #[test]
    fn a_scene_begins_as_glb_and_has_a_node_by_visible_component() {
        let cloud: SemanticCloud = [point(1, 0), point(2, 0)].into_iter().collect();
        let mut state = shown();
        state.reduce(&Event::ToggleComponent(1));
        let file = export_points(&cloud, &state, PointFormat::Glb).expect("a small model fits");
        assert_eq!(&file.bytes[..4], b"glTF");
        let text = String::from_utf8_lossy(&file.bytes);
        assert!(text.contains("pinion gear") && !text.contains("housing"));
    }
}
