//! The bytes of every message, one by one: whoever changes a field number or a type sees it here.

use semascan_model::{PointFlags, SemanticPoint, Taxonomy};
use semascan_protocol::chunk::{VoxelChunk, encode};
use semascan_protocol::*;
use std::fmt::Write;

/// Sixteen bytes a line, with their characters.
fn dump(bytes: &[u8]) -> String {
    let mut text = String::new();
    for (i, line) in bytes.chunks(16).enumerate() {
        let hex: Vec<String> = line.iter().map(|b| format!("{b:02x}")).collect();
        let shown = |b: &u8| {
            if b.is_ascii_graphic() || *b == b' ' { char::from(*b) } else { '.' }
        };
        let characters: String = line.iter().map(shown).collect();
        writeln!(text, "{:04x}  {:<47}  |{characters}|", 16 * i, hex.join(" ")).expect("a String takes everything");
    }
    text
}

fn server(body: server_message::Body) -> String {
    let message = ServerMessage { body: Some(body) };
    let bytes = prost::Message::encode_to_vec(&message);
    assert_eq!(decode_server(&bytes), Ok(message));
    dump(&bytes)
}

fn inspection() -> Inspection {
    let mut inspection = Inspection {
        id: "3f2a".into(),
        epoch: 2,
        part: "starter motor 7".into(),
        source: "virtual:starter-motor?seed=7".into(),
        voxel: 0.0005,
        views_expected: 12,
        turntable: Some(Turntable { radius: 0.15, height: -0.001 }),
        ..Default::default()
    };
    inspection.set_taxonomy(&Taxonomy::from_names(&["housing", "solenoid"], &["corrosion"]));
    inspection
}

#[test]
fn hello() {
    let held = HeldChunk { id: Some(ChunkId { x: -1, y: 0, z: 300 }), revision: 5 };
    let hello = Hello {
        client: "semascan-viewer 0.1.0".into(),
        capabilities: vec!["chunks.1".into()],
        inspection_id: "3f2a".into(),
        epoch: 2,
        held: vec![held],
    };
    let message = ClientMessage { body: Some(client_message::Body::Hello(hello)) };
    let bytes = prost::Message::encode_to_vec(&message);
    assert_eq!(decode_client(&bytes), Ok(message));
    insta::assert_snapshot!(dump(&bytes));
}

#[test]
fn welcome() {
    insta::assert_snapshot!(server(server_message::Body::Welcome(Welcome {
        agent: "semascan 0.1.0".into(),
        capabilities: vec!["chunks.1".into()],
        inspection: Some(inspection()),
        resumed: true,
    })));
}

#[test]
fn refused() {
    let reason = "this agent speaks semascan.v1".into();
    insta::assert_snapshot!(server(server_message::Body::Refused(Refused { reason })));
}

#[test]
fn clear() {
    let clear = Clear { inspection: Some(inspection()), successor: false };
    insta::assert_snapshot!(server(server_message::Body::Clear(clear)));
}

#[test]
fn clear_for_a_successor() {
    let inspection = Some(Inspection { id: "3f2a".into(), epoch: 3, ..Default::default() });
    insta::assert_snapshot!(server(server_message::Body::Clear(Clear { inspection, successor: true })));
}

#[test]
fn progress() {
    insta::assert_snapshot!(server(server_message::Body::Progress(Progress {
        phase: Phase::Finished.into(),
        views_done: 12,
        views_rejected: 1,
        views_expected: 12,
        points: 1_234_567,
        chunks: 890,
        model_hash: 0x0123_4567_89ab_cdef,
        message: String::new(),
        complete_epoch: 0,
        figures: None,
    })));
}

#[test]
fn progress_of_a_complete_epoch() {
    insta::assert_snapshot!(server(server_message::Body::Progress(Progress {
        phase: Phase::Running.into(),
        points: 300,
        complete_epoch: 2,
        ..Default::default()
    })));
}

#[test]
fn figures() {
    let one = |component: u16, id: u16, area| semascan_model::FeatureFigures {
        id,
        component,
        points: 300,
        area,
        confidence: 0.75,
        sigma: 0.125,
    };
    let figures = semascan_model::ModelFigures {
        components: vec![one(2, 2, Some(1e-4))],
        defects: vec![one(0, 1, None)],
        findings: vec![one(2, 1, Some(5e-5))],
        instances: vec![one(2, 7, Some(0.0))],
    };
    let message = Figures::from(&figures);
    assert_eq!(message.figures(), figures);
    let beyond = FeatureFigures { id: 70_000, ..FeatureFigures::default() };
    assert!(Figures { defects: vec![beyond], ..Figures::default() }.figures().defects.is_empty());
    insta::assert_snapshot!(server(server_message::Body::Progress(Progress {
        figures: Some(message),
        ..Default::default()
    })));
}

