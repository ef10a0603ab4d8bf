//! The reader: positions, normals, colours and labels.
//!
//! Our own: the one of crates.io that knows binary_compressed indexes past the data where a header promises too much, and
//! allocates what it promises. Here the memory is bounded by the size of the file.

use super::Viewpoint;
use super::header::{Field, Header, Kind, Storage};
use super::lzf;
use crate::geometry::{MAX_VERTICES, linear};
use crate::levels::{Range, largest};
use crate::text::{decoded, lines, number};
use crate::{Geometry, ReadError, offset};

/// Most bytes that packed data may stand for.
const MAX_UNPACKED: usize = 1 << 30;

/// A point cloud as it is stored; every column that is there has one entry a point.
#[derive(Clone, Debug, PartialEq)]
pub struct PcdCloud {
    /// Points in a row.
    pub width: u32,
    /// Rows; 1 where the cloud is not organized.
    pub height: u32,
    /// Positions in the file's unit (usually metres), row-major; NaN where the sensor saw nothing.
    pub positions: Vec<[f64; 3]>,
    /// Normals, if the file has them.
    pub normals: Option<Vec<[f32; 3]>>,
    /// sRGB colours, if the file has them.
    pub colors: Option<Vec<[u8; 3]>>,
    /// The field `label`, if the file has it; 0 where it is no whole number.
    pub labels: Option<Vec<u32>>,
    /// Pose of the sensor as the file states it; it is not applied to the points.
    pub viewpoint: Option<Viewpoint>,
    /// What of the file was not read, a sentence each.
    pub warnings: Vec<String>,
}

impl PcdCloud {
    /// The points and what is known of them. Labels that no class can have count as none.
    pub(crate) fn into_geometry(mut self) -> Geometry {
        let labels = self.labels.unwrap_or_default();
        let too_large = labels.iter().filter(|l| **l > u32::from(u16::MAX)).count();
        if too_large > 0 {
            self.warnings.push(format!("{too_large} labels are over 65535 and count as none"));
        }
        let share = |level: u8| f32::from(level) / 255.0;
        Geometry {
            positions: self.positions,
            normals: self.normals.unwrap_or_default(),
            colors: self.colors.unwrap_or_default().into_iter().map(|c| linear(c.map(share))).collect(),
            labels: labels.into_iter().map(|l| u16::try_from(l).unwrap_or(0)).collect(),
            warnings: self.warnings,
            ..Geometry::default()
        }
    }
}

/// Reads the bytes of the file `name`.
///
/// # Errors
/// [`ReadError::Format`] that says what is wrong.
pub fn read(name: &str, bytes: &[u8]) -> Result<PcdCloud, ReadError> {
    parse(bytes).map_err(|reason| ReadError::format(name, "PCD", &reason))
}

/// Reads a file from disk.
///
/// # Errors
/// [`ReadError`] with the path as the name of the file.
#[cfg(not(target_arch = "wasm32"))]
pub fn read_file(path: &std::path::Path) -> Result<PcdCloud, ReadError> {
    let file = path.display().to_string();
    let bytes = crate::regular_file::read(path).map_err(|source| ReadError::Io { file: file.clone(), source })?;
    read(&file, &bytes)
}

pub(super) fn parse(data: &[u8]) -> Result<PcdCloud, String> {
    let (header, body) = Header::parse(data)?;
    if header.points > MAX_VERTICES {
        return Err(format!("it holds {} points; {MAX_VERTICES} are the most", header.points));
    }
    let unpacked;
    let mut more = 0;
    let (content, by_point) = match header.storage {
        Storage::Ascii => {
            (unpacked, more) = from_text(&header, body)?;
            (unpacked.as_slice(), true)
        }
        Storage::Binary => (body, true),
        Storage::Compressed => {
            unpacked = decompress(&header, body)?;
            (unpacked.as_slice(), false)
        }
    };
    let needed = header.points.checked_mul(header.record()).filter(|n| *n <= content.len());
    let needed = needed.ok_or_else(|| {
        format!("{} points of {} bytes do not fit {} bytes", header.points, header.record(), content.len())
    })?;
    let table = Table { header: &header, content: &content[..needed], by_point };
    let positions = table.triple(["x", "y", "z"]).ok_or("the fields x, y and z are not all there")?;
    let mut warnings = table.unread();
    if header.storage == Storage::Binary {
        more = (content.len() - needed) / header.record();
    }
    if more > 0 {
        warnings.push(format!("{more} points follow that the header does not count"));
    }
    let labels = table.column("label").map(|c| labels(c, &mut warnings));
    let normals = table.triple(["normal_x", "normal_y", "normal_z"]).or_else(|| table.triple(["nx", "ny", "nz"]));
    Ok(PcdCloud {
        width: header.width,
        height: header.height,
        positions,
        normals: normals.map(|normals| offset::single(&normals)),
        colors: table.colors(),
        labels,
        viewpoint: header.viewpoint,
        warnings,
    })
}

