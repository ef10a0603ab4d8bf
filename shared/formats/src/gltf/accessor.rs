//! Accessors: the numbers of a glTF file, decoded with every bound checked. What is decoded is bounded in all: nodes,
//! primitives and instances can name the same bytes without end.

use super::document::Document;
use std::cell::Cell;

/// Buffers with the document that describes them.
pub(super) struct Buffers<'a> {
    document: &'a Document,
    contents: Vec<std::borrow::Cow<'a, [u8]>>,
    /// Numbers that may yet be decoded.
    left: Cell<usize>,
}

/// Most elements of an accessor whose bytes the file does not hold: a few bytes must not fill the memory.
const MAX_ABSENT: usize = 1 << 20;
/// Most numbers that are decoded, however often the file names them.
const MAX_NUMBERS: usize = 1 << 30;

/// Type of a number.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Kind {
    fn of(component_type: u32) -> Option<Self> {
        Some(match component_type {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// The number of these bytes; whole ones that are `normalized` stand for shares of their largest.
    fn number(self, b: &[u8], normalized: bool) -> f64 {
        let (value, largest) = match (self, b) {
            (Self::I8, &[a, ..]) => (f64::from(a as i8), 127.0),
            (Self::U8, &[a, ..]) => (f64::from(a), 255.0),
            (Self::I16, &[a, b, ..]) => (f64::from(i16::from_le_bytes([a, b])), 32_767.0),
            (Self::U16, &[a, b, ..]) => (f64::from(u16::from_le_bytes([a, b])), 65_535.0),
            (Self::U32, &[a, b, c, d, ..]) => (f64::from(u32::from_le_bytes([a, b, c, d])), 4_294_967_295.0),
            (Self::F32, &[a, b, c, d, ..]) => return f64::from(f32::from_le_bytes([a, b, c, d])),
            _ => return f64::NAN,
        };
        if normalized { (value / largest).max(-1.0) } else { value }
    }
}

/// How the elements of an accessor lie in its bytes, and what is wanted of them.
struct Layout {
    kind: Kind,
    /// Numbers of an element.
    stored: usize,
    /// Numbers that are wanted of it.
    width: usize,
    /// Whether whole numbers stand for shares of their largest.
    normalized: bool,
}

impl<'a> Buffers<'a> {
    /// `contents` are those of the document's buffers, in order.
    pub(super) fn new(document: &'a Document, contents: Vec<std::borrow::Cow<'a, [u8]>>) -> Self {
        Self { document, contents, left: Cell::new(MAX_NUMBERS) }
    }

    /// Bytes of all buffers.
    pub(super) fn bytes(&self) -> usize {
        self.contents.iter().map(|content| content.len()).sum()
    }

    /// Numbers of each element of an accessor: a scalar (1), a vector of 2 to 4, or a matrix of 4 by 4.
    fn width(&self, index: usize) -> Option<usize> {
        Some(match self.document.accessors.get(index)?.shape.as_str() {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            "MAT4" => 16,
            _ => return None,
        })
    }

    /// The bytes of a buffer view.
    pub(super) fn view(&self, index: usize) -> Result<&[u8], String> {
        let view = self.document.buffer_views.get(index).ok_or_else(|| format!("buffer view {index} is not there"))?;
        let buffer = self.contents.get(view.buffer).ok_or_else(|| format!("buffer {} is not there", view.buffer))?;
        let end = view.byte_offset.checked_add(view.byte_length);
        end.and_then(|end| buffer.get(view.byte_offset..end))
            .ok_or_else(|| format!("buffer view {index} leaves its buffer"))
    }

    /// The first `width` numbers of each element of a scalar or vector of at least so many, one after the other.
    pub(super) fn numbers(&self, index: usize, width: usize) -> Result<Vec<f64>, String> {
        self.elements(index, width, false)
    }

    /// The same of shares: whole numbers stand for shares of their largest, even where the file forgets to say so.
    pub(super) fn shares(&self, index: usize, width: usize) -> Result<Vec<f64>, String> {
        self.elements(index, width, true)
    }

    fn elements(&self, index: usize, width: usize, shares: bool) -> Result<Vec<f64>, String> {
        let accessor = self.document.accessors.get(index).ok_or_else(|| format!("accessor {index} is not there"))?;
        let fail = |what: &str| format!("accessor {index} {what}");
        let kind = Kind::of(accessor.component_type).ok_or_else(|| fail("holds no known type of number"))?;
        let stored = self.width(index).filter(|stored| *stored >= width);
        let stored =
            stored.ok_or_else(|| fail(&format!("is of the type {}: {width} numbers are needed", accessor.shape)))?;
        let normalized = accessor.normalized || shares && kind != Kind::F32;
        let layout = Layout { kind, stored, width, normalized };
        let left = accessor.count.checked_mul(width).and_then(|n| self.left.get().checked_sub(n));
        self.left.set(left.ok_or_else(|| {
            format!("its meshes are named too often: more than {MAX_NUMBERS} numbers would have to be decoded")
        })?);
        let mut numbers = match accessor.buffer_view {
            Some(view) => self.packed(view, accessor.byte_offset, accessor.count, &layout).map_err(|e| fail(&e))?,
            None if accessor.sparse.is_none() => return Err(fail("has no buffer view")),
            None if accessor.count > MAX_ABSENT => {
                let count = accessor.count;
                return Err(fail(&format!(
                    "has {count} elements that the file does not hold; {MAX_ABSENT} are the most"
                )));
            }
            None => vec![0.0; accessor.count * width],
        };
        if let Some(sparse) = &accessor.sparse {
            let part = |view, offset, layout: &Layout| {
                self.packed(view, offset, sparse.count, layout).map_err(|e| fail(&format!("is sparse and {e}")))
            };
            let kind = sparse.indices.component_type.and_then(Kind::of);
            let kind = kind.filter(|k| matches!(k, Kind::U8 | Kind::U16 | Kind::U32));
            let kind = kind.ok_or_else(|| fail("has sparse indices of no known type"))?;
            let single = Layout { kind, stored: 1, width: 1, normalized: false };
            let indices = part(sparse.indices.buffer_view, sparse.indices.byte_offset, &single)?;
            let values = part(sparse.values.buffer_view, sparse.values.byte_offset, &layout)?;
            for (at, value) in indices.into_iter().zip(values.chunks_exact(width)) {
                let start = at as usize * width;
                let place = numbers.get_mut(start..start + width);
                place.ok_or_else(|| fail("has a sparse index past its end"))?.copy_from_slice(value);
            }
        }
        Ok(numbers)
    }

    /// `count` elements of a buffer view from `offset` on.
    fn packed(&self, view_index: usize, offset: usize, count: usize, layout: &Layout) -> Result<Vec<f64>, String> {
        let Layout { kind, stored, width, normalized } = *layout;
        let data = self.view(view_index)?;
        let stride = self.document.buffer_views.get(view_index).and_then(|v| v.byte_stride);
        let size = stored * kind.size();
        let stride = stride.unwrap_or(size).max(1);
        let leaves = || "leaves its buffer view".to_owned();
        if count > data.len() {
            return Err(leaves());
        }
        let mut numbers = Vec::with_capacity(count * width);
        for i in 0..count {
            let start = i.checked_mul(stride).and_then(|s| s.checked_add(offset));
            let element = start.and_then(|start| data.get(start..start.checked_add(size)?)).ok_or_else(leaves)?;
            let parts = element.chunks_exact(kind.size()).take(width);
            numbers.extend(parts.map(|bytes| kind.number(bytes, normalized)));
        }
        Ok(numbers)
    }

    /// The indices that an accessor holds.
    pub(super) fn indices(&self, index: usize) -> Result<Vec<u32>, String> {
        let kind = self.document.accessors.get(index).and_then(|a| Kind::of(a.component_type));
        let whole = self.width(index) == Some(1) && matches!(kind, Some(Kind::U8 | Kind::U16 | Kind::U32));
        if !whole {
            return Err(format!("accessor {index} is no list of indices"));
        }
        Ok(self.numbers(index, 1)?.into_iter().map(|v| v as u32).collect())
    }
}
