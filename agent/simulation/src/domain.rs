//! Which world a cell's pictures come from: lens, light, sensor and development together.
//!
//! [`Domain::Standard`] is the virtual cell as it is. [`Domain::Shifted`] looks at the same parts with a camera, a light
//! rig and a noise model that no training view ever has ([`Randomisation::TRAINING`](super::Randomisation) stays clear of
//! them), so that what networks lose in a cell they were not made for can be told honestly.

use glam::Vec3;

use super::backdrop::Backdrop;
use super::camera::Camera;
use super::develop::Film;
use super::lighting::{Lamp, Lighting};
use super::random::Stream;
use super::sensor::SensorModel;
use semascan_perception::view::Intrinsics;

/// A world.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Domain {
    /// The virtual cell as it is.
    Standard,
    /// A wide lens, a lamp of tungsten light low at each side and a strong ring about the lens, a stereo camera's noise.
    Shifted,
}

impl Domain {
    /// The sensor that belongs to the world.
    pub(super) fn sensor(self) -> SensorModel {
        match self {
            Self::Standard => SensorModel::DEFAULT,
            Self::Shifted => SensorModel::STEREO,
        }
    }

    /// Focal length as a share of the picture's width: 615 pixels at 640, as structured-light cameras of this class
    /// have; or a wide lens.
    pub(super) fn focal(self) -> f64 {
        match self {
            Self::Standard => 0.961,
            Self::Shifted => 0.78,
        }
    }

    /// The camera of the cell `seed` with pictures of `size`.
    pub(super) fn camera(self, seed: u64, size: (u32, u32), sensor: Option<SensorModel>) -> Camera {
        let (lighting, film) = match self {
            Self::Standard => (Lighting::draw(seed), Film::draw(seed)),
            Self::Shifted => (shifted_lighting(seed), shifted_film(seed)),
        };
        Camera {
            intrinsics: draw_intrinsics(seed, size, self.focal()),
            lighting,
            sensor,
            film,
            ripple_step: Camera::RIPPLE_WAVES / size.0 as f32,
        }
    }
}

/// A calibrated lens: focal length within 1 %, centre within 1 % of the picture; they differ from cell to cell.
fn draw_intrinsics(seed: u64, (width, height): (u32, u32), focal: f64) -> Intrinsics {
    let mut s = Stream::new(seed, "lens");
    let mut vary = |share: f32| 1.0 + f64::from(s.range(-share, share));
    let (w, h) = (f64::from(width), f64::from(height));
    let f = focal * w * vary(0.01);
    Intrinsics {
        width,
        height,
        fx: f,
        fy: f * vary(0.001),
        cx: 0.5 * (w - 1.0) * vary(0.01),
        cy: 0.5 * (h - 1.0) * vary(0.01),
    }
}

fn shifted_lighting(seed: u64) -> Lighting {
    let mut s = Stream::new(seed, "shifted lights");
    // The camera is balanced for the ring: what it lights alone comes out neutral.
    let (tungsten, warm_white) = (Vec3::new(1.45, 1.0, 0.45), Vec3::new(1.2, 1.0, 0.8));
    let mut low = |side: f32, power: f32| Lamp {
        position: Vec3::new(side * s.range(0.8, 1.0), s.range(0.1, 0.5), s.range(0.10, 0.18)),
        radius: 0.02,
        power: tungsten * power * s.range(0.8, 1.25),
        shadows: true,
    };
    let lamps = vec![low(1.0, 1.3), low(-1.0, 0.8)];
    Lighting {
        lamps,
        headlight: warm_white * s.range(0.55, 0.75),
        ceiling: warm_white * 0.10,
        floor: warm_white * 0.36,
        tubes: 0.0,
        backdrop: Backdrop { color: warm_white * 0.65, gradient: -0.3, blotches: 0.25, density: 3.0, seed: s.word() },
    }
}

fn shifted_film(seed: u64) -> Film {
    let mut s = Stream::new(seed, "shifted film");
    Film {
        exposure: s.range(0.9, 1.1),
        white_balance: Vec3::new(s.range(0.80, 0.83), 1.0, s.range(1.22, 1.28)),
        blur: s.range(0.90, 1.0),
        vignette: s.range(1.8, 2.4),
        contrast: s.range(1.28, 1.4),
        saturation: s.range(1.5, 1.7),
    }
}

#[cfg(test)]
mod tests {
    use super::super::Randomisation;
    use super::*;

    /// What an honest figure for the shifted world rests on: nothing of the shifted world lies in what training draws.
    #[test]
    fn training_never_draws_what_the_shifted_world_has() {
        let r = Randomisation::TRAINING;
        let outside = |(low, high): (f32, f32), v: f32| v < low * 0.999 || v > high * 1.001;
        for seed in 0..50 {
            let c = Domain::Shifted.camera(seed, (640, 480), Some(Domain::Shifted.sensor()));
            assert!(outside(r.focal, (c.intrinsics.fx / 640.0) as f32));
            let sensor = c.sensor.expect("a sensor");
            assert!(outside(r.sigma, sensor.sigma) && outside(r.ripple, sensor.ripple));
            assert!(outside(r.quantum, sensor.quantum) && outside(r.darkest, sensor.darkest));
            assert!(outside(r.brightest, sensor.brightest) && outside(r.outliers, sensor.outliers));
            assert!(outside(r.edge_lost, sensor.edges.0) && outside(r.grain, sensor.color));
            let film = c.film;
            assert!(outside(r.blur, film.blur) && outside(r.vignette, film.vignette));
            assert!(outside(r.contrast, film.contrast) && outside(r.saturation, film.saturation));
            assert!(outside(r.white_balance, film.white_balance.x) && outside(r.white_balance, film.white_balance.z));
            assert!(outside(r.headlight, c.lighting.headlight.y) && outside(r.tubes, c.lighting.tubes - 1e-6));
            for lamp in &c.lighting.lamps {
                let elevation = (lamp.position.z / lamp.position.length()).asin().to_degrees();
                assert!(outside(r.elevation, elevation) && outside(r.lamp_radius, lamp.radius));
                assert!(lamp.power.x / lamp.power.z > (1.0 + r.warmth) / (1.0 - r.warmth));
            }
        }
    }
}
