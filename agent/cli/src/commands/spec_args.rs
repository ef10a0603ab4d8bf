//! Arguments of every command that inspects, to an [`InspectionSpec`].

use super::numbers;
use super::plan_args::PlanArgs;
use clap::{Args, ValueEnum};
use semascan_inspection::spec::{
    BackgroundMethod, CameraMask, DepthRange, InspectionSpec, LabelSource, LengthUnit, MaskRefinement,
    ObjectAssociation, RegistrationMethod, TurntableSpec,
};
use semascan_perception::fuse::Uncertain;

/// What an inspection is run with, as the command line says it; what is not said is as `cell.toml` or the default has it.
#[derive(Clone, Debug, Default, Args)]
pub(crate) struct SpecArgs {
    /// Where labels come from [default: source]
    #[arg(long, value_enum)]
    labels: Option<LabelsArg>,
    /// Pixels that show the robot: a PNG (nonzero = ignore), `auto` to find them, or `none` [default: auto]
    #[arg(long, value_name = "PNG")]
    camera_mask: Option<String>,
    /// Unit of the source's lengths [default: of a BOP scene's translations millimetres, checked against the depth; of PCD
    /// files and meshes assumed from their size, and said]
    #[arg(long, value_enum)]
    unit: Option<UnitArg>,
    /// Millimetres of a depth of 1 in a recording [default: what the recording says]
    #[arg(long, value_name = "MM", value_parser = numbers::length::<f64>, allow_negative_numbers = true)]
    depth_scale: Option<f64>,
    /// Only every Nth frame of a recording in a folder [default: 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    every: Option<u32>,
    /// Camera of a recording that does not say it: focal lengths and principal point in pixels [default: what the recording
    /// says, or what is known of its data set]
    #[arg(long, value_name = "FX,FY,CX,CY", value_parser = intrinsics, allow_hyphen_values = true)]
    intrinsics: Option<Pinhole>,
    /// Whether it is a recording of a turntable before a fixed camera: `none`, `estimate`, or what is known, `step=DEG`
    /// (degrees between two views) and `axis=X,Y,Z,NX,NY,NZ` (camera frame, metres) with a comma between [default: auto: a
    /// recording without poses before a background that stands still is one]
    #[arg(long, value_name = "WHAT", allow_hyphen_values = true)]
    turntable: Option<TurntableSpec>,
    /// Inspect only these depths along the optical axis, in metres: 0.2..1.5, ..1.5 or 0.2..
    #[arg(long, value_name = "MIN..MAX", allow_hyphen_values = true)]
    depth: Option<DepthRange>,
    /// Inspect only this box in the table frame, in metres
    #[arg(long = "box", value_name = "X0,Y0,Z0,X1,Y1,Z1", value_parser = corners, allow_hyphen_values = true)]
    bounds: Option<Corners>,
    /// Inspect only these pixels
    #[arg(long, value_enum)]
    roi: Option<RoiArg>,
    /// Smallest share of the views that must become part of the model, 0 to 1; with fewer the exit code is 1 [default: 0.5]
    #[arg(long, value_name = "SHARE", value_parser = numbers::share::<f64>, allow_negative_numbers = true)]
    least_views: Option<f64>,
    /// A view that is left out is a failure: the record says `failed`, and the exit code is 1. What there is of the model is
    /// written all the same
    #[arg(long)]
    strict: bool,
    /// Models for `--labels network`: names, folders of models, or folders with models, separated by commas; by default
    /// the best of each task that is installed
    #[arg(long, value_name = "NAME|DIR", value_delimiter = ',')]
    models: Vec<String>,
    /// Largest standard uncertainty of a component label, 0 to 1 [default: 0.16]
    #[arg(long, value_name = "T", value_parser = numbers::threshold, allow_negative_numbers = true)]
    sigma: Option<f32>,
    /// What becomes of pixels beyond it [default: geometry]
    #[arg(long, value_enum)]
    uncertain: Option<UncertainArg>,
    /// Filter the pictures' noise, of the type and level that they have
    #[arg(long)]
    denoise: bool,
    /// What is known not to be the part, and is not labelled [default: keep]
    #[arg(long, value_enum)]
    background: Option<BackgroundArg>,
    /// How views get their poses [default: auto]
    #[arg(long, value_enum)]
    registration: Option<RegistrationArg>,
    /// Whether masks are fitted to the geometry of the view [default: as-is]
    #[arg(long, value_enum)]
    masks: Option<MasksArg>,
    /// How objects of a view are found among those of the model [default: none]
    #[arg(long, value_enum)]
    association: Option<AssociationArg>,
    /// Voxel edge in millimetres; by default twice the median pixel footprint, at least 0.5
    #[arg(long, value_name = "MM", value_parser = numbers::length::<f64>, allow_negative_numbers = true)]
    voxel: Option<f64>,
    /// Inspect only the views of a moving camera that show something new (keyframes)
    #[arg(long)]
    keyframes: bool,
    /// Follow a handheld camera from frame to frame by what it sees; its keyframes are inspected
    #[arg(long)]
    track: bool,
    /// Least time between two captures in seconds [default: 0]
    #[arg(long, value_name = "SECONDS", value_parser = numbers::pause, allow_negative_numbers = true)]
    pace: Option<f64>,
    #[command(flatten)]
    plan: PlanArgs,
}

