//! Integer addresses: voxel -> brick (8^3 voxels) -> chunk (32^3 voxels, the unit of the stream).

use semascan_geometry::grid::coarser;
use semascan_protocol::chunk::CHUNK_EDGE;

/// Voxels along an edge of a brick.
pub(super) const BRICK_EDGE: i32 = 8;

/// Voxels in a brick.
pub(super) const BRICK_VOXELS: usize = 512;

/// Largest absolute brick coordinate: 18 bits an axis fit a sortable `u64`.
const BRICK_LIMIT: i32 = 1 << 17;

/// Index in its brick of a voxel, of which only the place in the brick counts.
#[inline]
pub(super) fn local_index(voxel: [i32; 3]) -> u16 {
    ((voxel[0] & 7) << 6 | (voxel[1] & 7) << 3 | (voxel[2] & 7)) as u16
}

/// Place in its brick of the voxel at index `local`, 0 to 7 along each axis.
#[inline]
pub(super) fn within_brick(local: u16) -> [u16; 3] {
    [local >> 6 & 7, local >> 3 & 7, local & 7]
}

/// Brick coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct BrickKey(pub(super) [i32; 3]);

/// A brick's address as one number that sorts as the address does; `None` out of range.
pub(super) fn pack_brick(brick: [i32; 3]) -> Option<u64> {
    let mut packed = 0_u64;
    for b in brick {
        if !(-BRICK_LIMIT..BRICK_LIMIT).contains(&b) {
            return None;
        }
        packed = packed << 18 | (b + BRICK_LIMIT) as u64;
    }
    Some(packed)
}

/// The brick of a packed address.
pub(super) fn brick_of(packed: u64) -> BrickKey {
    let axis = |shift: u32| (packed >> shift & 0x3_ffff) as i32 - BRICK_LIMIT;
    BrickKey([axis(36), axis(18), axis(0)])
}

impl BrickKey {
    /// The brick that holds a voxel.
    #[inline]
    pub(super) fn containing(voxel: [i32; 3]) -> Self {
        Self(coarser(voxel, BRICK_EDGE))
    }

    /// Address of the voxel at index `local`.
    pub(super) fn voxel(self, local: u16) -> [i32; 3] {
        let within = within_brick(local);
        std::array::from_fn(|i| self.0[i] * BRICK_EDGE + i32::from(within[i]))
    }

    /// The chunk that holds this brick.
    pub(super) fn chunk(self) -> [i32; 3] {
        coarser(self.0, CHUNK_EDGE / BRICK_EDGE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn packing_keeps_the_address_and_its_order(
            a in prop::array::uniform3(-1_000_000..1_000_000_i32),
            b in prop::array::uniform3(-1_000_000..1_000_000_i32),
        ) {
            let (first, second) = (BrickKey::containing(a), BrickKey::containing(b));
            let packed = |k: BrickKey| pack_brick(k.0).expect("in range");
            prop_assert_eq!(brick_of(packed(first)), first);
            prop_assert_eq!(first.voxel(local_index(a)), a);
            prop_assert_eq!(packed(first).cmp(&packed(second)), first.cmp(&second));
        }
    }

    #[test]
    fn addresses_out_of_range_are_refused() {
        assert_eq!(pack_brick([BRICK_LIMIT, 0, 0]), None);
        assert_eq!(pack_brick([0, i32::MIN, 0]), None);
    }
}
