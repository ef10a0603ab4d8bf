//! What every client must be sent, in which order.

use super::*;
use semascan_model::{PointFlags, SemanticPoint};
use semascan_protocol::chunk::{VoxelChunk, encode};
use semascan_protocol::{ChunkId, HeldChunk};

fn published(id: [i32; 3], revision: u32) -> Published {
    let voxel = 0.001_f32;
    let position = id.map(|c| (c * 32) as f32 * voxel + 0.5 * voxel);
    let point = SemanticPoint {
        position,
        normal: [0.0, 0.0, 1.0],
        color: [revision as u8; 3],
        label: 1,
        confidence: 1.0,
        defect: 0,
        defect_confidence: 1.0,
        sigma: 0.0,
        defect_sigma: 0.0,
        instance: 0,
        views: 1,
        flags: PointFlags(0),
    };
    let chunk = VoxelChunk { id, voxel, voxels: vec![([0; 3], point)] };
    Published { id, encoded: Some(encode(&chunk, 1, revision).expect("encodes")) }
}

fn hello(inspection_id: &str, epoch: u32, held: &[HeldChunk]) -> Hello {
    Hello { inspection_id: inspection_id.into(), epoch, held: held.to_vec(), ..Hello::default() }
}

fn running() -> LiveModel {
    let live = LiveModel::new();
    live.begin(Inspection { id: "a".into(), epoch: 1, ..Inspection::default() });
    live
}

/// Everything a client would be sent now, as (chunk, revision), and the phases it was sent.
fn drain(live: &LiveModel, cursor: &mut Cursor) -> (Vec<([i32; 3], u32)>, Vec<wire::Phase>) {
    let (mut chunks, mut phases) = (Vec::new(), Vec::new());
    while let Some(bytes) = live.next(cursor) {
        match wire::decode_server(&bytes).expect("valid").body {
            Some(Body::Chunk(c)) => chunks.push((c.id.expect("id").to_array(), c.revision)),
            Some(Body::Gone(c)) => chunks.push((c.id.expect("id").to_array(), c.revision)),
            Some(Body::Progress(p)) => phases.push(p.phase()),
            _ => {}
        }
    }
    (chunks, phases)
}

#[test]
fn a_slow_client_gets_the_newest_revision_only() {
    let live = running();
    let (mut cursor, _) = live.welcome(&hello("", 0, &[]));
    live.publish(vec![published([0; 3], 1), published([1, 0, 0], 1)]);
    live.publish(vec![published([0; 3], 2)]);
    assert_eq!(drain(&live, &mut cursor).0, [([1, 0, 0], 1), ([0; 3], 2)]);
    assert_eq!(drain(&live, &mut cursor).0, []);
    assert_eq!(live.metrics().superseded_so_far(), 1, "the first revision of one chunk");
    // What was replaced before a client came was not meant for it.
    let (mut late, _) = live.welcome(&hello("", 0, &[]));
    assert_eq!(drain(&live, &mut late).0.len(), 2);
    assert_eq!(live.metrics().superseded_so_far(), 1);
}

#[test]
fn a_returning_client_gets_the_difference() {
    let live = running();
    live.publish(vec![published([0; 3], 1), published([1, 0, 0], 1), published([2, 0, 0], 1)]);
    live.publish(vec![published([2, 0, 0], 2)]);
    let held = |x, revision| HeldChunk { id: Some(ChunkId { x, y: 0, z: 0 }), revision };
    let (mut cursor, _) = live.welcome(&hello("a", 1, &[held(0, 1), held(2, 1)]));
    assert_eq!(drain(&live, &mut cursor).0, [([1, 0, 0], 1), ([2, 0, 0], 2)]);
    let (mut stranger, _) = live.welcome(&hello("b", 1, &[held(0, 1)]));
    assert_eq!(drain(&live, &mut stranger).0.len(), 3);
}

