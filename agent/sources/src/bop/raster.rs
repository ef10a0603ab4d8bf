//! Picture files as their numbers, before anything is made of them: what the `image` crate would convert on the way
//! (palettes to colours) or does not read (TIFF of floating point numbers) is read as it is stored.

use image::{DynamicImage, ImageFormat, ImageReader, Limits};
use semascan_formats::regular_file;
use semascan_inspection::source::SourceError;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;
use tiff::decoder::{Decoder, DecodingResult};
use tiff::{ColorType, TiffError};

/// Largest picture edge that is read: beyond any camera, and a bound on what a broken header can ask for.
const MAX_EDGE: u32 = 16_384;
/// Most pixels of a picture: a few bytes can stand for many.
const MAX_PIXELS: u64 = 1 << 26;

/// A TIFF of one number a pixel.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct GreyTiff {
    /// Columns and rows.
    pub(super) size: (u32, u32),
    /// Row by row.
    pub(super) values: Vec<f64>,
    /// The largest value of the type: a sensor's mark for out of range. `None` for floating point numbers.
    pub(super) largest: Option<f64>,
    /// Bits of a number.
    pub(super) bits: u8,
}

/// A PNG of palette indices.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct PalettePng {
    /// Columns and rows.
    pub(super) size: (u32, u32),
    /// Row by row.
    indices: Vec<u8>,
    /// Red, green, blue of each index.
    palette: Vec<[u8; 3]>,
}

impl PalettePng {
    /// The pixels whose colour is not black, as any program shows it; where all are black, those whose index is not 0.
    /// `None` if several colours are there and none of them is black.
    pub(super) fn inside(&self) -> Option<Vec<bool>> {
        let shown = |i: &u8| self.palette.get(usize::from(*i)).is_some_and(|c| *c != [0; 3]);
        let inside: Vec<bool> = self.indices.iter().map(shown).collect();
        let one_index = self.indices.windows(2).all(|w| w[0] == w[1]);
        match (inside.contains(&true), inside.contains(&false)) {
            _ if one_index => Some(inside),
            (false, _) => Some(self.indices.iter().map(|i| *i != 0).collect()),
            (true, false) => None,
            (true, true) => Some(inside),
        }
    }
}

/// The format of a picture file, by its first bytes.
///
/// # Errors
/// [`SourceError::Io`] naming the file.
pub(super) fn format(path: &Path) -> Result<Option<ImageFormat>, SourceError> {
    Ok(open(path)?.format())
}

/// Columns and rows of a picture file, by its head.
///
/// # Errors
/// [`SourceError`] naming the file.
pub(crate) fn dimensions(path: &Path) -> Result<(u32, u32), SourceError> {
    let bad = |e: image::ImageError| SourceError::Format { path: path.to_owned(), reason: e.to_string() };
    let size = open(path)?.into_dimensions().map_err(bad)?;
    check_size(path, size)?;
    Ok(size)
}

/// Reads a picture file of any format.
///
/// # Errors
/// [`SourceError`] naming the file.
pub(super) fn read(path: &Path) -> Result<DynamicImage, SourceError> {
    let bad = |e: image::ImageError| SourceError::Format { path: path.to_owned(), reason: e.to_string() };
    dimensions(path)?;
    let mut reader = open(path)?;
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_EDGE);
    limits.max_image_height = Some(MAX_EDGE);
    reader.limits(limits);
    reader.decode().map_err(bad)
}

/// Refuses a picture of more pixels than are read, before memory is taken for them.
fn check_size(path: &Path, (width, height): (u32, u32)) -> Result<(), SourceError> {
    if width.max(height) <= MAX_EDGE && u64::from(width) * u64::from(height) <= MAX_PIXELS {
        return Ok(());
    }
    let reason = format!(
        "{width}x{height} pixels: larger than any camera's picture; {MAX_EDGE} along an edge and {MAX_PIXELS} in all are the most"
    );
    Err(SourceError::Format { path: path.to_owned(), reason })
}