#[test]
fn stage_event() {
    insta::assert_snapshot!(server(server_message::Body::Stage(StageEvent {
        view: 3,
        stage: Stage::Register.into(),
        state: StageState::Failed.into(),
        duration_us: 41_000,
        message: "no overlap with the model".into(),
    })));
}

#[test]
fn view_report() {
    insta::assert_snapshot!(server(server_message::Body::View(ViewReport {
        index: 3,
        accepted: true,
        reason: String::new(),
        table_from_camera: Some(Pose { qx: 0.0, qy: 0.6, qz: 0.0, qw: 0.8, tx: 0.1, ty: -0.2, tz: 0.5 }),
        intrinsics: Some(Intrinsics { width: 640, height: 480, fx: 615.0, fy: 615.5, cx: 319.5, cy: 239.5 }),
        thumbnail_jpeg: vec![0xff, 0xd8, 0xff, 0xd9],
        overlay_png: vec![0x89, b'P', b'N', b'G'],
        timings: vec![StageTiming { stage: Stage::Fuse.into(), duration_us: 12_345 }],
        points_added: 4096,
        sigma_png: vec![0x89, b'P'],
        contribution_png: vec![0x89, b'N'],
        domain: Domain::Inside.into(),
        pictures_dropped: false,
        sharpness: Some(0.5),
    })));
}

#[test]
fn view_request_and_page() {
    let message = ClientMessage { body: Some(client_message::Body::Views(ViewRequest { before: 400, count: 32 })) };
    let bytes = prost::Message::encode_to_vec(&message);
    assert_eq!(decode_client(&bytes), Ok(message));
    insta::assert_snapshot!("view_request", dump(&bytes));
    let page = ViewPage { count: 32, kept: 2000, forgotten: 7, first: 368, earlier: true };
    insta::assert_snapshot!("view_page", server(server_message::Body::Page(page)));
}

#[test]
fn view_report_out_of_domain() {
    let report = ViewReport { index: 3, accepted: true, domain: Domain::Outside.into(), ..Default::default() };
    insta::assert_snapshot!(server(server_message::Body::View(report)));
}

#[test]
fn chunk_update() {
    let point = |x: u8, label: u16| SemanticPoint {
        position: [f32::from(x) * 0.002 + 0.001, 0.0611, -0.0631],
        normal: [0.0, 0.0, 1.0],
        color: [120 + x, 110, 100],
        label,
        confidence: 0.9,
        defect: 0,
        defect_confidence: 1.0,
        sigma: 0.1,
        defect_sigma: 0.0,
        instance: 0,
        views: 4,
        flags: PointFlags::default(),
    };
    let voxels = (0..6).map(|x| ([x, 30, 0], point(x, 1 + u16::from(x > 3)))).collect();
    let encoded = encode(&VoxelChunk { id: [0, 0, -1], voxel: 0.002, voxels }, 2, 7).expect("a valid chunk");
    insta::assert_snapshot!("chunk_update_hash", format!("{:016x}", encoded.hash));
    insta::assert_snapshot!(server(server_message::Body::Chunk(encoded.update)));
}

#[test]
fn chunk_gone() {
    let id = Some(ChunkId { x: 1, y: -2, z: 3 });
    insta::assert_snapshot!(server(server_message::Body::Gone(ChunkGone { epoch: 2, id, revision: 8 })));
}

#[test]
fn pointer() {
    let pointer = Pointer { viewer: "v-1".into(), person: "A. Reviewer".into(), x: 0.01, y: -0.02, z: 0.5 };
    insta::assert_snapshot!(server(server_message::Body::Pointer(pointer)));
}

#[test]
fn review_change() {
    let change = ReviewChange {
        inspection: "3f2a".into(),
        sequence: 300,
        review: "r-2".into(),
        subject: Some(ReviewSubject { kind: Some(review_subject::Kind::Component("gear".into())) }),
        action: "rework".into(),
        person: "A. Reviewer".into(),
        at: "2026-11-28T12:00:00Z".into(),
        reason: "can be ground".into(),
        conflicts_with: vec!["r-1".into()],
        decision: "person".into(),
        conflicts: 1,
    };
    insta::assert_snapshot!(server(server_message::Body::Review(change.clone())));
    for kind in [review_subject::Kind::Part(true), review_subject::Kind::Finding("f-1".into())] {
        server(server_message::Body::Review(ReviewChange {
            subject: Some(ReviewSubject { kind: Some(kind) }),
            ..change.clone()
        }));
    }
}
