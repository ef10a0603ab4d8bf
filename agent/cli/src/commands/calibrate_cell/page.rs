//! The report of a calibration put together.

use super::pictures::Opened;
use semascan_calibration::{Calibration, IntrinsicsCheck, IntrinsicsVerdict, Verified};
use semascan_model::calibration::CalibrationRecord;
use semascan_reports::{
    CalibrationReport, CameraFigures, ShownCapture, ShownPicture, VerifiedCapture, calibration_html,
};

/// What was found, for a report.
pub(super) struct Found<'a> {
    pub(super) name: &'a str,
    pub(super) opened: &'a Opened,
    pub(super) calibration: &'a Calibration,
    pub(super) record: &'a CalibrationRecord,
    pub(super) intrinsics: Option<&'a IntrinsicsCheck>,
    /// The verification captures' places in their file, and what was found.
    pub(super) verified: &'a [(usize, Verified)],
    pub(super) next: &'a [String],
}

/// The report as HTML.
pub(super) fn page(found: &Found<'_>) -> String {
    let Found { name, opened, calibration, record, intrinsics, verified, next } = *found;
    let read = &opened.read;
    let size =
        opened.file.camera().ok().flatten().map(|camera| (camera.intrinsics().width, camera.intrinsics().height));
    let captures = read.captures.iter().zip(&read.views).zip(&read.numbers).map(|((capture, view), number)| {
        let pose = &capture.camera_from_board;
        let there = pose.translation.vector;
        let cosine = (pose.rotation * nalgebra::Vector3::z()).dot(&there.normalize()).abs().min(1.0);
        let picture = view.as_ref().zip(size).map(|(view, size)| {
            let (name, jpeg) = opened.pictures.get(number).cloned().unwrap_or_default();
            ShownPicture {
                name,
                jpeg,
                size,
                corners: view.corners.iter().zip(&view.residuals).map(|(c, residual)| (c.pixel, *residual)).collect(),
                left_out: view.doubtful.iter().chain(&view.mistaken).map(|corner| corner.pixel).collect(),
                sigma: view.sigma,
            }
        });
        ShownCapture { number: *number, picture, distance: there.norm(), tilt_deg: cosine.acos().to_degrees() }
    });
    let camera = intrinsics.map(|check| CameraFigures {
        verdict: check.verdict.to_string(),
        is_contradicted: matches!(check.verdict, IntrinsicsVerdict::Contradicted { .. }),
        rms: check.rms,
        own_rms: check.own.as_ref().map(|own| own.rms),
        coverage: check.coverage,
        numbers: check
            .own
            .iter()
            .flat_map(|own| &own.numbers)
            .map(|n| (n.name.into(), n.given, n.own, n.uncertainty))
            .collect(),
        rings: check.by_radius.iter().map(|ring| (ring.radius, ring.corners, ring.rms, ring.outwards)).collect(),
        by_capture: check.by_view.clone(),
    });
    let verified = verified.iter().map(|(number, verified)| VerifiedCapture {
        number: *number,
        deg: verified.residual.0.to_degrees(),
        mm: verified.residual.1 * 1e3,
        is_within: verified.is_within,
    });
    calibration_html(&CalibrationReport {
        name,
        software: concat!("semascan ", env!("CARGO_PKG_VERSION")),
        record,
        hand_eye_covariance: calibration
            .hand_eye
            .map(|found| std::array::from_fn(|r| std::array::from_fn(|c| found.covariance[(r, c)]))),
        turntable_covariance: calibration
            .turntable
            .map(|found| std::array::from_fn(|r| std::array::from_fn(|c| found.covariance[(r, c)]))),
        captures: captures.collect(),
        said: &read.said,
        camera,
        verified: verified.collect(),
        next: next.to_vec(),
    })
}
