//! Polygons as triangles.
//!
//! A convex polygon becomes a fan around its first corner. A fan of one that is not convex would cover what lies outside of
//! it, so that one is cut by ears (the `earcut` crate, after D. Eberly, "Triangulation by ear clipping").

use earcut::Earcut;

/// Cross products down to this share of the polygon's own are no reflex corners but rounding.
const FLAT: f64 = 1e-9;
/// Most corners of a polygon that is cut; the time grows with their square.
const MAX_CORNERS: usize = 20_000;

/// Splits polygons; keeps its buffers between them.
#[derive(Default)]
pub(crate) struct Triangulation {
    earcut: Earcut<f64>,
    triangles: Vec<[u32; 3]>,
    indices: Vec<u32>,
}

impl Triangulation {
    /// The triangles of a polygon by the numbers of its `corners`, turning as the polygon does.
    pub(crate) fn split(&mut self, corners: &[[f64; 3]]) -> &[[u32; 3]] {
        self.triangles.clear();
        let n = corners.len() as u32;
        if !self.cut_ears(corners) {
            self.triangles.clear();
            self.triangles.extend((2..n).map(|i| [0, i - 1, i]));
        }
        &self.triangles
    }

    /// Cuts a polygon that is not convex; `false` if it is, or if it cannot be cut.
    fn cut_ears(&mut self, corners: &[[f64; 3]]) -> bool {
        let n = corners.len();
        if !(4..=MAX_CORNERS).contains(&n) {
            return false;
        }
        let normal = normal(corners);
        let squared = dot(normal, normal);
        let turn = |k: usize| {
            let (before, here, after) = (corners[(k + n - 1) % n], corners[k], corners[(k + 1) % n]);
            dot(cross(minus(here, before), minus(after, here)), normal)
        };
        let limit = -FLAT * squared;
        // Also false where something is no number.
        if !(0..n).any(|k| turn(k) < limit) {
            return false;
        }
        // Seen along the axis that the polygon faces most.
        let axis = (0..3).fold(0, |most, a| if normal[a].abs() > normal[most].abs() { a } else { most });
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        self.earcut.earcut(corners.iter().map(|p| [p[u], p[v]]), &[], &mut self.indices);
        for t in self.indices.chunks_exact(3) {
            let [a, b, c] = [t[0], t[1], t[2]].map(|i| corners[i as usize]);
            let same_side = dot(cross(minus(b, a), minus(c, a)), normal) >= 0.0;
            self.triangles.push(if same_side { [t[0], t[1], t[2]] } else { [t[0], t[2], t[1]] });
        }
        !self.triangles.is_empty()
    }
}

/// Newell's normal: twice the area, along the side from which the corners go counter-clockwise.
fn normal(corners: &[[f64; 3]]) -> [f64; 3] {
    let origin = corners[0];
    let mut sum = [0.0; 3];
    for pair in corners[1..].windows(2) {
        let part = cross(minus(pair[0], origin), minus(pair[1], origin));
        (0..3).for_each(|a| sum[a] += part[a]);
    }
    sum
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(corners: &[[f64; 3]]) -> (f64, f64) {
        let mut triangulation = Triangulation::default();
        let whole = normal(corners);
        let unit = whole.map(|c| c / dot(whole, whole).sqrt());
        let signed = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| corners[i as usize]);
            0.5 * dot(cross(minus(b, a), minus(c, a)), unit)
        };
        let parts: Vec<f64> = triangulation.split(corners).iter().map(signed).collect();
        (parts.iter().sum(), parts.iter().map(|p| p.abs()).sum())
    }

    /// An L of 700 square units whose fan would cover more, turned out of the axes.
    const L: [[f64; 2]; 6] = [[40.0, 0.0], [40.0, 10.0], [10.0, 10.0], [10.0, 40.0], [0.0, 40.0], [0.0, 0.0]];

    #[test]
    fn a_polygon_that_is_not_convex_keeps_its_notch() {
        for first in 0..6 {
            let turned: Vec<[f64; 3]> =
                (0..6).map(|k| L[(first + k) % 6]).map(|[x, y]| [0.6 * x, y, 0.8 * x + 1e6]).collect();
            let reversed: Vec<[f64; 3]> = turned.iter().rev().copied().collect();
            for corners in [turned, reversed] {
                let (signed, covered) = area(&corners);
                assert!((signed - 700.0).abs() < 1e-6 && (covered - 700.0).abs() < 1e-6, "{signed} {covered}");
            }
        }
    }

    #[test]
    fn a_convex_polygon_is_a_fan() {
        let mut triangulation = Triangulation::default();
        let square = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        assert_eq!(triangulation.split(&square), [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(triangulation.split(&square[..2]).len(), 0);
        assert_eq!(triangulation.split(&[[f64::NAN; 3]; 5]).len(), 3);
        assert_eq!(triangulation.split(&[[1.0; 3]; 4]).len(), 2);
    }
}
