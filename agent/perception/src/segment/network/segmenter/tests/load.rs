//! Models that cannot be used are refused when they are loaded.

use super::*;

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
