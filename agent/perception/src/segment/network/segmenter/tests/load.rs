//! Models that cannot be used are refused when they are loaded.

use super::*;
use crate::segment::network::engine::Tensor;

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
        .floats("weights", &[3, 3, 3, 3], &[0.1; 81])
        .node("Conv", &["image", "weights"], "probabilities", &[("strides", &[3, 3])])
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
    let last = conv(&[Err("n"), Err("h"), Err("w"), Ok(3)]);
    let misfits: [Misfit<'_>; 10] = [
        ("channels last", last, &nothing, "input.tensor"),
        ("another input name", classifier(0.0), &|m| m.input.tensor = "picture".into(), "input.tensor"),
        ("two inputs", paired, &nothing, "input.tensor"),
        ("four channels", four, &nothing, "input.channels"),
        ("another output name", classifier(0.0), &|m| m.output.tensor = Some("masks".into()), "output.tensor"),
        ("too few classes", two, &nothing, "classes"),
        ("a third of the size", strided, &nothing, "output.tensor"),
        ("no probabilities", raw, &nothing, "output.activation"),
        ("a fixed size that is not said", fixed.clone(), &nothing, "input.height"),
        ("another fixed size", fixed, &|m| (m.input.width, m.input.height) = (Some(32), Some(48)), "input.width"),
    ];
    for engine in engines() {
        let name = engine.description().name;
        for (what, network, change, field) in &misfits {
            let folder = model("semantic", &NAMES, std::slice::from_ref(network), change);
            match NetworkModel::load(folder.path(), engine.as_ref(), 1).expect_err(what) {
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
            let error = NetworkModel::load(folder.path(), engine.as_ref(), 1).expect_err(what).to_string();
            assert!(error.contains("member-0.onnx"), "{name}, {what}: {error}");
        }
        let folder = model("semantic", &NAMES, &[classifier(0.0)], |_| {});
        std::fs::remove_file(folder.path().join("member-0.onnx")).expect("was there");
        let error = NetworkModel::load(folder.path(), engine.as_ref(), 1).expect_err("missing").to_string();
        assert!(error.contains("network[0].file") && error.contains("member-0.onnx"), "{error}");
    }
}

#[test]
fn networks_that_label_cells_are_spread_over_the_pixels() {
    // A cell of 4 x 4 pixels takes the mean colour.
    let spread: Vec<f32> = WEIGHTS.iter().flat_map(|row| row.iter().flat_map(|w| [w / 16.0; 16])).collect();
    let coarse = onnx::Graph::new("image", &onnx::picture(3))
        .floats("weights", &[3, 3, 4, 4], &spread)
        .node("Conv", &["image", "weights"], "scores", &[("strides", &[4, 4])])
        .node("Softmax", &["scores"], "probabilities", &[("axis", &[1])])
        .output("probabilities", &onnx::picture(3))
        .bytes();
    let fine = classifier(0.0);
    let picture =
        Tensor { shape: vec![2, 3, 64, 32], data: (0..2 * 3 * 64 * 32).map(|i| (i / 2048) as f32 / 6.0).collect() };
    for engine in engines() {
        let answers = [&coarse, &fine].map(|network| {
            let folder = model("semantic", &NAMES, std::slice::from_ref(network), |_| {});
            let mut loaded = NetworkModel::load(folder.path(), engine.as_ref(), 1).expect("fits");
            loaded.ask_first(&picture).expect("runs").probabilities
        });
        assert_eq!(answers[0].shape, answers[1].shape);
        let worst = answers[0].data.iter().zip(&answers[1].data).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(worst < 1e-5, "{worst}");
    }
}

#[test]
fn half_precision_runs_or_is_refused_by_name() {
    let half = onnx::Graph::half(&onnx::picture(3), |graph| {
        graph
            .floats("weights", &[3, 3, 1, 1], &WEIGHTS.concat())
            .node("Conv", &["image", "weights"], "scores", &[])
            .node("Softmax", &["scores"], "probabilities", &[("axis", &[1])])
    });
    let folder = model("semantic", &NAMES, &[half.bytes()], |m| {
        (m.input.tensor, m.output.tensor) = ("half".into(), Some("halved".into()));
    });
    for engine in engines() {
        let loaded = NetworkModel::load(folder.path(), engine.as_ref(), 1);
        if engine.description().name == "tract" {
            let error = loaded.expect_err("single precision only").to_string();
            assert!(error.contains("input.tensor") && error.contains("member-0.onnx"), "{error}");
            continue;
        }
        let grey = Tensor { shape: vec![1, 3, 32, 32], data: vec![0.5; 3 * 32 * 32] };
        let said = loaded.expect("fits").ask_first(&grey).expect("runs").probabilities;
        let expected = closed_form([128, 128, 128], 0.0);
        for (class, expected) in expected.iter().enumerate() {
            assert!((said.data[class * 32 * 32] - expected).abs() < 0.02, "{class}: {}", said.data[class * 32 * 32]);
        }
    }
}

#[test]
fn models_that_do_not_go_together_are_refused() {
    let engines = engines();
    let engine = engines[0].as_ref();
    let folder = model("semantic", &NAMES, &[classifier(2.0)], |_| {});
    let load = || NetworkModel::load(folder.path(), engine, 1).expect("fits");
    let new = |models, taxonomy: &Taxonomy, config| {
        NetworkSegmenter::new(models, engine.description(), taxonomy, None, config).expect_err("refused").to_string()
    };
    let config = NetworkConfig::default();
    assert!(new(vec![load(), load()], &taxonomy(), config.clone()).contains("say the same"));
    assert!(new(Vec::new(), &taxonomy(), config.clone()).contains("components"));
    let mut strange = taxonomy();
    strange.components.truncate(2);
    assert!(new(vec![load()], &strange, config.clone()).contains("red"));
    let wrong = NetworkConfig { augmentations: Vec::new(), ..config };
    assert!(new(vec![load()], &taxonomy(), wrong).contains("network.augmentations"));
    // A view whose picture and depth differ is an error that names the view.
    let mut segmenter =
        NetworkSegmenter::new(vec![load()], engine.description(), &taxonomy(), None, NetworkConfig::default())
            .expect("goes together");
    let mut picture = view(32, 32, color);
    Arc::make_mut(&mut picture.depth).metres.pop();
    assert!(segmenter.segment(&picture).expect_err("no depth for a pixel").to_string().contains("view 0"));
}