#[test]
fn an_emptied_chunk_leaves_a_tombstone_and_no_hash() {
    let live = running();
    let empty = live.hash();
    live.publish(vec![published([0; 3], 1)]);
    assert_ne!(live.hash(), empty);
    live.publish(vec![Published { id: [0; 3], encoded: None }]);
    let (mut cursor, _) = live.welcome(&hello("", 0, &[]));
    assert_eq!(drain(&live, &mut cursor).0, [([0; 3], 2)]);
    assert_eq!(live.hash(), empty);
}

#[test]
fn the_end_is_told_after_the_last_chunk_and_a_new_inspection_clears() {
    let live = running();
    let (mut cursor, _) = live.welcome(&hello("", 0, &[]));
    live.publish(vec![published([0; 3], 1)]);
    live.update_progress(|p| p.phase = wire::Phase::Finished.into());
    let mut last_was_chunk = false;
    while let Some(bytes) = live.next(&mut cursor) {
        match wire::decode_server(&bytes).expect("valid").body {
            Some(Body::Progress(_)) => assert!(last_was_chunk),
            other => last_was_chunk = matches!(other, Some(Body::Chunk(_))),
        }
    }
    live.begin(Inspection { id: "b".into(), epoch: 1, ..Inspection::default() });
    let first = live.next(&mut cursor).expect("clear");
    assert!(matches!(wire::decode_server(&first).expect("valid").body, Some(Body::Clear(_))));
}

/// Everything a client would be sent now: its order as letters, with what Progress says of the whole model.
fn story(live: &LiveModel, cursor: &mut Cursor) -> Vec<String> {
    let mut sent = Vec::new();
    while let Some(bytes) = live.next(cursor) {
        sent.push(match wire::decode_server(&bytes).expect("valid").body {
            Some(Body::Clear(c)) => format!("clear {} successor {}", c.inspection.expect("one").epoch, c.successor),
            Some(Body::Chunk(c)) => format!("chunk {}", c.id.expect("id").x),
            Some(Body::Progress(p)) => format!("complete {}", p.complete_epoch),
            _ => continue,
        });
    }
    sent
}

#[test]
fn a_rebuilt_model_is_announced_sent_and_then_called_whole() {
    let live = running();
    live.publish(vec![published([0; 3], 1), published([1, 0, 0], 1)]);
    let (mut follower, _) = live.welcome(&hello("", 0, &[]));
    assert_eq!(story(&live, &mut follower), ["complete 0", "chunk 0", "chunk 1"]);
    live.renew(2, vec![published([1, 0, 0], 1), published([2, 0, 0], 1)]);
    let rebuilt = ["clear 2 successor true", "complete 0", "chunk 1", "chunk 2", "complete 2"];
    assert_eq!(story(&live, &mut follower), rebuilt);
    // One that comes later gets the new model alone; one that held the old one cannot resume it.
    let (mut stranger, welcome) = live.welcome(&hello("a", 1, &[]));
    let Some(Body::Welcome(welcome)) = wire::decode_server(&welcome).expect("valid").body else {
        panic!("a Welcome was due")
    };
    assert!(!welcome.resumed);
    assert_eq!(story(&live, &mut stranger), rebuilt[1..]);
    // A chunk that changes before a slow client got it does not keep the model from being called whole.
    let (mut slow, _) = live.welcome(&hello("", 0, &[]));
    live.publish(vec![published([2, 0, 0], 2)]);
    assert_eq!(story(&live, &mut slow), ["complete 0", "chunk 1", "complete 2", "chunk 2"]);
}

#[test]
fn another_inspection_is_no_successor_and_an_empty_rebuild_is_whole() {
    let live = running();
    live.publish(vec![published([0; 3], 1)]);
    let (mut cursor, _) = live.welcome(&hello("", 0, &[]));
    story(&live, &mut cursor);
    live.renew(2, Vec::new());
    assert_eq!(story(&live, &mut cursor), ["clear 2 successor true", "complete 2"]);
    live.begin(Inspection { id: "b".into(), epoch: 1, ..Inspection::default() });
    assert_eq!(story(&live, &mut cursor), ["clear 1 successor false", "complete 0"]);
}

