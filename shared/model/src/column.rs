//! A column of the semantic point as the table [`POINT_COLUMNS`](super::POINT_COLUMNS) describes it to readers and writers
//! of files: its name, the names and type of its numbers, and how a point's value becomes bytes and is set from numbers.

use super::{PointFlags, SemanticPoint};

/// Type of a number in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NumberType {
    /// Unsigned, one byte.
    U8,
    /// Unsigned, two bytes.
    U16,
    /// IEEE 754 single precision.
    F32,
}

impl NumberType {
    /// Bytes of a number.
    pub const fn size(self) -> usize {
        match self {
            Self::U8 => 1,
            Self::U16 => 2,
            Self::F32 => 4,
        }
    }
}

/// One column of a semantic point.
#[derive(Clone, Copy, Debug)]
pub struct PointColumn {
    /// Name of the point's field: `position`, `label`.
    pub name: &'static str,
    /// Names of the column's numbers in a file: `x`, `y` and `z`, or `label`.
    pub number_names: &'static [&'static str],
    /// Type of these numbers.
    pub number_type: NumberType,
    /// Appends a point's value as bytes, little endian.
    pub append: fn(&SemanticPoint, &mut Vec<u8>),
    /// Sets number `k` of a point's value. What the type cannot hold becomes the nearest that it can.
    pub set: fn(&mut SemanticPoint, usize, f64),
}

/// A value that a column can hold.
pub trait ColumnValue {
    /// Type of its numbers.
    const NUMBER_TYPE: NumberType;

    /// Appends its bytes, little endian.
    fn append(&self, bytes: &mut Vec<u8>);

    /// Sets number `k`; nothing happens past the last.
    fn set(&mut self, k: usize, value: f64);
}

impl ColumnValue for f32 {
    const NUMBER_TYPE: NumberType = NumberType::F32;

    fn append(&self, bytes: &mut Vec<u8>) {
        bytes.extend_from_slice(&self.to_le_bytes());
    }

    fn set(&mut self, _: usize, value: f64) {
        *self = value as f32;
    }
}

impl ColumnValue for u16 {
    const NUMBER_TYPE: NumberType = NumberType::U16;

    fn append(&self, bytes: &mut Vec<u8>) {
        bytes.extend_from_slice(&self.to_le_bytes());
    }

    fn set(&mut self, _: usize, value: f64) {
        *self = value as u16;
    }
}

impl ColumnValue for u8 {
    const NUMBER_TYPE: NumberType = NumberType::U8;

    fn append(&self, bytes: &mut Vec<u8>) {
        bytes.push(*self);
    }

    fn set(&mut self, _: usize, value: f64) {
        *self = value as u8;
    }
}

impl ColumnValue for PointFlags {
    const NUMBER_TYPE: NumberType = NumberType::U16;

    fn append(&self, bytes: &mut Vec<u8>) {
        self.0.append(bytes);
    }

    fn set(&mut self, k: usize, value: f64) {
        self.0.set(k, value);
    }
}

impl<T: ColumnValue, const N: usize> ColumnValue for [T; N] {
    const NUMBER_TYPE: NumberType = T::NUMBER_TYPE;

    fn append(&self, bytes: &mut Vec<u8>) {
        self.iter().for_each(|value| value.append(bytes));
    }

    fn set(&mut self, k: usize, value: f64) {
        if let Some(element) = self.get_mut(k) {
            element.set(0, value);
        }
    }
}
