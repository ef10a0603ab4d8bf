//! Colours as files hold them: levels of 0..=255 or 0..=65535, or shares of 0..=1, and which of these it is.
//!
//! The type alone does not say: there are floats up to 255, and 16-bit numbers that never leave eight bits. The largest
//! channel of the whole file decides.

/// Which range the channels of a file have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Range {
    /// 0..=1.
    Share,
    /// 0..=255.
    Byte,
    /// 0..=65535.
    Word,
}

impl Range {
    /// The range of channels that are whole by their type or not, the largest of which is `largest`.
    pub(crate) fn of(has_fraction: bool, largest: f64) -> Self {
        match largest {
            // One 256th beyond is rounding.
            l if has_fraction && l <= 1.0 + 1.0 / 256.0 => Self::Share,
            l if l <= 255.0 => Self::Byte,
            _ => Self::Word,
        }
    }

    /// What stands for full light.
    fn full(self) -> f64 {
        match self {
            Self::Share => 1.0,
            Self::Byte => 255.0,
            Self::Word => 65_535.0,
        }
    }

    /// A channel as a share of full light, 0..=1; what is no number is dark.
    pub(crate) fn share(self, channel: f64) -> f64 {
        let share = channel / self.full();
        if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) }
    }

    /// A channel as a level of 0..=255.
    pub(crate) fn level(self, channel: f64) -> u8 {
        (self.share(channel) * 255.0).round() as u8
    }
}

/// The largest finite channel; 0 if there is none.
pub(crate) fn largest<'a>(channels: impl IntoIterator<Item = &'a f64>) -> f64 {
    channels.into_iter().copied().filter(|c| c.is_finite()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_channel_tells_the_range() {
        for (has_fraction, channels, range, level) in [
            (true, [0.2, 1.0], Range::Share, 51),
            (true, [51.0, 255.0], Range::Byte, 51),
            (false, [51.0, 200.0], Range::Byte, 51),
            (false, [13_107.0, 65_535.0], Range::Word, 51),
            (false, [1.0, 1.0], Range::Byte, 1),
        ] {
            let found = Range::of(has_fraction, largest(&channels));
            assert_eq!((found, found.level(channels[0])), (range, level), "{channels:?}");
        }
        assert_eq!((Range::Byte.level(f64::NAN), Range::Byte.level(-3.0)), (0, 0));
    }
}
