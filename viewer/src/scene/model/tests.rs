//! The model follows the stream's events, in any order that a link may give them.

use super::*;
use crate::display::HiddenFlags;
use semascan_model::SemanticPoint;

const VOXEL: f32 = 0.002;

fn point(x: f32, label: u16, flags: u16) -> SemanticPoint {
    SemanticPoint {
        position: [x, 0.0, 0.0],
        normal: [0.0, 0.0, 1.0],
        color: [0; 3],
        label,
        confidence: 0.5,
        defect: 0,
        defect_confidence: 0.0,
        sigma: 0.0,
        defect_sigma: 0.0,
        instance: 0,
        views: 3,
        flags: PointFlags(flags),
    }
}

fn chunk(x: i32, revision: u32, points: &[SemanticPoint]) -> LinkEvent {
    LinkEvent::Chunk(DecodedChunk {
        id: [x, 0, 0],
        revision,
        epoch: 0,
        voxel: VOXEL,
        hash: u64::from(revision) * 31 + x as u64,
        cloud: points.iter().copied().collect(),
    })
}

fn progress(progress: Progress) -> LinkEvent {
    LinkEvent::Message(Body::Progress(progress))
}

#[test]
fn a_chunk_replaces_its_earlier_revision_in_every_figure() {
    let mut model = HeldModel::new();
    assert_eq!(model.apply(&chunk(0, 1, &[point(1.0, 1, 0); 10])), ModelChange::Replaced([0; 3]));
    model.apply(&chunk(1, 1, &[point(2.0, 2, 0)]));
    model.apply(&chunk(0, 2, &[point(0.5, 1, 0), point(0.5, 2, 0)]));
    assert_eq!((model.point_count(), model.chunk_count()), (3, 2));
    let stats = model.class_stats(PointFlags::LEFT_OUT);
    assert_eq!((stats[&1].points, stats[&2].points), (1, 2));
    assert!((stats[&2].mean_confidence() - 0.5).abs() < 1e-9);
    assert_eq!(model.bounds().map(|b| b.max.x), Some(2.0));
    assert_eq!((model.most_views(), model.voxel()), (3, VOXEL));
    assert_eq!(model.to_cloud().len(), 3);
}

#[test]
fn a_new_epoch_replaces_the_old_model_only_when_it_is_whole() {
    let inspection = |id: &str, epoch| Inspection { id: id.into(), epoch, ..Inspection::default() };
    let mut model = HeldModel::new();
    assert_eq!(model.apply(&LinkEvent::Cleared(inspection("a", 1))), ModelChange::Cleared);
    model.apply(&chunk(0, 1, &[point(1.0, 1, 0)]));
    model.apply(&chunk(1, 1, &[point(2.0, 1, 0)]));
    assert_eq!(model.apply(&LinkEvent::Cleared(inspection("a", 2))), ModelChange::None);
    assert_eq!(model.apply(&chunk(0, 2, &[point(1.5, 1, 0)])), ModelChange::None);
    model.apply(&chunk(7, 2, &[point(7.5, 1, 0)]));
    model.apply(&LinkEvent::ChunkGone { id: [7, 0, 0] });
    assert_eq!((model.chunk_count(), model.bounds().map(|b| b.max.x)), (2, Some(2.0)), "the old one is still shown");
    let word =
        |complete_epoch| progress(Progress { complete_epoch, phase: Phase::Running.into(), ..Progress::default() });
    assert_eq!(model.apply(&word(1)), ModelChange::None);
    model.apply(&chunk(3, 2, &[point(3.5, 1, 0)]));
    assert_eq!(model.apply(&word(2)), ModelChange::Exchanged);
    assert_eq!((model.chunk_count(), model.bounds().map(|b| b.max.x)), (2, Some(3.5)));
    assert_eq!(model.apply(&word(2)), ModelChange::None);
    // At the end in any case.
    model.apply(&LinkEvent::Cleared(inspection("a", 4)));
    model.apply(&chunk(0, 3, &[point(1.0, 1, 0)]));
    let end = Progress { phase: Phase::Finished.into(), ..Progress::default() };
    assert_eq!(model.apply(&progress(end)), ModelChange::Exchanged);
    assert_eq!(model.chunk_count(), 1);
    // Another inspection is another model.
    model.apply(&chunk(0, 4, &[point(1.0, 1, 0)]));
    assert_eq!(model.apply(&LinkEvent::Cleared(inspection("b", 1))), ModelChange::Cleared);
}

#[test]
fn figures_count_what_the_picture_shows() {
    let mut model = HeldModel::new();
    let marked = [
        point(1.0, 1, 0),
        point(2.0, 1, PointFlags::RADIUS_OUTLIER),
        point(3.0, 1, PointFlags::BACKGROUND),
        point(4.0, 1, PointFlags::UNLABELLED),
    ];
    model.apply(&chunk(0, 1, &marked));
    let points = |outliers, background| model.class_stats(HiddenFlags { outliers, background }.bits())[&1].points;
    assert_eq!(points(false, false), 4);
    assert_eq!(points(true, false), 3);
    assert_eq!(points(true, true), 2);
}

