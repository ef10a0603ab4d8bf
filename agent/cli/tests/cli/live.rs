//! Live sources: what Foxglove's own SDK streams comes to the model of the folder that it streams (`fixtures/stream_of_others.py` of
//! `semascan-sources`, in the Python that `SEMASCAN_FOREIGN_PYTHON` names).

use crate::{MOTOR, semascan, stderr};
use semascan_model::SemanticCloud;
use semascan_store::read_inspection;
use std::collections::BTreeSet;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};

const SCRIPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../sources/fixtures/stream_of_others.py");

/// A server that streams a scene, and its address; why there is none.
fn stream(scene: &str, encoding: &str) -> Result<(Child, String), String> {
    let python =
        std::env::var("SEMASCAN_FOREIGN_PYTHON").map_err(|_| "SEMASCAN_FOREIGN_PYTHON is not set".to_owned())?;
    let mut command = Command::new(python);
    command.args([SCRIPT, scene, encoding]).stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut child = command.spawn().map_err(|error| error.to_string())?;
    let mut line = String::new();
    BufReader::new(child.stdout.take().expect("a pipe")).read_line(&mut line).expect("a line");
    match line.trim().parse::<u16>() {
        Ok(port) => Ok((child, format!("ws://127.0.0.1:{port}"))),
        Err(_) => {
            let _ = child.wait();
            Err(line.trim().to_owned())
        }
    }
}

fn inspect(source: &str, out: &Path) -> SemanticCloud {
    let output = semascan(&[
        "inspect",
        source,
        "--labels",
        "none",
        "--registration",
        "kinematic",
        "--voxel",
        "3",
        "--camera-mask",
        "none",
        "--out",
        out.to_str().expect("UTF-8"),
    ]);
    assert_eq!(output.status.code(), Some(0), "{source}: {}", stderr(&output));
    read_inspection(out).expect("whole").cloud
}

/// Voxels of 3 mm with points in them.
fn voxels(cloud: &SemanticCloud) -> BTreeSet<[i32; 3]> {
    cloud.positions.iter().map(|p| p.map(|c| (c / 3e-3).floor() as i32)).collect()
}

/// Inspects a scene as a folder and as a stream, and compares the models.
fn check(scene: &str, views: usize, encoding: &str, folder: &Path) {
    let (mut server, address) = match stream(scene, encoding) {
        Ok(server) => server,
        Err(why) => {
            eprintln!("SKIPPED: {why}: nothing is streamed by Foxglove's SDK");
            return;
        }
    };
    let live = inspect(&format!("{address}?views={views}&fixed_frame=table&silence_s=20"), &folder.join("live"));
    let _ = server.kill();
    let _ = server.wait();
    let recorded = inspect(scene, &folder.join("recorded"));
    let (a, b) = (voxels(&live), voxels(&recorded));
    let (common, all) = (a.intersection(&b).count(), a.union(&b).count());
    eprintln!(
        "{encoding}: {} points live, {} from the folder; {common} of {all} voxels of 3 mm are the same",
        live.len(),
        recorded.len()
    );
    assert!(recorded.len() > 500 && common * 1000 >= all * 995, "{common} of {all}");
}

#[test]
fn a_camera_of_ros_streams_to_the_model_of_the_folder() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let scene = dir.path().join("scene").to_str().expect("UTF-8").to_owned();
    let made = semascan(&["convert", MOTOR, &scene]);
    assert_eq!(made.status.code(), Some(0), "{}", stderr(&made));
    check(&scene, 3, "cdr", dir.path());
}

#[test]
fn a_real_scene_streams_to_the_model_of_the_folder() {
    let Ok(data) = std::env::var("SEMASCAN_DATA") else {
        eprintln!("SKIPPED: SEMASCAN_DATA is not set: no real scene is streamed");
        return;
    };
    let scene = Path::new(&data).join("shelf-eye-in-hand");
    let dir = tempfile::tempdir().expect("temporary folder");
    check(scene.to_str().expect("UTF-8"), 15, "protobuf", dir.path());
}
