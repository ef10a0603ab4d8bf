//! The ramp of every scalar colour mode, the same in picture and legend.
//!
//! Viridis (Smith and van der Walt, 2015): even steps for the eye, rising lightness, told apart with any colour vision.
//! Kept as 16 samples of the published table; between them the ramp is straight, a few levels from the table at most.

use semascan_model::Color;

/// The colour of what is not known, which is on no ramp: neither sure nor unsure, neither near nor far.
pub const UNKNOWN: Color = [0x8c, 0x93, 0x9c];

const VIRIDIS: [Color; 16] = [
    [68, 1, 84],
    [72, 26, 108],
    [71, 47, 125],
    [65, 68, 135],
    [57, 86, 140],
    [49, 104, 142],
    [42, 120, 142],
    [35, 136, 142],
    [31, 152, 139],
    [34, 168, 132],
    [53, 183, 121],
    [84, 197, 104],
    [122, 209, 81],
    [165, 219, 54],
    [210, 226, 27],
    [253, 231, 37],
];

/// sRGB colour of a share, 0..=1; what is outside is clamped, NaN counts as 0.
pub fn ramp(share: f32) -> Color {
    let last = VIRIDIS.len() - 1;
    let at = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) } * last as f32;
    let (low, t) = ((at as usize).min(last - 1), at - (at as usize).min(last - 1) as f32);
    std::array::from_fn(|c| {
        let (a, b) = (f32::from(VIRIDIS[low][c]), f32::from(VIRIDIS[low + 1][c]));
        (a + (b - a) * t).round() as u8
    })
}

/// The ramp as CSS: a `linear-gradient` to the right, for legends.
pub fn css_gradient() -> String {
    let stops: Vec<String> = VIRIDIS.iter().map(|[r, g, b]| format!("rgb({r} {g} {b})")).collect();
    format!("linear-gradient(to right, {})", stops.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_runs_from_dark_violet_to_yellow() {
        assert_eq!(ramp(0.0), VIRIDIS[0]);
        assert_eq!(ramp(1.0), VIRIDIS[15]);
        assert_eq!(ramp(f32::NAN), VIRIDIS[0]);
        assert_eq!(ramp(7.0), VIRIDIS[15]);
    }

    #[test]
    fn it_gets_lighter_all_the_way() {
        let luma = |[r, g, b]: Color| 0.2126 * f32::from(r) + 0.7152 * f32::from(g) + 0.0722 * f32::from(b);
        for i in 0..100 {
            let (a, b) = (i as f32 / 100.0, (i + 1) as f32 / 100.0);
            assert!(luma(ramp(b)) > luma(ramp(a)) - 0.5, "{a}");
        }
    }
}
