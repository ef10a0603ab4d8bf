//! What networks say beside class probabilities: contributions of two streams, objects.

use super::*;

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
    Arc::make_mut(&mut picture.depth).metres[5] = 1.0;
    for mut segmenter in segmenters(&[&folder], None, &asked(&[Augmentation::Identity, Augmentation::Flip])) {
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
    let together = segmenters(&[&components, &instances], None, &config);
    for mut segmenter in together.into_iter().chain(segmenters(&[&alone], None, &config)) {
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
    let picture = view(40, 30, color);
    for mut segmenter in segmenters(&[&folder], None, &asked(&[Augmentation::Identity, Augmentation::Flip])) {
        let said = segmenter.segment(&picture).expect("runs");
        let (_, p, sigma) = soft(&said.components);
        let [none, ..] = closed_form(color(7, 3), 0.0);
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
    for mut segmenter in segmenters(&[&folder], None, &asked(&[Augmentation::Identity, Augmentation::Flip])) {
        let said = segmenter.segment(&picture).expect("runs");
        assert_eq!((said.components.best(5), said.components.best(35)), (3, 0));
        assert_eq!((said.instances[5], said.instances[35]), (1, 0));
        let (_, p, _) = soft(&said.components);
        assert!((f32::from(p[5 * 4 + 3]) - 255.0 * 0.9).abs() <= 0.51);
    }
}
