//! Accessors: the numbers of a glTF file, decoded with every bound checked.

use super::document::{Accessor, Document};

/// Buffers with the document that describes them.
pub(super) struct Buffers<'a> {
    document: &'a Document,
    contents: Vec<std::borrow::Cow<'a, [u8]>>,
}

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
    fn of(accessor: &Accessor) -> Option<Self> {
        Some(match accessor.component_type {
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

impl<'a> Buffers<'a> {
    /// `contents` are those of the document's buffers, in order.
    pub(super) fn new(document: &'a Document, contents: Vec<std::borrow::Cow<'a, [u8]>>) -> Self {
        Self { document, contents }
    }

    /// Numbers of each element of an accessor, which is a scalar (1) or vector of 2 to 4.
    fn width(&self, index: usize) -> Option<usize> {
        Some(match self.document.accessors.get(index)?.shape.as_str() {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
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
        let accessor = self.document.accessors.get(index).ok_or_else(|| format!("accessor {index} is not there"))?;
        let fail = |what: &str| format!("accessor {index} {what}");
        if accessor.sparse.is_some() {
            return Err(fail("is sparse, which is not supported"));
        }
        let kind = Kind::of(accessor).ok_or_else(|| fail("holds no known type of number"))?;
        let stored = self.width(index).filter(|stored| *stored >= width);
        let stored =
            stored.ok_or_else(|| fail(&format!("is of the type {}: {width} numbers are needed", accessor.shape)))?;
        let view_index = accessor.buffer_view.ok_or_else(|| fail("has no buffer view"))?;
        let data = self.view(view_index)?;
        let stride = self.document.buffer_views.get(view_index).and_then(|v| v.byte_stride);
        let size = stored * kind.size();
        let stride = stride.unwrap_or(size).max(1);
        if accessor.count > data.len() {
            return Err(fail("leaves its buffer view"));
        }
        let mut numbers = Vec::with_capacity(accessor.count * width);
        for i in 0..accessor.count {
            let start = i.checked_mul(stride).and_then(|s| s.checked_add(accessor.byte_offset));
            let element = start.and_then(|start| data.get(start..start.checked_add(size)?));
            let element = element.ok_or_else(|| fail("leaves its buffer view"))?;
            let parts = element.chunks_exact(kind.size()).take(width);
            numbers.extend(parts.map(|bytes| kind.number(bytes, accessor.normalized)));
        }
        Ok(numbers)
    }

    /// The indices that an accessor holds.
    pub(super) fn indices(&self, index: usize) -> Result<Vec<u32>, String> {
        let kind = self.document.accessors.get(index).and_then(Kind::of);
        let whole = self.width(index) == Some(1) && matches!(kind, Some(Kind::U8 | Kind::U16 | Kind::U32));
        if !whole {
            return Err(format!("accessor {index} is no list of indices"));
        }
        Ok(self.numbers(index, 1)?.into_iter().map(|v| v as u32).collect())
    }
}
