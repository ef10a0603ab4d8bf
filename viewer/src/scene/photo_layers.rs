//! The photographs that colour the mesh, on their way to the graphics device: how much room they have there, and which pixels are
//! still to be given to it.

/// Most photographs that colour the mesh at a time.
pub const MOST_LAYERS: usize = 8;
/// Most that are kept on the graphics device.
const MOST_SLOTS: u64 = 16;
/// Longest edge of a photograph there, pixels: what WebGL2 is sure to have.
const MOST_SIDE: u32 = 2048;

/// Room on the graphics device: so many photographs of one size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LayerSize {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Photographs.
    pub slots: u32,
}

impl LayerSize {
    /// Room for at least `least` photographs of `width` times `height` pixels within `budget` bytes; they are made smaller where the
    /// budget asks for it.
    pub fn within(budget: u64, (width, height): (u32, u32), least: u32) -> Self {
        // One plane more for the depths that distances are drawn with.
        let pixels = budget as f64 / (f64::from(least) * Self::BYTES + 4.0);
        let fit = (pixels / (f64::from(width.max(1)) * f64::from(height.max(1)))).sqrt();
        let scale = fit.min(f64::from(MOST_SIDE) / f64::from(width.max(height).max(1))).min(1.0);
        let [width, height] = [width, height].map(|side| ((f64::from(side) * scale) as u32).max(1));
        let pixels = f64::from(width) * f64::from(height);
        let slots = (((budget as f64 - 4.0 * pixels) / (Self::BYTES * pixels)) as u64).clamp(least.into(), MOST_SLOTS);
        // WebGL2 would take a square of six, or of twelve, for the faces of cubes.
        let slots = if slots.is_multiple_of(6) { slots - 1 } else { slots } as u32;
        Self { width, height, slots }
    }

    /// Bytes of a pixel: its colour with the smaller pictures of it, and its distance.
    const BYTES: f64 = 4.0 * 4.0 / 3.0 + 4.0;

    /// Pictures of each photograph: itself, and each half as wide as the one before, down to a pixel.
    pub fn levels(self) -> u32 {
        self.width.max(self.height).max(1).ilog2() + 1
    }

    /// Columns and rows of one of them.
    pub fn of_level(self, level: u32) -> (u32, u32) {
        ((self.width >> level).max(1), (self.height >> level).max(1))
    }

    /// Bytes on the graphics device.
    pub fn bytes(self) -> u64 {
        let pixels = f64::from(self.width) * f64::from(self.height);
        (pixels * (Self::BYTES * f64::from(self.slots) + 4.0)) as u64
    }
}

/// The pixels of a photograph for one place on the graphics device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Upload {
    /// Which place.
    pub slot: u32,
    /// Its pictures, the largest first, RGBA.
    pub levels: Vec<Vec<u8>>,
}

/// What the graphics device shall have.
#[derive(Clone, Debug, Default)]
pub struct HeldLayers {
    size: Option<LayerSize>,
    uploads: Vec<Upload>,
    generation: u64,
}

impl HeldLayers {
    /// Makes room, or gives it back; what was there is gone.
    pub fn set_size(&mut self, size: Option<LayerSize>) {
        self.size = size;
        self.forget();
    }

    /// There is a new graphics device, which has nothing.
    pub fn forget(&mut self) {
        self.uploads.clear();
        self.generation += 1;
    }

    /// Changes whenever all pixels are gone.
    pub fn generation(&self) -> u64 {
        self.generation
    }

    /// The room.
    pub fn size(&self) -> Option<LayerSize> {
        self.size
    }

    /// Gives pixels to the graphics device with the next frame.
    pub fn put(&mut self, upload: Upload) {
        self.uploads.retain(|before| before.slot != upload.slot);
        self.uploads.push(upload);
    }

    /// What is to be given to it now.
    pub fn take(&mut self) -> Vec<Upload> {
        std::mem::take(&mut self.uploads)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_room_keeps_within_the_budget() {
        for budget in [48 << 20, 128 << 20] {
            for photo in [(320, 240), (640, 480), (1280, 720), (1920, 1080), (4096, 3000), (9000, 20), (0, 0)] {
                for least in [4, 8] {
                    let size = LayerSize::within(budget, photo, least);
                    assert!(size.bytes() <= budget + 1, "{photo:?}, {least} of {budget}: {size:?}, {}", size.bytes());
                    assert!(
                        size.slots >= least && !size.slots.is_multiple_of(6) && size.width.max(size.height) <= 2048
                    );
                }
            }
        }
        let whole = LayerSize::within(128 << 20, (1280, 720), 8);
        assert_eq!(whole, LayerSize { width: 1280, height: 720, slots: 15 });
        assert_eq!((whole.levels(), whole.of_level(1), whole.of_level(10)), (11, (640, 360), (1, 1)));
        let small = LayerSize::within(48 << 20, (1920, 1080), 4);
        assert!(small.width < 1920 && small.width * 9 / 16 - small.height <= 1, "in proportion: {small:?}");
    }

    #[test]
    fn only_the_latest_pixels_of_a_place_are_given() {
        let mut layers = HeldLayers::default();
        let upload = |slot, value| Upload { slot, levels: vec![vec![value; 4]] };
        [upload(0, 1), upload(1, 2), upload(0, 3)].into_iter().for_each(|u| layers.put(u));
        assert_eq!(layers.take(), [upload(1, 2), upload(0, 3)]);
        assert!(layers.take().is_empty());
        layers.put(upload(0, 1));
        let before = layers.generation();
        layers.forget();
        assert!(layers.take().is_empty() && layers.generation() != before);
    }
}
