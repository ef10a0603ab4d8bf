//! The text at the head of a PCD file (Point Cloud Library, *The PCD file format*, version 0.7): which fields a point
//! has, how many points there are and how they are stored.

use crate::text::{decoded, split_line, without_mark};

/// How the points are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Storage {
    /// Text, one point a line.
    Ascii,
    /// Point after point.
    Binary,
    /// Field after field, packed by LZF.
    Compressed,
}

/// Type of one value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    F32,
    F64,
    I8,
    I16,
    I32,
    I64,
    U8,
    U16,
    U32,
    U64,
}

impl Kind {
    fn new(letter: &str, size: usize) -> Option<Self> {
        Some(match (letter.to_ascii_uppercase().as_str(), size) {
            ("F", 4) => Self::F32,
            ("F", 8) => Self::F64,
            ("I", 1) => Self::I8,
            ("I", 2) => Self::I16,
            ("I", 4) => Self::I32,
            ("I", 8) => Self::I64,
            ("U", 1) => Self::U8,
            ("U", 2) => Self::U16,
            ("U", 4) => Self::U32,
            ("U", 8) => Self::U64,
            _ => return None,
        })
    }

    /// Bytes of one value.
    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::F32 | Self::I32 | Self::U32 => 4,
            Self::F64 | Self::I64 | Self::U64 => 8,
        }
    }
}

/// One field of a point.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Field {
    pub(super) name: String,
    pub(super) kind: Kind,
    /// Values of the field.
    pub(super) count: usize,
}

impl Field {
    /// Bytes of the field.
    pub(super) fn size(&self) -> usize {
        self.kind.size() * self.count
    }
}

/// Pose of the sensor in the frame of the points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewpoint {
    /// Its place, in the file's unit.
    pub translation: [f64; 3],
    /// Its rotation as a unit quaternion w, x, y, z.
    pub rotation: [f64; 4],
}

/// What the header says.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Header {
    pub(super) fields: Vec<Field>,
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) points: usize,
    /// Pose of the sensor; `None` where the file states none that is rigid.
    pub(super) viewpoint: Option<Viewpoint>,
    pub(super) storage: Storage,
}

/// Longest header; real ones have some hundred bytes.
const MAX_HEADER: usize = 64 * 1024;
/// Most values of a field (a feature histogram has 352).
const MAX_COUNT: usize = 4096;
/// Most fields of a point.
const MAX_FIELDS: usize = 256;

impl Header {
    /// Bytes of one point.
    pub(super) fn record(&self) -> usize {
        self.fields.iter().map(Field::size).sum()
    }

    /// Reads the header; what follows it in `data` is returned beside it.
    pub(super) fn parse(data: &[u8]) -> Result<(Self, &[u8]), String> {
        let mut lines = Lines::default();
        let mut rest = without_mark(data);
        let storage = loop {
            let (line, after) = split_line(&rest[..rest.len().min(MAX_HEADER)])
                .filter(|(line, _)| line.len() < rest.len() && data.len() - rest.len() <= MAX_HEADER)
                .ok_or("the header does not end with a DATA line")?;
            // The line was looked for in the head of the rest only.
            rest = &rest[rest.len().min(MAX_HEADER) - after.len()..];
            let line = decoded(line);
            let mut words = line.split_whitespace();
            match words.next().map(str::to_ascii_uppercase).as_deref() {
                Some("DATA") => match words.next().map(str::to_ascii_lowercase).as_deref() {
                    Some("ascii") => break Storage::Ascii,
                    Some("binary") => break Storage::Binary,
                    Some("binary_compressed") => break Storage::Compressed,
                    other => return Err(format!("DATA {} is unknown", other.unwrap_or("without a word"))),
                },
                Some(key) if !key.starts_with('#') => lines.take(key, words.map(str::to_owned).collect()),
                _ => {}
            }
        };
        lines.header(storage).map(|header| (header, rest))
    }
}

/// The words of each line of interest.
#[derive(Default)]
struct Lines {
    fields: Vec<String>,
    sizes: Vec<String>,
    types: Vec<String>,
    counts: Vec<String>,
    width: Vec<String>,
    height: Vec<String>,
    points: Vec<String>,
    viewpoint: Vec<String>,
}

impl Lines {
    fn take(&mut self, key: &str, words: Vec<String>) {
        match key {
            "FIELDS" | "COLUMNS" => self.fields = words,
            "SIZE" => self.sizes = words,
            "TYPE" => self.types = words,
            "COUNT" => self.counts = words,
            "WIDTH" => self.width = words,
            "HEIGHT" => self.height = words,
            "POINTS" => self.points = words,
            "VIEWPOINT" => self.viewpoint = words,
            _ => {}
        }
    }

    fn header(self, storage: Storage) -> Result<Header, String> {
        let n = self.fields.len();
        if n == 0 || n > MAX_FIELDS {
            return Err(format!("FIELDS names {n} fields"));
        }
        let counts = if self.counts.is_empty() { vec!["1".to_owned(); n] } else { self.counts };
        for (key, given) in [("SIZE", self.sizes.len()), ("TYPE", self.types.len()), ("COUNT", counts.len())] {
            if given != n {
                return Err(format!("{key} has {given} entries for {n} fields"));
            }
        }
        let mut fields = Vec::with_capacity(n);
        for (i, name) in self.fields.into_iter().enumerate() {
            let kind = self.sizes[i].parse().ok().and_then(|size| Kind::new(&self.types[i], size));
            let kind = kind.ok_or_else(|| format!("field {name}: TYPE {} SIZE {}", self.types[i], self.sizes[i]))?;
            let count = counts[i].parse().ok().filter(|c| (1..=MAX_COUNT).contains(c));
            let count = count.ok_or_else(|| format!("field {name}: COUNT {}", counts[i]))?;
            fields.push(Field { name, kind, count });
        }
        let number = |key: &str, words: &[String]| -> Result<u32, String> {
            let word = words.first().ok_or_else(|| format!("{key} is missing"))?;
            word.parse().map_err(|_| format!("{key} {word} is no count"))
        };
        // Versions before 0.5 have no rows.
        let height = if self.height.is_empty() { 1 } else { number("HEIGHT", &self.height)? };
        let width = if self.width.is_empty() { number("POINTS", &self.points)? } else { number("WIDTH", &self.width)? };
        let points = u64::from(width) * u64::from(height);
        if !self.points.is_empty() && u64::from(number("POINTS", &self.points)?) != points {
            return Err(format!("POINTS {} is not WIDTH {width} times HEIGHT {height}", self.points[0]));
        }
        let points = usize::try_from(points).map_err(|_| format!("{points} points are too many"))?;
        Ok(Header { fields, width, height, points, viewpoint: viewpoint(&self.viewpoint), storage })
    }
}

/// `tx ty tz qw qx qy qz`.
fn viewpoint(words: &[String]) -> Option<Viewpoint> {
    let values: Vec<f64> = words.iter().map(|w| w.parse()).collect::<Result<_, _>>().ok()?;
    let &[x, y, z, qw, qx, qy, qz] = values.as_slice() else { return None };
    let length = (qw * qw + qx * qx + qy * qy + qz * qz).sqrt();
    let rigid = length > 1e-6 && values.iter().all(|v| v.is_finite());
    rigid.then(|| Viewpoint { translation: [x, y, z], rotation: [qw, qx, qy, qz].map(|c| c / length) })
}
