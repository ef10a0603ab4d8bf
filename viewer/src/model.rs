//! The model as the viewer holds it: chunk by chunk, kept level with the agent by [`LinkEvent`]s.
//!
//! Figures (points, areas, bounds) are kept per chunk and summed on demand in chunk order, so replacing a chunk costs
//! only that chunk, nothing drifts, and the sums do not depend on the order of arrival.

use crate::link::{DecodedChunk, LinkEvent};
use crate::render::HiddenFlags;
use crate::tools::Bounds;
use semascan_shared::measure::surfel_area;
use semascan_shared::model::{PointFlags, SemanticCloud};
use semascan_shared::wire::chunk::model_hash;
use semascan_shared::wire::{Inspection, Phase, Progress};
use std::collections::BTreeMap;

/// The marks that can hide a point.
const HIDING: u16 = PointFlags::LEFT_OUT;

/// What an event did to the model; tells a renderer what to redraw.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModelChange {
    /// Nothing.
    None,
    /// Every chunk was dropped.
    Cleared,
    /// Every chunk was dropped and others are in their place.
    Exchanged,
    /// This chunk is new or has new content.
    Replaced([i32; 3]),
    /// This chunk is gone.
    Removed([i32; 3]),
}

/// Points, area and confidence of one component class.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ClassStats {
    /// Points that carry the class.
    pub points: usize,
    /// Surface area in square metres, by [`surfel_area`].
    pub area: f64,
    /// Sum of the points' confidences; see [`ClassStats::mean_confidence`].
    pub confidence_sum: f64,
}

impl ClassStats {
    /// Mean confidence of the points, 0..=1; 0 without points.
    pub fn mean_confidence(&self) -> f64 {
        if self.points == 0 { 0.0 } else { self.confidence_sum / self.points as f64 }
    }

    fn add(&mut self, other: &Self) {
        self.points += other.points;
        self.area += other.area;
        self.confidence_sum += other.confidence_sum;
    }
}

/// One chunk as held.
#[derive(Clone, Debug)]
pub struct ModelChunk {
    /// Revision of the content.
    pub revision: u32,
    /// Hash of the content as the agent counts it.
    pub hash: u64,
    /// The points, table frame.
    pub cloud: SemanticCloud,
    /// By class and by the marks that can hide a point, so that the figures of any choice of marks are a sum.
    stats: BTreeMap<(u16, u16), ClassStats>,
    bounds: Bounds,
    foreground: Bounds,
    most_views: u16,
}

/// The model held by this viewer.
///
/// When the agent makes the map of an inspection anew (a new epoch), the model of the epoch before stays until the chunks
/// of the new one have arrived, and then is exchanged for it at once: the picture never goes empty in between.
#[derive(Clone, Debug, Default)]
pub struct LiveModel {
    chunks: BTreeMap<[i32; 3], ModelChunk>,
    voxel: f32,
    /// Inspection that the model is of, and its newest epoch.
    inspection: (String, u32),
    /// Chunks of that epoch while they arrive.
    arriving: Option<BTreeMap<[i32; 3], ModelChunk>>,
}

impl LiveModel {
    /// An empty model.
    pub fn new() -> Self {
        Self::default()
    }

    /// Brings the model level with one event; events that do not concern the model change nothing.
    pub fn apply(&mut self, event: &LinkEvent) -> ModelChange {
        match event {
            LinkEvent::Connected { resumed: true, .. } => ModelChange::None,
            LinkEvent::Connected { inspection, .. } | LinkEvent::Cleared(inspection) => self.begin(inspection),
            LinkEvent::Progress(progress) => self.arrive(progress),
            LinkEvent::Chunk(chunk) => self.replace(chunk),
            LinkEvent::ChunkGone { id } if self.arriving.is_some() => {
                self.arriving.as_mut().and_then(|chunks| chunks.remove(id));
                ModelChange::None
            }
            LinkEvent::ChunkGone { id } => match self.chunks.remove(id) {
                Some(_) => ModelChange::Removed(*id),
                None => ModelChange::None,
            },
            _ => ModelChange::None,
        }
    }

    fn clear(&mut self) -> ModelChange {
        self.chunks.clear();
        self.arriving = None;
        ModelChange::Cleared
    }

    /// Exchanges the model for that of a new epoch when the agent's word says that this one is whole.
    fn arrive(&mut self, progress: &Progress) -> ModelChange {
        // The end is told after the last chunk, whether there was a whole model or not.
        let over = matches!(progress.phase(), Phase::Finished | Phase::Failed);
        if progress.complete_epoch < self.inspection.1 && !over {
            return ModelChange::None;
        }
        let Some(chunks) = self.arriving.take() else { return ModelChange::None };
        self.chunks = chunks;
        ModelChange::Exchanged
    }

