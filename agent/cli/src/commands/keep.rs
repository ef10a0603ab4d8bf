//! `--data DIR`: inspections that are kept while they run, and that are continued after a crash.

use super::Failure;
use super::criteria_file::CriteriaFile;
use super::keeping::Keeping;
use super::run::{Target, check_labels};
use super::source::open;
use anyhow::{Context, anyhow};
use semascan_inspection::criteria::CheckedCriteria;
use semascan_inspection::journal::{Journal, Trouble};
use semascan_inspection::ports::{InspectionRow, InspectionState, ResultRow};
use semascan_inspection::recording::{Continued, Recording};
use semascan_inspection::source::Source;
use semascan_inspection::spec::InspectionSpec;
use semascan_inspection::{Inspection, inspected_taxonomy};
use semascan_planning::planned;
use semascan_sources::mcap::McapSource;
use semascan_store::data::{DataFolder, Interrupted};
use std::path::{Path, absolute};
use std::sync::Arc;

/// A source that is named by a path, whatever the folder that the agent is started in next.
pub(crate) fn anchored(mut spec: InspectionSpec) -> InspectionSpec {
    if let Some(uri) = &spec.source.uri
        && Path::new(uri).exists()
        && let Ok(path) = absolute(uri)
        && let Some(path) = path.to_str()
    {
        spec.source.uri = Some(path.to_owned());
    }
    spec
}

/// An inspection as `spec` says that is kept in `data` from its first view on and judged by `criteria`; it continues
/// `interrupted` if that is given. `told` learns of what keeps it from being kept.
///
/// # Errors
/// [`Failure`] if it cannot begin. An interrupted one is then closed as such, unless an obstacle is the reason, which may be over
/// later.
pub(crate) fn prepare(
    spec: InspectionSpec,
    data: &Arc<DataFolder>,
    criteria: Option<&CriteriaFile>,
    interrupted: Option<&Interrupted>,
    told: Trouble,
) -> Result<(Inspection, Target), Failure> {
    match begin(spec, data, criteria, interrupted, told) {
        Err(failure) => {
            if let Some(Interrupted { row, .. }) = interrupted
                && failure.obstacle().is_none()
            {
                let reason = format!("it was cut off and cannot be continued: {}", failure.reason());
                tracing::warn!("inspection {}: {reason}", row.id);
                data.close_interrupted(row, &reason)?;
            }
            Err(failure)
        }
        prepared => prepared,
    }
}

fn begin(
    spec: InspectionSpec,
    data: &Arc<DataFolder>,
    criteria: Option<&CriteriaFile>,
    interrupted: Option<&Interrupted>,
    told: Trouble,
) -> Result<(Inspection, Target), Failure> {
    let uri = spec.source.uri.clone().ok_or_else(|| Failure::Call(anyhow!("no source is named")))?;
    check_labels(&spec)?;
    let source = open(&uri, &spec)?;
    let criteria = fitting(criteria, &spec, source.as_ref(), interrupted.is_some())?;
    let row = match interrupted {
        Some(Interrupted { row, .. }) => row.clone(),
        None => InspectionRow {
            id: Inspection::new_id(),
            part: source.info().part.clone(),
            source: uri,
            spec: serde_json::to_string(&spec).context("the settings cannot be written")?,
            began: jiff::Timestamp::now(),
            ended: None,
            state: InspectionState::Running,
            reason: None,
            held: false,
            views: 0,
            result: ResultRow::default(),
        },
    };
    let (source, kept): (Box<dyn Source>, _) = match interrupted {
        Some(interrupted) => {
            let views = interrupted.captured.unwrap_or(0);
            if views < row.views {
                return Err(Failure::Work(anyhow!(
                    "{}: holds {views} whole views of {} that were committed",
                    data.capture_path(row.id).display(),
                    row.views
                )));
            }
            let kept = data.continued(interrupted, source.as_ref())?;
            let source: Box<dyn Source> = if views == 0 {
                source
            } else {
                let recorded = McapSource::first_views(&data.capture_path(row.id), views)?;
                Box::new(Continued::new(Box::new(recorded), source, views)?)
            };
            tracing::info!("inspection {} was cut off after {views} captured views and is continued", row.id);
            (source, kept)
        }
        None => {
            let kept = data.begin(&row, source.as_ref())?;
            (source, kept)
        }
    };
    let recording = Recording::new(source, Arc::clone(&kept.captures));
    let plan = spec.plan.clone();
    let planned = Inspection::new(spec, Box::new(recording)).and_then(|inspection| planned(inspection, &plan));
    let made = planned.map_err(Failure::from).and_then(|inspection| {
        let inspection = inspection.continuing(row.id, row.began);
        inspection.keep(Journal::new(row.id, kept.catalogue, Arc::clone(&kept.captures))?, told);
        let folder = data.result_path(row.id);
        let kept = Keeping::new(Arc::clone(data), kept.captures);
        Ok((inspection, Target::open(&folder, true, false)?.kept(kept).judged_by(criteria)))
    });
    if let (Err(failure), None) = (&made, interrupted)
        && failure.obstacle().is_none()
    {
        data.close_interrupted(&row, &failure.reason())?;
    }
    made
}

/// The criteria that an inspection as `spec` says is judged by: those of the command, if they know no other classes than it has.
/// One that is continued may have begun with other ones; it goes on, and is not judged, which is said.
fn fitting(
    criteria: Option<&CriteriaFile>,
    spec: &InspectionSpec,
    source: &dyn Source,
    is_continued: bool,
) -> Result<Option<Arc<CheckedCriteria>>, Failure> {
    let Some(criteria) = criteria else { return Ok(None) };
    match criteria.for_classes(spec, &inspected_taxonomy(spec, source)?) {
        Err(failure) if is_continued => {
            tracing::warn!("the inspection that is continued is not judged: {}", failure.reason());
            Ok(None)
        }
        fitting => fitting.map(Some),
    }
}
