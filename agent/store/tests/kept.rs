//! An inspection that is kept: what a subscriber learns of is on the disk already, also where the disk is full at times.

use jiff::Timestamp;
use semascan_captures::{CaptureInfo, CaptureReader, CaptureWriter};
use semascan_inspection::Inspection;
use semascan_inspection::event::{EventKind, InspectionEvent, ProcessedView};
use semascan_inspection::journal::{Journal, SharedCaptures};
use semascan_inspection::ports::{Captures, Catalogue, InspectionRow, InspectionState, PortError, ResultRow};
use semascan_inspection::recording::Recording;
use semascan_inspection::source::{Source, SourceError};
use semascan_inspection::spec::InspectionSpec;
use semascan_perception::view::View;
use semascan_simulation::{VirtualCell, VirtualCellSpec};
use semascan_store::data::{CaptureFile, SqliteCatalogue};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

const VIEWS: u32 = 3;

/// Captures on a disk that is full at times.
struct OnFullDisk {
    inner: CaptureFile,
    /// Tries to sync, by number, that fail.
    failing: Range<u32>,
    tries: u32,
}

impl Captures for OnFullDisk {
    fn views(&self) -> u32 {
        self.inner.views()
    }

    fn append(&mut self, view: &Result<View, SourceError>, settings: &[(String, String)]) -> Result<(), PortError> {
        self.inner.append(view, settings)
    }

    fn append_segmentation(&mut self, index: u32, view: &ProcessedView) -> Result<(), PortError> {
        self.inner.append_segmentation(index, view)
    }

    fn sync(&mut self) -> Result<(), PortError> {
        self.tries += 1;
        if self.failing.contains(&(self.tries - 1)) {
            return Err(PortError::new("x.mcap", "no space left on device"));
        }
        self.inner.sync()
    }

    fn finish(&mut self) -> Result<(), PortError> {
        self.inner.finish()
    }
}

struct Kept {
    inspection: Inspection,
    catalogue: Arc<SqliteCatalogue>,
    capture: PathBuf,
    said: Arc<Mutex<Vec<String>>>,
}

/// An inspection of a simulated motor that is kept in `root`, on a disk that is full at the tries `failing`.
fn kept(root: &Path, failing: Range<u32>) -> Kept {
    let uri = format!("virtual:starter-motor?seed=3&views={VIEWS}&size=96x72&cell=4");
    let source = VirtualCell::open(&VirtualCellSpec::parse(&uri).expect("a source")).expect("a cell");
    let catalogue = Arc::new(SqliteCatalogue::open(&root.join("semascan.db")).expect("opens"));
    let capture = root.join("x.mcap");
    let info = CaptureInfo::new(source.info(), source.truth());
    let writer = CaptureWriter::create(&capture, &info, source.truth()).expect("a capture");
    let inner = CaptureFile::new(writer);
    let captures: SharedCaptures = Arc::new(Mutex::new(OnFullDisk { inner, failing, tries: 0 }));
    let row = InspectionRow {
        id: Inspection::new_id(),
        part: source.info().part.clone(),
        source: uri,
        spec: "{}".into(),
        began: Timestamp::now(),
        ended: None,
        state: InspectionState::Running,
        reason: None,
        held: false,
        views: 0,
        result: ResultRow::default(),
    };
    catalogue.begin(&row).expect("begun");
    let recording = Recording::new(Box::new(source), Arc::clone(&captures));
    let inspection = Inspection::new(InspectionSpec::default(), Box::new(recording)).expect("an inspection");
    let inspection = inspection.continuing(row.id, row.began);
    let said: Arc<Mutex<Vec<String>>> = Arc::default();
    let told = Arc::clone(&said);
    let journal = Journal::new(row.id, catalogue.clone(), captures).expect("a journal");
    inspection.keep(journal, Box::new(move |text| told.lock().expect("whole").push(text.to_owned())));
    Kept { inspection, catalogue, capture, said }
}

/// Asserts that all that `event` acknowledges is on the disk.
fn assert_durable(event: &InspectionEvent, catalogue: &SqliteCatalogue, capture: &Path) {
    let EventKind::ViewFinished { record, .. } = &event.kind else { return };
    let rows = catalogue.views(event.inspection).expect("reads");
    assert!(rows.iter().any(|row| row.index == record.index), "view {} has no row", record.index);
    let mut reader = CaptureReader::open(capture).expect("a capture");
    let views = std::iter::from_fn(|| reader.next_view()).filter(Result::is_ok).count();
    assert!(views > record.index as usize, "view {} is not captured", record.index);
}

#[test]
fn a_view_is_on_the_disk_before_it_is_acknowledged_also_after_the_disk_was_full() {
    // Never, at the beginning, and in the middle.
    for failing in [0..0, 0..4, 2..6] {
        let root = tempfile::tempdir().expect("a folder");
        let Kept { inspection, catalogue, capture, said } = kept(root.path(), failing.clone());
        let (id, events) = (inspection.id(), inspection.subscribe());
        let handle = inspection.start();
        let events: Vec<_> = events.inspect(|event| assert_durable(event, &catalogue, &capture)).collect();
        let inspected = handle.wait().expect("a model");
        assert_eq!((inspected.record.id, inspected.record.views.len()), (id, VIEWS as usize));
        let rows = catalogue.events(id, 0, u32::MAX).expect("reads");
        assert_eq!(rows.len(), events.len(), "every event is kept");
        for (row, event) in rows.iter().zip(&events) {
            assert_eq!((row.sequence, row.time), (event.sequence, event.time));
            assert_eq!(row.kind, serde_json::to_string(&event.kind).expect("plain data"));
        }
        let waiting = catalogue.waiting(u32::MAX).expect("reads");
        let views = waiting.iter().filter(|message| message.subject == format!("inspection.{id}.view_finished"));
        assert_eq!(views.count(), VIEWS as usize);
        let said = said.lock().expect("whole");
        if failing.is_empty() {
            assert!(said.is_empty(), "{said:?}");
        } else {
            assert!(said[0].contains("no space left on device") && said.last().is_some_and(String::is_empty));
        }
    }
}

#[test]
fn a_view_that_cannot_be_kept_is_acknowledged_to_nobody() {
    let root = tempfile::tempdir().expect("a folder");
    let Kept { inspection, catalogue, said, .. } = kept(root.path(), 1..u32::MAX);
    let (id, events) = (inspection.id(), inspection.subscribe());
    let handle = inspection.start();
    let stop = handle.stop_switch();
    // Only the begin could be kept: the inspection waits with its first view, and then somebody stops it.
    std::thread::spawn(move || {
        while said.lock().expect("whole").is_empty() {
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        stop.set();
    });
    assert_eq!(events.filter(|event| matches!(event.kind, EventKind::ViewFinished { .. })).count(), 0);
    // The view is in the model, and in no record.
    assert!(handle.wait().is_ok_and(|inspected| inspected.record.views.is_empty()));
    assert_eq!(catalogue.views(id), Ok(vec![]));
    let row = catalogue.inspection(id).expect("reads").expect("there");
    assert_eq!(row.state, InspectionState::Running, "the next start finds it");
}
