//! The dimensions of one starter motor, drawn from a seed.
//!
//! Ranges follow passenger-car and light-truck starters, the cores of [Remanufacturing paper] (section "Dataset
//! generation": 42 motors that "greatly vary in shape"): 150 to 300 mm long, pinions of 9 to 12 teeth of module 2.1 to
//! 3. Millimetres; the motor's axis is +z, z = 0 at the rear end, the solenoid stands at +x.

use super::super::random::Stream;

/// Drawn dimensions; see the fields.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Parameters {
    /// Radius of the housing (yoke).
    pub(super) yoke_radius: f32,
    /// Height of the housing, rear cover included: where the carrier begins.
    pub(super) yoke_length: f32,
    /// Height of the rear cover.
    pub(super) cover_height: f32,
    /// Radius of the rear cover.
    pub(super) cover_radius: f32,
    /// Length of the drive-end carrier.
    pub(super) carrier_length: f32,
    /// Radius of the carrier's nose.
    pub(super) nose_radius: f32,
    /// Whether the pinion stands free before the nose; else it shows through a window in the nose.
    pub(super) overhung: bool,
    /// Radius of the solenoid.
    pub(super) solenoid_radius: f32,
    /// Distance of the solenoid's axis from the motor's.
    pub(super) solenoid_offset: f32,
    /// z of the solenoid's drive end.
    pub(super) solenoid_top: f32,
    /// z of the solenoid's rear end, where the terminal cap begins.
    pub(super) solenoid_bottom: f32,
    /// Teeth of the pinion.
    pub(super) teeth: u32,
    /// Module of the pinion: pitch diameter over teeth.
    pub(super) module: f32,
    /// Width of the pinion along the axis.
    pub(super) face_width: f32,
}

impl Parameters {
    /// The motor of `seed`.
    pub(super) fn draw(seed: u64) -> Self {
        let mut s = Stream::new(seed, "dimensions");
        let yoke_radius = s.range(30.0, 43.0);
        let yoke_length = s.range(82.0, 140.0);
        let cover_radius = yoke_radius + s.range(-2.5, 1.5);
        let cover_height = s.range(20.0, 30.0);
        let (teeth, module) = (s.count(9, 12), s.range(2.1, 3.0));
        let outer_radius = module * (0.5 * teeth as f32 + 1.0);
        let nose_radius = (outer_radius + s.range(5.0, 8.0)).min(yoke_radius - 4.0);
        let solenoid_radius = yoke_radius * s.range(0.56, 0.70);
        let solenoid_offset = yoke_radius + solenoid_radius + s.range(2.0, 6.0);
        let solenoid_top = yoke_length + s.range(-6.0, 6.0);
        let solenoid_bottom = (solenoid_top - s.range(58.0, 84.0)).max(42.0);
        Self {
            yoke_radius,
            yoke_length,
            cover_height,
            cover_radius,
            carrier_length: s.range(54.0, 88.0),
            nose_radius,
            overhung: s.chance(0.6),
            solenoid_radius,
            solenoid_offset,
            solenoid_top,
            solenoid_bottom,
            teeth,
            module,
            face_width: s.range(15.0, 24.0),
        }
    }

    /// z of the front of the carrier's nose.
    pub(super) fn nose_end(&self) -> f32 {
        self.yoke_length + self.carrier_length
    }

    /// z of the pinion's rear face.
    pub(super) fn pinion_start(&self) -> f32 {
        if self.overhung { self.nose_end() + 3.0 } else { self.nose_end() - 14.0 - self.face_width }
    }

    /// Tip radius of the pinion.
    pub(super) fn tip_radius(&self) -> f32 {
        self.module * (0.5 * self.teeth as f32 + 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn motors_vary_within_real_proportions() {
        let all: Vec<Parameters> = (0..200).map(Parameters::draw).collect();
        for p in &all {
            let length = p.nose_end() + if p.overhung { 10.0 + p.face_width } else { 0.0 };
            assert!((130.0..300.0).contains(&length), "{length}");
            assert!(p.nose_radius > p.tip_radius(), "the pinion fits the nose: {p:?}");
            assert!(p.solenoid_top - p.solenoid_bottom > 30.0, "{p:?}");
        }
        let spread = |f: fn(&Parameters) -> f32| {
            let (low, high) = all.iter().map(f).fold((f32::MAX, f32::MIN), |(l, h), v| (l.min(v), h.max(v)));
            high / low
        };
        assert!(spread(|p| p.yoke_length) > 1.5 && spread(|p| p.yoke_radius) > 1.3);
    }
}
