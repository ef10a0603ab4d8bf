//! The folder of built web files (`www/dist`): kept equal to a set of files with as few writes as possible, because
//! whatever embeds or compresses a file looks at its time of change.

use anyhow::{Context, Result};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Content by path, relative to the folder, with `/` between the parts.
pub(crate) type Files = BTreeMap<String, Vec<u8>>;

/// Endings of the compressed siblings that [`crate::compress`] makes.
pub(crate) const COMPRESSED: [&str; 2] = ["br", "gz"];

/// Reads a folder into memory, leaving out hidden entries and the folders named in `except` at its top.
pub(crate) fn read(folder: &Path, except: &[&str]) -> Result<Files> {
    let mut files = Files::new();
    collect(folder, "", except, &mut files)?;
    Ok(files)
}

fn collect(folder: &Path, prefix: &str, except: &[&str], files: &mut Files) -> Result<()> {
    for entry in fs::read_dir(folder).with_context(|| format!("cannot read {}", folder.display()))? {
        let entry = entry?;
        let name = entry.file_name().into_string().map_err(|name| anyhow::anyhow!("{name:?} is not UTF-8"))?;
        if name.starts_with('.') || except.contains(&name.as_str()) {
            continue;
        }
        let path = format!("{prefix}{name}");
        if entry.path().is_dir() {
            collect(&entry.path(), &format!("{path}/"), &[], files)?;
        } else {
            let content = fs::read(entry.path()).with_context(|| format!("cannot read {}", entry.path().display()))?;
            files.insert(path, content);
        }
    }
    Ok(())
}

/// Makes `folder` hold exactly `files`: writes what differs, removes what is no longer there, and removes compressed
/// siblings of what changed. Returns the number of files written.
pub(crate) fn update(folder: &Path, files: &Files) -> Result<usize> {
    fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    for (stale, path) in listed(folder)? {
        let source = uncompressed(&stale).unwrap_or(&stale);
        if !files.contains_key(source) && !files.contains_key(&stale) {
            fs::remove_file(&path)?;
        }
    }
    let mut written = 0;
    for (name, content) in files {
        let path = folder.join(name);
        if fs::read(&path).is_ok_and(|old| old == *content) {
            continue;
        }
        remove_compressed(&path)?;
        if let Some(parent) = path.parent() {
            fs::create_dir_all(parent)?;
        }
        fs::write(&path, content).with_context(|| format!("cannot write {}", path.display()))?;
        written += 1;
    }
    Ok(written)
}

/// Removes every compressed sibling, so that a server finds the plain files only.
pub(crate) fn remove_all_compressed(folder: &Path) -> Result<()> {
    for (name, path) in listed(folder)? {
        if uncompressed(&name).is_some() {
            fs::remove_file(path)?;
        }
    }
    Ok(())
}

/// `app.js.br` and `app.js.gz` beside `app.js`.
pub(crate) fn compressed_sibling(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".");
    name.push(ending);
    PathBuf::from(name)
}

/// The name of the file a compressed sibling was made of; `None` for any other name.
pub(crate) fn uncompressed(name: &str) -> Option<&str> {
    name.rsplit_once('.').filter(|(_, ending)| COMPRESSED.contains(ending)).map(|(source, _)| source)
}

fn remove_compressed(path: &Path) -> Result<()> {
    for ending in COMPRESSED {
        let sibling = compressed_sibling(path, ending);
        if sibling.exists() {
            fs::remove_file(sibling)?;
        }
    }
    Ok(())
}

/// Every file of the folder: its relative name and its path.
pub(crate) fn listed(folder: &Path) -> Result<Vec<(String, PathBuf)>> {
    let names = read(folder, &[])?.into_keys();
    Ok(names.map(|name| (name.clone(), folder.join(name))).collect())
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn scratch(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("semascan-dist-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        folder
    }

    fn files(entries: &[(&str, &str)]) -> Files {
        entries.iter().map(|(name, content)| ((*name).to_owned(), content.as_bytes().to_vec())).collect()
    }

    #[test]
    fn only_what_differs_is_written() {
        let folder = scratch("differs");
        assert_eq!(update(&folder, &files(&[("a.js", "1"), ("icons/b.svg", "2")])).unwrap(), 2);
        assert_eq!(update(&folder, &files(&[("a.js", "1"), ("icons/b.svg", "3")])).unwrap(), 1);
        assert_eq!(fs::read_to_string(folder.join("icons/b.svg")).unwrap(), "3");
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn stale_files_and_stale_compressed_siblings_go() {
        let folder = scratch("stale");
        update(&folder, &files(&[("a.js", "1"), ("kept.js", "1"), ("old.js", "1")])).unwrap();
        for name in ["a.js.br", "kept.js.br", "old.js.gz"] {
            fs::write(folder.join(name), "squeezed").unwrap();
        }
        update(&folder, &files(&[("a.js", "2"), ("kept.js", "1")])).unwrap();
        let left: Vec<_> = listed(&folder).unwrap().into_iter().map(|(name, _)| name).collect();
        assert_eq!(left, ["a.js", "kept.js", "kept.js.br"]);
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn a_folder_is_read_without_hidden_and_excepted_entries() {
        let folder = scratch("read");
        update(&folder, &files(&[("index.html", "x"), ("dist/app.js", "y"), ("icons/dist/a.svg", "z")])).unwrap();
        fs::write(folder.join(".hidden"), "h").unwrap();
        let names: Vec<_> = read(&folder, &["dist"]).unwrap().into_keys().collect();
        assert_eq!(names, ["icons/dist/a.svg", "index.html"]);
        fs::remove_dir_all(folder).unwrap();
    }
}
