//! Views that a model was not made for: their labels are as uncertain as can be.

use super::*;
use crate::segment::network::domain::{Domain, numbers_of};
use crate::segment::network::picture_statistics::STATISTICS;

/// A picture of the right world: coloured squares under independent noise in each channel. `light` and `seed` vary it.
fn known(light: u32, seed: u32) -> View {
    view(96, 96, |u, v| {
        let noise = |c: u32| {
            let keys = [(u, 73_856_093_u32), (v, 19_349_663), (c + 1, 83_492_791), (seed, 2_654_435_761)];
            let mut h = keys.iter().fold(0, |h, (value, factor)| h ^ value.wrapping_mul(*factor));
            h = (h ^ (h >> 13)).wrapping_mul(0x5bd1_e995);
            (h ^ (h >> 15)) % (6 + seed % 5)
        };
        let square = (u / (8 + seed % 7) + v / (9 + seed % 4)) % 3;
        [40 + light + 40 * square + noise(0), 60 + light + noise(1), 30 + light + (10 + seed % 6) * square + noise(2)]
            .map(|c| c.min(255) as u8)
    })
}

fn calibration() -> Domain {
    let numbers = |set: u32| -> Vec<[f64; STATISTICS]> {
        (0..60).map(|i| numbers_of(&known((i * 7 + set) % 50, 2 * i + set), None, 0).expect("large enough")).collect()
    };
    Domain::calibrated(&[("a".into(), numbers(0)), ("b".into(), numbers(1))], &[]).expect("enough views")
}

#[test]
fn a_view_of_the_right_world_keeps_its_labels_and_one_from_elsewhere_does_not() {
    let folder = model("semantic", &NAMES, &[classifier(2.0)], |m| m.domain = Some(calibration()));
    let plain = model("semantic", &NAMES, &[classifier(2.0)], |_| {});
    // A smooth photograph: no noise, one slow slope.
    let elsewhere = view(96, 96, |u, v| [200 - u as u8, 90 + (v / 2) as u8, 120]);
    for mut segmenter in segmenters(&[&folder], None, &asked(&[Augmentation::Identity])) {
        let said = segmenter.segment(&known(20, 13)).expect("runs");
        let verdict = said.network.expect("networks").domain.expect("calibrated");
        assert!(!verdict.outside && verdict.score < verdict.threshold, "{verdict:?}");
        assert!(soft(&said.components).2.iter().all(|sigma| *sigma == 0), "one network asked once");

        let said = segmenter.segment(&elsewhere).expect("runs");
        let detail = said.network.expect("networks");
        let verdict = detail.domain.expect("calibrated");
        assert!(verdict.outside && verdict.score > verdict.threshold, "{verdict:?}");
        let (_, probabilities, sigma) = soft(&said.components);
        assert!(sigma.iter().all(|sigma| *sigma == u8::MAX), "no label counts");
        assert!(probabilities.iter().any(|p| *p > 200), "what was said can still be seen");
        assert_eq!(detail.components.uncertain, detail.components.foreground);
    }
    // Prepared pictures cannot be compared, and a model without a calibration does not judge.
    let prepared = NetworkConfig { judge_domain: false, ..asked(&[Augmentation::Identity]) };
    let unjudged = segmenters(&[&folder], None, &prepared);
    let uncalibrated = segmenters(&[&plain], None, &asked(&[Augmentation::Identity]));
    for mut segmenter in unjudged.into_iter().chain(uncalibrated) {
        let said = segmenter.segment(&elsewhere).expect("runs");
        assert_eq!(said.network.as_ref().and_then(|detail| detail.domain), None);
        assert!(soft(&said.components).2.iter().all(|sigma| *sigma == 0));
    }
}

#[test]
fn an_ensemble_that_disagrees_about_a_familiar_picture_does_not_know_it() {
    // The first member labels everything, the second hardly anything.
    let apart = [classifier(-2.0), classifier(4.0)];
    let domain = calibration().with_disagreement(vec![0.02; 99]).expect("enough views");
    let folder = model("semantic", &NAMES, &apart, |m| m.domain = Some(domain));
    let default = NetworkConfig { margin: 0, ..NetworkConfig::default() };
    for mut segmenter in segmenters(&[&folder], None, &default) {
        let verdict =
            segmenter.segment(&known(20, 13)).expect("runs").network.and_then(|d| d.domain).expect("calibrated");
        assert!(verdict.outside && verdict.score < verdict.threshold, "{verdict:?}");
        assert!(verdict.disagreement.is_some_and(|d| d > 0.1), "{verdict:?}");
    }
    // Asked otherwise than it was calibrated, its scatter is on another scale.
    for mut segmenter in segmenters(&[&folder], None, &asked(&[Augmentation::Identity])) {
        let verdict =
            segmenter.segment(&known(20, 13)).expect("runs").network.and_then(|d| d.domain).expect("calibrated");
        assert!(!verdict.outside && verdict.disagreement.is_none(), "{verdict:?}");
    }
}