    /// The model of `inspection` will come from its first chunk on: what is held goes, unless it is the same inspection's
    /// from an earlier epoch.
    fn begin(&mut self, inspection: &Inspection) -> ModelChange {
        self.voxel = inspection.voxel as f32;
        let now = (inspection.id.clone(), inspection.epoch);
        let (id, epoch) = std::mem::replace(&mut self.inspection, now);
        if !id.is_empty() && id == inspection.id && epoch < inspection.epoch && !self.chunks.is_empty() {
            self.arriving = Some(BTreeMap::new());
            return ModelChange::None;
        }
        self.clear()
    }

    fn replace(&mut self, chunk: &DecodedChunk) -> ModelChange {
        self.voxel = chunk.voxel;
        let mut held = ModelChunk {
            revision: chunk.revision,
            hash: chunk.hash,
            stats: BTreeMap::new(),
            bounds: Bounds::EMPTY,
            foreground: Bounds::EMPTY,
            most_views: 0,
            cloud: chunk.cloud.clone(),
        };
        for p in held.cloud.iter() {
            let class = held.stats.entry((p.label, p.flags.0 & HIDING)).or_default();
            class.points += 1;
            class.area += f64::from(surfel_area(p.normal, chunk.voxel));
            class.confidence_sum += f64::from(p.confidence);
            held.bounds.include(p.position.into());
            if !p.flags.has(PointFlags::LEFT_OUT) {
                held.foreground.include(p.position.into());
            }
            held.most_views = held.most_views.max(p.views);
        }
        if let Some(arriving) = &mut self.arriving {
            arriving.insert(chunk.id, held);
            return ModelChange::None;
        }
        self.chunks.insert(chunk.id, held);
        ModelChange::Replaced(chunk.id)
    }

    /// Chunks in the order of their coordinates.
    pub fn chunks(&self) -> impl Iterator<Item = ([i32; 3], &ModelChunk)> {
        self.chunks.iter().map(|(id, chunk)| (*id, chunk))
    }

    /// The chunk at `id`, if held.
    pub fn chunk(&self, id: [i32; 3]) -> Option<&ModelChunk> {
        self.chunks.get(&id)
    }

    /// Number of chunks held.
    pub fn chunk_count(&self) -> usize {
        self.chunks.len()
    }

    /// Number of points held.
    pub fn point_count(&self) -> usize {
        self.chunks.values().map(|c| c.cloud.len()).sum()
    }

    /// Voxel edge in metres; 0 until it is known.
    pub fn voxel(&self) -> f32 {
        self.voxel
    }

    /// The most views that any point was seen in; the natural top of a scale.
    pub fn most_views(&self) -> u16 {
        self.chunks.values().map(|c| c.most_views).max().unwrap_or(0)
    }

    /// Hash of the whole model, comparable with `Progress::model_hash`.
    pub fn hash(&self) -> u64 {
        hash_of(&self.chunks)
    }

    /// Figures of every component class that occurs, by class, over the points that `hidden` leaves in the picture.
    pub fn class_stats(&self, hidden: HiddenFlags) -> BTreeMap<u16, ClassStats> {
        let mut sum: BTreeMap<u16, ClassStats> = BTreeMap::new();
        for ((class, marks), stats) in self.chunks.values().flat_map(|c| &c.stats) {
            if marks & hidden.bits() == 0 {
                sum.entry(*class).or_default().add(stats);
            }
        }
        sum
    }

    /// Box around every point that is neither outlier nor background, metres, table frame; around every point if there
    /// is no such; `None` without points.
    pub fn bounds(&self) -> Option<Bounds> {
        let join = |of: fn(&ModelChunk) -> Bounds| {
            let all = self.chunks.values().fold(Bounds::EMPTY, |sum, c| sum.union(of(c)));
            (!all.is_empty()).then_some(all)
        };
        join(|c| c.foreground).or_else(|| join(|c| c.bounds))
    }

    /// Every point as one cloud, chunks in the order of their coordinates; for exports.
    pub fn to_cloud(&self) -> SemanticCloud {
        let mut cloud = SemanticCloud::with_capacity(self.point_count());
        for chunk in self.chunks.values() {
            cloud.extend_from(&chunk.cloud);
        }
        cloud
    }
}

