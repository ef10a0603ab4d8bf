//! Normal equations of the joint refinement: priors tie each camera to its kinematics, edges tie two cameras to each other.

use super::se3::{about, turned};
use nalgebra::{DMatrix, DVector, Isometry3, Matrix6, Point3, Vector6};

/// A pair of views of which the source's points are matched into the target.
pub(super) struct Edge {
    pub(super) source: usize,
    pub(super) target: usize,
}

/// Normal equations over a twist of each camera, six rows a view.
pub(super) struct Equations {
    hessian: DMatrix<f64>,
    gradient: DVector<f64>,
}

impl Equations {
    /// Of `views` cameras, without any evidence.
    pub(super) fn new(views: usize) -> Self {
        Self { hessian: DMatrix::zeros(6 * views, 6 * views), gradient: DVector::zeros(6 * views) }
    }

    /// Adds what a camera's prior says: `from_prior` is the way from it, `stiffness` the inverse of its covariance.
    pub(super) fn add_prior(&mut self, view: usize, stiffness: &Matrix6<f64>, from_prior: &Vector6<f64>) {
        let mut block = self.hessian.view_mut((6 * view, 6 * view), (6, 6));
        block += stiffness;
        let mut rows = self.gradient.rows_mut(6 * view, 6);
        rows += stiffness * from_prior;
    }

    /// Adds an edge's normal equations over a twist of the source about its centre (`source_centre` in its own camera,
    /// `target_centre` in the target's) in the target's frame.
    pub(super) fn add_edge(
        &mut self,
        edge: &Edge,
        poses: &[Isometry3<f64>],
        source_centre: &Point3<f64>,
        target_centre: &Point3<f64>,
        (hessian, gradient): (Matrix6<f64>, Vector6<f64>),
    ) {
        // How a twist of either camera moves the source's points relative to the target, about their centre.
        let (i, j) = (edge.source, edge.target);
        let turn = (poses[j].inverse() * poses[i]).rotation.to_rotation_matrix();
        let sides = [(i, turned(turn.matrix()) * about(source_centre)), (j, -about(target_centre))];
        for (a, jacobian_a) in &sides {
            let weighted = jacobian_a.transpose() * hessian;
            for (b, jacobian_b) in &sides {
                let mut block = self.hessian.view_mut((6 * a, 6 * b), (6, 6));
                block += weighted * jacobian_b;
            }
            let mut rows = self.gradient.rows_mut(6 * a, 6);
            rows += jacobian_a.transpose() * gradient;
        }
    }

    /// The twists that make the sum of squares least, six rows a view; `None` if they are not determined.
    pub(super) fn solve(self) -> Option<DVector<f64>> {
        Some(self.hessian.cholesky()?.solve(&-self.gradient))
    }

    /// Covariance of each camera's twist, all others being uncertain as well: the diagonal blocks of the inverse. `None` if
    /// the twists are not determined.
    pub(super) fn covariances(self) -> Option<Vec<Matrix6<f64>>> {
        let views = self.gradient.len() / 6;
        let inverse = self.hessian.cholesky()?.inverse();
        Some((0..views).map(|i| inverse.fixed_view::<6, 6>(6 * i, 6 * i).into_owned()).collect())
    }
}
