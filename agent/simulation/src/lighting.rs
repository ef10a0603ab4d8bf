//! Light in the cell and how surfaces answer it.
//!
//! A soft key light, a fill, a rim light, the camera's own light beside the lens, and a room with ceiling lights that
//! metals mirror. Surfaces follow the microfacet model (GGX distribution, Smith visibility, Schlick's Fresnel term:
//! [Walter 2007]; roughness and metalness as in [Burley 2012]). Lights stand in the static turntable frame: the part
//! turns beneath them, so pictures of one spot differ in light, as [Remanufacturing paper] wants them to.

use std::f32::consts::PI;

use glam::{Mat3, Vec3};

use super::appearance::Appearance;
use super::backdrop::Backdrop;
use super::noise::{hash2, smoothstep, unit};
use super::part::{Scene, SurfacePoint};
use super::random::Stream;

/// A round lamp.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lamp {
    /// Metres, static turntable frame.
    pub(super) position: Vec3,
    /// Metres.
    pub(super) radius: f32,
    /// Radiance times area: irradiance at one metre.
    pub(super) power: Vec3,
    /// Whether things throw shadows in its light; a lamp without is large and far.
    pub(super) shadows: bool,
}

/// The lights of a cell.
#[derive(Clone, Debug)]
pub(super) struct Lighting {
    pub(super) lamps: Vec<Lamp>,
    /// The camera's own light beside the lens: irradiance at one metre.
    pub(super) headlight: Vec3,
    /// Radiance from above.
    pub(super) ceiling: Vec3,
    /// Radiance from below.
    pub(super) floor: Vec3,
    /// Radiance of the rows of tubes on the ceiling.
    pub(super) tubes: f32,
    /// What is seen past the table.
    pub(super) backdrop: Backdrop,
}

/// The lights of one view in the table frame, with the camera's.
#[derive(Clone, Debug)]
pub(super) struct ViewLighting {
    pub(super) lighting: Lighting,
    to_station: Mat3,
    /// Where the camera's light (the projector) stands.
    pub(super) projector: Vec3,
}

impl Lighting {
    /// A cell's lights: positions, colours and balance vary from cell to cell.
    pub(super) fn draw(seed: u64) -> Self {
        let mut s = Stream::new(seed, "lights");
        let mut lamp = |at: Vec3, spread: f32, radius: f32, power: f32, shadows| {
            let jitter = Vec3::new(s.range(-spread, spread), s.range(-spread, spread), s.range(-spread, spread));
            let warmth = s.range(-0.10, 0.10);
            let color = Vec3::new(1.0 + warmth, 1.0, 1.0 - warmth);
            Lamp { position: at + jitter, radius, power: color * power * s.range(0.8, 1.25), shadows }
        };
        Self {
            lamps: vec![
                lamp(Vec3::new(0.85, 0.15, 0.95), 0.18, 0.13, 2.5, true),
                lamp(Vec3::new(-0.65, 0.85, 0.60), 0.20, 0.25, 0.62, false),
                lamp(Vec3::new(-0.35, -0.90, 0.75), 0.20, 0.20, 1.5, true),
            ],
            headlight: Vec3::splat(s.range(0.10, 0.20)),
            ceiling: Vec3::new(0.50, 0.52, 0.56) * s.range(0.75, 1.2),
            floor: Vec3::new(0.10, 0.095, 0.09),
            tubes: s.range(0.8, 1.7),
            backdrop: Backdrop::DARK_ROOM,
        }
    }

    /// The lights as seen from the table turned by `angle` (radians), with the projector at `projector` (table frame).
    pub(super) fn for_view(&self, angle: f32, projector: Vec3) -> ViewLighting {
        let to_table = Mat3::from_rotation_z(-angle);
        let mut lighting = self.clone();
        for lamp in &mut lighting.lamps {
            lamp.position = to_table * lamp.position;
        }
        ViewLighting { lighting, to_station: to_table.transpose(), projector }
    }

    /// What a mirror sees in direction `d` (turntable frame); rough surfaces see it blurred.
    fn room(&self, d: Vec3, roughness: f32) -> Vec3 {
        let blur = 0.25 + roughness;
        let up = smoothstep(-blur, blur, d.z);
        let mut seen = self.floor.lerp(self.ceiling * 0.55, up);
        // Dark walls: a band at the horizon gives metal its contrast.
        seen *= 1.0 - 0.45 * (-(d.z / (0.22 + 0.5 * roughness)).powi(2)).exp();
        if d.z > 0.02 {
            // Two rows of tubes on the ceiling, two metres up.
            let x = d.x / d.z * 2.0;
            let width = 0.22 + 1.6 * roughness;
            for row in [-1.1, 1.3] {
                let across = (x - row) / width;
                seen +=
                    Vec3::splat(self.tubes * (0.22 / width) * (-across * across).exp() * smoothstep(0.02, 0.35, d.z));
            }
        }
        seen
    }
}

