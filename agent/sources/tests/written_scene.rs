//! What goes out as a BOP scene comes back as the same views.

use image::GrayImage;
use nalgebra::Isometry3;
use semascan_inspection::source::Source;
use semascan_inspection::spec::CameraMask;
use semascan_model::Taxonomy;
use semascan_perception::segment::{RecordedSegmenter, Segmenter};
use semascan_perception::view::{PoseEvidence, RecordedLabels, View};
use semascan_simulation::{VirtualCell, VirtualCellSpec};
use semascan_sources::bop::{BopSource, SceneEntry, SceneWriter};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::sync::Arc;

fn cell() -> VirtualCell {
    let uri = "virtual:starter-motor?seed=4&views=2&size=96x80&cell=3";
    VirtualCell::open(&VirtualCellSpec::parse(uri).expect("a valid URI")).expect("needs no file")
}

/// Two views, and a scene whose pictures of them are written.
fn begun(folder: &Path, object: Isometry3<f64>) -> (Vec<View>, SceneWriter, Vec<SceneEntry>) {
    let mut cell = cell();
    let writer = SceneWriter::create(folder, &cell.info().taxonomy, object).expect("made");
    let views: Vec<View> = std::iter::from_fn(|| cell.next_view()).map(|v| v.expect("a view")).collect();
    let entries = views.iter().map(|v| writer.write(v).expect("written")).collect();
    (views, writer, entries)
}

/// What goes out as a scene comes back as the same views, but for the steps of the depth and the numbering of what
/// is visible.
#[test]
fn a_written_scene_reads_back() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let folder = dir.path().join("000000");
    let object = Isometry3::translation(0.01, 0.02, 0.03);
    let (views, writer, entries) = begun(&folder, object);
    let taxonomy = cell().info().taxonomy.clone();
    assert!(!BopSource::is_scene(&folder), "a scene without its JSON files is no scene yet");
    writer.finish(&entries).expect("finished");
    let mut source = BopSource::open(&folder, &CameraMask::None).expect("a scene");
    let names =
        |t: &Taxonomy| [&t.components, &t.defects].map(|c| c.iter().map(|c| c.name.clone()).collect::<Vec<_>>());
    assert_eq!(names(&source.info().taxonomy), names(&taxonomy));
    for view in &views {
        let read = source.next_view().expect("as many views").expect("readable");
        assert_eq!(read.rgb, view.rgb);
        // A number may lose its last bit on its way through JSON.
        let (k, l) = (read.intrinsics, view.intrinsics);
        assert_eq!((k.width, k.height), (l.width, l.height));
        assert!([k.fx - l.fx, k.fy - l.fy, k.cx - l.cx, k.cy - l.cy].iter().all(|d| d.abs() < 1e-9));
        let off = read.depth.metres.iter().zip(&view.depth.metres).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(off < 5.1e-5, "{off} m");
        let (read_labels, labels) = (read.labels.expect("labels"), view.labels.as_ref().expect("labels"));
        assert_eq!(read_labels.components, labels.components);
        assert_eq!(read_labels.defects, labels.defects);
        let PoseEvidence::World { table_from_camera, .. } = read.pose else { panic!("a pose") };
        let truth = view.truth.as_ref().expect("truth").table_from_camera;
        assert!((table_from_camera.inverse() * truth).translation.vector.norm() < 1e-9);
    }
    assert!(source.next_view().is_none());
    assert!(views.iter().flat_map(|v| &v.labels).any(|l| l.defects.iter().any(|d| *d != 0)), "a defect is in view");
    let text = fs::read_to_string(folder.join("scene_gt.json")).expect("reads");
    let truth: Value = serde_json::from_str(&text).expect("JSON");
    let pose = views[0].truth.as_ref().expect("truth").table_from_camera.inverse() * object;
    let z = truth["0"][0]["cam_t_m2c"][2].as_f64().expect("a number");
    assert!((z - pose.translation.vector.z * 1e3).abs() < 1e-9, "the object stands before the camera");
}

/// What nobody knows goes out as 255 and comes back as unknown: as no class, and not as none.
#[test]
fn what_is_unknown_comes_back_as_unknown() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let folder = dir.path().join("scene");
    let mut cell = cell();
    let mut view = cell.next_view().expect("a view").expect("drawn");
    let mut labels = (**view.labels.as_ref().expect("labels")).clone();
    let known = labels.clone();
    for i in (0..labels.components.len()).filter(|i| i % 3 == 0) {
        labels.components[i] = RecordedLabels::UNKNOWN;
    }
    for i in (0..labels.defects.len()).filter(|i| i % 5 == 0) {
        labels.defects[i] = RecordedLabels::UNKNOWN;
    }
    view.labels = Some(Arc::new(labels.clone()));
    let writer = SceneWriter::create(&folder, &cell.info().taxonomy, Isometry3::identity()).expect("made");
    let entry = writer.write(&view).expect("written");
    writer.finish(&[entry]).expect("finished");
    let read = |folder: &Path| {
        let mut source = BopSource::open(folder, &CameraMask::None).expect("a scene");
        source.next_view().expect("a view").map(|view| view.labels.expect("labels"))
    };
    let back = read(&folder).expect("readable");
    assert_eq!((&back.components, &back.defects), (&labels.components, &labels.defects));
    assert!((0..known.components.len()).all(|i| i % 3 == 0 || back.components[i] == known.components[i]));
    let said = RecordedSegmenter.segment(&View { labels: Some(back), ..view.clone() }).expect("labelled");
    let mut votes = vec![0.0; 8];
    said.components.add_evidence(0, 1.0, &mut votes);
    said.defects.add_evidence(0, 1.0, &mut votes);
    assert_eq!(votes, [0.0; 8]);
    // In a scene of others, whose objects have no names, the folder may be anything.
    fs::remove_file(folder.join("objects.json")).expect("there");
    let foreign = read(&folder).expect("readable");
    assert!(!foreign.components.contains(&RecordedLabels::UNKNOWN));
    // A file that names 255 means it.
    let names = r#"{"1": "corrosion", "2": "wear", "3": "crack", "255": "dent"}"#;
    fs::write(folder.join("defects.json"), names).expect("written");
    assert_eq!(read(&folder).expect("readable").defects[0], 4);
}

#[test]
fn a_defect_without_a_name_costs_its_view() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let folder = dir.path().join("scene");
    let (_, writer, entries) = begun(&folder, Isometry3::identity());
    writer.finish(&entries).expect("finished");
    GrayImage::from_pixel(96, 80, image::Luma([99])).save(folder.join("defects/000000.png")).expect("written");
    let mut source = BopSource::open(&folder, &CameraMask::None).expect("a scene");
    let error = source.next_view().expect("a view").expect_err("an unknown defect").to_string();
    assert!(error.contains("000000.png") && error.contains("99"), "{error}");
}
