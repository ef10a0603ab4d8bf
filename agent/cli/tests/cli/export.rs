//! `semascan export`.

use crate::{MOTOR, semascan, stderr};
use std::path::Path;

#[test]
fn export_writes_every_format_and_the_same_mesh_as_inspect() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let path = |name: &str| dir.path().join(name).to_str().expect("UTF-8").to_owned();
    let (motor, out) = (path("motor"), path("out"));
    assert_eq!(semascan(&["inspect", MOTOR, "--out", &motor]).status.code(), Some(0));
    let output = semascan(&["export", &motor, "--format", "ply,obj,stl,glb", "--out", &out, "--threads", "1"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let bytes = |folder: &str, file: &str| std::fs::read(Path::new(folder).join(file)).expect("reads");
    assert!(bytes(&motor, "mesh.ply") == bytes(&out, "mesh.ply"), "the mesh differs from that of inspect");
    assert!(bytes(&out, "mesh.glb").starts_with(b"glTF"));
    let geometry = String::from_utf8(bytes(&out, "mesh.obj")).expect("text");
    let materials = String::from_utf8(bytes(&out, "mesh.mtl")).expect("text");
    for name in ["housing", "solenoid"] {
        assert!(geometry.contains(&format!("\no {name}\nusemtl {name}\n")), "{name}");
        assert!(materials.contains(&format!("newmtl {name}\n")), "{name}");
        assert!(bytes(&out, &format!("mesh-{name}.stl")).len() > 84, "{name}");
    }

    // Millimetres where nothing else is asked for, and noted; what a mesh is in does not change it.
    assert!(geometry.starts_with("# semascan") && geometry.contains("unit mm, z up"), "{}", &geometry[..60]);
    assert!(String::from_utf8_lossy(&bytes(&out, "mesh-housing.stl")[..80]).contains("unit mm, z up"));
    let inches = path("inches");
    let call = ["export", &motor, "--format", "obj", "--unit", "inch", "--up", "y", "--out", &inches];
    let output = semascan(&call);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let first = |text: &str| -> Vec<f64> {
        let line = text.lines().find_map(|line| line.strip_prefix("v ")).expect("a vertex");
        line.split(' ').take(3).map(|word| word.parse().expect("a number")).collect()
    };
    let (mm, inch) = (first(&geometry), first(&String::from_utf8(bytes(&inches, "mesh.obj")).expect("text")));
    assert!(mm.iter().any(|c| c.abs() > 10.0), "{mm:?}");
    for (a, b) in [mm[0], mm[2], -mm[1]].into_iter().zip(inch) {
        assert!((a - 25.4 * b).abs() < 1e-4, "{a} mm are not {b} inches");
    }
    let refused = semascan(&["export", &motor, "--format", "glb", "--unit", "mm", "--out", &inches]);
    assert_eq!((refused.status.code(), stderr(&refused).contains("obj and stl")), (Some(2), true));

    // One scene, in the surface's own colours or those of the classes.
    let classes = path("classes");
    let output = semascan(&["export", &motor, "--format", "glb", "--colors", "classes", "--out", &classes]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    for (folder, colored) in [(&out, true), (&classes, false)] {
        let scene = gltf::Gltf::open(Path::new(folder).join("mesh.glb")).expect("valid");
        let primitives = || scene.meshes().flat_map(|mesh| mesh.primitives());
        assert_eq!(scene.scenes().len(), 1);
        assert!(
            primitives().count() > 5 && primitives().all(|p| p.get(&gltf::Semantic::Colors(0)).is_some() == colored)
        );
    }

    // The background is left out and that is said; a switch includes it.
    let points = |folder: &str| {
        let text = String::from_utf8_lossy(&bytes(folder, "cloud.ply")).into_owned();
        let line = text.lines().find_map(|l| l.strip_prefix("element vertex ")).expect("vertices");
        line.parse::<u64>().expect("a number")
    };
    let [part, whole] = [path("part"), path("whole")];
    let without = semascan(&["export", &motor, "--format", "cloud", "--out", &part]);
    assert!(stderr(&without).contains("(--background includes the background)"), "{}", stderr(&without));
    let with = semascan(&["export", &motor, "--format", "cloud,ply", "--background", "--out", &whole]);
    assert_eq!(with.status.code(), Some(0), "{}", stderr(&with));
    assert!(points(&part) < points(&whole) && points(&whole) <= points(&motor));
    assert!(bytes(&whole, "mesh.ply").len() > bytes(&motor, "mesh.ply").len());

    // What the model says in figures is the same in the record and in every scene, simplified or not.
    let record: serde_json::Value = serde_json::from_slice(&bytes(&motor, "inspection.json")).expect("JSON");
    let coarse = path("coarse");
    let output =
        semascan(&["export", &motor, "--format", "glb", "--simplify", "500", "--smooth", "5", "--out", &coarse]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    for (folder, file) in [(&motor, "scene.glb"), (&out, "mesh.glb"), (&coarse, "mesh.glb")] {
        let scene = gltf::Gltf::open(Path::new(folder).join(file)).expect("valid");
        let (mut compared, mut defects) = (0, std::collections::BTreeMap::<u64, (u64, f64)>::new());
        for node in scene.default_scene().and_then(|s| s.nodes().next()).expect("a root").children() {
            let extras: serde_json::Value =
                serde_json::from_str(node.extras().as_ref().expect("figures").get()).expect("JSON");
            let stated =
                record["components"].as_array().expect("a list").iter().find(|c| c["class"] == extras["class"]);
            let stated = stated.expect("a component of the record");
            for figure in ["points", "area", "confidence", "sigma"] {
                assert_eq!(extras[figure], stated[figure], "{figure} of {} in {file}", stated["name"]);
            }
            assert!(stated["area"].as_f64().is_some_and(|area| area > 0.0), "{stated}");
            for finding in extras["findings"].as_array().expect("a list") {
                let sum = defects.entry(finding["defect"].as_u64().expect("a class")).or_default();
                sum.0 += finding["points"].as_u64().expect("a number");
                sum.1 += finding["area"].as_f64().expect("an area");
            }
            compared += 1;
        }
        assert!(compared > 5, "{compared} components");
        for defect in record["defects"].as_array().expect("a list") {
            let (points, area) = defects.get(&defect["class"].as_u64().expect("a class")).copied().unwrap_or_default();
            assert_eq!(defect["points"].as_u64(), Some(points), "{defect}");
            assert!((defect["area"].as_f64().expect("an area") - area).abs() < 1e-12, "{defect}: {area}");
        }
    }

    // Fewer triangles and fewer points, where that is asked for.
    let faces = |folder: &str| {
        let text = String::from_utf8_lossy(&bytes(folder, "mesh.ply")).into_owned();
        let line = text.lines().find_map(|l| l.strip_prefix("element face ")).expect("faces");
        line.parse::<usize>().expect("a number")
    };
    let small = path("small");
    let simplified = ["export", &motor, "--format", "cloud,ply", "--simplify", "2000", "--out", &small];
    let output = semascan(&simplified);
    assert_eq!(output.status.code(), Some(0));
    // Nothing is left out without a word.
    let all = record["points"].as_u64().expect("a number");
    let said = stderr(&output);
    assert!(said.contains(&format!("of {all} points: left out")) && said.contains("background"), "{said}");
    assert!(said.contains(&format!("of the model's {all} points: left out")), "{said}");
    assert!(faces(&out) > 2000 && faces(&small) <= 2000, "{} and {}", faces(&out), faces(&small));
    assert!(String::from_utf8_lossy(&bytes(&small, "cloud.ply")).contains("element vertex 2000\n"));

    // As few triangles as openings and parts leave, which is said.
    let output = semascan(&["export", &motor, "--format", "ply", "--simplify", "1", "--out", &path("few")]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let left = faces(&path("few"));
    assert!(left > 1 && stderr(&output).contains(&format!("{left} are left and not 1")), "{}", stderr(&output));

    // The source is not overwritten, and what is wrong with a call is said.
    assert_eq!(semascan(&["export", &motor, "--format", "cloud"]).status.code(), Some(2));
    let own = semascan(&["export", &format!("{out}/mesh.ply"), "--format", "ply"]);
    assert_eq!(own.status.code(), Some(2), "{}", stderr(&own));
    assert!(stderr(&own).contains("would overwrite its source"), "{}", stderr(&own));
    let set = semascan(&["export", &motor, "--format", "ply"]);
    assert_eq!(set.status.code(), Some(2), "{}", stderr(&set));
    assert!(stderr(&set).contains("is a file of the inspection"), "{}", stderr(&set));
    assert_eq!(semascan(&["export", &motor, "--format", "ply", "--pitch", "99"]).status.code(), Some(2));
    assert_eq!(semascan(&["export", &path("nowhere"), "--format", "ply"]).status.code(), Some(2));
}

#[test]
fn the_origin_of_map_coordinates_is_kept_or_noted() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let path = |name: &str| dir.path().join(name).to_str().expect("UTF-8").to_owned();
    let text = "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\n\
                element face 1\nproperty list uchar int vertex_indices\nend_header\n\
                500000.25 4100000 100\n500001 4100000.5 100\n500000 4100001 101.5\n3 0 1 2\n";
    std::fs::write(path("map.ply"), text).expect("writes");
    let output = semascan(&["export", &path("map.ply"), "--format", "ply,obj,stl,glb", "--out", &path("out")]);
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(0), "{said}");
    for format in ["STL", "GLB"] {
        let expected = format!("{format} holds single precision only: its origin lies at 500000 4100001 100 m of");
        assert!(said.contains(&expected), "{said}");
    }
    let bytes = |file: &str| std::fs::read(Path::new(&path("out")).join(file)).expect("written");
    let geometry = String::from_utf8(bytes("mesh.obj")).expect("text");
    assert!(geometry.contains("\nv 500000250 4100000000 100000"), "{geometry}");
    let mut files = std::fs::read_dir(path("out")).expect("reads").filter_map(Result::ok).map(|entry| entry.path());
    let solid = files.find(|file| file.extension().is_some_and(|e| e == "stl")).expect("one component");
    let header = String::from_utf8_lossy(&std::fs::read(solid).expect("reads")[..80]).into_owned();
    assert!(header.contains("unit mm, z up, origin 500000 4100001 100 m"), "{header}");
    let scene = gltf::Gltf::from_slice(&bytes("mesh.glb")).expect("valid");
    let extras = scene.document.as_json().asset.extras.as_ref().expect("the origin is noted").get().to_owned();
    let extras: serde_json::Value = serde_json::from_str(&extras).expect("JSON");
    assert_eq!(extras["origin"], serde_json::json!([500_000.0, 4_100_001.0, 100.0]));
}

#[test]
fn forty_exports_at_once_onto_one_name_are_right_or_refused() {
    let dir = tempfile::tempdir().expect("temporary folder");
    let path = |name: &str| dir.path().join(name).to_str().expect("UTF-8").to_owned();
    let other = MOTOR.replace("seed=3", "seed=4");
    let files = ["mesh.ply", "mesh.obj", "mesh.mtl", "mesh.glb"];
    let format = ["--format", "ply,obj,glb", "--out"];
    let motors = [("one", MOTOR), ("two", other.as_str())].map(|(name, motor)| {
        assert_eq!(semascan(&["inspect", motor, "--out", &path(name)]).status.code(), Some(0));
        let alone = path(&format!("alone-{name}"));
        assert_eq!(semascan(&[&["export", &path(name)], &format[..], &[&alone]].concat()).status.code(), Some(0));
        files.map(|file| std::fs::read(Path::new(&alone).join(file)).expect("written"))
    });
    let out = path("out");
    let children: Vec<_> = (0..40)
        .map(|i| {
            std::process::Command::new(env!("CARGO_BIN_EXE_semascan"))
                .args([&["export", &path(["one", "two"][i % 2])], &format[..], &[&out]].concat())
                .stderr(std::process::Stdio::piped())
                .spawn()
                .expect("starts")
        })
        .collect();
    let mut done = 0;
    for child in children {
        let output = child.wait_with_output().expect("ends");
        match output.status.code() {
            Some(0) => done += 1,
            Some(1) => assert!(stderr(&output).contains("another process writes"), "{}", stderr(&output)),
            code => panic!("{code:?}: {}", stderr(&output)),
        }
    }
    eprintln!("{done} of 40 exports wrote, the others were refused");
    assert!(done > 0);
    let written = files.map(|file| std::fs::read(Path::new(&out).join(file)).expect("written"));
    assert!(motors.contains(&written), "the files are not those of one export");
    assert_eq!(std::fs::read_dir(&out).expect("reads").count(), files.len(), "no temporary file");
}
