//! The numbers after a PLY file's header, one after the other, as text or in either byte order.

use super::header::{Format, Kind, Property};
use crate::text::{decoded, number};

pub(super) struct Values<'a> {
    rest: &'a [u8],
    format: Format,
}

impl<'a> Values<'a> {
    pub(super) fn new(rest: &'a [u8], format: Format) -> Self {
        Self { rest, format }
    }

    /// Bytes that are left.
    pub(super) fn left(&self) -> usize {
        self.rest.len()
    }

    pub(super) fn next(&mut self, kind: Kind) -> Result<f64, String> {
        if self.format == Format::Ascii {
            let start = self.rest.iter().position(|b| !b.is_ascii_whitespace()).ok_or("it ends early")?;
            let word = &self.rest[start..];
            let end = word.iter().position(u8::is_ascii_whitespace).unwrap_or(word.len());
            self.rest = &word[end..];
            let text = decoded(&word[..end]);
            return number(&text).ok_or_else(|| format!("`{text}` is not a number"));
        }
        let (value, rest) = self.rest.split_at_checked(kind.size()).ok_or("it ends early")?;
        self.rest = rest;
        let mut b = [0; 8];
        b[..value.len()].copy_from_slice(value);
        if self.format == Format::Big {
            b[..value.len()].reverse();
        }
        let [b0, b1, b2, b3, ..] = b;
        Ok(match kind {
            Kind::I8 => i8::from_le_bytes([b0]).into(),
            Kind::U8 => b0.into(),
            Kind::I16 => i16::from_le_bytes([b0, b1]).into(),
            Kind::U16 => u16::from_le_bytes([b0, b1]).into(),
            Kind::I32 => i32::from_le_bytes([b0, b1, b2, b3]).into(),
            Kind::U32 => u32::from_le_bytes([b0, b1, b2, b3]).into(),
            Kind::I64 => i64::from_le_bytes(b) as f64,
            Kind::U64 => u64::from_le_bytes(b) as f64,
            Kind::F32 => f32::from_le_bytes([b0, b1, b2, b3]).into(),
            Kind::F64 => f64::from_le_bytes(b),
        })
    }

    /// Length of a list.
    pub(super) fn length(&mut self, kind: Kind) -> Result<usize, String> {
        let n = self.next(kind)?;
        // Each entry takes a byte at least.
        if !(0.0..=self.rest.len() as f64).contains(&n) { Err(format!("a list of {n}")) } else { Ok(n as usize) }
    }

    /// Passes over a property.
    pub(super) fn pass(&mut self, property: &Property) -> Result<(), String> {
        let n = property.list.map_or(Ok(1), |kind| self.length(kind))?;
        (0..n).try_for_each(|_| self.next(property.kind).map(drop))
    }

    /// Reads record `index` of the element `name` by `read`. In a text its line ends with it: where it does not, the header
    /// counts or names other than what is there, and all that follows would be taken for something else.
    pub(super) fn record(
        &mut self,
        name: &str,
        index: usize,
        read: impl FnOnce(&mut Self) -> Result<(), String>,
    ) -> Result<(), String> {
        read(self).map_err(|e| format!("{name} {index}: {e}"))?;
        let next = self.rest.iter().find(|b| !matches!(b, b' ' | b'\t'));
        if self.format == Format::Ascii && next.is_some_and(|b| !b.is_ascii_whitespace()) {
            return Err(format!("{name} {index}: its line has more numbers than the header names"));
        }
        Ok(())
    }

    /// What is said of bytes after the last element; nothing of line ends and zeros.
    pub(super) fn uncounted(&self) -> Option<String> {
        if self.rest.iter().all(|b| b.is_ascii_whitespace() || matches!(b, 0 | 0x1a)) {
            return None;
        }
        Some(format!("{} bytes follow that the header does not count", self.rest.len()))
    }
}
