//! The semantic map: a voxel hash of bricks that views are integrated into, in order, whatever the number of threads.
//!
//! Evidence follows [Remanufacturing paper], Eqs. 2 and 3 (component K and defect D of a point), with a Dirichlet
//! histogram a voxel: `alpha_c += w p_c` with `w = cos(incidence) (1 - sigma^2 / threshold^2)`. Geometry is weighted by
//! the inverse variance of the depth.

use super::brick::Brick;
use super::error::FuseError;
use super::kept_views::KeptViews;
use super::keys::{BrickKey, brick_of};
use super::labelled_view::LabelledView;
use super::map_config::MapConfig;
use super::merge::{Change, Scratch, merge_brick};
use super::runs::{Placer, Run, sorted_runs};
use crate::register::OrientedPoints;
use nalgebra::Isometry3;
use rayon::prelude::*;
use semascan_model::{PointFlags, SemanticCloud};
use semascan_protocol::chunk::{CHUNK_EDGE, VoxelChunk};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, HashMap};

/// Rows of a picture whose bricks are merged one after the other along the row.
const TOGETHER: u32 = 16;

/// Voxels of a map that need not become fewer before all views are in: less than a gigabyte.
const SMALL: usize = 6 << 20;

/// A chunk that an integration changed, and how much.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TouchedChunk {
    /// Chunk coordinates.
    pub id: [i32; 3],
    /// Voxels that were not there before.
    pub made: u32,
    /// Voxels whose best component or defect class changed.
    pub relabelled: u32,
}

/// What integrating one view did.
#[derive(Clone, Debug, Default)]
pub struct Integration {
    /// Changed chunks in address order.
    pub touched: Vec<TouchedChunk>,
    /// Voxels made.
    pub points_added: u64,
}

/// The semantic 3D model of a part, table frame.
#[derive(Debug)]
pub struct SemanticMap {
    pub(super) config: MapConfig,
    /// In the order of their making.
    pub(super) bricks: Vec<Brick>,
    /// Where each brick is.
    pub(super) keys: Vec<BrickKey>,
    pub(super) index: HashMap<BrickKey, usize>,
    kept: KeptViews,
    epoch: u32,
    /// Views that were merged.
    pub(super) views: u16,
    /// Voxels after surfaces were last made thin.
    consolidated: usize,
}

impl SemanticMap {
    /// An empty map.
    ///
    /// # Errors
    /// [`FuseError::Config`] if a setting is out of range.
    pub fn new(config: MapConfig) -> Result<Self, FuseError> {
        if !(config.voxel.is_finite() && config.voxel > 0.0) {
            return Err(FuseError::Config { field: "voxel", reason: format!("{} is not a length", config.voxel) });
        }
        let rule = &config.uncertainty;
        if ![rule.threshold, rule.defect_threshold].iter().all(|t| t.is_finite() && *t > 0.0) {
            return Err(FuseError::Config { field: "uncertainty", reason: "a threshold is not positive".into() });
        }
        if config.components == 0 || config.defects == 0 {
            return Err(FuseError::Config { field: "classes", reason: "class 0 (none) must exist".into() });
        }
        let kept = KeptViews::new(config.keep_in_memory);
        Ok(Self {
            config,
            bricks: Vec::new(),
            keys: Vec::new(),
            index: HashMap::new(),
            kept,
            epoch: 1,
            views: 0,
            consolidated: 0,
        })
    }

    /// The settings.
    pub fn config(&self) -> &MapConfig {
        &self.config
    }

    /// Grows with every rebuild; from 1.
    pub fn epoch(&self) -> u32 {
        self.epoch
    }

    /// Number of occupied voxels.
    pub fn len(&self) -> usize {
        self.bricks.iter().map(|b| b.voxels.len()).sum()
    }

    /// Whether nothing was integrated.
    pub fn is_empty(&self) -> bool {
        self.bricks.is_empty()
    }

