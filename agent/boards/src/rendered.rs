//! A picture of a board as a camera with a lens takes it: blurred, noisy, unevenly lit. Where its corners are is known, so that
//! detectors and calibrations can be held against the truth.

use crate::print::{Print, UnknownDictionary};
use image::{GrayImage, ImageBuffer, Luma};
use nalgebra::{Isometry3, Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;
use semascan_calibration::Board;
use semascan_perception::view::CameraModel;

/// Rays along each edge of a pixel.
const RAYS: usize = 4;
/// Grey values: of black ink, of paper, of what is behind the board.
const INK: f32 = 35.0;
const PAPER: f32 = 205.0;
const BEHIND: f32 = 110.0;
/// White margin around the print, millimetres.
const MARGIN: f64 = 8.0;
/// How much darker the light is at the right edge of the picture than at the left one.
const UNEVEN: f32 = 0.25;

/// How a picture is taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposure {
    /// Standard deviation of the blur, pixels.
    pub blur: f32,
    /// Standard deviation of the noise, grey values.
    pub noise: f32,
    /// Seed of the noise.
    pub seed: u64,
}

/// A camera that takes pictures of boards. What its lens does to the rays is worked out once.
pub struct Renderer {
    size: (usize, usize),
    /// The rays of the corners of pixels, row by row; between them a lens is straight enough.
    rays: Vec<Option<Vector3<f64>>>,
}

impl Renderer {
    /// For pictures of `camera`.
    pub fn new(camera: &CameraModel) -> Self {
        let (width, height) = (camera.intrinsics().width as usize, camera.intrinsics().height as usize);
        let rays = (0..(width + 1) * (height + 1)).into_par_iter().map(|at| {
            let (u, v) = ((at % (width + 1)) as f64 - 0.5, (at / (width + 1)) as f64 - 0.5);
            camera.ray_of_pixel(u, v)
        });
        Self { size: (width, height), rays: rays.collect() }
    }

    /// The picture of a board.
    ///
    /// # Errors
    /// [`UnknownDictionary`].
    pub fn picture(
        &self,
        board: &Board,
        camera_from_board: &Isometry3<f64>,
        exposure: Exposure,
    ) -> Result<GrayImage, UnknownDictionary> {
        let print = Print::new(board)?;
        let ((width, height), rays) = (self.size, &self.rays);
        let board_from_camera = camera_from_board.inverse();
        let eye = board_from_camera * Point3::origin();
        let grey_of = |ray: &Vector3<f64>| {
            let direction = board_from_camera * ray;
            let along = -eye.z / direction.z;
            let place = (eye + along * direction) * 1e3;
            let [w, h] = board.extent_mm();
            let is_board =
                along > 0.0 && (-MARGIN..w + MARGIN).contains(&place.x) && (-MARGIN..h + MARGIN).contains(&place.y);
            match is_board {
                true if print.is_black(place.x, place.y) => INK,
                true => PAPER,
                false => BEHIND,
            }
        };
        let pixels: Vec<f32> = (0..width * height)
            .into_par_iter()
            .map(|at| {
                let (column, row) = (at % width, at / width);
                let corner = |right: usize, down: usize| rays[(row + down) * (width + 1) + column + right];
                let [Some(a), Some(b), Some(c), Some(d)] = [corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)]
                else {
                    return 0.0;
                };
                let mut sum = 0.0;
                for k in 0..RAYS * RAYS {
                    let [x, y] = [k % RAYS, k / RAYS].map(|k| (k as f64 + 0.5) / RAYS as f64);
                    sum += grey_of(&((a * (1.0 - x) + b * x) * (1.0 - y) + (c * (1.0 - x) + d * x) * y));
                }
                let light = 1.0 - UNEVEN * (column as f32 / width as f32 - 0.5);
                light * sum / (RAYS * RAYS) as f32
            })
            .collect();
        let sharp: ImageBuffer<Luma<f32>, Vec<f32>> =
            ImageBuffer::from_vec(width as u32, height as u32, pixels).unwrap_or_default();
        let blurred = match exposure.blur > 0.0 {
            true => imageproc::filter::gaussian_blur_f32(&sharp, exposure.blur),
            false => sharp,
        };
        let mut rng = Pcg64::seed_from_u64(exposure.seed);
        // The sum of twelve uniform deviates is a normal one, nearly.
        let mut normal = || (0..12).map(|_| rng.random::<f32>()).sum::<f32>() - 6.0;
        let noisy =
            blurred.pixels().map(|grey| (grey.0[0] + exposure.noise * normal()).round().clamp(0.0, 255.0) as u8);
        Ok(GrayImage::from_vec(width as u32, height as u32, noisy.collect()).unwrap_or_default())
    }
}
