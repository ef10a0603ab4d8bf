//! A view without a prior: it is found in the model globally ([`global`](super::global)), then treated like any other,
//! the pose that was found as its prior.
//!
//! Global registration proposes poses by the surface alone, and on round parts most of them are wrong. Each is judged by
//! what the camera would have seen from there ([`super::visibility`]), and by its picture, where views that were found
//! before it show the same surface ([`super::photometric`]): round things are alike by their surface and not by their
//! print. Where none holds or two hold alike, no guess is made: one wrong pose spoils a model for all that come after. A pose that holds is known to about the edge of the grid
//! it was found on, which is what its covariance says: the ICP has to make a good one of it.

use super::global::{CloudInput, GlobalConfig, GlobalMatch, propose};
use super::kinematics::Prior;
use super::model_view::{ModelSurface, ModelView};
use super::photometric::{Alikeness, PhotometricGate, compare};
use super::registration::{RegisterError, RegistrationInput};
use super::se3::about;
use super::selection::Selection;
use super::source_points::SourcePoints;
use super::surfels::Facing;
use super::texture::{LEVELS, ViewTexture};
use super::visibility::Visibility;
use crate::view::covariance_of_prior;
use nalgebra::{Isometry3, Matrix6, Point3};

/// Edge of the pixels that the model is looked at with, in spacings of its points.
const PIXEL: f64 = 2.0;
/// Depths that differ by more spacings are of different surfaces.
const TOLERANCE: f64 = 3.0;
/// Of an object by itself, which is often round. But it stands free, before what is far away or nothing at all, so that
/// its outline tells.
const OBJECT: AcceptanceLimits = AcceptanceLimits { contradicted: 0.05, confirmed: 0.85, holes_count: true };
/// Of a whole scene, which is like itself in one pose only. But the sensor fails here and there.
const SCENE: AcceptanceLimits = AcceptanceLimits { contradicted: 0.15, confirmed: 0.75, holes_count: false };
/// Share of the best pose's confirmation from which on the next best one is a rival.
const RIVAL: f64 = 0.9;
/// Correlation of the pictures below which a pose does not hold, whatever the surface says.
const UNLIKE: f64 = 0.0;
/// By how much the correlation of one pose must exceed that of another that confirms as much, to be preferred.
const MORE_ALIKE: f64 = 0.2;
/// Fewest points that two pictures are compared in.
const FEWEST_COMPARED: u32 = 300;
/// Edges of the grids that are tried, in edges of the first.
const GRIDS: [f64; 3] = [1.0, 0.8, 1.25];
/// Standard deviations (radians, metres) of a camera that the table frame is defined by: all but none.
const EXACT: (f64, f64) = (1e-6, 1e-6);

/// The prior of the view whose camera is the table frame.
pub(super) fn camera_as_frame() -> Prior {
    Prior { table_from_camera: Isometry3::identity(), covariance: covariance_of_prior(EXACT.0, EXACT.1) }
}

/// What the view has to say of a pose that is accepted.
#[derive(Clone, Copy, Debug)]
struct AcceptanceLimits {
    /// Most that the view may contradict of what it can speak of.
    contradicted: f64,
    /// Least that it must confirm of what the model shows.
    confirmed: f64,
    /// Whether the model shows something also where the view measured nothing.
    holes_count: bool,
}

impl AcceptanceLimits {
    /// The share of what the model shows that the view confirms.
    fn confirmation(&self, seen: &Visibility) -> f64 {
        let holes = if self.holes_count { seen.unmeasured } else { 0 };
        f64::from(seen.confirmed) / f64::from((seen.confirmed + seen.contradicted + seen.hidden + holes).max(1))
    }

    fn accept(&self, seen: &Visibility) -> bool {
        seen.contradiction() < self.contradicted && self.confirmation(seen) > self.confirmed
    }
}

/// A pose that global registration proposes, and what the view says of it.
#[derive(Clone, Debug)]
pub(super) struct Proposal {
    pub(super) found: GlobalMatch,
    /// The seed that it was drawn with.
    pub(super) seed: u64,
    pub(super) seen: Visibility,
    /// Share of what the model shows that the view confirms.
    pub(super) confirmed: f64,
    /// Correlation of its picture with those of the views before it; `None` where they have too little in common.
    pub(super) alike: Option<f64>,
}

/// Pictures that a view is compared with.
#[derive(Clone, Copy)]
pub(super) struct Pictures<'a> {
    /// The view's own; `None` where it shows too little.
    pub(super) own: Option<&'a ViewTexture>,
    /// Surfaces and pictures of views whose poses are known.
    pub(super) known: &'a [(&'a ModelView, &'a ViewTexture)],
}

