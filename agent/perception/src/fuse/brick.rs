//! A brick: 8^3 voxels, of which the few that a surface passes through are stored.

use super::keys::BRICK_VOXELS;
use semascan_geometry::vector::unit;
use semascan_geometry::vote::{largest, majority_vote};
use semascan_model::{PointFlags, SemanticPoint};

const EMPTY: u16 = u16::MAX;

/// Sums over everything that fell into one voxel: a cache line. Offsets are in voxel edges from the voxel's lowest
/// corner.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Voxel {
    pub(super) weight: f32,
    pub(super) offset: [f32; 3],
    pub(super) normal: [f32; 3],
    pub(super) color: [f32; 3],
    pub(super) sigma: f32,
    pub(super) defect_sigma: f32,
    /// Lead of `instance` over all others ([`majority_vote`]): one counter in place of a histogram.
    pub(super) instance_lead: f32,
    pub(super) instance: u16,
    pub(super) views: u16,
    pub(super) flags: PointFlags,
    /// Index in the brick.
    pub(super) local: u16,
    /// Best component class of the evidence.
    pub(super) label: u16,
    /// Best defect class.
    pub(super) defect: u16,
}

/// Voxels of a brick and their class histograms.
#[derive(Clone, Debug)]
pub(super) struct Brick {
    pub(super) slots: Box<[u16; BRICK_VOXELS]>,
    pub(super) voxels: Vec<Voxel>,
    /// Dirichlet evidence: `classes` values a voxel, component classes first, then defect classes.
    evidence: Vec<f32>,
    /// Sum of variances of depth across the surface, square metres, and their number.
    variances: (f32, f32),
}

impl Default for Brick {
    fn default() -> Self {
        Self { slots: Box::new([EMPTY; BRICK_VOXELS]), voxels: Vec::new(), evidence: Vec::new(), variances: (0.0, 0.0) }
    }
}

impl Brick {
    /// Makes room for `more` voxels.
    pub(super) fn reserve(&mut self, more: usize, classes: usize) {
        // A few at a time: a model of millions of voxels must not pay for twice its size.
        if self.voxels.capacity() - self.voxels.len() < more {
            let room = more.max(self.voxels.len() / 8);
            self.voxels.reserve_exact(room);
            self.evidence.reserve_exact(room * classes);
        }
    }

    /// The voxel at `local` with its evidence, made if it is not there; true if it was made.
    pub(super) fn entry(&mut self, local: u16, classes: usize) -> (&mut Voxel, &mut [f32], bool) {
        let place = &mut self.slots[usize::from(local)];
        let made = *place == EMPTY;
        if made {
            *place = self.voxels.len() as u16;
            self.voxels.push(Voxel { local, ..Voxel::default() });
            self.evidence.resize(self.voxels.len() * classes, 0.0);
        }
        let slot = usize::from(*place);
        (&mut self.voxels[slot], &mut self.evidence[slot * classes..(slot + 1) * classes], made)
    }

    /// Notes a variance of depth across the surface, square metres.
    pub(super) fn note_variance(&mut self, variance: f32) {
        self.variances = (self.variances.0 + variance, self.variances.1 + 1.0);
    }

    /// Standard deviation of depth across the surfaces in the brick, metres; 0 where nothing is known of it.
    pub(super) fn noise(&self) -> f32 {
        let (sum, count) = self.variances;
        (sum / count.max(1.0)).sqrt()
    }

    /// The voxel at `local`, if it is occupied.
    #[cfg(test)]
    pub(super) fn voxel(&self, local: u16) -> Option<&Voxel> {
        self.voxels.get(usize::from(self.slots[usize::from(local)]))
    }

    /// Whether the voxel at `local` is occupied.
    pub(super) fn holds(&self, local: u16) -> bool {
        self.slots[usize::from(local)] != EMPTY
    }

    /// Evidence of the voxel in `slot`.
    pub(super) fn evidence(&self, slot: usize, classes: usize) -> &[f32] {
        &self.evidence[slot * classes..(slot + 1) * classes]
    }

    /// Occupied voxels in address order: (local index, slot).
    pub(super) fn occupied(&self) -> impl Iterator<Item = (u16, usize)> + '_ {
        (0..).zip(self.slots.iter()).filter_map(|(local, &slot)| (slot != EMPTY).then_some((local, usize::from(slot))))
    }
}

