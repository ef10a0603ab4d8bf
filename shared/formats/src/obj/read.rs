//! The reader: vertices with their colours, faces with their texture coordinates, groups and materials.
//!
//! Our own: the `tobj` crate makes fans of polygons that are not convex, and panics on material libraries with too few numbers.

use super::material::{self, Material};
use crate::file_frame::noted_unit;
use crate::files::Allowance;
use crate::geometry::{Geometry, Piece, PieceTexture, Texture, linear};
use crate::levels::{Range, largest};
use crate::polygon::Triangulation;
use crate::text::{self, decoded, lines, number};
use crate::{ReadError, Resolver};
use semascan_model::LengthUnit;
use std::borrow::Cow;
use std::collections::{BTreeSet, HashMap};
use std::rc::Rc;

/// Reads the bytes of the file `name`; each object, group or material within is a piece. A material library or picture that
/// is not there costs the colours, not the part. Without faces it is a cloud.
///
/// # Errors
/// [`ReadError::Format`] with the line at fault.
pub(crate) fn read(name: &str, bytes: &[u8], files: Resolver<'_>) -> Result<Geometry, ReadError> {
    let mut reader = Reader::new(files);
    reader.lines(bytes).and_then(|()| reader.finish()).map_err(|reason| ReadError::format(name, "OBJ", &reason))
}

/// A corner of a face: its vertex, and its texture coordinates if it has such.
#[derive(Clone, Copy)]
struct Corner {
    vertex: u32,
    texture: Option<u32>,
}

/// Consecutive faces of one object or group and one material.
struct Group {
    name: Rc<str>,
    material: Option<Rc<str>>,
    /// Number of faces up to its end.
    end: usize,
}

/// The colour of a vertex that has none.
const NO_COLOR: [f64; 3] = [f64::NAN; 3];

struct Reader<'a> {
    files: Named<'a>,
    positions: Vec<[f64; 3]>,
    /// sRGB as the file has it; filled up with [`NO_COLOR`] from the first vertex with a colour on.
    colors: Vec<[f64; 3]>,
    texture_coordinates: Vec<[f32; 2]>,
    corners: Vec<Corner>,
    /// End of each face in `corners`.
    faces: Vec<usize>,
    groups: Vec<Group>,
    name: Rc<str>,
    material: Option<Rc<str>>,
    materials: HashMap<String, Material>,
    warnings: Vec<String>,
    /// The unit that our own files note.
    unit: Option<LengthUnit>,
    /// Texture coordinates that are no numbers.
    bad_texture_coordinates: usize,
    /// Curves, surfaces, lines and points of their own.
    left_out: usize,
}

impl<'a> Reader<'a> {
    fn new(files: Resolver<'a>) -> Self {
        Self {
            files: Named { files, allowance: Allowance::new() },
            positions: Vec::new(),
            colors: Vec::new(),
            texture_coordinates: Vec::new(),
            corners: Vec::new(),
            faces: Vec::new(),
            groups: Vec::new(),
            name: "object".into(),
            material: None,
            materials: HashMap::new(),
            warnings: Vec::new(),
            unit: None,
            bad_texture_coordinates: 0,
            left_out: 0,
        }
    }

    fn lines(&mut self, bytes: &[u8]) -> Result<(), String> {
        let mut lines = lines(bytes).enumerate();
        while let Some((number, first)) = lines.next() {
            let mut line = decoded(first);
            // A backslash at its end continues a line on the next; comments may end with the name of a folder.
            while let Some(begun) = line.trim_end().strip_suffix('\\').filter(|begun| !begun.starts_with('#')) {
                let next = lines.next().map_or(Cow::Borrowed(""), |(_, next)| decoded(next));
                line = Cow::Owned(format!("{begun} {next}"));
            }
            self.line(line.trim()).ok_or_else(|| format!("line {}: `{}`", number + 1, line.trim()))?;
        }
        self.end_group();
        Ok(())
    }

