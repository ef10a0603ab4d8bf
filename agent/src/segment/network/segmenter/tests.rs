use super::*;
use crate::acquire::{PoseEvidence, covariance_of_prior};
use crate::segment::network::fixtures::{engines, manifest, onnx, view, write};
use crate::segment::network::{Augmentation, Manifest, ModelError};
use nalgebra::{Isometry3, Point3};
use tempfile::TempDir;

/// Scores of none, red and green: `softmax(0, 6 r - b, 6 g - b)`.
const WEIGHTS: [&[f32]; 3] = [&[0.0, 0.0, 0.0], &[6.0, 0.0, 0.0], &[0.0, 6.0, 0.0]];
const NAMES: [&str; 3] = ["none", "red", "green"];

fn classifier(b: f32) -> Vec<u8> {
    onnx::classifier(&WEIGHTS, &[0.0, -b, -b])
}

/// What [`classifier`] says of a colour.
fn closed_form(colour: [u8; 3], b: f32) -> [f32; 3] {
    let scores = [0.0, 6.0 * f32::from(colour[0]) / 255.0 - b, 6.0 * f32::from(colour[1]) / 255.0 - b];
    let sum: f32 = scores.iter().map(|s| s.exp()).sum();
    scores.map(|s| s.exp() / sum)
}

fn colour(u: u32, v: u32) -> [u8; 3] {
    [(u * 5) as u8, (v * 6) as u8, 9]
}

/// What is inspected: classes in another order than the networks', and one that these do not know.
fn info(volume: Option<Volume>) -> SourceInfo {
    SourceInfo {
        uri: String::new(),
        part: String::new(),
        taxonomy: Taxonomy::from_names(&["green", "blue", "red"], &["wear", "corrosion"]),
        view_count: None,
        turntable: None,
        volume,
        settings: Vec::new(),
    }
}

/// A folder with a model of `networks` and its manifest, changed by `change`.
fn model(task: &str, names: &[&str], networks: &[Vec<u8>], change: impl FnOnce(&mut Manifest)) -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let mut manifest = manifest(task, names);
    change(&mut manifest);
    write(folder.path(), manifest, networks);
    folder
}

fn asked(augmentations: &[Augmentation]) -> NetworkConfig {
    NetworkConfig { augmentations: augmentations.to_vec(), margin: 0, ..NetworkConfig::default() }
}

/// The segmenter of the models in `folders` in every engine there is.
fn segmenters(folders: &[&TempDir], info: &SourceInfo, config: &NetworkConfig) -> Vec<NetworkSegmenter> {
    engines()
        .iter()
        .map(|engine| {
            let load = |f: &&TempDir| Model::load(f.path(), engine.as_ref(), 1).expect("fits its manifest");
            let models = folders.iter().map(load).collect();
            NetworkSegmenter::new(models, engine.description(), info, config.clone()).expect("go together")
        })
        .collect()
}

fn soft(field: &ClassField) -> (usize, &[u8], &[u8]) {
    match field {
        ClassField::Soft { classes, probabilities, sigma } => (*classes, probabilities, sigma),
        ClassField::Hard(_) => panic!("networks give probabilities"),
    }
}

