//! Integer addresses: voxel -> brick (8^3 voxels) -> chunk (32^3 voxels, the unit of the stream).

use semascan_shared::wire::chunk::CHUNK_EDGE;

/// Voxels along an edge of a brick.
pub(super) const BRICK_EDGE: i32 = 8;

/// Voxels in a brick.
pub(super) const BRICK_VOXELS: usize = 512;

/// Largest absolute brick coordinate: 18 bits an axis, with 9 bits for the voxel, fit a sortable `u64`.
const BRICK_LIMIT: i32 = 1 << 17;

/// Brick coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct BrickKey(pub(super) [i32; 3]);

/// A voxel's address as one sortable number: bricks in order, voxels in order within them.
pub(super) fn pack(voxel: [i32; 3]) -> Option<u64> {
    let mut brick = 0_u64;
    let mut local = 0_u64;
    for axis in voxel {
        let b = axis.div_euclid(BRICK_EDGE);
        if !(-BRICK_LIMIT..BRICK_LIMIT).contains(&b) {
            return None;
        }
        brick = brick << 18 | (b + BRICK_LIMIT) as u64;
        local = local << 3 | axis.rem_euclid(BRICK_EDGE) as u64;
    }
    Some(brick << 9 | local)
}

/// The brick of a packed address.
pub(super) fn brick_of(packed: u64) -> BrickKey {
    let axis = |shift: u32| (packed >> (9 + shift) & 0x3_ffff) as i32 - BRICK_LIMIT;
    BrickKey([axis(36), axis(18), axis(0)])
}

/// The voxel's index in its brick, of a packed address.
pub(super) fn local_of(packed: u64) -> usize {
    (packed & 0x1ff) as usize
}

impl BrickKey {
    /// The brick that holds `voxel`.
    pub(super) fn containing(voxel: [i32; 3]) -> Self {
        Self(voxel.map(|c| c.div_euclid(BRICK_EDGE)))
    }

    /// Address of the voxel at index `local`.
    pub(super) fn voxel(self, local: usize) -> [i32; 3] {
        let within = [local >> 6 & 7, local >> 3 & 7, local & 7];
        std::array::from_fn(|i| self.0[i] * BRICK_EDGE + within[i] as i32)
    }

    /// The chunk that holds this brick.
    pub(super) fn chunk(self) -> [i32; 3] {
        self.0.map(|b| b.div_euclid(CHUNK_EDGE / BRICK_EDGE))
    }
}

/// Index of `voxel` in its brick.
pub(super) fn local_index(voxel: [i32; 3]) -> usize {
    voxel.iter().fold(0, |local, c| local << 3 | c.rem_euclid(BRICK_EDGE) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn packing_keeps_the_address(voxel in prop::array::uniform3(-1_000_000..1_000_000_i32)) {
            let packed = pack(voxel).expect("in range");
            prop_assert_eq!(brick_of(packed), BrickKey::containing(voxel));
            prop_assert_eq!(local_of(packed), local_index(voxel));
            prop_assert_eq!(brick_of(packed).voxel(local_of(packed)), voxel);
        }
    }

    #[test]
    fn addresses_out_of_range_are_refused() {
        assert_eq!(pack([BRICK_LIMIT * BRICK_EDGE, 0, 0]), None);
        assert_eq!(pack([0, i32::MIN, 0]), None);
    }
}
