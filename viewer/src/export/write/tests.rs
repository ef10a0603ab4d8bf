//! Files hold what was chosen, are as large as was said, and tell how far they are.

use super::*;
use crate::export::estimate;
use crate::features::mesh::{MeshEvent, part_counts};
use crate::link::LinkEvent;
use crate::state::AppState;
use crate::state::Event;
use crate::state::export_choice::{Content, Detail, ExportChoice};
use crate::state::legend::ClassCount;
use semascan_formats::{FileFrame, UpAxis};
use semascan_model::{LengthUnit, PointFlags, SemanticCloud, SemanticPoint, Taxonomy};
use semascan_protocol::Inspection;
use std::sync::{Arc, Mutex};

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

fn nobody(_: Step, _: f32) {}

fn export_points(cloud: &SemanticCloud, state: &AppState, format: PointFormat) -> ExportFile {
    let task = Task::of_points(cloud.clone(), state, Format::Points(format));
    task.run(nobody).expect("a small model fits").remove(0)
}

fn export_mesh(mesh: &SemanticMesh, state: &AppState, format: MeshFormat) -> Vec<ExportFile> {
    let task = Task::of_mesh(Arc::new(mesh.clone()), state, Format::Mesh(format));
    task.run(nobody).expect("a small mesh fits")
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
    let exported = |state: &AppState, format| export_points(&cloud, state, format);
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
    let files = |state: &AppState, format| export_mesh(&mesh, state, format);
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

/// A wavy sheet of `n` x `n` vertices over 100 x 100 mm, of two components.
fn grid(n: u32) -> SemanticMesh {
    let at = |i: u32| {
        let [x, y] = [i % n, i / n].map(|k| (k as f32 - 0.37 * n as f32) / n as f32 * 0.1);
        let label = 1 + u16::from(i > n * n / 2);
        SemanticPoint { position: [x, y, 0.01 * (60.0 * x).sin() * (47.0 * y).cos()], ..point(label, 0) }
    };
    let triangles = (0..(n - 1) * (n - 1)).flat_map(|i| {
        let a = i + i / (n - 1);
        [[a, a + 1, a + n + 1], [a, a + n + 1, a + n]]
    });
    let count = (n * n) as usize;
    SemanticMesh {
        vertices: (0..n * n).map(at).collect(),
        boundary: vec![false; count],
        triangles: triangles.collect(),
    }
}

#[test]
fn a_coarser_mesh_has_the_share_of_triangles_that_was_chosen() {
    let mesh = grid(21);
    let mut state = shown();
    for (detail, most) in [(Detail::Full, 800), (Detail::Half, 400), (Detail::Tenth, 80)] {
        state.reduce(&Event::ExportChoice(ExportChoice { detail, ..ExportChoice::default() }));
        let file = export_mesh(&mesh, &state, MeshFormat::Stl).remove(0);
        assert!(file.count <= most && file.count * 2 > most && file.left_out == 0, "{detail:?}: {}", file.count);
    }
}

#[test]
fn a_scene_begins_as_glb_and_has_a_node_by_visible_component() {
    let cloud: SemanticCloud = [point(1, 0), point(2, 0)].into_iter().collect();
    let mut state = shown();
    state.reduce(&Event::ToggleComponent(1));
    let file = export_points(&cloud, &state, PointFormat::Glb);
    assert_eq!(&file.bytes[..4], b"glTF");
    let text = String::from_utf8_lossy(&file.bytes);
    assert!(text.contains("pinion gear") && !text.contains("housing"));
}

#[test]
fn hidden_and_cut_components_are_exported_where_that_is_wanted() {
    let mesh = grid(21);
    let mut state = shown();
    state.reduce(&Event::ToggleComponent(1));
    state.display.cut.plane = Some(([1.0, 0.0, 0.0], 0.0));
    let of = |state: &mut AppState, content| {
        state.reduce(&Event::ExportChoice(ExportChoice { content, ..ExportChoice::default() }));
        let points = export_points(&mesh.vertices, state, PointFormat::Ply);
        let triangles = export_mesh(&mesh, state, MeshFormat::Ply).remove(0);
        assert_eq!(points.count + points.left_out, mesh.len());
        (points.count, triangles.count)
    };
    let [shown, kept, all] = Content::ALL.map(|content| of(&mut state, content));
    assert_eq!(all, (mesh.len(), mesh.triangles.len()));
    assert!(shown.0 < all.0 && shown.1 < all.1, "{shown:?} of {all:?}");
    assert!(kept.0 > 0 && kept.0 < shown.0 && kept.1 > 0 && kept.1 < shown.1, "{kept:?} of {shown:?}");
}

#[test]
fn estimates_are_close_to_the_size_of_the_files() {
    let mesh = grid(80);
    let mut state = shown();
    let points = mesh.vertices.labels.iter().filter(|label| **label == 1).count() as u64;
    let count = |points| ClassCount { points, shown: points, held: points, ..ClassCount::default() };
    let classes = vec![count(0), count(points), count(mesh.len() as u64 - points)];
    state.legend.rows.iter_mut().zip(classes).for_each(|(row, count)| row.count = count);
    state.reduce(&Event::Feature(MeshEvent::Counted(part_counts(&mesh)).into()));
    let inches = FileFrame { unit: LengthUnit::Inches, up: UpAxis::Y };
    let metres = FileFrame { unit: LengthUnit::Metres, up: UpAxis::Z };
    for choice in [
        ExportChoice::default(),
        ExportChoice { detail: Detail::Half, frame: inches, ..ExportChoice::default() },
        ExportChoice { detail: Detail::Tenth, frame: metres, solids: Solids::One, ..ExportChoice::default() },
    ] {
        state.reduce(&Event::ExportChoice(choice));
        for hide in [false, true] {
            state.reduce(&Event::AllComponents);
            if hide {
                state.reduce(&Event::ToggleComponent(2));
            }
            for format in Format::ALL {
                let task = match format {
                    Format::Points(_) => Task::of_points(mesh.vertices.clone(), &state, format),
                    Format::Mesh(_) => Task::of_mesh(Arc::new(mesh.clone()), &state, format),
                };
                let files = task.run(nobody).expect("a small model fits");
                let real = files.iter().map(|file| file.bytes.len()).sum::<usize>() as f64;
                let said = estimate(&state, format).expect("an estimate") as f64;
                assert!((said / real - 1.0).abs() < 0.25, "{format:?} {choice:?}: {said} for {real}");
            }
        }
    }
    state.display.cut.plane = Some(([1.0, 0.0, 0.0], 0.0));
    state.reduce(&Event::ExportChoice(ExportChoice { content: Content::Kept, ..ExportChoice::default() }));
    assert_eq!(Format::ALL.map(|format| estimate(&state, format)), [None; 6], "what a cut leaves is not known");
}

#[test]
fn the_steps_of_an_export_are_told_from_nothing_to_all() {
    static TOLD: Mutex<Vec<(Step, f32)>> = Mutex::new(Vec::new());
    fn note(step: Step, share: f32) {
        TOLD.lock().expect("nobody panics").push((step, share));
    }
    let mut state = shown();
    state.reduce(&Event::ExportChoice(ExportChoice { detail: Detail::Tenth, ..ExportChoice::default() }));
    let task = Task::of_mesh(Arc::new(grid(60)), &state, Format::Mesh(MeshFormat::Stl));
    task.run(note).expect("a small mesh fits");
    let told = TOLD.lock().expect("nobody panics");
    assert!(told.windows(2).all(|pair| pair[0].0 != pair[1].0 || pair[0].1 < pair[1].1), "{told:?}");
    assert_eq!((told[0], told.last().map(|last| last.0)), ((Step::Simplify, 0.0), Some(Step::Write)));
    assert!(told.len() > 4 && told.iter().all(|(_, share)| (0.0..=1.0).contains(share)), "{told:?}");
}
