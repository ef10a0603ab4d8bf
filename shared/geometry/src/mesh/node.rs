//! What points say of a node, and how four nodes at a time come to it.

use bytemuck::{Pod, Zeroable};
use glam::{BVec4A, Mat4, Vec4};

/// Normals around a node whose mean is longer than this agree.
const AGREEMENT: f32 = 0.9;

/// A node of the field that points reach.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(super) struct Node {
    /// Weight of the points.
    pub(super) weight: f32,
    /// Signed distance from the surface in cells, negative inside.
    pub(super) value: f32,
    /// Unit normal.
    pub(super) normal: [f32; 3],
    /// How far, in cells, it lies from the middle of its points along the surface.
    pub(super) drift: [f32; 3],
}

/// Sums over the points around four nodes: of weights, weighted distances from the points' planes, weighted normals (3)
/// and weighted offsets of the node from the point (3).
#[derive(Clone, Copy, Debug)]
pub(super) struct Sums(pub(super) [Vec4; 8]);

impl Sums {
    /// Which nodes points reach whose normals disagree.
    pub(super) fn disputed(&self) -> BVec4A {
        let [weight, _, x, y, z, ..] = self.0;
        let limit = AGREEMENT * weight;
        (x * x + y * y + z * z).cmplt(limit * limit)
    }

    /// Which nodes points reach.
    pub(super) fn reached(&self) -> BVec4A {
        self.0[0].cmpgt(Vec4::ZERO)
    }

    /// The nodes, and which of them lie inside; meaningless where no point reaches.
    pub(super) fn nodes(&self) -> ([Node; 4], BVec4A) {
        let [weight, plane, nx, ny, nz, x, y, z] = self.0;
        let share = 1.0 / weight;
        let length = (nx * nx + ny * ny + nz * nz).sqrt().max(Vec4::splat(f32::MIN_POSITIVE));
        let [nx, ny, nz] = [nx / length, ny / length, nz / length];
        let [x, y, z] = [x * share, y * share, z * share];
        let height = nx * x + ny * y + nz * z;
        let value = 0.5 * (plane * share + height);
        let [x, y, z] = [x - height * nx, y - height * ny, z - height * nz];
        let low = Mat4::from_cols(weight, value, nx, ny).transpose();
        let high = Mat4::from_cols(nz, x, y, z).transpose();
        let node = |k: usize| bytemuck::cast([low.col(k).to_array(), high.col(k).to_array()]);
        ([node(0), node(1), node(2), node(3)], value.cmplt(Vec4::ZERO))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sums of one point of weight `w` whose plane the node is `height` above, at `offset` across it.
    fn of(w: f32, height: f32, offset: [f32; 2]) -> [f32; 8] {
        [w, w * height, 0.0, 0.0, w, w * offset[0], w * offset[1], w * height]
    }

    #[test]
    fn four_nodes_are_settled_beside_each_other() {
        let four = [of(2.0, 0.5, [0.25, -0.5]), [0.0; 8], of(0.5, -0.75, [0.0, 1.0]), of(1.0, 0.0, [0.0; 2])];
        let sums = Sums(std::array::from_fn(|k| Vec4::from_array(four.map(|node| node[k]))));
        assert_eq!(sums.reached().bitmask(), 0b1101);
        assert_eq!(sums.disputed().bitmask(), 0);
        let (nodes, below) = sums.nodes();
        assert_eq!(below.bitmask() & 0b1101, 0b0100);
        for (node, weight, value, drift) in [
            (nodes[0], 2.0, 0.5, [0.25, -0.5, 0.0]),
            (nodes[2], 0.5, -0.75, [0.0, 1.0, 0.0]),
            (nodes[3], 1.0, 0.0, [0.0; 3]),
        ] {
            assert_eq!((node.weight, node.value, node.normal, node.drift), (weight, value, [0.0, 0.0, 1.0], drift));
        }
    }

    #[test]
    fn normals_that_disagree_are_disputed() {
        // Two points of weight 1: at right angles their mean is 0.71 long, 40 degrees apart 0.94.
        let rows = [[1.0, 1.0], [0.64 + 1.0, 0.77]].map(|[x, y]| [2.0, 0.0, x, y, 0.0, 0.0, 0.0, 0.0]);
        let four = [rows[0], rows[1], [0.0; 8], rows[0]];
        let sums = Sums(std::array::from_fn(|k| Vec4::from_array(four.map(|node: [f32; 8]| node[k]))));
        assert_eq!(sums.disputed().bitmask(), 0b1001);
    }
}
