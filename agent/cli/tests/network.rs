//! Networks as a script sees them: models that are listed, an inspection that they label, and what is wrong named before
//! the first view.

#[path = "../../perception/src/segment/network/fixtures/onnx.rs"]
#[allow(dead_code)]
mod onnx;

use serde_json::Value;
use sha2::{Digest, Sha256};
use std::path::Path;
use std::process::{Command, Output};

const MOTOR: &str = "virtual:starter-motor?seed=3&views=2&size=160x120&cell=2.5";

fn semascan(args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_semascan"));
    command.args(args).env_remove("SEMASCAN_MODELS").output().expect("the binary starts")
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{e}: {}", stderr(output)))
}

/// A model of two members that tells the dark from the bright, with a class that the motor has and one that it has not.
fn write_model(folder: &Path, name: &str) {
    std::fs::create_dir_all(folder).expect("a folder");
    let mut text = format!(
        "schema = 1\nname = \"{name}\"\nversion = \"3\"\ntask = \"semantic\"\nfusion = \"none\"\nlicence = \"MIT\"\n\
         [input]\ntensor = \"image\"\nchannels = [\"red\", \"green\", \"blue\"]\nmultiple = 16\n\
         [input.colour]\nmean = [0, 0, 0]\nstd = [1, 1, 1]\n[output]\ntensor = \"probabilities\"\n\
         [metrics]\nmean_iou = 0.25\n"
    );
    for class in ["none", "Solenoid", "gearbox"] {
        text += &format!("[[classes]]\nname = \"{class}\"\ncolour = \"#102030\"\n");
    }
    for (i, bias) in [1.0, 4.0].into_iter().enumerate() {
        let bytes = onnx::classifier(&[&[0.0; 3], &[4.0; 3], &[-9.0; 3]], &[0.0, -bias, bias]);
        let sha256: String = Sha256::digest(&bytes).iter().map(|b| format!("{b:02x}")).collect();
        std::fs::write(folder.join(format!("{i}.onnx")), bytes).expect("writes");
        text += &format!("[[network]]\nfile = \"{i}.onnx\"\nsha256 = \"{sha256}\"\n");
    }
    std::fs::write(folder.join("model.toml"), text).expect("writes");
}

#[test]
fn an_inspection_is_labelled_by_networks_and_says_by_which_and_how_sure_they_were() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let (shelf, out) = (dir.path().join("models"), dir.path().join("out"));
    write_model(&shelf.join("dark"), "dark");
    let config = dir.path().join("cell.toml");
    std::fs::write(&config, "[network]\naugmentations = [\"identity\", \"flip\", \"warp\"]\nseed = 5\nddof = 0")
        .expect("writes");
    let (shelf, config, out_path) =
        (shelf.display().to_string(), config.display().to_string(), out.display().to_string());
    let args = ["inspect", MOTOR, "--out", &out_path, "--labels", "network", "--models", &shelf, "--config", &config];
    let output = semascan(&[&args[..], &["--sigma", "0.2", "--uncertain", "drop", "--json"]].concat());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let record = json(&output);
    assert_eq!(record["labels"], "network");
    let said = &record["networks"];
    assert_eq!((&said["models"][0]["name"], &said["models"][0]["version"]), (&"dark".into(), &"3".into()));
    assert_eq!(said["models"][0]["networks"][1]["sha256"].as_str().map(str::len), Some(64));
    let engine = said["engine"]["name"].as_str().expect("an engine");
    assert!(engine == "onnxruntime" || engine == "tract", "{engine}");
    assert_eq!(said["augmentations"], serde_json::json!(["identity", "flip", "warp"]));
    assert_eq!((&said["uncertain"], &said["statistic"], &said["ddof"]), (&"drop".into(), &"norm".into(), &0.into()));
    assert!((said["threshold"].as_f64().expect("a number") - 0.2).abs() < 1e-6, "{said}");
    let figures = &record["views"][0]["networks"];
    assert!(
        figures["window"]["width"].is_number() && figures["components"]["sigma"].as_f64().is_some_and(|s| s > 0.0),
        "{figures}"
    );
    // The motor's classes keep their numbers, so that truth can judge; what only the network knows comes after them.
    let names: Vec<&str> =
        record["components"].as_array().expect("classes").iter().filter_map(|c| c["name"].as_str()).collect();
    assert!(names.contains(&"solenoid") && !names.contains(&"Solenoid"), "{names:?}");
    assert!(record["truth"]["label_accuracy"].is_number());
    let again = semascan(&[&args[..], &["--overwrite", "--sigma", "0.2", "--uncertain", "drop"]].concat());
    assert!(again.status.success());
    let cloud = std::fs::read(out.join("cloud.ply")).expect("a cloud");
    let header = String::from_utf8_lossy(&cloud[..cloud.len().min(4000)]).into_owned();
    assert!(header.contains("gearbox"), "{header}");
}

