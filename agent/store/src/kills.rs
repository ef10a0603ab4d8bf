//! Writers that are killed at random instants: what they leave is a whole set, old or new, or visibly none.
//!
//! The writer is this very program, started again for the test `writer` alone: it begins and publishes one small set after
//! the other into the folder that the environment names, until it is killed.

use crate::write::write_new;
use crate::{ResultFolder, SavedError, SavedInspection, StoreError, read_inspection};
use semascan_formats::gltf::{self, GlbOptions};
use semascan_formats::ply::{self, LabelledMesh};
use semascan_formats::{Geometry, no_files};
use semascan_model::record::{InspectionRecord, Outcome};
use semascan_model::{SemanticCloud, SemanticPoint, Taxonomy};
use serde_json::json;
use std::collections::BTreeSet;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

const FOLDER: &str = "SEMASCAN_KILLED_WRITER_FOLDER";
/// Kills of writers into folders that are exchanged as a whole: half of them into fresh ones.
const KILLS: u64 = 200;
/// Kills of writers into folders whose files are replaced one by one.
const KILLS_IN_PLACE: u64 = 40;
/// So many sets are written in the longest time that a writer lives after it began.
const SETS_OF_A_LIFE: u32 = 6;
/// Points of a set.
const POINTS: usize = 2000;

/// A record of an inspection that ended as `outcome` says.
fn record(outcome: Outcome) -> InspectionRecord {
    let points = if outcome == Outcome::Finished { POINTS } else { 0 };
    let text = json!({
        "schema_version": 2, "id": "018bcfe5-6800-7000-8000-000000000000", "began": "2026-01-01T00:00:00Z",
        "outcome": outcome, "software": { "name": "semascan", "version": "1" }, "part": "motor", "source": "test",
        "labels": "none", "settings": [], "voxel": 0.001, "points": points, "views": [], "components": [], "defects": [],
    });
    InspectionRecord::from_json(&text.to_string()).expect("a record")
}

/// Publishes a finished set of small files, of every kind that there is.
fn publish(folder: &ResultFolder) {
    let mut cloud = SemanticCloud::default();
    for i in 0..POINTS {
        cloud.push(SemanticPoint { position: [i as f32 * 1e-3, 0.0, 0.0], ..SemanticPoint::UNKNOWN });
    }
    let taxonomy = Taxonomy::from_names(&["gear"], &["wear"]);
    let published = folder.publish_files(&record(Outcome::Finished), |folder, target, generation| {
        let comments = [("generator", "semascan 1"), ("generation", generation)];
        let comments = comments.map(|(key, value)| (key.to_owned(), value.to_owned()));
        let write = |name: &str, part: &dyn Fn(&mut dyn std::io::Write) -> Result<(), semascan_formats::WriteError>| {
            write_new(&folder.join(name), &target.join(name), |out| part(out))
        };
        fs::create_dir(folder.join("views")).map_err(StoreError::io(folder))?;
        for name in ["cloud.ply", "mesh.ply", "views/000000.ply"] {
            write(name, &|out| ply::write_cloud(out, &cloud, &taxonomy, &comments))?;
        }
        let options = GlbOptions { generation: Some(generation.to_owned()), ..GlbOptions::default() };
        write("scene.glb", &|out| gltf::write_points(out, &cloud, &taxonomy, &options))?;
        let truth = LabelledMesh { vertices: &[[0.0; 3]], triangles: &[], labels: &[0], defects: &[0] };
        write("truth.ply", &|out| ply::write_mesh(out, &truth, &taxonomy, &comments))?;
        let head = format!("<head><meta name=\"generator\" content=\"semascan 1\">{}</head>", meta(generation));
        write("report.html", &|out| Ok(out.write_all(head.as_bytes())?))?;
        let names = ["cloud.ply", "mesh.ply", "report.html", "scene.glb", "truth.ply", "views/000000.ply"];
        Ok(names.map(str::to_owned).into())
    });
    published.expect("written");
}

/// How an HTML file names its generation.
fn meta(generation: &str) -> String {
    format!("<meta name=\"generation\" content=\"{generation}\">")
}

