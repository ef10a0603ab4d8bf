//! STL, binary or text. Corners at the same place become one vertex, so that edges have two sides.

use super::{ImportError, Shape};
use std::collections::BTreeMap;

/// Reads a file.
///
/// # Errors
/// [`ImportError::Format`] if it is neither form of STL.
pub fn read(bytes: &[u8]) -> Result<Shape, ImportError> {
    let mut welded = Welded::default();
    let count = bytes.get(80..84).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize);
    match count {
        // The length tells: text files may be anything, and some binary ones begin with `solid`.
        Some(count) if bytes.len() == count.saturating_mul(50).saturating_add(84) => {
            for record in bytes[84..].chunks_exact(50) {
                let float = |i: usize| f32::from_le_bytes([record[i], record[i + 1], record[i + 2], record[i + 3]]);
                welded.triangle([12, 24, 36].map(|at| [float(at), float(at + 4), float(at + 8)]));
            }
        }
        _ if bytes.starts_with(b"solid") => text(bytes, &mut welded)?,
        _ => return Err(refuse("its length does not fit its number of triangles")),
    }
    Ok(welded.shape)
}

fn text(bytes: &[u8], welded: &mut Welded) -> Result<(), ImportError> {
    let mut corners: Vec<[f32; 3]> = Vec::with_capacity(3);
    for line in bytes.split(|b| *b == b'\n') {
        let line = String::from_utf8_lossy(line);
        let mut words = line.split_whitespace();
        if words.next() == Some("vertex") {
            let mut next = || words.next().and_then(|w| w.parse().ok()).ok_or_else(|| refuse(line.trim()));
            corners.push([next()?, next()?, next()?]);
            if let [a, b, c] = corners[..] {
                welded.triangle([a, b, c]);
                corners.clear();
            }
        }
    }
    if corners.is_empty() { Ok(()) } else { Err(refuse("a facet has not three vertices")) }
}

fn refuse(reason: &str) -> ImportError {
    ImportError::Format { format: "STL", reason: reason.to_owned() }
}

#[derive(Default)]
struct Welded {
    shape: Shape,
    places: BTreeMap<[u32; 3], u32>,
}

impl Welded {
    fn triangle(&mut self, corners: [[f32; 3]; 3]) {
        let triangle = corners.map(|p| {
            // Zero has two signs but is one place.
            let key = p.map(|c| (c + 0.0).to_bits());
            *self.places.entry(key).or_insert_with(|| {
                self.shape.positions.push(p);
                self.shape.positions.len() as u32 - 1
            })
        });
        self.shape.triangles.push(triangle);
    }
}
