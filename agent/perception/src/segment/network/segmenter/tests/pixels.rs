//! Labels and sigma of pixels: members, augmentations, the region of interest.

use super::super::look::reaches_rim;
use super::*;
use crate::segment::network::engine::Tensor;

#[test]
fn labels_are_those_of_the_closed_form_whatever_runs_the_network() {
    let folder = model("semantic", &NAMES, &[classifier(2.0)], |_| {});
    let picture = view(50, 40, color);
    for mut segmenter in segmenters(&[&folder], None, &asked(&[Augmentation::Identity])) {
        let said = segmenter.segment(&picture).expect("runs");
        let (classes, probabilities, sigma) = soft(&said.components);
        assert_eq!((classes, probabilities.len()), (4, 50 * 40 * 4));
        for i in 0..50 * 40 {
            let [none, red, green] = closed_form(color(i % 50, i / 50), 2.0);
            // Green is class 1 of the inspection, red class 3; nothing says blue.
            for (found, wanted) in probabilities[i as usize * 4..].iter().zip([none, green, 0.0, red]) {
                assert!((f32::from(*found) - 255.0 * wanted).abs() <= 0.51, "pixel {i}: {found} {wanted}");
            }
        }
        assert!(sigma.iter().all(|s| *s == 0), "one network asked once");
        assert_eq!(said.components.model_sigma(7), None, "which has nobody to disagree with");
        assert_eq!(said.instances[49], said.components.best(49));
        let (_, defects, defect_sigma) = soft(&said.defects);
        assert!(defects.iter().all(|p| *p == 0) && defect_sigma.iter().all(|s| *s == 255), "nobody looked");
    }
}

#[test]
fn engines_agree() {
    let folder = model("semantic", &NAMES, &[classifier(2.0), classifier(1.0)], |_| {});
    let data: Vec<f32> = (0..2 * 3 * 32 * 64).map(|i| (i * 37 % 256) as f32 / 255.0).collect();
    let pictures = Tensor { shape: vec![2, 3, 32, 64], data };
    let answers: Vec<_> = engines()
        .iter()
        .map(|engine| {
            let mut model = NetworkModel::load(folder.path(), engine.as_ref(), 2).expect("fits");
            model.ask_each(1, |_| pictures.clone(), |_, answer| answer).expect("runs")
        })
        .collect();
    for other in &answers[1..] {
        for (a, b) in answers[0].iter().zip(other) {
            assert_eq!(a.probabilities.shape, [2, 3, 32, 64]);
            let far = a.probabilities.data.iter().zip(&b.probabilities.data).any(|(a, b)| (a - b).abs() > 1e-5);
            assert!(!far && a.probabilities.shape == b.probabilities.shape);
        }
    }
}

#[test]
fn sigma_of_two_members_that_disagree_is_the_one_computed_by_hand() {
    let folder = model("semantic", &NAMES, &[classifier(2.0), classifier(5.0)], |_| {});
    let picture = view(32, 32, |_, _| [255, 128, 0]);
    for mut segmenter in segmenters(&[&folder], None, &asked(&[Augmentation::Identity])) {
        let said = segmenter.segment(&picture).expect("runs");
        let (a, b) = (closed_form([255, 128, 0], 2.0), closed_form([255, 128, 0], 5.0));
        // Two values: the sample variance is half the square of their difference.
        let sigma = (0..3).map(|c| (a[c] - b[c]).powi(2) / 2.0).sum::<f32>().sqrt();
        let (_, probabilities, found) = soft(&said.components);
        assert!(sigma > 0.1 && (f32::from(found[7]) - 255.0 * sigma).abs() <= 0.51, "{} {sigma}", found[7]);
        assert!((f32::from(probabilities[3]) - 255.0 * (a[1] + b[1]) / 2.0).abs() <= 0.51);
        let part = said.components.model_sigma(7).expect("two members");
        assert!((part - sigma).abs() < 0.003, "all of it is the members'");
        let figures = said.network.expect("networks").components;
        assert!((figures.sigma - f64::from(sigma)).abs() < 1e-5 && figures.data < 1e-6);
        assert!((figures.model - f64::from(sigma)).abs() < 1e-5, "members differ, augmentations do not");
        assert_eq!((figures.pixels, figures.foreground), (1024, 1024));
    }
}

