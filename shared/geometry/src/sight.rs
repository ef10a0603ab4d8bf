//! How well a camera shows a place on the surface: the one rule by which the viewer orders the photographs of a point and by
//! which textures are made of them. It is the number of pixels on a patch of the surface: the cosine of the incidence over
//! the square of the depth, in pixels (the footprint of a pinhole camera's pixel).

/// Least cosine of the incidence: a surface seen more obliquely shows nothing.
pub const LEAST_COSINE: f64 = 0.1;

/// Pixels along a metre of the surface, mean over its directions: its square is the number of pixels on a square metre.
/// `None` where the surface is seen too obliquely, from behind, or by a camera that it lies behind.
///
/// * `focal`: focal lengths in pixels.
/// * `cosine`: between the surface's normal and the way to the camera.
/// * `depth`: along the optical axis, metres.
pub fn pixels_per_metre(focal: [f64; 2], cosine: f64, depth: f64) -> Option<f64> {
    (cosine >= LEAST_COSINE && depth > 0.0).then(|| (focal[0] * focal[1] * cosine).sqrt() / depth)
}

/// What blur leaves of the photographs of a part, judged against each other.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Blur {
    /// Median sharpness.
    median: Option<f32>,
}

impl Blur {
    /// By the sharpness of each photograph, where it is known.
    pub fn among(sharpness: impl Iterator<Item = Option<f32>>) -> Self {
        let mut known: Vec<f32> = sharpness.flatten().collect();
        known.sort_by(f32::total_cmp);
        Self { median: known.get(known.len() / 2).copied().filter(|median| *median > 0.0) }
    }

    /// Share of its pixels that a photograph is worth, 0.2 to 1. Sides of a part differ in what there is to see: only less than half
    /// of the median is taken for blur. A blurred photograph is worth less and never nothing; one of unknown sharpness is not blurred.
    pub fn leaves(self, sharpness: Option<f32>) -> f32 {
        sharpness.zip(self.median).map_or(1.0, |(own, median)| (2.0 * own / median).clamp(0.2, 1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_and_straight_views_show_most() {
        let seen = |cosine, depth| pixels_per_metre([600.0, 600.0], cosine, depth);
        assert!(seen(1.0, 0.4).is_some_and(|p| (p - 1500.0).abs() < 1e-9));
        assert!(seen(1.0, 0.4) > seen(1.0, 0.5) && seen(1.0, 0.4) > seen(0.8, 0.4));
        for (cosine, depth) in [(0.09, 0.4), (-1.0, 0.4), (f64::NAN, 0.4), (1.0, -0.4), (1.0, f64::NAN)] {
            assert_eq!(seen(cosine, depth), None, "{cosine} {depth}");
        }
    }

    #[test]
    fn what_is_less_than_half_as_sharp_as_others_is_blurred() {
        let blur = Blur::among([Some(0.5), None, Some(0.6), Some(0.05), Some(0.45)].into_iter());
        assert_eq!([blur.leaves(Some(0.55)), blur.leaves(Some(0.3)), blur.leaves(None)], [1.0; 3]);
        let blurred = blur.leaves(Some(0.1));
        assert!(blurred < 0.5 && blurred > 0.2, "{blurred}");
        assert_eq!((blur.leaves(Some(0.0)), Blur::default().leaves(Some(0.0))), (0.2, 1.0));
        assert_eq!(Blur::among([Some(0.0), Some(0.0)].into_iter()).leaves(Some(0.0)), 1.0, "nothing to compare with");
    }
}
