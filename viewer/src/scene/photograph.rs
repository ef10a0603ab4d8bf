//! The photograph that the page holds for the picture.

/// A picture, row by row from its upper left corner.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Pixels {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Red, green, blue, opacity of each pixel, sRGB.
    pub rgba: Vec<u8>,
}

/// The pixels of one photograph, if there are any.
#[derive(Clone, Debug, Default)]
pub struct HeldPhotograph {
    pixels: Option<Pixels>,
    revision: u64,
}

impl HeldPhotograph {
    /// Takes a photograph in the place of the one before, or none.
    pub fn set(&mut self, pixels: Option<Pixels>) {
        self.pixels = pixels;
        self.revision += 1;
    }

    /// The pixels, if there are any.
    pub fn pixels(&self) -> Option<&Pixels> {
        self.pixels.as_ref()
    }

    /// Changes with every change.
    pub fn revision(&self) -> u64 {
        self.revision
    }
}