#[test]
fn what_is_wrong_with_a_model_is_named_before_the_first_view() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let shelf = dir.path().join("models");
    write_model(&shelf.join("dark"), "dark");
    let (path, out) = (shelf.display().to_string(), dir.path().join("out").display().to_string());
    let inspect = |more: &[&str]| semascan(&[&["inspect", MOTOR, "--out", &out, "--labels", "network"], more].concat());
    let unknown = inspect(&["--models", &format!("{path},bright")]);
    assert_eq!(unknown.status.code(), Some(2), "{}", stderr(&unknown));
    assert!(stderr(&unknown).contains("bright") && stderr(&unknown).contains("dark"));
    let threshold = inspect(&["--models", &path, "--sigma", "2"]);
    assert_eq!(threshold.status.code(), Some(2), "{}", stderr(&threshold));
    assert!(stderr(&threshold).contains("threshold"));
    std::fs::write(shelf.join("dark/1.onnx"), b"something else").expect("writes");
    let changed = inspect(&["--models", &path]);
    assert_eq!(changed.status.code(), Some(1), "{}", stderr(&changed));
    assert!(stderr(&changed).contains("network[1].sha256") && stderr(&changed).contains("1.onnx"));
    assert!(!Path::new(&out).exists(), "nothing was inspected");
}

#[test]
fn models_lists_what_is_installed_and_doctor_fails_on_what_is_broken() {
    let dir = tempfile::tempdir().expect("temporary folder");
    write_model(&dir.path().join("dark"), "dark");
    let path = dir.path().display().to_string();
    let output = semascan(&["models", "--models", &path, "--json"]);
    let listed = json(&output);
    let model = &listed["models"][0];
    assert_eq!((&model["name"], &model["task"], &model["valid"]), (&"dark".into(), &"semantic".into(), &true.into()));
    assert_eq!(model["metrics"]["mean_iou"], 0.25);
    assert!(stderr(&output).contains("0.250") && stderr(&output).contains("gearbox"), "{}", stderr(&output));
    let doctor = |models: &Path| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_semascan"));
        command.args(["doctor", "--json"]).env("SEMASCAN_MODELS", models).output().expect("the binary starts")
    };
    let models = |report: &Value| {
        let found = report["findings"].as_array().expect("findings").iter().find(|f| f["what"] == "models").cloned();
        found.expect("models are looked at")
    };
    assert_eq!(models(&json(&doctor(dir.path())))["health"], "ok");
    let empty = tempfile::tempdir().expect("temporary folder");
    assert_eq!(models(&json(&doctor(empty.path())))["health"], "warning");
    std::fs::remove_file(dir.path().join("dark/0.onnx")).expect("was there");
    let output = doctor(dir.path());
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let report = json(&output);
    assert_eq!((&report["healthy"], &models(&report)["health"]), (&false.into(), &"failed".into()));
    assert!(stderr(&output).contains("0.onnx"), "{}", stderr(&output));
}

