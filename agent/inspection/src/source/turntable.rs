//! A recording of a turntable by a fixed camera: all views are looked at before the first is inspected, what stands still is
//! left out, and views without poses get theirs from the turn about the axis (`perception::register::turntable`).
//!
//! Memory stays bounded: of each view a thinned picture is kept, of [`MOST_VIEWS`] at most. A view whose angle is ambiguous
//! is an error with its reason, as one that cannot be read. Views with poses keep them: only what stands still is left out,
//! which a model in a frame that turns has no place for.

use crate::planning::SteeredCamera;
use crate::source::{CaptureTrigger, Source, SourceError, SourceInfo, TrueMesh};
use crate::spec::TurntableSpec;
use crate::stop::StopSwitch;
use nalgebra::{Isometry3, Matrix6};
use semascan_perception::register::se3::about;
use semascan_perception::register::turntable::{
    Axis, NoAngle, TurningView, Turntable, TurntableError, axis_of_poses, look_for_stillness, solve, volume,
};
use semascan_perception::view::{DepthImage, PoseEvidence, View, covariance_of_prior};
use std::sync::Arc;

/// Most views that are looked at together.
const MOST_VIEWS: usize = 240;
/// Views by which it is told whether the camera is fixed.
const FIRST_VIEWS: usize = 8;
/// Standard deviations of an estimated pose about the part: radians and metres.
const SIGMA: (f64, f64) = (0.03, 0.005);
/// Radians that a camera must have turned before its poses are judged.
const CARRIED: f64 = 0.06;

/// The setting that says what was found.
const SETTING: &str = "turntable";

/// A source whose views are told what turns.
pub struct TurntableSource {
    source: Box<dyn Source>,
    info: SourceInfo,
    spec: TurntableSpec,
    /// What was found; `None` until all views were looked at.
    found: Option<Found>,
    /// Views of the source so far, those that cannot be read included.
    next: usize,
    measured: u64,
    left_out: u64,
}

/// What looking at all views found.
enum Found {
    /// It is no turntable: views pass as they are.
    Nothing,
    /// What stands still is to be left out.
    Background(Turntable),
    /// The views' poses as well: each view's place among those that could be read.
    Poses(Turntable, Vec<Option<usize>>),
    /// It is one, and cannot be used.
    Refused(String),
}

impl TurntableSource {
    /// `source` as `spec` says. `None` gives the source back where there is nothing to be done.
    ///
    /// # Errors
    /// Why a turntable that was asked for cannot be looked for: the source's views come only once.
    pub fn wrap(mut source: Box<dyn Source>, spec: TurntableSpec) -> Result<Box<dyn Source>, String> {
        let known = source.info().turntable.is_some();
        match spec {
            TurntableSpec::None => Ok(source),
            TurntableSpec::Auto if known || !source.rewind() => Ok(source),
            TurntableSpec::Known { .. } if !source.rewind() => {
                Err(format!("{}: its views come only once, and all must be looked at first", source.info().uri))
            }
            _ => {
                let info = source.info().clone();
                Ok(Box::new(Self { source, info, spec, found: None, next: 0, measured: 0, left_out: 0 }))
            }
        }
    }

    /// Looks at all views.
    fn look(&mut self) -> Found {
        let asked = matches!(self.spec, TurntableSpec::Known { .. });
        let (mut thinned, mut poses, mut places) = (Vec::new(), Vec::new(), Vec::new());
        let mut posed = 0;
        while let Some(view) = self.source.next_view() {
            let Ok(view) = view.and_then(|v| {
                v.check_sizes().map(|()| v).map_err(|e| SourceError::Uri { uri: String::new(), reason: e.to_string() })
            }) else {
                places.push(None);
                continue;
            };
            places.push(Some(thinned.len()));
            posed += usize::from(view.pose.table_from_camera().is_some());
            poses.push(view.pose.table_from_camera());
            if posed > 0 && is_carried(&poses) {
                return if asked { Self::refused_poses() } else { Found::Nothing };
            }
            thinned.push(TurningView::of(&view));
            if thinned.len() == FIRST_VIEWS && !asked && matches!(look_for_stillness(&thinned), Err(e) if !e.is_fixed())
            {
                return Found::Nothing;
            }
            // Of a recording with poses the first views tell what stands still.
            if thinned.len() == MOST_VIEWS {
                break;
            }
        }
        if posed > 0 {
            let all: Option<Vec<Isometry3<f64>>> = poses.into_iter().collect();
            let axis = all.and_then(|poses| axis_of_poses(&poses));
            let turntable = axis.and_then(|axis| volume(&thinned, &axis).ok());
            return match turntable {
                None if asked => Self::refused_poses(),
                None => Found::Nothing,
                Some(turntable) => Found::Background(turntable),
            };
        }
        if thinned.len() == MOST_VIEWS && self.source.next_view().is_some() {
            let reason =
                format!("more than {MOST_VIEWS} views of a turntable without poses cannot be looked at together");
            return if asked { Found::Refused(reason) } else { Found::Nothing };
        }
        match solve(thinned, &self.spec.config()) {
            Ok(turntable) => Found::Poses(turntable, places),
            // A camera that moves, or a scene in which nothing turns, is for the other registration.
            Err(error) if !asked && !error.is_fixed() => Found::Nothing,
            Err(TurntableError::FewViews { .. }) if !asked => Found::Nothing,
            Err(error) => Found::Refused(error.to_string()),
        }
    }

    fn refused_poses() -> Found {
        Found::Refused("its poses are not those of a fixed camera before something that turns about one axis".into())
    }

