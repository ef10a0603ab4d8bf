//! Calibrations through rendered pictures against the truth: how exact corners are, how often they have wrong names before and after
//! the gates, and how far camera and axis are off. `cargo bench -p semascan-boards --bench calibration -- [--seeds N]
//! [--robot DEG MM] [--pictures DIR]`; with a folder the pictures of the first seed are kept there with `captures.json`,
//! `verify.json` and `truth.json`, for `semascan calibrate` and other detectors (`by_opencv.py`). What was measured goes to stdout as one
//! JSON object.

#![allow(clippy::print_stdout)]

#[path = "../tests/rendered_cell/mod.rs"]
mod rendered_cell;

use rendered_cell::{RenderedCell, Taken};
use semascan_boards::detect;
use semascan_calibration::{Capture, board_view, calibrate, check_intrinsics};
use semascan_perception::view::{CameraModel, Distortion, Intrinsics};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Captures with the table at rest, with the table all around, and kept back.
const CAPTURES: (usize, usize, usize) = (14, 14, 4);
const BOARD: &str =
    r#"{"type":"charuco","columns":11,"rows":8,"square_mm":18,"marker_mm":13.5,"dictionary":"DICT_5X5_100"}"#;
const SIZE: (u32, u32) = (1280, 960);
const PINHOLE: [f64; 4] = [1200.0, 1198.0, 643.0, 474.0];
const LENS: [f64; 5] = [-0.09, 0.04, 0.0006, -0.0004, 0.0];
/// Distance from which on a corner has the name of another one, pixels.
const WRONG: f64 = 5.0;

struct Arguments {
    seeds: u64,
    robot_error: (f64, f64),
    pictures: Option<PathBuf>,
}

fn arguments() -> Arguments {
    let mut parsed = Arguments { seeds: 3, robot_error: (0.0, 0.0), pictures: None };
    let mut words = std::env::args().skip(1);
    let number = |word: Option<String>| word.and_then(|word| word.parse::<f64>().ok()).expect("a number");
    while let Some(word) = words.next() {
        match word.as_str() {
            "--seeds" => parsed.seeds = number(words.next()) as u64,
            "--robot" => parsed.robot_error = (number(words.next()).to_radians(), number(words.next()) * 1e-3),
            "--pictures" => parsed.pictures = words.next().map(PathBuf::from),
            _ => {}
        }
    }
    parsed
}