#[test]
fn labels_are_those_of_the_closed_form_whatever_runs_the_network() {
    let folder = model("semantic", &NAMES, &[classifier(2.0)], |_| {});
    let picture = view(50, 40, colour);
    for mut segmenter in segmenters(&[&folder], &info(None), &asked(&[Augmentation::Identity])) {
        let said = segmenter.segment(&picture).expect("runs");
        let (classes, probabilities, sigma) = soft(&said.components);
        assert_eq!((classes, probabilities.len()), (4, 50 * 40 * 4));
        for i in 0..50 * 40 {
            let [none, red, green] = closed_form(colour(i % 50, i / 50), 2.0);
            // Green is class 1 of the inspection, red class 3; nothing says blue.
            for (found, wanted) in probabilities[i as usize * 4..].iter().zip([none, green, 0.0, red]) {
                assert!((f32::from(*found) - 255.0 * wanted).abs() <= 0.51, "pixel {i}: {found} {wanted}");
            }
        }
        assert!(sigma.iter().all(|s| *s == 0), "one network asked once");
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
            let mut model = Model::load(folder.path(), engine.as_ref(), 2).expect("fits");
            model.ask(&pictures).expect("runs")
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
    for mut segmenter in segmenters(&[&folder], &info(None), &asked(&[Augmentation::Identity])) {
        let said = segmenter.segment(&picture).expect("runs");
        let (a, b) = (closed_form([255, 128, 0], 2.0), closed_form([255, 128, 0], 5.0));
        // Two values: the sample variance is half the square of their difference.
        let sigma = (0..3).map(|c| (a[c] - b[c]).powi(2) / 2.0).sum::<f32>().sqrt();
        let (_, probabilities, found) = soft(&said.components);
        assert!(sigma > 0.1 && (f32::from(found[7]) - 255.0 * sigma).abs() <= 0.51, "{} {sigma}", found[7]);
        assert!((f32::from(probabilities[3]) - 255.0 * (a[1] + b[1]) / 2.0).abs() <= 0.51);
        let figures = said.network.expect("networks").components;
        assert!((figures.sigma - f64::from(sigma)).abs() < 1e-5 && figures.data < 1e-6);
        assert!((figures.model - f64::from(sigma)).abs() < 1e-5, "members differ, augmentations do not");
        assert_eq!((figures.pixels, figures.foreground), (1024, 1024));
    }
}

#[test]
fn the_region_of_interest_says_what_the_whole_picture_says() {
    let folder = model("semantic", &NAMES, &[classifier(2.0), classifier(3.0)], |m| m.input.multiple = 32);
    let mut picture = view(100, 80, |u, v| colour(u / 2, v / 2));
    picture.pose =
        PoseEvidence::World { table_from_camera: Isometry3::identity(), covariance: covariance_of_prior(0.1, 0.1) };
    // A cube of 0.1 m, 1 m before the camera, right of the middle: columns 60 to 71, rows 35 to 46.
    let volume = Some((Point3::new(0.1, -0.05, 1.0), Point3::new(0.2, 0.05, 1.1)));
    let config = asked(&[Augmentation::Identity, Augmentation::Flip]);
    let parts = segmenters(&[&folder], &info(volume), &config);
    let wholes = segmenters(&[&folder], &info(volume), &NetworkConfig { region: Region::Whole, ..config });
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
    for mut segmenter in segmenters(&[&folder], &info(None), &asked(&[Identity, Flip, Warp, Warp])) {
        let said = segmenter.segment(&picture).expect("runs");
        assert!(soft(&said.components).2.iter().all(|s| *s == 0), "every pixel is of one colour");
        assert_eq!(said, segmenter.segment(&picture).expect("runs"), "the seed decides");
    }
    // Noise in the light does change it.
    let lit = asked(&[Identity, Augmentation::Light]);
    for mut segmenter in segmenters(&[&folder], &info(None), &lit) {
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
    for mut segmenter in segmenters(&[&components, &defects], &info(None), &asked(&[Augmentation::Identity])) {
        let said = segmenter.segment(&picture).expect("runs");
        assert_eq!((said.components.best(20), said.defects.best(3), said.defects.best(20)), (3, 0, 2));
        assert!(said.components.sigma(20) == 0.0 && said.defects.sigma(20) > 0.004);
        assert_eq!(said.network.and_then(|n| n.defects).map(|d| d.foreground), Some(512));
    }
}

#[test]
fn a_two_stream_network_tells_what_each_stream_contributes() {
    let network = onnx::Graph::new("image", &onnx::picture(4))
        .floats("weights", &[2, 4, 1, 1], &[0.0, 0.0, 0.0, 0.0, 9.0, 0.0, 0.0, 0.0])
        .floats("share", &[1, 4, 1, 1], &[0.0, 0.0, 0.0, 1.0])
        .node("Conv", &["image", "weights"], "scores", &[])
        .node("Conv", &["image", "share"], "contribution", &[])
        .output("scores", &onnx::picture(2))
        .output("contribution", &onnx::picture(1))
        .bytes();
    let folder = model("two-stream", &["none", "red"], &[network], |m| {
        use crate::segment::network::{Activation, Channel, DepthScale, Fusion};
        m.fusion = Fusion::Contribution;
        m.input.channels.push(Channel::Depth);
        m.input.depth = Some(DepthScale { near: 0.0, far: 2.0, missing: 0.0 });
        m.output.tensor = Some("scores".into());
        m.output.contribution = Some("contribution".into());
        m.output.activation = Activation::Softmax;
    });
    let mut picture = view(32, 32, |_, _| [255, 0, 0]);
    picture.depth.metres[5] = 1.0;
    for mut segmenter in segmenters(&[&folder], &info(None), &asked(&[Augmentation::Identity, Augmentation::Flip])) {
        let said = segmenter.segment(&picture).expect("runs");
        let share = said.network.and_then(|n| n.contribution.clone()).expect("two streams");
        assert_eq!((share.len(), share[4], share[5], share[6]), (1024, 64, 128, 64));
        assert_eq!(said.components.best(5), 3);
    }
}

#[test]
fn an_instance_network_separates_objects_of_one_class() {
    let components = model("semantic", &NAMES, &[classifier(2.0)], |_| {});
    // Red cells are centres; offsets are zero, so a pixel belongs to the nearest centre.
    let mut heat = vec![0.0; 3 * 3 * 16];
    heat[3 * 16..4 * 16].fill(1.0 / 16.0);
    let network = || {
        onnx::Graph::new("image", &onnx::picture(3))
            .floats("heat", &[3, 3, 4, 4], &heat)
            .floats("zero", &[2, 3, 4, 4], &[0.0; 96])
            .node("Conv", &["image", "heat"], "centres", &[("strides", &[4, 4])])
            .node("Conv", &["image", "zero"], "offsets", &[("strides", &[4, 4])])
            .output("centres", &onnx::picture(3))
            .output("offsets", &onnx::picture(2))
            // The same network as a classifier, for pictures one by one.
            .floats("weights", &[3, 3, 1, 1], &WEIGHTS.concat())
            .floats("bias", &[3], &[0.0, -2.0, -2.0])
            .node("Conv", &["image", "weights", "bias"], "scores", &[])
            .node("Softmax", &["scores"], "probabilities", &[("axis", &[1])])
            .output("probabilities", &onnx::picture(3))
            .bytes()
    };
    let alone = model("instance", &NAMES, &[network()], |m| {
        m.input.multiple = 4;
        m.output.tensor = Some("probabilities".into());
    });
    let instances = model("instance", &NAMES, &[network()], |m| m.input.multiple = 4);
    // Two bright red spots, each a cell, on a dimmer red ground.
    let spot = |u: u32, v: u32| (8..12).contains(&v) && ((8..12).contains(&u) || (48..52).contains(&u));
    let picture = view(62, 30, |u, v| [if spot(u, v) { 255 } else { 128 }, 0, 0]);
    let config = asked(&[Augmentation::Identity]);
    let together = segmenters(&[&components, &instances], &info(None), &config);
    for mut segmenter in together.into_iter().chain(segmenters(&[&alone], &info(None), &config)) {
        let said = segmenter.segment(&picture).expect("runs");
        assert_eq!(said.components.best(0), 3);
        let (left, right) = (said.instances[9 * 62 + 9], said.instances[9 * 62 + 50]);
        assert!(left != right && left != 0 && right != 0, "{left} {right}");
        assert_eq!((said.instances[0], said.instances[61]), (left, right));
    }
}

/// The outputs of Torchvision's Mask R-CNN, for one object of class 1 that covers what is red.
fn detector() -> Vec<u8> {
    onnx::Graph::new("image", &[Ok(3), Err("h"), Err("w")])
        .whole("zero", &[1], &[0])
        .floats("red", &[1, 3, 1, 1], &[1.0, 0.0, 0.0])
        .floats("b", &[1, 4], &[0.0, 0.0, 1.0, 1.0])
        .whole("l", &[1], &[1])
        .floats("s", &[1], &[0.9])
        .node("Unsqueeze", &["image", "zero"], "batch", &[])
        .node("Conv", &["batch", "red"], "masks", &[])
        .node("Identity", &["b"], "boxes", &[])
        .node("Identity", &["l"], "labels", &[])
        .node("Identity", &["s"], "scores", &[])
        .output("boxes", &[Err("d"), Ok(4)])
        .whole_output("labels", &[Err("d")])
        .output("scores", &[Err("d")])
        .output("masks", &[Err("d"), Ok(1), Err("h"), Err("w")])
        .bytes()
}

#[test]
fn a_network_of_one_picture_at_a_time_is_asked_about_several() {
    let network = onnx::Graph::new("image", &[Ok(1), Ok(3), Err("h"), Err("w")])
        .floats("weights", &[3, 3, 1, 1], &WEIGHTS.concat())
        .node("Conv", &["image", "weights"], "scores", &[])
        .node("Softmax", &["scores"], "probabilities", &[("axis", &[1])])
        .output("probabilities", &onnx::picture(3))
        .bytes();
    let folder = model("semantic", &NAMES, &[network], |_| {});
    let picture = view(40, 30, colour);
    for mut segmenter in segmenters(&[&folder], &info(None), &asked(&[Augmentation::Identity, Augmentation::Flip])) {
        let said = segmenter.segment(&picture).expect("runs");
        let (_, p, sigma) = soft(&said.components);
        let [none, ..] = closed_form(colour(7, 3), 0.0);
        assert!((f32::from(p[(3 * 40 + 7) * 4]) - 255.0 * none).abs() <= 0.51);
        assert!(sigma.iter().all(|s| *s == 0), "flipping changes nothing");
    }
}

#[test]
fn a_detector_labels_pixels_and_separates_objects() {
    let folder = model("instance", &["none", "red"], &[detector()], |m| {
        m.output = crate::segment::network::Output {
            boxes: Some("boxes".into()),
            labels: Some("labels".into()),
            scores: Some("scores".into()),
            masks: Some("masks".into()),
            ..Default::default()
        };
    });
    let picture = view(40, 30, |u, _| [if u < 20 { 255 } else { 0 }, 0, 0]);
    for mut segmenter in segmenters(&[&folder], &info(None), &asked(&[Augmentation::Identity, Augmentation::Flip])) {
        let said = segmenter.segment(&picture).expect("runs");
        assert_eq!((said.components.best(5), said.components.best(35)), (3, 0));
        assert_eq!((said.instances[5], said.instances[35]), (1, 0));
        let (_, p, _) = soft(&said.components);
        assert!((f32::from(p[5 * 4 + 3]) - 255.0 * 0.9).abs() <= 0.51);
    }
}

/// (what is wrong, task, networks, change of the manifest, the field that is to be named).
type Misfit<'a> = (&'a str, Vec<u8>, &'a dyn Fn(&mut Manifest), &'a str);

#[test]
fn a_manifest_that_does_not_fit_its_network_names_file_and_field_at_load() {
    let nothing = |_: &mut Manifest| {};
    let four = onnx::classifier(&[&[0.0; 4], &[1.0; 4], &[1.0; 4]], &[0.0; 3]);
    let two = onnx::classifier(&WEIGHTS[..2], &[0.0; 2]);
    let conv = |shape: onnx::Shape<'_>| {
        onnx::Graph::new("image", shape)
            .floats("weights", &[3, 3, 1, 1], &WEIGHTS.concat())
            .node("Conv", &["image", "weights"], "scores", &[])
            .node("Softmax", &["scores"], "probabilities", &[("axis", &[1])])
            .output("probabilities", &onnx::picture(3))
            .bytes()
    };
    let fixed = conv(&[Err("n"), Ok(3), Ok(48), Ok(64)]);
    let strided = onnx::Graph::new("image", &onnx::picture(3))
        .floats("weights", &[3, 3, 2, 2], &[0.1; 36])
        .node("Conv", &["image", "weights"], "probabilities", &[("strides", &[2, 2])])
        .output("probabilities", &onnx::picture(3))
        .bytes();
    let raw = onnx::Graph::new("image", &onnx::picture(3))
        .floats("weights", &[3, 3, 1, 1], &[0.0; 9])
        .floats("bias", &[3], &[7.5; 3])
        .node("Conv", &["image", "weights", "bias"], "probabilities", &[])
        .output("probabilities", &onnx::picture(3))
        .bytes();
    let paired = onnx::Graph::new("image", &onnx::picture(3))
        .input("depth", &onnx::picture(3))
        .node("Add", &["image", "depth"], "probabilities", &[])
        .output("probabilities", &onnx::picture(3))
        .bytes();
    let misfits: [Misfit<'_>; 9] = [
        ("another input name", classifier(0.0), &|m| m.input.tensor = "picture".into(), "input.tensor"),
        ("two inputs", paired, &nothing, "input.tensor"),
        ("four channels", four, &nothing, "input.channels"),
        ("another output name", classifier(0.0), &|m| m.output.tensor = Some("masks".into()), "output.tensor"),
        ("too few classes", two, &nothing, "classes"),
        ("half the size", strided, &nothing, "output.tensor"),
        ("no probabilities", raw, &nothing, "output.activation"),
        ("a fixed size that is not said", fixed.clone(), &nothing, "input.height"),
        ("another fixed size", fixed, &|m| (m.input.width, m.input.height) = (Some(32), Some(48)), "input.width"),
    ];
    for engine in engines() {
        let name = engine.description().name;
        for (what, network, change, field) in &misfits {
            let folder = model("semantic", &NAMES, std::slice::from_ref(network), change);
            match Model::load(folder.path(), engine.as_ref(), 1).expect_err(what) {
                ModelError::Manifest(error) => {
                    assert_eq!(&error.field, field, "{name}, {what}: {error}");
                    assert!(error.to_string().contains("member-0.onnx") && error.path.ends_with("model.toml"));
                }
                error => panic!("{name}, {what}: {error}"),
            }
        }
        // What no manifest can mend names the network.
        let unknown = onnx::Graph::new("image", &onnx::picture(3))
            .node("Frobnicate", &["image"], "probabilities", &[])
            .output("probabilities", &onnx::picture(3))
            .bytes();
        for (what, network) in [("corrupt", b"no network".to_vec()), ("unknown", unknown), ("empty", Vec::new())] {
            let folder = model("semantic", &NAMES, &[network], |_| {});
            let error = Model::load(folder.path(), engine.as_ref(), 1).expect_err(what).to_string();
            assert!(error.contains("member-0.onnx"), "{name}, {what}: {error}");
        }
        let folder = model("semantic", &NAMES, &[classifier(0.0)], |_| {});
        std::fs::remove_file(folder.path().join("member-0.onnx")).expect("was there");
        let error = Model::load(folder.path(), engine.as_ref(), 1).expect_err("missing").to_string();
        assert!(error.contains("network[0].file") && error.contains("member-0.onnx"), "{error}");
    }
}

