//! A network of the compact kind with random weights: inverted residuals at four scales, a depthwise decoder, softmax at
//! half the resolution. What it says is noise; what it costs is what a trained one costs.

use crate::onnx::{Graph, picture};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sha2::{Digest, Sha256};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

const MEMBERS: u64 = 5;
const CLASSES: i64 = 6;
/// Channels at a half, a quarter, an eighth and a sixteenth of the resolution.
const WIDTHS: [i64; 4] = [16, 24, 48, 96];
/// How much wider the inside of a block is.
const EXPANSION: i64 = 4;

/// Writes a model of five members and gives its folder.
pub(crate) fn write(folder: &Path) -> PathBuf {
    std::fs::create_dir_all(folder).expect("a folder");
    let mut text = String::from(
        "schema = 1\nname = \"synthetic\"\nversion = \"0\"\ntask = \"semantic\"\nfusion = \"early\"\nlicence = \"MIT\"\n\
         [input]\ntensor = \"image\"\nchannels = [\"red\", \"green\", \"blue\", \"depth\"]\nmultiple = 32\n\
         [input.colour]\nmean = [0.485, 0.456, 0.406]\nstd = [0.229, 0.224, 0.225]\n\
         [input.depth]\nnear = 0.25\nfar = 0.9\nmissing = 0.0\n[output]\ntensor = \"probabilities\"\n",
    );
    for class in 0..CLASSES {
        let name = if class == 0 { "none".to_owned() } else { format!("class {class}") };
        write!(text, "[[classes]]\nname = \"{name}\"\ncolour = \"#000000\"\n").expect("writes");
    }
    for seed in 0..MEMBERS {
        let bytes = network(seed);
        let sha256: String = Sha256::digest(&bytes).iter().map(|b| format!("{b:02x}")).collect();
        std::fs::write(folder.join(format!("member-{seed}.onnx")), bytes).expect("writes");
        write!(text, "[[network]]\nfile = \"member-{seed}.onnx\"\nsha256 = \"{sha256}\"\n").expect("writes");
    }
    std::fs::write(folder.join("model.toml"), text).expect("writes");
    folder.to_owned()
}

/// Adds layers one after the other, each with weights of its own.
struct Layers {
    graph: Graph,
    random: Pcg64Mcg,
    count: usize,
}

impl Layers {
    /// A convolution of `size` with a bias, and a ReLU where wanted; the name of its result.
    fn conv(
        &mut self,
        from: &str,
        [inputs, outputs]: [i64; 2],
        size: i64,
        stride: i64,
        groups: i64,
        relu: bool,
    ) -> String {
        self.count += 1;
        let (name, weights, bias) =
            (format!("conv{}", self.count), format!("w{}", self.count), format!("b{}", self.count));
        let dims = [outputs, inputs / groups, size, size];
        let scale = (6.0 / (inputs / groups * size * size) as f32).sqrt();
        let count = dims.iter().product::<i64>();
        let values: Vec<f32> = (0..count).map(|_| scale * (2.0 * self.random.random::<f32>() - 1.0)).collect();
        let pad = size / 2;
        self.graph = std::mem::take(&mut self.graph)
            .floats(&weights, &dims, &values)
            .floats(&bias, &[outputs], &vec![0.01; outputs as usize])
            .node(
                "Conv",
                &[from, &weights, &bias],
                &name,
                &[("strides", &[stride, stride]), ("pads", &[pad, pad, pad, pad]), ("group", &[groups])],
            );
        if relu { self.node("Relu", &[&name]) } else { name }
    }

    fn node(&mut self, op: &str, inputs: &[&str]) -> String {
        self.count += 1;
        let name = format!("{}{}", op.to_lowercase(), self.count);
        self.graph = std::mem::take(&mut self.graph).node(op, inputs, &name, &[]);
        name
    }

    /// Expand, filter, project (MobileNetV2, [Sandler 2018]).
    fn block(&mut self, from: &str, [inputs, outputs]: [i64; 2], stride: i64) -> String {
        let inside = inputs * EXPANSION;
        let wide = self.conv(from, [inputs, inside], 1, 1, 1, true);
        let filtered = self.conv(&wide, [inside, inside], 3, stride, inside, true);
        let narrow = self.conv(&filtered, [inside, outputs], 1, 1, 1, false);
        if stride == 1 && inputs == outputs { self.node("Add", &[from, &narrow]) } else { narrow }
    }
}

fn network(seed: u64) -> Vec<u8> {
    let graph = Graph::new("image", &picture(4)).floats("scales", &[4], &[1.0, 1.0, 2.0, 2.0]);
    let mut layers = Layers { graph, random: Pcg64Mcg::seed_from_u64(seed), count: 0 };
    let mut at = layers.conv("image", [4, WIDTHS[0]], 3, 2, 1, true);
    let mut skips = vec![at.clone()];
    for pair in WIDTHS.windows(2) {
        at = layers.block(&at, [pair[0], pair[1]], 2);
        at = layers.block(&at, [pair[1], pair[1]], 1);
        at = layers.block(&at, [pair[1], pair[1]], 1);
        skips.push(at.clone());
    }
    for level in (0..WIDTHS.len() - 1).rev() {
        let narrow = layers.conv(&at, [WIDTHS[level + 1], WIDTHS[level]], 1, 1, 1, false);
        let large = layers.node("Resize", &[&narrow, "", "scales"]);
        let sum = layers.node("Add", &[&large, &skips[level]]);
        let filtered = layers.conv(&sum, [WIDTHS[level], WIDTHS[level]], 3, 1, WIDTHS[level], true);
        at = layers.conv(&filtered, [WIDTHS[level], WIDTHS[level]], 1, 1, 1, true);
    }
    let scores = layers.conv(&at, [WIDTHS[0], CLASSES], 1, 1, 1, false);
    let Layers { graph, .. } = layers;
    graph
        .node("Softmax", &[&scores], "half", &[("axis", &[1])])
        .node("Resize", &["half", "", "scales"], "probabilities", &[])
        .output("probabilities", &picture(CLASSES))
        .bytes()
}
