//! One inspection from its beginning to its end.

use crate::bus::{EventBus, Events};
use crate::compose::{Composition, SetupFailure, compose};
use crate::event::{EventKind, SharedModel};
use crate::findings;
use crate::journal::{Journal, Trouble};
use crate::pipeline::{self, Modelled, PipelineConfig, Region, Stages};
use crate::planning::ViewPlanner;
use crate::record::{Recorded, Recorder, pose_record};
use crate::source::{CaptureTrigger, Source, SourceInfo};
use crate::spec::{InspectionSpec, SpecError};
use crate::stop::StopSwitch;
use crate::summary::{Measured, measure, summarize};
use jiff::Timestamp;
use semascan_geometry::mesh::MeshError;
use semascan_model::finding::Finding;
use semascan_model::record::{
    InspectionRecord, Outcome, PlanRecord, RunRecord, SCHEMA_VERSION, Setting, SoftwareRecord, ViewRecord,
};
use semascan_model::{InspectionId, ModelFigures, SemanticCloud, SemanticMesh};
use semascan_perception::fuse::FuseError;
use semascan_perception::view::Intrinsics;
use std::collections::BTreeMap;
use std::thread::JoinHandle;

/// An inspection that is ready to begin: subscribe to its events, then [`start`](Self::start) it.
///
/// ```
/// use semascan_inspection::Inspection;
/// use semascan_inspection::spec::InspectionSpec;
/// use semascan_simulation::{VirtualCell, VirtualCellSpec};
///
/// // Two small views of a simulated motor; any other source is inspected alike.
/// let uri = "virtual:starter-motor?seed=7&views=2&size=96x72&cell=4&errors=none";
/// let source = VirtualCell::open(&VirtualCellSpec::parse(uri)?)?;
/// let inspection = Inspection::new(InspectionSpec::default(), Box::new(source))?;
/// let events = inspection.subscribe();
/// let handle = inspection.start();
/// assert!(events.count() > 2);
/// let inspected = handle.wait()?;
/// // Points in metres, in the table frame; areas in square metres.
/// assert!(inspected.cloud.len() > 100);
/// assert_eq!(inspected.record.views.len(), 2);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Inspection {
    id: InspectionId,
    spec: InspectionSpec,
    config: PipelineConfig,
    region: Region,
    least_share: f64,
    parts: Composition,
    events: EventBus,
    earlier: Vec<Finding>,
    /// Chooses where views are taken from.
    planner: Option<Box<dyn ViewPlanner>>,
    /// When it began, where that is known already.
    began: Option<Timestamp>,
}

/// An inspection that runs, on threads of its own.
#[derive(Debug)]
pub struct InspectionHandle {
    id: InspectionId,
    stop: StopSwitch,
    worker: JoinHandle<Result<Inspected, InspectionError>>,
}

/// A finished inspection.
pub struct Inspected {
    /// What it was run with.
    pub spec: InspectionSpec,
    /// Its source, whose views are used up; it still knows its truth.
    pub source: Box<dyn Source>,
    /// The model.
    pub model: SharedModel,
    /// The model as points, table frame.
    pub cloud: SemanticCloud,
    /// The mesh of these points; empty without oriented points.
    pub mesh: SemanticMesh,
    /// The model's figures, of which the record holds those of the classes.
    pub figures: ModelFigures,
    /// The record, without a judgement against truth.
    pub record: InspectionRecord,
    /// What its events said, true poses included.
    pub recorded: Recorded,
}

/// Why an inspection has no result.
#[derive(Debug, thiserror::Error)]
pub enum InspectionError {
    /// The map could not be made.
    #[error("{source}")]
    Fuse {
        /// Why.
        source: FuseError,
        /// What there is to record.
        record: Box<InspectionRecord>,
    },
    /// The model could not be meshed.
    #[error("no mesh: {source}")]
    Mesh {
        /// Why.
        source: MeshError,
        /// What there is to record.
        record: Box<InspectionRecord>,
    },
    /// Every view was left out.
    #[error("no view could be used: {}", reasons.join("; "))]
    NoView {
        /// Why, view by view.
        reasons: Vec<String>,
        /// What there is to record.
        record: Box<InspectionRecord>,
    },
    /// It was stopped before there was a model.
    #[error("stopped before a view was in the model")]
    Stopped {
        /// What there is to record.
        record: Box<InspectionRecord>,
    },
    /// A stage panicked.
    #[error("the inspection ended unexpectedly: this is a fault of the program")]
    Panicked,
}