#[test]
fn a_report_may_be_missing_or_written_later_and_must_be_of_the_set() {
    let root = tempfile::tempdir().expect("a folder");
    let folder = root.path().join("motor");
    publish(&ResultFolder::begin(&folder, &record(Outcome::Running), false).expect("a folder"));
    let read = || crate::read_record(&folder);
    let whole = read().expect("a set");
    let report = folder.join("report.html");
    let own = fs::read_to_string(&report).expect("there");
    fs::remove_file(&report).expect("removed");
    read().expect("a report is made of the other files");
    let generation = whole.files.as_ref().expect("listed").generation.clone();
    fs::write(&report, own.replace(&generation, "another")).expect("written");
    let mixed = read().expect_err("the report of another inspection");
    assert!(mixed.to_string().contains("report.html") && mixed.to_string().contains("another"), "{mixed}");
    // Written later, the record does not name it.
    fs::write(&report, own).expect("written");
    crate::amend_record::<crate::AmendError>(&folder, |record| {
        record.files.as_mut().expect("listed").names.retain(|name| name != "report.html");
        Ok(())
    })
    .expect("changed");
    read().expect("it is of this set");
}

#[test]
#[ignore = "started by the other tests, which kill it"]
fn writer() {
    let Some(folder) = std::env::var_os(FOLDER) else { return };
    eprintln!("ready");
    loop {
        match ResultFolder::begin(Path::new(&folder), &record(Outcome::Running), true) {
            Ok(folder) => publish(&folder),
            Err(StoreError::Locked { .. }) => thread::sleep(Duration::from_millis(1)),
            Err(error) => panic!("{error}"),
        }
    }
}

/// A writer that begins now.
fn start(folder: &Path, working_directory: &Path) -> Child {
    let mut child = Command::new(std::env::current_exe().expect("this program"))
        .args(["--exact", "kills::writer", "--ignored", "--nocapture"])
        .env(FOLDER, folder)
        .current_dir(working_directory)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("starts");
    let mut lines = BufReader::new(child.stderr.take().expect("a pipe")).lines();
    assert!(lines.any(|line| line.is_ok_and(|line| line.contains("ready"))), "the writer did not begin");
    // Nobody reads what it says then.
    thread::spawn(move || lines.for_each(drop));
    child
}

