//! What a structured-light sensor makes of the true depth: noise, gaps and the occasional lie.
//!
//! The projector's light that comes back decides everything: noise falls with its square root and grows with the square
//! of the distance and with incidence; too little light (dark, grazing, far) or too much (a gloss that mirrors the
//! projector) leaves a gap, as does the projector's shadow. At depth steps a pixel sees both surfaces: it is lost or
//! lands between them. Figures are of the order that makers of such cameras state at 0.5 m.

use glam::Vec3;

use super::lighting::{ViewLighting, reflected};
use super::noise::{gauss, hash2, unit};
use super::part::{Scene, SurfacePoint};

/// The sensor's figures; all lengths in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorModel {
    /// Standard deviation of depth at half a metre on a bright surface that faces the camera.
    pub sigma: f32,
    /// Standard deviation of the slowly varying error across the picture at half a metre.
    pub ripple: f32,
    /// Step of the recorded depth.
    pub quantum: f32,
    /// Share of the projected light that must come back for a measurement.
    pub darkest: f32,
    /// Share above which the image saturates.
    pub brightest: f32,
    /// Share of measured pixels that are far off for no visible reason.
    pub outliers: f32,
    /// Where smooth noise in [-1, 1] lies beyond this, a patch of the picture is lost for no visible reason; 1 = nowhere.
    pub patches: f32,
    /// Shares of the pixels at a depth step that are lost, and that are lost or land between the two surfaces.
    pub edges: (f32, f32),
    /// Standard deviation of the colour image's noise at mid grey, of full scale.
    pub color: f32,
}

/// The ray of one pixel and its random draws.
#[derive(Clone, Copy, Debug)]
pub(super) struct Beam {
    /// The camera, metres in the table frame.
    pub(super) eye: Vec3,
    /// True depth.
    pub(super) z: f32,
    /// The pixel's own random word.
    pub(super) draw: u32,
    /// The picture's smooth unit noise at the pixel.
    pub(super) ripple: f32,
    /// Smooth noise in [-1, 1] that decides where patches are lost.
    pub(super) patch: f32,
    /// The other depth that the pixel touches, if any.
    pub(super) behind: Option<f32>,
}

impl SensorModel {
    /// An industrial RGB-D camera of the middle class.
    pub const DEFAULT: Self = Self {
        sigma: 1.2e-4,
        ripple: 5e-5,
        quantum: 5e-5,
        darkest: 0.0035,
        brightest: 1.6,
        outliers: 2e-4,
        patches: 1.0,
        edges: (0.45, 0.53),
        color: 0.012,
    };
    /// A camera of the class that [Remanufacturing paper] uses: quieter, with exposure bracketing for dark and bright
    /// surfaces.
    pub const ZIVID: Self = Self {
        sigma: 4e-5,
        ripple: 2.5e-5,
        quantum: 1e-5,
        darkest: 0.0015,
        brightest: 4.0,
        outliers: 5e-5,
        patches: 1.0,
        edges: (0.45, 0.53),
        color: 0.008,
    };
    /// A stereo camera of the consumer class: coarse steps, slow waves, depth for dark and bright surfaces alike, and half
    /// of each edge smeared. Outside of everything that [`super::Randomisation::TRAINING`] draws.
    pub const STEREO: Self = Self {
        sigma: 4e-4,
        ripple: 5e-4,
        quantum: 5e-4,
        darkest: 0.0002,
        brightest: 8.0,
        outliers: 3e-3,
        patches: 1.0,
        edges: (0.15, 0.65),
        color: 0.045,
    };

    /// The depth that is recorded for what the pixel sees; 0 for a gap.
    pub(super) fn measure(&self, scene: &Scene, light: &ViewLighting, point: &SurfacePoint, ray: &Beam) -> f32 {
        let Beam { eye, z, draw, ripple, patch, behind } = *ray;
        if patch > self.patches || light.in_projector_shadow(scene, point) {
            return 0.0;
        }
        let to_light = light.projector - point.position;
        let distance = to_light.length();
        let view = (eye - point.position).normalize_or(point.face);
        let a = &point.appearance;
        // Half a metre and a white matt surface that faces the camera give 1.
        let returned = reflected(a, a.roughness, point.normal, view, to_light / distance).element_sum() / 3.0
            * std::f32::consts::PI
            * (0.25 / (distance * distance));
        let cos = point.face.dot(view).max(0.01);
        // A threshold crossed by noise, so that gaps have ragged edges.
        let flicker = (0.35 * gauss(hash2(draw, 1))).exp();
        if returned * flicker < self.darkest
            || returned * flicker > self.brightest
            || cos < 0.10 + 0.04 * unit(hash2(draw, 2))
        {
            return 0.0;
        }
        if let Some(other) = behind {
            let fate = unit(hash2(draw, 3));
            if fate < self.edges.0 {
                return 0.0;
            } else if fate < self.edges.1 {
                return self.quantized(z + (other - z) * unit(hash2(draw, 4)));
            }
        }
        if unit(hash2(draw, 5)) < self.outliers {
            return self.quantized(z + 0.03 * (unit(hash2(draw, 6)) - 0.5));
        }
        let range = (z / 0.5) * (z / 0.5);
        let weak = (0.25 / returned.min(1.0)).sqrt().clamp(0.7, 4.0);
        let sigma = self.sigma * range * weak / cos.max(0.2);
        self.quantized(z + sigma * gauss(hash2(draw, 7)) + self.ripple * range * ripple)
    }

    fn quantized(&self, z: f32) -> f32 {
        ((z / self.quantum).round() * self.quantum).max(0.0)
    }
}