    /// Notes what was found for people and the record.
    fn note(&mut self) {
        let left_out = || {
            let share = 100.0 * self.left_out as f64 / self.measured.max(1) as f64;
            format!(
                "{} of {} pixels with depth stand still and are left out ({share:.0} %)",
                self.left_out, self.measured
            )
        };
        let axis = |t: &Turntable| {
            let (p, d) = (t.axis.point, t.axis.direction);
            format!("axis={:.4},{:.4},{:.4},{:.4},{:.4},{:.4}", p.x, p.y, p.z, d.x, d.y, d.z)
        };
        let text = match &self.found {
            None | Some(Found::Nothing) => return,
            Some(Found::Refused(reason)) => format!("found, but not used: {reason}"),
            Some(Found::Background(turntable)) => {
                format!("a fixed camera before a turntable ({}); {}", axis(turntable), left_out())
            }
            Some(Found::Poses(turntable, _)) => {
                let placed = turntable.angles.iter().filter(|a| a.is_ok()).count();
                let all = turntable.angles.len();
                format!("{placed} of {all} views by their angle ({}); {}", axis(turntable), left_out())
            }
        };
        match self.info.settings.iter_mut().find(|(key, _)| key == SETTING) {
            Some((_, value)) => *value = text,
            None => {
                tracing::info!("{}: turntable: {text}", self.info.uri);
                self.info.settings.push((SETTING.into(), text));
            }
        }
    }

    /// The view without what stands still, with its pose.
    fn told(&mut self, view: View, place: usize) -> Result<View, SourceError> {
        let refuse = |reason: String| SourceError::Uri { uri: self.info.uri.clone(), reason };
        let turntable = match &self.found {
            None | Some(Found::Nothing) => return Ok(view),
            Some(Found::Refused(reason)) => {
                let hint = "say --turntable step=DEG or axis=X,Y,Z,NX,NY,NZ, or none if it is no turntable";
                return Err(refuse(format!("the view is of a turntable: {reason}; {hint}")));
            }
            Some(Found::Background(turntable) | Found::Poses(turntable, _)) => turntable,
        };
        let pose = match &self.found {
            Some(Found::Poses(turntable, places)) => {
                let nothing = NoAngle::NothingTurns { points: 0 };
                let read = places.get(place).copied().flatten();
                let angle = read.and_then(|read| turntable.angles.get(read)).copied().unwrap_or(Err(nothing));
                let angle = angle.map_err(|why| refuse(format!("the view is of a turntable without poses: {why}")))?;
                evidence(&turntable.axis, angle.radians)
            }
            _ => view.pose.clone(),
        };
        let width = view.depth.width;
        let (mut measured, mut left_out) = (0, 0);
        let metres = view.depth.metres.iter().enumerate().map(|(i, z)| {
            if *z <= 0.0 {
                return 0.0;
            }
            measured += 1;
            let (u, v) = (i as u32 % width, i as u32 / width);
            let turns = turntable.holds(&view.intrinsics.unproject(u.into(), v.into(), f64::from(*z)));
            left_out += u64::from(!turns);
            if turns { *z } else { 0.0 }
        });
        let depth = DepthImage { width, height: view.depth.height, metres: metres.collect() };
        if measured == left_out {
            return Err(refuse(format!("all {measured} pixels with depth stand still: nothing of the part is seen")));
        }
        self.measured += measured;
        self.left_out += left_out;
        Ok(View { depth: Arc::new(depth), pose, ..view })
    }
}

/// Whether the poses are those of a camera that is carried about, as far as they tell.
fn is_carried(table_from_camera: &[Option<Isometry3<f64>>]) -> bool {
    let Some(poses) = table_from_camera.iter().copied().collect::<Option<Vec<_>>>() else { return true };
    let turned = poses[0].rotation.angle_to(&poses[poses.len() - 1].rotation);
    turned > CARRIED && axis_of_poses(&poses).is_none()
}

/// The pose of the camera when the disc has turned by `angle`, in the frame that turns with it.
fn evidence(axis: &Axis, angle: f64) -> PoseEvidence {
    let table_from_camera = axis.table_from_camera() * axis.turned(-angle);
    let centre = axis.point;
    let carry: Matrix6<f64> = about(&nalgebra::Point3::from(-centre.coords));
    let covariance = carry * covariance_of_prior(SIGMA.0, SIGMA.1) * carry.transpose();
    PoseEvidence::World { table_from_camera, covariance }
}

impl Source for TurntableSource {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_view(&mut self) -> Option<Result<View, SourceError>> {
        if self.found.is_none() {
            let found = self.look();
            self.found = Some(found);
            self.source.rewind();
        }
        let place = self.next;
        self.next += 1;
        let view = self.source.next_view();
        self.info.follow_settings(self.source.info());
        let view = view?;
        let told = view.and_then(|view| self.told(view, place));
        self.note();
        Some(told)
    }

    fn rewind(&mut self) -> bool {
        (self.next, self.measured, self.left_out) = (0, 0, 0);
        self.source.rewind()
    }

    fn end_with(&mut self, stop: &StopSwitch) {
        self.source.end_with(stop);
    }

    fn capture_trigger(&self) -> Option<CaptureTrigger> {
        self.source.capture_trigger()
    }

    fn steered(&mut self) -> Option<&mut dyn SteeredCamera> {
        self.source.steered()
    }

    fn truth(&self) -> Option<&TrueMesh> {
        self.source.truth()
    }
}
