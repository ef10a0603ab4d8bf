//! Locally Coloured Convex Connected Patches: [Eye-in-hand 2020], section 3.1.2, Eqs. 1 to 3.
//!
//! `conv = CC_e and SC and PCC`, where the point colour criterion PCC asks that no channel of the supervoxels' mean
//! colours differs by gamma or more. So surfaces that touch tangentially part where their colours do. PCC is a conjunct
//! of its own: it does not take part in the count of CC_e. The paper leaves gamma open ("a small value").

use super::lccp::{LccpConfig, Segments, convex_edges, extended, join};
use super::vccs::{Patch, Supervoxels, VccsConfig};

/// The point colour criterion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColorCriterion {
    /// Largest difference of a channel, of 255.
    pub gamma: f32,
    /// Compares hue and saturation at equal brightness, so that shading and soft shadows do not part a surface; where a
    /// patch is too dark for that, or brightness itself jumps threefold, plain channels decide.
    pub illumination_robust: bool,
}

impl Default for ColorCriterion {
    fn default() -> Self {
        Self { gamma: 20.0, illumination_robust: false }
    }
}

/// Mean channel below which a patch has no dependable hue.
const DARK: f32 = 12.0;
/// Ratio of brightness up to which shading is the likelier cause.
const SHADING: f32 = 3.0;

impl ColorCriterion {
    /// PCC of two supervoxels.
    pub fn holds(&self, a: &Patch, b: &Patch) -> bool {
        let difference = |p: [f32; 3], q: [f32; 3]| (0..3).map(|k| (p[k] - q[k]).abs()).fold(0.0, f32::max);
        let brightness = |p: &Patch| p.color.iter().sum::<f32>() / 3.0;
        let (bright, dark) = (brightness(a).max(brightness(b)), brightness(a).min(brightness(b)));
        if !self.illumination_robust || dark < DARK || bright > SHADING * dark {
            return difference(a.color, b.color) < self.gamma;
        }
        let at = |p: &Patch| p.color.map(|c| c * bright / brightness(p));
        difference(at(a), at(b)) < self.gamma
    }
}

/// Segments of `supervoxels` by convexity and colour.
pub fn lcccp(supervoxels: &Supervoxels, vccs: &VccsConfig, config: &LccpConfig, color: &ColorCriterion) -> Segments {
    let mut valid = extended(supervoxels, &convex_edges(supervoxels, vccs, config), config.k);
    let patch = |i: u32| &supervoxels.patches[i as usize];
    for (valid, &[a, b]) in valid.iter_mut().zip(&supervoxels.edges) {
        *valid &= color.holds(patch(a), patch(b));
    }
    join(supervoxels, &valid, config.small)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn colored(color: [f32; 3]) -> Patch {
        Patch { normal: [0.0, 0.0, -1.0], color, voxels: 1, ..Patch::default() }
    }

    #[test]
    fn the_largest_channel_difference_decides() {
        let plain = ColorCriterion { gamma: 20.0, illumination_robust: false };
        let a = colored([100.0, 100.0, 100.0]);
        assert!(plain.holds(&a, &colored([119.0, 81.0, 100.0])));
        assert!(!plain.holds(&a, &colored([100.0, 100.0, 120.0])));
    }

    #[test]
    fn shading_does_not_part_a_surface_but_hue_does() {
        let robust = ColorCriterion { gamma: 20.0, illumination_robust: true };
        let lit = colored([160.0, 80.0, 40.0]);
        assert!(robust.holds(&lit, &colored([80.0, 40.0, 20.0])));
        assert!(!robust.holds(&lit, &colored([80.0, 80.0, 40.0])));
        assert!(!robust.holds(&lit, &colored([40.0, 20.0, 10.0])), "a fourfold jump is no shading");
        assert!(!ColorCriterion { illumination_robust: false, ..robust }.holds(&lit, &colored([80.0, 40.0, 20.0])));
    }

    #[test]
    fn a_flat_surface_of_two_colors_is_two_segments() {
        // Two rows of four: LCCP joins all, LCCCP parts them between the columns 1 and 2.
        let at = |i: usize| {
            let (x, y) = (i % 4, i / 4);
            let color = if x < 2 { [200.0, 20.0, 20.0] } else { [20.0, 20.0, 200.0] };
            Patch { position: [x as f32 * 0.03, y as f32 * 0.03, 0.5], ..colored(color) }
        };
        let mut edges = Vec::new();
        for a in 0..8_u32 {
            for b in a + 1..8 {
                if (a % 4).abs_diff(b % 4) <= 1 {
                    edges.push([a, b]);
                }
            }
        }
        let grown = Supervoxels { patches: (0..8).map(at).collect(), edges, of_point: Vec::new() };
        let (vccs, config) = (VccsConfig::new(0.0075), LccpConfig::default());
        assert_eq!(super::super::lccp::lccp(&grown, &vccs, &config).count, 1);
        let parted = lcccp(&grown, &vccs, &config, &ColorCriterion::default());
        assert_eq!(parted.of_patch, [0, 0, 1, 1, 0, 0, 1, 1]);
    }
}
