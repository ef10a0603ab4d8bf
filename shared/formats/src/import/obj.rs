//! OBJ: vertices and faces; everything else is passed over.

use super::{ImportError, Shape};

/// Reads a file. Faces become fans of triangles; negative indices count back from the last vertex.
///
/// # Errors
/// [`ImportError::Format`] with the line at fault.
pub fn read(bytes: &[u8]) -> Result<Shape, ImportError> {
    let mut shape = Shape::default();
    let mut corners: Vec<u32> = Vec::new();
    for (number, line) in bytes.split(|b| *b == b'\n').enumerate() {
        let text = String::from_utf8_lossy(line);
        let refuse =
            || ImportError::Format { format: "OBJ", reason: format!("line {}: `{}`", number + 1, text.trim()) };
        let mut words = text.split_whitespace();
        match words.next() {
            Some("v") => {
                let mut next = || words.next().and_then(|w| w.parse().ok()).ok_or_else(refuse);
                shape.positions.push([next()?, next()?, next()?]);
            }
            Some("f") => {
                corners.clear();
                for word in words {
                    let index: i64 = word.split('/').next().and_then(|w| w.parse().ok()).ok_or_else(refuse)?;
                    let place = if index < 0 { shape.positions.len() as i64 + index } else { index - 1 };
                    corners.push(u32::try_from(place).map_err(|_| refuse())?);
                }
                shape.triangles.extend((2..corners.len()).map(|i| [corners[0], corners[i - 1], corners[i]]));
            }
            _ => {}
        }
    }
    Ok(shape)
}
