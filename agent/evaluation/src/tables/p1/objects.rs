//! The thirteen objects: five toys, four scanned YCB objects, four starter motors.

use super::toys::toys;
use semascan_inspection::source::{SourceError, TrueMesh};
use semascan_simulation::{Domain, ErrorModel, PartSpec, Sampling, SensorModel, VirtualCellSpec};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Where an object comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Dataset {
    /// The paper's own: Table 3.
    Toys,
    /// Yale-CMU-Berkeley: Table 4.
    Ycb,
    /// Starter motors, which the paper does not have.
    Motors,
}

/// An object to be reconstructed.
#[derive(Clone, Debug)]
pub struct TableObject {
    /// Its name in the tables.
    pub name: String,
    /// Where it comes from.
    pub dataset: Dataset,
    /// Class of its pixels; 0 = the labels of the view are its classes.
    pub(super) class: u16,
    part: PartSpec,
    /// Seed of the motor; `None` where the shape is given.
    motor: Option<u64>,
}

/// What the camera and the cell are like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    /// Columns and rows.
    pub size: (u32, u32),
    /// Robot and table errors.
    pub errors: ErrorModel,
    /// The camera.
    pub sensor: SensorModel,
}

impl Setting {
    /// In the manner of the paper: 640x480 from 0.4 m and more, a consumer RGB-D camera (0.4 mm noise at half a metre),
    /// a robot that is off by a tenth of a degree and half a millimetre an axis.
    pub const P1: Self = Self {
        size: (640, 480),
        errors: ErrorModel { robot: (2e-3, 5e-4), ..ErrorModel::DEFAULT },
        sensor: SensorModel {
            sigma: 4e-4,
            ripple: 2e-4,
            quantum: 1e-4,
            outliers: 1e-3,
            color: 0.015,
            ..SensorModel::DEFAULT
        },
    };
}

/// The objects; YCB is left out where its folder is not known. The toys' meshes are written into `folder`.
///
/// # Errors
/// If a mesh cannot be written, or a YCB mesh is missing.
pub fn objects(folder: &Path, ycb: Option<&Path>) -> Result<Vec<TableObject>, SourceError> {
    let mut objects = Vec::new();
    for (toy, class) in toys().iter().zip(1..) {
        let path = folder.join(format!("{}.obj", toy.name));
        std::fs::write(&path, toy.obj()).map_err(|source| SourceError::Io { path: path.clone(), source })?;
        objects.push(TableObject::mesh(toy.name, Dataset::Toys, class, path, 1e-3));
    }
    for (name, class) in ["lemon", "orange", "plum", "mug"].into_iter().zip(1..) {
        let Some(path) = ycb.map(|folder| folder.join(name).join("textured.obj")) else { continue };
        if !path.is_file() {
            let missing = std::io::ErrorKind::NotFound.into();
            return Err(SourceError::Io { path, source: missing });
        }
        // The mug's scan is in centimetres, the fruit are in metres.
        let scale = if name == "mug" { 0.01 } else { 1.0 };
        objects.push(TableObject::mesh(name, Dataset::Ycb, class, path, scale));
    }
    objects.extend((1..=4).map(|k| TableObject {
        name: format!("starter motor {k}"),
        dataset: Dataset::Motors,
        class: 0,
        part: PartSpec::StarterMotor { cell: 1.2 },
        motor: Some(k),
    }));
    Ok(objects)
}

impl TableObject {
    fn mesh(name: &str, dataset: Dataset, class: u16, path: PathBuf, scale: f32) -> Self {
        Self { name: name.into(), dataset, class, part: PartSpec::Mesh { path, scale: Some(scale) }, motor: None }
    }

    /// Classes a flip may turn to, `none` included.
    pub(super) fn classes(&self) -> u16 {
        match self.dataset {
            Dataset::Toys | Dataset::Motors => 6,
            Dataset::Ycb => 5,
        }
    }

    /// The inspection of run `seed`: another cell, noise and errors; the object stays the same.
    pub(super) fn spec(&self, seed: u64, views: u32, setting: &Setting) -> VirtualCellSpec {
        VirtualCellSpec {
            uri: format!("virtual:{} (table P1, run {seed})", self.name),
            part: self.part.clone(),
            seed,
            part_seed: self.motor,
            views,
            size: setting.size,
            errors: setting.errors,
            noise: Some(setting.sensor),
            sampling: Sampling::Turn,
            domain: Domain::Standard,
        }
    }
}

/// The object's own surface: triangles of a component class (a motor's chuck is not part of it).
pub(super) fn own_surface(truth: &TrueMesh) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let own = |t: &&[u32; 3]| t.iter().all(|&v| truth.labels.get(v as usize).is_some_and(|&l| l != 0));
    (truth.vertices.clone(), truth.triangles.iter().filter(own).copied().collect())
}
