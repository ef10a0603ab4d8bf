//! One view's pixels into one brick.
//!
//! Everything that the view has to say of a voxel is summed first, then added at once: evidence of one view is capped,
//! because neighbouring pixels of one picture are not independent witnesses, and a view counts once.

use super::brick::{Brick, best_share};
use super::keys::{BRICK_VOXELS, BrickKey, local_index};
use super::labelled_view::LabelledView;
use super::map_config::{MapConfig, Uncertain};
use super::runs::{Placer, Ray, Run};
use semascan_geometry::vote::majority_vote;
use semascan_model::PointFlags;

const UNSEEN: u16 = u16::MAX;

/// Cosine of incidence of grazing pixels and of those without a normal.
const GRAZING: f32 = 0.05;
/// Error of a view that averaging its pixels does not remove, metres: a pixel without noise weighs 1.
pub(super) const SYSTEMATIC: f32 = 3e-5;
/// Deviation of a depth of which nothing is known.
const UNKNOWN_SIGMA: f32 = 1e-3;
/// What a flying pixel, or one that is dropped, weighs beside one on a surface: enough for a place, too little to move
/// one.
const FLYING: f32 = 1e-4;

/// What one view says of one voxel.
#[derive(Clone, Copy, Debug, Default)]
struct Fresh {
    local: u16,
    /// Whether any pixel lay on a surface rather than between two.
    solid: bool,
    /// Whether any pixel was not to be dropped for its uncertainty.
    certain: bool,
    /// Weighted sums of 1, offset (3), normal (3), colour (3), sigma and defect sigma: one array, so that it is added
    /// to in a few wide steps.
    sums: [f32; 12],
    instance: u16,
    instance_lead: f32,
}

/// Working memory of one thread.
#[derive(Debug)]
pub(super) struct Scratch {
    slots: Box<[u16; BRICK_VOXELS]>,
    fresh: Vec<Fresh>,
    /// Component classes, then defect classes, of each fresh voxel.
    evidence: Vec<f32>,
}

impl Default for Scratch {
    fn default() -> Self {
        Self { slots: Box::new([UNSEEN; BRICK_VOXELS]), fresh: Vec::new(), evidence: Vec::new() }
    }
}

/// The weights of one pixel.
#[derive(Clone, Copy, Debug)]
struct Weights {
    /// Of position, normal and colour: the inverse variance across the surface, up to a factor.
    geometry: f32,
    /// Of labels: cosine of incidence.
    label: f32,
}

/// What merging a brick did: voxels made and relabelled.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Change {
    pub(super) made: u32,
    pub(super) relabelled: u32,
}

/// Merges the pixels in `runs` into `brick`, whose address is `key`.
pub(super) fn merge_brick(
    config: &MapConfig,
    view: &LabelledView,
    placer: &Placer,
    scratch: &mut Scratch,
    (key, brick, runs): (BrickKey, &mut Brick, &[Run]),
) -> Change {
    scratch.gather(config, view, placer, runs);
    let classes = config.components + config.defects;
    let made = scratch.fresh.iter().filter(|f| !brick.holds(f.local)).count();
    brick.reserve(made, classes);
    // The first pixel of each run stands for the noise of all.
    for run in runs {
        let (i, (u, v)) = (run.start as usize, placer.column_and_row(run.start));
        let across = view.cloud.sigma[i] * cosine(placer.ray(u, v), view.cloud.normals[i]);
        if across.is_finite() {
            brick.note_variance(across * across);
        }
    }
    let mut change = Change { made: made as u32, relabelled: 0 };
    for (fresh, said) in scratch.fresh.iter().zip(scratch.evidence.chunks_exact(classes)) {
        let (voxel, evidence, is_new) = brick.entry(fresh.local, classes);
        // Geometry, colour and uncertainty: running weighted sums.
        let [weight, ox, oy, oz, nx, ny, nz, r, g, b, sigma, defect_sigma] = fresh.sums;
        voxel.weight += weight;
        for (sums, said) in
            [(&mut voxel.offset, [ox, oy, oz]), (&mut voxel.normal, [nx, ny, nz]), (&mut voxel.color, [r, g, b])]
        {
            for (sum, said) in sums.iter_mut().zip(said) {
                *sum += said;
            }
        }
        voxel.sigma += sigma;
        voxel.defect_sigma += defect_sigma;
        voxel.views = voxel.views.saturating_add(1);
        voxel.vote(fresh.instance, fresh.instance_lead);
        // Labels: Dirichlet evidence (P0 Eqs. 2 and 3), no more of one view than the cap.
        let (components, defects) = evidence.split_at_mut(config.components);
        let (said_components, said_defects) = said.split_at(config.components);
        add_capped(components, said_components, config.evidence_cap);
        add_capped(defects, said_defects, config.evidence_cap);
        let best = (best_share(components).0, best_share(defects).0);
        // Flags: a new voxel starts with what its first view says; later views can only clear it.
        if is_new {
            let mut flags = if fresh.solid { 0 } else { PointFlags::EDGE };
            flags |= if fresh.certain { 0 } else { PointFlags::UNCERTAIN };
            if let Some((low, high)) = config.volume {
                let p = voxel.position(key.voxel(fresh.local), config.voxel);
                let inside = (0..3).all(|a| f64::from(p[a]) >= low[a] && f64::from(p[a]) <= high[a]);
                flags |= if inside { 0 } else { PointFlags::BACKGROUND };
            }
            voxel.flags = PointFlags(flags);
        } else {
            change.relabelled += u32::from(best != (voxel.label, voxel.defect));
            let solved = if fresh.solid { PointFlags::EDGE } else { 0 };
            let settled = if fresh.certain { PointFlags::UNCERTAIN } else { 0 };
            voxel.flags = PointFlags(voxel.flags.0 & !(solved | settled));
        }
        (voxel.label, voxel.defect) = best;
    }
    scratch.clear();
    change
}

