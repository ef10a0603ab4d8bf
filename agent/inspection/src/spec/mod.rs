//! What an inspection is run with: one plain value, which the command line, `cell.toml` and programs all produce.
//!
//! Every field has a default, so that an empty document is a specification; unknown fields are refused, so that a typing
//! mistake is noticed.

mod network;
mod plan;
mod region;
mod turntable;

pub use network::NetworkSpec;
pub use plan::{PlanSpec, ReachSpec, TargetSpec};
pub use region::{Corners, DepthRange, RegionSpec};
pub use semascan_model::LengthUnit;
pub use semascan_model::record::{LabelSource, PlanStrategy};
pub use turntable::TurntableSpec;

use semascan_perception::fuse::{AssociationTest, OutlierFilter};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::time::Duration;

/// Share of the views that must become part of the model, if nothing is said.
const LEAST_VIEWS: f64 = 0.5;

/// What an inspection is run with.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct InspectionSpec {
    /// What is inspected, and at which resolution.
    pub source: SourceSpec,
    /// Whether it is a recording of a turntable before a fixed camera: `auto`, `none`, `estimate`, `step=DEG`,
    /// `axis=X,Y,Z,NX,NY,NZ` (camera frame, metres).
    pub turntable: TurntableSpec,
    /// Which of a view's pixels are inspected.
    pub region: RegionSpec,
    /// Smallest share of the views that must become part of the model, 0 to 1; half of them if absent. An inspection with
    /// fewer is kept, but did not succeed.
    pub least_views: Option<f64>,
    /// Whether a view that is left out makes the inspection a failure.
    pub strict: bool,
    /// Where labels come from.
    pub labels: LabelSource,
    /// The networks, with `labels = "network"`.
    pub network: NetworkSpec,
    /// What is done to the pictures before they are labelled.
    pub preparation: PreparationSpec,
    /// Whether masks are fitted to the geometry of a view.
    pub masks: MaskRefinement,
    /// How objects of a view are found among those of the model.
    pub association: ObjectAssociation,
    /// How views get their poses.
    pub registration: RegistrationMethod,
    /// When a point of the model is an outlier.
    pub outliers: OutlierFilter,
    /// Where views are taken from, where the source can be steered.
    pub plan: PlanSpec,
}

/// What is inspected.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SourceSpec {
    /// URI or path of the source: `virtual:starter-motor?seed=7`, a BOP scene folder ...
    pub uri: Option<String>,
    /// Pixels that show the robot itself: `auto`, `none` or a PNG (nonzero = ignored).
    pub camera_mask: CameraMask,
    /// Unit of recorded lengths (a BOP scene's translations); by default that of the format, checked against the depth.
    pub unit: Option<LengthUnit>,
    /// Millimetres of a recorded depth of 1; by default what the recording says.
    pub depth_scale_mm: Option<f64>,
    /// Take only every so many frames of a recording in a folder, from the first on; all if absent.
    pub every: Option<u32>,
    /// Focal lengths and principal point of a recording's colour camera in pixels (fx, fy, cx, cy), where it does not say them.
    pub intrinsics: Option<[f64; 4]>,
    /// Voxel edge in millimetres; by default twice the median pixel footprint of the first view, at least 0.5.
    pub voxel_mm: Option<f64>,
    /// Inspect only the views of a moving camera that show something new (keyframes); the rest is counted.
    pub keyframes: bool,
    /// Follow a handheld camera from frame to frame (30 a second) by what it sees, whatever poses the source says; its keyframes
    /// are inspected, the rest is counted.
    pub track: bool,
    /// Least time between two captures in seconds, so that people can watch.
    pub pace_s: f64,
}

impl SourceSpec {
    /// Whether some views of the source are not inspected though nothing is wrong with them.
    pub fn leaves_out(&self) -> bool {
        self.keyframes || self.track
    }
}

/// What is known to show the robot itself in every view.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "String", into = "String")]
pub enum CameraMask {
    /// Found from the views.
    #[default]
    Auto,
    /// Nothing.
    None,
    /// A PNG of the pictures' size; pixels other than 0 are ignored.
    File(PathBuf),
}

