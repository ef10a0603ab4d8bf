//! The data folder as a whole: opened by one process at a time, which begins, continues and closes inspections in it.

use super::catalogue::FileRow;
use super::{CaptureFile, LocalBlobs, SqliteCatalogue};
use crate::contents::RECORD;
use crate::lock::FolderLock;
use crate::{ResultFolder, StoreError};
use jiff::Timestamp;
use semascan_captures::{CaptureInfo, CaptureReader, CaptureWriter};
use semascan_formats::regular_file;
use semascan_inspection::criteria::CheckedCriteria;
use semascan_inspection::journal::SharedCaptures;
use semascan_inspection::ports::{
    Blobs, Catalogue, InspectionFilter, InspectionRow, InspectionState, Obstacle, PortError, ResultRows,
};
use semascan_inspection::source::Source;
use semascan_model::InspectionId;
use semascan_model::record::{InspectionRecord, Outcome};
use sha2::{Digest, Sha256};
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

/// The name of the database.
pub(super) const DATABASE: &str = "semascan.db";

/// The data folder of an agent.
pub struct DataFolder {
    folder: PathBuf,
    catalogue: Arc<SqliteCatalogue>,
    blobs: LocalBlobs,
    /// Absent where the folder is only looked at.
    _lock: Option<FolderLock>,
}

/// An inspection that was killed: the catalogue says that it runs, and nobody runs it.
#[derive(Clone, Debug)]
pub struct Interrupted {
    /// Its row.
    pub row: InspectionRow,
    /// The captured views that are whole; `None` where not even the source was recorded.
    pub captured: Option<u32>,
}

/// An inspection that is kept in a data folder while it runs.
pub struct KeptInspection {
    /// Its captures, which the source fills and the journal makes durable.
    pub captures: SharedCaptures,
    /// Its catalogue.
    pub catalogue: Arc<SqliteCatalogue>,
}

impl DataFolder {
    /// Opens the data folder `folder`, which is made if it is not there, for the only process that writes into it.
    ///
    /// # Errors
    /// [`StoreError`]: another process holds it, or a file in it cannot be used.
    pub fn open(folder: &Path) -> Result<Self, StoreError> {
        fs::create_dir_all(folder).map_err(StoreError::io(folder))?;
        let lock = FolderLock::acquire(folder)?;
        for name in ["captures", "inspections", "blobs"] {
            let path = folder.join(name);
            fs::create_dir_all(&path).map_err(StoreError::io(&path))?;
        }
        crate::write::remove_temporary_files(folder)?;
        let catalogue = Arc::new(SqliteCatalogue::open(&folder.join(DATABASE))?);
        crate::write::sync_folder(folder)?;
        let blobs = LocalBlobs::open(&folder.join("blobs"))?;
        let data = Self { folder: folder.to_owned(), catalogue, blobs, _lock: Some(lock) };
        data.note_results()?;
        Ok(data)
    }

    /// Notes the results of inspections that an earlier version closed without them. Those whose record cannot be read stay
    /// without one, and it is said how many.
    fn note_results(&self) -> Result<(), StoreError> {
        let mut unknown = 0;
        for id in self.catalogue.without_result()? {
            match self.record(id) {
                Ok(Some(record)) => self.catalogue.set_result(id, &ResultRows::of(&record))?,
                // Cut off before there was one: nobody looked for anything.
                Ok(None) => self.catalogue.set_result(id, &ResultRows::default())?,
                Err(error) => {
                    unknown += 1;
                    tracing::warn!("{error}");
                }
            }
        }
        if unknown > 0 {
            tracing::warn!(
                "{unknown} inspections have no record that can be read: no filter by findings or verdict finds them"
            );
        }
        Ok(())
    }

    /// The record of an inspection as it was measured and judged; `None` where there is none.
    ///
    /// # Errors
    /// [`StoreError`] naming the file that cannot be read or is no record.
    pub fn record(&self, id: InspectionId) -> Result<Option<InspectionRecord>, StoreError> {
        let path = self.result_path(id).join(RECORD);
        match regular_file::read_to_string(&path) {
            Ok(text) => match InspectionRecord::from_json(&text) {
                Ok(record) => Ok(Some(record)),
                Err(error) => Err(PortError::new(path.display(), error).into()),
            },
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(StoreError::io(&path)(error)),
        }
    }