impl Inspection {
    /// An inspection of `source` as `spec` says. Everything that is wrong with either shows here.
    ///
    /// # Errors
    /// [`SetupFailure`] naming the field, file or model at fault.
    pub fn new(spec: InspectionSpec, source: Box<dyn Source>) -> Result<Self, SetupFailure> {
        let config = PipelineConfig {
            voxel: spec.voxel()?,
            filter: spec.outliers,
            association: spec.association_test(),
            uncertainty: spec.network.uncertainty_rule(),
            pace: spec.pace()?,
        };
        let region = Region::new(&spec.region, config.voxel)?;
        let least_share = spec.least_share()?;
        spec.check_thresholds()?;
        spec.plan.check()?;
        let parts = compose(&spec, source)?;
        let id = Self::new_id();
        Ok(Self {
            id,
            spec,
            config,
            region,
            least_share,
            parts,
            events: EventBus::new(id),
            earlier: Vec::new(),
            planner: None,
            began: None,
        })
    }

    /// The same inspection of a part of which an earlier result in the same frame has these findings: those that are found
    /// again keep their names.
    #[must_use]
    pub fn with_earlier_findings(self, earlier: Vec<Finding>) -> Self {
        Self { earlier, ..self }
    }

    /// The camera, where the source can be steered.
    pub fn steered_camera(&mut self) -> Option<Intrinsics> {
        self.parts.source.steered().map(|camera| camera.intrinsics())
    }

    /// The same inspection with views from where `planner` says.
    ///
    /// # Errors
    /// [`SetupFailure`] if the source cannot be steered.
    pub fn planned_by(mut self, planner: Box<dyn ViewPlanner>) -> Result<Self, SetupFailure> {
        if self.parts.source.steered().is_none() {
            let reason = format!("{}: its views come as they come, and cannot be planned", self.info().uri);
            return Err(SpecError { field: "plan".into(), reason }.into());
        }
        self.planner = Some(planner);
        Ok(self)
    }

    /// Views that will come, if that is known; where they are planned, at most.
    pub fn views_expected(&self) -> Option<u32> {
        self.planner.as_ref().map(|planner| planner.most_views()).or(self.info().view_count)
    }

    /// An identifier for an inspection that begins now.
    pub fn new_id() -> InspectionId {
        InspectionId::from(uuid::Uuid::now_v7())
    }

    /// Its identifier.
    pub fn id(&self) -> InspectionId {
        self.id
    }

    /// What is inspected, with the classes that its labels will have.
    pub fn info(&self) -> &SourceInfo {
        self.parts.source.info()
    }

    /// What a view of it can be asked for with; `None` where its source's views come when they come.
    pub fn capture_trigger(&self) -> Option<CaptureTrigger> {
        self.parts.source.capture_trigger()
    }

    /// The record as it is before anything happened: kept from the beginning on, it says so if the inspection is killed.
    pub fn record(&self) -> InspectionRecord {
        let Composition { source, networks, .. } = &self.parts;
        InspectionRecord {
            schema_version: SCHEMA_VERSION,
            id: self.id,
            began: self.began.unwrap_or_else(Timestamp::now),
            ended: None,
            outcome: Outcome::Running,
            files: None,
            software: SoftwareRecord { name: "semascan".into(), version: env!("CARGO_PKG_VERSION").into() },
            part: source.info().part.clone(),
            source: source.info().uri.clone(),
            labels: self.spec.labels,
            networks: networks.clone(),
            settings: settings(source.info()),
            voxel: None,
            points: 0,
            base_from_table: None,
            refinement: None,
            photometric: None,
            plan: self.planner.as_ref().map(|planner| PlanRecord {
                strategy: planner.strategy(),
                seed: planner.seed(),
                views: Vec::new(),
                stopped: None,
                coverage: None,
            }),
            run: None,
            views: Vec::new(),
            components: Vec::new(),
            defects: Vec::new(),
            findings: None,
            verdict: None,
            truth: None,
        }
    }