/// What is done to the pictures before they are labelled.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PreparationSpec {
    /// Filter the pictures' noise, of the type and level that they have.
    pub denoise: bool,
    /// What is known not to be the part, and is not labelled.
    pub background: BackgroundMethod,
}

/// How the background of a picture is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BackgroundMethod {
    /// It is not looked for.
    #[default]
    Keep,
    /// Outside an active contour around the edges.
    Contour,
    /// Outside the cell's measuring volume.
    Volume,
}

/// Whether masks are fitted to the geometry of the view (fusion segmentation).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MaskRefinement {
    /// As they come.
    #[default]
    AsIs,
    /// To superpixels of the picture.
    Slic,
    /// To convex patches of one colour.
    Lcccp,
}

/// How objects of a view are found among those of the model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ObjectAssociation {
    /// Views number them alike already.
    #[default]
    None,
    /// By common surface.
    Overlap,
    /// By the nearest gravity centre.
    GravityCentre,
}

/// How views get their poses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RegistrationMethod {
    /// ICP on the object's points where a turntable moves it, on all points where everything stands still.
    #[default]
    Auto,
    /// The robot's and turntable's readings alone.
    Kinematic,
    /// ICP on all points.
    Icp,
    /// ICP on the points that carry a component label.
    SegmentIcp,
}

/// A field of a specification that cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{field}: {reason}")]
pub struct SpecError {
    /// The field, as a path of keys.
    pub field: String,
    /// What is wrong with it.
    pub reason: String,
}

impl InspectionSpec {
    /// The voxel edge in metres; `None` if the first view decides.
    ///
    /// # Errors
    /// [`SpecError`] if it is no length.
    pub fn voxel(&self) -> Result<Option<f64>, SpecError> {
        match self.source.voxel_mm {
            Some(mm) if !(mm.is_finite() && mm > 0.0) => {
                Err(SpecError { field: "voxel".into(), reason: format!("{mm} is not a length in millimetres") })
            }
            mm => Ok(mm.map(|mm| mm * 1e-3)),
        }
    }

    /// The smallest share of the views that must become part of the model.
    ///
    /// # Errors
    /// [`SpecError`] if it is no share.
    pub fn least_share(&self) -> Result<f64, SpecError> {
        let share = self.least_views.unwrap_or(LEAST_VIEWS);
        if (0.0..=1.0).contains(&share) {
            return Ok(share);
        }
        Err(SpecError { field: "least_views".into(), reason: format!("{share} is no share: 0 to 1") })
    }

    /// Checks the largest standard uncertainties.
    ///
    /// # Errors
    /// [`SpecError`] naming the field that is no number between 0 and 1.
    pub fn check_thresholds(&self) -> Result<(), SpecError> {
        let limits = [("threshold", self.network.threshold), ("defect_threshold", self.network.defect_threshold)];
        for (field, value) in limits.into_iter().filter_map(|(field, value)| Some((field, value?))) {
            if !(0.0..=1.0).contains(&value) {
                let reason = format!("{value} is no standard uncertainty: 0 to 1");
                return Err(SpecError { field: format!("network.{field}"), reason });
            }
        }
        Ok(())
    }

    /// The millimetres of a recorded depth of 1, if they are said.
    ///
    /// # Errors
    /// [`SpecError`] if they are no length.
    pub fn depth_scale(&self) -> Result<Option<f64>, SpecError> {
        match self.source.depth_scale_mm {
            Some(mm) if !(mm.is_finite() && mm > 0.0) => Err(SpecError {
                field: "depth_scale_mm".into(),
                reason: format!("{mm} is not a length in millimetres"),
            }),
            mm => Ok(mm),
        }
    }

    /// The least time between two captures.
    ///
    /// # Errors
    /// [`SpecError`] if it is no duration.
    pub fn pace(&self) -> Result<Duration, SpecError> {
        let seconds = self.source.pace_s;
        Duration::try_from_secs_f64(seconds)
            .map_err(|e| SpecError { field: "pace".into(), reason: format!("{seconds} seconds: {e}") })
    }

    /// How objects of a view are found in the model; `None` where views number them alike.
    pub fn association_test(&self) -> Option<AssociationTest> {
        match self.association {
            ObjectAssociation::None => None,
            ObjectAssociation::Overlap => Some(AssociationTest::Overlap(Default::default())),
            ObjectAssociation::GravityCentre => Some(AssociationTest::GravityCentre(Default::default())),
        }
    }
}

