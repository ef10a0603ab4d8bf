//! Pictures freed of their background by the measuring volume.

use semascan_inspection::source::Source;
use semascan_perception::segment::preparation::{Background, Preparation, Prepared};
use semascan_perception::segment::{ClassField, RecordedSegmenter, SegmentError, Segmentation, Segmenter};
use semascan_perception::view::View;
use semascan_simulation::{VirtualCell, VirtualCellSpec};

/// A view of a motor with soft labels that call everything class 1.
struct AllOne;

impl Segmenter for AllOne {
    fn segment(&mut self, view: &View) -> Result<Segmentation, SegmentError> {
        let n = view.depth.metres.len();
        let probabilities = [0, 255].repeat(n);
        let soft = ClassField::Soft { classes: 2, probabilities, sigma: vec![90; n], model_sigma: Vec::new() };
        Ok(Segmentation { components: soft.clone(), defects: soft, instances: vec![4; n], network: None })
    }
}

#[test]
fn outside_the_volume_nothing_is_labelled_and_inside_nothing_changes() {
    let uri = "virtual:starter-motor?seed=5&views=1&size=160x120&errors=none&noise=none&cell=2.5";
    let cell = VirtualCell::open(&VirtualCellSpec::parse(uri).expect("valid")).expect("opens");
    let view = cell.view(0).expect("a view");
    let (low, high) = cell.info().volume.expect("a volume");
    let preparation = Preparation { denoise: false, background: Background::Volume(low, high) };
    let said = Prepared::new(AllOne, preparation).segment(&view).expect("labels");
    let truth = RecordedSegmenter.segment(&view).expect("truth");
    let pose = view.truth.as_ref().expect("truth").table_from_camera;
    let (mut part, mut kept, mut below) = (0, 0, 0);
    for i in 0..view.depth.metres.len() {
        let labelled = said.components.best(i) == 1;
        assert_eq!(said.components.sigma(i) > 0.0, labelled, "pixel {i}");
        assert_eq!(said.instances[i], if labelled { 4 } else { 0 });
        let z = f64::from(view.depth.metres[i]);
        if z <= 0.0 {
            continue;
        }
        if truth.components.best(i) != 0 {
            part += 1;
            kept += u32::from(labelled);
        }
        let p = pose * view.intrinsics.unproject((i % 160) as f64, (i / 160) as f64, z);
        if p.z < 0.001 {
            below += 1;
            assert!(!labelled, "pixel {i} shows the table");
        }
    }
    assert!(below > 1000, "{below} pixels of the table");
    // The volume begins two millimetres above the chuck.
    assert!(part > 500 && kept * 100 >= part * 97, "{kept} of {part}");
}
