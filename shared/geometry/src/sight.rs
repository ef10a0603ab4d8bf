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
}
