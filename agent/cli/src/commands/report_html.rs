//! The report put together: the record, pictures drawn of the mesh, and photographs out of the views that the model was made
//! of, of an earlier report of the same model, of a capture, or of the source.

use super::Failure;
use super::recorded_views::{RecordedViews, table_from_camera};
use anyhow::{Context, anyhow};
use semascan_formats::{ply, regular_file};
use semascan_inspection::event::SharedModel;
use semascan_inspection::ports::{Archive, PortError, ReviewLog};
use semascan_inspection::review::{reviewed_state, with_drawn};
use semascan_model::measurement::KeptMeasurement;
use semascan_model::record::InspectionRecord;
use semascan_model::{SemanticMesh, Taxonomy};
use semascan_perception::fuse::KeptPicture;
use semascan_reports::{
    Audit, Photographs, Pictures, Report, Reviewed, ViewPicture, carried_photographs, findings, html,
    photographed_views, pictured, take_photographs,
};
use semascan_store::data::{Audited, BadEntry, DataFolder};
use semascan_store::{FolderLock, write_file};
use std::borrow::Cow;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The report of an inspection that has just ended, whose `record` names the files of its set: of the views that its `model`
/// keeps, of its `mesh` and of its classes.
pub(super) fn of_inspected(
    model: &SharedModel,
    mesh: &SemanticMesh,
    taxonomy: &Taxonomy,
    record: &InspectionRecord,
) -> String {
    let map = model.read();
    let views = map.kept_views();
    let indices = views.indices();
    let mut holes = false;
    let mut photographs = take_photographs(record, |view| {
        let place = indices.iter().position(|index| *index == view).ok_or("is not part of the model")?;
        let KeptPicture { depth, rgb, is_whole } = views.picture(place).map_err(|error| error.to_string())?;
        holes |= !is_whole;
        Ok(ViewPicture {
            rgb,
            depth: depth.metres,
            intrinsics: depth.intrinsics,
            table_from_camera: depth.table_from_camera,
        })
    });
    if holes && photographs.missing.is_none() {
        photographs.missing = Some("pixels without depth are black, they were not kept".into());
    }
    let pictures = drawn(mesh, taxonomy, record);
    html(&Report { record, taxonomy, pictures: &pictures, photographs: &photographs, reviewed: None })
}

/// The report of the inspection in `folder`, with what people decided about it where that is kept.
///
/// # Errors
/// [`Failure`] naming the file that cannot be read.
pub(super) fn of_folder(
    folder: &Path,
    record: &InspectionRecord,
    reviewed: Option<&Reviewed>,
) -> Result<String, Failure> {
    with_report(folder, record, reviewed, html)
}

/// The same as a PDF file, made at `made`.
///
/// # Errors
/// [`Failure`] naming the file that cannot be read.
#[cfg(feature = "pdf")]
pub(super) fn pdf_of_folder(
    folder: &Path,
    record: InspectionRecord,
    made: jiff::Timestamp,
) -> Result<Vec<u8>, Failure> {
    let reviewed = reviewed_in(folder, &record)?;
    let pdf = with_report(folder, &record, reviewed.as_ref(), |report| semascan_reports::pdf(report, made))?;
    pdf.map_err(|error| Failure::Work(error.into()))
}