#[test]
fn the_region_of_interest_says_what_the_whole_picture_says() {
    let folder = model("semantic", &NAMES, &[classifier(2.0), classifier(3.0)], |m| m.input.multiple = 32);
    let mut picture = view(100, 80, |u, v| color(u / 2, v / 2));
    picture.pose =
        PoseEvidence::World { table_from_camera: Isometry3::identity(), covariance: covariance_of_prior(0.1, 0.1) };
    // A cube of 0.1 m, 1 m before the camera, right of the middle: columns 60 to 71, rows 35 to 46.
    let volume = Some((Point3::new(0.1, -0.05, 1.0), Point3::new(0.2, 0.05, 1.1)));
    let config = asked(&[Augmentation::Identity, Augmentation::Flip]);
    let parts = segmenters(&[&folder], volume, &config);
    let wholes = segmenters(&[&folder], volume, &NetworkConfig { region: Region::Whole, ..config });
    for (mut part, mut whole) in parts.into_iter().zip(wholes) {
        let (part, whole) = (part.segment(&picture).expect("runs"), whole.segment(&picture).expect("runs"));
        let window = part.network.as_ref().and_then(|n| n.window).expect("in sight");
        assert!((59..=60).contains(&window.left) && window.pixels() < 500, "{window:?}");
        assert_eq!(whole.network.and_then(|n| n.window), Some(Window::whole(100, 80)));
        let (_, p, sigma) = soft(&part.components);
        let (_, q, other) = soft(&whole.components);
        for i in 0..8000_u32 {
            let (u, v) = (i % 100, i / 100);
            let i = i as usize;
            if window.contains(u, v) {
                assert_eq!((&p[i * 4..i * 4 + 4], sigma[i]), (&q[i * 4..i * 4 + 4], other[i]), "pixel {u} {v}");
            } else {
                assert_eq!((&p[i * 4..i * 4 + 4], sigma[i]), (&[255, 0, 0, 0][..], 0), "pixel {u} {v}");
            }
        }
    }
}

#[test]
fn augmentations_change_nothing_for_a_network_that_they_cannot_change() {
    use Augmentation::{Flip, Identity, Warp};
    let folder = model("semantic", &NAMES, &[classifier(2.0)], |_| {});
    let picture = view(64, 48, |_, _| [200, 30, 0]);
    for mut segmenter in segmenters(&[&folder], None, &asked(&[Identity, Flip, Warp, Warp])) {
        let said = segmenter.segment(&picture).expect("runs");
        assert!(soft(&said.components).2.iter().all(|s| *s == 0), "every pixel is of one colour");
        assert_eq!(said, segmenter.segment(&picture).expect("runs"), "the seed decides");
    }
    // Noise in the light does change it.
    let lit = asked(&[Identity, Augmentation::Light]);
    for mut segmenter in segmenters(&[&folder], None, &lit) {
        let figures = segmenter.segment(&picture).expect("runs").network.expect("networks").components;
        assert!(figures.data > 0.001 && figures.model < 1e-6, "{figures:?}");
    }
}

#[test]
fn defects_have_a_network_and_an_uncertainty_of_their_own() {
    let components = model("semantic", &NAMES, &[classifier(2.0)], |_| {});
    let rust = [&[0.0_f32, 0.0, 0.0][..], &[0.0, 0.0, 8.0]];
    let networks = [onnx::classifier(&rust, &[0.0, -4.0]), onnx::classifier(&rust, &[0.0, -3.0])];
    let defects = model("defect", &["none", "corrosion"], &networks, |_| {});
    let picture = view(32, 32, |u, _| [255, 0, if u < 16 { 0 } else { 255 }]);
    for mut segmenter in segmenters(&[&components, &defects], None, &asked(&[Augmentation::Identity])) {
        let said = segmenter.segment(&picture).expect("runs");
        assert_eq!((said.components.best(20), said.defects.best(3), said.defects.best(20)), (3, 0, 2));
        assert!(said.components.sigma(20) == 0.0 && said.defects.sigma(20) > 0.004);
        assert_eq!(said.network.and_then(|n| n.defects).map(|d| d.foreground), Some(512));
    }
}

