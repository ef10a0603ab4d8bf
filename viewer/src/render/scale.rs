//! Distances of grid lines that people can count in: 1, 2 or 5 times a power of ten.

/// The round length nearest below `length` (metres): 1, 2 or 5 times a power of ten. 1 mm for nonsense.
pub fn round_step(length: f32) -> f32 {
    if !(length.is_finite() && length > 0.0) {
        return 1e-3;
    }
    let power = 10_f32.powf(length.log10().floor());
    let digit = length / power;
    // A hair of slack, so that 0.05 is 5 hundredths and not 2.
    power
        * if digit > 4.999 {
            5.0
        } else if digit > 1.999 {
            2.0
        } else {
            1.0
        }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_round_and_not_longer_than_asked() {
        for (length, step) in [(0.0625, 0.05), (0.05, 0.05), (0.049, 0.02), (0.013, 0.01), (0.0199, 0.01), (3.0, 2.0)] {
            assert!((round_step(length) - step).abs() < step * 1e-4, "{length}: {}", round_step(length));
        }
        assert_eq!(round_step(f32::NAN), 1e-3);
        assert_eq!(round_step(-1.0), 1e-3);
    }
}
