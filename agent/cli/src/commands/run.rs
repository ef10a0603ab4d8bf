//! One inspection, as every command runs it.

use super::Failure;
use super::config::CellConfig;
use super::network::NetworkArgs;
use super::source::open;
use anyhow::{Context, anyhow};
use clap::{Args, ValueEnum};
use semascan_evaluation::judge_inspection;
use semascan_inspection::pipeline;
use semascan_inspection::pipeline::{InspectionSink, PipelineConfig, Stage, StageStatus, ViewOutcome};
use semascan_inspection::record::{InspectionRecord, Recorder, SegmentationRecord};
use semascan_inspection::source::{KeyframeRule, Keyframes, Source, SourceInfo, WithTaxonomy};
use semascan_model::SemanticCloud;
use semascan_perception::fuse::{AssociationTest, SemanticMap};
use semascan_perception::register::{
    IcpConfig, IcpRegistrar, JointRefinement, KinematicRegistrar, Registrar, Selection,
};
use semascan_perception::segment::geometric::PatchMethod;
use semascan_perception::segment::preparation::contour::Snake;
use semascan_perception::segment::preparation::{Background, Preparation, Prepared};
use semascan_perception::segment::{GeometricSegmenter, RecordedSegmenter, Segmenter};
use semascan_sources::bop::CameraMask;
use semascan_store::{write_inspection, write_view_clouds};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// Where labels come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Labels {
    /// Recorded masks or simulated truth that come with the views
    Source,
    /// Trained networks
    Network,
    /// Geometry only
    None,
}

/// Whether masks are fitted to the geometry of the view (fusion segmentation).
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Masks {
    /// As they come
    AsIs,
    /// To superpixels of the picture
    Slic,
    /// To convex patches of one colour
    Lcccp,
}

/// How the background of a picture is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum BackgroundArg {
    /// It is not looked for
    #[default]
    Keep,
    /// Outside an active contour around the edges of the picture
    Contour,
    /// Outside the cell's measuring volume
    Volume,
}

/// How objects of a view are found among those of the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Association {
    /// Views number them alike already
    None,
    /// By common surface
    Overlap,
    /// By the nearest gravity centre of the same class
    GravityCentre,
}

/// How views get their poses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Registration {
    /// ICP on the object's points where a turntable moves it, on all points where everything stands still
    Auto,
    /// The robot's and turntable's readings alone
    Kinematic,
    /// ICP on all points
    Icp,
    /// ICP on the points that carry a component label
    SegmentIcp,
}

/// What an inspection is run with.
#[derive(Clone, Debug, Args)]
pub(crate) struct InspectionArgs {
    /// Where labels come from
    #[arg(long, value_enum, default_value = "source")]
    pub(crate) labels: Labels,
    /// Pixels that show the robot: a PNG (nonzero = ignore), `auto` to find them, or `none`
    #[arg(long, value_name = "PNG", default_value = "auto")]
    pub(crate) camera_mask: String,
    #[command(flatten)]
    pub(crate) network: NetworkArgs,
    /// Filter the pictures' noise, of the type (Gaussian, impulses) and level that they have
    #[arg(long)]
    pub(crate) denoise: bool,
    /// What is known not to be the part, and is not labelled
    #[arg(long, value_enum, default_value = "keep")]
    pub(crate) background: BackgroundArg,
    /// How views get their poses
    #[arg(long, value_enum, default_value = "auto")]
    pub(crate) registration: Registration,
    /// Whether masks are fitted to the geometry of the view
    #[arg(long, value_enum, default_value = "as-is")]
    pub(crate) masks: Masks,
    /// How objects of a view are found among those of the model
    #[arg(long, value_enum, default_value = "none")]
    pub(crate) association: Association,
    /// Voxel edge in millimetres; by default twice the median pixel footprint, at least 0.5
    #[arg(long, value_name = "MM")]
    pub(crate) voxel: Option<f64>,
    /// Inspect only the views of a moving camera that show something new (keyframes)
    #[arg(long)]
    pub(crate) keyframes: bool,
    /// Least time between two captures in seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0)]
    pub(crate) pace: f64,
}

