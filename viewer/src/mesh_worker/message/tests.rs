//! Messages between page and worker come back; broken ones are refused.

use super::*;
use proptest::prelude::*;
use semascan_model::{PointFlags, SemanticPoint};

fn mesh(n: usize) -> SemanticMesh {
    let point = |i: usize| SemanticPoint {
        position: [i as f32, -1.5, 0.25],
        normal: [0.0, 0.0, 1.0],
        color: [i as u8, 2, 3],
        label: i as u16,
        confidence: 0.5,
        defect: 1,
        defect_confidence: 0.25,
        sigma: 0.125,
        defect_sigma: 0.75,
        instance: 9,
        views: 4,
        flags: PointFlags(PointFlags::UNLABELLED),
    };
    let last = n.saturating_sub(1) as u32;
    SemanticMesh {
        vertices: (0..n).map(point).collect(),
        boundary: (0..n).map(|i| i % 2 == 0).collect(),
        triangles: if n > 2 { vec![[0, 1, last], [1, 2, last]] } else { Vec::new() },
    }
}

fn opened() -> OpenedModel {
    let taxonomy = Taxonomy::from_names(&["gear"], &["wear"]);
    OpenedModel { name: "ß.glb".into(), taxonomy, voxel: 1e-3, remarks: vec!["one".into()], mesh: mesh(7) }
}

#[test]
fn replies_cross_unchanged() {
    let figures = DeviationFigures { mean: 0.1, rms: 0.2, p95: 0.3, range: [-0.4, 0.5], mismatch: None };
    let off = |mismatch| Reply::Deviation {
        of_vertices: vec![0.5],
        figures: DeviationFigures { mismatch: Some(mismatch), ..figures },
    };
    let replies = [
        Reply::Progress { done: 3, total: 9 },
        Reply::Mesh(Arc::new(mesh(7))),
        Reply::Mesh(Arc::default()),
        Reply::Cancelled,
        Reply::Failed("no".into()),
        Reply::Reference(ReferenceInfo {
            name: "ß.stl".into(),
            triangles: 4,
            points: 5,
            unit: LengthUnit::Inches,
            is_guess: true,
            warnings: vec!["one".into(), String::new(), "zwei\n".into()],
        }),
        off(Mismatch::Unit { ratio: 25.5, fits: LengthUnit::Centimetres }),
        off(Mismatch::Size { ratio: 0.25 }),
        off(Mismatch::Place { distance: 2.5 }),
        off(Mismatch::Surface { median: 0.5 }),
        Reply::NoReference("why".into()),
        Reply::NotOpened("why".into()),
        Reply::Opened(Box::new(opened())),
        Reply::Deviation { of_vertices: vec![0.5, -1.0], figures },
    ];
    for reply in replies {
        assert_eq!(Reply::decode(&reply.encode()), Ok(reply));
    }
}

#[test]
fn requests_cross_unchanged() {
    let requests = [
        Request::Clear,
        Request::Chunk { id: [1, -2, 3], voxel: 0.001, cloud: mesh(3).vertices.into() },
        Request::Gone([-1, 0, 9]),
        Request::Mesh,
        Request::Cancel,
        Request::Reference { name: "a.stl".into(), unit: None, bytes: [1, 2, 3].into() },
        Request::Reference { name: String::new(), unit: Some(LengthUnit::Metres), bytes: [].into() },
        Request::Forget,
        Request::Open { name: "ß.ply".into(), bytes: [1, 2, 3].into(), beside: Vec::new() },
        Request::Open {
            name: "a.obj".into(),
            bytes: [1, 2, 3].into(),
            beside: vec![("ß.mtl".into(), [4].into()), (String::new(), [].into())],
        },
    ];
    for request in requests {
        assert_eq!(Request::decode(&request.encode()), Ok(request));
    }
}

proptest! {
    #[test]
    fn arbitrary_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
        let _ = Request::decode(&bytes);
        let _ = Reply::decode(&bytes);
    }
}
