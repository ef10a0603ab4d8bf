//! Edges of masks, refined by the picture.
//!
//! The labels of a model are sharp to about a voxel, and a pose shifts them in the picture. Within that distance of an edge
//! the picture knows better: a pixel belongs to the side that looks like it. Each pixel of the rim asks its neighbourhood
//! (joint bilateral filter, [Petschnigg 2004]): a neighbour votes for its own label, the more the nearer it is,
//! the more alike its colour is, and the farther it lies from the edge, where its label is certain; a jump of depth between
//! the two leaves next to nothing of its vote. Where no label has a clear majority, the pixel stays open.
//!
//! Along silhouettes depth is missing or wrong, so the labels of the two sides often do not touch. Where gaps are to be closed,
//! pixels between them that are open are asked, too, up to a few from either side; they have no vote of their own.
//!
//! A region that is thinner than two rims, such as a crack, has no pixel that far from its edge; its middle is what is most certain
//! of it and counts in full.

use crate::IGNORE;
use image::RgbImage;
use rayon::prelude::*;
use semascan_perception::view::Intrinsics;

/// What becomes of the rim of a mask.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RimTreatment {
    /// It stays as the model has it.
    Keep,
    /// All of it is left open.
    Open,
    /// It is refined by the picture, and left open where that does not tell.
    Refine,
    /// The same, and gaps between two components are closed by the picture: less certain than the rest, but without them a network
    /// learns nothing along silhouettes.
    Close,
}

/// Least share of the votes that a label needs.
const MAJORITY: f32 = 0.75;
/// Least deviation of colours, in steps of 255, that still are alike.
const ALIKE: f32 = 8.0;
/// The same in units of the noise of the picture.
const ALIKE_IN_NOISE: f32 = 4.0;
/// What a jump of depth leaves of a vote.
const BEYOND_JUMP: f32 = 0.02;
/// Slope of a surface against the direction of view up to which neighbours lie on the same one, and metres of slack.
const SLOPE: f32 = 2.0;
const JUMP: f32 = 2e-3;
/// Pixels beyond the rim up to which what is open between two components is asked.
const GAP: usize = 3;
/// Weight of a neighbour that lies at the edge itself; one that lies a rim away counts 1.
const AT_EDGE: f32 = 0.05;

/// The picture that edges are refined by.
pub(crate) struct Guide<'a> {
    pub(crate) rgb: &'a RgbImage,
    /// Metres, row-major; 0 where nothing was measured.
    pub(crate) depth: &'a [f32],
    pub(crate) intrinsics: &'a Intrinsics,
}

/// `labels` of a picture, row-major, with the pixels at most `rim` away from an edge treated.
pub(crate) fn treat_rim(labels: &[u16], guide: &Guide<'_>, rim: usize, treatment: RimTreatment) -> Vec<u16> {
    if treatment == RimTreatment::Keep || labels.is_empty() {
        return labels.to_vec();
    }
    let (width, height) = (guide.intrinsics.width as usize, guide.intrinsics.height as usize);
    let reach = if treatment == RimTreatment::Close { rim + GAP } else { 0 };
    let steps = steps_to_edge(&bridged(labels, (width, height), reach), (width, height), rim.max(reach));
    let is_rim = |at: usize| steps[at] <= if labels[at] == IGNORE { reach } else { rim };
    if treatment == RimTreatment::Open {
        return (0..labels.len()).map(|at| if is_rim(at) { IGNORE } else { labels[at] }).collect();
    }
    let voting = Voting::new(labels, &steps, guide, rim);
    let label = |at: usize| match labels[at] {
        kept if !is_rim(at) => kept,
        IGNORE => voting.label(at, reach + 2),
        _ => voting.label(at, 2 * rim + 2),
    };
    (0..labels.len()).into_par_iter().map(label).collect()
}

/// `labels` spread up to `most` pixels into what is open: where two of them meet, an edge lies in the gap between.
fn bridged(labels: &[u16], (width, height): (usize, usize), most: usize) -> Vec<u16> {
    let mut spread = labels.to_vec();
    let mut front: Vec<usize> = (0..labels.len()).filter(|at| labels[*at] != IGNORE).collect();
    for _ in 0..most {
        let mut next = Vec::new();
        for at in front {
            for beside in neighbours(at, (width, height)) {
                if spread[beside] == IGNORE {
                    spread[beside] = spread[at];
                    next.push(beside);
                }
            }
        }
        front = next;
    }
    spread
}

