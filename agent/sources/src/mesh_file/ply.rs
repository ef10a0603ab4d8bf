//! PLY, text or binary, by the `ply-rs` crate: positions, faces, vertex colours, and what our own files say of a point.

use std::io::BufRead;
use std::path::Path;

use ply_rs::parser::Parser;
use ply_rs::ply::{Property, PropertyAccess};

use super::{Piece, VertexSemantics, bytes, fan, linear};
use semascan_inspection::source::SourceError;

/// A vertex or a face: unknown properties are passed over, so that memory stays bounded by the file.
#[derive(Debug, Default)]
struct Row {
    position: [f32; 3],
    colour: Option<[f32; 3]>,
    corners: Vec<u32>,
    semantics: VertexSemantics,
}

impl PropertyAccess for Row {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: String, property: Property) {
        let position = ["x", "y", "z"].iter().position(|n| *n == name);
        let channel = ["red", "green", "blue"].iter().position(|n| *n == name);
        match (position, channel, property) {
            (Some(k), _, Property::Float(v)) => self.position[k] = v,
            (Some(k), _, Property::Double(v)) => self.position[k] = v as f32,
            (_, Some(k), Property::UChar(v)) => self.colour.get_or_insert_default()[k] = f32::from(v) / 255.0,
            (_, Some(k), Property::Float(v)) => self.colour.get_or_insert_default()[k] = v,
            (_, _, Property::Float(v)) => match name.as_str() {
                "nx" => self.semantics.normal[0] = v,
                "ny" => self.semantics.normal[1] = v,
                "nz" => self.semantics.normal[2] = v,
                "confidence" => self.semantics.confidence = Some(v),
                _ => {}
            },
            (_, _, Property::UShort(v)) => match name.as_str() {
                "label" => self.semantics.label = Some(v),
                "flags" => self.semantics.flags = v,
                _ => {}
            },
            (_, _, Property::ListInt(v)) => {
                self.take_corners(&name, v.into_iter().map(|i| u32::try_from(i).unwrap_or(u32::MAX)))
            }
            (_, _, Property::ListUInt(v)) => self.take_corners(&name, v.into_iter()),
            (_, _, Property::ListUShort(v)) => self.take_corners(&name, v.into_iter().map(u32::from)),
            (_, _, Property::ListUChar(v)) => self.take_corners(&name, v.into_iter().map(u32::from)),
            _ => {}
        }
    }
}

impl Row {
    fn take_corners(&mut self, name: &str, corners: impl Iterator<Item = u32>) {
        if name == "vertex_indices" || name == "vertex_index" {
            self.corners = corners.collect();
        }
    }
}

/// The file's one mesh.
pub(super) fn read(path: &Path) -> Result<Vec<Piece>, SourceError> {
    let refuse = |reason: String| SourceError::Format { path: path.to_owned(), reason };
    let data = bytes(path)?;
    let mut rest = data.as_slice();
    let parser = Parser::<Row>::new();
    let header = parser.read_header(&mut rest).map_err(|e| refuse(format!("PLY header: {e}")))?;
    let mut piece = Piece { name: "mesh".into(), ..Piece::default() };
    for (name, element) in &header.elements {
        // Every element takes a byte at least: a header that promises more is wrong, and could fill the memory.
        if element.properties.is_empty() || element.count > rest.len() {
            return Err(refuse(format!("element {name}: {} of them do not fit the file", element.count)));
        }
        let rows =
            read_rows(&parser, &mut rest, element, &header).map_err(|e| refuse(format!("element {name}: {e}")))?;
        match name.as_str() {
            "vertex" => {
                piece.colours = rows.iter().filter_map(|r| r.colour.map(linear)).collect();
                piece.semantics = rows.iter().map(|r| r.semantics).collect();
                piece.positions = rows.into_iter().map(|r| r.position).collect();
            }
            "face" => piece.triangles = rows.iter().flat_map(|r| fan(&r.corners)).collect(),
            _ => {}
        }
    }
    Ok(vec![piece])
}

fn read_rows<T: BufRead>(
    parser: &Parser<Row>,
    data: &mut T,
    element: &ply_rs::ply::ElementDef,
    header: &ply_rs::ply::Header,
) -> std::io::Result<Vec<Row>> {
    parser.read_payload_for_element(data, element, header)
}
