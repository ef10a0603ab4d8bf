//! Textures baked of the photographs against pictures from places where no photograph was taken, beside the colours of vertices;
//! and a printed grid of 2 mm on them.

mod grid;
mod held_out;
mod print;

pub use grid::Legibility;
pub use held_out::{Against, ColorErrors};
pub use print::print;

use super::{InspectError, inspect};
use semascan_inspection::Inspected;
use semascan_inspection::record::isometry;
use semascan_inspection::source::{Source, SourceError};
use semascan_inspection::spec::InspectionSpec;
use semascan_perception::view::View;
use semascan_simulation::{VirtualCell, VirtualCellSpec};
use semascan_texture::{Photograph, TextureError, TextureOptions, TexturedMesh, texture};
use serde::Serialize;
use std::borrow::Cow;
use std::path::PathBuf;
use std::sync::Arc;

/// What is inspected.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Config {
    /// Seeds of the motors.
    pub motors: Vec<u64>,
    /// Views of each. As many are held out, each halfway between two of them.
    pub views: u32,
    /// Columns and rows.
    pub size: (u32, u32),
    /// Whether the printed grid is inspected, too.
    pub grid: bool,
    /// Where pictures are written to that show what is compared.
    #[serde(skip)]
    pub pictures: Option<PathBuf>,
}

impl Default for Config {
    /// Five motors that no network was trained on.
    fn default() -> Self {
        Self { motors: (1001..=1005).collect(), views: 12, size: (960, 720), grid: true, pictures: None }
    }
}

/// One motor.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Motor {
    /// Its seed.
    pub seed: u64,
    /// Voxel edge, metres.
    pub voxel: f64,
    /// Length of a texel, metres.
    pub texel: f64,
    /// Columns and rows of the atlas.
    pub atlas: (u32, u32),
    /// Bytes of the atlas as PNG.
    pub bytes: usize,
    /// Charts.
    pub charts: usize,
    /// Share of the surface that no photograph shows.
    pub unseen: f64,
    /// Errors, by what the model is compared with.
    pub errors: Vec<ColorErrors>,
}

/// The table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// What was inspected.
    pub config: Config,
    /// By motor.
    pub motors: Vec<Motor>,
    /// Over all motors, each counting alike.
    pub errors: Vec<ColorErrors>,
    /// The printed grid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub grid: Option<Legibility>,
}

/// Why there is no table.
#[derive(Debug, thiserror::Error)]
pub enum TextureTableError {
    /// The part cannot be simulated.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// It could not be inspected.
    #[error("{part}: {source}")]
    Inspect {
        /// Which.
        part: String,
        /// Why.
        source: InspectError,
    },
    /// It has no texture.
    #[error("{part}: {source}")]
    Texture {
        /// Which.
        part: String,
        /// Why.
        source: TextureError,
    },
    /// There is nothing to compare with.
    #[error("{part}: no true pose is known")]
    NoTruth {
        /// Which.
        part: String,
    },
    /// A file could not be written.
    #[error("{path}: {source}")]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
}

/// Inspects every part and compares; `on_step` gets how many are done, and of how many.
///
/// # Errors
/// [`TextureTableError`] naming the part.
pub fn run(config: &Config, on_step: &dyn Fn(usize, usize)) -> Result<Report, TextureTableError> {
    let count = config.motors.len() + usize::from(config.grid);
    let mut motors = Vec::new();
    for seed in &config.motors {
        on_step(motors.len(), count);
        motors.push(held_out::motor(config, *seed)?);
    }
    on_step(motors.len(), count);
    let grid = config.grid.then(|| grid::printed(config)).transpose()?;
    let errors = held_out::mean_errors(motors.iter().map(|motor| motor.errors.as_slice()));
    Ok(Report { config: config.clone(), motors, errors, grid })
}

/// A part that was inspected, with the texture of its photographs.
struct Baked {
    inspected: Inspected,
    views: Vec<View>,
    textured: TexturedMesh,
}

/// Inspects the part at `uri` and lays its photographs onto the model.
fn baked(part: &str, uri: &str) -> Result<Baked, TextureTableError> {
    let cell = VirtualCellSpec::parse(uri)?;
    let source = Box::new(VirtualCell::open(&cell)?);
    let inspected = inspect(InspectionSpec::default(), source)
        .map_err(|source| TextureTableError::Inspect { part: part.to_owned(), source })?;
    let mut again = VirtualCell::open(&cell)?;
    let views = std::iter::from_fn(|| again.next_view()).collect::<Result<Vec<View>, SourceError>>()?;
    let photograph = |number: u32| {
        let recorded = inspected.record.views.iter().find(|view| view.index == number && view.accepted);
        let pose = recorded.and_then(|view| view.pose.as_ref()).ok_or("has no pose")?;
        let view = views.get(number as usize).ok_or("is not there")?;
        Ok(Photograph {
            rgb: Arc::clone(&view.rgb),
            depth: Cow::Borrowed(view.depth.metres.as_slice()),
            intrinsics: view.intrinsics,
            table_from_camera: isometry(pose),
        })
    };
    let count = u32::try_from(views.len()).unwrap_or(u32::MAX);
    let textured = texture(&inspected.mesh, count, photograph, &TextureOptions::default())
        .map_err(|source| TextureTableError::Texture { part: part.to_owned(), source })?;
    Ok(Baked { inspected, views, textured })
}
