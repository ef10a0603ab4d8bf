//! Rigid motions: the one that fits pairs of points best, and whether a matrix is one.

use nalgebra::{Isometry3, Matrix3, Matrix4, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// Largest entry of `R^T R - 1` of a matrix that still counts as a rotation: what five printed digits leave.
const ROTATION_TOLERANCE: f64 = 1e-4;

/// Why a matrix is not a rigid motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NotRigid {
    /// An entry is NaN or infinite.
    #[error("the pose matrix holds a number that is not finite")]
    NotFinite,
    /// The last row is not 0 0 0 1.
    #[error("the last row of the pose matrix is not 0 0 0 1")]
    Projective,
    /// The upper left part scales or shears.
    #[error("the rotation part of the pose matrix is not orthonormal")]
    NotOrthonormal,
    /// The upper left part mirrors.
    #[error("the rotation part of the pose matrix is a mirror image")]
    Mirror,
}

/// The rigid motion that `matrix` is.
///
/// # Errors
/// [`NotRigid`] if it is none; small deviations (1e-4) are taken as rounding and removed.
pub fn from_matrix(matrix: &Matrix4<f64>) -> Result<Isometry3<f64>, NotRigid> {
    if !matrix.iter().all(|v| v.is_finite()) {
        return Err(NotRigid::NotFinite);
    }
    let last = matrix.row(3);
    if last.iter().zip([0.0, 0.0, 0.0, 1.0]).any(|(v, w)| (v - w).abs() > 1e-9) {
        return Err(NotRigid::Projective);
    }
    let rotation: Matrix3<f64> = matrix.fixed_view::<3, 3>(0, 0).into();
    if (rotation.transpose() * rotation - Matrix3::identity()).amax() > ROTATION_TOLERANCE {
        return Err(NotRigid::NotOrthonormal);
    }
    if rotation.determinant() < 0.0 {
        return Err(NotRigid::Mirror);
    }
    let rotation = nearest_rotation(&rotation).ok_or(NotRigid::NotOrthonormal)?;
    let translation = Translation3::new(matrix[(0, 3)], matrix[(1, 3)], matrix[(2, 3)]);
    Ok(Isometry3::from_parts(translation, UnitQuaternion::from_rotation_matrix(&rotation)))
}

/// The rotation that maximises `tr(R^T M)` [Umeyama 1991]; `None` if `m` is not finite.
pub fn nearest_rotation(m: &Matrix3<f64>) -> Option<Rotation3<f64>> {
    if !m.iter().all(|v| v.is_finite()) {
        return None;
    }
    let svd = m.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let sign = (u.determinant() * v_t.determinant()).signum();
    // nalgebra sorts singular values, largest first: the last one pays for a reflection.
    let flip = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign));
    let rotation = u * flip * v_t;
    rotation.iter().all(|v| v.is_finite()).then(|| Rotation3::from_matrix_unchecked(rotation))
}

/// The motion `target_from_source` that brings each pair's first point closest to its second in the sense of least
/// squares; `None` for fewer than three pairs.
pub fn fit(pairs: &[(Point3<f64>, Point3<f64>)]) -> Option<Isometry3<f64>> {
    if pairs.len() < 3 {
        return None;
    }
    let n = pairs.len() as f64;
    let from = pairs.iter().map(|p| p.0.coords).sum::<Vector3<f64>>() / n;
    let to = pairs.iter().map(|p| p.1.coords).sum::<Vector3<f64>>() / n;
    let correlation: Matrix3<f64> = pairs.iter().map(|(a, b)| (b.coords - to) * (a.coords - from).transpose()).sum();
    let rotation = UnitQuaternion::from_rotation_matrix(&nearest_rotation(&correlation)?);
    Some(Isometry3::from_parts(Translation3::from(to - rotation * from), rotation))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn motions_come_back_and_nothing_else_passes(
            t in prop::array::uniform3((-3_000_000..3_000_000_i32).prop_map(|k| f64::from(k) / 1e6)),
            r in prop::array::uniform3((-1_700_000..1_700_000_i32).prop_map(|k| f64::from(k) / 1e6)),
            (row, column) in (0..4_usize, 0..4_usize),
            off in prop_oneof![Just(0.01), Just(-0.5), Just(f64::NAN), Just(f64::INFINITY)],
        ) {
            let motion = Isometry3::new(t.into(), r.into());
            let mut matrix = motion.to_homogeneous();
            let back = from_matrix(&matrix).expect("rigid");
            prop_assert!((back.to_homogeneous() - matrix).amax() < 1e-12);
            let pairs: Vec<_> = (0..5)
                .map(|i| Point3::new(f64::from(i), f64::from(i * i), f64::from(i % 2)))
                .map(|p| (p, motion * p))
                .collect();
            prop_assert!((fit(&pairs).expect("five pairs").to_homogeneous() - matrix).amax() < 1e-9);
            matrix[(row, column)] += off;
            // A finite translation is the one thing that may change.
            prop_assert_eq!(from_matrix(&matrix).is_ok(), column == 3 && row < 3 && off.is_finite());
        }
    }

    #[test]
    fn mirrors_and_scales_are_named() {
        let mirror = Matrix4::from_diagonal(&nalgebra::Vector4::new(1.0, 1.0, -1.0, 1.0));
        assert_eq!(from_matrix(&mirror), Err(NotRigid::Mirror));
        assert_eq!(from_matrix(&Matrix4::new_scaling(1.01)), Err(NotRigid::NotOrthonormal));
        assert_eq!(from_matrix(&Matrix4::zeros()), Err(NotRigid::Projective));
        assert!(fit(&[(Point3::origin(), Point3::origin()); 2]).is_none());
        assert!(nearest_rotation(&(Matrix3::identity() * f64::NAN)).is_none());
    }
}