/// Where labels come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum LabelsArg {
    /// Recorded masks or simulated truth that come with the views
    Source,
    /// Trained networks
    Network,
    /// Geometry only
    None,
}

/// Two corners of a box: x, y, z of one, then of the other. (An array alone would be several arguments.)
#[derive(Clone, Copy, Debug, PartialEq)]
struct Corners([f64; 6]);

/// Reads six numbers with commas.
fn corners(text: &str) -> Result<Corners, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|n| n.trim().parse::<f64>()).collect();
    let numbers = numbers.map_err(|e| e.to_string())?;
    let corners = numbers.as_slice().try_into().map_err(|_| format!("{} numbers in place of 6", numbers.len()))?;
    Ok(Corners(corners))
}

/// Focal lengths and principal point of a camera in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Pinhole([f64; 4]);

/// Reads four numbers with commas.
fn intrinsics(text: &str) -> Result<Pinhole, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|n| n.trim().parse::<f64>()).collect();
    let numbers = numbers.map_err(|e| e.to_string())?;
    let pinhole: [f64; 4] =
        numbers.as_slice().try_into().map_err(|_| format!("{} numbers in place of 4", numbers.len()))?;
    let [fx, fy, cx, cy] = pinhole;
    if !([fx, fy].iter().all(|f| f.is_finite() && *f > 0.0) && cx.is_finite() && cy.is_finite()) {
        return Err("not the focal lengths and the principal point of a camera".into());
    }
    Ok(Pinhole(pinhole))
}

/// A unit of length.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum UnitArg {
    /// Millimetres
    Mm,
    /// Centimetres
    Cm,
    /// Metres
    M,
    /// Inches
    Inch,
}

/// Which pixels are inspected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum RoiArg {
    /// Those that carry a component label
    Labelled,
}

/// What becomes of uncertain pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum UncertainArg {
    /// They add geometry, but no evidence for a class
    Geometry,
    /// They are dropped
    Drop,
}

/// Whether masks are fitted to the geometry of the view (fusion segmentation).
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum MasksArg {
    /// As they come
    AsIs,
    /// To superpixels of the picture
    Slic,
    /// To convex patches of one colour
    Lcccp,
}

/// How the background of a picture is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum BackgroundArg {
    /// It is not looked for
    Keep,
    /// Outside an active contour around the edges
    Contour,
    /// Outside the cell's measuring volume
    Volume,
}

/// How objects of a view are found among those of the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum AssociationArg {
    /// Views number them alike already
    None,
    /// By common surface
    Overlap,
    /// By the nearest gravity centre
    GravityCentre,
}

/// How views get their poses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum RegistrationArg {
    /// ICP on the object's points where a turntable moves it, on all points where everything stands still
    Auto,
    /// The robot's and turntable's readings alone
    Kinematic,
    /// ICP on all points
    Icp,
    /// ICP on the points that carry a component label
    SegmentIcp,
}

impl SpecArgs {
    /// The specification `spec` with what the command line says.
    pub(crate) fn apply(self, mut spec: InspectionSpec) -> InspectionSpec {
        fn set<T>(place: &mut T, value: Option<impl Into<T>>) {
            if let Some(value) = value {
                *place = value.into();
            }
        }
        set(&mut spec.labels, self.labels);
        set(&mut spec.source.camera_mask, self.camera_mask.map(CameraMask::from));
        spec.source.unit = self.unit.map(Into::into).or(spec.source.unit);
        spec.source.depth_scale_mm = self.depth_scale.or(spec.source.depth_scale_mm);
        spec.source.every = self.every.or(spec.source.every);
        spec.source.intrinsics = self.intrinsics.map(|Pinhole(numbers)| numbers).or(spec.source.intrinsics);
        set(&mut spec.turntable, self.turntable);
        spec.region.depth = self.depth.or(spec.region.depth);
        spec.region.bounds = self.bounds.map(|Corners(corners)| corners).or(spec.region.bounds);
        spec.region.labelled |= self.roi == Some(RoiArg::Labelled);
        spec.least_views = self.least_views.or(spec.least_views);
        spec.strict |= self.strict;
        if !self.models.is_empty() {
            spec.network.models = self.models;
        }
        spec.network.threshold = self.sigma.or(spec.network.threshold);
        set(&mut spec.network.uncertain, self.uncertain);
        spec.preparation.denoise |= self.denoise;
        set(&mut spec.preparation.background, self.background);
        set(&mut spec.registration, self.registration);
        set(&mut spec.masks, self.masks);
        set(&mut spec.association, self.association);
        spec.source.voxel_mm = self.voxel.or(spec.source.voxel_mm);
        spec.source.keyframes |= self.keyframes;
        spec.source.track |= self.track;
        set(&mut spec.source.pace_s, self.pace);
        self.plan.apply(&mut spec.plan);
        spec
    }
}