    fn line(&mut self, line: &str) -> Option<()> {
        let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        // Names may have a `#` within; numbers end before one.
        let numbers = rest.split('#').next().unwrap_or_default();
        match word {
            "v" => self.vertex(numbers)?,
            "vt" => self.texture_vertex(numbers),
            "f" | "fo" => self.face(numbers)?,
            "o" | "g" => {
                self.end_group();
                self.name = if rest.is_empty() { "object".into() } else { rest.into() };
            }
            "usemtl" => {
                self.end_group();
                self.material = Some(rest.into());
            }
            "mtllib" => self.library(rest),
            "#" if self.unit.is_none() => self.unit = noted_unit(rest),
            "p" | "l" | "curv" | "curv2" | "surf" => self.left_out += 1,
            _ => {}
        }
        Some(())
    }

    /// `x y z`, and `r g b` if there are so many numbers.
    fn vertex(&mut self, rest: &str) -> Option<()> {
        let mut words = rest.split_whitespace();
        let mut next = || number(words.next()?);
        self.positions.push([next()?, next()?, next()?]);
        if let (Some(r), Some(g), Some(b)) = (next(), next(), next()) {
            self.colors.resize(self.positions.len() - 1, NO_COLOR);
            self.colors.push([r, g, b]);
        }
        Some(())
    }

    /// `u v`; one number is a place on a line. What cannot be read costs the picture at that corner only.
    fn texture_vertex(&mut self, rest: &str) {
        let mut numbers = rest.split_whitespace().map(|w| number(w).filter(|n| n.is_finite()));
        let place = numbers.next().flatten().zip(numbers.next().unwrap_or(Some(0.0)));
        self.bad_texture_coordinates += usize::from(place.is_none());
        let (u, v) = place.unwrap_or_default();
        self.texture_coordinates.push([u as f32, v as f32]);
    }

    /// `v`, `v/vt`, `v//vn` or `v/vt/vn` for each corner; negative numbers count back from the last so far.
    fn face(&mut self, rest: &str) -> Option<()> {
        let place = |word: &str, count: usize| -> Option<u32> {
            let index: i64 = word.parse().ok()?;
            u32::try_from(if index < 0 { count as i64 + index } else { index - 1 }).ok()
        };
        for word in rest.split_whitespace() {
            let mut parts = word.split('/');
            let vertex = place(parts.next()?, self.positions.len())?;
            let texture = match parts.next() {
                None | Some("") => None,
                Some(word) => Some(place(word, self.texture_coordinates.len())?),
            };
            self.corners.push(Corner { vertex, texture });
        }
        self.faces.push(self.corners.len());
        Some(())
    }

    fn end_group(&mut self) {
        let end = self.faces.len();
        let last = self.groups.last_mut();
        if end == last.as_ref().map_or(0, |g| g.end) {
            return;
        }
        if let Some(last) = last.filter(|g| g.name == self.name && g.material == self.material) {
            last.end = end;
        } else {
            self.groups.push(Group { name: self.name.clone(), material: self.material.clone(), end });
        }
    }

    /// A library by its name, which may have spaces, or several by theirs.
    fn library(&mut self, names: &str) {
        match self.files.find(&names.replace('\\', "/")) {
            Ok(bytes) => material::read(&bytes, &mut self.materials),
            Err(error) => {
                let several: Vec<&str> = names.split_whitespace().collect();
                if several.len() > 1 {
                    several.into_iter().for_each(|name| self.library(name));
                } else {
                    self.warnings.push(format!("the material library is left out: {error}"));
                }
            }
        }
    }

