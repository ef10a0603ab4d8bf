//! Where views come from: a file or folder a source. Each implements [`Source`], and has a line in the table `KINDS`.

pub mod bop;
pub mod camera_mask;
pub mod depth_map;
pub mod pcd;
pub mod training_set;

use bop::BopSource;
use pcd::PcdSource;
use semascan_formats::unit::Unit;
use semascan_inspection::source::{Source, SourceError};
use semascan_inspection::spec::CameraMask;
use std::path::Path;

/// An open source, or why it cannot be opened.
type Opened = Result<Box<dyn Source>, SourceError>;

/// A kind of source that a path may name.
struct Kind {
    /// What it is, for people who named something else.
    name: &'static str,
    /// Whether the file or folder is one.
    recognizes: fn(&Path) -> bool,
    /// Opens it; the camera mask is for cameras that show their own robot.
    open: fn(&Path, &CameraMask) -> Opened,
}

/// Every kind, in the order in which they are tried.
const KINDS: &[Kind] = &[
    Kind {
        name: "a BOP scene folder (with scene_camera.json)",
        recognizes: BopSource::is_scene,
        open: |path, mask| Ok(Box::new(BopSource::open(path, mask)?)),
    },
    Kind {
        name: "organized clouds in a PCD file or a folder of them",
        recognizes: PcdSource::is_source,
        open: |path, _| Ok(Box::new(PcdSource::open(path, None)?)),
    },
];

/// Opens the recording that `uri` names, by what lies there. A path may be followed by `?unit=mm` (or cm, m, inch) where the
/// format does not fix the unit.
///
/// # Errors
/// [`SourceError`] if there is none, or it cannot be opened.
pub fn open(uri: &str, mask: &CameraMask) -> Result<Box<dyn Source>, SourceError> {
    let refuse = |reason: String| SourceError::Uri { uri: uri.into(), reason };
    if let Some((scheme, _)) = uri.split_once("://") {
        return Err(refuse(format!("no source speaks {scheme}://")));
    }
    let (name, unit) = match uri.rsplit_once("?unit=") {
        Some((name, unit)) if !Path::new(uri).exists() => {
            let known = Unit::parse(unit);
            (name, Some(known.ok_or_else(|| refuse(format!("key unit: {unit:?} is not mm, cm, m or inch")))?))
        }
        _ => (uri, None),
    };
    let path = Path::new(name);
    if !path.exists() {
        return Err(refuse("no such file or folder".into()));
    }
    if unit.is_some() && !BopSource::is_scene(path) && PcdSource::is_source(path) {
        return Ok(Box::new(PcdSource::open(path, unit)?));
    }
    if unit.is_some() {
        return Err(refuse("key unit: only PCD files leave their unit open".into()));
    }
    match KINDS.iter().find(|kind| (kind.recognizes)(path)) {
        Some(kind) => (kind.open)(path, mask),
        None => {
            let names: Vec<&str> = KINDS.iter().map(|kind| kind.name).collect();
            Err(refuse(format!("neither {}", names.join(" nor "))))
        }
    }
}
