//! Pixel formats of GenICam (its Pixel Format Naming Convention): colours and range out of a frame's bytes.
//!
//! Bytes come from a network: their number is checked against the size before a pixel is made of them.

use image::{Rgb, RgbImage};
use semascan_perception::view::DepthImage;

/// Most pixels of a frame: beyond any camera.
const MOST_PIXELS: u64 = 1 << 28;

/// A pixel format that is read, by its number in the convention.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PixelFormat {
    /// Grey, so many bits a pixel in one or two bytes.
    Mono(u8),
    /// A colour filter before each pixel, of 8 bits: the column and row of the first red one.
    Bayer(u8, u8),
    /// Red, green and blue.
    Rgb,
    /// Blue, green and red.
    Bgr,
    /// Range in 16 bits, the third coordinate alone or of three.
    Range16 {
        /// Coordinates of a pixel.
        coordinates: u8,
    },
    /// Range as floating point number, the third coordinate alone or of three.
    RangeFloat {
        /// Coordinates of a pixel.
        coordinates: u8,
    },
}

/// What the numbers of a range picture are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Metres of a 1.
    pub unit: f64,
    /// Metres of a 0.
    pub offset: f64,
    /// The number that says that nothing was measured.
    pub invalid: Option<f64>,
}

impl PixelFormat {
    /// The format of a number; `None` for those that are not read.
    pub fn of(number: u32) -> Option<Self> {
        Some(match number {
            0x0108_0001 => Self::Mono(8),
            0x0110_0003 => Self::Mono(10),
            0x0110_0005 => Self::Mono(12),
            0x0110_0025 => Self::Mono(14),
            0x0110_0007 => Self::Mono(16),
            0x0108_0009 => Self::Bayer(0, 0),
            0x0108_0008 => Self::Bayer(1, 0),
            0x0108_000A => Self::Bayer(0, 1),
            0x0108_000B => Self::Bayer(1, 1),
            0x0218_0014 => Self::Rgb,
            0x0218_0015 => Self::Bgr,
            0x0110_00B8 => Self::Range16 { coordinates: 1 },
            0x0230_00B9 => Self::Range16 { coordinates: 3 },
            0x0120_00BF => Self::RangeFloat { coordinates: 1 },
            0x0260_00C0 => Self::RangeFloat { coordinates: 3 },
            _ => return None,
        })
    }

    /// Whether it is range for sure; grey of 16 bits may be.
    pub fn is_range(self) -> bool {
        matches!(self, Self::Range16 { .. } | Self::RangeFloat { .. })
    }

    /// Bytes of a pixel.
    fn bytes(self) -> usize {
        match self {
            Self::Mono(8) | Self::Bayer(..) => 1,
            Self::Mono(_) => 2,
            Self::Rgb | Self::Bgr => 3,
            Self::Range16 { coordinates } => 2 * usize::from(coordinates),
            Self::RangeFloat { coordinates } => 4 * usize::from(coordinates),
        }
    }

    /// Refuses bytes that are not those of `width` x `height` pixels.
    fn check(self, bytes: &[u8], (width, height): (u32, u32)) -> Result<(), String> {
        let pixels = u64::from(width) * u64::from(height);
        if pixels == 0 || pixels > MOST_PIXELS {
            return Err(format!("a frame of {width} x {height} pixels"));
        }
        let expected = pixels as usize * self.bytes();
        if bytes.len() < expected {
            return Err(format!("{} bytes of {expected} for {width} x {height} pixels", bytes.len()));
        }
        Ok(())
    }

    /// The colours of a frame.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn color(self, bytes: &[u8], (width, height): (u32, u32)) -> Result<RgbImage, String> {
        self.check(bytes, (width, height))?;
        let pixels = width as usize * height as usize;
        let grey = |values: Vec<u8>| values.into_iter().flat_map(|value| [value; 3]).collect();
        let rgb: Vec<u8> = match self {
            Self::Mono(8) => grey(bytes[..pixels].to_vec()),
            Self::Mono(bits) => {
                let brightest = |pair: &[u8; 2]| (u16::from_le_bytes(*pair) >> (bits - 8)).min(255) as u8;
                grey(bytes.as_chunks::<2>().0.iter().take(pixels).map(brightest).collect())
            }
            Self::Bayer(column, row) => return Ok(demosaiced(bytes, (width, height), (column, row))),
            Self::Rgb => bytes[..3 * pixels].to_vec(),
            Self::Bgr => bytes.as_chunks::<3>().0.iter().take(pixels).flat_map(|[b, g, r]| [*r, *g, *b]).collect(),
            Self::Range16 { .. } | Self::RangeFloat { .. } => return Err("a range picture has no colours".to_owned()),
        };
        RgbImage::from_raw(width, height, rgb).ok_or_else(|| "fewer bytes than pixels".to_owned())
    }

    /// The depth of a frame, metres.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn depth(self, bytes: &[u8], (width, height): (u32, u32), range: Range) -> Result<DepthImage, String> {
        self.check(bytes, (width, height))?;
        let pixels = width as usize * height as usize;
        let metres = |stored: f64| {
            if range.invalid.is_some_and(|invalid| invalid == stored) {
                return 0.0;
            }
            let z = (range.offset + stored * range.unit) as f32;
            if z.is_finite() && z > 0.0 { z } else { 0.0 }
        };
        let size = self.bytes();
        let all = bytes.chunks_exact(size).take(pixels);
        let metres: Vec<f32> = match self {
            Self::Range16 { .. } | Self::Mono(10..) => all
                .filter_map(|pixel| pixel.last_chunk::<2>())
                .map(|stored| metres(f64::from(u16::from_le_bytes(*stored))))
                .collect(),
            Self::RangeFloat { .. } => all
                .filter_map(|pixel| pixel.last_chunk::<4>())
                .map(|stored| metres(f64::from(f32::from_le_bytes(*stored))))
                .collect(),
            _ => return Err("the depth camera sends colours: say depth_format=Coord3D_C16 or another range".to_owned()),
        };
        Ok(DepthImage { width, height, metres })
    }
}

