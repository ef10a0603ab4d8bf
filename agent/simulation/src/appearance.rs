//! Procedural surfaces: what a point of the part, the chuck or the table looks like.
//!
//! Every finish draws from one distribution for all components, so that colour alone does not give a component away;
//! grime, oil and defects lie over it. Evaluated at 3D points in the part's frame (millimetres), so that there are no
//! seams and a texture stays on its place from every view. Colours are linear RGB.

use glam::Vec3;

use super::noise::{Noise, smoothstep};
use super::random::Stream;

/// What light meets at a point: the parameters of the shading model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Appearance {
    /// Linear base colour.
    pub(super) base: Vec3,
    /// 0 = dielectric, 1 = metal.
    pub(super) metallic: f32,
    /// Perceptual roughness, 0..=1.
    pub(super) roughness: f32,
    /// Tilt of the shading normal: a small vector to add before normalizing.
    pub(super) bump: Vec3,
}

/// A kind of finish that parts of this trade have.
struct Kind {
    /// How common it is.
    weight: f32,
    color: Vec3,
    metallic: f32,
    roughness: (f32, f32),
    grain: f32,
    turning: f32,
}

const fn kind(weight: f32, rgb: [f32; 3], metallic: f32, roughness: (f32, f32), grain: f32, turning: f32) -> Kind {
    Kind { weight, color: Vec3::from_array(rgb), metallic, roughness, grain, turning }
}

const KINDS: [Kind; 11] = [
    // Paints: black, grey, silver.
    kind(2.0, [0.018; 3], 0.0, (0.35, 0.60), 0.10, 0.0),
    kind(1.3, [0.10; 3], 0.0, (0.40, 0.65), 0.12, 0.0),
    kind(1.0, [0.33; 3], 0.35, (0.42, 0.60), 0.10, 0.0),
    // Metals: bare steel, cast aluminium, yellow-chromated zinc, oxidised steel.
    kind(2.0, [0.48; 3], 1.0, (0.40, 0.55), 0.05, 0.30),
    kind(2.4, [0.55, 0.55, 0.56], 1.0, (0.50, 0.66), 0.35, 0.0),
    kind(1.4, [0.58, 0.52, 0.38], 1.0, (0.36, 0.50), 0.05, 0.15),
    kind(1.2, [0.24, 0.22, 0.21], 0.8, (0.45, 0.65), 0.15, 0.10),
    // Rarer ones: blue and green paint, red-brown plastic, copper.
    kind(0.6, [0.045, 0.085, 0.16], 0.0, (0.40, 0.60), 0.08, 0.0),
    kind(0.5, [0.045, 0.10, 0.06], 0.0, (0.40, 0.60), 0.08, 0.0),
    kind(0.6, [0.20, 0.035, 0.025], 0.0, (0.40, 0.60), 0.08, 0.0),
    kind(0.4, [0.70, 0.40, 0.26], 1.0, (0.38, 0.52), 0.05, 0.10),
];

/// A finish: base colour and how it varies.
#[derive(Clone, Debug)]
pub(super) struct Finish {
    base: Vec3,
    metallic: f32,
    roughness: f32,
    /// Strength of a cast or blasted grain in the normal.
    grain: f32,
    /// Strength of fine machining marks around the part's axis.
    turning: f32,
    /// Share by which the colour varies from place to place.
    mottling: f32,
    /// Whether lines of print stand on it.
    printed: bool,
    noise: Noise,
}

impl Finish {
    /// A finish from the one distribution that all components share.
    pub(super) fn draw(s: &mut Stream) -> Self {
        let shade = s.range(0.75, 1.25);
        let mut left = s.range(0.0, KINDS.iter().map(|k| k.weight).sum());
        let kind = KINDS.iter().find(|k| {
            left -= k.weight;
            left <= 0.0
        });
        let kind = kind.unwrap_or(&KINDS[0]);
        let tint = Vec3::new(s.range(0.94, 1.06), 1.0, s.range(0.92, 1.05));
        Self {
            base: (kind.color * shade * tint).min(Vec3::splat(0.85)),
            metallic: kind.metallic,
            roughness: s.range(kind.roughness.0, kind.roughness.1),
            grain: kind.grain,
            turning: kind.turning,
            mottling: s.range(0.08, 0.22),
            printed: false,
            noise: Noise::new(s.word()),
        }
    }

