//! A simulated starter motor against its own truth.

use semascan_evaluation::judge;
use semascan_tests::inspect::inspect;
use semascan_tests::sources::open;

#[test]
fn labels_of_a_fused_motor_are_true() {
    let uri = "virtual:starter-motor?seed=7&views=12&errors=none";
    let inspected = inspect(open(uri).expect("opens")).expect("inspects");
    let report = judge(&inspected.cloud, inspected.source.truth().expect("the virtual cell knows the truth"));
    assert!(report.accuracy >= 0.98, "label accuracy {:.4}", report.accuracy);
    assert!(report.completeness >= 0.99, "completeness {:.4}", report.completeness);
    let surface = report.surface.expect("points");
    assert!(surface.mean < 0.5e-3, "mean error {:.2e} m", surface.mean);
}
