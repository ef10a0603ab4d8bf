//! A picture in a few numbers that differ between worlds: brightness and colour, and how strong detail and noise are at
//! each scale, in brightness and in colour. What a camera and its light do to a picture shows here whatever it shows.
//!
//! Detail at a scale is that of Haar's wavelet ([Mallat 1989]): differences within squares of two by two pixels, then of
//! the mean values of these squares, and so on.

use super::region::Window;
use crate::view::luma;
use image::RgbImage;

/// Scales of brightness that are looked at.
const SCALES: usize = 4;
/// Scales of colour.
const COLOR_SCALES: usize = 3;
/// Added before a logarithm, grey values: an eighth of a step is nothing.
const FLOOR: f32 = 0.125;
/// How many numbers there are.
pub const STATISTICS: usize = 6 + 3 * SCALES + COLOR_SCALES;

/// What the numbers are, as manifests name this set of them; another set gets another name.
pub(super) const NAME: &str = "picture-1";

/// The numbers of `window` of a picture: mean and spread of brightness, mean and (logarithmic) spread of two colour
/// differences, then for each scale of brightness the logarithms of the median and mean diagonal detail and of the mean
/// detail along rows and columns, then for each scale of red minus green that of the mean diagonal detail. `None` where the
/// window is too small to have all scales.
pub(super) fn statistics(rgb: &RgbImage, window: Window) -> Option<[f64; STATISTICS]> {
    let least = 4 << SCALES;
    let inside = window.left + window.width <= rgb.width() && window.top + window.height <= rgb.height();
    if !inside || window.width < least || window.height < least {
        return None;
    }
    let (width, height) = (window.width as usize, window.height as usize);
    let columns = rgb.width() as usize;
    let (mut grey, mut red_green) = (Vec::with_capacity(width * height), Vec::with_capacity(width * height));
    let [mut of_grey, mut of_red, mut of_blue] = [Moments::default(); 3];
    for row in rgb.as_raw().chunks_exact(3 * columns).skip(window.top as usize).take(height) {
        for p in row[3 * window.left as usize..].chunks_exact(3).take(width) {
            let pixel = [p[0], p[1], p[2]];
            let ([r, g, b], y) = (pixel.map(f32::from), luma(pixel));
            of_grey.add(y);
            of_red.add(r - y);
            of_blue.add(b - y);
            grey.push(y);
            red_green.push(r - g);
        }
    }
    let mut numbers = vec![of_grey.mean() / 255.0, of_grey.deviation() / 255.0];
    numbers.extend([of_red, of_blue].map(|m| m.mean() / 255.0));
    numbers.extend([of_red, of_blue].map(|m| (m.deviation() + 0.5).ln()));
    let mut plane = Plane { width, height, values: grey };
    for _ in 0..SCALES {
        let detail = plane.detail();
        numbers.extend([detail.median_diagonal, detail.diagonal, detail.straight].map(|d| f64::from((d + FLOOR).ln())));
        plane = detail.coarser;
    }
    let mut plane = Plane { width, height, values: red_green };
    for _ in 0..COLOR_SCALES {
        let detail = plane.detail();
        numbers.push(f64::from((detail.diagonal + FLOOR).ln()));
        plane = detail.coarser;
    }
    numbers.try_into().ok()
}

/// Sums for mean and standard deviation.
#[derive(Clone, Copy, Default)]
struct Moments {
    count: f64,
    sum: f64,
    square: f64,
}

impl Moments {
    fn add(&mut self, value: f32) {
        let value = f64::from(value);
        self.count += 1.0;
        self.sum += value;
        self.square += value * value;
    }

    fn mean(&self) -> f64 {
        self.sum / self.count.max(1.0)
    }

    fn deviation(&self) -> f64 {
        (self.square / self.count.max(1.0) - self.mean().powi(2)).max(0.0).sqrt()
    }
}

/// One channel.
struct Plane {
    width: usize,
    height: usize,
    values: Vec<f32>,
}

/// Detail at one scale, grey values.
struct Detail {
    median_diagonal: f32,
    diagonal: f32,
    /// Along rows and along columns together.
    straight: f32,
    /// Mean values of the squares.
    coarser: Plane,
}

impl Plane {
    fn detail(&self) -> Detail {
        let (width, height) = (self.width / 2, self.height / 2);
        let (mut diagonal, mut straight) = (Vec::with_capacity(width * height), 0.0_f64);
        let mut values = Vec::with_capacity(width * height);
        for rows in self.values.chunks_exact(2 * self.width.max(1)).take(height) {
            let (upper, lower) = rows.split_at(self.width);
            for (a, c) in upper.chunks_exact(2).zip(lower.chunks_exact(2)) {
                let ([a, b], [c, d]) = ([a[0], a[1]], [c[0], c[1]]);
                diagonal.push((0.5 * (a - b - c + d)).abs());
                straight += f64::from((0.5 * (a - b + c - d)).abs() + (0.5 * (a + b - c - d)).abs());
                values.push(0.25 * (a + b + c + d));
            }
        }
        let count = diagonal.len().max(1);
        let mean = diagonal.iter().map(|d| f64::from(*d)).sum::<f64>() / count as f64;
        let middle = diagonal.len() / 2;
        let median = if diagonal.is_empty() { 0.0 } else { *diagonal.select_nth_unstable_by(middle, f32::total_cmp).1 };
        Detail {
            median_diagonal: median,
            diagonal: mean as f32,
            straight: (straight / count as f64) as f32,
            coarser: Self { width, height, values },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;

    #[test]
    fn a_plain_picture_has_its_colour_and_no_detail() {
        let rgb = RgbImage::from_pixel(96, 80, Rgb([200, 100, 50]));
        let numbers = statistics(&rgb, Window::whole(96, 80)).expect("large enough");
        let grey = 0.299 * 200.0 + 0.587 * 100.0 + 0.114 * 50.0;
        assert!((numbers[0] - grey / 255.0).abs() < 1e-5 && numbers[1] < 1e-4, "{numbers:?}");
        assert!(
            (numbers[2] - (200.0 - grey) / 255.0).abs() < 1e-5 && (numbers[3] - (50.0 - grey) / 255.0).abs() < 1e-5
        );
        assert!(numbers[6..].iter().all(|d| (d - f64::from(FLOOR.ln())).abs() < 1e-3), "{numbers:?}");
    }

    #[test]
    fn detail_shows_at_its_scale_and_where_the_window_is() {
        // Squares of 4 pixels in the right half.
        let squares = |u: u32, v: u32| if u >= 96 && (u / 4 + v / 4).is_multiple_of(2) { [160; 3] } else { [100; 3] };
        let rgb = RgbImage::from_fn(192, 96, |u, v| Rgb(squares(u, v)));
        let right = statistics(&rgb, Window { left: 96, top: 0, width: 96, height: 96 }).expect("large enough");
        let diagonal = |scale: usize| right[6 + 3 * scale + 1];
        assert!(diagonal(2) > diagonal(0) + 3.0 && diagonal(2) > diagonal(1) + 3.0, "{right:?}");
        let left = statistics(&rgb, Window { left: 0, top: 0, width: 96, height: 96 }).expect("large enough");
        assert!(left[1] < 1e-4, "the left half is plain");
    }

    #[test]
    fn a_window_that_is_too_small_or_outside_has_no_numbers() {
        let rgb = RgbImage::new(96, 80);
        assert!(statistics(&rgb, Window { left: 0, top: 0, width: 32, height: 80 }).is_none());
        assert!(statistics(&rgb, Window { left: 32, top: 0, width: 96, height: 80 }).is_none());
    }
}