fn main() {
    let Arguments { seeds, robot_error, pictures } = arguments();
    let pinhole =
        Intrinsics { width: SIZE.0, height: SIZE.1, fx: PINHOLE[0], fy: PINHOLE[1], cx: PINHOLE[2], cy: PINHOLE[3] };
    let lens = Distortion::named("plumb_bob", &LENS).expect("a lens");
    let camera = CameraModel::new(pinhole, lens).expect("a camera");
    let board: semascan_calibration::Board = serde_json::from_str(BOARD).expect("a board");
    eprintln!("robot errors {:.4} deg, {:.4} mm along each axis", robot_error.0.to_degrees(), robot_error.1 * 1e3);
    eprintln!(
        "seed  captures  camera deg      mm   within deg      mm   axis deg      mm   within deg      mm  camera's numbers"
    );
    let mut calibrations = Vec::new();
    let (mut errors, mut visible, mut wrong, mut wrong_kept, mut seconds) = (Vec::new(), 0, 0, 0, Vec::new());
    for seed in 1..=seeds {
        let mut cell = RenderedCell::new(board.clone(), camera.clone(), (0.3, 0.45), seed);
        cell.robot_error = robot_error;
        let taken = cell.captures(CAPTURES.0, CAPTURES.1);
        let mut views = Vec::new();
        for taken in &taken {
            let begun = Instant::now();
            let corners = detect(&cell.board, &taken.picture).expect("the board is seen");
            seconds.push(begun.elapsed().as_secs_f64());
            let is_wrong =
                |corner: &&semascan_calibration::Corner| cell.corner_error(corner, &taken.camera_from_board) > WRONG;
            wrong += corners.iter().filter(is_wrong).count();
            let view = board_view(&corners, &cell.camera).expect("a pose");
            wrong_kept += view.corners.iter().filter(is_wrong).count();
            errors.extend(view.corners.iter().map(|corner| cell.corner_error(corner, &taken.camera_from_board)));
            let there = cell.board.corners_mm();
            visible += there.iter().filter(|mm| cell.corner(**mm, &taken.camera_from_board).is_some()).count();
            views.push(view);
        }
        let captures: Vec<Capture> = taken.iter().zip(&views).map(|(taken, view)| taken.capture(view)).collect();
        let check = check_intrinsics(&views.iter().collect::<Vec<_>>(), &cell.camera);
        // Fourteen captures: half with the table at rest, half all around; then all of them.
        let fourteen: Vec<Capture> = captures[..7].iter().chain(captures[14..].iter().step_by(2)).copied().collect();
        for set in [&fourteen, &captures] {
            let found = calibrate(set, None).expect("calibrates");
            let ((w, t), (turn, shift)) = (cell.camera_error(&found), cell.axis_error(&found));
            let (uw, ut) = found.hand_eye.expect("it moved").expanded_uncertainty();
            let (uturn, ushift) = found.turntable.expect("it turned").expanded_uncertainty();
            calibrations.push(json!({ "seed": seed, "captures": set.len(), "camera_deg": w, "camera_mm": t, "axis_deg": turn, "axis_mm": shift }));
            eprintln!(
                "{seed:>4}  {:>8}  {w:>10.4}  {t:>6.4}  {:>11.4}  {:>6.4}  {turn:>9.4}  {shift:>6.4}  {:>11.4}  {:>6.4}  {}",
                set.len(),
                uw.to_degrees(),
                ut * 1e3,
                uturn.to_degrees(),
                ushift * 1e3,
                check.verdict
            );
        }
        if let Some(folder) = pictures.as_ref().filter(|_| seed == 1) {
            let kept_back = cell.captures(1, CAPTURES.2 - 1);
            write(folder, &cell, &taken, &kept_back);
        }
    }
    errors.sort_by(f64::total_cmp);
    seconds.sort_by(f64::total_cmp);
    let at = |share: f64| errors[(share * (errors.len() - 1) as f64) as usize];
    eprintln!(
        "corners: {} of {visible} visible ones, median {:.4}, p95 {:.4}, largest {:.4} pixels; wrong names: {wrong} found, {wrong_kept} kept; \
         {:.1} ms a picture (median)",
        errors.len(),
        at(0.5),
        at(0.95),
        at(1.0),
        seconds[seconds.len() / 2] * 1e3
    );
    let corners = json!({
        "found": errors.len(), "visible": visible, "median_px": at(0.5), "p95_px": at(0.95), "largest_px": at(1.0),
        "wrong_found": wrong, "wrong_kept": wrong_kept
    });
    println!("{}", json!({ "calibrations": calibrations, "corners": corners }));
}

/// Pictures and files for other programs.
fn write(folder: &Path, cell: &RenderedCell, taken: &[Taken], kept_back: &[Taken]) {
    std::fs::create_dir_all(folder).expect("a folder");
    let mut truth = Vec::new();
    for (name, taken) in [("captures", taken), ("verify", kept_back)] {
        let mut captures = Vec::new();
        for (number, taken) in taken.iter().enumerate() {
            let picture = format!("{name}-{number:02}.png");
            taken.picture.save(folder.join(&picture)).expect("written");
            let corners = cell.board.corners_mm().into_iter();
            let corners = corners.map(|mm| cell.corner(mm, &taken.camera_from_board)).collect::<Vec<_>>();
            truth.push(json!({ "picture": picture, "corners": corners }));
            captures.push(json!({
                "base_from_ee": pose(&taken.base_from_ee),
                "table_angle_deg": taken.table_angle.to_degrees(),
                "picture": picture
            }));
        }
        let [fx, fy, cx, cy] = PINHOLE;
        let file = json!({
            "camera": { "width": SIZE.0, "height": SIZE.1, "fx": fx, "fy": fy, "cx": cx, "cy": cy,
                        "distortion": { "model": "plumb_bob", "coefficients": LENS } },
            "board": serde_json::from_str::<Value>(BOARD).expect("JSON"),
            "working_distance_m": 0.4,
            "temperature_c": 21.0,
            "captures": captures
        });
        std::fs::write(folder.join(format!("{name}.json")), file.to_string()).expect("written");
    }
    let truth = json!({
        "ee_from_camera": pose(&cell.ee_from_camera),
        "base_from_tablebase": pose(&cell.base_from_tablebase),
        "pictures": truth
    });
    std::fs::write(folder.join("truth.json"), truth.to_string()).expect("written");
}

fn pose(pose: &nalgebra::Isometry3<f64>) -> Value {
    let (q, t) = (pose.rotation.coords, pose.translation.vector);
    json!({ "translation": [t.x, t.y, t.z], "rotation": { "x": q.x, "y": q.y, "z": q.z, "w": q.w } })
}
