//! The grey value of a colour: the luma of ITU-R BT.601, which is what most programs call a grey picture.

/// Weights of red, green and blue; their sum is 1.
pub const LUMA_WEIGHTS: [f32; 3] = [0.299, 0.587, 0.114];

/// Luma of a pixel, 0 to 255.
#[inline(always)]
pub fn luma([red, green, blue]: [u8; 3]) -> f32 {
    let [r, g, b] = LUMA_WEIGHTS;
    r * f32::from(red) + g * f32::from(green) + b * f32::from(blue)
}

/// Luma of a pixel, rounded.
#[inline(always)]
pub fn luma_rounded(pixel: [u8; 3]) -> u8 {
    (luma(pixel) + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn greys_stay_and_green_is_brightest() {
        for grey in 0..=255 {
            assert!((luma([grey; 3]) - f32::from(grey)).abs() < 1e-4);
            assert_eq!(luma_rounded([grey; 3]), grey);
        }
        assert_eq!([[255, 0, 0], [0, 255, 0], [0, 0, 255]].map(luma_rounded), [76, 150, 29]);
    }
}