/// Numbers that look random: SplitMix64.
fn random(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// The longest time that a writer lives: machines take different times for a set, and more where others work beside.
fn longest_life() -> Duration {
    let root = tempfile::tempdir().expect("a folder");
    let folder = root.path().join("timed");
    let times = (0..3).map(|_| {
        let begin = Instant::now();
        publish(&ResultFolder::begin(&folder, &record(Outcome::Running), true).expect("a folder"));
        begin.elapsed()
    });
    times.max().unwrap_or_default() * SETS_OF_A_LIFE
}

fn kill_after_a_while(mut child: Child, longest: Duration, random: u64) {
    thread::sleep(longest.mul_f64(random as f64 / u64::MAX as f64));
    child.kill().expect("killed");
    child.wait().expect("gone");
}

/// Entries that a person sees.
fn visible(folder: &Path) -> usize {
    let names = fs::read_dir(folder).into_iter().flatten().map(|entry| entry.expect("readable").file_name());
    names.filter(|name| !name.to_string_lossy().starts_with('.')).count()
}

/// Asserts that what `saved` says of itself is so, and returns whether it is a model.
fn check(folder: &Path, saved: &SavedInspection) -> bool {
    let SavedInspection { record, cloud, .. } = saved;
    let files = record.files.as_ref().expect("this version lists the files");
    let is_model = match &record.outcome {
        Outcome::Finished => {
            assert_eq!((record.points, cloud.len() as u64), (cloud.len() as u64, record.points));
            assert!(record.points > 0 && files.names.len() == 6, "{:?}", files.names);
            let mesh = fs::read(folder.join("mesh.ply")).expect("there");
            let mesh = ply::read("mesh.ply", &mesh).expect("whole");
            assert_eq!(mesh.comment("generation"), Some(files.generation.as_str()));
            let scene = fs::read(folder.join("scene.glb")).expect("there");
            Geometry::read("scene.glb", &scene, &no_files).expect("whole");
            true
        }
        Outcome::Running => {
            assert!(files.names.is_empty() && record.points == 0);
            false
        }
        other => panic!("nobody wrote {other:?}"),
    };
    // The six files are five and the folder of the views; the record is one more.
    let expected = if is_model { 7 } else { 1 };
    assert_eq!(visible(folder), expected, "{}", folder.display());
    is_model
}

#[test]
fn two_hundred_kills_leave_no_mixed_half_or_falsely_finished_set() {
    let root = tempfile::tempdir().expect("a folder");
    let begun = record(Outcome::Running);
    let longest = longest_life();
    let used = root.path().join("used");
    publish(&ResultFolder::begin(&used, &begun, false).expect("a folder"));
    let mut state = 20;
    let (mut nothing, mut running, mut models) = (0, 0, 0);
    let begin = Instant::now();
    for kill in 0..KILLS {
        let is_used = kill % 2 == 0;
        let folder = if is_used { used.clone() } else { root.path().join(format!("fresh-{kill}")) };
        let child = start(&folder, root.path());
        kill_after_a_while(child, longest, random(&mut state));
        match read_inspection(&folder) {
            Ok(saved) if check(&folder, &saved) => models += 1,
            Ok(_) => {
                assert!(!is_used, "kill {kill}: the earlier model is gone");
                running += 1;
            }
            Err(error) => {
                // Killed before the first set was there.
                assert!(!is_used && visible(&folder) == 0, "kill {kill}: {error}");
                nothing += 1;
            }
        }
        if !is_used {
            // The next writer goes on where the killed one left off, and clears up.
            drop(ResultFolder::begin(&folder, &begun, true).expect("a folder"));
        }
    }
    drop(ResultFolder::begin(&used, &begun, true).expect("a folder"));
    let left: Vec<_> = fs::read_dir(root.path()).expect("reads").map(|e| e.expect("readable").file_name()).collect();
    assert_eq!(left.len() as u64, KILLS / 2 + 1, "leftovers: {left:?}");
    eprintln!(
        "{KILLS} kills in {:.0} s: {models} whole models, {running} records of a running inspection, {nothing} empty",
        begin.elapsed().as_secs_f64()
    );
    assert!(models > KILLS / 2, "{models} models: the kills came too early to test anything");
}

#[test]
fn a_folder_whose_files_are_replaced_one_by_one_shows_that_it_is_not_whole() {
    let root = tempfile::tempdir().expect("a folder");
    let folder = root.path().join("here");
    fs::create_dir(&folder).expect("made");
    let longest = longest_life();
    let mut state = 21;
    let (mut none, mut whole) = (0, 0);
    for kill in 0..KILLS_IN_PLACE {
        let child = start(&folder, &folder);
        kill_after_a_while(child, longest, random(&mut state));
        match read_inspection(&folder) {
            Ok(saved) => whole += u64::from(check(&folder, &saved)),
            Err(SavedError::NoRecord { .. }) => none += 1,
            Err(error) => panic!("kill {kill}: {error}"),
        }
    }
    eprintln!("{KILLS_IN_PLACE} kills in place: {whole} whole models, {none} folders without a record");
    assert!(whole > 0);
}

#[test]
fn a_reader_sees_a_whole_set_at_every_moment_and_a_second_writer_is_refused() {
    let root = tempfile::tempdir().expect("a folder");
    let folder = root.path().join("out");
    let begun = record(Outcome::Running);
    publish(&ResultFolder::begin(&folder, &begun, false).expect("a folder"));
    let mut child = start(&folder, root.path());
    let (begin, mut reads, mut generations, mut refused) = (Instant::now(), 0, BTreeSet::new(), 0);
    while begin.elapsed() < Duration::from_secs(2) {
        let saved = read_inspection(&folder).expect("whole");
        assert_eq!(saved.record.outcome, Outcome::Finished);
        generations.extend(saved.record.files.map(|files| files.generation));
        reads += 1;
        match ResultFolder::begin(&folder, &begun, true) {
            // In between two sets the folder is free for a moment.
            Ok(_) => {}
            Err(error) => {
                assert!(matches!(error, StoreError::Locked { .. }), "{error}");
                refused += 1;
            }
        }
    }
    child.kill().expect("killed");
    child.wait().expect("gone");
    eprintln!("{reads} reads of {} generations, {refused} writers refused", generations.len());
    assert!(reads > 10 && generations.len() > 3 && refused > 0);
}
