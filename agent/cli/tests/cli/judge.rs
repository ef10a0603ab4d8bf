//! Findings in the files of an inspection, and `semascan judge`.

use crate::{semascan, stderr};
use std::path::Path;
use std::process::Output;

const MOTOR: &str = "virtual:starter-motor?seed=3&views=3&size=320x240&cell=2.5";

fn judge(folder: &str, criteria: &Path, more: &[&str]) -> Output {
    let criteria = criteria.to_str().expect("UTF-8");
    semascan(&[&["judge", folder, "--criteria", criteria, "--json"], more].concat())
}

fn verdict(output: &Output) -> serde_json::Value {
    assert_eq!(output.status.code(), Some(0), "{}", stderr(output));
    serde_json::from_slice(&output.stdout).expect("one JSON object")
}

fn record(folder: &str) -> serde_json::Value {
    let text = std::fs::read_to_string(Path::new(folder).join("inspection.json")).expect("reads");
    serde_json::from_str(&text).expect("JSON")
}

#[test]
fn what_was_found_is_judged_and_keeps_its_name() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let path = |name: &str| dir.path().join(name);
    let motor = path("motor").to_str().expect("UTF-8").to_owned();
    let head = "version = 1\nname = \"motors\"\nrevision = \"7\"\n";
    let lenient = path("lenient.toml");
    let every = |defects: &[&str], rule: &str| -> String {
        defects.iter().map(|d| format!("[[defect]]\ndefect = \"{d}\"\n{rule}\n")).collect()
    };
    let all = ["corrosion", "wear", "crack"];
    std::fs::write(&lenient, format!("{head}{}", every(&all, "then = \"accept\""))).expect("written");
    let output = semascan(&["inspect", MOTOR, "--out", &motor, "--criteria", lenient.to_str().expect("UTF-8")]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stderr(&output).contains("verdict by \"motors\", revision 7"), "{}", stderr(&output));

    // The findings stand in the record and in the scene, with the areas of the model's figures.
    let written = record(&motor);
    assert_eq!(written["verdict"]["criteria"]["revision"], "7");
    let list = written["findings"]["list"].as_array().expect("a list").clone();
    assert!(list.len() > 3, "{} findings", list.len());
    for defect in written["defects"].as_array().expect("a list") {
        let own = list.iter().filter(|f| f["defect"]["class"] == defect["class"]);
        let area = |value: &serde_json::Value| value.as_f64().expect("a number");
        let large: f64 = own.map(|f| area(&f["region"]["area"]["value"])).sum();
        let small = written["findings"]["left_out"].as_array().expect("a list").iter();
        let small: f64 = small.filter(|l| l["defect"]["class"] == defect["class"]).map(|l| area(&l["area"])).sum();
        assert!((large + small - area(&defect["area"])).abs() < 1e-10, "{defect}: {large} and {small}");
    }
    let scene = gltf::Gltf::open(path("motor").join("scene.glb")).expect("valid");
    let in_scene = |id: &serde_json::Value| {
        scene
            .nodes()
            .filter_map(|n| n.extras().as_ref())
            .any(|extras| extras.get().contains(id.as_str().expect("text")))
    };
    assert!(list.iter().all(|finding| in_scene(&finding["id"])));

    // Stricter criteria, first printed only, then kept.
    let strict = path("strict.toml");
    let rule = "largest_area_mm2 = 1\nthen = \"reject\"";
    std::fs::write(&strict, format!("{head}{}", every(&all, rule))).expect("written");
    let printed = verdict(&judge(&motor, &strict, &["--print-only"]));
    assert_eq!((&printed["decision"], &printed["automatic"]), (&"reject".into(), &"reject".into()));
    assert_eq!(record(&motor), written, "the folder stays as it is");
    let kept = verdict(&judge(&motor, &strict, &[]));
    assert_eq!(record(&motor)["verdict"]["automatic"], "reject");
    let rejecting = kept["lines"].as_array().expect("a list").iter().filter(|l| l["decision"] == "reject");
    assert!(rejecting.clone().count() > 0 && rejecting.clone().all(|l| l["findings"][0].is_string()), "{kept}");
    // The set is still whole.
    let again = semascan(&["evaluate", &format!("{motor}/mesh.ply"), &format!("{motor}/truth.ply")]);
    assert_eq!(again.status.code(), Some(0), "{}", stderr(&again));

    // Another run gives the same names, in another folder and in place of the first; so do other poses there.
    let ids = |folder: &str| -> Vec<String> {
        let record = record(folder);
        let list = record["findings"]["list"].as_array().expect("a list").clone();
        list.iter().map(|f| f["id"].as_str().expect("text").to_owned()).collect()
    };
    let first = ids(&motor);
    let second = path("second").to_str().expect("UTF-8").to_owned();
    assert_eq!(semascan(&["inspect", MOTOR, "--out", &second]).status.code(), Some(0));
    assert_eq!(ids(&second), first);
    let rebuilt = ["inspect", MOTOR, "--out", &second, "--overwrite", "--registration", "kinematic"];
    let output = semascan(&rebuilt);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let now = ids(&second);
    let found = first.iter().filter(|id| now.contains(id)).count();
    assert!(4 * found >= 3 * first.len(), "{found} of {} names stay under other poses", first.len());
}