    /// Adds a posed, labelled view and keeps it for later rebuilds.
    ///
    /// # Errors
    /// [`FuseError`] if the view's parts do not fit together, hold no depth, or cannot be kept; the map is unchanged.
    pub fn integrate(&mut self, view: &LabelledView) -> Result<Integration, FuseError> {
        let pixels = view.cloud.depth.len();
        let mismatch = |field| {
            let k = view.cloud.intrinsics;
            FuseError::SizeMismatch { view: view.index, field, width: k.width, height: k.height }
        };
        if view.rgb.width() as usize * view.rgb.height() as usize != pixels {
            return Err(mismatch("colour image"));
        }
        if view.segmentation.instances.len() != pixels {
            return Err(mismatch("instance labels"));
        }
        let cloud = &view.cloud;
        let fitted = [cloud.normals.len(), cloud.flying.len(), cloud.smooth.len(), cloud.sigma.len()];
        if fitted.iter().any(|n| *n != pixels) {
            return Err(mismatch("fitted surface"));
        }
        let no_depth = FuseError::NoDepth { view: view.index };
        let Some(placer) = Placer::new(view, self.config.voxel) else { return Err(no_depth) };
        // Packing a view takes as long as placing it, and one does not wait for the other.
        let (kept, runs) = rayon::join(|| self.kept.prepare(view), || sorted_runs(view, &placer));
        if runs.is_empty() {
            return Err(no_depth);
        }
        self.kept.keep(kept?)?;
        let mut integration = self.merge(view, &placer, &runs);
        let moved = self.consolidate_if_grown().into_iter().map(|id| TouchedChunk { id, made: 0, relabelled: 0 });
        if moved.len() > 0 {
            integration.touched.extend(moved);
            integration.touched.sort_by_key(|chunk| chunk.id);
            // Of two entries of a chunk the first says what the view did.
            integration.touched.dedup_by_key(|chunk| chunk.id);
        }
        Ok(integration)
    }

    /// Makes the map anew from the kept views under other camera poses (one a kept view, in order), in a new epoch.
    ///
    /// # Errors
    /// [`FuseError::PoseCount`], or [`FuseError::Keep`] if a view cannot be read back; the map is then unchanged.
    pub fn rebuild(&mut self, table_from_camera: &[Isometry3<f64>]) -> Result<(), FuseError> {
        let fresh = self.with_poses(table_from_camera)?;
        self.bricks = fresh.bricks;
        self.keys = fresh.keys;
        self.index = fresh.index;
        (self.views, self.consolidated) = (fresh.views, fresh.consolidated);
        self.kept.set_poses(table_from_camera);
        self.epoch += 1;
        Ok(())
    }

    /// Another map of the kept views, under other camera poses (one a kept view, in order); this one stays as it is. The new
    /// map keeps no views.
    ///
    /// # Errors
    /// As [`Self::rebuild`].
    pub fn with_poses(&self, table_from_camera: &[Isometry3<f64>]) -> Result<Self, FuseError> {
        if table_from_camera.len() != self.kept.len() {
            return Err(FuseError::PoseCount { poses: table_from_camera.len(), views: self.kept.len() });
        }
        let mut fresh = Self::new(self.config.clone())?;
        // One view at a time: the old map, the new one and a view are what memory has to hold.
        for (i, pose) in table_from_camera.iter().enumerate() {
            let mut view = self.kept.restore(i)?;
            view.table_from_camera = *pose;
            fresh.place_and_merge(&view)?;
        }
        Ok(fresh)
    }

    fn place_and_merge(&mut self, view: &LabelledView) -> Result<(), FuseError> {
        let placer = Placer::new(view, self.config.voxel).ok_or(FuseError::NoDepth { view: view.index })?;
        let runs = sorted_runs(view, &placer);
        self.merge(view, &placer, &runs);
        self.consolidate_if_grown();
        Ok(())
    }

    /// Makes noisy surfaces thin where views have made a large map twice as large since it was last done: memory follows the
    /// surface, not the number of views.
    fn consolidate_if_grown(&mut self) -> Vec<[i32; 3]> {
        let voxels = self.len();
        if voxels < SMALL || voxels < 2 * self.consolidated {
            return Vec::new();
        }
        let changed = self.consolidate();
        self.consolidated = self.len();
        changed
    }

    /// Camera poses that views were integrated with, in order.
    pub fn kept_views(&self) -> &KeptViews {
        &self.kept
    }