fn hash_of(chunks: &BTreeMap<[i32; 3], ModelChunk>) -> u64 {
    model_hash(chunks.iter().map(|(id, c)| (*id, c.hash)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use semascan_shared::model::SemanticPoint;

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

    #[test]
    fn a_chunk_replaces_its_earlier_revision_in_every_figure() {
        let mut model = LiveModel::new();
        assert_eq!(model.apply(&chunk(0, 1, &[point(1.0, 1, 0); 10])), ModelChange::Replaced([0; 3]));
        model.apply(&chunk(1, 1, &[point(2.0, 2, 0)]));
        model.apply(&chunk(0, 2, &[point(0.5, 1, 0), point(0.5, 2, 0)]));
        assert_eq!((model.point_count(), model.chunk_count()), (3, 2));
        let stats = model.class_stats(HiddenFlags::default());
        assert_eq!((stats[&1].points, stats[&2].points), (1, 2));
        let area = f64::from(VOXEL * VOXEL);
        assert!((stats[&2].area - 2.0 * area).abs() < area * 1e-6);
        assert!((stats[&2].mean_confidence() - 0.5).abs() < 1e-9);
        assert_eq!(model.bounds().map(|b| b.max.x), Some(2.0));
        assert_eq!((model.most_views(), model.voxel()), (3, VOXEL));
        assert_eq!(model.to_cloud().len(), 3);
    }

    #[test]
    fn a_new_epoch_replaces_the_old_model_only_when_it_is_whole() {
        let inspection = |id: &str, epoch| Inspection { id: id.into(), epoch, ..Inspection::default() };
        let mut model = LiveModel::new();
        assert_eq!(model.apply(&LinkEvent::Cleared(inspection("a", 1))), ModelChange::Cleared);
        model.apply(&chunk(0, 1, &[point(1.0, 1, 0)]));
        model.apply(&chunk(1, 1, &[point(2.0, 1, 0)]));
        assert_eq!(model.apply(&LinkEvent::Cleared(inspection("a", 2))), ModelChange::None);
        assert_eq!(model.apply(&chunk(0, 2, &[point(1.5, 1, 0)])), ModelChange::None);
        model.apply(&chunk(7, 2, &[point(7.5, 1, 0)]));
        model.apply(&LinkEvent::ChunkGone { id: [7, 0, 0] });
        assert_eq!(
            (model.chunk_count(), model.bounds().map(|b| b.max.x)),
            (2, Some(2.0)),
            "the old one is still shown"
        );
        let word = |complete_epoch| {
            LinkEvent::Progress(Progress { complete_epoch, phase: Phase::Running.into(), ..Progress::default() })
        };
        assert_eq!(model.apply(&word(1)), ModelChange::None);
        model.apply(&chunk(3, 2, &[point(3.5, 1, 0)]));
        assert_eq!(model.apply(&word(2)), ModelChange::Exchanged);
        assert_eq!((model.chunk_count(), model.bounds().map(|b| b.max.x)), (2, Some(3.5)));
        assert_eq!(model.apply(&word(2)), ModelChange::None);
        // At the end in any case.
        model.apply(&LinkEvent::Cleared(inspection("a", 4)));
        model.apply(&chunk(0, 3, &[point(1.0, 1, 0)]));
        let end = Progress { phase: Phase::Finished.into(), ..Progress::default() };
        assert_eq!(model.apply(&LinkEvent::Progress(end)), ModelChange::Exchanged);
        assert_eq!(model.chunk_count(), 1);
        // Another inspection is another model.
        model.apply(&chunk(0, 4, &[point(1.0, 1, 0)]));
        assert_eq!(model.apply(&LinkEvent::Cleared(inspection("b", 1))), ModelChange::Cleared);
    }

    #[test]
    fn figures_count_what_the_picture_shows() {
        let mut model = LiveModel::new();
        let marked = [
            point(1.0, 1, 0),
            point(2.0, 1, PointFlags::RADIUS_OUTLIER),
            point(3.0, 1, PointFlags::BACKGROUND),
            point(4.0, 1, PointFlags::UNLABELLED),
        ];
        model.apply(&chunk(0, 1, &marked));
        let points = |outliers, background| {
            let hidden = HiddenFlags { outliers, background };
            model.class_stats(hidden)[&1].points
        };
        assert_eq!(points(false, false), 4);
        assert_eq!(points(true, false), 3);
        assert_eq!(points(true, true), 2);
    }

    #[test]
    fn the_hash_depends_on_content_and_not_on_the_way_there() {
        let (mut straight, mut winding) = (LiveModel::new(), LiveModel::new());
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
        let connected =
            |resumed| LinkEvent::Connected { inspection: Inspection::default(), resumed, agent: String::new() };
        let mut model = LiveModel::new();
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
    fn bounds_pass_over_outliers_and_background_while_there_is_anything_else() {
        let mut model = LiveModel::new();
        model.apply(&chunk(0, 1, &[point(50.0, 0, PointFlags::BACKGROUND)]));
        assert_eq!(model.bounds().map(|b| b.max.x), Some(50.0));
        model.apply(&chunk(1, 1, &[point(1.0, 1, 0), point(9.0, 1, PointFlags::RADIUS_OUTLIER)]));
        assert_eq!(model.bounds().map(|b| (b.min.x, b.max.x)), Some((1.0, 1.0)));
    }
}
