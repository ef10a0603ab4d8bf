//! Masks fitted to the geometry of a motor.

use semascan_inspection::source::Source;
use semascan_perception::segment::geometric::PatchMethod;
use semascan_perception::segment::{
    Degradation, Degraded, GeometricSegmenter, RecordedSegmenter, Segmentation, Segmenter,
};
use semascan_simulation::{VirtualCell, VirtualCellSpec};

/// Mean IoU over the component classes of a view.
fn iou(segmentation: &Segmentation, truth: &[u16]) -> f64 {
    let score = |class: u16| {
        let (mut both, mut either) = (0_u32, 0_u32);
        for (i, &t) in truth.iter().enumerate() {
            let given = segmentation.components.best(i);
            both += u32::from(t == class && given == class);
            either += u32::from(t == class || given == class);
        }
        f64::from(both) / f64::from(either)
    };
    let classes: Vec<u16> = (1..6).filter(|c| truth.contains(c)).collect();
    classes.iter().map(|&c| score(c)).sum::<f64>() / classes.len() as f64
}

#[test]
fn spoiled_masks_of_a_motor_get_better() {
    let spec = VirtualCellSpec::parse("virtual:starter-motor?seed=7&views=3&cell=2.5").expect("a valid URI");
    let mut cell = VirtualCell::open(&spec).expect("needs no file");
    let inner = Degraded { inner: RecordedSegmenter, degradation: Degradation::network(6, 1) };
    let (mut spoiled, mut by) = (inner.clone(), [0.0; 3]);
    let mut lcccp = GeometricSegmenter::new(inner.clone(), PatchMethod::LCCCP);
    let mut slic = GeometricSegmenter::new(inner, PatchMethod::SLIC);
    while let Some(view) = cell.next_view() {
        let view = view.expect("renders");
        let truth = &view.labels.as_ref().expect("truth").components;
        by[0] += iou(&spoiled.segment(&view).expect("segments"), truth) / 3.0;
        by[1] += iou(&lcccp.segment(&view).expect("segments"), truth) / 3.0;
        by[2] += iou(&slic.segment(&view).expect("segments"), truth) / 3.0;
    }
    assert!(by[1] > by[0] + 0.03 && by[2] > by[0] + 0.03, "masks {:.3}, LCCCP {:.3}, SLIC {:.3}", by[0], by[1], by[2]);
}