/// Reads a TIFF of one number a pixel, of 8 bits and more; `None` if it is one of another kind.
///
/// # Errors
/// [`SourceError`] naming the file.
pub(super) fn read_grey_tiff(path: &Path) -> Result<Option<GreyTiff>, SourceError> {
    let bad = |e: TiffError| SourceError::Format { path: path.to_owned(), reason: e.to_string() };
    let mut decoder = Decoder::new(BufReader::new(file(path)?)).map_err(bad)?;
    let size = decoder.dimensions().map_err(bad)?;
    check_size(path, size)?;
    let bits = match decoder.colortype().map_err(bad)? {
        ColorType::Gray(bits @ 8..) => bits,
        _ => return Ok(None),
    };
    let (values, largest): (Vec<f64>, Option<f64>) = match decoder.read_image().map_err(bad)? {
        DecodingResult::U8(v) => (v.into_iter().map(f64::from).collect(), Some(u8::MAX.into())),
        DecodingResult::U16(v) => (v.into_iter().map(f64::from).collect(), Some(u16::MAX.into())),
        DecodingResult::U32(v) => (v.into_iter().map(f64::from).collect(), Some(u32::MAX.into())),
        DecodingResult::U64(v) => (v.into_iter().map(|v| v as f64).collect(), Some(u64::MAX as f64)),
        DecodingResult::I8(v) => (v.into_iter().map(f64::from).collect(), Some(i8::MAX.into())),
        DecodingResult::I16(v) => (v.into_iter().map(f64::from).collect(), Some(i16::MAX.into())),
        DecodingResult::I32(v) => (v.into_iter().map(f64::from).collect(), Some(i32::MAX.into())),
        DecodingResult::I64(v) => (v.into_iter().map(|v| v as f64).collect(), Some(i64::MAX as f64)),
        DecodingResult::F16(v) => (v.into_iter().map(|v| v.to_f64()).collect(), None),
        DecodingResult::F32(v) => (v.into_iter().map(f64::from).collect(), None),
        DecodingResult::F64(v) => (v, None),
    };
    if values.len() != size.0 as usize * size.1 as usize {
        let reason = format!("{} numbers for {}x{} pixels", values.len(), size.0, size.1);
        return Err(SourceError::Format { path: path.to_owned(), reason });
    }
    Ok(Some(GreyTiff { size, values, largest, bits }))
}

/// Reads a PNG of palette indices; `None` if it is one of another kind.
///
/// # Errors
/// [`SourceError`] naming the file.
pub(super) fn read_palette_png(path: &Path) -> Result<Option<PalettePng>, SourceError> {
    let bad = |reason: String| SourceError::Format { path: path.to_owned(), reason };
    let mut decoder = png::Decoder::new(BufReader::new(file(path)?));
    decoder.set_transformations(png::Transformations::IDENTITY);
    let mut reader = decoder.read_info().map_err(|e| bad(e.to_string()))?;
    let info = reader.info();
    if info.color_type != png::ColorType::Indexed {
        return Ok(None);
    }
    let (width, height, bits) = (info.width, info.height, info.bit_depth as u32);
    check_size(path, (width, height))?;
    let palette = info.palette.as_ref().ok_or_else(|| bad("a palette is missing".into()))?;
    let palette = palette.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
    let bytes = reader.output_buffer_size().ok_or_else(|| bad("too large".into()))?;
    let mut rows = vec![0; bytes];
    reader.next_frame(&mut rows).map_err(|e| bad(e.to_string()))?;
    // Several indices share a byte, the first in its high bits; a row begins with a new byte.
    let stride = (width * bits).div_ceil(8);
    let index = |x: u32, y: u32| {
        let bit = x * bits;
        let byte = rows.get((y * stride + bit / 8) as usize).copied().unwrap_or(0);
        let shift = 8 - bits - bit % 8;
        (byte >> shift) & (0xff_u8 >> (8 - bits))
    };
    let indices = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| index(x, y)).collect();
    Ok(Some(PalettePng { size: (width, height), indices, palette }))
}

