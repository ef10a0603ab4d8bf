//! The model as the viewer holds it: chunk by chunk, kept level with the agent by [`LinkEvent`]s.
//!
//! Figures (points, areas, bounds) are kept per chunk and summed on demand in chunk order, so replacing a chunk costs
//! only that chunk, nothing drifts, and the sums do not depend on the order of arrival.

use crate::camera::Bounds;
use crate::display::{ScalarScale, ShareHistogram, ShareScales};
use crate::link::halving::halved;
use crate::link::{DecodedChunk, LinkEvent};
use semascan_model::{PointFlags, SemanticCloud};
use semascan_protocol::chunk::model_hash;
use semascan_protocol::server_message::Body;
use semascan_protocol::{Inspection, Phase, Progress};
use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};

/// The marks that can hide a point.
const HIDING: u16 = PointFlags::LEFT_OUT;

/// Points with a component are what is looked at if they are this share of the surface.
const LABELLED: f64 = 0.1;
/// Share of the points that may lie beyond either side of what is looked at.
const STRAY: f64 = 0.005;
/// Chunks with few points count if they are so many chunks, at most, from others.
const RINGS: usize = 2;

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

/// The shares of the points that are part of the surface and have evidence for a component; of the others neither is
/// known.
#[derive(Clone, Debug, Default, PartialEq)]
struct Shares {
    confidence: ShareHistogram,
    sigma: ShareHistogram,
}

impl Shares {
    fn add(&mut self, cloud: &SemanticCloud) {
        for (confidence, sigma) in known_shares(cloud) {
            self.confidence.add(confidence);
            self.sigma.add(sigma);
        }
    }

    fn remove(&mut self, cloud: &SemanticCloud) {
        for (confidence, sigma) in known_shares(cloud) {
            self.confidence.remove(confidence);
            self.sigma.remove(sigma);
        }
    }
}

/// Confidence and sigma of the points whose component is known.
fn known_shares(cloud: &SemanticCloud) -> impl Iterator<Item = (f32, f32)> {
    let known = cloud.iter().filter(|p| p.label != 0 && p.confidence > 0.0 && !p.flags.has(PointFlags::LEFT_OUT));
    known.map(|p| (p.confidence, p.sigma))
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
    /// Points in `foreground`, and how many of them have a component.
    surface_points: u32,
    labelled: u32,
    /// Box of the latter.
    labelled_bounds: Bounds,
    most_views: u16,
}

impl ModelChunk {
    /// The points of a chunk with their figures.
    fn new(revision: u32, hash: u64, cloud: SemanticCloud) -> Self {
        let mut held = Self {
            revision,
            hash,
            stats: BTreeMap::new(),
            bounds: Bounds::EMPTY,
            foreground: Bounds::EMPTY,
            surface_points: 0,
            labelled: 0,
            labelled_bounds: Bounds::EMPTY,
            most_views: 0,
            cloud,
        };
        for p in held.cloud.iter() {
            let class = held.stats.entry((p.label, p.flags.0 & HIDING)).or_default();
            class.points += 1;
            class.confidence_sum += f64::from(p.confidence);
            held.bounds.include(p.position.into());
            if !p.flags.has(PointFlags::LEFT_OUT) {
                held.foreground.include(p.position.into());
                held.surface_points += 1;
                if p.label != 0 {
                    held.labelled_bounds.include(p.position.into());
                    held.labelled += 1;
                }
            }
            held.most_views = held.most_views.max(p.views);
        }
        held
    }

