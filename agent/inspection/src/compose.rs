//! From a specification to the stages that do it: the one place that puts segmenter and registrar together.

use crate::source::{
    KeyframeRule, Keyframes, Source, SourceError, SourceInfo, TrackedSource, TurntableSource, WithTaxonomy,
};
use crate::spec::{
    BackgroundMethod, InspectionSpec, MaskRefinement, NetworkSpec, RegistrationMethod, SpecError, TurntableSpec,
};
use rayon::prelude::*;
use semascan_model::Taxonomy;
use semascan_model::finding::NamedClass;
use semascan_model::record::{LabelSource, NetworksRecord, Task};
use semascan_perception::register::{IcpConfig, IcpRegistrar, KinematicRegistrar, Registrar, Selection};
use semascan_perception::segment::geometric::PatchMethod;
use semascan_perception::segment::network::{
    EngineError, Manifest, ModelError, NetworkConfig, NetworkModel, NetworkSegmenter, SelectError, SetupError,
    class_number, engine, extended, select,
};
use semascan_perception::segment::preparation::contour::Snake;
use semascan_perception::segment::preparation::{Background, Preparation, Prepared};
use semascan_perception::segment::{GeometricSegmenter, RecordedSegmenter, Segmenter, Unlabelled};
use std::path::PathBuf;

