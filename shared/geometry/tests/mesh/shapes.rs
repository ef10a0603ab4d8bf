//! Clouds of known surfaces, as a map holds them: one mean point a voxel; and what a good mesh is.

use rand::{RngExt, SeedableRng};
use semascan_model::{PointFlags, SemanticCloud, SemanticMesh, SemanticPoint};
use std::collections::BTreeMap;
use std::f32::consts::TAU;

/// Voxel edge of all shapes, metres.
pub(crate) const VOXEL: f32 = 0.001;

/// A point of a surface with its normal and label.
pub(crate) type Sample = ([f32; 3], [f32; 3], u16);

/// Positions and normals, their number, and how often each label occurred.
type Sums = ([f64; 6], u32, BTreeMap<u16, u32>);

/// Means over voxels of samples with noise of `deviation` metres along the normals.
pub(crate) fn voxelized(samples: impl Iterator<Item = Sample>, deviation: f32, seed: u64) -> SemanticCloud {
    let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
    let mut cells: BTreeMap<[i32; 3], Sums> = BTreeMap::new();
    for (p, n, label) in samples {
        // Near enough to a normal distribution.
        let noise = (0..4).map(|_| random.random_range(-1.0..1.0_f32)).sum::<f32>() * deviation * 0.87;
        let p: [f32; 3] = std::array::from_fn(|a| p[a] + noise * n[a]);
        let cell = p.map(|c| (f64::from(c) / f64::from(VOXEL)).floor() as i32);
        let (sums, count, labels) = cells.entry(cell).or_default();
        for a in 0..3 {
            sums[a] += f64::from(p[a]);
            sums[a + 3] += f64::from(n[a]);
        }
        *count += 1;
        *labels.entry(label).or_default() += 1;
    }
    let point = |(sums, count, labels): Sums| {
        let normal = [3, 4, 5].map(|a| sums[a] as f32);
        let length = normal.iter().map(|c| c * c).sum::<f32>().sqrt();
        let (label, votes) = labels.into_iter().max_by_key(|(label, n)| (*n, u16::MAX - label)).expect("a sample");
        SemanticPoint {
            position: [0, 1, 2].map(|a| (sums[a] / f64::from(count)) as f32),
            normal: if length > 1e-6 { normal.map(|c| c / length) } else { [0.0; 3] },
            color: [10 * label as u8, 100, 200],
            label,
            confidence: votes as f32 / count as f32,
            defect: 0,
            defect_confidence: 1.0,
            sigma: 0.1,
            defect_sigma: 0.0,
            instance: label,
            views: 4,
            flags: PointFlags::default(),
        }
    };
    cells.into_values().map(point).collect()
}

/// A sphere around `centre`; label 1 above its middle, 2 below.
pub(crate) fn sphere(centre: [f32; 3], radius: f32) -> impl Iterator<Item = Sample> {
    let count = (4.0 * std::f32::consts::PI * (radius / VOXEL).powi(2) * 16.0) as u32;
    (0..count).map(move |i| {
        let z = 1.0 - 2.0 * (i as f32 + 0.5) / count as f32;
        let angle = (f64::from(i) * 2.399_963_229_728_653 % std::f64::consts::TAU) as f32;
        let r = (1.0 - z * z).sqrt();
        let n = [r * angle.cos(), r * angle.sin(), z];
        (std::array::from_fn(|a| centre[a] + radius * n[a]), n, if z > 0.0 { 1 } else { 2 })
    })
}

/// A torus around z through the origin, label 1.
pub(crate) fn torus(major: f32, minor: f32) -> impl Iterator<Item = Sample> {
    let steps = |r: f32| (TAU * r / VOXEL * 4.0) as u32;
    let (around, across) = (steps(major + minor), steps(minor));
    (0..around * across).map(move |i| {
        let u = (i / across) as f32 / around as f32 * TAU;
        let v = (i % across) as f32 / across as f32 * TAU;
        let n = [v.cos() * u.cos(), v.cos() * u.sin(), v.sin()];
        let ring = [major * u.cos(), major * u.sin(), 0.0];
        (std::array::from_fn(|a| ring[a] + minor * n[a]), n, 1)
    })
}

/// A square of edge `edge` at height `z`, normal up or down, label 1 left and 2 right of x = 0.
pub(crate) fn square(edge: f32, z: f32, up: bool) -> impl Iterator<Item = Sample> {
    let steps = (edge / VOXEL * 4.0) as u32;
    (0..steps * steps).map(move |i| {
        let at = |k: u32| ((k as f32 + 0.5) / steps as f32 - 0.5) * edge;
        let (x, y) = (at(i / steps), at(i % steps));
        ([x, y, z], [0.0, 0.0, if up { 1.0 } else { -1.0 }], if x < 0.0 { 1 } else { 2 })
    })
}

/// Number of triangles over each edge, by its vertices, and whether any edge is run through twice in one direction.
pub(crate) fn edges(mesh: &SemanticMesh) -> (BTreeMap<[u32; 2], u32>, bool) {
    let (mut count, mut directed) = (BTreeMap::new(), BTreeMap::new());
    for t in &mesh.triangles {
        for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            *count.entry([a.min(b), a.max(b)]).or_insert(0) += 1;
            *directed.entry([a, b]).or_insert(0_u32) += 1;
        }
    }
    (count, directed.values().any(|&n| n > 1))
}

/// Checks that every edge has one or two triangles that agree in orientation, that the triangles around each vertex are
/// one fan, that none is degenerate, and that open edges are marked. Returns the number of open edges.
pub(crate) fn check_manifold(mesh: &SemanticMesh) -> usize {
    let (edges, twice) = edges(mesh);
    assert!(!twice, "an edge has two triangles on one side");
    assert!(edges.values().all(|&n| n <= 2), "an edge has more than two triangles");
    let mut open = 0;
    for ([a, b], _) in edges.iter().filter(|(_, n)| **n == 1) {
        open += 1;
        assert!(mesh.boundary[*a as usize] && mesh.boundary[*b as usize], "an open edge is not marked");
    }
    // Around a vertex, the opposite edges of its triangles form one chain.
    let mut around: BTreeMap<u32, Vec<[u32; 2]>> = BTreeMap::new();
    for t in &mesh.triangles {
        for i in 0..3 {
            around.entry(t[i]).or_default().push([t[(i + 1) % 3], t[(i + 2) % 3]]);
        }
    }
    for (vertex, links) in around {
        let next: BTreeMap<u32, u32> = links.iter().map(|l| (l[0], l[1])).collect();
        let ends: std::collections::BTreeSet<u32> = links.iter().map(|l| l[1]).collect();
        let start = links.iter().map(|l| l[0]).find(|a| !ends.contains(a)).unwrap_or(links[0][0]);
        let (mut at, mut seen) = (start, 0);
        while let Some(&to) = next.get(&at) {
            (at, seen) = (to, seen + 1);
            if at == start {
                break;
            }
        }
        assert_eq!(seen, links.len(), "vertex {vertex} joins two fans");
    }
    for t in &mesh.triangles {
        let [a, b, c] = mesh.corners(*t).expect("vertices that are there");
        let cross = cross(sub(b, a), sub(c, a));
        let area = 0.5 * dot(cross, cross).sqrt();
        assert!(area > 1e-6 * VOXEL * VOXEL, "degenerate: {area}");
    }
    open
}

pub(crate) fn sub(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|k| a[k] - b[k])
}

pub(crate) fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    (0..3).map(|k| a[k] * b[k]).sum()
}

pub(crate) fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