#[test]
fn criteria_that_cannot_be_used_are_a_wrong_call() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let motor = dir.path().join("motor").to_str().expect("UTF-8").to_owned();
    let uri = "virtual:starter-motor?seed=3&views=1&size=96x72&cell=4&errors=none";
    assert_eq!(semascan(&["inspect", uri, "--out", &motor]).status.code(), Some(0));
    let head = "version = 1\nname = \"motors\"\nrevision = \"7\"\n";
    let rule = "[[defect]]\ndefect = \"wear\"\nlargest_count = 1\nthen = \"reject\"\n";
    for (text, words) in [
        (format!("{head}{}", rule.replace("wear", "waer")), ["criteria.toml", "\"waer\"", "\"wear\""]),
        (
            format!("{head}{}", rule.replace("largest_count", "largest_cuont")),
            ["criteria.toml", "largest_cuont", "largest_count"],
        ),
        (
            format!("{head}[[component]]\ncomponent = \"gaer\"\nthen = \"reject\"\n"),
            ["criteria.toml", "\"gaer\"", "gear"],
        ),
        (
            format!("{head}[reference]\nfile = \"cad.stl\"\nunit = \"mm\"\ntolerance_mm = 1\nthen = \"reject\"\n"),
            ["criteria.toml", "reference", "cad.stl"],
        ),
    ] {
        let criteria = dir.path().join("criteria.toml");
        std::fs::write(&criteria, &text).expect("written");
        let before = record(&motor);
        let output = judge(&motor, &criteria, &[]);
        assert_eq!(output.status.code(), Some(2), "{text}: {}", stderr(&output));
        let said = stderr(&output);
        assert!(words.iter().all(|word| said.contains(word)) && output.stdout.is_empty(), "{text}: {said}");
        assert_eq!(record(&motor), before);
    }
    // What was inspected without labels has nothing to judge: a person decides.
    let bare = dir.path().join("bare").to_str().expect("UTF-8").to_owned();
    assert_eq!(semascan(&["inspect", uri, "--out", &bare, "--labels", "none"]).status.code(), Some(0));
    let criteria = dir.path().join("right.toml");
    std::fs::write(&criteria, format!("{head}{rule}")).expect("written");
    assert_eq!(verdict(&judge(&bare, &criteria, &[]))["decision"], "person");
    let missing = judge(dir.path().join("nowhere").to_str().expect("UTF-8"), &criteria, &[]);
    assert_eq!(missing.status.code(), Some(2), "{}", stderr(&missing));
    let empty = judge(dir.path().to_str().expect("UTF-8"), &criteria, &[]);
    assert!(empty.status.code() == Some(1) && stderr(&empty).contains("inspection.json"), "{}", stderr(&empty));
    // The true mesh as the reference: the surface lies on it, and a hand's breadth of it does not.
    let reference = |tolerance: &str| {
        let text = format!(
            "{head}unlisted = \"accept\"\n[reference]\nfile = \"motor/truth.ply\"\nunit = \"m\"\ntolerance_mm = {tolerance}\nthen = \"reject\"\n"
        );
        std::fs::write(&criteria, text).expect("written");
        verdict(&judge(&motor, &criteria, &[]))
    };
    assert_eq!(reference("20")["decision"], "accept");
    let schema = semascan(&["schema", "criteria"]);
    let schema: serde_json::Value = serde_json::from_slice(&schema.stdout).expect("JSON");
    assert!(schema["properties"]["defect"].is_object() && schema["additionalProperties"] == false, "{schema}");
}