    fn finish(self) -> Result<Geometry, String> {
        let mut geometry = Geometry { warnings: self.warnings, unit: self.unit, ..Geometry::default() };
        let mut flat = 0_usize;
        let mut unknown = BTreeSet::new();
        let mut pictures = Pictures { files: &self.files, indices: HashMap::new() };
        let mut triangulation = Triangulation::default();
        let (mut start, mut first, mut places) = (0, 0, Vec::new());
        for group in self.groups {
            let first_triangle = geometry.triangles.len();
            let mut has_texture_coordinates = false;
            for &end in &self.faces[first..group.end] {
                let face = &self.corners[start..end];
                start = end;
                flat += usize::from(face.len() < 3);
                places.clear();
                for corner in face {
                    let (vertex, count) = (corner.vertex, self.positions.len());
                    let place = self.positions.get(vertex as usize);
                    // As the file counts: from 1.
                    places.push(
                        *place.ok_or_else(|| format!("a face names vertex {} of {count}", u64::from(vertex) + 1))?,
                    );
                }
                has_texture_coordinates |= face.iter().any(|c| c.texture.is_some());
                for t in triangulation.split(&places) {
                    let corners = t.map(|k| face[k as usize]);
                    geometry.triangles.push(corners.map(|c| c.vertex));
                    geometry.texture_coordinates.push(corners.map(|c| {
                        let place = c.texture.and_then(|t| self.texture_coordinates.get(t as usize));
                        place.copied().unwrap_or_default()
                    }));
                }
            }
            first = group.end;
            let material = group.material.as_deref().and_then(|name| self.materials.get(name));
            if let (None, Some(name)) = (material, group.material) {
                unknown.insert(text::name(&name));
            }
            let picture = material.and_then(|m| m.picture.as_deref()).filter(|_| has_texture_coordinates);
            let texture = picture.and_then(|name| pictures.index(name, &mut geometry));
            geometry.pieces.push(Piece {
                name: text::name(&group.name),
                triangles: first_triangle..geometry.triangles.len(),
                base_color: material.and_then(|m| m.base_color),
                // Libraries often leave an arbitrary grey beside the picture.
                texture: texture.map(|index| PieceTexture { index, tinted: false }),
            });
        }
        if self.texture_coordinates.is_empty() {
            geometry.texture_coordinates.clear();
        }
        let range = Range::of(true, largest(self.colors.iter().flatten()));
        let color =
            |c: [f64; 3]| if c[0].is_nan() { [1.0; 3] } else { linear(c.map(|channel| range.share(channel) as f32)) };
        geometry.colors = self.colors.into_iter().map(color).collect();
        if !geometry.colors.is_empty() {
            geometry.colors.resize(self.positions.len(), [1.0; 3]);
        }
        // Without a library, that it is missing has been said.
        if !unknown.is_empty() && !self.materials.is_empty() {
            let names: Vec<String> = unknown.into_iter().collect();
            geometry.warnings.push(format!("is in no material library: {}", names.join(", ")));
        }
        for (count, what) in [
            (flat, "faces of fewer than three corners are left out"),
            (self.left_out, "points, lines, curves and curved surfaces are left out: only faces are read"),
            (self.bad_texture_coordinates, "texture coordinates are no numbers"),
        ] {
            if count > 0 {
                geometry.warnings.push(format!("{count} {what}"));
            }
        }
        geometry.positions = self.positions;
        geometry.drop_unused_vertices();
        Ok(geometry)
    }
}

/// The files that the model names, and how much of them may yet be read.
struct Named<'a> {
    files: Resolver<'a>,
    allowance: Allowance,
}

impl Named<'_> {
    /// The file `name`, or one of its last name beside the model: paths of another computer lead nowhere.
    fn find(&self, name: &str) -> std::io::Result<Vec<u8>> {
        let found = (self.files)(name).or_else(|error| match name.rsplit_once('/') {
            Some((_, last)) if !last.is_empty() => (self.files)(last).map_err(|_| error),
            _ => Err(error),
        });
        found.and_then(|bytes| self.allowance.take(bytes.len()).map(|()| bytes))
    }
}

/// Pictures, each opened once.
struct Pictures<'a> {
    files: &'a Named<'a>,
    indices: HashMap<String, Option<usize>>,
}

impl Pictures<'_> {
    /// Index of a picture among the geometry's textures; `None`, with a warning, if it cannot be opened.
    fn index(&mut self, name: &str, geometry: &mut Geometry) -> Option<usize> {
        if let Some(known) = self.indices.get(name) {
            return *known;
        }
        let index = match self.files.find(name) {
            Ok(bytes) => {
                geometry.textures.push(Texture { name: name.to_owned(), bytes });
                Some(geometry.textures.len() - 1)
            }
            Err(error) => {
                geometry.warnings.push(format!("a picture is left out: {error}"));
                None
            }
        };
        self.indices.insert(name.to_owned(), index);
        index
    }
}