    /// Opens the data folder `folder` to look at it, also while another process writes into it.
    ///
    /// # Errors
    /// [`StoreError`]: there is none, or a file in it cannot be used.
    pub fn open_beside(folder: &Path) -> Result<Self, StoreError> {
        let database = folder.join(DATABASE);
        fs::metadata(&database).map_err(StoreError::io(&database))?;
        let catalogue = Arc::new(SqliteCatalogue::open_existing(&database)?);
        let blobs = LocalBlobs::open(&folder.join("blobs"))?;
        Ok(Self { folder: folder.to_owned(), catalogue, blobs, _lock: None })
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        &self.folder
    }

    /// Its rows.
    pub fn catalogue(&self) -> &Arc<SqliteCatalogue> {
        &self.catalogue
    }

    /// Its blobs.
    pub fn blobs(&self) -> &LocalBlobs {
        &self.blobs
    }

    /// The file with the captures of an inspection.
    pub fn capture_path(&self, id: InspectionId) -> PathBuf {
        self.folder.join("captures").join(format!("{id}.mcap"))
    }

    /// The folder with the record and the model of an inspection.
    pub fn result_path(&self, id: InspectionId) -> PathBuf {
        self.folder.join("inspections").join(id.to_string())
    }

    /// Begins to keep an inspection of `source`: its row, and its captures.
    ///
    /// # Errors
    /// [`StoreError`] naming the file.
    pub fn begin(&self, row: &InspectionRow, source: &dyn Source) -> Result<KeptInspection, StoreError> {
        self.catalogue.begin(row)?;
        self.capture_anew(row.id, source)
    }

    /// Goes on keeping an inspection that was killed. What was captured stays, to its last whole view.
    ///
    /// # Errors
    /// [`StoreError`] naming the file.
    pub fn continued(&self, interrupted: &Interrupted, source: &dyn Source) -> Result<KeptInspection, StoreError> {
        if interrupted.captured.is_none() {
            return self.capture_anew(interrupted.row.id, source);
        }
        let writer = CaptureWriter::reopen(&self.capture_path(interrupted.row.id))?;
        Ok(self.kept(writer))
    }

    fn capture_anew(&self, id: InspectionId, source: &dyn Source) -> Result<KeptInspection, StoreError> {
        let path = self.capture_path(id);
        match fs::remove_file(&path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(StoreError::io(&path)(error)),
            _ => {}
        }
        let info = CaptureInfo::new(source.info(), source.truth());
        Ok(self.kept(CaptureWriter::create(&path, &info, source.truth())?))
    }

    fn kept(&self, writer: CaptureWriter) -> KeptInspection {
        let captures: SharedCaptures = Arc::new(Mutex::new(CaptureFile::new(writer)));
        KeptInspection { captures, catalogue: Arc::clone(&self.catalogue) }
    }

    /// Inspections that were killed, the earliest first. Called by who holds the folder.
    ///
    /// # Errors
    /// [`StoreError`] naming the database.
    pub fn interrupted(&self) -> Result<Vec<Interrupted>, StoreError> {
        let filter = InspectionFilter { state: Some(InspectionState::Running), ..InspectionFilter::default() };
        let mut rows = self.catalogue.inspections(&filter)?;
        rows.reverse();
        let with_captures = |row: InspectionRow| {
            let captured = whole_views(&self.capture_path(row.id))?;
            Ok(Interrupted { row, captured })
        };
        rows.into_iter().map(with_captures).collect()
    }

    /// Keeps the text of criteria that an inspection was judged by; keeping it twice is harmless.
    ///
    /// # Errors
    /// [`StoreError`] naming the blob.
    pub fn keep_criteria(&self, criteria: &CheckedCriteria) -> Result<(), StoreError> {
        self.blobs.put(criteria.text.as_bytes())?;
        Ok(())
    }

