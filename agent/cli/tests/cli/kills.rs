//! Whole inspections that are killed at random moments, into fresh folders and into one that holds an earlier model: what they
//! leave is a whole set, old or new, or visibly none, and the next inspection goes on from there.

use crate::{MOTOR, semascan, stderr};
use semascan_model::record::Outcome;
use semascan_store::{SavedError, read_inspection};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// How many, where [`COUNT`] does not say it.
const KILLS: u32 = 6;
/// The variable that says how many inspections are killed.
const COUNT: &str = "SEMASCAN_TEST_KILLS";

fn arguments(folder: &Path) -> [&str; 5] {
    ["inspect", MOTOR, "--overwrite", "--out", folder.to_str().expect("UTF-8")]
}

/// Names that a person sees.
fn visible(folder: &Path) -> Vec<String> {
    let names = std::fs::read_dir(folder).into_iter().flatten().map(|entry| entry.expect("readable").file_name());
    let mut names: Vec<_> = names.map(|name| name.to_string_lossy().into_owned()).collect();
    names.retain(|name| !name.starts_with('.'));
    names.sort();
    names
}

const SET: [&str; 6] = ["cloud.ply", "inspection.json", "mesh.ply", "report.html", "scene.glb", "truth.ply"];

#[test]
fn inspections_killed_at_random_moments_leave_whole_sets() {
    let kills = std::env::var(COUNT).map_or(KILLS, |count| count.parse().expect("a number of kills"));
    let root = tempfile::tempdir().expect("temporary folder");
    let used = root.path().join("used");
    let begin = Instant::now();
    let first = semascan(&arguments(&used));
    assert_eq!(first.status.code(), Some(0), "{}", stderr(&first));
    let whole = begin.elapsed();
    let mut earlier = read_inspection(&used).expect("whole").record.id;
    // Multiples of the golden section cover an interval evenly, however many there are.
    let moments = (1..=kills).map(|k| (f64::from(k) * 0.618_033_988_749_895).fract());
    let (mut nothing, mut running, mut kept, mut new) = (0, 0, 0, 0);
    for (kill, moment) in moments.enumerate() {
        let is_used = kill % 2 == 0;
        let folder = if is_used { used.clone() } else { root.path().join(format!("fresh-{kill}")) };
        let mut command = Command::new(env!("CARGO_BIN_EXE_semascan"));
        let mut child = command.args(arguments(&folder)).stderr(Stdio::null()).spawn().expect("starts");
        std::thread::sleep(whole.mul_f64(1.1 * moment));
        child.kill().expect("killed");
        child.wait().expect("gone");
        match read_inspection(&folder) {
            Ok(saved) if saved.record.outcome == Outcome::Finished => {
                assert_eq!(saved.record.points, saved.cloud.len() as u64, "kill {kill}");
                assert!(saved.record.points > 1000 && saved.record.views.len() == 3, "kill {kill}");
                assert_eq!(visible(&folder), SET, "kill {kill}");
                if saved.record.id == earlier {
                    kept += 1
                } else {
                    new += 1
                }
                if is_used {
                    earlier = saved.record.id;
                }
            }
            Ok(saved) => {
                assert_eq!((saved.record.outcome, saved.record.points), (Outcome::Running, 0), "kill {kill}");
                assert!(!is_used, "kill {kill}: the earlier model is gone");
                assert_eq!(visible(&folder), ["inspection.json"], "kill {kill}");
                running += 1;
            }
            Err(error) => {
                let is_none = matches!(error, SavedError::NoRecord { .. } | SavedError::Io { .. });
                assert!(is_none && !is_used && visible(&folder).is_empty(), "kill {kill}: {error}");
                nothing += 1;
            }
        }
        if !is_used {
            let _ = std::fs::remove_dir_all(&folder);
        }
    }
    let last = semascan(&arguments(&used));
    assert_eq!(last.status.code(), Some(0), "{}", stderr(&last));
    assert_ne!(read_inspection(&used).expect("whole").record.id, earlier);
    assert_eq!(std::fs::read_dir(&used).expect("reads").count(), SET.len(), "leftovers in the folder");
    eprintln!(
        "{kills} inspections of {:.1} s killed in {:.0} s: {nothing} left nothing, {running} a record that says `running`, {kept} \
         the earlier model, {new} a new one",
        whole.as_secs_f64(),
        begin.elapsed().as_secs_f64(),
    );
    assert!(kept > 0 && running + nothing > 0, "the kills came too late to test anything");
    assert!(whole > Duration::from_millis(100));
}
