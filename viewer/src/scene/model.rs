//! The model as the viewer holds it: chunk by chunk, kept level with the agent by [`LinkEvent`]s.
//!
//! Figures (points, areas, bounds) are kept per chunk and summed on demand in chunk order, so replacing a chunk costs
//! only that chunk, nothing drifts, and the sums do not depend on the order of arrival.

use crate::camera::Bounds;
use crate::link::{DecodedChunk, LinkEvent};
use semascan_model::{PointFlags, SemanticCloud};
use semascan_protocol::chunk::model_hash;
use semascan_protocol::server_message::Body;
use semascan_protocol::{Inspection, Phase, Progress};
use std::collections::BTreeMap;

/// The marks that can hide a point.
const HIDING: u16 = PointFlags::LEFT_OUT;

/// What an event did to the model: what a renderer must redraw.
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

/// Points and confidence of one component class.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ClassStats {
    /// Points that carry the class.
    pub points: usize,
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
pub struct HeldModel {
    chunks: BTreeMap<[i32; 3], ModelChunk>,
    voxel: f32,
    /// Inspection that the model is of, and its newest epoch.
    inspection: (String, u32),
    /// Chunks of that epoch while they arrive.
    arriving: Option<BTreeMap<[i32; 3], ModelChunk>>,
}

impl HeldModel {
    /// An empty model.
    pub fn new() -> Self {
        Self::default()
    }

    /// Brings the model level with one event; events that do not concern the model change nothing.
    pub fn apply(&mut self, event: &LinkEvent) -> ModelChange {
        match event {
            LinkEvent::Connected { resumed: true, .. } => ModelChange::None,
            LinkEvent::Connected { inspection, .. } | LinkEvent::Cleared(inspection) => self.begin(inspection),
            LinkEvent::Message(Body::Progress(progress)) => self.arrive(progress),
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

    /// Exchanges the model for that of a new epoch when the agent says that this one is whole.
    fn arrive(&mut self, progress: &Progress) -> ModelChange {
        // The end is reported after the last chunk, whether there was a whole model or not.
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
        model_hash(self.chunks.iter().map(|(id, chunk)| (*id, chunk.hash)))
    }

    /// Figures of every component class that occurs, by class, over the points without any of the marks `left_out`, bits of
    /// [`PointFlags::LEFT_OUT`].
    pub fn class_stats(&self, left_out: u16) -> BTreeMap<u16, ClassStats> {
        let mut sum: BTreeMap<u16, ClassStats> = BTreeMap::new();
        for ((class, marks), stats) in self.chunks.values().flat_map(|c| &c.stats) {
            if marks & left_out == 0 {
                sum.entry(*class).or_default().add(stats);
            }
        }
        sum
    }

    /// Box around every point that is neither outlier nor background, metres, table frame; around every point if there
    /// is no such; `None` without points.
    pub fn bounds(&self) -> Option<Bounds> {
        let (mut foreground, mut all) = (Bounds::EMPTY, Bounds::EMPTY);
        for chunk in self.chunks.values() {
            foreground = foreground.union(chunk.foreground);
            all = all.union(chunk.bounds);
        }
        [foreground, all].into_iter().find(|bounds| !bounds.is_empty())
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

#[cfg(test)]
mod tests;