impl InspectionArgs {
    /// Takes what `cell.toml` says where the command line says nothing.
    pub(crate) fn configure(&mut self, config: &CellConfig) {
        self.voxel = self.voxel.or(config.source.voxel_mm);
        if let (Some(mask), "auto") = (&config.source.camera_mask, self.camera_mask.as_str()) {
            self.camera_mask.clone_from(mask);
        }
        self.network.section = config.network.clone();
    }

    /// Opens `uri` with the camera mask that was asked for; its keyframes only, if they were.
    pub(crate) fn open(&self, uri: &str) -> Result<Box<dyn Source>, Failure> {
        let mask = match self.camera_mask.as_str() {
            "auto" => CameraMask::Auto,
            "none" => CameraMask::None,
            file => CameraMask::File(PathBuf::from(file)),
        };
        let mut source = open(uri, &mask)?;
        if self.labels == Labels::Network {
            let taxonomy = self.network.taxonomy(&source.info().taxonomy, source.truth().is_some())?;
            source = Box::new(WithTaxonomy::new(source, taxonomy));
        }
        Ok(if self.keyframes { Box::new(Keyframes::new(source, KeyframeRule::default())) } else { source })
    }

    fn pipeline(&self) -> Result<PipelineConfig, Failure> {
        let voxel = match self.voxel {
            Some(mm) if !(mm.is_finite() && mm > 0.0) => {
                return Err(Failure::Call(anyhow!("--voxel {mm}: not a length in millimetres")));
            }
            mm => mm.map(|mm| mm * 1e-3),
        };
        let pace =
            Duration::try_from_secs_f64(self.pace).map_err(|e| Failure::Call(anyhow!("--pace {}: {e}", self.pace)))?;
        let association = match self.association {
            Association::None => None,
            Association::Overlap => Some(AssociationTest::Overlap(Default::default())),
            Association::GravityCentre => Some(AssociationTest::GravityCentre(Default::default())),
        };
        Ok(PipelineConfig { voxel, pace, association, uncertainty: self.network.rule(), ..PipelineConfig::default() })
    }

    fn registrar(&self, source: &dyn Source) -> Box<dyn Registrar> {
        let selection = match self.registration {
            Registration::Kinematic => return Box::new(KinematicRegistrar),
            Registration::Auto if source.info().turntable.is_some() => Selection::Object,
            Registration::SegmentIcp => Selection::Object,
            Registration::Auto | Registration::Icp => Selection::Everything,
        };
        Box::new(IcpRegistrar::new(IcpConfig::default(), selection))
    }

    /// What is done to the views of a source like `info` before they are labelled.
    fn preparation(&self, info: &SourceInfo) -> Result<Preparation, Failure> {
        let background = match self.background {
            BackgroundArg::Keep => Background::Kept,
            BackgroundArg::Contour => Background::Contour(Snake::default()),
            BackgroundArg::Volume => {
                let (low, high) = info.volume.ok_or_else(|| {
                    Failure::Call(anyhow!("--background volume: {} knows no measuring volume; use contour", info.uri))
                })?;
                Background::Volume(low, high)
            }
        };
        Ok(Preparation { denoise: self.denoise, background })
    }

    /// What labels the views of a source like `info`, and where that is networks, what the record says of them.
    fn segmenter(&self, info: &SourceInfo) -> Result<(Box<dyn Segmenter>, Option<SegmentationRecord>), Failure> {
        let recorded = |required| Box::new(RecordedSegmenter { required }) as Box<dyn Segmenter>;
        let (masks, record) = match self.labels {
            Labels::Source => (recorded(true), None),
            Labels::None => (recorded(false), None),
            Labels::Network => {
                let networks = self.network.segmenter(info)?;
                let uncertain = self.network.rule().uncertain;
                let record = SegmentationRecord { network: networks.report().clone(), uncertain };
                (Box::new(networks) as Box<dyn Segmenter>, Some(record))
            }
        };
        let preparation = self.preparation(info)?;
        let masks: Box<dyn Segmenter> =
            if preparation == Preparation::default() { masks } else { Box::new(Prepared::new(masks, preparation)) };
        let fitted: Box<dyn Segmenter> = match self.masks {
            Masks::AsIs => masks,
            Masks::Slic => Box::new(GeometricSegmenter::new(masks, PatchMethod::SLIC)),
            Masks::Lcccp => Box::new(GeometricSegmenter::new(masks, PatchMethod::LCCCP)),
        };
        Ok((fitted, record))
    }
}