/// Numbers of the views whose reports a client is sent now; the pages that it is told of.
fn views(live: &LiveModel, cursor: &mut Cursor) -> (Vec<u32>, Vec<wire::ViewPage>) {
    let (mut numbers, mut pages) = (Vec::new(), Vec::new());
    while let Some(bytes) = live.next(cursor) {
        match wire::decode_server(&bytes).expect("valid").body {
            Some(Body::View(report)) => numbers.push(report.index),
            Some(Body::Page(page)) => pages.push(page),
            _ => {}
        }
    }
    (numbers, pages)
}

fn report(index: u32) -> ViewReport {
    ViewReport { index, ..ViewReport::default() }
}

#[test]
fn reports_and_stages_are_sent_once_and_not_again_with_a_new_epoch() {
    let live = running();
    let (mut cursor, _) = live.welcome(&hello("", 0, &[]));
    live.stage(StageEvent { view: 2, ..StageEvent::default() });
    (0..2).for_each(|index| live.view(report(index)));
    assert_eq!(views(&live, &mut cursor).0, [0, 1]);
    live.renew(2, vec![published([0; 3], 1)]);
    live.view(report(2));
    let mut stages = 0;
    let mut numbers = Vec::new();
    while let Some(bytes) = live.next(&mut cursor) {
        match wire::decode_server(&bytes).expect("valid").body {
            Some(Body::Stage(_)) => stages += 1,
            Some(Body::View(report)) => numbers.push(report.index),
            _ => {}
        }
    }
    assert_eq!((stages, numbers), (0, vec![2]));
    // Another inspection starts over.
    live.begin(Inspection { id: "b".into(), epoch: 1, ..Inspection::default() });
    live.view(report(0));
    assert_eq!(views(&live, &mut cursor).0, [0]);
}

#[test]
fn a_late_client_gets_the_latest_reports_and_learns_of_the_others() {
    let live = running();
    let (mut follower, _) = live.welcome(&hello("", 0, &[]));
    let mut followed = Vec::new();
    for index in 0..3000 {
        live.view(report(index));
        followed.extend(views(&live, &mut follower).0);
    }
    assert_eq!(followed, (0..3000).collect::<Vec<_>>());
    let (mut late, _) = live.welcome(&hello("", 0, &[]));
    let (numbers, pages) = views(&live, &mut late);
    assert_eq!(numbers, (2936..3000).collect::<Vec<_>>());
    assert_eq!(pages, [wire::ViewPage { count: 64, kept: 3000, forgotten: 0, first: 2936, earlier: true }]);
    live.view(report(3000));
    assert_eq!(views(&live, &mut late), (vec![3000], vec![]));
}

#[test]
fn of_a_hello_only_what_is_still_the_newest_is_kept() {
    let live = running();
    live.publish(vec![published([0; 3], 1), published([1, 0, 0], 1)]);
    let held = |x| HeldChunk { id: Some(ChunkId { x, y: 0, z: 0 }), revision: 1 };
    let listed: Vec<HeldChunk> = (0..10_000).map(held).collect();
    let (cursor, _) = live.welcome(&hello("a", 1, &listed));
    assert_eq!(cursor.held.len(), 2);
}

#[test]
fn a_stage_that_failed_is_told_to_those_who_come_later_and_the_log_is_bounded() {
    let live = running();
    for view in 0..2000 {
        let state = if view == 1999 { wire::StageState::Failed } else { wire::StageState::Finished };
        live.stage(StageEvent { view, state: state.into(), ..StageEvent::default() });
        live.view(report(view));
    }
    (2000..4000).for_each(|view| live.stage(StageEvent { view, ..StageEvent::default() }));
    let told = |live: &LiveModel| {
        let (mut cursor, _) = live.welcome(&hello("", 0, &[]));
        let mut told = Vec::new();
        while let Some(bytes) = live.next(&mut cursor) {
            if let Some(Body::Stage(event)) = wire::decode_server(&bytes).expect("valid").body {
                told.push(event.view);
            }
        }
        told
    };
    assert_eq!(told(&live), (3488..4000).collect::<Vec<_>>());
    let live = running();
    live.stage(StageEvent { view: 0, state: wire::StageState::Failed.into(), ..StageEvent::default() });
    live.stage(StageEvent { view: 1, ..StageEvent::default() });
    live.view(report(0));
    live.view(report(1));
    assert_eq!(told(&live), [0]);
}

