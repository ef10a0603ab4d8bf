//! Binary glTF 2.0: the positions, triangles and points of the first scene, in the scene's frame turned so that z is up.
//!
//! Only what geometry needs is read, from the JSON as it is: materials, animations and compressed buffers are not.

use super::{ImportError, Shape};
use glam::{Mat4, Quat, Vec3};
use serde_json::Value;

/// Deepest nesting of nodes: a file whose nodes contain each other would never end.
const DEEPEST: usize = 64;

/// Reads a file.
///
/// # Errors
/// [`ImportError::Format`] if it is no GLB, names what is not there, or keeps its geometry in a way that is not read.
pub fn read(bytes: &[u8]) -> Result<Shape, ImportError> {
    let (json, binary) = chunks(bytes).ok_or_else(|| refuse("no GLB container"))?;
    let root: Value = serde_json::from_slice(json).map_err(|e| refuse(&e.to_string()))?;
    let mut reader = Reader { root: &root, binary, shape: Shape::default() };
    // glTF is y up.
    let z_up = Mat4::from_rotation_x(std::f32::consts::FRAC_PI_2);
    let scene = root["scene"].as_u64().unwrap_or(0) as usize;
    let nodes = &root["scenes"][scene]["nodes"];
    for node in nodes.as_array().into_iter().flatten() {
        reader.node(node, z_up, 0)?;
    }
    Ok(reader.shape)
}

fn refuse(reason: &str) -> ImportError {
    ImportError::Format { format: "GLB", reason: reason.to_owned() }
}

/// The JSON and the binary chunk.
fn chunks(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let word = |at: usize| Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?));
    if !bytes.starts_with(b"glTF") || word(4)? != 2 {
        return None;
    }
    let length = word(12)? as usize;
    let json = bytes.get(20..20_usize.checked_add(length)?)?;
    let next = 20 + length;
    let binary = word(next).and_then(|n| bytes.get(next + 8..(next + 8).checked_add(n as usize)?));
    Some((json, binary.unwrap_or(&[])))
}

struct Reader<'a> {
    root: &'a Value,
    binary: &'a [u8],
    shape: Shape,
}

impl<'a> Reader<'a> {
    fn node(&mut self, index: &Value, parent: Mat4, depth: usize) -> Result<(), ImportError> {
        let node = self.entry("nodes", index)?;
        if depth > DEEPEST {
            return Err(refuse("its nodes are nested too deeply"));
        }
        let placed = parent * transform(node);
        if !node["mesh"].is_null() {
            let mesh = self.entry("meshes", &node["mesh"])?;
            for primitive in mesh["primitives"].as_array().into_iter().flatten() {
                self.primitive(primitive, placed)?;
            }
        }
        for child in node["children"].as_array().into_iter().flatten() {
            self.node(child, placed, depth + 1)?;
        }
        Ok(())
    }

    fn primitive(&mut self, primitive: &Value, placed: Mat4) -> Result<(), ImportError> {
        let mode = primitive["mode"].as_u64().unwrap_or(4);
        let position = &primitive["attributes"]["POSITION"];
        // Lines and strips are no surfaces of inspection.
        if position.is_null() || !matches!(mode, 0 | 4) {
            return Ok(());
        }
        let first = self.shape.positions.len() as u32;
        let (bytes, stride, count) = self.accessor(position, 5126, 12)?;
        let at = |i: usize| {
            let float = |k: usize| f32::from_le_bytes(std::array::from_fn(|b| bytes[i * stride + 4 * k + b]));
            placed.transform_point3(Vec3::new(float(0), float(1), float(2))).to_array()
        };
        self.shape.positions.extend((0..count).map(at));
        if mode == 0 {
            return Ok(());
        }
        let indices: Vec<u32> = if primitive["indices"].is_null() {
            (0..count as u32).collect()
        } else {
            let kind = self.entry("accessors", &primitive["indices"])?["componentType"].as_u64().unwrap_or(0);
            let size = match kind {
                5121 => 1,
                5123 => 2,
                5125 => 4,
                _ => return Err(refuse("indices are no unsigned numbers")),
            };
            let (bytes, stride, count) = self.accessor(&primitive["indices"], kind, size)?;
            let index = |i: usize| (0..size).fold(0_u32, |v, b| v | u32::from(bytes[i * stride + b]) << (8 * b));
            (0..count).map(index).collect()
        };
        let corner = |v: u32| v.checked_add(first).filter(|_| (v as usize) < count);
        for t in indices.chunks_exact(3) {
            match [corner(t[0]), corner(t[1]), corner(t[2])] {
                [Some(a), Some(b), Some(c)] => self.shape.triangles.push([a, b, c]),
                _ => return Err(refuse("a triangle names a vertex that is not there")),
            }
        }
        Ok(())
    }

    /// Bytes of an accessor of a component type, `size` bytes an element; distance between elements; their number.
    fn accessor(&self, index: &Value, kind: u64, size: usize) -> Result<(&'a [u8], usize, usize), ImportError> {
        let accessor = self.entry("accessors", index)?;
        if accessor["componentType"].as_u64() != Some(kind) || !accessor["sparse"].is_null() {
            return Err(refuse("an accessor of a kind that is not read"));
        }
        let view = self.entry("bufferViews", &accessor["bufferView"])?;
        let number = |value: &Value| value.as_u64().and_then(|n| usize::try_from(n).ok());
        let or_zero = |value: &Value| if value.is_null() { Some(0) } else { number(value) };
        let found = || {
            let start = or_zero(&view["byteOffset"])?.checked_add(or_zero(&accessor["byteOffset"])?)?;
            let stride = number(&view["byteStride"]).filter(|s| *s > 0).unwrap_or(size);
            let count = number(&accessor["count"])?;
            let length = count.checked_sub(1).map_or(Some(0), |n| n.checked_mul(stride)?.checked_add(size))?;
            (stride >= size).then_some(())?;
            Some((self.binary.get(start..start.checked_add(length)?)?, stride, count))
        };
        found().ok_or_else(|| refuse("an accessor lies outside of its buffer"))
    }

    fn entry(&self, list: &str, index: &Value) -> Result<&'a Value, ImportError> {
        let found = index.as_u64().and_then(|i| self.root[list].get(i as usize));
        found.ok_or_else(|| refuse(&format!("{list} {index} is not there")))
    }
}

/// A node's `parent_from_node`.
fn transform(node: &Value) -> Mat4 {
    let floats = |value: &Value| -> Vec<f32> {
        value.as_array().into_iter().flatten().filter_map(Value::as_f64).map(|v| v as f32).collect()
    };
    if let Ok(columns) = <[f32; 16]>::try_from(floats(&node["matrix"])) {
        return Mat4::from_cols_array(&columns);
    }
    let three = |name: &str, default: Vec3| <[f32; 3]>::try_from(floats(&node[name])).map_or(default, Vec3::from_array);
    let rotation = <[f32; 4]>::try_from(floats(&node["rotation"])).map_or(Quat::IDENTITY, Quat::from_array);
    Mat4::from_scale_rotation_translation(three("scale", Vec3::ONE), rotation, three("translation", Vec3::ZERO))
}