/// Calls `written` with the report of the inspection in `folder`.
fn with_report<T>(
    folder: &Path,
    record: &InspectionRecord,
    reviewed: Option<&Reviewed>,
    written: impl FnOnce(&Report<'_>) -> T,
) -> Result<T, Failure> {
    let with_drawn = reviewed.map(|reviewed| with_drawn(record, &reviewed.state));
    let record = with_drawn.as_ref().unwrap_or(record);
    let (mesh, taxonomy) = if record.points > 0 {
        mesh(folder)?
    } else {
        (SemanticMesh::default(), Taxonomy::from_names::<&str>(&[], &[]))
    };
    let pictures = drawn(&mesh, &taxonomy, record);
    let photographs = photographs(folder, record);
    let report = Report { record, taxonomy: &taxonomy, pictures: &pictures, photographs: &photographs, reviewed };
    Ok(written(&report))
}

/// Writes the report in `folder` anew, if one stands there.
///
/// # Errors
/// [`Failure`] naming the file.
pub(super) fn renew(folder: &Path, record: &InspectionRecord) -> Result<(), Failure> {
    let path = folder.join("report.html");
    if !path.exists() {
        return Ok(());
    }
    put(folder, &path, record).map_err(|failure| {
        let reason =
            format!("the record says what was decided, but {} does not yet: {}", path.display(), failure.reason());
        Failure::Work(anyhow!(reason))
    })
}

/// Writes the report of the inspection in `folder` to `path`.
///
/// # Errors
/// [`Failure`] naming the file.
pub(super) fn put(folder: &Path, path: &Path, record: &InspectionRecord) -> Result<(), Failure> {
    let reviewed = reviewed_in(folder, record)?;
    let text = of_folder(folder, record, reviewed.as_ref())?;
    let _lock = FolderLock::acquire(&folder.canonicalize().with_context(|| folder.display().to_string())?)?;
    Ok(write_file(path, |out| Ok(out.write_all(text.as_bytes())?))?)
}

fn drawn(mesh: &SemanticMesh, taxonomy: &Taxonomy, record: &InspectionRecord) -> Pictures {
    Pictures::draw(mesh, taxonomy, record.voxel.unwrap_or(0.0), findings(record), &pictured(record))
}

/// The mesh in an inspection's folder and its classes; empty where the inspection has none.
fn mesh(folder: &Path) -> Result<(SemanticMesh, Taxonomy), Failure> {
    let path = folder.join("mesh.ply");
    let name = path.display().to_string();
    let bytes = regular_file::read(&path).with_context(|| name.clone())?;
    let model = ply::read(&name, &bytes)?;
    Ok((model.mesh, model.taxonomy))
}

/// The photographs of an earlier report of the same model, if it has them all; else they are taken anew.
fn photographs(folder: &Path, record: &InspectionRecord) -> Photographs {
    let earlier = regular_file::read_to_string(&folder.join("report.html")).ok();
    let mut carried = earlier.and_then(|text| carried_photographs(&text, record)).unwrap_or_default();
    let wanted = pictured(record);
    let is_whole = findings(record).iter().filter(|finding| wanted.contains(&finding.id)).all(|finding| {
        let views = photographed_views(finding);
        let held = carried.of.entry(finding.id).or_default();
        held.retain(|photograph| views.iter().any(|view| view.view == photograph.view));
        held.len() == views.len()
    });
    if is_whole {
        return carried;
    }
    let uri = capture(folder, record).unwrap_or_else(|| record.source.clone());
    let mut opened = match RecordedViews::open(&uri) {
        Ok(opened) => opened,
        Err(reason) => return Photographs { missing: Some(reason), ..carried },
    };
    let taken = take_photographs(record, |view| picture(&mut opened, record, view));
    if taken.of.is_empty() { Photographs { missing: taken.missing, ..carried } } else { taken }
}

/// What people decided about the inspection in `folder`, where a data folder keeps it.
///
/// # Errors
/// [`Failure`] naming the database.
fn reviewed_in(folder: &Path, record: &InspectionRecord) -> Result<Option<Reviewed>, Failure> {
    let Some(data) = kept_in(folder) else { return Ok(None) };
    Ok(Some(reviewed(&DataFolder::open_beside(&data)?, record)?))
}

/// The record of the inspection in `folder` with the findings that people drew and the measurements that they keep; these are
/// `None` where no data folder keeps it.
///
/// # Errors
/// [`Failure`] naming the database.
pub(super) fn with_reviews(
    folder: &Path,
    record: InspectionRecord,
) -> Result<(InspectionRecord, Option<Vec<KeptMeasurement>>), Failure> {
    Ok(match reviewed_in(folder, &record)? {
        Some(reviewed) => (with_drawn(&record, &reviewed.state), Some(reviewed.state.measurements)),
        None => (record, None),
    })
}

/// What people decided about an inspection that `data` keeps.
///
/// # Errors
/// [`PortError`] if the log of reviews cannot be read.
pub(super) fn reviewed(data: &DataFolder, record: &InspectionRecord) -> Result<Reviewed, PortError> {
    let log = data.catalogue();
    let criteria = match &record.verdict {
        Some(verdict) => data.criteria(&verdict.criteria.sha256)?,
        None => None,
    };
    let entries = log.all_entries(record.id)?;
    let state = reviewed_state(record, &entries, criteria.as_ref());
    let Audited { entries: number, head, fault } = log.audit(None)?;
    let audit = match fault {
        None => Audit::Good { entries: number, head },
        Some(BadEntry { sequence, reason, .. }) => Audit::Broken { sequence, reason },
    };
    Ok(Reviewed { entries, state, audit })
}

/// Refuses to write into `folder` if it is an inspection's in a data folder: what is kept is what was measured, and its digests are
/// noted. `instead` says what can be done.
///
/// # Errors
/// [`Failure::Call`] naming both folders.
pub(super) fn refuse_kept(folder: &Path, instead: &str) -> Result<(), Failure> {
    let Some(data) = kept_in(folder) else { return Ok(()) };
    let (folder, data) = (folder.display(), data.display());
    Err(Failure::Call(anyhow!("{folder}: is kept in the data folder {data}, whose files stay as they are; {instead}")))
}

/// The data folder that keeps the inspection in `folder`, `DATA/inspections/ID`.
fn kept_in(folder: &Path) -> Option<PathBuf> {
    let folder = folder.canonicalize().ok()?;
    let inspections = folder.parent().filter(|parent| parent.ends_with("inspections"))?;
    let data = inspections.parent()?;
    data.join("semascan.db").is_file().then(|| data.to_owned())
}

/// The capture of an inspection that is kept in a data folder.
pub(super) fn capture(folder: &Path, record: &InspectionRecord) -> Option<String> {
    let path = kept_in(folder)?.join("captures").join(format!("{}.mcap", record.id));
    path.is_file().then(|| path.to_str().map(str::to_owned))?
}

/// The pictures of a view, at the pose that the record has for it.
fn picture(views: &mut RecordedViews, record: &InspectionRecord, index: u32) -> Result<ViewPicture<'static>, String> {
    let recorded = record.views.iter().find(|view| view.index == index).ok_or("is not in the record")?;
    let pose = recorded.pose.as_ref().ok_or("has no pose in the record")?;
    let view = views.view(recorded)?;
    Ok(ViewPicture {
        rgb: Arc::clone(&view.rgb),
        depth: Cow::Owned(view.depth.metres.clone()),
        intrinsics: view.intrinsics,
        table_from_camera: table_from_camera(pose).ok_or("has no whole pose in the record")?,
    })
}