    fn merge(&mut self, view: &LabelledView, placer: &Placer, runs: &[Run]) -> Integration {
        self.views = self.views.saturating_add(1);
        // One job a brick, in the order of the picture: neighbours in it share what they read of the view.
        let mut work: Vec<&[Run]> = runs.chunk_by(|a, b| a.brick == b.brick).collect();
        let width = view.cloud.intrinsics.width.max(1);
        work.par_sort_unstable_by_key(|run| (run[0].start / width / TOGETHER, run[0].start % width, run[0].brick));
        let mut places = Vec::with_capacity(work.len());
        for run in &work {
            let key = brick_of(run[0].brick);
            places.push(self.place_of(key));
        }
        let mut bricks: Vec<Option<&mut Brick>> = self.bricks.iter_mut().map(Some).collect();
        let jobs: Vec<(Option<&mut Brick>, BrickKey, &[Run])> =
            places.iter().zip(work).map(|(&at, run)| (bricks[at].take(), self.keys[at], run)).collect();
        let config = &self.config;
        let changes: Vec<([i32; 3], Change)> = jobs
            .into_par_iter()
            .map_init(Scratch::default, |scratch, (brick, key, run)| {
                let change = brick.map(|brick| merge_brick(config, view, placer, scratch, (key, brick, run)));
                (key.chunk(), change.unwrap_or_default())
            })
            .collect();

        let mut touched: BTreeMap<[i32; 3], Change> = BTreeMap::new();
        for (chunk, change) in changes {
            let chunk = touched.entry(chunk).or_default();
            chunk.made += change.made;
            chunk.relabelled += change.relabelled;
        }
        let points_added = touched.values().map(|c| u64::from(c.made)).sum();
        let chunk = |(id, Change { made, relabelled })| TouchedChunk { id, made, relabelled };
        Integration { touched: touched.into_iter().map(chunk).collect(), points_added }
    }

    /// Place of the brick at `key`, which is made if it is not there.
    pub(super) fn place_of(&mut self, key: BrickKey) -> usize {
        *self.index.entry(key).or_insert_with(|| {
            self.bricks.push(Brick::default());
            self.keys.push(key);
            self.bricks.len() - 1
        })
    }

    /// Bricks in address order.
    pub(super) fn sorted_bricks(&self) -> Vec<(BrickKey, &Brick)> {
        let mut order: Vec<(BrickKey, &Brick)> = self.index.iter().map(|(k, &i)| (*k, &self.bricks[i])).collect();
        order.par_sort_unstable_by_key(|(k, _)| *k);
        order
    }

    /// The whole model as points, in address order.
    pub fn cloud(&self) -> SemanticCloud {
        let classes = self.config.components + self.config.defects;
        let mut cloud = SemanticCloud::with_capacity(self.len());
        for (key, brick) in self.sorted_bricks() {
            for (local, slot) in brick.occupied() {
                let evidence = brick.evidence(slot, classes);
                let voxel = &brick.voxels[slot];
                cloud.push(voxel.point(key.voxel(local), self.config.voxel, evidence, self.config.components));
            }
        }
        cloud
    }

    /// Points of the component classes that `wanted` agrees to, in address order. Outliers are left out.
    pub(super) fn oriented_points(&self, wanted: &dyn Fn(u16) -> bool) -> OrientedPoints {
        let mut out = OrientedPoints::default();
        for (key, brick) in self.sorted_bricks() {
            for (local, slot) in brick.occupied() {
                let voxel = &brick.voxels[slot];
                if voxel.flags.has(PointFlags::OUTLIER) || !wanted(voxel.label) {
                    continue;
                }
                out.points.push(voxel.position(key.voxel(local), self.config.voxel));
                out.normals.push(voxel.unit_normal());
            }
        }
        out
    }

    /// Coordinates of all occupied chunks, in order.
    pub fn chunk_ids(&self) -> Vec<[i32; 3]> {
        let mut ids: Vec<_> = self.index.keys().map(|k| k.chunk()).collect();
        ids.sort_unstable();
        ids.dedup();
        ids
    }

    /// The content of one chunk, for the stream.
    pub fn chunk(&self, id: [i32; 3]) -> VoxelChunk {
        let classes = self.config.components + self.config.defects;
        let first = id.map(|c| c * CHUNK_EDGE / 8);
        let mut chunk = VoxelChunk { id, voxel: self.config.voxel as f32, voxels: Vec::new() };
        for b in 0..64 {
            let key = BrickKey([first[0] + (b >> 4 & 3), first[1] + (b >> 2 & 3), first[2] + (b & 3)]);
            let Some(brick) = self.index.get(&key).map(|&i| &self.bricks[i]) else { continue };
            for (local, slot) in brick.occupied() {
                let address = key.voxel(local);
                let within = address.map(|c| c.rem_euclid(CHUNK_EDGE) as u8);
                let evidence = brick.evidence(slot, classes);
                let point = brick.voxels[slot].point(address, self.config.voxel, evidence, self.config.components);
                chunk.voxels.push((within, point));
            }
        }
        chunk
    }
}
