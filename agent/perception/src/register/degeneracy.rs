//! Which directions of a pose the data constrain: a cylinder slides along and spins about its axis unseen.
//!
//! The normal equations are brought to one unit (rotations times the object's radius, per unit of weight), so that an
//! eigenvalue is the mean square share of a motion that the residuals see: 1/3 is a sphere's translation where
//! all of it is seen, 0 a motion that nothing sees. What lies below the threshold is noise in the normals and is frozen: the data neither
//! move the pose along it nor claim to know it (after [Zhang 2016]).

use nalgebra::{Matrix6, SymmetricEigen, Vector6};

/// A direction that the data leave unconstrained.
#[derive(Clone, Debug, PartialEq)]
pub struct FrozenDirection {
    /// Twist about the object's centre: rotation in radians times the object's radius, translation; unit length.
    pub twist: [f64; 6],
    /// Its eigenvalue.
    pub eigenvalue: f64,
}

/// How well the data constrain each direction.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Degeneracy {
    /// Eigenvalues in ascending order, dimensionless, 0 to 1.
    pub eigenvalues: [f64; 6],
    /// The directions that are unconstrained.
    pub frozen: Vec<FrozenDirection>,
}

/// Normal equations without the directions that the data leave unconstrained.
#[derive(Clone, Debug)]
pub(super) struct ObservableEquations {
    /// The hessian on the directions that are left.
    pub(super) hessian: Matrix6<f64>,
    /// The gradient on the directions that are left.
    pub(super) gradient: Vector6<f64>,
    /// What was found.
    pub(super) degeneracy: Degeneracy,
}

/// Projects out of `hessian` and `gradient` (over a twist about the object's centre, summed to `weight`) every direction
/// whose eigenvalue is below `weakest`; `radius` is the object's, metres.
pub(super) fn project_out_degenerate(
    hessian: &Matrix6<f64>,
    gradient: &Vector6<f64>,
    weight: f64,
    radius: f64,
    weakest: f64,
) -> ObservableEquations {
    let arm = radius.max(1e-6);
    let unit = Matrix6::from_diagonal(&Vector6::new(1.0 / arm, 1.0 / arm, 1.0 / arm, 1.0, 1.0, 1.0));
    let metric = Matrix6::from_diagonal(&Vector6::new(arm, arm, arm, 1.0, 1.0, 1.0));
    let scaled = unit * hessian * unit / weight.max(f64::MIN_POSITIVE);
    let eigen = SymmetricEigen::new(0.5 * (scaled + scaled.transpose()));
    let mut order: Vec<usize> = (0..6).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));

    let mut degeneracy = Degeneracy::default();
    let mut kept = Matrix6::zeros();
    for (slot, &i) in order.iter().enumerate() {
        let value = eigen.eigenvalues[i].max(0.0);
        let direction = eigen.eigenvectors.column(i);
        degeneracy.eigenvalues[slot] = value;
        if value >= weakest {
            kept += direction * direction.transpose();
        } else {
            let twist = std::array::from_fn(|a| direction[a]);
            degeneracy.frozen.push(FrozenDirection { twist, eigenvalue: value });
        }
    }
    ObservableEquations {
        hessian: metric * kept * scaled * kept * metric * weight,
        gradient: metric * kept * unit * gradient,
        degeneracy,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    /// Normal equations of points on a surface with the given normals.
    fn equations(points: &[(Vector3<f64>, Vector3<f64>)]) -> Matrix6<f64> {
        points.iter().fold(Matrix6::zeros(), |h, (p, n)| {
            let m = p.cross(n);
            let j = Vector6::new(m.x, m.y, m.z, n.x, n.y, n.z);
            h + j * j.transpose()
        })
    }

    #[test]
    fn a_cylinder_slides_and_spins() {
        let on_cylinder = |k: usize| {
            let (angle, z) = (k as f64 * 0.7, ((k % 17) as f64 - 8.0) * 0.01);
            let n = Vector3::new(angle.cos(), angle.sin(), 0.0);
            (n * 0.03 + Vector3::z() * z, n)
        };
        let points: Vec<_> = (0..500).map(on_cylinder).collect();
        let observable = project_out_degenerate(&equations(&points), &Vector6::repeat(1.0), 500.0, 0.06, 2e-3);
        assert_eq!(observable.degeneracy.frozen.len(), 2);
        for frozen in &observable.degeneracy.frozen {
            let along_z = frozen.twist[2].abs().max(frozen.twist[5].abs());
            assert!(along_z > 0.7, "{frozen:?}");
        }
        assert!(observable.gradient[2].abs() < 1e-9 && observable.gradient[5].abs() < 1e-9);
        assert!(observable.degeneracy.eigenvalues[2] > 0.01);
    }

    #[test]
    fn a_box_constrains_all() {
        let mut points = Vec::new();
        for i in 0..7 {
            for j in 0..7 {
                let (a, b) = (f64::from(i - 3) * 0.01, f64::from(j - 3) * 0.01);
                points.push((Vector3::new(0.04, a, b), Vector3::x()));
                points.push((Vector3::new(a, 0.04, b), Vector3::y()));
                points.push((Vector3::new(a, b, 0.04), Vector3::z()));
            }
        }
        let h = equations(&points);
        let observable = project_out_degenerate(&h, &Vector6::repeat(1.0), points.len() as f64, 0.05, 2e-3);
        assert!(observable.degeneracy.frozen.is_empty(), "{:?}", observable.degeneracy);
        assert!((observable.hessian - h).norm() < 1e-9 * h.norm());
    }
}
