//! What it costs in accuracy, and gains in time, that networks look at the part alone: labels of single recorded views by where
//! networks look, against the recorded ones. The views are those of `semascan synth --size 640x480 --window 640x480`, from
//! motors that no network was trained on, with the installed networks asked as in an inspection.

#![allow(clippy::print_stdout)] // A benchmark prints its figures.

use semascan_evaluation::tables::teach;
use semascan_evaluation::{RiskCoverage, Shelf, labelling, test_source};
use semascan_perception::segment::Segmenter;
use semascan_perception::segment::network::{NetworkConfig, Region};
use semascan_simulation::{Randomisation, TrainingCell, TrainingOptions};
use std::error::Error;
use std::ops::Range;
use std::time::{Duration, Instant};

/// Neither networks nor their thresholds were made with any of these.
const MOTORS: Range<u64> = teach::FIRST_MOTOR..teach::FIRST_MOTOR + 10;
const VIEWS: u32 = 4;
const SIZE: (u32, u32) = (640, 480);

/// One way to look.
struct Row<N> {
    region: Region,
    network: N,
    components: RiskCoverage,
    time: Duration,
    pixels: u64,
}

fn main() -> Result<(), Box<dyn Error>> {
    let shelf = Shelf::open(None)?;
    let source = test_source();
    let folders = labelling(&shelf.chosen(&source.taxonomy)?);
    let row = |region| -> Result<_, Box<dyn Error>> {
        let network = shelf.segmenter(&folders, &source, &NetworkConfig { region, ..NetworkConfig::default() })?;
        let components = RiskCoverage::new(source.taxonomy.component_count());
        Ok(Row { region, network, components, time: Duration::ZERO, pixels: 0 })
    };
    let mut rows = [row(Region::Volume)?, row(Region::Whole)?];

    let options = TrainingOptions { size: SIZE, window: SIZE, cell: 1.0 };
    for seed in MOTORS {
        let cell = TrainingCell::new(seed, 0, options, Randomisation::TRAINING);
        for view in (0..VIEWS).map(|index| cell.view(index)) {
            let labels = view.labels.as_ref().ok_or("a view without labels")?;
            for Row { network, components, time, pixels, .. } in &mut rows {
                let begun = Instant::now();
                let said = network.segment(&view)?;
                *time += begun.elapsed();
                *pixels += said.network.and_then(|detail| detail.window).map_or(0, |window| window.pixels() as u64);
                components.add(&said.components, &labels.components);
            }
        }
    }

    let views = MOTORS.count() as u32 * VIEWS;
    println!("{views} recorded views of {}x{}, volume not known", SIZE.0, SIZE.1);
    println!("{:<40} {:>9} {:>9} {:>12}", "networks look at", "mean IoU", "s a view", "pixels");
    for Row { region, components, time, pixels, .. } in rows {
        let name = match region {
            Region::Volume => "what a glance takes for the part",
            Region::Whole => "the whole picture",
        };
        let mean_iou = components.unfiltered().mean_iou;
        let (seconds, pixels) = (time.as_secs_f64() / f64::from(views), pixels / u64::from(views));
        println!("{name:<40} {mean_iou:>9.4} {seconds:>9.2} {pixels:>12}");
    }
    Ok(())
}