#[test]
fn models_that_do_not_go_together_are_refused() {
    let engines = engines();
    let engine = engines[0].as_ref();
    let folder = model("semantic", &NAMES, &[classifier(2.0)], |_| {});
    let load = || Model::load(folder.path(), engine, 1).expect("fits");
    let new = |models, info: &SourceInfo, config| {
        NetworkSegmenter::new(models, engine.description(), info, config).expect_err("refused").to_string()
    };
    let config = NetworkConfig::default();
    assert!(new(vec![load(), load()], &info(None), config.clone()).contains("say the same"));
    assert!(new(Vec::new(), &info(None), config.clone()).contains("components"));
    let mut strange = info(None);
    strange.taxonomy.components.truncate(2);
    assert!(new(vec![load()], &strange, config.clone()).contains("red"));
    let wrong = NetworkConfig { augmentations: Vec::new(), ..config };
    assert!(new(vec![load()], &info(None), wrong).contains("network.augmentations"));
    // A view whose picture and depth differ is an error that names the view.
    let mut segmenter =
        NetworkSegmenter::new(vec![load()], engine.description(), &info(None), NetworkConfig::default())
            .expect("goes together");
    let mut picture = view(32, 32, colour);
    picture.depth.metres.pop();
    assert!(segmenter.segment(&picture).expect_err("no depth for a pixel").to_string().contains("view 0"));
}