/// A finished inspection.
#[derive(Debug)]
pub(crate) struct Done {
    pub(crate) record: InspectionRecord,
    pub(crate) cloud: SemanticCloud,
    map: Option<SemanticMap>,
}

/// Runs one inspection of `source` to its end and judges it; `id` is unique to the run.
pub(crate) fn run(
    source: &mut dyn Source,
    args: &InspectionArgs,
    id: &str,
    watcher: &dyn InspectionSink,
    stop: &AtomicBool,
) -> Result<Done, Failure> {
    let config = args.pipeline()?;
    let (mut segmenter, segmentation) = args.segmenter(source.info())?;
    let mut registrar = args.registrar(source);
    let recorder = Recorder::default();
    let sink = Both(watcher, &recorder);
    let inspected = pipeline::run(source, segmenter.as_mut(), registrar.as_mut(), &config, &sink, stop)?;
    if inspected.map.is_none() {
        let reasons = recorder.rejections();
        return Err(Failure::Work(anyhow!("no view could be used: {}", reasons.join("; "))));
    }
    let labels = args.labels.to_possible_value().map_or_else(String::new, |v| v.get_name().to_owned());
    let cloud = inspected.map.as_ref().map(SemanticMap::cloud).unwrap_or_default();
    let map = inspected.map.as_ref();
    let mut recorded = recorder.finish(id, source.info(), &labels, map, &cloud);
    let taxonomy = &source.info().taxonomy;
    recorded.record.truth =
        source.truth().map(|mesh| judge_inspection(&recorded, map, &cloud, taxonomy, mesh, &config.filter));
    let mut record = recorded.record;
    record.segmentation = segmentation;
    Ok(Done { record, cloud, map: inspected.map })
}

impl Done {
    /// Writes the inspection into `folder`.
    pub(crate) fn write(&self, folder: &Path, source: &dyn Source) -> Result<(), Failure> {
        write_inspection(folder, &self.record, &self.cloud, &source.info().taxonomy, source.truth())
            .context("the inspection could not be written")?;
        Ok(())
    }

    /// Writes each view that became part of the model as a semantic cloud of its own into `folder`.
    pub(crate) fn write_view_clouds(&self, folder: &Path, source: &dyn Source) -> Result<(), Failure> {
        if let Some(map) = &self.map {
            write_view_clouds(folder, map.kept_views(), &source.info().taxonomy)
                .context("the clouds of the views could not be written")?;
        }
        Ok(())
    }
}

/// Tells two sinks.
struct Both<'a>(&'a dyn InspectionSink, &'a dyn InspectionSink);

impl InspectionSink for Both<'_> {
    fn stage(&self, view: u32, stage: Stage, status: &StageStatus) {
        self.0.stage(view, stage, status);
        self.1.stage(view, stage, status);
    }

    fn map_changed(&self, map: &SemanticMap, touched: &[semascan_perception::fuse::TouchedChunk], last: bool) {
        self.0.map_changed(map, touched, last);
        self.1.map_changed(map, touched, last);
    }

    fn view_done(&self, outcome: &ViewOutcome) {
        self.0.view_done(outcome);
        self.1.view_done(outcome);
    }

    fn refined(&self, views: &[u32], refinement: &JointRefinement) {
        self.0.refined(views, refinement);
        self.1.refined(views, refinement);
    }
}

/// A name that no other run has: when it began, and which process it is.
pub(crate) fn unique_id() -> String {
    let nanos = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_nanos());
    format!("{nanos:x}-{:x}", std::process::id())
}