impl Pictures<'_> {
    /// Correlation with the view's picture, taken from `table_from_camera`; surfaces up to `distance` metres apart are the
    /// same.
    fn alike(&self, table_from_camera: &Isometry3<f64>, distance: f32) -> Option<f64> {
        let own = self.own?;
        // A proposed pose is good to a few millimetres: fine detail would not meet.
        let gate = PhotometricGate { level: LEVELS - 1, distance, tukey: f32::INFINITY };
        let all = self.known.iter().map(|(surface, texture)| {
            let target_from_source = surface.table_from_camera.inverse() * table_from_camera;
            compare(&own.points, texture, surface, &target_from_source, &gate)
        });
        all.fold(Alikeness::default(), Alikeness::and).correlation(FEWEST_COMPARED)
    }
}

/// Finds `source`, the points of `input` (camera frame) that `selection` agrees to, among those points of `model`. The covariance is that of the pose relative to the model.
///
/// # Errors
/// [`RegisterError::NotFound`]; [`RegisterError::Unlike`] where the pictures differ; [`RegisterError::Contradicted`] where the view would have seen through the model;
/// [`RegisterError::Ambiguous`] where two poses are nearly as good.
pub(super) fn find(
    source: &SourcePoints,
    input: &RegistrationInput<'_>,
    model: &dyn ModelSurface,
    selection: Selection,
    pictures: Pictures<'_>,
    config: &GlobalConfig,
) -> Result<(Prior, Proposal), RegisterError> {
    let wanted = &|class| selection.wants(class);
    let limits = if selection == Selection::Everything { SCENE } else { OBJECT };
    let target = model.points(wanted);
    let source_input = CloudInput { points: &source.points, facing: Facing::Normals(&source.normals) };
    let target_input = CloudInput { points: &target.points, facing: Facing::Normals(&target.normals) };
    let centre = source.centroid().unwrap_or_else(Point3::origin);
    let camera = &input.cloud.intrinsics;
    let coarse = camera.scaled((camera.footprint(centre.z) / (PIXEL * model.spacing())).min(1.0));
    let tolerance = (TOLERANCE * model.spacing()) as f32;
    let look = |found: GlobalMatch, seed: u64| {
        let shown = model.view(&coarse, &found.target_from_source);
        let seen = Visibility::of(input, &shown, wanted, tolerance);
        let alike = pictures.alike(&found.target_from_source, 2.0 * tolerance);
        Proposal { confirmed: limits.confirmation(&seen), alike, seen, found, seed }
    };
    let mut chosen = Err(RegisterError::NoEvidence);
    let mut voxel = config.voxel;
    // Where no pose holds, the right one may not have been drawn, or not show on that grid.
    for (seed, scale) in (config.seed..).zip(GRIDS) {
        let settings = GlobalConfig { seed, voxel: voxel.map(|voxel| voxel * scale), ..*config };
        let proposed = match (propose(&source_input, &target_input, &settings), &chosen) {
            (Ok(proposed), _) => proposed,
            (Err(_), Err(RegisterError::Contradicted { .. } | RegisterError::Unlike { .. })) => break,
            (Err(error), _) => return Err(error.into()),
        };
        voxel = voxel.or(proposed.first().map(|p| p.voxel));
        chosen = choose(proposed.into_iter().map(|found| look(found, seed)).collect(), limits);
        if !matches!(chosen, Err(RegisterError::Contradicted { .. } | RegisterError::Unlike { .. })) {
            break;
        }
    }
    let chosen = chosen?;
    let covariance = covariance_about(&centre, source.radius(&centre), chosen.found.voxel);
    Ok((Prior { table_from_camera: chosen.found.target_from_source, covariance }, chosen))
}

