//! Training sets on disk, drawn by a generator that needs no simulator.

use super::*;
use crate::bop::BopSource;
use image::{Rgb, RgbImage};
use semascan_inspection::source::Source;
use semascan_inspection::spec::CameraMask;
use semascan_perception::view::{DepthImage, Intrinsics, PoseEvidence, RecordedLabels, covariance_of_prior};
use serde_json::json;
use std::sync::Arc;

/// Draws walls with one labelled square, which stand elsewhere in each view.
#[derive(Clone, Copy)]
struct Walls {
    seed: u64,
    window: (u32, u32),
}

const SMALL: Walls = Walls { seed: 5, window: (48, 32) };

impl PartGenerator for Walls {
    fn description(&self) -> Description {
        Description {
            generator: "walls 1".into(),
            seed: self.seed,
            size: (64, 48),
            window: self.window,
            cell: 3.0,
            taxonomy: Taxonomy::from_names(&["square"], &["scratch"]),
        }
    }

    fn part(&self, part: u32) -> Box<dyn GeneratedPart + '_> {
        Box::new(Wall { generator: *self, part })
    }
}

struct Wall {
    generator: Walls,
    part: u32,
}

impl GeneratedPart for Wall {
    fn table_from_part(&self) -> Isometry3<f64> {
        Isometry3::identity()
    }

    fn view(&self, index: u32) -> View {
        let (width, height) = self.generator.window;
        let shade = (self.generator.seed as u32 * 7 + self.part * 31 + index * 11) as u8;
        let inside = |i: u32| i % width >= 8 + index && i % width < 20 + index && i / width >= 8 && i / width < 20;
        let labels: Vec<u16> = (0..width * height).map(|i| u16::from(inside(i))).collect();
        View {
            index,
            stamp: None,
            intrinsics: Intrinsics { width, height, fx: 60.0, fy: 60.0, cx: 23.5, cy: 15.5 },
            rgb: Arc::new(RgbImage::from_fn(width, height, |u, v| Rgb([u as u8, v as u8, shade]))),
            depth: Arc::new(DepthImage { width, height, metres: vec![0.5; labels.len()] }),
            pose: PoseEvidence::World {
                table_from_camera: Isometry3::translation(0.01 * f64::from(index), 0.0, 0.0),
                covariance: covariance_of_prior(1e-6, 1e-6),
            },
            labels: Some(Arc::new(RecordedLabels {
                defects: vec![0; labels.len()],
                instances: labels.clone(),
                components: labels,
            })),
            truth: None,
        }
    }

    fn about(&self) -> Value {
        json!({ "part": self.part })
    }
}

fn bytes_of(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut files = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(next).expect("a folder").map(|e| e.expect("an entry").path()) {
            if entry.is_dir() {
                folders.push(entry);
            } else {
                let name = entry.strip_prefix(folder).expect("inside").to_owned();
                files.push((name, fs::read(&entry).expect("reads")));
            }
        }
    }
    files.sort();
    files
}

#[test]
fn a_part_is_the_same_bytes_again_and_a_scene_of_its_own() {
    let (a, b) = (tempfile::tempdir().expect("a folder"), tempfile::tempdir().expect("a folder"));
    let make = |folder: &Path, parts: &[u32]| {
        let set = TrainingSet::open(folder, 2, 3, SMALL).expect("begun");
        parts.iter().for_each(|p| set.write_part(*p, &|| ()).expect("written"));
    };
    make(a.path(), &[0, 1]);
    make(b.path(), &[1]);
    let one = bytes_of(&a.path().join("000001"));
    // Three views with four pictures each and some masks, five JSON files.
    assert!(one.len() > 3 * 4 + 5 && one == bytes_of(&b.path().join("000001")));
    assert_ne!(one, bytes_of(&a.path().join("000000")));
    let mut scene = BopSource::open(&a.path().join("000001"), &CameraMask::None).expect("a scene");
    assert_eq!(scene.info().view_count, Some(3));
    let part = SMALL.part(1);
    for index in 0..3 {
        let (read, drawn) = (scene.next_view().expect("three views").expect("readable"), part.view(index));
        assert_eq!(read.rgb, drawn.rgb);
        assert_eq!(read.labels, drawn.labels);
    }
}

#[test]
fn a_stopped_run_leaves_no_half_part_and_is_taken_up() {
    let dir = tempfile::tempdir().expect("a folder");
    let set = TrainingSet::open(dir.path(), 2, 1, SMALL).expect("begun");
    // What a killed run leaves behind.
    let left = dir.path().join(".000000.partial");
    fs::create_dir_all(left.join("rgb")).expect("made");
    fs::write(left.join("rgb/000099.png"), b"half").expect("written");
    assert_eq!(set.missing(0..2), [0, 1]);
    set.write_part(0, &|| ()).expect("written");
    assert!(!left.exists() && !set.part_folder(0).join("rgb/000099.png").exists());
    let again = TrainingSet::open(dir.path(), 3, 1, SMALL).expect("the same set, larger");
    assert_eq!((again.missing(0..3), again.manifest().parts), (vec![1, 2], 3));
    let smaller = TrainingSet::open(dir.path(), 1, 1, SMALL).expect("the same set");
    assert_eq!(smaller.manifest().parts, 3, "asking for less takes nothing away");
}

#[test]
fn a_set_made_otherwise_is_not_added_to() {
    let dir = tempfile::tempdir().expect("a folder");
    TrainingSet::open(dir.path(), 2, 1, SMALL).expect("begun");
    for (attempt, field, value) in [
        (TrainingSet::open(dir.path(), 2, 1, Walls { seed: 6, ..SMALL }), "seed", "6"),
        (TrainingSet::open(dir.path(), 2, 9, SMALL), "views", "9"),
        (TrainingSet::open(dir.path(), 2, 1, Walls { window: (56, 32), ..SMALL }), "window", "56"),
    ] {
        let message = attempt.err().expect(field).to_string();
        assert!(message.contains("dataset.json") && message.contains(field) && message.contains(value), "{message}");
    }
    fs::write(dir.path().join("dataset.json"), "{").expect("written");
    let message = TrainingSet::open(dir.path(), 2, 1, SMALL).err().expect("broken").to_string();
    assert!(message.contains("dataset.json"), "{message}");
}
