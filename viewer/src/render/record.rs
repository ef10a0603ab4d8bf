//! A point as the GPU reads it: two texels of an `Rgba32Uint` data texture, 32 bytes.
//!
//! | texel | r | g | b | a |
//! |---|---|---|---|---|
//! | 0 | x (f32 bits) | y | z | normal, octahedral, 2 x snorm16 |
//! | 1 | red, green, blue, confidence (8 bits each) | label, defect (16 each) | views, flags (16 each) | marks |
//!
//! Marks: bit 31 = there is a point, bit 30 = its normal is known; bits 0..8 sigma, 8..16 defect confidence.
//! The octahedral map folds the unit sphere onto a square [Cigolle 2014].

use semascan_model::SemanticPoint;

/// Words of a record.
pub const RECORD_WORDS: usize = 8;

/// A slot without a point.
pub const EMPTY: [u32; RECORD_WORDS] = [0; RECORD_WORDS];

const OCCUPIED: u32 = 1 << 31;
const NORMAL_KNOWN: u32 = 1 << 30;

/// Packs a point; one that is nowhere (a position that is not finite) becomes [`EMPTY`].
pub fn pack(p: &SemanticPoint) -> [u32; RECORD_WORDS] {
    if !p.position.iter().all(|c| c.is_finite()) {
        return EMPTY;
    }
    let [x, y, z] = p.position.map(f32::to_bits);
    let (normal, known) = match octahedral(p.normal) {
        Some(normal) => (normal, NORMAL_KNOWN),
        None => (0, 0),
    };
    let [r, g, b] = p.color;
    [
        x,
        y,
        z,
        normal,
        u32::from_le_bytes([r, g, b, unorm8(p.confidence)]),
        pair(p.label, p.defect),
        pair(p.views, p.flags.0),
        OCCUPIED | known | u32::from_le_bytes([unorm8(p.sigma), unorm8(p.defect_confidence), 0, 0]),
    ]
}

fn pair(low: u16, high: u16) -> u32 {
    u32::from(low) | u32::from(high) << 16
}

fn unorm8(share: f32) -> u8 {
    (share.clamp(0.0, 1.0) * 255.0).round() as u8
}

fn octahedral([x, y, z]: [f32; 3]) -> Option<u32> {
    let sum = x.abs() + y.abs() + z.abs();
    if !(sum.is_finite() && sum > 0.1) {
        return None;
    }
    let sign = |v: f32| if v < 0.0 { -1.0 } else { 1.0 };
    let (mut u, mut v) = (x / sum, y / sum);
    if z < 0.0 {
        (u, v) = ((1.0 - v.abs()) * sign(u), (1.0 - u.abs()) * sign(v));
    }
    let snorm16 = |c: f32| (c * 32767.0).round() as i16 as u16;
    Some(pair(snorm16(u), snorm16(v)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Vec2, Vec3};
    use proptest::prelude::*;
    use semascan_model::PointFlags;

    fn point(position: [f32; 3], normal: [f32; 3]) -> SemanticPoint {
        SemanticPoint {
            position,
            normal,
            color: [1, 2, 3],
            label: 7,
            confidence: 1.0,
            defect: 9,
            defect_confidence: 0.0,
            sigma: 0.0,
            defect_sigma: 0.0,
            instance: 0,
            views: 11,
            flags: PointFlags(PointFlags::BACKGROUND),
        }
    }

    /// The same steps as `unfold_normal` in points.wgsl.
    fn unfold(word: u32) -> Vec3 {
        let snorm = |w: u32| f32::from(w as u16 as i16) / 32767.0;
        let f = Vec2::new(snorm(word & 0xffff), snorm(word >> 16));
        let mut n = Vec3::new(f.x, f.y, 1.0 - f.x.abs() - f.y.abs());
        let t = (-n.z).max(0.0);
        n.x += if n.x >= 0.0 { -t } else { t };
        n.y += if n.y >= 0.0 { -t } else { t };
        n.normalize()
    }

    #[test]
    fn fields_are_where_the_shader_looks() {
        let record = pack(&point([1.0, 2.0, 3.0], [0.0, 0.0, 1.0]));
        assert_eq!(record[..3].iter().map(|w| f32::from_bits(*w)).collect::<Vec<_>>(), [1.0, 2.0, 3.0]);
        assert_eq!(record[4].to_le_bytes(), [1, 2, 3, 255]);
        assert_eq!((record[5] & 0xffff, record[5] >> 16), (7, 9));
        assert_eq!((record[6] & 0xffff, record[6] >> 16), (11, u32::from(PointFlags::BACKGROUND)));
        assert_eq!(record[7] >> 30, 3);
    }

    #[test]
    fn points_that_are_nowhere_and_normals_that_point_nowhere_are_marked() {
        assert_eq!(pack(&point([f32::NAN, 0.0, 0.0], [0.0, 0.0, 1.0])), EMPTY);
        assert_eq!(pack(&point([0.0; 3], [0.0; 3]))[7] >> 30, 2);
        assert_eq!(pack(&point([0.0; 3], [f32::NAN; 3]))[7] >> 30, 2);
    }

    proptest! {
        #[test]
        fn normals_survive_folding(
            n in prop::array::uniform3((-1_000_000..1_000_000_i32).prop_map(|k| k as f32 / 1e6)),
        ) {
            let n = Vec3::from(n);
            prop_assume!(n.length() > 0.1);
            let n = n.normalize();
            let word = pack(&point([0.0; 3], n.into()))[3];
            prop_assert!(unfold(word).distance(n) < 1e-3);
        }
    }
}
