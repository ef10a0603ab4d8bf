//! The segmenter on networks small enough to compute by hand: what all of its tests share.

mod domain;
mod load;
mod objects;
mod pixels;

use super::*;
use crate::segment::ClassField;
use crate::segment::network::fixtures::{engines, manifest, onnx, view, write};
use crate::segment::network::{Augmentation, Manifest, ModelError};
use crate::view::{PoseEvidence, covariance_of_prior};
use nalgebra::{Isometry3, Point3};
use std::sync::Arc;
use tempfile::TempDir;

/// Scores of none, red and green: `softmax(0, 6 r - b, 6 g - b)`.
const WEIGHTS: [&[f32]; 3] = [&[0.0, 0.0, 0.0], &[6.0, 0.0, 0.0], &[0.0, 6.0, 0.0]];
const NAMES: [&str; 3] = ["none", "red", "green"];

fn classifier(b: f32) -> Vec<u8> {
    onnx::classifier(&WEIGHTS, &[0.0, -b, -b])
}

/// What [`classifier`] says of a colour.
fn closed_form(color: [u8; 3], b: f32) -> [f32; 3] {
    let scores = [0.0, 6.0 * f32::from(color[0]) / 255.0 - b, 6.0 * f32::from(color[1]) / 255.0 - b];
    let sum: f32 = scores.iter().map(|s| s.exp()).sum();
    scores.map(|s| s.exp() / sum)
}

fn color(u: u32, v: u32) -> [u8; 3] {
    [(u * 5) as u8, (v * 6) as u8, 9]
}

/// The classes of what is inspected: in another order than the networks', and one that these do not know.
fn taxonomy() -> Taxonomy {
    Taxonomy::from_names(&["green", "blue", "red"], &["wear", "corrosion"])
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
fn segmenters(folders: &[&TempDir], volume: Option<Volume>, config: &NetworkConfig) -> Vec<NetworkSegmenter> {
    engines()
        .iter()
        .map(|engine| {
            let load = |f: &&TempDir| NetworkModel::load(f.path(), engine.as_ref(), 1).expect("fits its manifest");
            let models = folders.iter().map(load).collect();
            NetworkSegmenter::new(models, engine.description(), &taxonomy(), volume, config.clone())
                .expect("go together")
        })
        .collect()
}

fn soft(field: &ClassField) -> (usize, &[u8], &[u8]) {
    match field {
        ClassField::Soft { classes, probabilities, sigma, .. } => (*classes, probabilities, sigma),
        ClassField::Hard(_) => panic!("networks give probabilities"),
    }
}