impl Scratch {
    /// Sums the pixels of `runs` by voxel.
    fn gather(&mut self, config: &MapConfig, view: &LabelledView, placer: &Placer, runs: &[Run]) {
        let classes = config.components + config.defects;
        let segmentation = &view.segmentation;
        let rule = &config.uncertainty;
        let drops = rule.uncertain == Uncertain::Drop;
        for run in runs {
            let (first, row) = placer.column_and_row(run.start);
            for step in 0..run.len {
                let i = (run.start + step) as usize;
                let z = view.cloud.smooth[i];
                if z <= 0.0 {
                    continue;
                }
                // Which voxel the pixel falls into, and where in it.
                let ray = placer.ray(first + step, row);
                let Some((voxel, offset)) = placer.place(ray, z) else { continue };
                let slot = self.slot(local_index(voxel), classes);
                // What it weighs there.
                let n = view.cloud.normals[i];
                let flying = view.cloud.flying[i];
                let weights = Weights::of(ray, n, view.cloud.sigma[i], flying);
                let (sigma, defect_sigma) = (segmentation.components.sigma(i), segmentation.defects.sigma(i));
                let dropped = drops && sigma > rule.threshold;
                let (w, label) =
                    if dropped { (FLYING * weights.geometry, 0.0) } else { (weights.geometry, weights.label) };
                // Geometry and colour, in one array of sums.
                let [nx, ny, nz] = placer.turned(n);
                let [ox, oy, oz] = offset;
                let rgb = view.rgb.as_raw().get(i * 3..i * 3 + 3).unwrap_or(&[0; 3]);
                let [r, g, b] = [rgb[0], rgb[1], rgb[2]].map(f32::from);
                let fresh = &mut self.fresh[slot];
                fresh.solid |= !flying;
                fresh.certain |= !dropped;
                let said = [1.0, ox, oy, oz, nx, ny, nz, r, g, b, sigma, defect_sigma];
                for (sum, said) in fresh.sums.iter_mut().zip(said) {
                    *sum += w * said;
                }
                let instance = segmentation.instances[i];
                // Pixels without an instance keep a voxel without one, and do not vote against any.
                if instance != 0 || fresh.instance == 0 {
                    majority_vote(&mut fresh.instance, &mut fresh.instance_lead, instance, label);
                }
                // Labels. Evidence fades out towards the threshold, where it ends.
                let certain = |sigma: f32, threshold: f32| label * (1.0 - (sigma / threshold).powi(2)).max(0.0);
                let evidence = &mut self.evidence[slot * classes..(slot + 1) * classes];
                let (components, defects) = evidence.split_at_mut(config.components);
                segmentation.components.add_evidence(i, certain(sigma, rule.threshold), components);
                segmentation.defects.add_evidence(i, certain(defect_sigma, rule.defect_threshold), defects);
            }
        }
    }

    /// Place of the voxel at `local` among the fresh ones.
    #[inline]
    fn slot(&mut self, local: u16, classes: usize) -> usize {
        let place = &mut self.slots[usize::from(local)];
        if *place == UNSEEN {
            *place = self.fresh.len() as u16;
            self.fresh.push(Fresh { local, ..Fresh::default() });
            self.evidence.resize(self.fresh.len() * classes, 0.0);
        }
        usize::from(*place)
    }

    fn clear(&mut self) {
        for fresh in &self.fresh {
            self.slots[usize::from(fresh.local)] = UNSEEN;
        }
        self.fresh.clear();
        self.evidence.clear();
    }
}

impl Weights {
    /// `sigma` is the deviation of the depth; across the surface it counts by the cosine of incidence.
    #[inline]
    fn of(ray: Ray, normal: [f32; 3], sigma: f32, flying: bool) -> Self {
        let cos = cosine(ray, normal);
        let across = sigma.min(UNKNOWN_SIGMA) * cos;
        let geometry = SYSTEMATIC * SYSTEMATIC / (across * across + SYSTEMATIC * SYSTEMATIC);
        if flying { Self { geometry: FLYING * geometry, label: FLYING } } else { Self { geometry, label: cos } }
    }
}

/// Cosine of incidence of a pixel on `ray` with the normal `normal`, camera frame.
#[inline]
fn cosine(ray: Ray, normal: [f32; 3]) -> f32 {
    let along = -(ray[0] * normal[0] + ray[1] * normal[1] + normal[2]);
    (along / (ray[0] * ray[0] + ray[1] * ray[1] + 1.0).sqrt()).max(GRAZING)
}

fn add_capped(evidence: &mut [f32], fresh: &[f32], cap: f32) {
    let total: f32 = fresh.iter().sum();
    let scale = if total > cap { cap / total } else { 1.0 };
    for (alpha, e) in evidence.iter_mut().zip(fresh) {
        *alpha += scale * e;
    }
}
