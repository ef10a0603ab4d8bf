//! Quadric errors: the sum of squared distances from planes as a symmetric 4 x 4 matrix [Garland 1997].

use crate::vector::dot;

/// A quadric: `error(x) = x'Ax + 2 b'x + c`, square metres times the planes' weights.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Quadric {
    /// Upper triangle of A, row by row.
    a: [f64; 6],
    b: [f64; 3],
    c: f64,
}

impl Quadric {
    /// Squared distance from the plane through `point` with unit normal `normal`, times `weight`.
    pub(super) fn plane(normal: [f64; 3], point: [f64; 3], weight: f64) -> Self {
        let [x, y, z] = normal;
        let d = -dot(normal, point);
        Self {
            a: [x * x, x * y, x * z, y * y, y * z, z * z].map(|v| v * weight),
            b: normal.map(|n| n * d * weight),
            c: d * d * weight,
        }
    }

    /// Squared distance from `point`, times `weight`.
    pub(super) fn point(point: [f64; 3], weight: f64) -> Self {
        Self {
            a: [weight, 0.0, 0.0, weight, 0.0, weight],
            b: point.map(|p| -p * weight),
            c: dot(point, point) * weight,
        }
    }

    /// Adds another.
    pub(super) fn add(&mut self, other: &Self) {
        self.a.iter_mut().zip(other.a).for_each(|(a, o)| *a += o);
        self.b.iter_mut().zip(other.b).for_each(|(b, o)| *b += o);
        self.c += other.c;
    }

    /// The error at `p`, not negative.
    pub(super) fn error(&self, p: [f64; 3]) -> f64 {
        let [xx, xy, xz, yy, yz, zz] = self.a;
        let ap =
            [xx * p[0] + xy * p[1] + xz * p[2], xy * p[0] + yy * p[1] + yz * p[2], xz * p[0] + yz * p[1] + zz * p[2]];
        (dot(ap, p) + 2.0 * dot(self.b, p) + self.c).max(0.0)
    }

    /// Where the error is least; `None` where the planes leave that open.
    pub(super) fn least(&self) -> Option<[f64; 3]> {
        let [xx, xy, xz, yy, yz, zz] = self.a;
        let cofactors = [yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy];
        let determinant = xx * cofactors[0] + xy * cofactors[1] + xz * cofactors[2];
        let scale = (xx + yy + zz) / 3.0;
        if determinant.abs() <= 1e-4 * scale * scale * scale {
            return None;
        }
        let inverse = [
            cofactors,
            [cofactors[1], xx * zz - xz * xz, xy * xz - xx * yz],
            [cofactors[2], xy * xz - xx * yz, xx * yy - xy * xy],
        ];
        Some(inverse.map(|row| -dot(row, self.b) / determinant))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_planes_meet_in_a_point() {
        let corner = [0.3, -0.2, 0.5];
        let mut q = Quadric::default();
        for n in [[1.0, 0.0, 0.0], [0.0, 0.6, 0.8], [0.0, -0.8, 0.6]] {
            q.add(&Quadric::plane(n, corner, 2.0));
        }
        let least = q.least().expect("three planes");
        assert!((0..3).all(|a| (least[a] - corner[a]).abs() < 1e-12), "{least:?}");
        assert!(q.error(corner) < 1e-12);
        assert!((q.error([1.3, -0.2, 0.5]) - 2.0).abs() < 1e-12);
        assert!(Quadric::plane([0.0, 0.0, 1.0], corner, 1.0).least().is_none());
    }
}
