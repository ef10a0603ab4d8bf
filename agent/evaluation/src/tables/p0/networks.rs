//! [Remanufacturing paper], Table 3 and the single networks of Table 5: mean IoU by network and by how colour and depth
//! meet.
//!
//! Every variant is trained alike on the compact backbone and asked once about each view, without augmentation. The
//! paper has VGG16 and ResNet34, started from ImageNet, and pictures of real motors: its figures stand beside the same
//! variant of ours for orientation, not for comparison.

use super::super::setting::{Judged, NOT_TRAINED, images_seen, pictures, score_singles};
use super::super::{DomainScores, NetworkSetting, Progress};
use crate::{NetworkError, TestDomain};
use serde::Serialize;
use std::io::{self, Write};

/// A model, what it is, and the paper's figures of the same variant by their names there.
type Variant = (&'static str, &'static str, &'static [(&'static str, f64)]);

/// All of them.
const VARIANTS: [Variant; 13] = [
    ("u-net-edge", "U-Net, colour", &[("U_opt", 0.9187)]),
    ("u-net-edge-depth", "U-Net, depth", &[]),
    ("ud-net-edge-early", "UD-Net, early", &[]),
    ("ud-net-edge-intermediate-add", "UD-Net, intermediate, addition", &[("UD_opt,v", 0.9291), ("UD_opt,t", 0.9662)]),
    ("ud-net-edge-intermediate-conv", "UD-Net, intermediate, convolution", &[]),
    ("ud-net-edge-late-add", "UD-Net, late, addition", &[]),
    ("ud-net-edge-late-network", "UD-Net, late, network", &[]),
    ("mask-rcnn-edge", "M-Net, colour", &[("M_opt", 0.9537)]),
    ("md-net-edge-early", "MD-Net, early", &[("MD_opt,v", 0.9527), ("MD_opt,t", 0.9464)]),
    ("md-net-edge-intermediate-add", "MD-Net, intermediate, addition", &[]),
    ("md-net-edge-intermediate-conv", "MD-Net, intermediate, convolution", &[]),
    ("md-net-edge-late-add", "MD-Net, late, addition", &[]),
    ("md-net-edge-late-network", "MD-Net, late, network", &[]),
];

/// One network.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Its model.
    pub model: String,
    /// What it is.
    pub variant: String,
    /// Pictures that it was trained on, repeats counted, where its manifest says so.
    pub images_seen: Option<i64>,
    /// Ours by domain; empty: not trained here.
    pub domains: Vec<DomainScores>,
    /// The paper's mean IoU of the same variant, by its name there.
    pub published: Vec<(String, f64)>,
}

/// The table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Table3 {
    /// How the figures are to be read.
    pub setting: String,
    /// Ours, the paper's beside them.
    pub rows: Vec<Row>,
}

/// Judges every variant that is there.
///
/// # Errors
/// [`NetworkError`] if one that is there cannot be used.
pub fn run(setting: &NetworkSetting, progress: &mut Progress<'_>) -> Result<Table3, NetworkError> {
    let names = VARIANTS.map(|(model, _, _)| model);
    let scored = score_singles(&names, setting, progress)?;
    let row = |((model, variant, published), scored): (&Variant, Option<Judged>)| {
        let (manifest, domains) = scored.unzip();
        Row {
            model: (*model).to_owned(),
            variant: (*variant).to_owned(),
            images_seen: manifest.as_ref().and_then(images_seen),
            domains: domains.unwrap_or_default(),
            published: published.iter().map(|(name, iou)| ((*name).to_owned(), *iou)).collect(),
        }
    };
    let rows = VARIANTS.iter().zip(scored).map(row).collect();
    let test = &setting.test;
    let setting = format!(
        "ours: compact backbone, trained on simulated motors only; {} other motors, {} views each, {}x{} camera, one network \
         asked once; mean over the five components of the IoU of all pixels together. Published: VGG16 (U, UD) and ResNet34 \
         (M, MD) from ImageNet, real motors; v = augmented validation, t = ten other motors. Not comparable",
        test.motors.len(),
        test.views,
        test.size.0,
        test.size.1
    );
    Ok(Table3 { setting, rows })
}

/// Writes the table for people.
///
/// # Errors
/// If `out` fails.
pub fn print(out: &mut dyn Write, report: &Table3) -> io::Result<()> {
    write!(out, "{:<36}{:>10}", "P0, Table 3 and 5: mean IoU", "pictures")?;
    for domain in TestDomain::ALL {
        write!(out, "{:>14}", domain.name())?;
    }
    writeln!(out, "   published")?;
    for row in &report.rows {
        write!(out, "{:<36}{:>10}", row.variant, pictures(row.images_seen))?;
        if row.domains.is_empty() {
            write!(out, "{:>42}", NOT_TRAINED)?;
        }
        for domain in &row.domains {
            write!(out, "{:>14.4}", domain.scores.mean_iou)?;
        }
        let published: Vec<String> = row.published.iter().map(|(name, iou)| format!("{name} {iou:.4}")).collect();
        writeln!(out, "   {}", if published.is_empty() { "-".to_owned() } else { published.join(", ") })?;
    }
    writeln!(out, "{}", report.setting)
}