#[test]
fn the_tables_of_networks_are_made_by_the_models_that_are_there() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let shelf = dir.path().join("models");
    write_model(&shelf.join("dark"), "dark");
    write_model(&shelf.join("comparison/u-net-edge"), "u-net-edge");
    let path = shelf.display().to_string();
    let output = semascan(&["tables", "P0", "--table", "3,5,6", "--quick", "--models", &path, "--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let report = json(&output);
    assert!(report.get("table_1").is_none());
    let rows = report["table_3"]["rows"].as_array().expect("rows");
    let trained: Vec<&Value> = rows.iter().filter(|r| r["domains"][0].is_object()).map(|r| &r["model"]).collect();
    assert_eq!(trained, ["u-net-edge"]);
    assert!(stderr(&output).contains("not trained here"), "{}", stderr(&output));
    let table = &report["table_5"];
    assert_eq!(table["domains"].as_array().map(Vec::len), Some(3));
    let domain = &table["domains"][2];
    assert_eq!(domain["singles"].as_array().map(Vec::len), Some(2), "each member alone");
    let completeness = |scores: &Value| scores["completeness"].as_f64().expect("a number");
    // What it takes for a gearbox is no class of the motor, and as good as not given.
    let (all, kept) = (completeness(&domain["ensemble"]), completeness(&domain["filtered"]));
    assert!(all > 0.5 && all < 1.0 && kept <= all, "{all} {kept}");
    assert_eq!(report["threshold"]["validation"].as_array().map(Vec::len), Some(2));
    assert_eq!(report["threshold"]["sigma"], report["table_6"]["sigma"]);
    assert_eq!(report["table_6"]["motors"][0]["seed"], 1001);
    let given = semascan(&["tables", "P0", "--table", "5", "--quick", "--models", &path, "--sigma", "0.25", "--json"]);
    let given = json(&given);
    assert_eq!((&given["threshold"]["rule"], &given["table_5"]["sigma"]), (&"given".into(), &0.25.into()));
    for (args, word) in
        [(&["--table", "2"][..], "1, 3, 5, 6"), (&["--sigma", "2"], "--sigma"), (&["--only", "x"], "P1")]
    {
        let wrong = semascan(&[&["tables", "P0"], args].concat());
        assert_eq!(wrong.status.code(), Some(2), "{args:?}");
        assert!(stderr(&wrong).contains(word), "{}", stderr(&wrong));
    }
}

/// Any network: Torchvision's Mask R-CNN, exported by the training package with random weights. `SEMASCAN_TRAINING_PYTHON`
/// names a Python with `agent/training/requirements.txt`, which is gigabytes.
#[test]
fn a_mask_r_cnn_as_torchvision_exports_it_labels_an_inspection() {
    let Some(python) = std::env::var_os("SEMASCAN_TRAINING_PYTHON") else {
        eprintln!("SKIPPED: SEMASCAN_TRAINING_PYTHON is not set: no Mask R-CNN is exported");
        return;
    };
    if std::env::var_os("ORT_DYLIB_PATH").is_none() {
        eprintln!("SKIPPED: ORT_DYLIB_PATH is not set: a Mask R-CNN needs ONNX Runtime");
        return;
    }
    let dir = tempfile::tempdir().expect("temporary folder");
    let model = dir.path().join("mask-rcnn");
    let training = Path::new(env!("CARGO_MANIFEST_DIR")).join("../training");
    let mut export = Command::new(python);
    export.current_dir(training).args(["-m", "semascan_training", "untrained", "recipes/mask-rcnn-resnet34.toml"]);
    let exported = export.arg(&model).output().expect("Python starts");
    assert!(exported.status.success(), "{}", stderr(&exported));
    let (path, out) = (model.display().to_string(), dir.path().join("out").display().to_string());
    let source = "virtual:starter-motor?seed=3&views=1&size=320x240";
    let output = semascan(&["inspect", source, "--labels", "network", "--models", &path, "--out", &out, "--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let said = &json(&output)["networks"];
    assert_eq!(
        (&said["models"][0]["name"], &said["engine"]["name"]),
        (&"mask-rcnn-resnet34".into(), &"onnxruntime".into())
    );
}