/// Labels as whole numbers, whatever their type; the others are counted.
fn labels(column: Column<'_>, warnings: &mut Vec<String>) -> Vec<u32> {
    let mut unusable = 0_usize;
    let label = |value: f64| {
        let is_label = (0.0..=f64::from(u32::MAX)).contains(&value) && value.fract() == 0.0;
        unusable += usize::from(!is_label);
        if is_label { value as u32 } else { 0 }
    };
    let labels = column.values().map(label).collect();
    if unusable > 0 {
        warnings.push(format!("{unusable} labels are no whole numbers from 0 on and count as none"));
    }
    labels
}

/// 0xAARRGGBB.
fn color(bits: u32) -> [u8; 3] {
    [(bits >> 16) as u8, (bits >> 8) as u8, bits as u8]
}

fn decompress(header: &Header, body: &[u8]) -> Result<Vec<u8>, String> {
    if header.points == 0 {
        return Ok(Vec::new());
    }
    let size = |at: usize| body.get(at..at + 4)?.try_into().ok().map(|b| u32::from_le_bytes(b) as usize);
    let (Some(packed), Some(length)) = (size(0), size(4)) else {
        return Err("the sizes of the packed data are cut short".into());
    };
    if header.points.checked_mul(header.record()) != Some(length) {
        return Err(format!("{} points of {} bytes are not {length} bytes", header.points, header.record()));
    }
    if length > MAX_UNPACKED {
        return Err(format!("its packed data stand for {length} bytes; {MAX_UNPACKED} are the most"));
    }
    let content = body[8..].get(..packed).ok_or_else(|| format!("{packed} packed bytes leave the file"))?;
    lzf::unpack(content, length)
}

/// Text to the layout of `DATA binary`, and how many lines follow the points that the header counts.
fn from_text(header: &Header, body: &[u8]) -> Result<(Vec<u8>, usize), String> {
    let values: usize = header.fields.iter().map(|f| f.count).sum();
    // A value takes a digit and a separator.
    if header.points.checked_mul(2 * values).is_none_or(|n| n > body.len() + 1) {
        return Err(format!("{} points do not fit {} bytes of text", header.points, body.len()));
    }
    let mut out = Vec::with_capacity(header.points * header.record());
    let mut lines = lines(body).map(<[u8]>::trim_ascii).filter(|l| !l.is_empty());
    for i in 0..header.points {
        let line = decoded(lines.next().ok_or_else(|| format!("{i} points of {}", header.points))?);
        let mut words = line.split_whitespace();
        for field in &header.fields {
            for _ in 0..field.count {
                let word = words.next().ok_or_else(|| format!("point {i}: field {} is missing", field.name))?;
                write_value(&mut out, field.kind, word)
                    .ok_or_else(|| format!("point {i}: field {}: {word:?} is no number", field.name))?;
            }
        }
        if words.next().is_some() {
            return Err(format!("point {i}: its line has more numbers than the header names"));
        }
    }
    Ok((out, lines.count()))
}

fn write_value(out: &mut Vec<u8>, kind: Kind, word: &str) -> Option<()> {
    // Integers that a writer printed as floats are taken as what they are.
    let int = || word.parse::<i64>().ok().or_else(|| number(word).filter(|v| v.is_finite()).map(|v| v as i64));
    match kind {
        // Not by way of f64: colours are packed into the bits.
        Kind::F32 => out.extend(word.parse().ok().or_else(|| Some(number(word)? as f32))?.to_le_bytes()),
        Kind::F64 => out.extend(number(word)?.to_le_bytes()),
        Kind::I8 | Kind::U8 => out.extend((int()? as u8).to_le_bytes()),
        Kind::I16 | Kind::U16 => out.extend((int()? as u16).to_le_bytes()),
        Kind::I32 | Kind::U32 => out.extend((int()? as u32).to_le_bytes()),
        Kind::I64 => out.extend(int()?.to_le_bytes()),
        Kind::U64 => out.extend(word.parse().ok().or_else(|| Some(int()? as u64))?.to_le_bytes()),
    }
    Some(())
}

/// A field's name without capitals and CloudCompare's `scalar_`.
fn plain(name: &str) -> String {
    let lower = name.to_ascii_lowercase();
    lower.strip_prefix("scalar_").map_or(lower.clone(), str::to_owned)
}

/// The points' bytes, point by point or field by field.
struct Table<'a> {
    header: &'a Header,
    content: &'a [u8],
    by_point: bool,
}

