//! A data set written: inspection by inspection, view by view.

use super::super::recorded_views::table_from_camera;
use super::input::{Input, InputViews, Inputs, LeftOut};
use super::manifest::{InspectionEntry, Manifest, SCHEMA, ViewLeftOut};
use super::writer::DatasetWriter;
use super::{Failure, Format};
use anyhow::anyhow;
use nalgebra::Isometry3;
use semascan_labelling::{
    CapturedView, Corrected, EmptySpace, IGNORE, LabelledModel, PixelCounts, RimTreatment, Selection, corrected_labels,
};
use semascan_model::record::{InspectionRecord, Outcome, SoftwareRecord, ViewRecord};
use semascan_model::review::NetworkVersion;
use semascan_model::{ClassDef, SemanticMesh, Taxonomy};
use semascan_perception::view::View;
use semascan_store::{DATASET_KIND, DatasetFolder, MANIFEST, write_file};
use std::io::Write;
use std::path::Path;

/// How a data set is made.
pub(super) struct Options {
    pub(super) format: Format,
    pub(super) include_uncorrected: bool,
    pub(super) selection: Selection,
    /// What becomes of the edges of masks.
    pub(super) rims: RimTreatment,
    pub(super) overwrite: bool,
}

/// Writes the data set of `inputs` into `out`.
///
/// # Errors
/// [`Failure`] naming the folder, file or inspection; nothing stands in `out` then that did not before.
pub(super) fn write(out: &Path, inputs: Inputs, options: &Options) -> Result<Manifest, Failure> {
    let folder = DatasetFolder::begin(out, options.overwrite)?;
    let Inputs { list, mut left_out } = inputs;
    let (mut used, mut names) = (Vec::new(), ClassNames::default());
    for input in list {
        match unusable(&input, options) {
            Some(reason) => left_out.push(LeftOut { inspection: input.record.id, reason }),
            None => {
                names.add(&input.mesh()?.1);
                used.push(input);
            }
        }
    }
    for LeftOut { inspection, reason } in &left_out {
        tracing::warn!("inspection {inspection} is left out: {reason}");
    }
    if used.is_empty() {
        return Err(anyhow!("there is no inspection that a data set can be made of").into());
    }
    let taxonomy = names.taxonomy()?;
    let mut writer = DatasetWriter::begin(folder.draft(), options.format, &taxonomy)?;
    let mut inspections = Vec::new();
    for (scene, input) in (0..).zip(&used) {
        let entry = inspection(&mut writer, input, scene, &taxonomy, options)?;
        tracing::info!(
            "inspection {}: {} views, {} of {} vertices corrected, {} views left out",
            entry.inspection,
            entry.views,
            entry.changed,
            entry.vertices,
            entry.left_out.len()
        );
        for ViewLeftOut { view, reason } in &entry.left_out {
            tracing::warn!("inspection {}, view {view} is left out: {reason}", entry.inspection);
        }
        inspections.push(entry);
    }
    writer.finish()?;
    let names = |classes: &[ClassDef]| classes.iter().map(|class| class.name.clone()).collect();
    let manifest = Manifest {
        schema: SCHEMA,
        kind: DATASET_KIND,
        software: SoftwareRecord { name: "semascan".into(), version: env!("CARGO_PKG_VERSION").into() },
        format: options.format,
        include_uncorrected: options.include_uncorrected,
        selection: options.selection,
        gaps_closed: options.rims == RimTreatment::Close,
        classes: names(&taxonomy.components),
        defects: names(&taxonomy.defects),
        ignore: IGNORE,
        views: inspections.iter().map(|entry| entry.views).sum(),
        inspections,
        left_out,
    };
    if manifest.views == 0 {
        return Err(anyhow!("no view of these inspections can be read: there is nothing to learn from").into());
    }
    let text = serde_json::to_string_pretty(&manifest)?;
    write_file(&folder.draft().join(MANIFEST), |file| Ok(writeln!(file, "{text}")?))?;
    folder.publish()?;
    Ok(manifest)
}

/// Why no data set is made of an inspection.
fn unusable(input: &Input, options: &Options) -> Option<String> {
    let record = &input.record;
    if record.outcome == Outcome::Running {
        return Some("it has not ended".into());
    }
    if record.points == 0 {
        return Some("it did not come to a model".into());
    }
    if record.voxel.is_none() {
        return Some("its record does not say how large its voxels are".into());
    }
    let nobody = input.entries.is_empty() && !options.include_uncorrected;
    nobody.then(|| "nobody reviewed it; --include-uncorrected takes its labels as they were measured".into())
}

/// The classes of several models by name.
#[derive(Default)]
struct ClassNames {
    components: Vec<String>,
    defects: Vec<String>,
}

