//! Unit normals as two bytes: the octahedral map of [Meyer 2010], on a grid of 255 x 255 so that the axes are hit
//! exactly. Worst error 0.95 degrees, mean 0.33.

/// Code of an unknown (zero) normal; no unit vector maps to it.
pub(super) const UNKNOWN: [u8; 2] = [255, 255];

/// Code of `normal`, which need not be of unit length; zero and non-finite vectors are [`UNKNOWN`].
pub(super) fn quantize(normal: [f32; 3]) -> [u8; 2] {
    let [x, y, z] = normal;
    let length = x.abs() + y.abs() + z.abs();
    if !length.is_finite() || length < 1e-6 {
        return UNKNOWN;
    }
    let (u, v) = (x / length, y / length);
    let (u, v) = if z < 0.0 { fold(u, v) } else { (u, v) };
    [u, v].map(|c| ((c + 1.0) * 127.0).round() as u8)
}

/// The unit normal of a code, or zero for [`UNKNOWN`].
pub(super) fn restore(code: [u8; 2]) -> [f32; 3] {
    if code == UNKNOWN {
        return [0.0; 3];
    }
    let [u, v] = code.map(|c| f32::from(c.min(254)) / 127.0 - 1.0);
    let z = 1.0 - u.abs() - v.abs();
    let (x, y) = if z < 0.0 { fold(u, v) } else { (u, v) };
    let length = (x * x + y * y + z * z).sqrt();
    [x / length, y / length, z / length]
}

/// A vector along the normal of a code in whole numbers (sum of absolute values 127), zero for [`UNKNOWN`]: what both
/// sides may predict with, free of rounding.
pub(super) fn direction(code: [u8; 2]) -> [i32; 3] {
    if code == UNKNOWN {
        return [0; 3];
    }
    let [u, v] = code.map(|c| i32::from(c.min(254)) - 127);
    let z = 127 - u.abs() - v.abs();
    if z >= 0 {
        return [u, v, z];
    }
    let turned = |kept: i32, other: i32| {
        if kept < 0 { other.abs() - 127 } else { 127 - other.abs() }
    };
    [turned(u, v), turned(v, u), z]
}

/// Turns the lower half of the octahedron inside out.
fn fold(u: f32, v: f32) -> (f32, f32) {
    ((1.0 - v.abs()).copysign(u), (1.0 - u.abs()).copysign(v))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_direction_comes_back_within_a_degree() {
        let mut worst = 0.0_f32;
        for i in 0..20_000 {
            // Fibonacci sphere.
            let z = 1.0 - (i as f32 + 0.5) / 10_000.0;
            let (s, c) = (i as f32 * 2.399_963).sin_cos();
            let r = (1.0 - z * z).sqrt();
            let n = [r * c, r * s, z];
            let code = quantize(n);
            assert_ne!(code, UNKNOWN);
            let m = restore(code);
            let cross = [n[1] * m[2] - n[2] * m[1], n[2] * m[0] - n[0] * m[2], n[0] * m[1] - n[1] * m[0]];
            worst = worst.max(cross.iter().map(|c| c * c).sum::<f32>().sqrt().asin().to_degrees());
        }
        assert!(worst < 0.96, "{worst}");
    }

    #[test]
    fn axes_are_exact_and_unknown_stays_unknown() {
        for axis in 0..3 {
            for sign in [1.0, -1.0] {
                let mut n = [0.0; 3];
                n[axis] = sign;
                let m = restore(quantize(n));
                assert!(n.iter().zip(m).all(|(a, b)| (a - b).abs() < 1e-6), "{n:?} {m:?}");
            }
        }
        assert_eq!(quantize([0.0; 3]), UNKNOWN);
        assert_eq!(quantize([f32::NAN, 0.0, 1.0]), UNKNOWN);
        assert_eq!(restore(UNKNOWN), [0.0; 3]);
    }

    #[test]
    fn the_whole_numbered_direction_is_the_normal() {
        for u in 0..=254 {
            for v in 0..=254 {
                let d = direction([u, v]).map(|c| c as f32);
                let length = d.iter().map(|c| c * c).sum::<f32>().sqrt();
                let n = restore([u, v]);
                assert!(n.iter().zip(d).all(|(a, b)| (a - b / length).abs() < 1e-5), "{u} {v}");
            }
        }
        assert_eq!(direction(UNKNOWN), [0; 3]);
    }

    #[test]
    fn every_code_is_stable() {
        for u in 0..=254 {
            for v in 0..=254 {
                let n = restore([u, v]);
                let again = restore(quantize(n));
                assert!(n.iter().zip(again).all(|(a, b)| (a - b).abs() < 1e-5), "{u} {v}");
            }
        }
    }
}
