//! The GLB container (glTF 2.0, section 4.4), and the one check of its JSON that the `gltf` crate leaves out.
//!
//! The crate's own reader subtracts lengths it has not compared and follows attribute indices before it has validated
//! them; both end in a panic on a broken file.

use serde_json::Value;

/// JSON text and binary chunk of a file that is GLB, or the whole of one that is plain JSON.
pub(super) fn split(data: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    if !data.starts_with(b"glTF") {
        return Ok((data, None));
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

/// Whether every vertex attribute names an accessor that is there.
pub(super) fn check_attributes(json: &[u8]) -> Result<(), String> {
    let root: Value = serde_json::from_slice(json).map_err(|e| e.to_string())?;
    let accessors = root["accessors"].as_array().map_or(0, Vec::len) as u64;
    let meshes = root["meshes"].as_array().into_iter().flatten();
    for (i, mesh) in meshes.enumerate() {
        let primitives = mesh["primitives"].as_array().into_iter().flatten();
        for (name, index) in primitives.filter_map(|p| p["attributes"].as_object()).flatten() {
            if index.as_u64().is_none_or(|k| k >= accessors) {
                return Err(format!("mesh {i}: attribute {name} names accessor {index}, of {accessors}"));
            }
        }
    }
    Ok(())
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
        let unresolved = br#"{"accessors":[],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}]}"#;
        assert!(check_attributes(unresolved).expect_err("no accessor").contains("POSITION"));
    }
}