/// Steps from each pixel to the nearest edge between two labels, 1 at the edge; more than `most` where it is farther. Where a
/// label borders on [`IGNORE`] there is no edge: nothing is known of the other side.
fn steps_to_edge(labels: &[u16], (width, height): (usize, usize), most: usize) -> Vec<usize> {
    let mut steps = vec![most + 1; labels.len()];
    let mut front: Vec<usize> = Vec::new();
    let mut note = |at: usize| {
        if steps[at] > 1 {
            steps[at] = 1;
            front.push(at);
        }
    };
    let differ = |a: usize, b: usize| labels[a] != labels[b] && labels[a] != IGNORE && labels[b] != IGNORE;
    for at in 0..labels.len() {
        for next in [(at % width + 1 < width).then_some(at + 1), (at / width + 1 < height).then_some(at + width)] {
            if let Some(next) = next.filter(|next| differ(at, *next)) {
                note(at);
                note(next);
            }
        }
    }
    for step in 2..=most {
        let mut next = Vec::new();
        for at in front {
            for beside in neighbours(at, (width, height)) {
                if steps[beside] > step {
                    steps[beside] = step;
                    next.push(beside);
                }
            }
        }
        front = next;
    }
    steps
}

/// The pixels to the left, right, above and below.
fn neighbours(at: usize, (width, height): (usize, usize)) -> impl Iterator<Item = usize> {
    let (u, v) = (at % width, at / width);
    let list = [
        (u > 0).then(|| at - 1),
        (u + 1 < width).then_some(at + 1),
        (v > 0).then(|| at - width),
        (v + 1 < height).then_some(at + width),
    ];
    list.into_iter().flatten()
}

/// The votes of neighbourhoods.
struct Voting<'a> {
    labels: &'a [u16],
    /// How certain the label of each pixel is, 0 to 1.
    certainty: Vec<f32>,
    guide: &'a Guide<'a>,
    /// Weight by squared distance of colours, in steps of the table.
    by_color: Vec<f32>,
    color_step: f32,
}

impl<'a> Voting<'a> {
    fn new(labels: &'a [u16], steps: &[usize], guide: &'a Guide<'a>, rim: usize) -> Self {
        const STEPS: usize = 512;
        let alike = ALIKE.max(ALIKE_IN_NOISE * noise(guide.rgb));
        // Beyond four deviations nothing is left of a vote.
        let color_step = 16.0 * alike * alike / STEPS as f32;
        let by_color = (0..STEPS).map(|k| (-0.5 * k as f32 * color_step / (alike * alike)).exp()).collect();
        let size = (guide.intrinsics.width as usize, guide.intrinsics.height as usize);
        let certainty = certainty(labels, steps, size, rim);
        Self { labels, certainty, guide, by_color, color_step }
    }

    /// The label that the neighbourhood of a pixel, `reach` pixels to either side, votes for; [`IGNORE`] without a majority.
    fn label(&self, at: usize, reach: usize) -> u16 {
        let (width, height) = (self.guide.intrinsics.width as usize, self.guide.intrinsics.height as usize);
        let (u, v) = (at % width, at / width);
        let pixels = self.guide.rgb.as_raw();
        let color = |at: usize| [0, 1, 2].map(|k| f32::from(pixels[3 * at + k]));
        let (own, depth) = (color(at), self.guide.depth[at]);
        let footprint = self.guide.intrinsics.footprint(f64::from(depth)) as f32;
        let deviation = 0.5 * reach as f32;
        let mut votes: Vec<(u16, f32)> = Vec::with_capacity(4);
        for y in v.saturating_sub(reach)..(v + reach + 1).min(height) {
            for x in u.saturating_sub(reach)..(u + reach + 1).min(width) {
                let other = y * width + x;
                let label = self.labels[other];
                if label == IGNORE {
                    continue;
                }
                let difference = color(other).iter().zip(own).map(|(a, b)| (a - b) * (a - b)).sum::<f32>();
                let Some(by_color) = self.by_color.get((difference / self.color_step) as usize) else { continue };
                let squared = (x.abs_diff(u).pow(2) + y.abs_diff(v).pow(2)) as f32;
                let by_distance = (-0.5 * squared / (deviation * deviation)).exp();
                let by_certainty = AT_EDGE + (1.0 - AT_EDGE) * self.certainty[other].powi(2);
                let by_depth = match self.guide.depth[other] {
                    there if there > 0.0 && depth > 0.0 => {
                        let jump = JUMP + SLOPE * footprint * squared.sqrt();
                        if (there - depth).abs() > jump { BEYOND_JUMP } else { 1.0 }
                    }
                    _ => 1.0,
                };
                let vote = by_color * by_distance * by_certainty * by_depth;
                match votes.iter_mut().find(|(known, _)| *known == label) {
                    Some((_, sum)) => *sum += vote,
                    None => votes.push((label, vote)),
                }
            }
        }
        let all: f32 = votes.iter().map(|(_, vote)| vote).sum();
        let best = votes.iter().fold((IGNORE, 0.0), |best, one| if one.1 > best.1 { *one } else { best });
        if best.1 >= MAJORITY * all { best.0 } else { IGNORE }
    }
}