    /// A finish from a wider distribution, likewise shared by all components: every second one any colour and any gloss.
    pub(super) fn draw_widely(s: &mut Stream) -> Self {
        let mut finish = Self::draw(s);
        if s.chance(0.5) {
            // Dark ones are as common as they are under a bonnet.
            let value = s.range(-4.2, -0.25).exp();
            let hue = Vec3::new(s.range(-1.0, 1.0), s.range(-1.0, 1.0), s.range(-1.0, 1.0));
            let vivid = s.range(0.0, 0.7) * s.range(0.0, 1.0);
            finish.base = (Vec3::splat(value) * (1.0 + vivid * hue)).clamp(Vec3::splat(0.004), Vec3::splat(0.85));
            finish.metallic = if s.chance(0.4) { s.range(0.6, 1.0) } else { 0.0 };
            finish.roughness = s.range(0.25, 0.8);
            finish.grain = s.range(0.0, 0.35);
            finish.turning = if s.chance(0.4) { s.range(0.0, 0.35) } else { 0.0 };
        }
        finish.mottling = s.range(0.05, 0.30);
        finish
    }

    /// The same finish with lines of print: a rating plate.
    pub(super) fn printed(mut self) -> Self {
        self.printed = true;
        self
    }

    /// Clean machined steel or anodised aluminium of the station itself.
    pub(super) fn station(base: Vec3, metallic: f32, roughness: f32, seed: u32) -> Self {
        Self {
            base,
            metallic,
            roughness,
            grain: 0.03,
            turning: 0.5,
            mottling: 0.1,
            printed: false,
            noise: Noise::new(seed),
        }
    }

    /// One colour everywhere, for parts that bring a texture of their own.
    pub(super) fn plain(base: Vec3, roughness: f32) -> Self {
        Self {
            base,
            metallic: 0.0,
            roughness,
            grain: 0.0,
            turning: 0.0,
            mottling: 0.0,
            printed: false,
            noise: Noise::new(0),
        }
    }

    /// A matt surface whose colour varies from place to place by the share `mottling`: printed paper, wood, stone.
    pub(super) fn mottled(base: Vec3, mottling: f32, seed: u32) -> Self {
        Self { mottling, noise: Noise::new(seed), ..Self::plain(base, 0.8) }
    }

    /// The finish at `p` (millimetres, part's frame).
    pub(super) fn at(&self, p: Vec3) -> Appearance {
        let mut a =
            Appearance { base: self.base, metallic: self.metallic, roughness: self.roughness, bump: Vec3::ZERO };
        if self.mottling > 0.0 {
            let broad = self.noise.fbm(p * 0.06, 2);
            let fine = self.noise.at(p * 0.4);
            a.base *= 1.0 + self.mottling * (broad + 0.4 * fine);
            a.roughness = (a.roughness + 0.10 * broad + 0.05 * fine).clamp(0.12, 1.0);
        }
        if self.grain > 0.04 {
            let q = p * 0.42;
            let dx = self.noise.at(q + Vec3::new(31.0, 0.0, 0.0));
            let dy = self.noise.at(q + Vec3::new(0.0, 57.0, 0.0));
            let dz = self.noise.at(q + Vec3::new(0.0, 0.0, 83.0));
            a.bump += Vec3::new(dx, dy, dz) * (self.grain * 0.45);
        }
        if self.turning > 0.0 {
            // Tool marks run around the axis: they vary along z and radius only, no finer than a pixel sees them.
            let marks = Vec3::new(p.truncate().length() * 0.55, p.z * 0.55, 0.0);
            let depth = self.noise.at(marks) * self.turning;
            let radial = p.truncate().normalize_or_zero();
            a.bump += Vec3::new(radial.x, radial.y, 0.8) * (depth * 0.07);
            a.base *= 1.0 + 0.10 * depth;
        }
        if self.printed {
            let line = (p.z / 2.6).floor();
            let within = (p.z / 2.6).fract().abs();
            let across = p.x.atan2(p.y) * 36.0;
            let letters = self.noise.at(Vec3::new(across * 0.9, line * 7.7, 3.0));
            let ink = smoothstep(0.05, 0.2, letters) * smoothstep(0.25, 0.35, within) * smoothstep(0.95, 0.85, within);
            let contrast = if self.base.y > 0.12 { 0.08 } else { 6.0 };
            a.base = a.base.lerp((self.base * contrast).clamp(Vec3::splat(0.01), Vec3::splat(0.6)), ink * 0.85);
        }
        a
    }
}

