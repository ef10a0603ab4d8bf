//! Whether the files of a folder belong together: the record names them, and each carries the record's generation.

use crate::contents::{MODEL_FILES, RECORD, REPORT, VIEWS, is_view_cloud};
use semascan_formats::regular_file;
use semascan_model::record::InspectionRecord;
use serde_json::Value;
use std::io::{self, BufRead, BufReader, ErrorKind, Read};
use std::path::{Path, PathBuf};

/// Longest header of a PLY file that is searched, bytes.
const LONGEST_HEADER: u64 = 1 << 20;

/// Bytes of an HTML file in which its generation stands.
const LONGEST_HEAD: u64 = 4 << 10;

/// Why the files of a folder are no set.
#[derive(Debug, thiserror::Error)]
pub enum SetError {
    /// A file cannot be read.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The underlying I/O error.
        source: io::Error,
    },
    /// A file that the record names is not there.
    #[error("{}: is missing, though the record beside it names it", path.display())]
    Missing {
        /// The file.
        path: PathBuf,
    },
    /// A file belongs to another inspection, or to another writing of this one.
    #[error(
        "{}: does not belong to the record beside it ({}): files of several inspections are mixed in this folder",
        path.display(),
        described(found, expected)
    )]
    Mixed {
        /// The file.
        path: PathBuf,
        /// Its generation.
        found: Option<String>,
        /// That of the record.
        expected: Option<String>,
    },
    /// The record names what no inspection writes.
    #[error("{}: files.names: {name} is no file of an inspection", path.display())]
    Name {
        /// The record.
        path: PathBuf,
        /// The name.
        name: String,
    },
}

fn described(found: &Option<String>, expected: &Option<String>) -> String {
    let or_none = |id: &Option<String>| id.clone().unwrap_or_else(|| "none".into());
    format!("generation {}, the record's is {}", or_none(found), or_none(expected))
}

/// Checks that the files beside `record` in `folder` are those that were written with it, and no others. A record of a
/// version that kept no list must stand beside files without a generation.
///
/// # Errors
/// [`SetError`] naming the file.
pub fn check_set(folder: &Path, record: &InspectionRecord) -> Result<(), SetError> {
    let expected = record.files.as_ref().map(|files| files.generation.clone());
    let names = record.files.as_ref().map(|files| files.names.as_slice()).unwrap_or_default();
    for name in names {
        let view = name.strip_prefix(VIEWS).and_then(|rest| rest.strip_prefix('/'));
        if !MODEL_FILES.contains(&name.as_str()) && !view.is_some_and(is_view_cloud) {
            return Err(SetError::Name { path: folder.join(RECORD), name: name.clone() });
        }
        // A report is made of the other files: whoever removed it loses nothing.
        check_file(&folder.join(name), &expected, name != REPORT)?;
    }
    // A file that the record does not name is of an earlier inspection.
    for name in MODEL_FILES.iter().filter(|name| !names.iter().any(|listed| listed == *name)) {
        let path = folder.join(name);
        match (&expected, path.exists()) {
            (None, _) => check_file(&path, &None, false)?,
            (Some(_), true) => {
                let found = generation_of(&path).map_err(|source| SetError::Io { path: path.clone(), source })?;
                // A report can be written later, from the files of the set.
                if *name == REPORT && found == expected {
                    continue;
                }
                return Err(SetError::Mixed { path, found, expected });
            }
            (Some(_), false) => {}
        }
    }
    Ok(())
}

/// Checks the files of `folder` against the record in it, if one that can be read is there.
///
/// # Errors
/// [`SetError`] naming the file.
pub fn check_folder(folder: &Path) -> Result<(), SetError> {
    match regular_file::read_to_string(&folder.join(RECORD)).map(|text| InspectionRecord::from_json(&text)) {
        Ok(Ok(record)) => check_set(folder, &record),
        _ => Ok(()),
    }
}

/// Checks one file against the record that lies in its folder, if one does: a file by itself belongs to nothing.
///
/// # Errors
/// [`SetError::Mixed`] if it is a file of an inspection's folder and of another generation than the record there.
pub fn check_beside_record(file: &Path) -> Result<(), SetError> {
    let Some(name) = file.file_name().and_then(|name| name.to_str()).filter(|name| MODEL_FILES.contains(name)) else {
        return Ok(());
    };
    let folder = file.parent().unwrap_or(Path::new("."));
    let Ok(text) = regular_file::read_to_string(&folder.join(RECORD)) else { return Ok(()) };
    let Ok(record) = InspectionRecord::from_json(&text) else { return Ok(()) };
    let expected = record.files.map(|files| files.generation);
    check_file(&folder.join(name), &expected, true)
}

fn check_file(path: &Path, expected: &Option<String>, must_exist: bool) -> Result<(), SetError> {
    match generation_of(path) {
        Ok(found) if found == *expected => Ok(()),
        Ok(found) => Err(SetError::Mixed { path: path.to_owned(), found, expected: expected.clone() }),
        Err(error) if error.kind() == ErrorKind::NotFound && must_exist => {
            Err(SetError::Missing { path: path.to_owned() })
        }
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        Err(source) => Err(SetError::Io { path: path.to_owned(), source }),
    }
}

/// The generation that a PLY, GLB or HTML file carries; `None` if it carries none.
fn generation_of(path: &Path) -> io::Result<Option<String>> {
    let mut file = BufReader::new(regular_file::open(path)?);
    if path.extension().is_some_and(|extension| extension == "html") {
        let mut head = Vec::new();
        file.take(LONGEST_HEAD).read_to_end(&mut head)?;
        let head = String::from_utf8_lossy(&head);
        let meta = head.split_once("<meta name=\"generation\" content=\"").and_then(|(_, rest)| rest.split_once('"'));
        return Ok(meta.map(|(generation, _)| generation.to_owned()));
    }
    if path.extension().is_some_and(|extension| extension == "glb") {
        let asset = glb_asset(&mut file)?;
        return Ok(asset["extras"]["generation"].as_str().map(str::to_owned));
    }
    let mut header = file.take(LONGEST_HEADER);
    let mut line = Vec::new();
    while header.read_until(b'\n', &mut line)? > 0 {
        let text = String::from_utf8_lossy(&line);
        if let Some(generation) = text.trim_end().strip_prefix("comment generation ") {
            return Ok(Some(generation.to_owned()));
        }
        if text.trim_end() == "end_header" {
            break;
        }
        line.clear();
    }
    Ok(None)
}

/// `asset` of a GLB file, which says what wrote it; null where the file is none.
pub(crate) fn glb_asset(file: &mut impl Read) -> io::Result<Value> {
    let mut head = [0; 20];
    let complete = match file.read_exact(&mut head) {
        Err(error) if error.kind() == ErrorKind::UnexpectedEof => false,
        result => result.is_ok(),
    };
    if !complete || &head[..4] != b"glTF" || &head[16..] != b"JSON" {
        return Ok(Value::Null);
    }
    let length = u32::from_le_bytes([head[12], head[13], head[14], head[15]]);
    let json: Result<Value, _> = serde_json::from_reader(file.take(length.into()));
    Ok(json.ok().as_mut().and_then(|json| json.get_mut("asset")).map(Value::take).unwrap_or_default())
}
