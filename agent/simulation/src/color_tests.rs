//! That colour and depth of a pixel alone do not give its component away.
//!
//! Networks are to learn shapes. A classifier that sees one pixel at a time (a histogram over colour and depth, which is
//! the best there is at its resolution) is trained on some motors and scored on others.

use super::training::TrainingOptions;
use super::{Randomisation, TrainingCell, VirtualCell, VirtualCellSpec};
use semascan_perception::view::View;

const CLASSES: usize = 6;
/// Steps of red, green, blue and depth: finer ones hold fewer pixels each.
const STEPS: [usize; 2] = [16, 6];

/// Counts of every class in every bin, from fine to coarse.
struct PixelClassifier([Vec<[f32; CLASSES]>; 2]);

/// Red, green, blue and depth, each 0 to 1.
type Features = [f32; 4];

fn bin(f: &Features, steps: usize) -> usize {
    f.iter().fold(0, |at, x| at * steps + ((x * steps as f32) as usize).min(steps - 1))
}

impl PixelClassifier {
    /// `balanced` counts every class as often as the others, so that small components are found too.
    fn train(pixels: &[(Features, usize)], balanced: bool) -> Self {
        let mut total = [0.0_f32; CLASSES];
        pixels.iter().for_each(|(_, c)| total[*c] += 1.0);
        Self(STEPS.map(|steps| {
            let mut bins = vec![[0.0; CLASSES]; steps.pow(4)];
            for (f, c) in pixels {
                bins[bin(f, steps)][*c] += if balanced { 1e4 / total[*c] } else { 1.0 };
            }
            bins
        }))
    }

    fn class(&self, f: &Features) -> usize {
        let filled = self.0.iter().zip(STEPS).map(|(bins, n)| &bins[bin(f, n)]).find(|b| b.iter().sum::<f32>() > 0.0);
        filled.map_or(0, |b| (0..CLASSES).max_by(|i, j| b[*i].total_cmp(&b[*j])).unwrap_or(0))
    }

    /// Mean intersection over union of the five components.
    fn mean_iou(&self, pixels: &[(Features, usize)]) -> f64 {
        let mut counts = [[0_u32; CLASSES]; CLASSES];
        pixels.iter().for_each(|(f, c)| counts[*c][self.class(f)] += 1);
        (1..CLASSES)
            .map(|c| {
                let truth: u32 = counts[c].iter().sum();
                let found: u32 = counts.iter().map(|row| row[c]).sum();
                f64::from(counts[c][c]) / f64::from((truth + found - counts[c][c]).max(1))
            })
            .sum::<f64>()
            / (CLASSES - 1) as f64
    }
}

fn pixels(view: &View) -> Vec<(Features, usize)> {
    let labels = view.labels.as_ref().expect("labels");
    let depth = view.depth.metres.iter().map(|z| ((z - 0.25) / 0.65).clamp(0.0, 0.999));
    let color = view.rgb.pixels().map(|p| p.0.map(|c| f32::from(c) / 256.0));
    let features = color.zip(depth).map(|([r, g, b], z)| [r, g, b, z]);
    features.zip(labels.components.iter().map(|c| usize::from(*c))).collect()
}

fn training(parts: std::ops::Range<u32>) -> Vec<(Features, usize)> {
    let options = TrainingOptions { size: (320, 240), window: (128, 160), cell: 3.0 };
    parts
        .flat_map(|part| {
            let cell = TrainingCell::new(12, part, options, Randomisation::TRAINING);
            (0..5).flat_map(|i| pixels(&cell.view(i))).collect::<Vec<_>>()
        })
        .collect()
}

fn standard(seeds: std::ops::Range<u32>) -> Vec<(Features, usize)> {
    seeds
        .flat_map(|seed| {
            let uri = format!("virtual:starter-motor?seed={seed}&views=4&size=160x120&cell=3");
            let cell = VirtualCell::open(&VirtualCellSpec::parse(&uri).expect("valid")).expect("a motor");
            (0..4).flat_map(|i| pixels(&cell.view(i).expect("four views"))).collect::<Vec<_>>()
        })
        .collect()
}

#[test]
fn a_pixel_alone_does_not_give_its_component_away() {
    for (world, known, unseen) in
        [("training", training(0..3), training(3..5)), ("standard", standard(1..4), standard(4..6))]
    {
        for balanced in [false, true] {
            let score = PixelClassifier::train(&known, balanced).mean_iou(&unseen);
            assert!(score < 0.6, "{world}, balanced {balanced}: mean IoU {score:.3}");
        }
        // The classifier itself is not to blame: where colour tells the class, it finds out.
        let labelled = |pixels: &[(Features, usize)]| -> Vec<(Features, usize)> {
            pixels.iter().map(|([_, g, b, z], c)| ([*c as f32 / 6.0 + 0.05, *g, *b, *z], *c)).collect()
        };
        let score = PixelClassifier::train(&labelled(&known), false).mean_iou(&labelled(&unseen));
        assert!(score > 0.9, "{world}: mean IoU {score:.3} with the answer in the red channel");
    }
}