#[test]
fn the_hash_depends_on_content_and_not_on_the_way_there() {
    let (mut straight, mut winding) = (HeldModel::new(), HeldModel::new());
    straight.apply(&chunk(0, 2, &[point(1.0, 1, 0)]));
    straight.apply(&chunk(1, 1, &[point(2.0, 1, 0)]));
    winding.apply(&chunk(5, 1, &[point(9.0, 1, 0)]));
    winding.apply(&chunk(1, 1, &[point(2.0, 1, 0)]));
    winding.apply(&chunk(0, 1, &[point(7.0, 1, 0)]));
    assert_ne!(winding.hash(), straight.hash());
    winding.apply(&chunk(0, 2, &[point(1.0, 1, 0)]));
    assert_eq!(winding.apply(&LinkEvent::ChunkGone { id: [5, 0, 0] }), ModelChange::Removed([5, 0, 0]));
    assert_eq!(winding.apply(&LinkEvent::ChunkGone { id: [5, 0, 0] }), ModelChange::None);
    assert_eq!(winding.hash(), straight.hash());
}

#[test]
fn only_a_connection_that_resumes_keeps_the_model() {
    let connected = |resumed| LinkEvent::Connected { inspection: Inspection::default(), resumed, agent: String::new() };
    let mut model = HeldModel::new();
    model.apply(&chunk(0, 1, &[point(1.0, 1, 0)]));
    assert_eq!(model.apply(&connected(true)), ModelChange::None);
    assert_eq!(model.point_count(), 1);
    assert_eq!(model.apply(&connected(false)), ModelChange::Cleared);
    assert_eq!(model.point_count(), 0);
    model.apply(&chunk(0, 1, &[point(1.0, 1, 0)]));
    assert_eq!(model.apply(&LinkEvent::Cleared(Inspection::default())), ModelChange::Cleared);
    assert!(model.bounds().is_none());
}

#[test]
fn outliers_background_and_what_lies_apart_are_not_looked_at() {
    let mut model = HeldModel::new();
    assert_eq!(model.focus(), None);
    let focus = |model: &HeldModel| model.focus().map(|b| (b.min.x, b.max.x));
    model.apply(&chunk(0, 1, &[point(50.0, 1, PointFlags::BACKGROUND)]));
    assert_eq!(focus(&model), Some((50.0, 50.0)), "where there is nothing else");
    model.apply(&chunk(1, 1, &[point(1.0, 1, 0), point(9.0, 1, PointFlags::RADIUS_OUTLIER)]));
    assert_eq!(focus(&model), Some((1.0, 1.0)));
    // Far more points without a component around the part.
    model.apply(&chunk(3, 1, &[point(7.0, 0, 0); 5]));
    assert_eq!(focus(&model), Some((1.0, 1.0)));
    model.apply(&chunk(4, 1, &[point(8.0, 0, 0); 900]));
    assert_eq!(focus(&model), Some((7.0, 8.0)), "next to nothing has a component: one stray point is none of it");
    model.apply(&LinkEvent::ChunkGone { id: [4, 0, 0] });
    assert_eq!(focus(&model), Some((1.0, 1.0)));
    // The end of a part has few points too, and is next to the rest; a speck in the air is not.
    model.apply(&chunk(2, 1, &[point(2.0, 1, 0); 1000]));
    model.apply(&chunk(100, 1, &[point(100.0, 1, 0)]));
    assert_eq!(focus(&model), Some((1.0, 2.0)));
    assert_eq!(model.bounds().map(|b| b.max.x), Some(100.0));
}

#[test]
fn scales_of_shares_follow_the_points_that_are_held() {
    let of = |share: f32, sigma: f32, label: u16| SemanticPoint { confidence: share, sigma, ..point(1.0, label, 0) };
    let mut model = HeldModel::new();
    model.apply(&chunk(0, 1, &[of(0.9, 0.0, 1), of(0.8, 0.0, 1), of(0.1, 0.9, 0)]));
    let scales = model.share_scales();
    let confidence = scales.confidence.expect("there are labels");
    assert!(confidence.low > 0.7 && confidence.high <= 0.95, "{confidence:?}: what has no component has no confidence");
    assert_eq!(scales.sigma, None, "nobody estimated one");
    model.apply(&chunk(1, 1, &[of(0.9, 0.02, 1), of(0.8, 0.06, 1)]));
    assert!(model.share_scales().sigma.expect("some").high <= 0.1);
    model.apply(&chunk(1, 2, &[of(0.9, 0.0, 1)]));
    assert_eq!(model.share_scales().sigma, None, "of chunks that were replaced nothing is left");
    model.apply(&LinkEvent::ChunkGone { id: [0; 3] });
    model.apply(&LinkEvent::ChunkGone { id: [1, 0, 0] });
    assert_eq!(model.share_scales(), ShareScales::default());
}
