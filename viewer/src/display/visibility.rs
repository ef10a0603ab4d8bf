//! Which points are shown: by component class, and by the marks that hide a point.

/// A set of classes; those from 255 on are one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClassMask([u64; 4]);

impl ClassMask {
    /// Every class.
    pub const ALL: Self = Self([u64::MAX; 4]);
    /// No class.
    pub const NONE: Self = Self([0; 4]);

    /// Whether `class` is in the set.
    pub fn has(&self, class: u16) -> bool {
        let bit = class.min(255);
        self.0[usize::from(bit / 64)] & (1 << (bit % 64)) != 0
    }

    /// Puts `class` in or takes it out.
    pub fn set(&mut self, class: u16, member: bool) {
        let bit = class.min(255);
        let word = &mut self.0[usize::from(bit / 64)];
        if member { *word |= 1 << (bit % 64) } else { *word &= !(1 << (bit % 64)) }
    }
}

/// Which marked points are left out of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HiddenFlags {
    /// Outliers, and points whose class was too uncertain to keep them.
    pub outliers: bool,
    /// What lies outside the measuring volume.
    pub background: bool,
}

impl Default for HiddenFlags {
    fn default() -> Self {
        Self { outliers: true, background: false }
    }
}

impl HiddenFlags {
    /// The bits of `PointFlags` that hide a point.
    pub fn bits(self) -> u16 {
        use semascan_model::PointFlags;
        let outliers = if self.outliers { PointFlags::OUTLIER | PointFlags::UNCERTAIN } else { 0 };
        let background = if self.background { PointFlags::BACKGROUND } else { 0 };
        outliers | background
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mask_holds_exactly_what_was_put_in() {
        let mut mask = ClassMask::NONE;
        for class in [0, 63, 64, 200, 255] {
            mask.set(class, true);
        }
        for class in 0..256 {
            assert_eq!(mask.has(class), [0, 63, 64, 200, 255].contains(&class), "{class}");
        }
        assert!(mask.has(60_000), "classes from 255 on are one");
        mask.set(64, false);
        assert!(!mask.has(64) && mask.has(63));
    }
}
