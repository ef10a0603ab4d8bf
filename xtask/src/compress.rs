//! Compresses the built web files beforehand (`.br`, `.gz`), so that the agent serves them as they lie and spends no
//! time on it: the strongest settings cost seconds here and nothing there.

use crate::dist::{COMPRESSED, compressed_sibling, listed, uncompressed};
use anyhow::{Context, Result};
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Brotli's strongest quality and largest window (RFC 7932).
const BROTLI_QUALITY: u32 = 11;
const BROTLI_WINDOW_BITS: u32 = 24;

/// Compressed already: images and fonts of these formats do not shrink.
const DENSE: [&str; 6] = ["png", "jpg", "jpeg", "webp", "woff2", "ico"];

/// Compresses every file of `folder` whose compressed siblings are missing, on all cores. Returns how many were made.
pub(crate) fn folder(folder: &Path) -> Result<usize> {
    let mut jobs: Vec<(PathBuf, &str)> = Vec::new();
    for (name, path) in listed(folder)? {
        let dense = path.extension().is_some_and(|ending| DENSE.iter().any(|dense| ending == *dense));
        if uncompressed(&name).is_none() && !dense {
            let missing = COMPRESSED.iter().filter(|ending| !compressed_sibling(&path, ending).exists());
            jobs.extend(missing.map(|ending| (path.clone(), *ending)));
        }
    }
    // The longest job first, else it starts last and the other cores wait for it.
    jobs.sort_by_cached_key(|(path, _)| std::cmp::Reverse(fs::metadata(path).map_or(0, |file| file.len())));

    let next = AtomicUsize::new(0);
    let threads = std::thread::available_parallelism().map_or(1, usize::from).min(jobs.len());
    let work = || -> Result<()> {
        while let Some((path, ending)) = jobs.get(next.fetch_add(1, Ordering::Relaxed)) {
            make_sibling(path, ending).with_context(|| format!("cannot compress {}", path.display()))?;
        }
        Ok(())
    };
    std::thread::scope(|scope| {
        let threads: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        threads.into_iter().try_for_each(|thread| thread.join().map_err(|_| anyhow::anyhow!("a compressor died"))?)
    })?;
    Ok(jobs.len())
}

fn make_sibling(path: &Path, ending: &str) -> Result<()> {
    let content = fs::read(path)?;
    let compressed = if ending == "br" { brotli(&content)? } else { gzip(&content)? };
    // Under another name first: a run that is interrupted must not leave half a file behind.
    let target = compressed_sibling(path, ending);
    let unfinished = compressed_sibling(path, "unfinished");
    let unfinished = compressed_sibling(&unfinished, ending);
    fs::write(&unfinished, compressed)?;
    fs::rename(&unfinished, &target)?;
    Ok(())
}

fn brotli(content: &[u8]) -> Result<Vec<u8>> {
    let mut writer = brotli::CompressorWriter::new(Vec::new(), 1 << 16, BROTLI_QUALITY, BROTLI_WINDOW_BITS);
    writer.write_all(content)?;
    writer.flush()?;
    Ok(writer.into_inner())
}

fn gzip(content: &[u8]) -> Result<Vec<u8>> {
    let mut writer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    writer.write_all(content)?;
    Ok(writer.finish()?)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use std::io::Read;

    #[test]
    fn what_was_compressed_comes_back() {
        let content = b"a model that names its own uncertainty ".repeat(500);
        let mut unbrotlied = Vec::new();
        let squeezed = brotli(&content).unwrap();
        brotli::Decompressor::new(&squeezed[..], 4096).read_to_end(&mut unbrotlied).unwrap();
        assert_eq!(unbrotlied, content);

        let mut ungzipped = Vec::new();
        flate2::read::GzDecoder::new(&gzip(&content).unwrap()[..]).read_to_end(&mut ungzipped).unwrap();
        assert_eq!(ungzipped, content);
        assert!(squeezed.len() * 20 < content.len());
    }

    #[test]
    fn a_second_run_makes_nothing_and_dense_files_are_left_alone() {
        let place = std::env::temp_dir().join(format!("semascan-compress-{}", std::process::id()));
        let _ = fs::remove_dir_all(&place);
        fs::create_dir_all(&place).unwrap();
        fs::write(place.join("app.js"), "let a = 1;").unwrap();
        fs::write(place.join("icon.png"), "png").unwrap();
        assert_eq!(folder(&place).unwrap(), 2);
        assert_eq!(folder(&place).unwrap(), 0);
        assert!(place.join("app.js.br").exists() && place.join("app.js.gz").exists());
        assert!(!place.join("icon.png.br").exists());
        fs::remove_dir_all(place).unwrap();
    }
}
