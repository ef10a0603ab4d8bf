//! Which crossings of a grid cell belong to one sheet of the surface: the loops of dual marching cubes.
//!
//! A dual mesher that puts one vertex into a cell pinches sheets together where two pass through one cell. One vertex
//! for each loop of crossed edges keeps them apart [Nielson 2004]. What then is left is a face with four crossings
//! whose two neighbours each have one loop through all of them: both would be joined by two quads pairs over one edge.
//! Such a face is read the other way round ([Wenger 2013], section 5.5), which always splits the loop in two.
//!
//! Corner `c` of a cell lies at `(c & 1, c >> 1 & 1, c >> 2 & 1)`. Edge `4 * axis + k` runs along `axis`, `k` holding its
//! place along the other two axes, the lower axis in the lower bit. Face `2 * axis + side` is orthogonal to `axis`.

/// No loop: the edge is not crossed, or no quad crosses it.
pub(super) const NO_LOOP: u8 = u8::MAX;

/// Low and high corner of every edge.
pub(super) const EDGE_CORNERS: [[u8; 2]; 12] = edge_corners();

/// Loops of all sign patterns, faces with four crossings read so that corners outside stay apart.
const LOOPS: [Loops; 256] = all_loops();

/// Which loop each edge of a cell belongs to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Loops {
    /// Loop of each edge, or [`NO_LOOP`].
    pub(super) of_edge: [u8; 12],
    /// Number of loops.
    pub(super) count: u8,
    /// Faces with four crossings that all belong to one loop, a bit each.
    pub(super) doubled: u8,
}

/// The two axes other than `axis`, in order.
pub(super) const fn others(axis: usize) -> [usize; 2] {
    match axis {
        0 => [1, 2],
        1 => [0, 2],
        _ => [0, 1],
    }
}

const fn edge_corners() -> [[u8; 2]; 12] {
    let mut corners = [[0; 2]; 12];
    let mut e = 0;
    while e < 12 {
        let (axis, k) = (e / 4, e % 4);
        let [b, c] = others(axis);
        let low = (k & 1) << b | (k >> 1) << c;
        corners[e] = [low as u8, (low | 1 << axis) as u8];
        e += 1;
    }
    corners
}

/// Edges that are crossed when the corners in `mask` lie inside, a bit each.
pub(super) const fn crossed(mask: u8) -> u16 {
    let mut edges = 0;
    let mut e = 0;
    while e < 12 {
        let [low, high] = EDGE_CORNERS[e];
        if (mask >> low & 1) != (mask >> high & 1) {
            edges |= 1 << e;
        }
        e += 1;
    }
    edges
}

/// Corners of a face in order around it.
const fn face_corners(face: usize) -> [u8; 4] {
    let (axis, side) = (face / 2, face % 2);
    let [b, c] = others(axis);
    let base = (side << axis) as u8;
    let (b, c) = (1 << b, 1 << c);
    [base, base | b, base | b | c, base | c]
}

const fn edge_between(a: u8, b: u8) -> usize {
    let mut e = 0;
    while e < 12 {
        let [low, high] = EDGE_CORNERS[e];
        if (low == a && high == b) || (low == b && high == a) {
            return e;
        }
        e += 1;
    }
    12
}

/// Pairs of crossed edges that the surface joins across `face`; `flipped` reads a face with four crossings the other
/// way. `None` twice where the face is not crossed.
const fn segments(mask: u8, face: usize, flipped: bool) -> [Option<[usize; 2]>; 2] {
    let q = face_corners(face);
    let edges =
        [edge_between(q[0], q[1]), edge_between(q[1], q[2]), edge_between(q[2], q[3]), edge_between(q[3], q[0])];
    let inside = [mask >> q[0] & 1 == 1, mask >> q[1] & 1 == 1, mask >> q[2] & 1 == 1, mask >> q[3] & 1 == 1];
    if inside[0] == inside[2] && inside[1] == inside[3] && inside[0] != inside[1] {
        // Each pair cuts one corner off: those outside, or, flipped, those inside.
        return if inside[0] == flipped {
            [Some([edges[3], edges[0]]), Some([edges[1], edges[2]])]
        } else {
            [Some([edges[0], edges[1]]), Some([edges[2], edges[3]])]
        };
    }
    let mut found = [12; 4];
    let mut n = 0;
    let mut i = 0;
    while i < 4 {
        if inside[i] != inside[(i + 1) % 4] {
            found[n] = edges[i];
            n += 1;
        }
        i += 1;
    }
    if n == 2 { [Some([found[0], found[1]]), None] } else { [None, None] }
}