#[test]
fn reviews_go_to_those_who_take_them_from_their_coming_on_and_outlive_the_model() {
    let live = running();
    let change = |sequence| ReviewChange { sequence, inspection: "elsewhere".into(), ..ReviewChange::default() };
    live.review(change(1));
    let takes = Hello { capabilities: vec!["x".into(), TAKES_REVIEWS.into()], ..Hello::default() };
    let (mut cursor, _) = live.welcome(&takes);
    // A viewer of an earlier version would not know what to do with them.
    let (mut earlier, _) = live.welcome(&hello("", 0, &[]));
    let seen = |cursor: &mut Cursor| {
        let mut seen = Vec::new();
        while let Some(bytes) = live.next(cursor) {
            if let Some(Body::Review(change)) = wire::decode_server(&bytes).expect("valid").body {
                seen.push(change.sequence);
            }
        }
        seen
    };
    assert!(seen(&mut cursor).is_empty(), "what was decided before it came is read through REST");
    live.review(change(2));
    live.begin(Inspection { id: "b".into(), epoch: 1, ..Inspection::default() });
    live.review(change(3));
    live.renew(2, vec![published([0; 3], 1)]);
    assert_eq!(seen(&mut cursor), [2, 3]);
    live.review(change(4));
    assert_eq!(seen(&mut cursor), [4]);
    assert!(seen(&mut earlier).is_empty());
}

#[test]
fn pointers_go_to_those_who_take_them_and_are_of_the_inspection_that_is_shown() {
    let live = running();
    let pointer = |viewer: &str| Pointer { viewer: viewer.into(), ..Pointer::default() };
    let takes = Hello { capabilities: vec![TAKES_POINTERS.into()], ..Hello::default() };
    let shown = live.lock().inspection.id.clone();
    assert_eq!(live.point(&shown, &pointer("a")), 0, "nobody follows");
    let (mut cursor, _) = live.welcome(&takes);
    let (mut earlier, _) = live.welcome(&hello("", 0, &[]));
    let attends = (live.attend(&cursor), live.attend(&earlier));
    assert!(attends.0.is_some() && attends.1.is_none());
    let seen = |cursor: &mut Cursor| {
        let mut seen = Vec::new();
        while let Some(bytes) = live.next(cursor) {
            if let Some(Body::Pointer(pointer)) = wire::decode_server(&bytes).expect("valid").body {
                seen.push(pointer.viewer);
            }
        }
        seen
    };
    assert!(seen(&mut cursor).is_empty(), "what was before it came is over");
    assert_eq!((live.point(&shown, &pointer("a")), live.point("elsewhere", &pointer("b"))), (1, 0));
    assert_eq!(seen(&mut cursor), ["a"]);
    assert!(seen(&mut cursor).is_empty() && seen(&mut earlier).is_empty());
    // A new epoch does not lose them, another inspection does.
    live.renew(2, vec![published([0; 3], 1)]);
    live.point(&shown, &pointer("c"));
    seen(&mut cursor);
    live.point(&shown, &pointer("d"));
    assert_eq!(seen(&mut cursor), ["d"]);
    live.point(&shown, &pointer("e"));
    live.begin(Inspection { id: "b".into(), epoch: 1, ..Inspection::default() });
    assert!(seen(&mut cursor).is_empty());
    drop(attends);
    assert_eq!(live.point("b", &pointer("a")), 0);
}
