//! Pictures that are written as they are in memory: `sensor_msgs/Image` and `foxglove.RawImage`, whose encodings have the
//! same names.

use super::error::MessageError;
use super::types::{ColorPicture, DepthPicture, DepthSamples, Header};
use super::{Content, Message};
use image::RgbImage;
use std::borrow::Cow;

/// Most columns or rows of a picture.
pub(crate) const LARGEST_SIDE: u32 = 16_384;

/// A picture as its message has it.
#[derive(Clone, Debug)]
pub(crate) struct RawPicture<'a> {
    pub(crate) header: Header,
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) encoding: Cow<'a, str>,
    pub(crate) big_endian: bool,
    /// Bytes of a row.
    pub(crate) step: u32,
    pub(crate) data: Cow<'a, [u8]>,
}

/// How the pixels are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Pixels {
    /// Bytes of a pixel, and which of them are red, green and blue.
    Color {
        size: usize,
        rgb: [usize; 3],
    },
    Depth16,
    Depth32,
}

impl Pixels {
    fn of_encoding(encoding: &str) -> Result<Self, MessageError> {
        Ok(match encoding {
            "rgb8" => Self::Color { size: 3, rgb: [0, 1, 2] },
            "bgr8" | "8UC3" => Self::Color { size: 3, rgb: [2, 1, 0] },
            "rgba8" => Self::Color { size: 4, rgb: [0, 1, 2] },
            "bgra8" | "8UC4" => Self::Color { size: 4, rgb: [2, 1, 0] },
            "mono8" | "8UC1" => Self::Color { size: 1, rgb: [0; 3] },
            "mono16" | "16UC1" => Self::Depth16,
            "32FC1" => Self::Depth32,
            other => {
                let reason = format!(
                    "{other:?} is not read; colour may be rgb8, bgr8, rgba8, bgra8 or mono8, and depth 16UC1, mono16 or 32FC1"
                );
                return Err(MessageError::field("encoding", reason));
            }
        })
    }

    fn size(self) -> usize {
        match self {
            Self::Color { size, .. } => size,
            Self::Depth16 => 2,
            Self::Depth32 => 4,
        }
    }
}

impl RawPicture<'_> {
    /// What the picture shows, by its encoding.
    pub(crate) fn content(&self) -> Result<Content, MessageError> {
        Ok(match Pixels::of_encoding(&self.encoding)? {
            Pixels::Color { .. } => Content::Color,
            Pixels::Depth16 | Pixels::Depth32 => Content::Depth,
        })
    }

    /// The picture. The memory that it takes is at most three times that of the message.
    pub(crate) fn decode(self) -> Result<Message, MessageError> {
        let pixels = Pixels::of_encoding(&self.encoding)?;
        let rows = self.rows(pixels.size())?;
        let Self { width, height, big_endian, .. } = self;
        match pixels {
            Pixels::Color { size, rgb } => {
                let mut samples = vec![0; 3 * width as usize * height as usize];
                for (row, out) in rows.zip(samples.chunks_exact_mut(3 * width as usize)) {
                    if (size, rgb) == (3, [0, 1, 2]) {
                        out.copy_from_slice(row);
                        continue;
                    }
                    for (pixel, out) in row.chunks_exact(size).zip(out.as_chunks_mut::<3>().0) {
                        *out = [pixel[rgb[0]], pixel[rgb[1]], pixel[rgb[2]]];
                    }
                }
                let rgb = RgbImage::from_raw(width, height, samples)
                    .ok_or_else(|| MessageError::field("data", "does not have the picture's size"))?;
                Ok(Message::Color(ColorPicture { header: self.header, rgb }))
            }
            Pixels::Depth16 => {
                let read = if big_endian { u16::from_be_bytes } else { u16::from_le_bytes };
                let samples = rows.flat_map(|row| row.as_chunks::<2>().0.iter().map(|z| read(*z))).collect();
                let samples = DepthSamples::Integers(samples);
                Ok(Message::Depth(DepthPicture { header: self.header, width, height, samples }))
            }
            Pixels::Depth32 => {
                let read = if big_endian { f32::from_be_bytes } else { f32::from_le_bytes };
                let samples = rows.flat_map(|row| row.as_chunks::<4>().0.iter().map(|z| read(*z))).collect();
                let samples = DepthSamples::Floats(samples);
                Ok(Message::Depth(DepthPicture { header: self.header, width, height, samples }))
            }
        }
    }

    /// The rows' bytes without what fills them up; all of them are there.
    fn rows(&self, pixel: usize) -> Result<impl Iterator<Item = &[u8]>, MessageError> {
        check_size(self.width, self.height)?;
        let row = self.width as usize * pixel;
        let step = if self.step == 0 { row } else { self.step as usize };
        if step < row {
            let reason = format!("is {step} bytes, and a row of {} pixels takes {row}", self.width);
            return Err(MessageError::field("step", reason));
        }
        let last = step.saturating_mul(self.height as usize - 1);
        if last.saturating_add(row) > self.data.len() {
            let reason = format!("has {} bytes for {} x {} pixels", self.data.len(), self.width, self.height);
            return Err(MessageError::field("data", reason));
        }
        let rows = self.data.chunks(step).take(self.height as usize);
        Ok(rows.filter_map(move |bytes| bytes.get(..row)))
    }
}