#[test]
fn fine_pictures_are_shrunk_and_a_glance_finds_the_part() {
    let folder = model("semantic", &NAMES, &[classifier(3.0)], |m| m.input.footprint = Some([1.5e-3, 2.8e-3]));
    // Pixels of 0.8 mm half a metre away: half as fine as the network likes them.
    let in_part = |u: u32, v: u32| (240..320).contains(&u) && (160..220).contains(&v);
    // A shadow, say, that looks like a part, but not as surely as one.
    let shadow = [170, 0, 0];
    let in_shadow = |u: u32, v: u32| (480..560).contains(&u) && (300..360).contains(&v);
    let picture = view(600, 400, |u, v| match (in_part(u, v), in_shadow(u, v)) {
        (true, _) => [255, 0, 0],
        (_, true) => shadow,
        _ => [0; 3],
    });
    for mut segmenter in segmenters(&[&folder], None, &asked(&[Augmentation::Identity])) {
        let said = segmenter.segment(&picture).expect("runs");
        let window = said.network.as_ref().and_then(|n| n.window).expect("seen");
        assert!((195..=212).contains(&window.left) && (144..=170).contains(&window.width), "{window:?}");
        let (classes, probabilities, sigma) = soft(&said.components);
        assert_eq!(
            (probabilities.len(), sigma.len(), said.instances.len()),
            (600 * 400 * classes, 600 * 400, 600 * 400)
        );
        let wrong = (0..600 * 400_u32).filter(|i| {
            let wanted = if in_part(i % 600, i / 600) { 3 } else { 0 };
            said.components.best(*i as usize) != wanted
        });
        // At most the pixels along the part's outline.
        assert!(wrong.count() < 300);
        assert_eq!(sigma[190 * 600 + 280], 0, "one network asked once");
        // What a glance alone takes for a part is no evidence, and no certainty that nothing is there.
        let [none, red, _] = closed_form(shadow, 3.0);
        assert!(red > none && red < 0.95, "{red}");
        let in_the_shadow = 330 * 600 + 520;
        assert_eq!((said.components.best(in_the_shadow), sigma[in_the_shadow]), (0, u8::MAX));
        // Of what only the glance saw the sigma is that of its own probabilities.
        let [none, ..] = closed_form([0; 3], 3.0);
        let glanced = f32::from(sigma[10]) / 255.0;
        let other = (1.0 - none) / 2.0;
        let wanted = (none * (1.0 - none) + 2.0 * other * (1.0 - other)).sqrt();
        assert!((glanced - wanted).abs() < 0.01, "{glanced} {wanted}");
    }
}

#[test]
fn a_part_that_goes_on_beyond_the_window_is_noticed() {
    let window = Window { left: 10, top: 20, width: 40, height: 40 };
    let field = |inside: fn(u32, u32) -> bool| {
        ClassField::Hard((0..100 * 80).map(|i| u16::from(inside(i % 100, i / 100))).collect())
    };
    assert!(!reaches_rim(&field(|u, v| (20..40).contains(&u) && (30..50).contains(&v)), window, (100, 80)));
    assert!(reaches_rim(&field(|u, v| (20..60).contains(&u) && (30..50).contains(&v)), window, (100, 80)));
    // A pixel or two are noise; at the picture's own rim there is nothing more to see.
    assert!(!reaches_rim(&field(|u, v| u == 49 && v == 30), window, (100, 80)));
    assert!(!reaches_rim(&field(|_, v| v > 30), Window { left: 0, top: 20, width: 100, height: 60 }, (100, 80)));
}