    /// Closes an inspection whose record is in its folder, with the digests of all that is kept of it.
    ///
    /// # Errors
    /// [`StoreError`] naming the file.
    pub fn close(&self, record: &InspectionRecord) -> Result<(), StoreError> {
        let (state, reason) = match &record.outcome {
            Outcome::Finished => (InspectionState::Finished, None),
            Outcome::Stopped => (InspectionState::Stopped, None),
            Outcome::Failed { reason } => (InspectionState::Failed, Some(reason.as_str())),
            Outcome::Running => return Ok(()),
        };
        self.note_files(record.id)?;
        self.catalogue.set_result(record.id, &ResultRows::of(record))?;
        let ended = record.ended.unwrap_or_else(Timestamp::now);
        Ok(self.catalogue.close(record.id, ended, state, reason)?)
    }

    /// Closes an inspection that was killed and cannot be continued because of `reason`; its record says so.
    ///
    /// # Errors
    /// [`StoreError`] naming the file.
    pub fn close_interrupted(&self, row: &InspectionRow, reason: &str) -> Result<(), StoreError> {
        let folder = self.result_path(row.id);
        if let Ok(text) = fs::read_to_string(folder.join("inspection.json"))
            && let Ok(record) = InspectionRecord::from_json(&text)
            && record.outcome == Outcome::Running
        {
            let outcome = Outcome::Failed { reason: format!("interrupted: {reason}") };
            let record = InspectionRecord { outcome, ..record };
            ResultFolder::open(&folder, true)?.publish_record(&record)?;
        }
        self.note_files(row.id)?;
        let result = self.record(row.id)?.as_ref().map(ResultRows::of);
        self.catalogue.set_result(row.id, &result.unwrap_or_default())?;
        let state = InspectionState::Interrupted;
        Ok(self.catalogue.close(row.id, Timestamp::now(), state, Some(reason))?)
    }

    /// Notes the digests of an inspection's files: of its capture, and of what its folder holds.
    fn note_files(&self, id: InspectionId) -> Result<(), StoreError> {
        let mut files = Vec::new();
        let capture = self.capture_path(id);
        if capture.exists() {
            files.push(digest(&capture, format!("captures/{id}.mcap"))?);
        }
        let folder = self.result_path(id);
        let mut folders = vec![(folder, format!("inspections/{id}"))];
        while let Some((folder, name)) = folders.pop() {
            let entries = match fs::read_dir(&folder) {
                Ok(entries) => entries,
                Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
                Err(error) => return Err(StoreError::io(&folder)(error)),
            };
            for entry in entries {
                let path = entry.map_err(StoreError::io(&folder))?.path();
                let own = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
                if own.starts_with('.') {
                    continue;
                }
                let name = format!("{name}/{own}");
                if path.is_dir() {
                    folders.push((path, name));
                } else {
                    files.push(digest(&path, name)?);
                }
            }
        }
        Ok(self.catalogue.set_files(id, &files)?)
    }
}

/// The whole views of a capture; `None` where it does not even say what its source is, or is not there. One that cannot be read
/// now is an error: its views are not lost.
fn whole_views(path: &Path) -> Result<Option<u32>, StoreError> {
    let mut reader = match CaptureReader::open(path) {
        Ok(reader) => reader,
        Err(error) if Obstacle::of(&error).is_some() => return Err(error.into()),
        Err(_) => return Ok(None),
    };
    let mut views = 0;
    while let Some(Ok(_)) = reader.next_view() {
        views += 1;
    }
    Ok(Some(views))
}

/// The row of the file at `path`, which is called `name` in the data folder.
pub(super) fn digest(path: &Path, name: String) -> Result<FileRow, StoreError> {
    let mut file = File::open(path).map_err(StoreError::io(path))?;
    let mut hasher = Sha256::new();
    let mut buffer = vec![0; 1 << 16];
    let mut bytes = 0;
    loop {
        let read = io::Read::read(&mut file, &mut buffer).map_err(StoreError::io(path))?;
        let Some(part) = buffer.get(..read).filter(|part| !part.is_empty()) else { break };
        hasher.update(part);
        bytes += read as u64;
    }
    let sha256 = semascan_inspection::ports::BlobDigest(hasher.finalize().into()).to_string();
    Ok(FileRow { name, sha256, bytes })
}

impl From<PortError> for StoreError {
    fn from(error: PortError) -> Self {
        Self::Port(error)
    }
}
