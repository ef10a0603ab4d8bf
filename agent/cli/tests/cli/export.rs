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
        assert!(geometry.contains(&format!("\ng {name}\nusemtl {name}\n")), "{name}");
        assert!(materials.contains(&format!("newmtl {name}\n")), "{name}");
        assert!(bytes(&out, &format!("mesh-{name}.stl")).len() > 84, "{name}");
    }

    // Fewer triangles and fewer points, where that is asked for.
    let faces = |folder: &str| {
        let text = String::from_utf8_lossy(&bytes(folder, "mesh.ply")).into_owned();
        let line = text.lines().find_map(|l| l.strip_prefix("element face ")).expect("faces");
        line.parse::<usize>().expect("a number")
    };
    let small = path("small");
    let simplified = ["export", &motor, "--format", "cloud,ply", "--simplify", "2000", "--out", &small];
    assert_eq!(semascan(&simplified).status.code(), Some(0));
    assert!(faces(&out) > 2000 && faces(&small) <= 2000, "{} and {}", faces(&out), faces(&small));
    assert!(String::from_utf8_lossy(&bytes(&small, "cloud.ply")).contains("element vertex 2000\n"));

    // The source is not overwritten, and what is wrong with a call is said.
    assert_eq!(semascan(&["export", &motor, "--format", "cloud"]).status.code(), Some(2));
    assert_eq!(semascan(&["export", &motor, "--format", "ply", "--pitch", "99"]).status.code(), Some(2));
    assert_eq!(semascan(&["export", &path("nowhere"), "--format", "ply"]).status.code(), Some(1));
}