/// Colours of a picture behind a filter whose first red pixel is at `(column, row)`: what a pixel lacks is the mean of its
/// neighbours that have it.
fn demosaiced(bytes: &[u8], (width, height): (u32, u32), (column, row): (u8, u8)) -> RgbImage {
    // 0 red, 1 green, 2 blue.
    let filter = |x: u32, y: u32| ((x + u32::from(column)) % 2 + (y + u32::from(row)) % 2) as usize;
    let at = |x: u32, y: u32| u32::from(bytes[(y * width + x) as usize]);
    RgbImage::from_fn(width, height, |x, y| {
        let (mut sums, mut counts) = ([0_u32; 3], [0_u32; 3]);
        for v in y.saturating_sub(1)..=(y + 1).min(height - 1) {
            for u in x.saturating_sub(1)..=(x + 1).min(width - 1) {
                sums[filter(u, v)] += at(u, v);
                counts[filter(u, v)] += 1;
            }
        }
        let own = filter(x, y);
        (sums[own], counts[own]) = (at(x, y), 1);
        Rgb([0, 1, 2].map(|c| sums[c].checked_div(counts[c]).unwrap_or(0) as u8))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const RANGE: Range = Range { unit: 5e-4, offset: 0.1, invalid: Some(0.0) };
    const NUMBERS: [u32; 15] = [
        0x0108_0001,
        0x0110_0003,
        0x0110_0005,
        0x0110_0025,
        0x0110_0007,
        0x0108_0009,
        0x0108_0008,
        0x0108_000A,
        0x0108_000B,
        0x0218_0014,
        0x0218_0015,
        0x0110_00B8,
        0x0230_00B9,
        0x0120_00BF,
        0x0260_00C0,
    ];

    fn format(number: u32) -> PixelFormat {
        PixelFormat::of(number).expect("a format")
    }

    #[test]
    fn grey_and_colours_are_read_and_an_even_filter_gives_its_colour_everywhere() {
        assert_eq!(format(0x0108_0001).color(&[7, 9], (2, 1)).expect("grey").into_raw(), [7, 7, 7, 9, 9, 9]);
        assert_eq!(format(0x0110_0005).color(&[0xF0, 0x0F], (1, 1)).expect("grey").into_raw(), [255; 3]);
        assert_eq!(format(0x0110_0007).color(&[0, 0x40], (1, 1)).expect("grey").into_raw(), [0x40; 3]);
        assert_eq!(format(0x0218_0015).color(&[3, 2, 1], (1, 1)).expect("colours").into_raw(), [1, 2, 3]);
        // BayerRG8 has red in the first pixel and green beside it, and so on.
        for (number, rows) in [
            (0x0108_0009, [[200, 100], [100, 50]]),
            (0x0108_0008, [[100, 200], [50, 100]]),
            (0x0108_000A, [[100, 50], [200, 100]]),
            (0x0108_000B, [[50, 100], [100, 200]]),
        ] {
            let bytes: Vec<u8> = (0..4).flat_map(|y| (0..6).map(move |x| rows[y % 2][x % 2])).collect();
            let picture = format(number).color(&bytes, (6, 4)).expect("colours");
            assert!(picture.pixels().all(|pixel| pixel.0 == [200, 100, 50]), "{number:x}: {picture:?}");
        }
    }

    #[test]
    fn range_is_in_metres_and_what_was_not_measured_is_none() {
        let sixteen = |values: &[u16]| values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>();
        let depth = |number: u32, bytes: &[u8], width: u32| {
            format(number).depth(bytes, (width, 1), RANGE).expect("range").metres
        };
        assert_eq!(depth(0x0110_00B8, &sixteen(&[0, 800]), 2), [0.0, 0.5]);
        assert_eq!(depth(0x0110_0007, &sixteen(&[800]), 1), [0.5], "grey that is range");
        assert_eq!(depth(0x0230_00B9, &sixteen(&[1, 2, 800, 3, 4, 0]), 2), [0.5, 0.0]);
        let floats: Vec<u8> = [1.0_f32, 2.0, f32::NAN, 0.0, 0.0, 800.0].iter().flat_map(|v| v.to_le_bytes()).collect();
        assert_eq!(depth(0x0260_00C0, &floats, 2), [0.0, 0.5]);
        assert!(format(0x0218_0014).depth(&[0; 3], (1, 1), RANGE).is_err());
        assert!(format(0x0110_00B8).color(&[0; 2], (1, 1)).is_err());
        let short = format(0x0110_00B8).depth(&[0; 3], (2, 1), RANGE).expect_err("short");
        assert!(short.contains("3 bytes of 4"), "{short}");
        assert_eq!(PixelFormat::of(0), None);
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_or_refused(
            bytes in prop::collection::vec(any::<u8>(), 0..200), width in 0_u32..20, height in 0_u32..20,
            number in prop::sample::select(NUMBERS.to_vec()), huge in any::<bool>(),
        ) {
            let size = if huge { (width << 27, height << 27) } else { (width, height) };
            if let Ok(picture) = format(number).color(&bytes, size) {
                prop_assert_eq!(picture.dimensions(), size);
            }
            if let Ok(depth) = format(number).depth(&bytes, size, RANGE) {
                prop_assert_eq!(depth.metres.len(), (size.0 * size.1) as usize);
                prop_assert!(depth.metres.iter().all(|z| z.is_finite() && *z >= 0.0));
            }
        }
    }
}