impl From<LabelsArg> for LabelSource {
    fn from(arg: LabelsArg) -> Self {
        match arg {
            LabelsArg::Source => Self::Source,
            LabelsArg::Network => Self::Network,
            LabelsArg::None => Self::None,
        }
    }
}

impl From<UnitArg> for LengthUnit {
    fn from(arg: UnitArg) -> Self {
        match arg {
            UnitArg::Mm => Self::Millimetres,
            UnitArg::Cm => Self::Centimetres,
            UnitArg::M => Self::Metres,
            UnitArg::Inch => Self::Inches,
        }
    }
}

impl From<UncertainArg> for Uncertain {
    fn from(arg: UncertainArg) -> Self {
        match arg {
            UncertainArg::Geometry => Self::Geometry,
            UncertainArg::Drop => Self::Drop,
        }
    }
}

impl From<MasksArg> for MaskRefinement {
    fn from(arg: MasksArg) -> Self {
        match arg {
            MasksArg::AsIs => Self::AsIs,
            MasksArg::Slic => Self::Slic,
            MasksArg::Lcccp => Self::Lcccp,
        }
    }
}

impl From<BackgroundArg> for BackgroundMethod {
    fn from(arg: BackgroundArg) -> Self {
        match arg {
            BackgroundArg::Keep => Self::Keep,
            BackgroundArg::Contour => Self::Contour,
            BackgroundArg::Volume => Self::Volume,
        }
    }
}

impl From<AssociationArg> for ObjectAssociation {
    fn from(arg: AssociationArg) -> Self {
        match arg {
            AssociationArg::None => Self::None,
            AssociationArg::Overlap => Self::Overlap,
            AssociationArg::GravityCentre => Self::GravityCentre,
        }
    }
}

impl From<RegistrationArg> for RegistrationMethod {
    fn from(arg: RegistrationArg) -> Self {
        match arg {
            RegistrationArg::Auto => Self::Auto,
            RegistrationArg::Kinematic => Self::Kinematic,
            RegistrationArg::Icp => Self::Icp,
            RegistrationArg::SegmentIcp => Self::SegmentIcp,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;
    use semascan_inspection::spec::PlanStrategy;

    #[derive(Parser)]
    struct Command {
        #[command(flatten)]
        args: SpecArgs,
    }

    fn apply(line: &str, spec: InspectionSpec) -> InspectionSpec {
        let words = std::iter::once("semascan").chain(line.split_whitespace());
        Command::try_parse_from(words).expect("a right call").args.apply(spec)
    }

    #[test]
    fn what_is_not_said_stays_and_what_is_said_wins() {
        let mut spec = InspectionSpec { labels: LabelSource::Network, ..InspectionSpec::default() };
        spec.source.voxel_mm = Some(2.0);
        spec.source.keyframes = true;
        assert_eq!(apply("", spec.clone()), spec);
        let changed = apply("--labels none --voxel 1 --sigma 0.3 --camera-mask m.png --pace 0.5", spec.clone());
        assert_eq!((changed.labels, changed.source.voxel_mm), (LabelSource::None, Some(1.0)));
        assert_eq!(changed.network.threshold, Some(0.3));
        assert_eq!(changed.source.camera_mask, CameraMask::File("m.png".into()));
        assert!(changed.source.keyframes && changed.source.pace_s == 0.5);
        let changed = apply("--unit m --depth 0.2..2 --box -1,-1,0,1,1,0.5 --roi labelled --least-views 0.9", spec);
        assert_eq!((changed.source.unit, changed.least_views), (Some(LengthUnit::Metres), Some(0.9)));
        assert_eq!(changed.region.depth, Some(DepthRange { min: 0.2, max: 2.0 }));
        assert_eq!(changed.region.bounds, Some([-1.0, -1.0, 0.0, 1.0, 1.0, 0.5]));
        assert!(changed.region.labelled);
        let planned = apply("--plan next-best --views 9 --refine --least-gain 0.02", InspectionSpec::default()).plan;
        assert_eq!((planned.strategy, planned.views), (Some(PlanStrategy::NextBest), 9));
        assert!(planned.refine && planned.least_gain == 0.02);
        let turning = apply("--turntable axis=0,0.1,0.6,0,-0.7,-0.7,step=-15", InspectionSpec::default());
        assert_eq!(turning.turntable.to_string(), "axis=0,0.1,0.6,0,-0.7,-0.7,step=-15");
        let wrong = [
            "--box 1,2,3",
            "--depth 2..1",
            "--depth 1",
            "--depth -1..1",
            "--unit feet",
            "--turntable yes",
            "--sigma nan",
            "--sigma 2",
            "--sigma -1",
            "--least-views inf",
            "--voxel 0",
            "--pace -1",
            "--plan best",
            "--depth-scale nan",
            "--every 0",
            "--intrinsics 1,2,3",
            "--intrinsics 0,1,2,3",
        ];
        for line in wrong {
            let words = std::iter::once("semascan").chain(line.split_whitespace());
            let Err(error) = Command::try_parse_from(words) else { panic!("{line}") };
            // The message names the argument.
            let name = line.split_whitespace().next().expect("a name");
            assert!(error.to_string().contains(&format!("'{name} <")), "{line}: {error}");
        }
    }
}