impl ViewLighting {
    /// Colour that leaves `point` towards `eye`; `draw` picks the place on the soft lights.
    pub(super) fn shade(&self, scene: &Scene, point: &SurfacePoint, eye: Vec3, draw: u32) -> Vec3 {
        let view = (eye - point.position).normalize_or(point.face);
        let a = &point.appearance;
        let mut out = Vec3::ZERO;
        for (k, lamp) in self.lighting.lamps.iter().enumerate() {
            let to = lamp.position - point.position;
            let distance = to.length();
            let direction = to / distance;
            if point.face.dot(direction) <= 0.0 || point.normal.dot(direction) <= 0.0 {
                continue;
            }
            let lit = if lamp.shadows {
                self.visible(scene, point, lamp, hash2(draw, k as u32))
            } else {
                0.25 + 0.75 * point.openness
            };
            if lit > 0.0 {
                // A lamp of some size mirrors as a wider highlight.
                let widened = (a.roughness + 0.5 * lamp.radius / distance).min(1.0);
                out +=
                    reflected(a, widened, point.normal, view, direction) * lamp.power * (lit / (distance * distance));
            }
        }
        let to = self.projector - point.position;
        let distance = to.length();
        if point.face.dot(to) > 0.0 && !self.in_projector_shadow(scene, point) {
            let power = self.lighting.headlight / (distance * distance);
            out += reflected(a, (a.roughness + 0.1).min(1.0), point.normal, view, to / distance) * power;
        }
        out + self.ambient(a, point, view)
    }

    fn ambient(&self, a: &Appearance, point: &SurfacePoint, view: Vec3) -> Vec3 {
        let n = self.to_station * point.normal;
        let sky = self.lighting.floor.lerp(self.lighting.ceiling, 0.5 + 0.5 * n.z);
        let open = point.openness * point.openness;
        let diffuse = a.base * (1.0 - a.metallic) * sky * open;
        let mirrored = 2.0 * point.normal.dot(view) * point.normal - view;
        let cos = point.normal.dot(view).clamp(0.0, 1.0);
        let f0 = Vec3::splat(0.04).lerp(a.base, a.metallic);
        let fresnel = f0 + (Vec3::splat(1.0 - a.roughness).max(f0) - f0) * (1.0 - cos).powi(5);
        diffuse + fresnel * self.lighting.room(self.to_station * mirrored, a.roughness) * (0.15 + 0.85 * open)
    }

    /// Share of the lamp that the surface sees: a look at two opposite places, and eight more where they disagree.
    fn visible(&self, scene: &Scene, point: &SurfacePoint, lamp: &Lamp, draw: u32) -> f32 {
        let from = point.position + point.face * 4e-4;
        let sees = |k: u32| {
            let h = hash2(draw, k / 2);
            let offset = Vec3::new(unit(hash2(h, 1)), unit(hash2(h, 2)), unit(hash2(h, 3))) - 0.5;
            let side = if k.is_multiple_of(2) { 2.0 } else { -2.0 };
            let target =
                lamp.position + offset.normalize_or_zero() * (side * 0.5 * lamp.radius * unit(hash2(h, 4)).sqrt());
            u32::from(!scene.rays.is_blocked(from, target - from, 1.0))
        };
        match sees(0) + sees(1) {
            1 => (1 + (2..10).map(sees).sum::<u32>()) as f32 / 10.0,
            n => 0.5 * n as f32,
        }
    }

    /// Whether the projector's light does not reach `point`.
    pub(super) fn in_projector_shadow(&self, scene: &Scene, point: &SurfacePoint) -> bool {
        let from = point.position + point.face * 4e-4;
        point.face.dot(self.projector - from) <= 0.0 || scene.rays.is_blocked(from, self.projector - from, 1.0)
    }
}

/// Share of light from `light` that leaves towards `view`, the cosine included.
pub(super) fn reflected(a: &Appearance, roughness: f32, n: Vec3, view: Vec3, light: Vec3) -> Vec3 {
    let (nl, nv) = (n.dot(light).max(0.0), n.dot(view).max(1e-3));
    if nl <= 0.0 {
        return Vec3::ZERO;
    }
    let half = (light + view).normalize_or(n);
    let (nh, vh) = (n.dot(half).max(0.0), view.dot(half).max(0.0));
    let alpha2 = (roughness * roughness).max(0.02).powi(2);
    let d = alpha2 / (PI * (nh * nh * (alpha2 - 1.0) + 1.0).powi(2));
    let smith = |c: f32| c + (c * c * (1.0 - alpha2) + alpha2).sqrt();
    let visibility = 1.0 / (smith(nl) * smith(nv));
    let f0 = Vec3::splat(0.04).lerp(a.base, a.metallic);
    let fresnel = f0 + (Vec3::ONE - f0) * (1.0 - vh).powi(5);
    let diffuse = a.base * (1.0 - a.metallic) / PI * (Vec3::ONE - fresnel);
    (diffuse + fresnel * (d * visibility)) * nl
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn surfaces_do_not_make_light() {
        // Integrates the reflected share over the hemisphere of light directions.
        for (metallic, roughness) in [(0.0, 0.3), (0.0, 0.9), (1.0, 0.4), (1.0, 0.8)] {
            let a = Appearance { base: Vec3::ONE, metallic, roughness, bump: Vec3::ZERO };
            let view = Vec3::new(0.4, 0.0, 1.0).normalize();
            let n = 20_000;
            let sum: f32 = (0..n)
                .map(|i| {
                    let (u, v) = (unit(hash2(i, 1)), unit(hash2(i, 2)));
                    let r = (1.0 - u * u).sqrt();
                    let (sin, cos) = (2.0 * PI * v).sin_cos();
                    reflected(&a, roughness, Vec3::Z, view, Vec3::new(r * cos, r * sin, u)).x * 2.0 * PI
                })
                .sum();
            let share = sum / n as f32;
            assert!((0.5..1.08).contains(&share), "metallic {metallic}, roughness {roughness}: {share}");
        }
    }
}
