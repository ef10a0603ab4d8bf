//! The name of a calibration in `cell.toml`; comments and all else there stay as they are.

use crate::commands::Failure;
use crate::commands::config;
use anyhow::{Context, anyhow};
use semascan_formats::regular_file;
use semascan_store::write_file;
use std::io::Write;
use std::path::Path;
use toml_edit::{DocumentMut, Item, Table, value};

/// The table and the key.
const SECTION: &str = "cell";
const KEY: &str = "calibration";

/// The content of `cell.toml` with the calibration's name in it.
///
/// # Errors
/// [`Failure::Call`] naming the file, if it is none or cannot be read.
pub(super) fn with_calibration(cell: &Path, calibration: &Path) -> Result<String, Failure> {
    let name = || cell.display().to_string();
    let text = regular_file::read_to_string(cell).with_context(name)?;
    let name_of =
        calibration.to_str().ok_or_else(|| Failure::Call(anyhow!("{}: is no UTF-8", calibration.display())))?;
    let edited = edited(&text, name_of).with_context(name).map_err(Failure::Call)?;
    // What was no cell.toml before is none now either: that is said before anything is written.
    config::parse(&edited).with_context(name).map_err(Failure::Call)?;
    Ok(edited)
}

/// Writes it.
///
/// # Errors
/// [`Failure`] naming the file.
pub(super) fn put(cell: &Path, content: &str) -> Result<(), Failure> {
    Ok(write_file(cell, |file| Ok(file.write_all(content.as_bytes())?))?)
}

fn edited(text: &str, calibration: &str) -> anyhow::Result<String> {
    let mut document: DocumentMut = text.parse()?;
    let section = document.entry(SECTION).or_insert(Item::Table(Table::new()));
    let table = section.as_table_like_mut().with_context(|| format!("{SECTION} is no table"))?;
    match table.get_mut(KEY).and_then(Item::as_value_mut) {
        // A comment behind it stays.
        Some(there) => {
            let decor = there.decor().clone();
            *there = calibration.into();
            *there.decor_mut() = decor;
        }
        None => {
            table.insert(KEY, value(calibration));
        }
    }
    Ok(document.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_name_changes() {
        let text = "# Cell 3\nlabels = \"none\" # for now\n\n[cell]\n# The robot's\nframes.ee = \"tool0\"\n\n[serve]\n# nobody\nallow_hosts = []\n";
        let once = edited(text, "a.json").expect("edited");
        assert_eq!(once.replace("calibration = \"a.json\"\n", ""), text);
        let config = config::parse(&once).expect("a cell.toml");
        assert_eq!(config.cell.calibration.as_deref(), Some(Path::new("a.json")));
        let commented = once.replace("\"a.json\"", "\"a.json\" # of May");
        let twice = edited(&commented, "b.json").expect("edited");
        assert_eq!(twice, commented.replace("a.json", "b.json"));
    }

    #[test]
    fn the_sample_and_an_empty_file_get_it() {
        for text in [config::SAMPLE, ""] {
            let edited = edited(text, "c.json").expect("edited");
            let config = config::parse(&edited).expect("a cell.toml");
            assert_eq!(config.cell.calibration.as_deref(), Some(Path::new("c.json")));
            let lines = edited.lines().filter(|line| !line.contains("calibration = \"c.json\"") && *line != "[cell]");
            let before = text.lines().filter(|line| *line != "[cell]");
            assert!(lines.eq(before), "all other lines stay");
        }
        assert!(edited("cell = 1", "d.json").is_err());
    }
}