/// What years under a bonnet leave: dust in the corners, grime in patches, oil.
#[derive(Clone, Debug)]
pub(super) struct Grime {
    dirt: f32,
    oil: f32,
    dust: Vec3,
    noise: Noise,
}

impl Grime {
    /// A used part's grime; some parts are nearly clean.
    pub(super) fn draw(s: &mut Stream) -> Self {
        Self {
            dirt: s.range(0.1, 0.85),
            oil: s.range(0.0, 0.9),
            dust: Vec3::new(0.115, 0.088, 0.062) * s.range(0.5, 1.3),
            noise: Noise::new(s.word()),
        }
    }

    /// Grime from a wider distribution: from clean to caked, the dust of any shade between sand, soot and cement.
    pub(super) fn draw_widely(s: &mut Stream) -> Self {
        let shade = Vec3::new(0.115, 0.088, 0.062).lerp(Vec3::splat(0.09), s.range(0.0, 1.0));
        Self {
            dirt: s.range(0.0, 1.0),
            oil: s.range(0.0, 1.0),
            dust: shade * s.range(-1.2, 1.0).exp(),
            noise: Noise::new(s.word()),
        }
    }

    /// No grime.
    pub(super) fn none() -> Self {
        Self { dirt: 0.0, oil: 0.0, dust: Vec3::ZERO, noise: Noise::new(0) }
    }

    /// Lays the grime over `a` at `p`; `openness` is the share of the sky the point sees.
    pub(super) fn cover(&self, a: &mut Appearance, p: Vec3, openness: f32) {
        if self.dirt <= 0.0 && self.oil <= 0.0 {
            return;
        }
        let patch = self.noise.fbm(p * 0.045, 3);
        let speckle = self.noise.at(p * 0.33);
        let corner = smoothstep(0.85, 0.35, openness);
        let dirt =
            self.dirt * (smoothstep(-0.15, 0.7, patch + 0.15 * speckle) * 0.75 + corner * (0.65 + 0.2 * speckle));
        let dirt = dirt.clamp(0.0, 0.92);
        a.base = a.base.lerp(self.dust * (1.0 + 0.25 * speckle), dirt);
        a.metallic *= 1.0 - 0.9 * dirt;
        a.roughness += (0.88 - a.roughness) * dirt;
        let oil = self.oil * smoothstep(0.18, 0.42, self.noise.fbm(p * 0.03 + Vec3::splat(91.0), 3));
        a.base *= 1.0 - 0.6 * oil;
        a.metallic *= 1.0 - 0.5 * oil;
        a.roughness += (0.30 - a.roughness) * 0.7 * oil;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finishes_vary_and_stay_physical() {
        let mut s = Stream::new(3, "finish");
        let (mut metals, mut paints) = (0, 0);
        for _ in 0..60 {
            let (finish, grime) = (Finish::draw(&mut s), Grime::draw(&mut s));
            if finish.metallic > 0.5 {
                metals += 1
            } else {
                paints += 1
            }
            for i in 0..40 {
                let p = Vec3::new(i as f32 * 3.1, i as f32 * -1.7, i as f32 * 0.9);
                let mut a = finish.at(p);
                grime.cover(&mut a, p, 0.7);
                assert!(a.base.min_element() >= 0.0 && a.base.max_element() <= 1.0, "{a:?}");
                assert!((0.0..=1.0).contains(&a.roughness) && (0.0..=1.0).contains(&a.metallic), "{a:?}");
                assert!(a.bump.length() < 0.6);
            }
        }
        assert!(metals > 10 && paints > 10, "{metals} metals, {paints} paints");
    }
}
