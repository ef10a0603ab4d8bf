//! Where views come from: a file or folder a source. Each implements [`Source`], and has a line in the table `KINDS`.

pub mod bop;
pub mod camera_mask;
pub mod depth_map;
mod options;
pub mod pcd;
pub mod training_set;

pub use options::OpenOptions;

use bop::BopSource;
use pcd::PcdSource;
use semascan_inspection::source::{Source, SourceError};
use std::path::Path;

/// An open source, or why it cannot be opened.
type Opened = Result<Box<dyn Source>, SourceError>;

/// A kind of source that a path may name.
struct Kind {
    /// What it is, for people who named something else.
    name: &'static str,
    /// Whether the file or folder is one.
    recognizes: fn(&Path) -> bool,
    /// Opens it; what the options say is used where it applies.
    open: fn(&Path, &OpenOptions) -> Opened,
}

/// Every kind, in the order in which they are tried.
const KINDS: &[Kind] = &[
    Kind {
        name: "a BOP scene folder (with scene_camera.json)",
        recognizes: BopSource::is_scene,
        open: |path, options| Ok(Box::new(BopSource::open(path, options)?)),
    },
    Kind {
        name: "organized clouds in a PCD file or a folder of them",
        recognizes: PcdSource::is_source,
        open: |path, options| Ok(Box::new(PcdSource::open(path, options.unit.map(options::unit))?)),
    },
];

/// Opens the recording that `uri` names, by what lies there. A [`CameraMask`](semascan_inspection::spec::CameraMask) alone
/// is options too.
///
/// # Errors
/// [`SourceError`] if there is none, or it cannot be opened.
pub fn open(uri: &str, options: impl Into<OpenOptions>) -> Result<Box<dyn Source>, SourceError> {
    let refuse = |reason: String| SourceError::Uri { uri: uri.into(), reason };
    if let Some((scheme, _)) = uri.split_once("://") {
        return Err(refuse(format!("no source speaks {scheme}://")));
    }
    let path = Path::new(uri);
    if !path.exists() {
        return Err(refuse("no such file or folder".into()));
    }
    match KINDS.iter().find(|kind| (kind.recognizes)(path)) {
        Some(kind) => (kind.open)(path, &options.into()),
        None => {
            let names: Vec<&str> = KINDS.iter().map(|kind| kind.name).collect();
            Err(refuse(format!("neither {}", names.join(" nor "))))
        }
    }
}
