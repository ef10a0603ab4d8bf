//! A PLY file's header: its format, and which elements with which properties follow.

use crate::text::{decoded, without_mark};
use semascan_model::NumberType;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Format {
    Ascii,
    Little,
    Big,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

#[derive(Clone, Debug)]
pub(super) struct Property {
    pub(super) name: String,
    /// Type of the length, for lists.
    pub(super) list: Option<Kind>,
    pub(super) kind: Kind,
}

#[derive(Clone, Debug)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: usize,
    pub(super) properties: Vec<Property>,
}

pub(super) struct Header {
    pub(super) format: Format,
    pub(super) comments: Vec<String>,
    pub(super) elements: Vec<Element>,
    /// Bytes up to the first value.
    pub(super) length: usize,
}

impl Header {
    pub(super) fn read(bytes: &[u8]) -> Result<Self, String> {
        let mut header = Self { format: Format::Ascii, comments: Vec::new(), elements: Vec::new(), length: 0 };
        header.length = bytes.len() - without_mark(bytes).len();
        // Where lines end with CR alone, an LF after `end_header` is the first byte of binary data.
        let (mut first, mut format, mut cr_alone) = (true, None, false);
        loop {
            let rest = &bytes[header.length..];
            let end = rest.iter().position(|b| matches!(b, b'\n' | b'\r')).ok_or("the header has no end")?;
            let pair = rest[end..].starts_with(b"\r\n") && !cr_alone;
            let line = decoded(&rest[..end]);
            let line = line.trim();
            header.length += end + if pair { 2 } else { 1 };
            if std::mem::take(&mut first) {
                if !line.eq_ignore_ascii_case("ply") {
                    return Err("it does not begin with `ply`".into());
                }
                cr_alone = rest[end] == b'\r' && !pair;
                continue;
            }
            let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
            let rest = rest.trim();
            match word {
                "end_header" => break,
                "comment" => header.comments.push(rest.to_owned()),
                "format" => {
                    format = Some(match rest.split_whitespace().next() {
                        Some("ascii") => Format::Ascii,
                        Some("binary_little_endian") => Format::Little,
                        Some("binary_big_endian") => Format::Big,
                        _ => return Err(format!("format `{rest}` is unknown")),
                    });
                }
                "element" => {
                    let parsed = rest
                        .rsplit_once(char::is_whitespace)
                        .and_then(|(name, n)| Some((name.trim(), n.parse().ok()?)));
                    let (name, count) = parsed.ok_or_else(|| format!("header line `{line}`"))?;
                    header.elements.push(Element { name: name.to_owned(), count, properties: Vec::new() });
                }
                "property" => {
                    let property = property(rest).ok_or_else(|| format!("header line `{line}`"))?;
                    header.elements.last_mut().ok_or("a property of nothing")?.properties.push(property);
                }
                // `obj_info` and what else programs add.
                _ => {}
            }
        }
        header.format = format.ok_or("the header names no format")?;
        Ok(header)
    }
}

fn property(text: &str) -> Option<Property> {
    let words: Vec<&str> = text.split_whitespace().collect();
    match words[..] {
        ["list", length, kind, name] => {
            Some(Property { name: name.into(), list: Some(Kind::parse(length)?), kind: Kind::parse(kind)? })
        }
        [kind, name] => Some(Property { name: name.into(), list: None, kind: Kind::parse(kind)? }),
        _ => None,
    }
}

impl Kind {
    fn parse(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "int64" => Self::I64,
            "uint64" => Self::U64,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    /// The type under which numbers of a column are written: the names with their size, because Open3D passes over columns
    /// of a `ushort`.
    pub(super) fn name_of(number: NumberType) -> &'static str {
        match number {
            NumberType::U8 => "uint8",
            NumberType::U16 => "uint16",
            NumberType::F32 => "float32",
        }
    }

    /// Whether numbers of it can have a fraction.
    pub(super) fn has_fraction(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }

    /// Bytes of a number.
    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }
}