/// Whether a picture may have this size.
pub(crate) fn check_size(width: u32, height: u32) -> Result<(), MessageError> {
    let allowed = 1..=LARGEST_SIDE;
    if allowed.contains(&width) && allowed.contains(&height) {
        return Ok(());
    }
    let reason = format!("{width} x {height} pixels: a side may have 1 to {LARGEST_SIDE}");
    Err(MessageError::field("width, height", reason))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::types::DepthUnit;

    fn picture(encoding: &str, step: u32, big_endian: bool, data: &[u8]) -> Result<Message, MessageError> {
        let (width, height, header) = (2, 2, Header::default());
        RawPicture { header, width, height, encoding: encoding.into(), big_endian, step, data: data.into() }.decode()
    }

    fn colors(message: Result<Message, MessageError>) -> Vec<u8> {
        match message.expect("a picture") {
            Message::Color(picture) => picture.rgb.into_raw(),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn every_encoding_gives_the_same_colours() {
        let rgb = [10, 20, 30, 40, 50, 60, 70, 80, 90, 100, 110, 120];
        assert_eq!(colors(picture("rgb8", 6, false, &rgb)), rgb);
        let bgr = [30, 20, 10, 60, 50, 40, 90, 80, 70, 120, 110, 100];
        assert_eq!(colors(picture("bgr8", 0, false, &bgr)), rgb);
        let rgba = [10, 20, 30, 1, 40, 50, 60, 1, 70, 80, 90, 1, 100, 110, 120, 1];
        assert_eq!(colors(picture("rgba8", 8, false, &rgba)), rgb);
        let bgra = [30, 20, 10, 1, 60, 50, 40, 1, 90, 80, 70, 1, 120, 110, 100, 1];
        assert_eq!(colors(picture("bgra8", 8, false, &bgra)), rgb);
        // Two bytes fill each row up but for the last.
        let padded = [10, 20, 30, 40, 50, 60, 0, 0, 70, 80, 90, 100, 110, 120];
        assert_eq!(colors(picture("rgb8", 8, false, &padded)), rgb);
        assert_eq!(colors(picture("mono8", 2, false, &[1, 2, 3, 4])), [1, 1, 1, 2, 2, 2, 3, 3, 3, 4, 4, 4]);
    }

    #[test]
    fn depth_comes_in_metres_in_both_byte_orders_and_what_was_not_measured_is_0() {
        let metres = |message: Result<Message, MessageError>| match message.expect("a picture") {
            Message::Depth(picture) => picture.in_metres(DepthUnit::default(), None).metres,
            other => panic!("{other:?}"),
        };
        let values = [500_u16, 0, 1250, 65535];
        let little: Vec<u8> = values.iter().flat_map(|z| z.to_le_bytes()).collect();
        let big: Vec<u8> = values.iter().flat_map(|z| z.to_be_bytes()).collect();
        assert_eq!(metres(picture("16UC1", 4, false, &little)), [0.5, 0.0, 1.25, 65.535]);
        assert_eq!(metres(picture("mono16", 4, true, &big)), [0.5, 0.0, 1.25, 65.535]);
        let floats: Vec<u8> = [0.5_f32, f32::NAN, -1.0, f32::INFINITY].iter().flat_map(|z| z.to_le_bytes()).collect();
        assert_eq!(metres(picture("32FC1", 8, false, &floats)), [0.5, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn sizes_that_are_not_those_of_the_data_are_refused() {
        for (encoding, step, data) in [("rgb8", 6, &[0; 11][..]), ("rgb8", 5, &[0; 64]), ("rgb8", 7, &[0; 12])] {
            assert!(picture(encoding, step, false, data).is_err(), "{encoding} {step} {}", data.len());
        }
        let bayer = picture("bayer_rggb8", 2, false, &[0; 4]).expect_err("not read").to_string();
        assert!(bayer.contains("bayer_rggb8") && bayer.contains("rgb8"), "{bayer}");
        let side = |width| RawPicture {
            header: Header::default(),
            width,
            height: u32::MAX,
            encoding: "mono8".into(),
            big_endian: false,
            step: u32::MAX,
            data: Cow::Borrowed(&[]),
        };
        assert!(side(0).decode().is_err() && side(u32::MAX).decode().is_err() && side(4).decode().is_err());
    }
}
