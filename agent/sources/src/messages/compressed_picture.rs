//! Pictures that are written as JPEG or PNG: `sensor_msgs/CompressedImage` and `foxglove.CompressedImage`.
//!
//! What the field `format` says differs by its writer: `jpeg`; `rgb8; jpeg compressed bgr8`; `16UC1; png compressed`; and
//! `16UC1; compressedDepth png` with a header of 12 bytes in front of the PNG, in which `32FC1; compressedDepth` keeps the two
//! numbers `a` and `b` that make its whole numbers `v` depth again, `a / (v - b)`. (These are the forms of the ROS packages
//! compressed_image_transport and compressed_depth_image_transport.)

use super::error::MessageError;
use super::raw_picture::LARGEST_SIDE;
use super::types::{ColorPicture, DepthPicture, DepthSamples, Header};
use super::{Content, Message};
use image::{DynamicImage, ImageFormat, ImageReader, Limits};
use std::borrow::Cow;
use std::io::Cursor;

/// The first bytes of a PNG.
const PNG: &[u8] = b"\x89PNG\r\n\x1a\n";
/// Bytes in front of the PNG of a compressed depth picture: a number and two floats.
const DEPTH_HEADER: usize = 12;
/// Most memory that decoding one picture may take, in bytes.
const MOST_MEMORY: u64 = 512 << 20;

/// A picture as its message has it.
#[derive(Clone, Debug)]
pub(crate) struct CompressedPicture<'a> {
    pub(crate) header: Header,
    pub(crate) format: Cow<'a, str>,
    pub(crate) data: Cow<'a, [u8]>,
}

/// What the field `format` says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Form {
    /// A picture file and nothing else.
    File,
    /// Depth with the header of 12 bytes.
    Depth { float: bool },
}

impl CompressedPicture<'_> {
    /// What the picture shows.
    pub(crate) fn content(&self) -> Result<Content, MessageError> {
        Ok(match self.form()? {
            Form::Depth { .. } => Content::Depth,
            Form::File if is_grey_png_of_16_bits(&self.data) => Content::Depth,
            Form::File => Content::Color,
        })
    }

    /// The picture.
    pub(crate) fn decode(self) -> Result<Message, MessageError> {
        match self.form()? {
            Form::File => {
                let picture = read(&self.data)?;
                let (width, height, header) = (picture.width(), picture.height(), self.header);
                Ok(match picture {
                    DynamicImage::ImageLuma16(grey) => {
                        let samples = DepthSamples::Integers(grey.into_raw());
                        Message::Depth(DepthPicture { header, width, height, samples })
                    }
                    other => Message::Color(ColorPicture { header, rgb: other.into_rgb8() }),
                })
            }
            Form::Depth { float } => {
                let (quantization, png) = split(&self.data)?;
                let DynamicImage::ImageLuma16(grey) = read(png)? else {
                    return Err(MessageError::field("data", "is no grey PNG of 16 bits, as compressed depth must be"));
                };
                let (width, height) = grey.dimensions();
                let values = grey.into_raw();
                let samples = match (float, quantization) {
                    (false, _) => DepthSamples::Integers(values),
                    (true, Some([a, b])) => {
                        let depth = |v: u16| if v == 0 { f32::NAN } else { a / (f32::from(v) - b) };
                        DepthSamples::Floats(values.into_iter().map(depth).collect())
                    }
                    (true, None) => {
                        return Err(MessageError::field("data", "has no header with the scale of its depth"));
                    }
                };
                Ok(Message::Depth(DepthPicture { header: self.header, width, height, samples }))
            }
        }
    }

    fn form(&self) -> Result<Form, MessageError> {
        let (encoding, transport) = match self.format.split_once(';') {
            Some((encoding, transport)) => (encoding.trim(), transport.trim()),
            None => ("", self.format.trim()),
        };
        if !transport.starts_with("compressedDepth") {
            return Ok(Form::File);
        }
        if transport.contains("rvl") {
            let reason = format!("{:?}: RVL is not read; compressed depth as PNG is", self.format);
            return Err(MessageError::field("format", reason));
        }
        match encoding {
            "16UC1" | "mono16" | "" => Ok(Form::Depth { float: false }),
            "32FC1" => Ok(Form::Depth { float: true }),
            _ => Err(MessageError::field("format", format!("{:?} is no depth of 16UC1 or 32FC1", self.format))),
        }
    }
}

/// The two numbers of the header of a compressed depth picture and its PNG; some writers leave the header out.
fn split(data: &[u8]) -> Result<(Option<[f32; 2]>, &[u8]), MessageError> {
    if data.starts_with(PNG) {
        return Ok((None, data));
    }
    match data.split_first_chunk::<DEPTH_HEADER>() {
        Some((&[_, _, _, _, a0, a1, a2, a3, b0, b1, b2, b3], png)) if png.starts_with(PNG) => {
            let quantization = [f32::from_le_bytes([a0, a1, a2, a3]), f32::from_le_bytes([b0, b1, b2, b3])];
            Ok((Some(quantization), png))
        }
        _ => Err(MessageError::field("data", "has no PNG behind its header of 12 bytes")),
    }
}

