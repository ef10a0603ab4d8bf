//! What somebody meets who types the first commands: what is not there, what was meant, how much is said.

use crate::{MOTOR, semascan, stderr};
use std::path::Path;

fn text(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

#[test]
fn a_missing_file_has_one_exit_code_and_is_named() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let missing = dir.path().join("missing-thing");
    let (missing, out) = (text(&missing), dir.path().join("out"));
    let out = text(&out);
    let mesh = format!("virtual:mesh?path={missing}.obj");
    let ply = format!("{missing}.ply");
    let json = format!("{missing}.json");
    for args in [
        &["inspect", missing, "--out", out][..],
        &["inspect", &mesh, "--out", out],
        &["inspect", MOTOR, "--out", out, "--config", missing],
        &["inspect", MOTOR, "--out", out, "--labels", "network", "--models", missing],
        &["serve", missing, "--port", "0"],
        &["serve", "--source", missing, "--port", "0"],
        &["serve", "--config", missing, "--port", "0"],
        &["serve", "--web-dir", missing, "--port", "0"],
        &["demo", "--source", missing, "--port", "0", "--no-open"],
        &["evaluate", &ply, &ply],
        &["evaluate", &ply, &json],
        &["evaluate", missing, &json],
        &["evaluate", "--photometric", missing, missing],
        &["export", missing, "--format", "obj"],
        &["export", &ply, "--format", "obj", "--out", out],
        &["models", "--models", missing],
        &["models", "calibrate", missing, "--views", missing],
        &["doctor", "--config", missing],
        &["config", missing],
    ] {
        let output = semascan(args);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {}", stderr(&output));
        assert!(stderr(&output).contains("missing-thing"), "{args:?}: {}", stderr(&output));
    }
    assert!(!Path::new(out).join("inspection.json").exists(), "nothing was begun");
}

#[test]
fn a_slip_is_answered_with_what_was_meant_and_what_there_is() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let out = dir.path().join("out");
    let scene = dir.path().join("set/000000");
    std::fs::create_dir_all(&scene).expect("a folder");
    std::fs::write(scene.join("scene_camera.json"), "{}").expect("writes");
    let (out, set) = (text(&out), dir.path().join("set"));
    let first = format!("did you mean {}", text(&scene));
    let config = dir.path().join("cell.toml");
    std::fs::write(&config, "[source]\nvoxl_mm = 1.0\n").expect("writes");
    for (args, said) in [
        (&["inspect", text(&set), "--out", out][..], &[first.as_str()][..]),
        (&["inspect", "virtual:starter-motor?sed=7", "--out", out], &["\"seed\"", "views", "errors", "part-seed"]),
        (&["inspect", "virtual:startermotor", "--out", out], &["\"starter-motor\"", "mesh"]),
        (&["inspect", MOTOR, "--out", out, "--config", text(&config)], &["\"voxel_mm\"", "camera_mask", "source"]),
        (&["inspect", MOTOR, "--out", out, "--labels", "networks"], &["network", "source", "none"]),
        (&["inspect", "rtsp://cell", "--out", out], &["rtsp://", "BOP scene folder"]),
        (&["evaluate", text(&config), text(&config)], &["ply", "obj", "glb"]),
        (&["export", out, "--format", "gltf"], &["glb", "obj", "stl"]),
        (&["inspekt"], &["inspect"]),
    ] {
        let output = semascan(args);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {}", stderr(&output));
        for word in said {
            assert!(stderr(&output).contains(word), "{args:?}: {word} is not in {}", stderr(&output));
        }
    }
}

#[test]
fn quiet_says_nothing_of_what_went_well_and_verbose_speaks_of_every_view() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let inspect = |name: &str, flags: &[&str]| {
        let out = dir.path().join(name);
        let output = semascan(&[&["inspect", MOTOR, "--out", text(&out)], flags].concat());
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        stderr(&output)
    };
    assert_eq!(inspect("quiet", &["-qq"]), "");
    let normal = inspect("normal", &[]);
    assert!(normal.contains("3 of 3 views used") && !normal.contains("view 1:"), "{normal}");
    let verbose = inspect("verbose", &["-v"]);
    for view in 0..3 {
        let line = verbose.lines().find(|line| line.contains(&format!("view {view}: ")));
        assert!(line.is_some_and(|line| line.contains("points more") && line.contains(" ms")), "{verbose}");
    }
    // Errors are said all the same.
    let failed = semascan(&["-qq", "inspect", "/no/such/folder", "--out", text(&dir.path().join("new"))]);
    assert!(stderr(&failed).contains("/no/such/folder"));
    assert_eq!(semascan(&["inspect", "-q", "-v", MOTOR, "--out", "x"]).status.code(), Some(2));
}

