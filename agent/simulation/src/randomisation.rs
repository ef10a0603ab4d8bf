//! Domain randomisation: how far lights, camera, sensor and surfaces vary between training views.
//!
//! A network that is to work in cells it has not seen must not learn one cell's look [Tobin 2017]. Every view gets new
//! lights, a new camera and new surfaces; only the part's shape stays. All ranges are here, in one value.

use glam::Vec3;

use super::appearance::{Finish, Grime};
use super::backdrop::Backdrop;
use super::camera::Camera;
use super::defects::Defects;
use super::develop::Film;
use super::lighting::{Lamp, Lighting};
use super::part::Dress;
use super::random::Stream;
use super::scene::{STATION, motor_finishes, station_finishes};
use super::sensor::SensorModel;
use super::starter_motor::StarterMotor;
use semascan_perception::view::Intrinsics;

/// Smallest and largest value of what is drawn evenly, or evenly in its logarithm where noted.
pub type Range = (f32, f32);

/// The ranges; lengths in metres, angles in degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Randomisation {
    /// From the camera to the part's middle.
    pub distance: Range,
    /// Focal length as a share of the picture's width.
    pub focal: Range,
    /// Number of lamps.
    pub lamps: (u32, u32),
    /// Height of a lamp above the horizon.
    pub elevation: Range,
    /// Radius of a lamp.
    pub lamp_radius: Range,
    /// Irradiance that all lamps together give the part; logarithmic.
    pub irradiance: Range,
    /// Share by which red and blue differ from green, up or down.
    pub warmth: f32,
    /// Irradiance of the camera's own light at one metre; logarithmic.
    pub headlight: Range,
    /// Radiance from above; logarithmic. From below comes a tenth to a half of it.
    pub ceiling: Range,
    /// Radiance of the ceiling's tubes.
    pub tubes: Range,
    /// Radiance of the backdrop; logarithmic.
    pub backdrop: Range,
    /// Exposure against that which suits the light; logarithmic.
    pub exposure: Range,
    /// Gain of red and of blue against green.
    pub white_balance: Range,
    /// Standard deviation of the lens's blur in pixels.
    pub blur: Range,
    /// Fall of light towards the corners.
    pub vignette: Range,
    /// Exponent of the light before the tone curve.
    pub contrast: Range,
    /// 1 = as it is, 0 = grey.
    pub saturation: Range,
    /// Colour noise at mid grey; logarithmic.
    pub grain: Range,
    /// Depth noise; logarithmic. This and what follows: see [`SensorModel`].
    pub sigma: Range,
    /// Slow depth error; logarithmic.
    pub ripple: Range,
    /// Depth step; logarithmic.
    pub quantum: Range,
    /// Least light; logarithmic.
    pub darkest: Range,
    /// Most light; logarithmic.
    pub brightest: Range,
    /// Share of outliers; logarithmic.
    pub outliers: Range,
    /// Threshold of lost patches, where a view has any.
    pub patches: Range,
    /// Share of views with lost patches.
    pub patchy: f32,
    /// Share lost at depth steps.
    pub edge_lost: Range,
    /// Share that lands between the surfaces at depth steps.
    pub edge_mixed: Range,
}

impl Randomisation {
    /// What training data is drawn from: the standard cell lies well inside, the shifted one (see
    /// [`Domain`](super::Domain)) outside.
    pub const TRAINING: Self = Self {
        distance: (0.38, 0.68),
        focal: (0.92, 1.00),
        lamps: (1, 4),
        elevation: (18.0, 80.0),
        lamp_radius: (0.04, 0.30),
        irradiance: (1.5, 4.5),
        warmth: 0.25,
        headlight: (0.02, 0.45),
        ceiling: (0.18, 0.90),
        tubes: (0.0, 2.4),
        backdrop: (0.008, 0.55),
        exposure: (0.62, 1.6),
        white_balance: (0.85, 1.18),
        blur: (0.30, 0.80),
        vignette: (0.0, 1.5),
        contrast: (0.85, 1.22),
        saturation: (0.5, 1.4),
        grain: (0.004, 0.03),
        sigma: (3e-5, 2.5e-4),
        ripple: (1e-5, 1.2e-4),
        quantum: (1e-5, 2e-4),
        darkest: (0.001, 0.012),
        brightest: (1.2, 4.0),
        outliers: (2e-5, 1e-3),
        patches: (0.45, 0.8),
        patchy: 0.3,
        edge_lost: (0.25, 0.60),
        edge_mixed: (0.03, 0.20),
    };

    /// A camera in its light, with pictures of `size`.
    pub(super) fn camera(&self, s: &mut Stream, size: (u32, u32)) -> Camera {
        let lighting = self.lighting(s);
        let film = self.film(s, &lighting);
        Camera {
            intrinsics: self.intrinsics(s, size),
            lighting,
            sensor: Some(self.sensor(s)),
            film,
            ripple_step: Camera::RIPPLE_WAVES / size.0 as f32,
        }
    }