    /// The same inspection under an identifier that it was given, which began then: that of the one that it continues, or of
    /// its row in a catalogue.
    #[must_use]
    pub fn continuing(mut self, id: InspectionId, began: Timestamp) -> Self {
        self.id = id;
        self.began = Some(began);
        self.events = EventBus::new(id);
        self
    }

    /// Keeps what happens: from now on a view is acknowledged when `journal` has it on the disk. `told` learns of what keeps
    /// it from that, and gets an empty text when that is over; the inspection waits meanwhile. Called before
    /// [`subscribe`](Self::subscribe).
    pub fn keep(&self, journal: Journal, told: Trouble) {
        self.events.keep(journal, told);
    }

    /// Everything that will happen, from the first event on. A subscriber that does not read holds the inspection up: see
    /// [`crate::bus`].
    pub fn subscribe(&self) -> Events {
        self.events.subscribe()
    }

    /// Begins.
    pub fn start(self) -> InspectionHandle {
        let stop = self.events.stop_switch().clone();
        let (id, switch) = (self.id, stop.clone());
        let span = tracing::info_span!("inspection", %id);
        let worker = std::thread::spawn(move || span.in_scope(|| self.run(&switch)));
        InspectionHandle { id, stop, worker }
    }

    fn run(self, stop: &StopSwitch) -> Result<Inspected, InspectionError> {
        let begun = self.record();
        let views_expected = self.views_expected();
        let Self { id: _, spec, config, mut region, least_share, parts, events, earlier, planner, began } = self;
        let Composition { mut source, mut segmenter, mut registrar, networks: _, looked_for } = parts;
        let info = source.info().clone();
        // The record is made by a subscriber like any other, which is done when the events are.
        let followed = events.subscribe();
        let span = tracing::Span::current();
        let recorder = std::thread::spawn(move || {
            let _in_span = span.entered();
            let mut recorder = Recorder::default();
            followed.for_each(|event| recorder.handle(&event));
            recorder.finish()
        });
        events.publish(EventKind::Started {
            part: info.part.clone(),
            source: info.uri.clone(),
            taxonomy: info.taxonomy.clone(),
            views_expected,
            turntable: info.turntable,
        });
        let stages = Stages { segmenter: segmenter.as_mut(), region: &mut region, registrar: registrar.as_mut() };
        source.end_with(stop);
        let modelled = pipeline::run(source.as_mut(), planner, stages, &config, &events, stop.flag());
        let (model, views, used, thinned, covariances) = match modelled {
            Ok(Modelled { model, views, used, thinned, covariances }) => {
                (Ok(model), views, used, Some(thinned), covariances)
            }
            Err(error) => (Err(error), 0, 0, None, BTreeMap::new()),
        };
        // The mesh belongs to the inspection: its figures are measured on it.
        let measured = model.as_ref().ok().and_then(Option::as_ref).map(|model| {
            let (cloud, voxel) = {
                let map = model.read();
                (map.cloud(), map.config().voxel)
            };
            (measure(&cloud, voxel), cloud, voxel)
        });
        // Views without a single point in the map are no model.
        let measured = measured.filter(|(_, cloud, _)| !cloud.is_empty());
        let outcome = match (&model, &measured) {
            (Err(error), _) => Outcome::Failed { reason: error.to_string() },
            (_, Some((Err(error), ..))) => Outcome::Failed { reason: format!("no mesh: {error}") },
            _ if stop.is_set() => Outcome::Stopped,
            (_, None) => Outcome::Failed { reason: "no view could be used".into() },
            _ if spec.strict && used < views => {
                let reason = format!("{} of {views} views were left out, and none may be (--strict)", views - used);
                Outcome::Failed { reason }
            }
            (_, Some(_)) => Outcome::Finished,
        };
        if let Some((Ok(Measured { figures, .. }), ..)) = &measured {
            events.publish(EventKind::Measured { figures: Box::new(figures.clone()) });
        }
        if let (Ok(Some(model)), Some((Ok(Measured { mesh, .. }), _, voxel))) = (&model, &measured)
            && !mesh.triangles.is_empty()
        {
            let map = model.read();
            let taxonomy = &info.taxonomy;
            let looked_for = &looked_for;
            let searched =
                findings::Model { mesh, voxel: *voxel, taxonomy, looked_for, views: map.kept_views(), covariances };
            match findings::find(&searched, &earlier) {
                Ok(findings) => events.publish(EventKind::Found { findings: Box::new(findings) }),
                Err(error) => tracing::error!("findings are not known: {error}"),
            }
        }
        events.publish(EventKind::Ended { outcome: outcome.clone() });
        drop(events);
        let recorded = recorder.join().map_err(|_| InspectionError::Panicked)?;
        let used = recorded.views.iter().filter(|v: &&ViewRecord| v.accepted).count() as u32;
        let record = InspectionRecord {
            began: began.or(recorded.began).unwrap_or(begun.began),
            ended: recorded.ended,
            outcome,
            // A source may count while it is used up: its settings are those of the end.
            settings: settings(source.info()),
            base_from_table: recorded.base_from_table.as_ref().map(pose_record),
            refinement: recorded.refinement.clone(),
            photometric: recorded.photometric.clone(),
            plan: begun.plan.map(|plan| PlanRecord {
                views: recorded.planned.clone(),
                stopped: recorded.plan_ended.as_ref().map(|(why, _)| *why),
                coverage: recorded.plan_ended.as_ref().and_then(|(_, coverage)| coverage.clone()),
                ..plan
            }),
            findings: recorded.findings.clone(),
            run: Some(RunRecord {
                surfaces_thinned: thinned.filter(|_| used > 0),
                ..RunRecord::new(recorded.views.len() as u32, used, least_share, region.counted())
            }),
            views: recorded.views.clone(),
            ..begun
        };
        let model = match model {
            Ok(model) => model,
            Err(source) => return Err(InspectionError::Fuse { source, record: Box::new(record) }),
        };
        let (measured, cloud, voxel, model) = match (measured, model) {
            (Some((Ok(measured), cloud, voxel)), Some(model)) => (measured, cloud, voxel, model),
            (Some((Err(source), ..)), _) => return Err(InspectionError::Mesh { source, record: Box::new(record) }),
            _ if stop.is_set() => return Err(InspectionError::Stopped { record: Box::new(record) }),
            _ => {
                let mut reasons = recorded.rejections();
                if reasons.is_empty() {
                    reasons.push(if views == 0 { "none came" } else { "none has a point in the map" }.to_owned());
                }
                return Err(InspectionError::NoView { reasons, record: Box::new(record) });
            }
        };
        let (components, defects) = summarize(&measured.figures, &info.taxonomy, spec.labels);
        let points = cloud.len() as u64;
        let record = InspectionRecord { voxel: Some(voxel), points, components, defects, ..record };
        let Measured { mesh, figures } = measured;
        Ok(Inspected { spec, source, model, cloud, mesh, figures, record, recorded })
    }
}

/// A source's settings as the record keeps them.
fn settings(info: &SourceInfo) -> Vec<Setting> {
    info.settings.iter().map(|(name, value)| Setting { name: name.clone(), value: value.clone() }).collect()
}

impl InspectionError {
    /// What there is to record of the inspection; `None` after a fault of the program.
    pub fn into_record(self) -> Option<InspectionRecord> {
        match self {
            Self::Fuse { record, .. }
            | Self::Mesh { record, .. }
            | Self::NoView { record, .. }
            | Self::Stopped { record } => Some(*record),
            Self::Panicked => None,
        }
    }
}

impl InspectionHandle {
    /// The inspection's identifier.
    pub fn id(&self) -> InspectionId {
        self.id
    }

    /// What ends it early.
    pub fn stop_switch(&self) -> StopSwitch {
        self.stop.clone()
    }

    /// Ends it early.
    pub fn stop(&self) {
        self.stop.set();
    }

    /// Waits for the end.
    ///
    /// # Errors
    /// [`InspectionError`] if there is no model.
    pub fn wait(self) -> Result<Inspected, InspectionError> {
        self.worker.join().map_err(|_| InspectionError::Panicked)?
    }
}
