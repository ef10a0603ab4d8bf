//! The colours of deviations, shared by picture and legend: one green band within tolerance, then yellow to red where the
//! surface stands out and cyan to blue where it falls short, up to four tolerances.

use super::color_ramp::UNKNOWN;
use super::css_color;
use semascan_model::Color;

/// Ends of the scale, in tolerances.
pub const TOP: f32 = 4.0;

const WITHIN: Color = [0x3f, 0xa3, 0x5c];
/// From just out of tolerance to the end of the scale.
const ABOVE: [Color; 3] = [[0xf2, 0xc6, 0x3c], [0xe8, 0x7b, 0x2f], [0xb9, 0x21, 0x2c]];
const BELOW: [Color; 3] = [[0x4f, 0xc3, 0xd9], [0x2f, 0x7f, 0xd1], [0x2a, 0x35, 0x9c]];

/// Colour of a deviation, given in tolerances.
pub fn color(tolerances: f32) -> Color {
    if !tolerances.is_finite() {
        return if tolerances.is_nan() { UNKNOWN } else { color(tolerances.signum() * TOP) };
    }
    let out = tolerances.abs() - 1.0;
    if out <= 0.0 {
        return WITHIN;
    }
    let ramp = if tolerances > 0.0 { ABOVE } else { BELOW };
    let place = (out / (TOP - 1.0)).min(1.0) * (ramp.len() - 1) as f32;
    let low = (place as usize).min(ramp.len() - 2);
    let share = place - low as f32;
    std::array::from_fn(|channel| {
        let (from, to) = (f32::from(ramp[low][channel]), f32::from(ramp[low + 1][channel]));
        (from + (to - from) * share).round() as u8
    })
}

/// The scale from `-TOP` to `TOP` as a CSS gradient, left to right.
pub fn css_gradient() -> String {
    let steps = 64;
    let stops = (0..steps).map(|i| {
        let color = css_color(color(TOP * (2.0 * (i as f32 + 0.5) / steps as f32 - 1.0)));
        let (from, to) = (i as f32 * 100.0 / steps as f32, (i + 1) as f32 * 100.0 / steps as f32);
        format!("{color} {from:.2}% {to:.2}%")
    });
    format!("linear-gradient(to right, {})", stops.collect::<Vec<_>>().join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn within_tolerance_is_one_color_and_the_sign_shows() {
        for d in [0.0, 0.5, -0.99, 1.0, -1.0] {
            assert_eq!(color(d), WITHIN);
        }
        assert_eq!((color(1.001), color(-1.001)), (ABOVE[0], BELOW[0]));
        assert_eq!((color(4.0), color(-9.0), color(f32::INFINITY)), (ABOVE[2], BELOW[2], ABOVE[2]));
        assert_eq!(color(f32::NAN), UNKNOWN);
        // Redder the farther out, bluer the farther in.
        assert!(color(1.5)[1] > color(2.5)[1] && color(2.5)[1] > color(3.5)[1]);
    }

    #[test]
    fn the_legend_shows_the_same_colors() {
        let css = css_gradient();
        assert!(css.starts_with("linear-gradient(to right, #") && css.contains("#3fa35c 37.50%"), "{css}");
    }
}
