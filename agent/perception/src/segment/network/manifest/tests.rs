//! Manifests read back; what is wrong is named; any text is refused or read, never a panic.

use super::*;
use proptest::prelude::*;
use sha2::Digest;

/// A manifest that is right.
const GOOD: &str = r##"
schema = 1
name = "ud-net-edge"
version = "1"
task = "semantic"
architecture = "ud-net"
fusion = "early"
licence = "MIT OR Apache-2.0"
[[network]]
file = "member-0.onnx"
sha256 = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"
[input]
tensor = "image"
channels = ["red", "green", "blue", "depth"]
multiple = 32
[input.colour]
mean = [0.485, 0.456, 0.406]
std = [0.229, 0.224, 0.225]
[input.depth]
near = 0.25
far = 0.90
missing = 0.0
[output]
tensor = "probabilities"
activation = "softmax"
[[classes]]
name = "none"
colour = "#000000"
[[classes]]
name = "housing"
colour = "#3b82c4"
[training]
seed = 7
[metrics]
mean_iou = 0.9
"##;

#[test]
fn a_whole_manifest_is_read_and_comes_back() {
    let manifest = Manifest::parse(GOOD).expect("right");
    assert_eq!(manifest.classes[1].rgb(), Some([0x3b, 0x82, 0xc4]));
    assert_eq!((manifest.output.activation, manifest.input.multiple), (Activation::Softmax, 32));
    assert_eq!(manifest.metrics["mean_iou"].as_float(), Some(0.9));
    let text = toml::to_string(&manifest).expect("writes");
    assert_eq!(Manifest::parse(&text).expect("right"), manifest);
}

#[test]
fn every_fault_names_its_field() {
    let two_networks = "file = \"b.onnx\"\nsha256 = \"00\"\n[input]";
    let cases = [
        ("schema = 1", "schema = 2", "schema"),
        ("ud-net-edge", "Ud Net", "name"),
        ("version = \"1\"", "version = \"\"", "version"),
        ("member-0.onnx", "../member-0.onnx", "network[0].file"),
        ("e3b0c442", "e3b0c44z", "network[0].sha256"),
        ("[input]", &format!("[[network]]\n{two_networks}"), "network[1].sha256"),
        ("tensor = \"image\"", "tensor = \"\"", "input.tensor"),
        ("\"blue\", \"depth\"]", "\"blue\", \"blue\"]", "input.channels"),
        ("multiple = 32", "multiple = 0", "input.multiple"),
        ("multiple = 32", "multiple = 32\nwidth = 640", "input.height"),
        ("multiple = 32", "multiple = 32\nwidth = 640\nheight = 500", "input.height"),
        ("std = [0.229", "std = [0.0", "input.colour.std"),
        ("far = 0.90", "far = 0.2", "input.depth.far"),
        ("[input.depth]\nnear = 0.25\nfar = 0.90\nmissing = 0.0", "", "input.depth"),
        ("fusion = \"early\"", "fusion = \"none\"", "fusion"),
        ("[\"red\", \"green\", \"blue\", \"depth\"]", "[\"red\"]", "fusion"),
        ("tensor = \"probabilities\"", "", "output.tensor"),
        ("tensor = \"probabilities\"", "tensor = \"p\"\ncontribution = \"c\"", "output.contribution"),
        ("tensor = \"probabilities\"", "tensor = \"p\"\nmasks = \"m\"", "output.masks"),
        ("task = \"semantic\"", "task = \"instance\"", "output.centres"),
        ("name = \"none\"", "name = \"background\"", "classes[0].name"),
        ("name = \"housing\"", "name = \"none\"", "classes[1].name"),
        ("#3b82c4", "blue", "classes[1].colour"),
    ];
    for (from, to, field) in cases {
        assert!(GOOD.contains(from), "{from} is in the manifest");
        let (found, reason) = Manifest::parse(&GOOD.replace(from, to)).expect_err(field);
        assert_eq!(found, field, "{reason}");
    }
    // What the format itself refuses names the line.
    for (from, to, word) in [
        ("licence", "license", "license"),
        ("task = \"semantic\"", "task = \"panoptic\"", "panoptic"),
        ("version = \"1\"", "", "version"),
    ] {
        let (line, reason) = Manifest::parse(&GOOD.replace(from, to)).expect_err(word);
        assert!(line.starts_with("line ") && reason.contains(word), "{line}: {reason}");
    }
}

