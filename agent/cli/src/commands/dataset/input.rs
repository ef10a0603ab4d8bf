//! What a data set is made of: the inspections of data folders, or single ones with their recording.

use super::super::recorded_views::RecordedViews;
use super::Failure;
use anyhow::{Context, anyhow};
use semascan_captures::CaptureReader;
use semascan_formats::{ply, regular_file};
use semascan_inspection::ports::{Archive, Catalogue, InspectionFilter, ReviewLog};
use semascan_labelling::MeasuringVolume;
use semascan_model::record::{InspectionRecord, ViewRecord};
use semascan_model::review::ReviewEntry;
use semascan_model::{InspectionId, SemanticMesh, Taxonomy};
use semascan_perception::view::View;
use semascan_store::check_set;
use semascan_store::data::DataFolder;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The log of reviews that entries were read from.
#[derive(Clone, Debug, Serialize)]
pub(super) struct LogRecord {
    /// Entries in the whole log, all inspections together.
    pub(super) entries: u64,
    /// The hash of the last one, by which `semascan audit verify` tells whether it is still there.
    pub(super) head: String,
}

/// An inspection.
pub(super) struct Input {
    /// What was named.
    pub(super) from: PathBuf,
    /// Its folder.
    pub(super) folder: PathBuf,
    pub(super) record: InspectionRecord,
    /// What people said about it, in order.
    pub(super) entries: Vec<ReviewEntry>,
    /// Absent without a data folder: nobody could review it.
    pub(super) log: Option<LogRecord>,
    data: Option<Arc<DataFolder>>,
}

/// An inspection that cannot be used.
#[derive(Clone, Debug, Serialize)]
pub(super) struct LeftOut {
    /// The inspection.
    pub(super) inspection: InspectionId,
    /// Why.
    pub(super) reason: String,
}

/// All inspections that were named.
pub(super) struct Inputs {
    /// The earliest first.
    pub(super) list: Vec<Input>,
    /// Those that have no record.
    pub(super) left_out: Vec<LeftOut>,
}

/// The inspections in `from`; of data folders those in `chosen`, or all where it is empty.
///
/// # Errors
/// [`Failure`] naming the folder that is none, the chosen inspection that is not there, the log that was changed.
pub(super) fn open(from: &[PathBuf], chosen: &[InspectionId]) -> Result<Inputs, Failure> {
    let mut inputs = Inputs { list: Vec::new(), left_out: Vec::new() };
    for folder in from {
        if folder.join("semascan.db").is_file() {
            of_data(folder, folder, chosen, &mut inputs)?;
        } else if folder.join("inspection.json").is_file() {
            let record = record(folder)?;
            if !chosen.is_empty() && !chosen.contains(&record.id) {
                continue;
            }
            match data_of(folder) {
                Some(data) => of_data(folder, &data, &[record.id], &mut inputs)?,
                None => inputs.list.push(Input {
                    from: folder.clone(),
                    folder: folder.clone(),
                    record,
                    entries: Vec::new(),
                    log: None,
                    data: None,
                }),
            }
        } else {
            let reason = "is neither a data folder (with semascan.db) nor one of an inspection (with inspection.json)";
            return Err(Failure::Call(anyhow!("{}: {reason}", folder.display())));
        }
    }
    for id in chosen {
        let is_known = inputs.list.iter().any(|input| input.record.id == *id);
        if !is_known && !inputs.left_out.iter().any(|left_out| left_out.inspection == *id) {
            return Err(Failure::Call(anyhow!("--inspection {id}: none of the folders holds it")));
        }
    }
    inputs.list.sort_by_key(|input| input.record.id);
    inputs.list.dedup_by_key(|input| input.record.id);
    Ok(inputs)
}

fn record(folder: &Path) -> Result<InspectionRecord, Failure> {
    Ok(semascan_store::read_record(folder)?)
}

/// The data folder that an inspection's folder lies in.
fn data_of(folder: &Path) -> Option<PathBuf> {
    let folder = folder.canonicalize().ok()?;
    let data = folder.parent().filter(|parent| parent.ends_with("inspections"))?.parent()?;
    data.join("semascan.db").is_file().then(|| data.to_owned())
}