fn open(path: &Path) -> Result<ImageReader<BufReader<File>>, SourceError> {
    let reader = ImageReader::new(BufReader::new(file(path)?));
    reader.with_guessed_format().map_err(|source| SourceError::Io { path: path.to_owned(), source })
}

fn file(path: &Path) -> Result<File, SourceError> {
    regular_file::open(path).map_err(|source| SourceError::Io { path: path.to_owned(), source })
}

#[cfg(test)]
mod tests {
    use super::*;
    use tiff::encoder::{TiffEncoder, colortype};

    #[test]
    fn floating_point_and_long_numbers_come_as_they_are() {
        let dir = tempfile::tempdir().expect("folder");
        let path = dir.path().join("float.tif");
        let mut file = File::create(&path).expect("made");
        let mut encoder = TiffEncoder::new(&mut file).expect("begun");
        encoder.write_image::<colortype::Gray32Float>(2, 1, &[0.5, f32::NAN]).expect("written");
        let read = read_grey_tiff(&path).expect("reads").expect("grey");
        assert_eq!((read.size, read.values[0], read.largest, read.bits), ((2, 1), 0.5, None, 32));
        assert!(read.values[1].is_nan());
    }

    #[test]
    fn a_header_that_asks_for_too_much_is_refused_by_its_limit() {
        let dir = tempfile::tempdir().expect("folder");
        let path = dir.path().join("large.png");
        for (color, bits) in
            [(png::ColorType::Indexed, png::BitDepth::One), (png::ColorType::Grayscale, png::BitDepth::Sixteen)]
        {
            let mut file = File::create(&path).expect("made");
            let mut encoder = png::Encoder::new(&mut file, 16_384, 16_384);
            encoder.set_color(color);
            encoder.set_depth(bits);
            encoder.set_palette(vec![0; 6]);
            // The head and the begin of what follows: the pixels never come.
            let mut writer = encoder.write_header().expect("begun");
            writer.write_chunk(png::chunk::IDAT, &[0; 8]).expect("written");
            drop(writer);
            let refused = match color {
                png::ColorType::Indexed => read_palette_png(&path).map(drop),
                _ => read(&path).map(drop),
            };
            let error = refused.expect_err("too large").to_string();
            assert!(error.contains("large.png") && error.contains("67108864"), "{error}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn pipes_and_devices_are_no_pictures() {
        let dir = tempfile::tempdir().expect("folder");
        let path = dir.path().join("000000.png");
        std::os::unix::fs::symlink("/dev/zero", &path).expect("links");
        for refused in [read(&path).map(drop), read_grey_tiff(&path).map(drop), read_palette_png(&path).map(drop)] {
            let error = refused.expect_err("a device").to_string();
            assert!(error.contains("000000.png") && error.contains("device"), "{error}");
        }
    }

    #[test]
    fn palettes_are_read_by_colour_and_by_index_where_all_is_black() {
        let png = |indices: &[u8], palette: &[[u8; 3]]| PalettePng {
            size: (indices.len() as u32, 1),
            indices: indices.to_vec(),
            palette: palette.to_vec(),
        };
        let (black, white, red) = ([0; 3], [255; 3], [255, 0, 0]);
        assert_eq!(png(&[0, 1], &[black, red]).inside(), Some(vec![false, true]));
        assert_eq!(png(&[0, 1], &[white, black]).inside(), Some(vec![true, false]));
        assert_eq!(png(&[0, 1], &[black, black]).inside(), Some(vec![false, true]));
        assert_eq!(png(&[0, 1], &[white, red]).inside(), None);
        assert_eq!(png(&[1, 1], &[black, red]).inside(), Some(vec![true, true]));
        assert_eq!(png(&[0, 0], &[black, red]).inside(), Some(vec![false, false]));
    }
}