impl From<String> for CameraMask {
    fn from(text: String) -> Self {
        match text.as_str() {
            "auto" => Self::Auto,
            "none" => Self::None,
            _ => Self::File(PathBuf::from(text)),
        }
    }
}

impl From<CameraMask> for String {
    fn from(mask: CameraMask) -> Self {
        match mask {
            CameraMask::Auto => "auto".into(),
            CameraMask::None => "none".into(),
            CameraMask::File(path) => path.display().to_string(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_empty_document_is_a_specification_and_comes_back_from_its_own() {
        let spec: InspectionSpec = toml::from_str("").expect("everything has a default");
        assert_eq!(spec, InspectionSpec::default());
        let text = toml::to_string(&spec).expect("plain data");
        assert_eq!(toml::from_str::<InspectionSpec>(&text).expect("its own"), spec, "{text}");
    }

    #[test]
    fn every_field_is_read_and_an_unknown_one_is_named() {
        let text = "labels = \"network\"\nmasks = \"lcccp\"\nassociation = \"gravity-centre\"\nturntable = \"step=15\"\n\
            registration = \"segment-icp\"\nleast_views = 0.8\n[region]\ndepth = \"0.2..1.5\"\n\
            box = [-0.1, -0.1, 0.0, 0.1, 0.1, 0.2]\nlabelled = true\nfootprint_voxels = 3\n[source]\nuri = \"scene\"\ncamera_mask = \"gripper.png\"\nvoxel_mm = 1.5\n\
            keyframes = true\ntrack = true\nunit = \"cm\"\ndepth_scale_mm = 0.25\npace_s = 0.5\n[preparation]\ndenoise = true\nbackground = \"volume\"\n\
            [outliers]\nmin_neighbours = 4\n[network]\nmodels = [\"ud-net-edge\"]\nthreshold = 0.3\n";
        let spec: InspectionSpec = toml::from_str(text).expect("right");
        assert_eq!(spec.source.camera_mask, CameraMask::File("gripper.png".into()));
        assert!(spec.source.track && spec.source.leaves_out());
        assert_eq!(spec.voxel(), Ok(Some(1.5e-3)));
        assert_eq!(spec.pace(), Ok(Duration::from_millis(500)));
        assert_eq!((spec.outliers.min_neighbours, spec.outliers.radius), (4, OutlierFilter::default().radius));
        assert!(spec.association_test().is_some());
        assert_eq!(spec.turntable, TurntableSpec::Known { axis: None, step: Some(15.0) });
        assert_eq!((spec.least_share(), spec.depth_scale()), (Ok(0.8), Ok(Some(0.25))));
        assert_eq!(spec.source.unit.map(LengthUnit::in_metres), Some(0.01));
        assert!(spec.region.labelled && spec.region.depth == Some(DepthRange { min: 0.2, max: 1.5 }));
        assert_eq!(
            spec.region.corners().map(|c| c.map(|(low, high)| high - low)).map(|d| d.map(|d| d.z)),
            Ok(Some(0.2))
        );
        for (wrong, word) in [
            ("lables = \"none\"", "lables"),
            ("[source]\nurl = 1", "url"),
            ("masks = 3", "masks"),
            ("[region]\ndepht = \"1..2\"", "depht"),
            ("[region]\ndepth = \"2..1\"", "2..1"),
        ] {
            let error = toml::from_str::<InspectionSpec>(wrong).expect_err(word).to_string();
            assert!(error.contains(word), "{error}");
        }
    }

    #[test]
    fn what_is_no_length_or_duration_is_refused_by_name() {
        let spec = |voxel_mm, pace_s| InspectionSpec {
            source: SourceSpec { voxel_mm, pace_s, ..SourceSpec::default() },
            ..InspectionSpec::default()
        };
        assert_eq!(spec(Some(-1.0), 0.0).voxel().expect_err("negative").field, "voxel");
        assert_eq!(spec(Some(f64::NAN), 0.0).voxel().expect_err("no number").field, "voxel");
        assert_eq!(spec(None, -1.0).pace().expect_err("negative").field, "pace");
    }
}
