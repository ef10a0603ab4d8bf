//! What the camera sees past the table: a room with a gradient, and blotches that stand for things out of focus.

use glam::Vec3;

use super::noise::Noise;

/// The room behind the cell; directions are of the table frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Backdrop {
    /// Radiance at the horizon.
    pub(super) color: Vec3,
    /// Share by which it grows towards the zenith.
    pub(super) gradient: f32,
    /// Share by which it varies from place to place, 0..=1.
    pub(super) blotches: f32,
    /// Blotches along one radian.
    pub(super) density: f32,
    /// The blotches' seed.
    pub(super) seed: u32,
}

impl Backdrop {
    /// The dark, neutral room of the virtual cell.
    pub(super) const DARK_ROOM: Self =
        Self { color: Vec3::new(0.030, 0.032, 0.036), gradient: 0.9, blotches: 0.0, density: 1.0, seed: 0 };

    /// Radiance from `direction`, of any length.
    pub(super) fn at(&self, direction: Vec3) -> Vec3 {
        let d = direction.normalize_or(Vec3::Z);
        let mut out = self.color * (1.0 + self.gradient * d.z);
        if self.blotches > 0.0 {
            let noise = Noise::new(self.seed);
            // A tint of its own for each place: things there have colours.
            let tint = Vec3::new(noise.at(d * self.density + 11.0), 0.0, noise.at(d * self.density - 7.0)) * 0.3;
            out *= (Vec3::ONE + tint) * (1.0 + self.blotches * 1.4 * noise.fbm(d * self.density, 2));
        }
        out.max(Vec3::ZERO)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_blotchy_room_varies_and_gives_no_negative_light() {
        let busy = Backdrop { blotches: 1.0, density: 9.0, seed: 4, ..Backdrop::DARK_ROOM };
        let look = |b: &Backdrop, i: u32| b.at(Vec3::new((i as f32 * 0.7).cos(), (i as f32 * 0.7).sin(), 0.1));
        assert!((0..300).all(|i| look(&busy, i).min_element() >= 0.0));
        let spread = |b: &Backdrop| {
            let all: Vec<f32> = (0..300).map(|i| look(b, i).y).collect();
            all.iter().copied().fold(0.0, f32::max) / all.iter().copied().fold(1.0, f32::min)
        };
        assert!(spread(&busy) > 1.5 && spread(&Backdrop::DARK_ROOM) < 1.001);
    }
}
