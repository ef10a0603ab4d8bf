//! Fields of a message one after the other: the serializations of ROS 1 (packed, little endian) and of ROS 2 (CDR: each
//! number at a multiple of its size, in either byte order; [OMG XTypes], section 7.4, version 1 of the encoding). The
//! records of MCAP files and ROS 1 bags are packed in the same way.
//!
//! What a length says is compared with the bytes that are left before anything is taken or allocated.

use super::error::MessageError;
use super::types::Stamp;

/// How the fields lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Layout {
    /// One after the other, little endian; a text is its length and its bytes.
    Packed,
    /// Aligned; a text ends with a zero byte, which its length counts.
    Cdr { big_endian: bool },
}

/// Reads fields in their order.
#[derive(Clone, Debug)]
pub(crate) struct Fields<'a> {
    bytes: &'a [u8],
    at: usize,
    layout: Layout,
}

impl<'a> Fields<'a> {
    /// Fields without gaps, little endian.
    pub(crate) fn packed(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0, layout: Layout::Packed }
    }

    /// Fields of a CDR message, whose first four bytes say its byte order; places are counted from behind them.
    pub(crate) fn cdr(message: &'a [u8]) -> Result<Self, MessageError> {
        let refuse = |reason: String| Err(MessageError::Encoding { encoding: "CDR", reason });
        let Some(([kind_high, kind, ..], bytes)) = message.split_first_chunk::<4>() else {
            return refuse("it has less than four bytes".to_owned());
        };
        let big_endian = match (kind_high, kind) {
            (0, 0) => true,
            (0, 1) => false,
            (high, low) => return refuse(format!("encapsulation {high:02x}{low:02x} is not read, plain CDR only")),
        };
        Ok(Self { bytes, at: 0, layout: Layout::Cdr { big_endian } })
    }

    /// Whether the message was written by ROS 1, whose headers begin with a number of their own.
    pub(crate) fn is_packed(&self) -> bool {
        self.layout == Layout::Packed
    }

    /// Bytes that are left.
    pub(crate) fn remaining(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// Where the next field begins, from the first.
    pub(crate) fn at(&self) -> usize {
        self.at
    }

    /// The next `length` bytes.
    pub(crate) fn take(&mut self, length: usize, field: &'static str) -> Result<&'a [u8], MessageError> {
        let end = self.at.checked_add(length).ok_or(MessageError::Cut { field })?;
        let taken = self.bytes.get(self.at..end).ok_or(MessageError::Cut { field })?;
        self.at = end;
        Ok(taken)
    }

    /// The next number of `N` bytes, little endian.
    fn number<const N: usize>(&mut self, field: &'static str) -> Result<[u8; N], MessageError> {
        if let Layout::Cdr { .. } = self.layout {
            let gap = self.at.next_multiple_of(N) - self.at;
            self.take(gap, field)?;
        }
        let (number, _) = self.take(N, field)?.split_first_chunk::<N>().ok_or(MessageError::Cut { field })?;
        let mut number = *number;
        if self.layout == (Layout::Cdr { big_endian: true }) {
            number.reverse();
        }
        Ok(number)
    }

    pub(crate) fn u8(&mut self, field: &'static str) -> Result<u8, MessageError> {
        self.number(field).map(u8::from_le_bytes)
    }

    pub(crate) fn u16(&mut self, field: &'static str) -> Result<u16, MessageError> {
        self.number(field).map(u16::from_le_bytes)
    }

    pub(crate) fn u32(&mut self, field: &'static str) -> Result<u32, MessageError> {
        self.number(field).map(u32::from_le_bytes)
    }

    pub(crate) fn u64(&mut self, field: &'static str) -> Result<u64, MessageError> {
        self.number(field).map(u64::from_le_bytes)
    }

    pub(crate) fn f64(&mut self, field: &'static str) -> Result<f64, MessageError> {
        self.number(field).map(f64::from_le_bytes)
    }

    /// An array of numbers whose length the type says.
    pub(crate) fn f64_array<const N: usize>(&mut self, field: &'static str) -> Result<[f64; N], MessageError> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.f64(field)?;
        }
        Ok(values)
    }

    /// The length of a sequence whose elements take `least` bytes or more.
    pub(crate) fn count(&mut self, least: usize, field: &'static str) -> Result<usize, MessageError> {
        let count = self.u32(field)? as usize;
        match count.checked_mul(least) {
            Some(bytes) if bytes <= self.remaining() => Ok(count),
            _ => Err(MessageError::Cut { field }),
        }
    }

    /// A sequence of numbers.
    pub(crate) fn f64_sequence(&mut self, field: &'static str) -> Result<Vec<f64>, MessageError> {
        let count = self.count(8, field)?;
        (0..count).map(|_| self.f64(field)).collect()
    }

    /// A sequence of bytes.
    pub(crate) fn bytes(&mut self, field: &'static str) -> Result<&'a [u8], MessageError> {
        let length = self.count(1, field)?;
        self.take(length, field)
    }

    /// A text.
    pub(crate) fn text(&mut self, field: &'static str) -> Result<&'a str, MessageError> {
        let bytes = self.bytes(field)?;
        let bytes = match self.layout {
            Layout::Packed => bytes,
            Layout::Cdr { .. } => bytes.strip_suffix(&[0]).unwrap_or(bytes),
        };
        std::str::from_utf8(bytes).map_err(|_| MessageError::field(field, "is no UTF-8 text"))
    }

    /// A time: seconds, with a sign in ROS 2, and nanoseconds.
    pub(crate) fn stamp(&mut self, field: &'static str) -> Result<Stamp, MessageError> {
        let seconds = self.u32(field)?;
        let nanoseconds = self.u32(field)?;
        let seconds = match self.layout {
            Layout::Packed => i64::from(seconds),
            Layout::Cdr { .. } => i64::from(seconds.cast_signed()),
        };
        Ok(Stamp::new(seconds, nanoseconds))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_cdr_lie_at_multiples_of_their_size_in_both_byte_orders() {
        let mut little = vec![0, 1, 0, 0, 7, 0, 0, 0];
        little.extend(5_u32.to_le_bytes());
        little.extend([0; 0]);
        little.extend([2, 0, 0, 0, b'a', 0, 0, 0]);
        little.extend(1.5_f64.to_le_bytes());
        let mut big = vec![0, 0, 0, 0, 7, 0, 0, 0];
        big.extend(5_u32.to_be_bytes());
        big.extend([0, 0, 0, 2, b'a', 0, 0, 0]);
        big.extend(1.5_f64.to_be_bytes());
        for message in [little, big] {
            let mut fields = Fields::cdr(&message).expect("CDR");
            assert_eq!(fields.u8("a"), Ok(7));
            assert_eq!(fields.u32("b"), Ok(5));
            assert_eq!(fields.text("c"), Ok("a"));
            assert_eq!(fields.f64("d"), Ok(1.5));
            assert_eq!(fields.f64("e"), Err(MessageError::Cut { field: "e" }));
        }
        let mut packed = Fields::packed(&[7, 5, 0, 0, 0, 1, 0, 0, 0, b'a']);
        assert_eq!((packed.u8("a"), packed.u32("b"), packed.text("c")), (Ok(7), Ok(5), Ok("a")));
    }

    #[test]
    fn a_length_beyond_the_message_is_refused_before_anything_is_allocated() {
        let huge = [0xff, 0xff, 0xff, 0x7f, 0, 0];
        assert!(Fields::packed(&huge).bytes("data").is_err());
        assert!(Fields::packed(&huge).f64_sequence("d").is_err());
        assert!(Fields::cdr(&[0, 3, 0, 0]).expect_err("parameters").to_string().contains("0003"));
    }
}
