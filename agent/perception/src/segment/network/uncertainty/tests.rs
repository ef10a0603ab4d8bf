//! Sigma, its parts and its statistics against the closed form.

use super::*;

/// Two members, two augmentations, two classes, two pixels; the second pixel is unknown to the second augmentation.
fn predictions() -> Predictions {
    let of = |p: [f32; 2]| vec![1.0 - p[0], 1.0 - p[1], p[0], p[1]];
    Predictions {
        classes: 2,
        pixels: 2,
        members: 2,
        augmentations: 2,
        planes: vec![of([0.9, 0.2]), of([0.7, 0.9]), of([0.6, 0.4]), of([0.6, 0.0])],
        valid: vec![None, Some(vec![true, false])],
    }
}

#[test]
fn figures_are_those_computed_by_hand() {
    let settings = UncertaintySettings { threshold: 0.15, ..UncertaintySettings::default() };
    let e = predictions().estimate(&settings);
    // Pixel 0, class 1: 0.9 0.7 | 0.6 0.6, mean 0.7, member means 0.8 and 0.6. Within: 4 * 0 + 2 * 0.01 = 0.02;
    // between: 2 * 0.01 + 2 * 0.01 = 0.04; over M - 1 = 3. Both classes scatter alike.
    let close = |a: f32, b: f32| assert!((a - b).abs() < 1e-6, "{a} is not {b}");
    close(e.mean[2], 0.7);
    close(e.sigma[0], (2.0 * 0.06 / 3.0_f32).sqrt());
    close(e.data[0], (2.0 * 0.02 / 3.0_f32).sqrt());
    close(e.model[0], (2.0 * 0.04 / 3.0_f32).sqrt());
    // Pixel 1 is known by one augmentation: 0.2 and 0.4, mean 0.3, sum of squares 0.02 over M - 1 = 1.
    close(e.mean[3], 0.3);
    close(e.sigma[1], (2.0 * 0.02_f32).sqrt());
    close(e.data[1], 0.0);
    // The foreground is pixel 0: sorted 0.6 0.6 0.7 0.9, quantiles at 0.075 and 2.925 of 3 steps.
    let f = e.figures;
    assert_eq!((f.pixels, f.foreground, f.uncertain), (2, 1, 1));
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-6, "{a} is not {b}");
    near(f.expanded, 2.0 * 0.02_f64.sqrt());
    near(f.quantile_low, 0.6);
    near(f.quantile_high, 0.7 + 0.925 * 0.2);
    near(f.sigma * f.sigma, f.data * f.data + f.model * f.model);
}

#[test]
fn the_population_form_never_exceeds_a_half_and_splits_as_the_law_says() {
    let mut p = predictions();
    p.valid = vec![None, None];
    let settings = UncertaintySettings { ddof: 0, statistic: Statistic::Predicted, ..Default::default() };
    let e = p.estimate(&settings);
    // Pixel 1: 0.2 0.9 | 0.4 0.0: E[Var] = (0.1225 + 0.04) / 2, Var[E] of 0.55 and 0.2.
    assert!((e.data[1] - (0.1625_f32 / 2.0).sqrt()).abs() < 1e-6);
    assert!((e.model[1] - 0.175).abs() < 1e-6);
    let opposed = |p: f32| vec![p, 1.0 - p];
    let e = Predictions {
        classes: 2,
        pixels: 1,
        members: 2,
        augmentations: 1,
        planes: vec![opposed(0.0), opposed(1.0)],
        valid: vec![None],
    }
    .estimate(&settings);
    assert!((e.sigma[0] - 0.5).abs() < 1e-6);
}

#[test]
fn one_prediction_has_no_scatter() {
    let one = Predictions {
        classes: 2,
        pixels: 1,
        members: 1,
        augmentations: 1,
        planes: vec![vec![0.3, 0.7]],
        valid: vec![None],
    };
    let e = one.estimate(&UncertaintySettings::default());
    assert_eq!((e.sigma[0], e.mean[1]), (0.0, 0.7));
}

#[test]
fn the_statistic_is_the_one_that_was_chosen() {
    let p = |a: [f32; 3]| a.to_vec();
    let three = Predictions {
        classes: 3,
        pixels: 1,
        members: 2,
        augmentations: 1,
        planes: vec![p([0.6, 0.3, 0.1]), p([0.5, 0.1, 0.4])],
        valid: vec![None],
    };
    // u_c^2 over M - 1 = 1: 0.005, 0.02, 0.045; the predicted class is 0, the largest u is class 2's.
    for (statistic, square) in [(Statistic::Norm, 0.07_f32), (Statistic::Predicted, 0.005), (Statistic::Largest, 0.045)]
    {
        let e = three.estimate(&UncertaintySettings { statistic, ..Default::default() });
        assert!((e.sigma[0] - square.sqrt()).abs() < 1e-6, "{statistic:?}: {}", e.sigma[0]);
    }
}

#[test]
fn pieces_and_threads_do_not_show() {
    let pixels = 3 * TOGETHER + 17;
    let value = |k: usize, i: usize| ((i * 7919 + k * 104_729) % 1000) as f32 / 1000.0;
    let planes = (0..6).map(|k| (0..2 * pixels).map(|i| value(k, i)).collect()).collect();
    let many = Predictions { classes: 2, pixels, members: 3, augmentations: 2, planes, valid: vec![None, None] };
    let settings = UncertaintySettings::default();
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| many.estimate(&settings))
    };
    let (one, four) = (on(1), on(4));
    assert_eq!(one, four);
    let i = pixels - 3;
    let mean: f32 = (0..6).map(|k| value(k, i)).sum::<f32>() / 6.0;
    assert!((one.mean[i] - mean).abs() < 1e-6);
}