/// The one proposal (the one with the largest overlap first) that holds.
fn choose(proposals: Vec<Proposal>, limits: AcceptanceLimits) -> Result<Proposal, RegisterError> {
    let per_cent = |share: f64| share * 100.0;
    let (overlap, contradicted) =
        proposals.first().map_or((0.0, 0.0), |p| (per_cent(p.found.overlap), per_cent(p.seen.contradiction())));
    let mut holding: Vec<Proposal> = proposals.into_iter().filter(|p| limits.accept(&p.seen)).collect();
    let unlike = holding.iter().filter_map(|p| p.alike).fold(f64::NEG_INFINITY, f64::max);
    let held = !holding.is_empty();
    holding.retain(|p| p.alike.is_none_or(|alike| alike > UNLIKE));
    if held && holding.is_empty() {
        return Err(RegisterError::Unlike { correlation: unlike });
    }
    holding.sort_by(|a, b| b.confirmed.total_cmp(&a.confirmed));
    let most = holding.first().ok_or(RegisterError::Contradicted { overlap, contradicted })?.confirmed;
    // Of those that the surface confirms about as much, the picture chooses, if it is clear.
    holding.retain(|p| p.confirmed > RIVAL * most);
    holding.sort_by(|a, b| b.alike.unwrap_or(UNLIKE).total_cmp(&a.alike.unwrap_or(UNLIKE)));
    let next = holding.get(1).map(|next| (next.confirmed, next.alike));
    let best = holding.swap_remove(0);
    match next {
        None => Ok(best),
        Some((_, Some(other))) if best.alike.is_some_and(|alike| alike > other + MORE_ALIKE) => Ok(best),
        Some((confirmed, _)) => {
            Err(RegisterError::Ambiguous { best: per_cent(best.confirmed), next: per_cent(confirmed) })
        }
    }
}

/// Covariance of a camera's pose that puts an object at `centre` (camera frame), `radius` metres in size, to `sigma`
/// metres: its middle in each direction, and its outside by a turn about each axis.
fn covariance_about(centre: &Point3<f64>, radius: f64, sigma: f64) -> Matrix6<f64> {
    let at_object = covariance_of_prior(sigma / radius.max(sigma), sigma);
    // The object's centre as the camera sees it: a turn about the one also shifts the other.
    let carry = about(&Point3::from(-centre.coords));
    carry * at_object * carry.transpose()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_covariance_is_that_of_the_object_not_of_the_camera() {
        let centre = Point3::new(0.1, -0.05, 0.6);
        let covariance = covariance_about(&centre, 0.06, 0.003);
        let at_object = about(&centre) * covariance * about(&centre).transpose();
        assert!((at_object - covariance_of_prior(0.05, 0.003)).norm() < 1e-12, "{at_object}");
        // 0.6 m away, a turn of the object moves the camera by ten times what it moves the object's outside.
        assert!(covariance[(3, 3)].sqrt() > 0.03);
    }

    fn proposal(overlap: f64, confirmed: u32, contradicted: u32) -> Proposal {
        let found = GlobalMatch {
            target_from_source: Isometry3::identity(),
            overlap,
            runner_up: 0.0,
            support: 100,
            unconstrained: 0,
            rmse: 1e-4,
            voxel: 3e-3,
        };
        let hidden = 100 - confirmed - contradicted;
        let seen = Visibility { confirmed, contradicted, hidden, unmeasured: 0 };
        Proposal { confirmed: OBJECT.confirmation(&seen), alike: None, seen, found, seed: 1 }
    }

    #[test]
    fn the_picture_decides_between_poses_that_the_surface_confirms_alike() {
        let with = |alike, overlap| Proposal { alike, ..proposal(overlap, 90, 1) };
        let chosen = choose(vec![with(Some(0.05), 0.9), with(Some(0.6), 0.8)], OBJECT).expect("one is alike");
        assert_eq!(chosen.found.overlap, 0.8);
        let both = choose(vec![with(Some(0.5), 0.9), with(Some(0.6), 0.8)], OBJECT);
        assert!(matches!(both, Err(RegisterError::Ambiguous { .. })), "{both:?}");
        // What could not be compared is no worse than what could.
        let one = choose(vec![with(None, 0.9), with(Some(0.6), 0.8)], OBJECT);
        assert!(matches!(one, Err(RegisterError::Ambiguous { .. })), "{one:?}");
        let none = choose(vec![with(Some(-0.3), 0.9)], OBJECT);
        assert!(matches!(none, Err(RegisterError::Unlike { .. })), "{none:?}");
    }

    #[test]
    fn the_pose_that_the_view_confirms_is_taken_whatever_overlaps_more() {
        let chosen = choose(vec![proposal(0.9, 70, 20), proposal(0.5, 90, 1)], OBJECT).expect("one holds");
        assert_eq!(chosen.found.overlap, 0.5);
    }

    #[test]
    fn no_guess_is_made() {
        let none = choose(vec![proposal(0.9, 80, 10), proposal(0.8, 60, 0)], OBJECT);
        assert!(matches!(none, Err(RegisterError::Contradicted { overlap, .. }) if overlap == 90.0), "{none:?}");
        let two = choose(vec![proposal(0.9, 88, 1), proposal(0.5, 90, 1)], OBJECT);
        assert!(matches!(two, Err(RegisterError::Ambiguous { .. })), "{two:?}");
    }
}