#[test]
fn shells_get_completions_and_the_sample_is_a_configuration() {
    for (shell, word) in [("bash", "complete -F"), ("zsh", "#compdef semascan"), ("fish", "complete -c semascan")] {
        let output = semascan(&["completions", shell]);
        assert_eq!(output.status.code(), Some(0));
        let script = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(script.contains(word) && script.contains("least-views"), "{shell}");
    }
    let dir = tempfile::tempdir().expect("temporary folder");
    let file = dir.path().join("cell.toml");
    let sample = semascan(&["config", "--sample"]);
    std::fs::write(&file, &sample.stdout).expect("writes");
    let output = semascan(&["config", text(&file)]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    std::fs::write(&file, "[serve]\nport = 1\n").expect("writes");
    let output = semascan(&["config", text(&file)]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("port") && stderr(&output).contains("listen"), "{}", stderr(&output));
}

#[test]
fn no_help_speaks_of_papers_in_codes() {
    let commands = [
        "demo",
        "serve",
        "inspect",
        "evaluate",
        "export",
        "models",
        "doctor",
        "config",
        "completions",
        "schema",
        "synth",
    ];
    let calls = commands.iter().map(|command| vec![*command, "--help"]);
    for args in calls.chain([vec!["--help"], vec!["models", "calibrate", "--help"]]) {
        let output = semascan(&args);
        assert_eq!(output.status.code(), Some(0), "{args:?}");
        let help = String::from_utf8_lossy(&output.stdout).into_owned();
        let is_code = |word: &str| matches!(word, "P0" | "P1" | "P2" | "P3" | "Eq" | "Eqs");
        let code = help.split(|c: char| !c.is_alphanumeric()).find(|word| is_code(word));
        assert_eq!(code, None, "{args:?}");
    }
    // Where the papers themselves are the subject, each is named.
    let help = String::from_utf8_lossy(&semascan(&["tables", "--help"]).stdout).into_owned();
    for (code, subject) in [("P0", "remanufacturing"), ("P1", "eye-in-hand"), ("P2", "Keyframe")] {
        assert!(help.lines().any(|line| line.contains(code) && line.contains(subject)), "{code}: {help}");
    }
    let own = String::from_utf8_lossy(&semascan(&["--help"]).stdout).into_owned();
    assert!(own.starts_with("Semantic 3D inspection of used parts"), "{own}");
    let inspect = String::from_utf8_lossy(&semascan(&["inspect", "--help"]).stdout).into_owned();
    for key in ["seed", "views", "size", "errors", "noise", "sampling", "domain", "part-seed", "cell", "path", "unit"] {
        assert!(inspect.lines().any(|line| line.trim_start().starts_with(&format!("{key} "))), "{key}");
    }
}

#[test]
fn a_unit_that_is_said_is_used() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let corners = (0..8).map(|i| format!("v {} {} {}\n", i & 1, (i >> 1) & 1, (i >> 2) & 1)).collect::<String>();
    let faces = "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    let cube = dir.path().join("cube.obj");
    std::fs::write(&cube, corners + faces).expect("writes");
    for (unit, metres) in [("mm", 0.001), ("cm", 0.01), ("m", 1.0), ("inch", 0.0254)] {
        let output = semascan(&["evaluate", text(&cube), text(&cube), "--unit", unit, "--samples", "100", "--json"]);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        let report: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
        for model in ["a", "b"] {
            assert_eq!(report[model]["scale"].as_f64(), Some(metres), "{unit}");
            assert_eq!(report[model]["scale_assumed"], false);
        }
    }
    // An inspection of it in inches: its truth is 25.4 mm wide.
    let out = dir.path().join("out");
    let source = format!("virtual:mesh?path={}&views=3&size=160x120&errors=none", text(&cube));
    let output = semascan(&["inspect", &source, "--unit", "inch", "--out", text(&out)]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let bytes = std::fs::read(out.join("truth.ply")).expect("reads");
    let truth = semascan_formats::ply::read("truth.ply", &bytes).expect("own file").mesh;
    let heights = truth.vertices.positions.iter().map(|p| p[2]);
    let height = heights.clone().fold(f32::MIN, f32::max) - heights.fold(f32::MAX, f32::min);
    assert!((height - 0.0254).abs() < 1e-5, "{height} m");
    for wrong in ["feet", "metre"] {
        let output = semascan(&["inspect", &source, "--unit", wrong, "--out", text(&out)]);
        assert_eq!(output.status.code(), Some(2));
        assert!(stderr(&output).contains("inch"), "{}", stderr(&output));
    }
}

#[test]
fn poses_are_judged_by_the_truth_of_a_turntable_recording() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let set = dir.path().join("set");
    let synth =
        ["synth", "--turntable", "bracket", "--posed", "--masks", "--parts", "1", "--views", "4", "--seed", "2"];
    let output = semascan(&[&synth[..], &["--size", "160x120", "--out", text(&set)]].concat());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let (scene, out) = (set.join("000000"), dir.path().join("out"));
    let output = semascan(&["inspect", text(&scene), "--registration", "kinematic", "--out", text(&out)]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let truth = scene.join("truth.json");
    let output = semascan(&["evaluate", text(&out), text(&truth), "--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    let views = report["views"].as_array().expect("views");
    assert_eq!(views.len(), 4);
    // The recording has the true poses, to the digits of its files.
    assert!(
        views.iter().all(|v| v["translation"].as_f64() < Some(1e-4) && v["rotation"].as_f64() < Some(1e-3)),
        "{report}"
    );
    assert!(stderr(&output).contains("after the one rigid motion"), "{}", stderr(&output));
    let output = semascan(&["evaluate", text(&out), text(&truth), "--unit", "mm"]);
    assert_eq!(output.status.code(), Some(2), "a unit has no meaning here");
}