/// Why an inspection cannot begin.
#[derive(Debug, thiserror::Error)]
pub enum SetupFailure {
    /// A field of the specification cannot be used.
    #[error(transparent)]
    Spec(#[from] SpecError),
    /// The source cannot be had.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// There are no such models.
    #[error(transparent)]
    Select(#[from] SelectError),
    /// Nothing runs networks.
    #[error(transparent)]
    Engine(#[from] EngineError),
    /// A model cannot be loaded.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The models do not go together.
    #[error("the networks cannot be used: {0}")]
    Networks(#[from] SetupError),
}

/// What an inspection is done with.
pub(crate) struct Composition {
    pub(crate) source: Box<dyn Source>,
    pub(crate) segmenter: Box<dyn Segmenter>,
    pub(crate) registrar: Box<dyn Registrar>,
    pub(crate) networks: Option<NetworksRecord>,
    /// The defect classes that are looked for, or why none is.
    pub(crate) looked_for: Result<Vec<NamedClass>, String>,
}

/// Puts together what `spec` says for `source`: everything that is wrong with either shows here.
pub(crate) fn compose(spec: &InspectionSpec, source: Box<dyn Source>) -> Result<Composition, SetupFailure> {
    let (taxonomy, models) = taxonomy_and_models(spec, source.as_ref())?;
    let mut source = source;
    if taxonomy != source.info().taxonomy {
        source = Box::new(WithTaxonomy::new(source, taxonomy));
    }
    if spec.region.labelled && spec.labels == LabelSource::None {
        let reason = "only labelled pixels are asked for, but no labels: none would be left".to_owned();
        return Err(SpecError { field: "region.labelled".into(), reason }.into());
    }
    source = posed(spec, source)?;
    if spec.source.keyframes {
        source = Box::new(Keyframes::new(source, KeyframeRule::default()));
    }
    let info = source.info();
    let preparation = preparation(spec, info)?;
    let as_captured = preparation == Preparation::default();
    let (labels, networks): (Box<dyn Segmenter>, _) = match spec.labels {
        LabelSource::Source => (Box::new(RecordedSegmenter), None),
        LabelSource::None => (Box::new(Unlabelled), None),
        LabelSource::Network => {
            let segmenter = network_segmenter(&spec.network, &models, info, as_captured)?;
            let network = segmenter.report().clone();
            (Box::new(segmenter), Some(NetworksRecord { network, uncertain: spec.network.uncertain }))
        }
    };
    let prepared: Box<dyn Segmenter> = if as_captured { labels } else { Box::new(Prepared::new(labels, preparation)) };
    let segmenter: Box<dyn Segmenter> = match spec.masks {
        MaskRefinement::AsIs => prepared,
        MaskRefinement::Slic => Box::new(GeometricSegmenter::new(prepared, PatchMethod::SLIC)),
        MaskRefinement::Lcccp => Box::new(GeometricSegmenter::new(prepared, PatchMethod::LCCCP)),
    };
    let registrar = registrar(spec.registration, info);
    let looked_for = looked_for(spec.labels, &models, &source.info().taxonomy);
    Ok(Composition { source, segmenter, registrar, networks, looked_for })
}

/// The source with the poses that looking at it gives: of a camera that is tracked, or before a turntable.
fn posed(spec: &InspectionSpec, source: Box<dyn Source>) -> Result<Box<dyn Source>, SpecError> {
    let turntable = |reason| SpecError { field: "turntable".into(), reason };
    match spec.turntable {
        TurntableSpec::Known { .. } if spec.source.track => {
            Err(turntable("a camera that is tracked moves, and one before a turntable stands still".into()))
        }
        _ if spec.source.track => Ok(Box::new(TrackedSource::new(source))),
        _ => TurntableSource::wrap(source, spec.turntable).map_err(turntable),
    }
}

/// The classes that an inspection of `source` as `spec` says names, known before it is set up.
///
/// # Errors
/// [`SetupFailure`] where it could not be set up either: no such networks, or labels that the source does not have.
pub fn inspected_taxonomy(spec: &InspectionSpec, source: &dyn Source) -> Result<Taxonomy, SetupFailure> {
    taxonomy_and_models(spec, source).map(|(taxonomy, _)| taxonomy)
}

/// The classes of an inspection, and the networks that name them.
fn taxonomy_and_models(
    spec: &InspectionSpec,
    source: &dyn Source,
) -> Result<(Taxonomy, Vec<(PathBuf, Manifest)>), SetupFailure> {
    let known = &source.info().taxonomy;
    match spec.labels {
        LabelSource::Network => {
            let models = select(&spec.network.models, known)?;
            Ok((network_taxonomy(&models, known, source.truth().is_some()), models))
        }
        // Without truth there is nothing that classes could be compared with, and none is looked for.
        LabelSource::None if source.truth().is_none() => Ok((Taxonomy::from_names::<&str>(&[], &[]), Vec::new())),
        LabelSource::None => Ok((known.clone(), Vec::new())),
        LabelSource::Source => match &source.info().no_labels {
            Some(reason) => {
                let reason = format!("source: {reason}; use --labels network or --labels none");
                Err(SpecError { field: "labels".into(), reason }.into())
            }
            None => Ok((known.clone(), Vec::new())),
        },
    }
}

/// The defect classes that `labels` can name, or why they name none: then a surface without defects is no finding.
fn looked_for(
    labels: LabelSource,
    models: &[(PathBuf, Manifest)],
    taxonomy: &Taxonomy,
) -> Result<Vec<NamedClass>, String> {
    let all: Vec<NamedClass> =
        taxonomy.defects.iter().skip(1).map(|d| NamedClass { class: d.id, name: d.name.clone() }).collect();
    let (classes, why) = match labels {
        LabelSource::None => (Vec::new(), "no labels were used"),
        LabelSource::Source => (all, "the source names no defect classes"),
        LabelSource::Network => {
            let of_defects: Vec<&Manifest> = models.iter().map(|(_, m)| m).filter(|m| m.task == Task::Defect).collect();
            // The classes of these networks alone: a source's truth may know others.
            let known = extended(&Taxonomy::from_names::<&str>(&[], &[]), &of_defects);
            let knows = |class: &NamedClass| class_number(&known.defects, &class.name).is_some();
            (all.into_iter().filter(knows).collect(), "no network looks for defects")
        }
    };
    if classes.is_empty() { Err(why.into()) } else { Ok(classes) }
}

fn registrar(method: RegistrationMethod, info: &SourceInfo) -> Box<dyn Registrar> {
    let selection = match method {
        RegistrationMethod::Kinematic => return Box::new(KinematicRegistrar),
        RegistrationMethod::Auto if info.turntable.is_some() => Selection::Object,
        RegistrationMethod::SegmentIcp => Selection::Object,
        RegistrationMethod::Auto | RegistrationMethod::Icp => Selection::Everything,
    };
    Box::new(IcpRegistrar::new(IcpConfig::default(), selection))
}

/// What is done to the views of a source like `info` before they are labelled.
fn preparation(spec: &InspectionSpec, info: &SourceInfo) -> Result<Preparation, SpecError> {
    let background = match spec.preparation.background {
        BackgroundMethod::Keep => Background::Kept,
        BackgroundMethod::Contour => Background::Contour(Snake::default()),
        BackgroundMethod::Volume => {
            let (low, high) = info.volume.ok_or_else(|| SpecError {
                field: "background".into(),
                reason: format!("volume: {} knows no measuring volume; use contour", info.uri),
            })?;
            Background::Volume(low, high)
        }
    };
    Ok(Preparation { denoise: spec.preparation.denoise, background })
}

/// The classes of an inspection of a source with the classes `known`. Where its truth is known its numbers stay;
/// otherwise the networks' classes are all there are.
fn network_taxonomy(models: &[(PathBuf, Manifest)], known: &Taxonomy, has_truth: bool) -> Taxonomy {
    let manifests: Vec<&Manifest> = models.iter().map(|(_, manifest)| manifest).collect();
    let none = Taxonomy::from_names::<&str>(&[], &[]);
    extended(if has_truth { known } else { &none }, &manifests)
}

/// Loads the networks for an inspection of a source like `info`, whose pictures come to them `as_captured` or were prepared.
fn network_segmenter(
    spec: &NetworkSpec,
    models: &[(PathBuf, Manifest)],
    info: &SourceInfo,
    as_captured: bool,
) -> Result<NetworkSegmenter, SetupFailure> {
    let config = NetworkConfig { judge_domain: as_captured, ..spec.network_config() };
    config.check().map_err(|(field, reason)| SpecError { field: format!("network.{field}"), reason })?;
    let engine = engine::open(spec.engine, spec.onnxruntime.as_deref(), spec.provider)?;
    let threads = spec.threads.unwrap_or_else(rayon::current_num_threads);
    let load = |(folder, _): &(PathBuf, Manifest)| NetworkModel::load(folder, engine.as_ref(), threads);
    let models: Vec<NetworkModel> = models.par_iter().map(load).collect::<Result<_, _>>()?;
    let description = engine.description();
    let names: Vec<&str> = models.iter().map(|m| m.manifest().name.as_str()).collect();
    tracing::info!("labels by {} in {} {}", names.join(", "), description.name, description.version);
    let segmenter = NetworkSegmenter::new(models, description, &info.taxonomy, info.volume, config)?;
    if segmenter.predictions() == 1 {
        tracing::warn!("one network asked once: its uncertainty cannot be known and counts as none");
    }
    Ok(segmenter)
}
