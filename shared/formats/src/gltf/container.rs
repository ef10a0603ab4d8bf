//! The GLB container (glTF 2.0, section 4.4): header, JSON chunk padded with spaces, BIN chunk padded with zeros.

use crate::WriteError;
use crate::text::without_mark;
use std::io::Write;

/// Writes both chunks; an empty buffer gives no BIN chunk.
pub(super) fn write(mut out: impl Write, json: &[u8], binary: &[u8]) -> Result<(), WriteError> {
    let chunks = [(b"JSON", json, b' '), (b"BIN\0", binary, 0)];
    let present = || chunks.iter().filter(|(_, bytes, _)| !bytes.is_empty());
    let total = 12 + present().map(|(_, bytes, _)| 8 + bytes.len().next_multiple_of(4)).sum::<usize>();
    let limit = u32::MAX as usize;
    let length = u32::try_from(total).map_err(|_| WriteError::TooLarge { what: "the scene", len: total, limit })?;
    out.write_all(b"glTF")?;
    out.write_all(&2_u32.to_le_bytes())?;
    out.write_all(&length.to_le_bytes())?;
    for (kind, bytes, fill) in present() {
        let padded = bytes.len().next_multiple_of(4);
        // Fits, because the total does.
        out.write_all(&(padded as u32).to_le_bytes())?;
        out.write_all(*kind)?;
        out.write_all(bytes)?;
        out.write_all(&[*fill; 3][..padded - bytes.len()])?;
    }
    Ok(out.flush()?)
}

/// JSON text and binary chunk of a file that is GLB, or the whole of one that is plain JSON.
pub(super) fn split(data: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    if !data.starts_with(b"glTF") {
        return Ok((without_mark(data), None));
    }
    let word = |at: usize| -> Option<usize> {
        let bytes = data.get(at..at.checked_add(4)?)?;
        Some(u32::from_le_bytes(bytes.try_into().ok()?) as usize)
    };
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        return Err("the GLB header is cut short".into());
    };
    if version != 2 {
        return Err(format!("GLB version {version} is not 2"));
    }
    if length < 12 || length > data.len() {
        return Err(format!("the GLB header states {length} bytes, the file has {}", data.len()));
    }
    let (mut at, mut json, mut binary) = (12, None, None);
    while at < length {
        let (Some(size), Some(kind)) = (word(at), data.get(at + 4..at + 8)) else {
            return Err("a GLB chunk header is cut short".into());
        };
        let end = (at + 8).checked_add(size).filter(|end| *end <= length);
        let content = end.and_then(|end| data.get(at + 8..end));
        let content = content.ok_or_else(|| format!("a GLB chunk of {size} bytes leaves the file"))?;
        match kind {
            b"JSON" if json.is_none() => json = Some(content),
            b"BIN\0" if binary.is_none() => binary = Some(content),
            _ => {}
        }
        at += 8 + size;
    }
    Ok((json.ok_or("the GLB file has no JSON chunk")?, binary))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn broken_containers_are_refused() {
        let header =
            |version: u32, length: u32| [b"glTF".as_slice(), &version.to_le_bytes(), &length.to_le_bytes()].concat();
        let chunk = [90_u32.to_le_bytes().as_slice(), b"JSON"].concat();
        for (data, word) in [
            (b"glTF\x02".to_vec(), "cut short"),
            (header(1, 12), "version 1"),
            (header(2, 0), "states 0"),
            (header(2, 4000), "states 4000"),
            (header(2, 12), "no JSON"),
            ([header(2, 20), chunk].concat(), "90 bytes"),
        ] {
            let message = split(&data).expect_err(word);
            assert!(message.contains(word), "{word}: {message}");
        }
    }
}