    fn intrinsics(&self, s: &mut Stream, (width, height): (u32, u32)) -> Intrinsics {
        let (w, h) = (f64::from(width), f64::from(height));
        let f = f64::from(even(s, self.focal)) * w;
        let mut centre = |n: f64| 0.5 * (n - 1.0) * (1.0 + f64::from(s.range(-0.02, 0.02)));
        Intrinsics { width, height, fx: f, fy: f, cx: centre(w), cy: centre(h) }
    }

    fn lighting(&self, s: &mut Stream) -> Lighting {
        let count = s.count(self.lamps.0, self.lamps.1);
        let shares: Vec<f32> = (0..count).map(|_| s.range(0.15, 1.0)).collect();
        let irradiance = logarithmic(s, self.irradiance) / shares.iter().sum::<f32>();
        let lamp = |share: &f32| {
            let (azimuth, elevation) = (s.range(0.0, std::f32::consts::TAU), even(s, self.elevation).to_radians());
            let distance = s.range(0.8, 1.9);
            let direction =
                Vec3::new(elevation.cos() * azimuth.cos(), elevation.cos() * azimuth.sin(), elevation.sin());
            Lamp {
                position: direction * distance,
                radius: even(s, self.lamp_radius),
                power: self.tint(s) * (irradiance * share * distance * distance),
                shadows: s.chance(0.75),
            }
        };
        let lamps = shares.iter().map(lamp).collect();
        let ceiling = self.tint(s) * logarithmic(s, self.ceiling);
        Lighting {
            lamps,
            headlight: self.tint(s) * logarithmic(s, self.headlight),
            ceiling,
            floor: ceiling * s.range(0.1, 0.5),
            tubes: even(s, self.tubes),
            backdrop: Backdrop {
                color: self.tint(s) * logarithmic(s, self.backdrop),
                gradient: s.range(-0.9, 0.9),
                blotches: s.range(-0.3, 1.0).max(0.0),
                density: s.range(2.0, 16.0),
                seed: s.word(),
            },
        }
    }

    fn tint(&self, s: &mut Stream) -> Vec3 {
        let warmth = s.range(-self.warmth, self.warmth);
        Vec3::new(1.0 + warmth, 1.0 + s.range(-0.05, 0.05), 1.0 - warmth)
    }

    /// Exposure follows the light, as every camera's does.
    fn film(&self, s: &mut Stream, lighting: &Lighting) -> Film {
        /// What the standard cell's lights give.
        const USUAL: f32 = 4.4;
        let lamps: f32 = lighting.lamps.iter().map(|l| l.power.y / l.position.length_squared()).sum();
        let light = lamps + 4.0 * lighting.headlight.y + 1.8 * lighting.ceiling.y;
        Film {
            exposure: logarithmic(s, self.exposure) * USUAL / light,
            white_balance: Vec3::new(even(s, self.white_balance), 1.0, even(s, self.white_balance)),
            blur: even(s, self.blur),
            vignette: even(s, self.vignette),
            contrast: even(s, self.contrast),
            saturation: even(s, self.saturation),
        }
    }

    fn sensor(&self, s: &mut Stream) -> SensorModel {
        let edge_lost = even(s, self.edge_lost);
        SensorModel {
            sigma: logarithmic(s, self.sigma),
            ripple: logarithmic(s, self.ripple),
            quantum: logarithmic(s, self.quantum),
            darkest: logarithmic(s, self.darkest),
            brightest: logarithmic(s, self.brightest),
            outliers: logarithmic(s, self.outliers),
            patches: if s.chance(self.patchy) { even(s, self.patches) } else { 1.0 },
            edges: (edge_lost, edge_lost + even(s, self.edge_mixed)),
            color: logarithmic(s, self.grain),
        }
    }

    /// Surfaces for `motor`: all components draw from one distribution, and some motors are painted all over, so that
    /// colour gives no component away.
    pub(super) fn dress(&self, s: &mut Stream, motor: &StarterMotor) -> Dress {
        let station: [Finish; STATION] =
            if s.chance(0.5) { station_finishes() } else { std::array::from_fn(|_| Finish::draw_widely(s)) };
        let coat = s.chance(0.15).then(|| Finish::draw_widely(s));
        let finishes = motor_finishes(station, || match &coat {
            Some(coat) if s.chance(0.8) => coat.clone(),
            _ => Finish::draw_widely(s),
        });
        let rust = Vec3::new(s.range(0.75, 1.3), s.range(0.7, 1.35), s.range(0.6, 1.5)) * s.range(0.7, 1.15);
        Dress {
            finishes,
            textures: Vec::new(),
            grime: Grime::draw_widely(s),
            defects: Defects::draw(motor, u64::from(s.word())).tinted(rust),
        }
    }
}

fn even(s: &mut Stream, (low, high): Range) -> f32 {
    s.range(low, high)
}

fn logarithmic(s: &mut Stream, (low, high): Range) -> f32 {
    s.range(low.ln(), high.ln()).exp()
}
