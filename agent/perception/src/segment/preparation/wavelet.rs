//! The Haar wavelet transform of a plane of samples: orthonormal, so that noise has the same deviation in every band.
//!
//! After [Mallat 1989]. A level splits a plane of even size into four quarters: means, and differences along rows,
//! along columns and across both (HH).

/// A plane of samples, row-major.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Plane {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) values: Vec<f32>,
}

/// One level of a plane: four bands of half its width and height.
#[derive(Clone, Debug)]
pub(super) struct Bands {
    pub(super) low: Plane,
    /// Differences along rows, along columns, across both.
    pub(super) high: [Plane; 3],
}

impl Plane {
    /// A plane whose sample at (column, row) is `at(column, row)`.
    pub(super) fn of(width: usize, height: usize, mut at: impl FnMut(usize, usize) -> f32) -> Self {
        let mut values = Vec::with_capacity(width * height);
        for v in 0..height {
            values.extend((0..width).map(|u| at(u, v)));
        }
        Self { width, height, values }
    }

    /// Splits the plane; an odd last column or row is left out.
    pub(super) fn split(&self) -> Bands {
        let (width, height) = (self.width / 2, self.height / 2);
        // Signs of the upper right, lower left and lower right sample; the upper left always counts.
        let band = |[b, c, d]: [f32; 3]| {
            Self::of(width, height, |u, v| {
                let at = 2 * v * self.width + 2 * u;
                let (upper, lower) = (&self.values[at..at + 2], &self.values[at + self.width..at + self.width + 2]);
                0.5 * (upper[0] + b * upper[1] + c * lower[0] + d * lower[1])
            })
        };
        Bands {
            low: band([1.0, 1.0, 1.0]),
            high: [band([-1.0, 1.0, -1.0]), band([1.0, -1.0, -1.0]), band([-1.0, -1.0, 1.0])],
        }
    }
}

impl Bands {
    /// The plane that was split.
    pub(super) fn join(&self) -> Plane {
        let (width, [h, v, d]) = (self.low.width, &self.high);
        Plane::of(2 * width, 2 * self.low.height, |x, y| {
            let at = y / 2 * width + x / 2;
            let (right, below) = (if x % 2 == 0 { 1.0 } else { -1.0 }, if y % 2 == 0 { 1.0 } else { -1.0 });
            0.5 * (self.low.values[at] + right * h.values[at] + below * v.values[at] + right * below * d.values[at])
        })
    }
}

/// Median of the absolute values over 0.6745: the standard deviation of Gaussian noise whatever else a few of the values
/// are [Donoho 1994]. 0 without values.
pub(super) fn robust_deviation(values: &[f32]) -> f32 {
    let mut sizes: Vec<f32> = values.iter().map(|v| v.abs()).collect();
    if sizes.is_empty() {
        return 0.0;
    }
    let middle = sizes.len() / 2;
    let (_, median, _) = sizes.select_nth_unstable_by(middle, f32::total_cmp);
    *median / 0.6745
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_is_split_is_joined_and_keeps_its_energy(
            (w, h) in (1_usize..9, 1_usize..9),
            values in proptest::collection::vec((-30_000_i32..30_000).prop_map(|k| k as f32 / 100.0), 18 * 18),
        ) {
            let plane = Plane::of(2 * w, 2 * h, |u, v| values[v * 18 + u]);
            let bands = plane.split();
            for (a, b) in bands.join().values.iter().zip(&plane.values) {
                prop_assert!((a - b).abs() < 1e-3);
            }
            let energy = |p: &Plane| p.values.iter().map(|v| f64::from(v * v)).sum::<f64>();
            let sum = energy(&bands.low) + bands.high.iter().map(energy).sum::<f64>();
            prop_assert!((sum - energy(&plane)).abs() < 1e-4 * sum.max(1.0));
        }
    }

    #[test]
    fn a_slope_is_told_from_an_edge_by_its_bands() {
        let along = Plane::of(8, 8, |u, _| u as f32).split();
        assert!(along.high[0].values.iter().all(|d| *d == -1.0), "{:?}", along.high[0]);
        assert!(along.high[1].values.iter().chain(&along.high[2].values).all(|d| *d == 0.0));
    }
}