#[test]
fn objects_come_by_centres_or_by_detection() {
    let with = |output: &str| {
        let text = GOOD.replace("task = \"semantic\"", "task = \"instance\"");
        Manifest::parse(&text.replace("tensor = \"probabilities\"", output)).map_err(|(field, _)| field)
    };
    assert!(with("centres = \"c\"\noffsets = \"o\"").is_ok());
    assert!(with("tensor = \"p\"\ncentres = \"c\"\noffsets = \"o\"").is_ok(), "it may label pixels as well");
    assert!(with("boxes = \"b\"\nlabels = \"l\"\nscores = \"s\"\nmasks = \"m\"").is_ok());
    assert_eq!(with("centres = \"c\""), Err("output.offsets".into()));
    assert_eq!(with("boxes = \"b\"\nlabels = \"l\"\nmasks = \"m\""), Err("output.scores".into()));
    assert_eq!(with("centres = \"c\"\nboxes = \"b\""), Err("output.boxes".into()));
    assert_eq!(with(""), Err("output.centres".into()));
}

#[test]
fn the_checksum_is_that_of_the_bytes() {
    let folder = tempfile::tempdir().expect("a folder");
    let manifest = Manifest::parse(GOOD).expect("right");
    let missing = manifest.verify(folder.path()).expect_err("no file");
    assert_eq!(missing.field, "network[0].file");
    assert!(missing.to_string().contains("model.toml: network[0].file: member-0.onnx"), "{missing}");
    // The checksum in the manifest is that of no bytes at all.
    std::fs::write(folder.path().join("member-0.onnx"), b"").expect("writes");
    manifest.verify(folder.path()).expect("right");
    std::fs::write(folder.path().join("member-0.onnx"), b"x").expect("writes");
    assert_eq!(manifest.verify(folder.path()).expect_err("another file").field, "network[0].sha256");
}

#[test]
fn weights_in_another_file_are_under_a_checksum_too() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).expect("writes");
    // A model whose only tensor lies in `w.data`.
    let tensor = b"\x6a\x12\x0a\x08location\x12\x06w.data".to_vec();
    let graph = [&[0x2a, tensor.len() as u8][..], &tensor].concat();
    let network = [&[0x3a, graph.len() as u8][..], &graph].concat();
    write("member-0.onnx", &network);
    let digest = |bytes: &[u8]| sha2::Sha256::digest(bytes).iter().map(|b| format!("{b:02x}")).collect::<String>();
    let own = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";
    let manifest = |weights: &str| {
        Manifest::parse(&GOOD.replace(&format!("\"{own}\""), &format!("\"{}\"{weights}", digest(&network))))
            .expect("right")
    };
    let fault = |manifest: &Manifest| manifest.verify(folder.path()).map_err(|e| (e.field.clone(), e.to_string()));
    let (silent, named) =
        (manifest(""), format!("\n[[network.weights]]\nfile = \"w.data\"\nsha256 = \"{}\"", digest(b"weights")));
    let named = manifest(&named);
    for there in [false, true] {
        if there {
            write("w.data", b"weights");
        }
        let (field, reason) = fault(&silent).expect_err("no checksum");
        assert_eq!(field, "network[0].weights");
        assert!(reason.contains("w.data") && reason.contains(&digest(b"weights")) == there, "{reason}");
        assert_eq!(
            fault(&named).map_err(|(field, _)| field),
            if there { Ok(()) } else { Err("network[0].weights[0].file".into()) }
        );
    }
    write("w.data", b"changed");
    let (field, reason) = fault(&named).expect_err("changed");
    assert!(field == "network[0].weights[0].sha256" && reason.contains("w.data"), "{field}: {reason}");
}

#[test]
fn a_folder_without_a_manifest_is_an_error_that_names_it() {
    let error = Manifest::read(Path::new("/nowhere/at-all")).expect_err("nothing there");
    assert!(error.to_string().contains("/nowhere/at-all/model.toml"), "{error}");
}

proptest! {
    #[test]
    fn no_text_makes_it_panic(text in ".{0,200}") {
        let _ = Manifest::parse(&text);
    }

    #[test]
    fn no_line_in_it_makes_it_panic(at in 0_usize..40, line in "[a-z.]{0,12}( = )?[-0-9a-z\"\\[\\]{}#., ]{0,24}") {
        let mut lines: Vec<&str> = GOOD.lines().collect();
        let at = at.min(lines.len() - 1);
        lines[at] = &line;
        let _ = Manifest::parse(&lines.join("\n"));
    }
}
