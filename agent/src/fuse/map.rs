//! The semantic map: a voxel hash of bricks that views are integrated into, in order, whatever the number of threads.
//!
//! Evidence follows P0 Eqs. 2 and 3 with a Dirichlet histogram a voxel: `alpha_c += w p_c`, `w` the cosine of incidence.
//! One view's evidence for a voxel is capped, because neighbouring pixels of one picture are not independent witnesses.

use super::brick::{Brick, best_share};
use super::keys::{BrickKey, brick_of, local_of};
use super::samples::{Sample, sorted_samples};
use super::{FuseError, KeptViews, LabelledView};
use nalgebra::{Isometry3, Point3};
use rayon::prelude::*;
use semascan_shared::model::{PointFlags, SemanticCloud};
use semascan_shared::wire::chunk::{CHUNK_EDGE, VoxelChunk};
use std::collections::{BTreeMap, HashMap};

/// Settings of a map.
#[derive(Clone, Debug)]
pub struct MapConfig {
    /// Voxel edge in metres.
    pub voxel: f64,
    /// Component classes, `none` included.
    pub components: usize,
    /// Defect classes, `none` included.
    pub defects: usize,
    /// Most evidence that one view may add to a voxel.
    pub evidence_cap: f32,
    /// Pixels with a larger sigma add geometry but no evidence.
    pub sigma_threshold: f32,
    /// Measuring volume in the table frame (min and max corner); points outside are marked as background.
    pub volume: Option<(Point3<f64>, Point3<f64>)>,
    /// Bytes of kept views held in memory before they go to disk.
    pub keep_in_memory: usize,
}

impl MapConfig {
    /// The usual settings for a voxel size and class counts.
    pub fn new(voxel: f64, components: usize, defects: usize) -> Self {
        Self {
            voxel,
            components,
            defects,
            evidence_cap: 1.0,
            sigma_threshold: 0.5,
            volume: None,
            keep_in_memory: 512 << 20,
        }
    }
}

