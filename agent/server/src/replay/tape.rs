//! A past inspection as it is streamed again: its recorded events in their order and with their times, and with each what
//! clients were sent beside it.
//!
//! Chunks and pictures are not kept while an inspection runs. They are made once more: the inspection is made again from its
//! captured views with the settings of then, through the same pipeline and the same encoder, and what it attaches to an event
//! is put to the recorded event that says the same. As nothing depends on time or threads, the final model is that of then, bit
//! for bit; that is compared, and where it is not so (another version of the program, other networks) viewers are told. What
//! may differ in between is how far ahead of its event the model was when its chunks were read, as it may between two runs.

use crate::live::LiveModel;
use crate::live_stream::{Attachment, LiveStream};
use crate::messages::view_report;
use crate::past::Past;
use semascan_inspection::event::{EventKind, InspectionEvent};
use semascan_inspection::ports::{InspectionRow, InspectionState, PortError};
use semascan_model::finding::FindingKind;
use semascan_model::record::InspectionRecord;
use semascan_model::{InspectionId, Taxonomy};
use semascan_protocol::ViewReport;
use std::collections::BTreeMap;

/// Events that are read from the catalogue at once.
const PAGE: u32 = 1000;
/// Bytes of pictures that are kept; later views are reported without, and that is said.
const PICTURES: usize = 64 << 20;

/// An event and what goes out with it.
#[derive(Clone, Debug)]
pub(super) struct Step {
    pub(super) event: InspectionEvent,
    pub(super) attached: Attachment,
}

/// A past inspection, ready to be streamed.
#[derive(Debug)]
pub(crate) struct Tape {
    pub(super) steps: Vec<Step>,
    /// What viewers are told when it is over; empty where the model is that of then.
    pub(super) remark: String,
}

/// What an event is about, for those that something is attached to. An inspection that was cut off and continued has some of
/// them twice; what is attached is the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Key {
    Model { epoch: u32, view: Option<u32>, complete: bool },
    View(u32),
}

fn key(kind: &EventKind) -> Option<Key> {
    match kind {
        EventKind::ModelChanged { epoch, view, complete, .. } => {
            Some(Key::Model { epoch: *epoch, view: *view, complete: *complete })
        }
        EventKind::ViewFinished { record, .. } => Some(Key::View(record.index)),
        _ => None,
    }
}

impl Tape {
    /// The tape of an inspection: waits until it was made again.
    ///
    /// # Errors
    /// [`PortError`] naming what is missing.
    pub(super) fn make(past: &Past, row: &InspectionRow) -> Result<Self, PortError> {
        let id = row.id;
        let recorded = recorded_events(past, id)?;
        let place = || format!("inspection {id}");
        if row.state == InspectionState::Running {
            return Err(PortError::new(place(), "has not ended: it is followed live, or continued by the next start"));
        }
        let inspection = past.remake.again(id)?;
        let events = inspection.subscribe();
        let handle = inspection.start();
        // The chunks are encoded against what was published before them, as they are for viewers.
        let scratch = LiveModel::new();
        let mut stream = LiveStream::new(&scratch);
        let mut attached = BTreeMap::new();
        let (mut bytes, mut without_pictures) = (0, 0_u32);
        for event in events {
            let mut attachment = stream.attach(&event);
            if let Attachment::Report(report) = &mut attachment {
                let size = pictures(report);
                if bytes + size > PICTURES {
                    drop_pictures(report);
                    without_pictures += 1;
                } else {
                    bytes += size;
                }
            }
            if let Some(key) = key(&event.kind) {
                attached.insert(key, attachment.clone());
            }
            crate::live_stream::apply(&scratch, &event, attachment);
        }
        let remade = match handle.wait() {
            Ok(inspected) => Some(inspected.record),
            Err(error) => error.into_record(),
        };
        let then = past.archive.record(id)?;
        let mut taxonomy = Taxonomy::from_names::<&str>(&[], &[]);
        let (mut steps, mut missing) = (Vec::new(), 0_u32);
        for event in recorded {
            if let EventKind::Started { taxonomy: own, .. } = &event.kind {
                taxonomy = own.clone();
            }
            let found = key(&event.kind).map(|key| attached.get(&key).cloned());
            let attached = match (&event.kind, found) {
                (_, None) => Attachment::Nothing,
                (EventKind::ViewFinished { record, .. }, Some(remade)) => {
                    let mut report = view_report(record, None, &taxonomy);
                    if let Some(Attachment::Report(remade)) = remade {
                        take_pictures(&mut report, *remade);
                    }
                    Attachment::Report(Box::new(report))
                }
                (_, Some(Some(chunks))) => chunks,
                (_, Some(None)) => {
                    missing += 1;
                    Attachment::Nothing
                }
            };
            steps.push(Step { event, attached });
        }
        let mut remarks = Vec::new();
        if !is_same(then.as_ref(), remade.as_ref()) {
            remarks.push(
                "made again it differs from what was kept: another version of the program or its networks".into(),
            );
        }
        if missing > 0 {
            remarks.push(format!("{missing} changes of the model could not be made again"));
        }
        if without_pictures > 0 {
            remarks.push(format!("{without_pictures} views are shown without pictures"));
        }
        Ok(Self { steps, remark: remarks.join("; ") })
    }
}

