//! A simulated starter motor against its own truth.

use semascan_evaluation::judge;
use semascan_inspection::pipeline::PipelineConfig;
use semascan_inspection::record::Recorder;
use semascan_tests::served;
use semascan_tests::sources::open;

#[test]
fn labels_of_a_fused_motor_are_true() {
    let uri = "virtual:starter-motor?seed=7&views=12&errors=none";
    let mut source = open(uri).expect("opens");
    let map = served::run(source.as_mut(), &PipelineConfig::default(), &Recorder::default()).expect("inspects");
    let report = judge(&map.cloud(), source.truth().expect("the virtual cell knows the truth"));
    assert!(report.accuracy >= 0.98, "label accuracy {:.4}", report.accuracy);
    assert!(report.completeness >= 0.99, "completeness {:.4}", report.completeness);
    let surface = report.surface.expect("points");
    assert!(surface.mean < 0.5e-3, "mean error {:.2e} m", surface.mean);
}
