//! The reader, binary or text. Corners at the same place become one vertex, so that edges have two sides.
//!
//! Which form a file has is told by its length and content, not by its first word: many binary files begin with `solid`.

use crate::file_frame::noted_unit;
use crate::polygon::Triangulation;
use crate::text::{decoded, lines, number, without_mark};
use crate::{Geometry, Piece, ReadError};
use std::collections::HashMap;

/// Bytes before the first triangle of a binary file: 80 of any content, and the number of triangles.
const HEAD: usize = 84;
/// Bytes of a triangle: normal, three corners, and two bytes of any content.
const RECORD: usize = 50;

/// Reads the bytes of the file `name`; each solid of a text file is a piece.
///
/// # Errors
/// [`ReadError::Format`] if it is neither form of STL or is cut short.
pub(crate) fn read(name: &str, bytes: &[u8]) -> Result<Geometry, ReadError> {
    let mut welded = Welded::default();
    let count = bytes.get(80..HEAD).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize);
    let exact = count.is_some_and(|n| bytes.len() == n.saturating_mul(RECORD).saturating_add(HEAD));
    let begins = without_mark(bytes).trim_ascii_start().get(..5).is_some_and(|w| w.eq_ignore_ascii_case(b"solid"));
    let is_text = !exact && begins && !bytes.contains(&0);
    let read = match count {
        _ if is_text => text(bytes, &mut welded),
        Some(count) => binary(count, &bytes[HEAD..], &mut welded),
        None => Err("it is too short for a binary file and does not begin with `solid`".into()),
    };
    read.map_err(|reason| ReadError::format(name, "STL", &reason))?;
    if !is_text {
        welded.geometry.unit = bytes.get(..80).and_then(|head| noted_unit(&decoded(head)));
    }
    Ok(welded.geometry)
}

fn binary(count: usize, records: &[u8], welded: &mut Welded) -> Result<(), String> {
    let there = records.len() / RECORD;
    let taken = match count {
        // Not yet known when the head was written.
        n if n == u32::MAX as usize && records.len().is_multiple_of(RECORD) => {
            welded.geometry.warnings.push(format!("does not count its triangles and holds {there}: all are read"));
            there
        }
        n if n > there => return Err(format!("it is cut short: {there} triangles of {n}")),
        // Some programs write the number before they know it; what follows is triangles all the same.
        n if n < there && records.len().is_multiple_of(RECORD) => {
            welded.geometry.warnings.push(format!("counts {n} triangles and holds {there}: all are read"));
            there
        }
        n if n < there => return Err(format!("its length does not fit its {n} triangles")),
        n => n,
    };
    for record in records.chunks_exact(RECORD).take(taken) {
        let coordinate = |i: usize| f32::from_le_bytes([record[i], record[i + 1], record[i + 2], record[i + 3]]);
        welded.triangle([12, 24, 36].map(|at| [at, at + 4, at + 8].map(|i| f64::from(coordinate(i)))));
    }
    welded.end_solid("solid");
    Ok(())
}

/// Facets of a text, word by word: some programs write several to a line.
fn text(bytes: &[u8], welded: &mut Welded) -> Result<(), String> {
    let mut corners: Vec<[f64; 3]> = Vec::with_capacity(3);
    let mut triangulation = Triangulation::default();
    let mut solid: Option<String> = None;
    for line in lines(bytes) {
        let line = decoded(line);
        let mut words = line.split_whitespace();
        while let Some(word) = words.next() {
            match word.to_ascii_lowercase().as_str() {
                "solid" => solid = Some(words.by_ref().collect::<Vec<_>>().join(" ")),
                "endsolid" => {
                    let name = solid.take().filter(|n| !n.is_empty());
                    welded.end_solid(name.as_deref().unwrap_or("solid"));
                    // Its name, which may be any word.
                    words.by_ref().for_each(drop);
                }
                "vertex" => {
                    let mut next =
                        || words.next().and_then(number).ok_or_else(|| format!("`{}` is no vertex", line.trim()));
                    corners.push([next()?, next()?, next()?]);
                }
                "endloop" => {
                    if corners.len() < 3 {
                        return Err(format!("a facet has {} vertices", corners.len()));
                    }
                    for t in triangulation.split(&corners) {
                        welded.triangle(t.map(|k| corners[k as usize]));
                    }
                    corners.clear();
                }
                _ => {}
            }
        }
    }
    match (corners.is_empty(), solid) {
        (false, _) => Err("it is cut short: a facet does not end".into()),
        (true, Some(_)) => Err("it is cut short: a solid does not end".into()),
        (true, None) => {
            // Facets past the last solid.
            welded.end_solid("solid");
            Ok(())
        }
    }
}

/// Triangles whose corners at the same place are one vertex.
#[derive(Default)]
struct Welded {
    geometry: Geometry,
    places: HashMap<[u64; 3], u32>,
}

impl Welded {
    fn triangle(&mut self, corners: [[f64; 3]; 3]) {
        let triangle = corners.map(|p| {
            // Zero has two signs but is one place.
            let key = p.map(|c| (c + 0.0).to_bits());
            *self.places.entry(key).or_insert_with(|| {
                self.geometry.positions.push(p);
                self.geometry.positions.len() as u32 - 1
            })
        });
        self.geometry.triangles.push(triangle);
    }

    /// Makes a piece of the triangles since the last.
    fn end_solid(&mut self, name: &str) {
        let (start, end) = (self.geometry.pieces.last().map_or(0, |p| p.triangles.end), self.geometry.triangles.len());
        if end > start {
            self.geometry.pieces.push(Piece { name: name.to_owned(), triangles: start..end, ..Piece::default() });
        }
    }
}