/// A chunk that an integration changed, and how much.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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
        if config.components == 0 || config.defects == 0 {
            return Err(FuseError::Config { field: "classes", reason: "class 0 (none) must exist".into() });
        }
        let kept = KeptViews::new(config.keep_in_memory);
        Ok(Self { config, bricks: Vec::new(), keys: Vec::new(), index: HashMap::new(), kept, epoch: 1 })
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
        let samples = sorted_samples(view, self.config.voxel);
        if samples.is_empty() {
            return Err(FuseError::NoDepth { view: view.index });
        }
        self.kept.keep(view)?;
        Ok(self.merge(view, &samples))
    }

    /// Makes the map anew from the kept views under other camera poses (one a kept view, in order), in a new epoch.
    ///
    /// # Errors
    /// [`FuseError::PoseCount`], or [`FuseError::Keep`] if a view cannot be read back; the map is then unchanged.
    pub fn rebuild(&mut self, table_from_camera: &[Isometry3<f64>]) -> Result<(), FuseError> {
        if table_from_camera.len() != self.kept.len() {
            return Err(FuseError::PoseCount { poses: table_from_camera.len(), views: self.kept.len() });
        }
        let mut fresh = Self::new(self.config.clone())?;
        for (i, pose) in table_from_camera.iter().enumerate() {
            let mut view = self.kept.restore(i)?;
            view.table_from_camera = *pose;
            let samples = sorted_samples(&view, self.config.voxel);
            fresh.merge(&view, &samples);
        }
        self.bricks = fresh.bricks;
        self.keys = fresh.keys;
        self.index = fresh.index;
        self.epoch += 1;
        Ok(())
    }

    /// Camera poses that views were integrated with, in order.
    pub fn kept_views(&self) -> &KeptViews {
        &self.kept
    }

    fn merge(&mut self, view: &LabelledView, samples: &[Sample]) -> Integration {
        // One job a brick. Bricks are taken out of the arena so that each job owns its brick.
        let runs: Vec<&[Sample]> = samples.chunk_by(|a, b| a.key >> 9 == b.key >> 9).collect();
        let mut jobs: Vec<(BrickKey, usize, Brick, &[Sample])> = Vec::with_capacity(runs.len());
        for run in runs {
            let key = brick_of(run[0].key);
            let slot = *self.index.entry(key).or_insert_with(|| {
                self.bricks.push(Brick::default());
                self.keys.push(key);
                self.bricks.len() - 1
            });
            jobs.push((key, slot, std::mem::take(&mut self.bricks[slot]), run));
        }
        let config = &self.config;
        let changes: Vec<(u32, u32)> =
            jobs.par_iter_mut().map(|(key, _, brick, run)| merge_brick(config, view, *key, brick, run)).collect();

        let mut touched: BTreeMap<[i32; 3], (u32, u32)> = BTreeMap::new();
        for ((key, slot, brick, _), (made, relabelled)) in jobs.into_iter().zip(changes) {
            self.bricks[slot] = brick;
            let chunk = touched.entry(key.chunk()).or_default();
            chunk.0 += made;
            chunk.1 += relabelled;
        }
        let points_added = touched.values().map(|c| u64::from(c.0)).sum();
        let chunk = |(id, (made, relabelled))| TouchedChunk { id, made, relabelled };
        Integration { touched: touched.into_iter().map(chunk).collect(), points_added }
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

/// Merges one view's samples of one brick; returns how many voxels were made and relabelled.
fn merge_brick(
    config: &MapConfig,
    view: &LabelledView,
    key: BrickKey,
    brick: &mut Brick,
    run: &[Sample],
) -> (u32, u32) {
    let classes = config.components + config.defects;
    let rotation = view.table_from_camera.rotation.to_rotation_matrix().matrix().cast::<f32>();
    let (mut made, mut relabelled) = (0, 0);
    let mut fresh = vec![0.0_f32; classes];
    for samples in run.chunk_by(|a, b| a.key == b.key) {
        let local = local_of(samples[0].key);
        let (voxel, evidence, is_new) = brick.entry(local, classes);
        fresh.fill(0.0);
        for s in samples {
            let i = s.pixel as usize;
            let n = view.cloud.normals[i];
            let weight = incidence(view, i, n);
            voxel.weight += weight;
            let rgb = view.rgb.as_raw().get(i * 3..i * 3 + 3).unwrap_or(&[0; 3]);
            for axis in 0..3 {
                let turned = rotation[(axis, 0)] * n[0] + rotation[(axis, 1)] * n[1] + rotation[(axis, 2)] * n[2];
                voxel.offset[axis] += weight * s.offset[axis];
                voxel.normal[axis] += weight * turned;
                voxel.color[axis] += weight * f32::from(rgb[axis]);
            }
            let (sigma, defect_sigma) = (view.segmentation.components.sigma(i), view.segmentation.defects.sigma(i));
            voxel.sigma += weight * sigma;
            voxel.defect_sigma += weight * defect_sigma;
            if sigma <= config.sigma_threshold {
                view.segmentation.components.add_evidence(i, weight, &mut fresh[..config.components]);
            }
            if defect_sigma <= config.sigma_threshold {
                view.segmentation.defects.add_evidence(i, weight, &mut fresh[config.components..]);
            }
            vote_instance(voxel, view.segmentation.instances[i], weight);
        }
        voxel.views = voxel.views.saturating_add(1);
        let (components, defects) = evidence.split_at_mut(config.components);
        let before = (best_share(components).0, best_share(defects).0);
        add_capped(components, &fresh[..config.components], config.evidence_cap);
        add_capped(defects, &fresh[config.components..], config.evidence_cap);
        if is_new {
            made += 1;
            if let Some((low, high)) = config.volume {
                let p = voxel.position(key.voxel(local), config.voxel);
                let inside = (0..3).all(|a| f64::from(p[a]) >= low[a] && f64::from(p[a]) <= high[a]);
                voxel.flags = PointFlags(if inside { 0 } else { PointFlags::BACKGROUND });
            }
        } else if before != (best_share(components).0, best_share(defects).0) {
            relabelled += 1;
        }
    }
    (made, relabelled)
}

/// Weight of pixel `i`: cosine between its normal and the ray, with a floor for grazing or unknown normals.
fn incidence(view: &LabelledView, i: usize, normal: [f32; 3]) -> f32 {
    const FLOOR: f32 = 0.05;
    let Some(p) = view.cloud.point(i) else { return FLOOR };
    let ray = p.coords.cast::<f32>().normalize();
    (-(ray.x * normal[0] + ray.y * normal[1] + ray.z * normal[2])).max(FLOOR)
}

fn add_capped(evidence: &mut [f32], fresh: &[f32], cap: f32) {
    let total: f32 = fresh.iter().sum();
    let scale = if total > cap { cap / total } else { 1.0 };
    for (alpha, e) in evidence.iter_mut().zip(fresh) {
        *alpha += scale * e;
    }
}

fn vote_instance(voxel: &mut super::brick::Voxel, instance: u16, weight: f32) {
    if voxel.instance == instance {
        voxel.instance_lead += weight;
    } else if voxel.instance_lead >= weight {
        voxel.instance_lead -= weight;
    } else {
        voxel.instance = instance;
        voxel.instance_lead = weight - voxel.instance_lead;
    }
}