/// How far each pixel lies from an edge as a share of the rim, or of the half width of its region where that is thinner.
fn certainty(labels: &[u16], steps: &[usize], size: (usize, usize), rim: usize) -> Vec<f32> {
    let mut certainty = vec![0.0; labels.len()];
    let mut is_seen = vec![false; labels.len()];
    for first in 0..labels.len() {
        if is_seen[first] {
            continue;
        }
        is_seen[first] = true;
        let mut region = vec![first];
        let mut next = 0;
        while let Some(&at) = region.get(next) {
            next += 1;
            for beside in neighbours(at, size) {
                if !is_seen[beside] && labels[beside] == labels[at] {
                    is_seen[beside] = true;
                    region.push(beside);
                }
            }
        }
        let deepest = region.iter().map(|at| steps[*at]).max().unwrap_or(1).saturating_sub(1).min(rim);
        for at in region {
            certainty[at] = if deepest == 0 { 1.0 } else { ((steps[at] - 1) as f32 / deepest as f32).min(1.0) };
        }
    }
    certainty
}

/// Standard deviation of a channel by noise, steps of 255: from the median difference of pixels beside each other, which most
/// often show the same surface.
fn noise(rgb: &RgbImage) -> f32 {
    let mut counts = [0_u64; 256];
    let width = rgb.width() as usize;
    for row in rgb.as_raw().chunks_exact(3 * width.max(1)) {
        for (a, b) in row.iter().zip(row.iter().skip(3)) {
            counts[usize::from(a.abs_diff(*b))] += 1;
        }
    }
    let all: u64 = counts.iter().sum();
    let mut below = 0;
    let median = counts.iter().position(|count| {
        below += count;
        2 * below >= all
    });
    // The median of the absolute value of a normal deviate is 0.674 deviations, and a difference has two.
    median.unwrap_or(0) as f32 / (0.674 * std::f32::consts::SQRT_2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;

    const SIZE: usize = 40;
    const CAMERA: Intrinsics = Intrinsics { width: 40, height: 40, fx: 600.0, fy: 600.0, cx: 20.0, cy: 20.0 };

    /// A picture whose left part, `edge` columns wide, is of the first colour; with some noise.
    fn picture(edge: usize, colors: [[u8; 3]; 2]) -> RgbImage {
        RgbImage::from_fn(SIZE as u32, SIZE as u32, |u, v| {
            let noise = ((u * 7 + v * 13) % 5) as u8;
            Rgb(colors[usize::from(u as usize >= edge)].map(|c| c + noise))
        })
    }

    fn labels(edge: usize) -> Vec<u16> {
        (0..SIZE * SIZE).map(|at| 1 + u16::from(at % SIZE >= edge)).collect()
    }

    fn treated(shown: &RgbImage, depth: &[f32], treatment: RimTreatment) -> Vec<u16> {
        treat_rim(&labels(18), &Guide { rgb: shown, depth, intrinsics: &CAMERA }, 3, treatment)
    }

    /// Whether the edge moved from column 18 to 20: no pixel is wrong, and one column at most is left open.
    fn check_moved(refined: &[u16]) {
        let wrong = (0..refined.len()).find(|at| refined[*at] != IGNORE && refined[*at] != labels(20)[*at]);
        assert_eq!(wrong.map(|at| (at % SIZE, at / SIZE)), None);
        let open = refined.iter().filter(|label| **label == IGNORE).count();
        assert!(open <= SIZE, "{open} pixels are open");
    }

    #[test]
    fn an_edge_moves_to_where_the_colours_change() {
        let shown = picture(20, [[60, 60, 60], [150, 90, 60]]);
        let depth = vec![0.3; SIZE * SIZE];
        let refined = treated(&shown, &depth, RimTreatment::Refine);
        check_moved(&refined);
        assert_eq!(treated(&shown, &depth, RimTreatment::Keep), labels(18));
        let open = treated(&shown, &depth, RimTreatment::Open);
        let expected = |at: usize| if (15..21).contains(&(at % SIZE)) { IGNORE } else { labels(18)[at] };
        assert_eq!(open, (0..SIZE * SIZE).map(expected).collect::<Vec<_>>());
    }

    #[test]
    fn an_edge_that_the_picture_does_not_show_stays_open() {
        let shown = picture(20, [[90, 90, 90]; 2]);
        let refined = treated(&shown, &vec![0.3; SIZE * SIZE], RimTreatment::Refine);
        for (at, (label, before)) in refined.iter().zip(labels(18)).enumerate() {
            let column = at % SIZE;
            if (17..19).contains(&column) {
                assert_eq!(*label, IGNORE, "{column}");
            } else {
                assert!(*label == before || *label == IGNORE && (15..21).contains(&column), "{column}");
            }
        }
    }

    #[test]
    fn an_edge_moves_to_where_the_depth_jumps() {
        let shown = picture(20, [[90, 90, 90]; 2]);
        let depth: Vec<f32> = (0..SIZE * SIZE).map(|at| if at % SIZE < 20 { 0.3 } else { 0.34 }).collect();
        check_moved(&treated(&shown, &depth, RimTreatment::Refine));
    }

    #[test]
    fn a_thin_line_that_the_picture_shows_stays_and_one_that_it_does_not_show_is_open() {
        let on_line = |at: usize| (18..20).contains(&(at % SIZE));
        let labels: Vec<u16> = (0..SIZE * SIZE).map(|at| if on_line(at) { 2 } else { 1 }).collect();
        let depth = vec![0.3; SIZE * SIZE];
        let refined = |line: [u8; 3]| {
            let shown = RgbImage::from_fn(SIZE as u32, SIZE as u32, |u, v| {
                let noise = ((u * 7 + v * 13) % 5) as u8;
                Rgb((if on_line(u as usize) { line } else { [120; 3] }).map(|c| c + noise))
            });
            treat_rim(&labels, &Guide { rgb: &shown, depth: &depth, intrinsics: &CAMERA }, 3, RimTreatment::Refine)
        };
        assert_eq!(refined([20; 3]), labels);
        let lost = refined([120; 3]);
        assert!((0..lost.len()).all(|at| lost[at] == labels[at] || lost[at] == IGNORE));
        assert!((0..lost.len()).filter(|at| on_line(*at)).all(|at| lost[at] == IGNORE));
    }

    #[test]
    fn what_borders_on_the_unknown_is_no_edge_and_the_unknown_stays() {
        let mut known = labels(18);
        known.iter_mut().for_each(|label| *label = if *label == 2 { IGNORE } else { 1 });
        let shown = picture(20, [[60; 3], [150; 3]]);
        let depth = vec![0.3; SIZE * SIZE];
        let guide = Guide { rgb: &shown, depth: &depth, intrinsics: &CAMERA };
        for treatment in [RimTreatment::Open, RimTreatment::Refine, RimTreatment::Close] {
            assert_eq!(treat_rim(&known, &guide, 3, treatment), known);
        }
    }

    #[test]
    fn a_gap_between_two_labels_is_closed_where_the_picture_tells_and_no_wider_one() {
        let shown = picture(20, [[60, 60, 60], [150, 90, 60]]);
        let depth = vec![0.3; SIZE * SIZE];
        let guide = Guide { rgb: &shown, depth: &depth, intrinsics: &CAMERA };
        let closed = |gap: std::ops::Range<usize>| {
            let mut known = labels(20);
            (0..known.len()).filter(|at| gap.contains(&(at % SIZE))).for_each(|at| known[at] = IGNORE);
            treat_rim(&known, &guide, 3, RimTreatment::Close)
        };
        check_moved(&closed(18..23));
        assert!((0..SIZE).all(|row| closed(10..30)[row * SIZE + 20] == IGNORE));
    }

    #[test]
    fn noise_is_told_from_pixels_beside_each_other() {
        let mut state = 1_u32;
        let mut uniform = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1 << 24)
        };
        // The sum of twelve uniform deviates is nearly normal with variance 1.
        let mut normal = || (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
        let noisy = RgbImage::from_fn(200, 200, |_, _| Rgb([0; 3].map(|_: u8| (120.0 + 5.0 * normal()).round() as u8)));
        assert!((noise(&noisy) - 5.0).abs() < 0.6, "{}", noise(&noisy));
    }
}