impl Voxel {
    /// Mean position in metres; `lowest` is the voxel's address, `edge` its size in metres.
    pub(super) fn position(&self, lowest: [i32; 3], edge: f64) -> [f32; 3] {
        std::array::from_fn(|i| {
            // The mean of points in the voxel is in the voxel; rounding must not push it into the next one.
            let offset = f64::from(self.offset[i] / self.weight).clamp(0.0, 0.999_999);
            ((f64::from(lowest[i]) + offset) * edge) as f32
        })
    }

    /// Mean normal; zero where unknown.
    pub(super) fn unit_normal(&self) -> [f32; 3] {
        unit(self.normal, 1e-6).unwrap_or_default()
    }

    /// Casts a vote for `instance`; 0 is no instance and no vote.
    pub(super) fn vote(&mut self, instance: u16, weight: f32) {
        if instance != 0 && weight > 0.0 {
            majority_vote(&mut self.instance, &mut self.instance_lead, instance, weight);
        }
    }

    /// Adds the sums of another voxel of the same place; `views` is the number of all views.
    pub(super) fn absorb(&mut self, other: &Self, views: u16) {
        // Flags that a better observation clears; outlier flags are found anew.
        let first = self.weight == 0.0;
        self.flags = if first { other.flags } else { PointFlags(self.flags.0 & other.flags.0) };
        self.local = other.local;
        self.weight += other.weight;
        for (sums, others) in
            [(&mut self.offset, other.offset), (&mut self.normal, other.normal), (&mut self.color, other.color)]
        {
            for (sum, other) in sums.iter_mut().zip(others) {
                *sum += other;
            }
        }
        self.sigma += other.sigma;
        self.defect_sigma += other.defect_sigma;
        // A view falls into one layer of a noisy surface, seldom into more.
        self.views = self.views.saturating_add(other.views).min(views.max(other.views));
        self.vote(other.instance, other.instance_lead);
    }

    /// Takes the best classes of the evidence.
    pub(super) fn decide(&mut self, components: &[f32], defects: &[f32]) {
        (self.label, self.defect) = (best_share(components).0, best_share(defects).0);
    }

    /// The voxel as a point, its labels the best classes of `evidence`.
    pub(super) fn point(&self, lowest: [i32; 3], edge: f64, evidence: &[f32], components: usize) -> SemanticPoint {
        let (label, confidence) = best_share(&evidence[..components]);
        let (defect, defect_confidence) = best_share(&evidence[components..]);
        let unlabelled = if confidence > 0.0 { 0 } else { PointFlags::UNLABELLED };
        SemanticPoint {
            position: self.position(lowest, edge),
            normal: self.unit_normal(),
            color: self.color.map(|c| (c / self.weight).round().clamp(0.0, 255.0) as u8),
            label,
            confidence,
            defect,
            defect_confidence,
            sigma: self.sigma / self.weight,
            defect_sigma: self.defect_sigma / self.weight,
            instance: self.instance,
            views: self.views,
            flags: PointFlags(self.flags.0 | unlabelled),
        }
    }
}

/// Best class and its share of the evidence; (0, 0) without any.
pub(super) fn best_share(evidence: &[f32]) -> (u16, f32) {
    let total: f32 = evidence.iter().sum();
    if total <= 0.0 {
        return (0, 0.0);
    }
    let best = largest(evidence, f32::MIN);
    (best as u16, evidence[best] / total)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn evidence_stays_with_its_voxel() {
        let mut brick = Brick::default();
        for (i, local) in [5_u16, 500, 0].into_iter().enumerate() {
            let (_, evidence, made) = brick.entry(local, 4);
            assert!(made);
            evidence[i] = 1.0;
        }
        let order: Vec<_> = brick.occupied().collect();
        assert_eq!(order, [(0, 2), (5, 0), (500, 1)]);
        assert_eq!(brick.evidence(1, 4), [0.0, 1.0, 0.0, 0.0]);
        assert!(!brick.entry(5, 4).2);
    }

    #[test]
    fn the_majority_has_the_instance_and_pixels_without_one_do_not_vote() {
        let mut voxel = Voxel::default();
        for (instance, weight) in [(1, 1.0), (2, 0.7), (0, 9.0), (2, 0.8), (0, 9.0), (2, 0.6)] {
            voxel.vote(instance, weight);
        }
        assert_eq!(voxel.instance, 2);
    }

    #[test]
    fn share_of_the_best_class() {
        assert_eq!(best_share(&[1.0, 3.0, 0.0]), (1, 0.75));
        assert_eq!(best_share(&[0.0, 0.0]), (0, 0.0));
    }
}