    /// Box around its points.
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }
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
    /// How often the points of each chunk were halved, to be held at all.
    halvings: u32,
    /// Chunks of that epoch while they arrive.
    arriving: Option<BTreeMap<[i32; 3], ModelChunk>>,
    /// Of the chunks held, brought level with each of them.
    shares: Shares,
    /// What [`HeldModel::focus`] came to for the chunks held.
    focus: Cell<Option<Option<Bounds>>>,
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
            LinkEvent::Halved { halvings } => self.halve(*halvings),
            LinkEvent::ChunkGone { id } | LinkEvent::LeftOut { id } if self.arriving.is_some() => {
                self.arriving.as_mut().and_then(|chunks| chunks.remove(id));
                ModelChange::None
            }
            LinkEvent::ChunkGone { id } | LinkEvent::LeftOut { id } => self.remove(*id),
            _ => ModelChange::None,
        }
    }

    fn remove(&mut self, id: [i32; 3]) -> ModelChange {
        let Some(chunk) = self.chunks.remove(&id) else { return ModelChange::None };
        self.shares.remove(&chunk.cloud);
        self.focus.take();
        ModelChange::Removed(id)
    }

    /// Thins every chunk.
    fn halve(&mut self, halvings: u32) -> ModelChange {
        let from = std::mem::replace(&mut self.halvings, halvings);
        if halvings <= from || self.chunks.is_empty() && self.arriving.is_none() {
            return ModelChange::None;
        }
        for chunk in self.chunks.values_mut().chain(self.arriving.iter_mut().flat_map(BTreeMap::values_mut)) {
            *chunk = ModelChunk::new(chunk.revision, chunk.hash, halved(&chunk.cloud, from, halvings));
        }
        self.shares = Shares::default();
        self.chunks.values().for_each(|chunk| self.shares.add(&chunk.cloud));
        self.focus.take();
        ModelChange::Exchanged
    }

    fn clear(&mut self) -> ModelChange {
        self.chunks.clear();
        self.arriving = None;
        self.shares = Shares::default();
        self.focus.take();
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
        self.shares = Shares::default();
        self.chunks.values().for_each(|chunk| self.shares.add(&chunk.cloud));
        self.focus.take();
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
        let held = ModelChunk::new(chunk.revision, chunk.hash, chunk.cloud.clone());
        if let Some(arriving) = &mut self.arriving {
            arriving.insert(chunk.id, held);
            return ModelChange::None;
        }
        self.shares.add(&held.cloud);
        if let Some(before) = self.chunks.insert(chunk.id, held) {
            self.shares.remove(&before.cloud);
        }
        self.focus.take();
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

    /// How often the points of each chunk were halved because there is no memory for more; 0: all are held.
    pub fn halvings(&self) -> u32 {
        self.halvings
    }

    /// Distance of points beside each other as they are held, metres; 0 until it is known.
    pub fn spacing(&self) -> f32 {
        self.voxel * 2.0_f32.powf(0.5 * self.halvings as f32)
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

    /// Box around every point, metres, table frame; `None` without points.
    pub fn bounds(&self) -> Option<Bounds> {
        let all = self.chunks.values().fold(Bounds::EMPTY, |all, chunk| all.union(chunk.bounds));
        (!all.is_empty()).then_some(all)
    }

    /// Box around what a person wants to see, metres, table frame: of the points that are neither outlier nor background
    /// those with a component, if these are a good part of them; without the few that lie apart from the rest. `None`
    /// without points.
    pub fn focus(&self) -> Option<Bounds> {
        if let Some(found) = self.focus.get() {
            return found;
        }
        let sum = |of: fn(&ModelChunk) -> u32| self.chunks.values().map(|c| u64::from(of(c))).sum::<u64>();
        let enough = sum(|c| c.labelled) as f64 >= LABELLED * sum(|c| c.surface_points) as f64;
        let of = |bounds: fn(&ModelChunk) -> Bounds, points: fn(&ModelChunk) -> u32| {
            trimmed_bounds(self.chunks.iter().map(|(id, chunk)| (*id, bounds(chunk), points(chunk))))
        };
        let found = if enough { of(|c| c.labelled_bounds, |c| c.labelled) } else { None }
            .or_else(|| of(|c| c.foreground, |c| c.surface_points))
            .or_else(|| of(|c| c.bounds, |c| c.cloud.len() as u32));
        self.focus.set(Some(found));
        found
    }

    /// Scales of the colours that mean shares, as the points held need them.
    pub fn share_scales(&self) -> ShareScales {
        let sigma = &self.shares.sigma;
        ShareScales {
            confidence: ScalarScale::of(&self.shares.confidence),
            sigma: ScalarScale::of(sigma).filter(|_| sigma.is_any_positive()),
        }
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

/// The box around the points of `chunks` (where they are, in which box, how many) without those that lie apart: a chunk at
/// either end of an axis, where few points are in all, counts only if it is next to others.
fn trimmed_bounds(chunks: impl Iterator<Item = ([i32; 3], Bounds, u32)>) -> Option<Bounds> {
    let chunks: Vec<_> = chunks.filter(|(_, bounds, _)| !bounds.is_empty()).collect();
    let total: u64 = chunks.iter().map(|(_, _, points)| u64::from(*points)).sum();
    let least = (STRAY * total as f64) as u64;
    let mut trimmed = BTreeSet::new();
    let mut order: Vec<usize> = (0..chunks.len()).collect();
    for axis in 0..3 {
        order.sort_unstable_by_key(|i| chunks[*i].0[axis]);
        for from_low in [true, false] {
            let mut passed = 0;
            for place in 0..order.len() {
                let i = order[if from_low { place } else { order.len() - 1 - place }];
                passed += u64::from(chunks[i].2);
                if passed > least {
                    break;
                }
                trimmed.insert(i);
            }
        }
    }
    let mut kept: BTreeSet<[i32; 3]> =
        chunks.iter().enumerate().filter(|(i, _)| !trimmed.contains(i)).map(|(_, (id, _, _))| *id).collect();
    for _ in 0..RINGS {
        let near = |id: &[i32; 3]| neighbours(*id).any(|other| kept.contains(&other));
        let back: Vec<[i32; 3]> = trimmed.iter().map(|i| chunks[*i].0).filter(near).collect();
        kept.extend(back);
    }
    let all = chunks.iter().filter(|(id, _, _)| kept.contains(id));
    let bounds = all.fold(Bounds::EMPTY, |sum, (_, bounds, _)| sum.union(*bounds));
    (!bounds.is_empty()).then_some(bounds)
}

/// A cell of a grid, such as a chunk, and the 26 around it.
pub(crate) fn neighbours([x, y, z]: [i32; 3]) -> impl Iterator<Item = [i32; 3]> {
    let steps = move |i: i32| [i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1];
    (0..27).map(steps).map(move |[a, b, c]| [x.saturating_add(a), y.saturating_add(b), z.saturating_add(c)])
}

#[cfg(test)]
mod tests;