/// The history of an inspection, oldest first.
fn recorded_events(past: &Past, id: InspectionId) -> Result<Vec<InspectionEvent>, PortError> {
    let mut events: Vec<InspectionEvent> = Vec::new();
    loop {
        let from = events.last().map_or(0, |event| event.sequence + 1);
        let page = past.catalogue.events(id, from, PAGE)?;
        if page.is_empty() {
            return Ok(events);
        }
        for row in page {
            let kind = serde_json::from_str(&row.kind)
                .map_err(|error| PortError::new(format!("event {} of inspection {id}", row.sequence), error))?;
            events.push(InspectionEvent { inspection: id, sequence: row.sequence, time: row.time, kind });
        }
    }
}

/// Whether two runs came to the same: points, figures, poses and findings to the last bit.
fn is_same(then: Option<&InspectionRecord>, now: Option<&InspectionRecord>) -> bool {
    let (Some(then), Some(now)) = (then, now) else { return then.is_none() && now.is_none() };
    // What was expected of the part was found when it was judged, not when it was inspected.
    let defects = |record: &InspectionRecord| {
        let list = record.findings.iter().flat_map(|findings| &findings.list);
        let measured = list.filter(|finding| matches!(finding.kind, FindingKind::Defect { .. }));
        measured
            .map(|finding| (finding.component.clone(), finding.kind.clone(), finding.region.clone()))
            .collect::<Vec<_>>()
    };
    let poses = |record: &InspectionRecord| record.views.iter().map(|v| (v.accepted, v.pose)).collect::<Vec<_>>();
    then.points == now.points
        && then.voxel == now.voxel
        && then.components == now.components
        && then.defects == now.defects
        && poses(then) == poses(now)
        && defects(then) == defects(now)
}

fn pictures(report: &ViewReport) -> usize {
    [&report.thumbnail_jpeg, &report.overlay_png, &report.sigma_png, &report.contribution_png]
        .iter()
        .map(|picture| picture.len())
        .sum()
}

fn drop_pictures(report: &mut ViewReport) {
    for picture in
        [&mut report.thumbnail_jpeg, &mut report.overlay_png, &mut report.sigma_png, &mut report.contribution_png]
    {
        *picture = Vec::new();
    }
    report.pictures_dropped = true;
}

/// What of a report is not in the record: pictures, and the camera that they are of.
fn take_pictures(report: &mut ViewReport, remade: ViewReport) {
    report.intrinsics = remade.intrinsics;
    report.thumbnail_jpeg = remade.thumbnail_jpeg;
    report.overlay_png = remade.overlay_png;
    report.sigma_png = remade.sigma_png;
    report.contribution_png = remade.contribution_png;
    report.pictures_dropped = remade.pictures_dropped;
}
