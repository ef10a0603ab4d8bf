//! Every column of `cloud.ply` and `mesh.ply` as Open3D reads it: `by_open3d.py`, in the Python that `SEMASCAN_FOREIGN_PYTHON`
//! names. Open3D passes silently over columns whose type it does not know.

use super::taxonomy;
use semascan_formats::ply::{write_cloud, write_semantic_mesh};
use semascan_model::{NumberType, POINT_COLUMNS, PointFlags, SemanticCloud, SemanticMesh, SemanticPoint};
use serde_json::{Map, Value, json};
use std::process::Command;

/// Names a Python that may have Open3D.
const PYTHON: &str = "SEMASCAN_FOREIGN_PYTHON";
/// What the script ends with where there is no Open3D.
const NO_OPEN3D: i32 = 77;

fn point(k: u16) -> SemanticPoint {
    let share = f32::from(k) / 16.0;
    SemanticPoint {
        position: [share, 1.0 - share, f32::from(k * k)],
        normal: [0.0, 0.6, -0.8],
        color: [k as u8, 255 - k as u8, 7],
        label: k % 3,
        confidence: share,
        defect: k % 2,
        defect_confidence: 1.0 - share,
        sigma: share / 2.0,
        defect_sigma: share / 4.0,
        instance: 60_000 + k,
        views: 300 + k,
        flags: PointFlags(PointFlags::EDGE * (k % 2)),
    }
}

/// The numbers of each column by the name that files have for it, decoded from the row that is written.
fn columns(cloud: &SemanticCloud) -> Map<String, Value> {
    let mut all = Map::new();
    for column in POINT_COLUMNS {
        for (k, name) in column.number_names.iter().enumerate() {
            let number = |point: SemanticPoint| {
                let mut row = Vec::new();
                (column.append)(&point, &mut row);
                match column.number_type {
                    NumberType::U8 => f64::from(row[k]),
                    NumberType::U16 => f64::from(u16::from_le_bytes([row[2 * k], row[2 * k + 1]])),
                    NumberType::F32 => f64::from(f32::from_le_bytes(row[4 * k..4 * k + 4].try_into().expect("four"))),
                }
            };
            all.insert((*name).to_owned(), cloud.iter().map(number).collect());
        }
    }
    all
}

#[test]
fn open3d_reads_every_column() {
    let Some(python) = std::env::var_os(PYTHON).filter(|p| !p.is_empty()) else {
        eprintln!("SKIPPED: {PYTHON} is not set: our PLY files are not read by Open3D");
        return;
    };
    let cloud: SemanticCloud = (0..16).map(point).collect();
    let mesh = SemanticMesh {
        vertices: cloud.clone(),
        boundary: vec![false; 16],
        triangles: (0..14).map(|v| [v, v + 1, v + 2]).collect(),
    };
    let folder = tempfile::tempdir().expect("a folder");
    let create = |name: &str| std::fs::File::create(folder.path().join(name)).expect("made");
    write_cloud(create("cloud.ply"), &cloud, &taxonomy(), &[]).expect("written");
    write_semantic_mesh(create("mesh.ply"), &mesh, &taxonomy(), &[]).expect("written");
    let expected = json!([
        { "file": "cloud.ply", "columns": columns(&cloud), "triangles": 0 },
        { "file": "mesh.ply", "columns": columns(&cloud), "triangles": mesh.triangles.len() },
    ]);
    let list = serde_json::to_vec(&expected).expect("JSON");
    std::fs::write(folder.path().join("expected.json"), list).expect("written");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/exports/by_open3d.py");
    let output = Command::new(python).arg(script).arg(folder.path()).output().expect("runs");
    let said = String::from_utf8_lossy(&output.stdout);
    if output.status.code() == Some(NO_OPEN3D) {
        eprintln!("SKIPPED: {}", said.trim());
        return;
    }
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    eprintln!("{said}");
}