impl ClassNames {
    fn add(&mut self, taxonomy: &Taxonomy) {
        for (names, classes) in [(&mut self.components, &taxonomy.components), (&mut self.defects, &taxonomy.defects)] {
            for class in classes.iter().filter(|class| class.id != 0) {
                if !names.contains(&class.name) {
                    names.push(class.name.clone());
                }
            }
        }
    }

    fn taxonomy(&self) -> Result<Taxonomy, Failure> {
        let most = usize::from(IGNORE) - 1;
        for (kind, names) in [("component", &self.components), ("defect", &self.defects)] {
            if names.len() > most {
                let count = names.len();
                return Err(anyhow!("{count} {kind} classes: masks of 8 bits hold {most}").into());
            }
        }
        Ok(Taxonomy::from_names(&self.components, &self.defects))
    }
}

/// Writes the views of an inspection.
fn inspection(
    writer: &mut DatasetWriter,
    input: &Input,
    scene: u32,
    taxonomy: &Taxonomy,
    options: &Options,
) -> Result<InspectionEntry, Failure> {
    let record = &input.record;
    let (mesh, own) = input.mesh()?;
    let mut corrected: Corrected = corrected_labels(&mesh, &own, record, &input.entries);
    corrected.renumber(&own, taxonomy);
    let name = format!("{scene:06}");
    let mut entry = begun(input, &name, &mesh, &corrected);
    let model = LabelledModel::new(&mesh, &corrected, record.voxel.unwrap_or(1e-3), options.selection);
    writer.begin_scene(&name, &record.part, taxonomy)?;
    let space = empty_space(input)?;
    let mut views = input.views();
    let mut pixels = PixelCounts::default();
    for recorded in &record.views {
        let (view, pose) = match usable_view(&mut views, recorded) {
            Ok(view) => view,
            Err(reason) => {
                entry.left_out.push(ViewLeftOut { view: recorded.index, reason });
                continue;
            }
        };
        let captured = CapturedView::of(&view, pose, recorded, space.as_ref());
        let projection = model.project(&captured);
        let masks = projection.masks_with(&captured, options.rims);
        pixels.add(&projection.counts);
        entry.open += masks.components.iter().filter(|label| **label == IGNORE).count() as u64;
        entry.views += 1;
        writer.write(&view, pose, recorded.index, &masks, taxonomy)?;
    }
    entry.pixels = pixels;
    writer.finish_scene()?;
    Ok(entry)
}

/// Where the part can be, without what its views saw to be empty; `None` where its source does not say where it can be.
fn empty_space(input: &Input) -> Result<Option<EmptySpace>, Failure> {
    let mut views = input.views();
    let Some(volume) = input.volume(&views)? else { return Ok(None) };
    let mut space = EmptySpace::new(volume, input.record.voxel.unwrap_or(1e-3));
    for recorded in &input.record.views {
        // A view that cannot be used says nothing; why is said where it is left out.
        if let Ok((view, pose)) = usable_view(&mut views, recorded) {
            space.see(&CapturedView::of(&view, pose, recorded, None));
        }
    }
    Ok(Some(space))
}

/// A view of an inspection and its pose, or why it is left out.
fn usable_view(views: &mut InputViews<'_>, recorded: &ViewRecord) -> Result<(View, Isometry3<f64>), String> {
    if !recorded.accepted {
        return Err(recorded.reason.clone().unwrap_or_else(|| "the inspection did not use it".into()));
    }
    let pose = recorded.pose.as_ref().and_then(table_from_camera).ok_or("the record has no pose of it")?;
    Ok((views.view(recorded)?, pose))
}

/// What the manifest says of an inspection before its views.
fn begun(input: &Input, scene: &str, mesh: &SemanticMesh, corrected: &Corrected) -> InspectionEntry {
    let record = &input.record;
    InspectionEntry {
        inspection: record.id,
        from: input.from.display().to_string(),
        part: record.part.clone(),
        scene: scene.to_owned(),
        model: record.files.as_ref().map(|files| files.generation.clone()),
        inspected_with: record.software.clone(),
        networks: networks(record),
        log: input.log.clone(),
        entries: input.entries.len() as u64,
        last_entry: input.entries.last().map_or(0, |entry| entry.sequence),
        applied: corrected.applied,
        of_other_model: corrected.of_other_model,
        vertices: mesh.len() as u64,
        changed: corrected.changed,
        contradictions: corrected.contradictions.clone(),
        without_effect: corrected.without_effect.clone(),
        views: 0,
        pixels: PixelCounts::default(),
        open: 0,
        left_out: Vec::new(),
    }
}

fn networks(record: &InspectionRecord) -> Vec<NetworkVersion> {
    let models = record.networks.iter().flat_map(|networks| &networks.network.models);
    let version = models.map(|model| NetworkVersion {
        name: format!("{} {}", model.name, model.version),
        sha256: model.networks.iter().map(|file| file.sha256.clone()).collect(),
    });
    version.collect()
}