/// Adds the inspections of a data folder.
fn of_data(from: &Path, data: &Path, chosen: &[InspectionId], inputs: &mut Inputs) -> Result<(), Failure> {
    let opened = Arc::new(DataFolder::open_beside(data)?);
    let catalogue = opened.catalogue();
    // Labels out of a log that somebody changed teach what nobody said.
    let audited = catalogue.audit(None)?;
    if let Some(fault) = audited.fault {
        let log = data.display();
        return Err(anyhow!("{log}: entry {} of the log of reviews {}", fault.sequence, fault.reason).into());
    }
    let mut filter = InspectionFilter::default();
    loop {
        let rows = catalogue.inspections(&filter)?;
        let Some(last) = rows.last() else { return Ok(()) };
        filter.before = Some(last.id);
        for row in rows.iter().filter(|row| chosen.is_empty() || chosen.contains(&row.id)) {
            let folder = opened.result_path(row.id);
            let Some(record) = opened.record(row.id)? else {
                let reason = format!("is {} and has no record", row.state.name());
                inputs.left_out.push(LeftOut { inspection: row.id, reason });
                continue;
            };
            inputs.list.push(Input {
                from: from.to_owned(),
                folder,
                record,
                entries: catalogue.all_entries(row.id)?,
                log: Some(LogRecord { entries: audited.entries, head: audited.head.clone() }),
                data: Some(Arc::clone(&opened)),
            });
        }
    }
}

impl Input {
    /// The mesh of its model and the classes of that.
    pub(super) fn mesh(&self) -> Result<(SemanticMesh, Taxonomy), Failure> {
        check_set(&self.folder, &self.record)?;
        let path = self.folder.join("mesh.ply");
        let name = path.display().to_string();
        let bytes = regular_file::read(&path).with_context(|| name.clone())?;
        let model = ply::read(&name, &bytes)?;
        if model.shift != [0.0; 3] {
            return Err(anyhow!("{name}: is shifted against the table frame, which poses are given in").into());
        }
        Ok((model.mesh, model.taxonomy))
    }

    /// Where its part can be; `None` where its source does not say.
    pub(super) fn volume(&self, views: &InputViews<'_>) -> Result<Option<MeasuringVolume>, Failure> {
        let corners = match views {
            InputViews::Source(Ok(views)) => views.volume(),
            InputViews::Source(Err(_)) => None,
            InputViews::Kept(data, id) => {
                let path = data.capture_path(*id);
                // A capture that was deleted has no views either, which is said of each.
                let info = path.exists().then(|| CaptureReader::open(&path)).transpose()?;
                info.and_then(|capture| capture.info().source_info("").volume)
            }
        };
        Ok(corners.map(|(least, greatest)| MeasuringVolume { least, greatest }))
    }

    /// Its views.
    pub(super) fn views(&self) -> InputViews<'_> {
        match &self.data {
            Some(data) => InputViews::Kept(data, self.record.id),
            None => InputViews::Source(RecordedViews::open(&self.record.source).map(Box::new)),
        }
    }
}

/// The views of an inspection.
pub(super) enum InputViews<'a> {
    /// Out of its capture.
    Kept(&'a DataFolder, InspectionId),
    /// Out of its source, opened again.
    Source(Result<Box<RecordedViews>, String>),
}

impl InputViews<'_> {
    /// The view that was inspected as `recorded`, or why there is none; they are asked for in order.
    pub(super) fn view(&mut self, recorded: &ViewRecord) -> Result<View, String> {
        match self {
            Self::Kept(data, id) => {
                let kept = data.view(*id, recorded.index).map_err(|error| error.to_string())?;
                let view = kept.ok_or("the capture has no such view")?.view?;
                view.check_sizes().map_err(|error| error.to_string())?;
                Ok(view)
            }
            Self::Source(Ok(views)) => views.view(recorded),
            Self::Source(Err(reason)) => Err(reason.clone()),
        }
    }
}