impl<'a> Table<'a> {
    /// The first value of each point's field `name`.
    fn column(&self, name: &str) -> Option<Column<'a>> {
        let exact = self.header.fields.iter().position(|f| f.name == name);
        let at = exact.or_else(|| self.header.fields.iter().position(|f| plain(&f.name) == name))?;
        let field = &self.header.fields[at];
        let before: usize = self.header.fields[..at].iter().map(Field::size).sum();
        let (start, stride) = match self.by_point {
            true => (before, self.header.record()),
            false => (before * self.header.points, field.size()),
        };
        Some(Column {
            content: self.content.get(start..).unwrap_or_default(),
            stride,
            kind: field.kind,
            points: self.header.points,
        })
    }

    /// Colours: packed into one number, or a field for each channel.
    fn colors(&self) -> Option<Vec<[u8; 3]>> {
        if let Some(packed) = self.column("rgb").or_else(|| self.column("rgba")) {
            return Some(packed.packed().map(color).collect());
        }
        let names = [["red", "green", "blue"], ["r", "g", "b"]];
        let (names, channels) = names.into_iter().find_map(|names| Some((names, self.triple(names)?)))?;
        let has_fraction =
            names.iter().any(|n| self.column(n).is_some_and(|c| matches!(c.kind, Kind::F32 | Kind::F64)));
        let range = Range::of(has_fraction, largest(channels.iter().flatten()));
        Some(channels.into_iter().map(|c| c.map(|channel| range.level(channel))).collect())
    }

    /// What is said of the fields that are not read.
    fn unread(&self) -> Vec<String> {
        const READ: [&str; 20] = [
            "x", "y", "z", "normal_x", "normal_y", "normal_z", "nx", "ny", "nz", "rgb", "rgba", "label", "red",
            "green", "blue", "r", "g", "b", "_", "a",
        ];
        let fields = &self.header.fields;
        let twice = |i: usize| fields[..i].iter().any(|f| f.name == fields[i].name && f.name != "_");
        let unread = fields.iter().enumerate().filter(|(i, f)| !READ.contains(&plain(&f.name).as_str()) || twice(*i));
        let names: Vec<&str> = unread.map(|(_, f)| f.name.as_str()).collect();
        if names.is_empty() { Vec::new() } else { vec![format!("is not read: {}", names.join(", "))] }
    }

    fn triple(&self, names: [&str; 3]) -> Option<Vec<[f64; 3]>> {
        let [x, y, z] = names.map(|n| self.column(n));
        let (x, y, z) = (x?, y?, z?);
        let values = x.values().zip(y.values()).zip(z.values());
        Some(values.map(|((x, y), z)| [x, y, z]).collect())
    }
}

#[derive(Clone, Copy)]
struct Column<'a> {
    content: &'a [u8],
    stride: usize,
    kind: Kind,
    points: usize,
}

impl<'a> Column<'a> {
    fn raw(self) -> impl Iterator<Item = [u8; 8]> + 'a {
        let size = self.kind.size();
        // The last record may be shorter than the stride: only the value itself has to be there.
        (0..self.points).map(move |i| {
            let mut word = [0; 8];
            if let Some(bytes) = self.content.get(i * self.stride..i * self.stride + size) {
                word[..size].copy_from_slice(bytes);
            }
            word
        })
    }

    /// The values as numbers.
    fn values(self) -> impl Iterator<Item = f64> + 'a {
        self.raw().map(move |w| {
            let low4 = [w[0], w[1], w[2], w[3]];
            match self.kind {
                Kind::F32 => f32::from_le_bytes(low4).into(),
                Kind::F64 => f64::from_le_bytes(w),
                Kind::I8 => (w[0] as i8).into(),
                Kind::U8 => w[0].into(),
                Kind::I16 => i16::from_le_bytes([w[0], w[1]]).into(),
                Kind::U16 => u16::from_le_bytes([w[0], w[1]]).into(),
                Kind::I32 => i32::from_le_bytes(low4).into(),
                Kind::U32 => u32::from_le_bytes(low4).into(),
                Kind::I64 => i64::from_le_bytes(w) as f64,
                Kind::U64 => u64::from_le_bytes(w) as f64,
            }
        })
    }

    /// Packed colours: the low 32 bits of whole numbers and of single precision. Early versions of PCL wrote the whole
    /// number itself as a float; then all are whole and positive, which the bits of colours never are.
    fn packed(self) -> impl Iterator<Item = u32> + 'a {
        let is_float = matches!(self.kind, Kind::F32 | Kind::F64);
        let whole = |v: f64| v == 0.0 || (1.0..16_777_216.0).contains(&v) && v.fract() == 0.0;
        let by_value = is_float && self.values().any(|v| v != 0.0) && self.values().all(whole);
        let low = |w: [u8; 8]| u32::from_le_bytes([w[0], w[1], w[2], w[3]]);
        let bits = move |w: [u8; 8], value: f64| match self.kind {
            _ if by_value => value as u32,
            Kind::F64 => (value as f32).to_bits(),
            _ => low(w),
        };
        self.raw().zip(self.values()).map(move |(w, value)| bits(w, value))
    }
}