/// Decodes a picture file whose size and need of memory are limited.
fn read(data: &[u8]) -> Result<DynamicImage, MessageError> {
    let refuse = |reason: String| MessageError::field("data", reason);
    let mut reader = ImageReader::new(Cursor::new(data)).with_guessed_format().map_err(|e| refuse(e.to_string()))?;
    match reader.format() {
        Some(ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::WebP) => {}
        _ => return Err(refuse("is neither JPEG nor PNG nor WebP".to_owned())),
    }
    let mut limits = Limits::default();
    limits.max_image_width = Some(LARGEST_SIDE);
    limits.max_image_height = Some(LARGEST_SIDE);
    limits.max_alloc = Some(MOST_MEMORY);
    reader.limits(limits);
    reader.decode().map_err(|error| refuse(error.to_string()))
}

/// Whether this is a PNG with one channel of 16 bits, by its first chunk: width, height, bits, kind of colour.
fn is_grey_png_of_16_bits(data: &[u8]) -> bool {
    data.starts_with(PNG) && data.get(24..26) == Some(&[16, 0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::types::DepthUnit;
    use image::{ImageBuffer, Luma, Rgb, RgbImage};

    fn file(picture: impl Into<DynamicImage>, format: ImageFormat) -> Vec<u8> {
        let mut file = Cursor::new(Vec::new());
        picture.into().write_to(&mut file, format).expect("written");
        file.into_inner()
    }

    fn decode(format: &str, data: &[u8]) -> Result<Message, MessageError> {
        let message = CompressedPicture { header: Header::default(), format: format.into(), data: data.into() };
        let content = message.content()?;
        let decoded = message.decode()?;
        assert_eq!(content, decoded.content().expect("a picture"));
        Ok(decoded)
    }

    fn depth(values: [u16; 4]) -> Vec<u8> {
        let picture: ImageBuffer<Luma<u16>, _> = ImageBuffer::from_raw(2, 2, values.to_vec()).expect("a picture");
        file(picture, ImageFormat::Png)
    }

    fn metres(message: Message) -> Vec<f32> {
        match message {
            Message::Depth(picture) => picture.in_metres(DepthUnit::default(), None).metres,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn colours_come_from_jpeg_and_png() {
        let red = RgbImage::from_pixel(8, 8, Rgb([200, 10, 20]));
        for (format, kind) in [("rgb8; jpeg compressed bgr8", ImageFormat::Jpeg), ("png", ImageFormat::Png)] {
            match decode(format, &file(red.clone(), kind)).expect("a picture") {
                Message::Color(picture) => {
                    let [r, g, b] = picture.rgb.get_pixel(4, 4).0;
                    assert!(r.abs_diff(200) < 4 && g.abs_diff(10) < 4 && b.abs_diff(20) < 4, "{r} {g} {b}");
                }
                other => panic!("{other:?}"),
            }
        }
    }

    #[test]
    fn depth_comes_from_every_form_of_png() {
        let png = depth([500, 0, 1000, 4000]);
        let with_header: Vec<u8> = [&[0; DEPTH_HEADER][..], &png].concat();
        for (format, data) in [
            ("16UC1; compressedDepth png", &with_header),
            ("16UC1; compressedDepth", &with_header),
            ("16UC1; compressedDepth png", &png),
            ("16UC1; png compressed ", &png),
            ("png", &png),
        ] {
            assert_eq!(metres(decode(format, data).expect(format)), [0.5, 0.0, 1.0, 4.0], "{format}");
        }
        // 1 m, not measured, 0.5 m and 2 m as `a / z + b`.
        let (a, b) = (1000.0_f32, 100.0_f32);
        let quantized = depth([1100, 0, 2100, 600]);
        let header = [&[0; 4][..], &a.to_le_bytes(), &b.to_le_bytes(), &quantized].concat();
        assert_eq!(metres(decode("32FC1; compressedDepth png", &header).expect("depth")), [1.0, 0.0, 0.5, 2.0]);
    }

    #[test]
    fn what_cannot_be_read_is_said() {
        let said = |format: &str, data: &[u8]| decode(format, data).expect_err("refused").to_string();
        assert!(said("16UC1; compressedDepth rvl", &[0; 20]).contains("RVL"));
        assert!(said("8UC3; compressedDepth png", &[0; 20]).contains("16UC1"));
        assert!(said("jpeg", b"no picture").contains("JPEG"));
        assert!(said("16UC1; compressedDepth png", &[0; 20]).contains("12 bytes"));
        assert!(said("32FC1; compressedDepth png", &depth([1; 4])).contains("scale"));
        // A PNG that says that it is 2^31 pixels wide.
        let mut wide = depth([1; 4]);
        wide[16..20].copy_from_slice(&0x7fff_ffff_u32.to_be_bytes());
        assert!(decode("png", &wide).is_err());
    }
}