/// The loops of a cell: edges joined across faces. Only edges in `present` take part; faces in `flips` are read the other
/// way round. Where quads are missing a loop falls into the fans that are left.
pub(super) const fn loops(mask: u8, flips: u8, present: u16) -> Loops {
    let mut parent = [0_u8; 12];
    let mut e = 0;
    while e < 12 {
        parent[e] = e as u8;
        e += 1;
    }
    let mut face = 0;
    while face < 6 {
        let pairs = segments(mask, face, flips >> face & 1 == 1);
        let mut s = 0;
        while s < 2 {
            if let Some([a, b]) = pairs[s]
                && present >> a & 1 == 1
                && present >> b & 1 == 1
            {
                // Twelve edges: relabelling is as good as a forest.
                let (from, to) = (parent[a], parent[b]);
                let mut i = 0;
                while i < 12 {
                    if parent[i] == from {
                        parent[i] = to;
                    }
                    i += 1;
                }
            }
            s += 1;
        }
        face += 1;
    }
    let mut loops = Loops { of_edge: [NO_LOOP; 12], count: 0, doubled: 0 };
    let mut number = [NO_LOOP; 12];
    let mut e = 0;
    while e < 12 {
        if present >> e & 1 == 1 {
            let root = parent[e] as usize;
            if number[root] == NO_LOOP {
                number[root] = loops.count;
                loops.count += 1;
            }
            loops.of_edge[e] = number[root];
        }
        e += 1;
    }
    let mut face = 0;
    while face < 6 {
        if let [Some([a, _]), Some([b, _])] = segments(mask, face, flips >> face & 1 == 1)
            && loops.of_edge[a] != NO_LOOP
            && loops.of_edge[a] == loops.of_edge[b]
        {
            loops.doubled |= 1 << face;
        }
        face += 1;
    }
    loops
}

const fn all_loops() -> [Loops; 256] {
    let mut table = [Loops { of_edge: [NO_LOOP; 12], count: 0, doubled: 0 }; 256];
    let mut mask = 0;
    while mask < 256 {
        table[mask] = loops(mask as u8, 0, crossed(mask as u8));
        mask += 1;
    }
    table
}

/// The loops of a cell whose quads are all there and whose faces are read the usual way.
pub(super) fn whole_loops(mask: u8) -> &'static Loops {
    const TABLE: &[Loops; 256] = &LOOPS;
    &TABLE[usize::from(mask)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_crossing_belongs_to_a_loop_of_at_least_three() {
        for mask in 0..=255_u8 {
            let loops = whole_loops(mask);
            let mut sizes = [0; 12];
            for (e, &l) in loops.of_edge.iter().enumerate() {
                assert_eq!(l != NO_LOOP, crossed(mask) >> e & 1 == 1);
                if l != NO_LOOP {
                    sizes[usize::from(l)] += 1;
                }
            }
            assert!(sizes[..usize::from(loops.count)].iter().all(|&n| n >= 3), "{mask:08b}: {sizes:?}");
        }
        // Two opposite corners inside are two sheets, one corner is one.
        assert_eq!(whole_loops(0b1000_0001).count, 2);
        assert_eq!(whole_loops(0b0000_0001).count, 1);
        assert_eq!((whole_loops(0).count, whole_loops(255).count), (0, 0));
    }

    #[test]
    fn reading_a_doubled_face_the_other_way_splits_its_loop() {
        let mut seen = 0;
        for mask in 0..=255_u8 {
            let plain = whole_loops(mask);
            for face in 0..6 {
                if plain.doubled >> face & 1 == 1 {
                    let flipped = loops(mask, 1 << face, crossed(mask));
                    assert_eq!(flipped.count, plain.count + 1, "{mask:08b}, face {face}");
                    assert_eq!(flipped.doubled >> face & 1, 0);
                    seen += 1;
                }
            }
        }
        assert!(seen > 0);
    }
}
