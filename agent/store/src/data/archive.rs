//! What a data folder keeps of inspections, read back.

use super::DataFolder;
use crate::contents::RECORD;
use crate::lock::beside;
use crate::{SavedError, StoreError, read_inspection};
use semascan_captures::{CaptureReader, Wanted};
use semascan_formats::{ply, regular_file};
use semascan_inspection::criteria::CheckedCriteria;
use semascan_inspection::ports::{Archive, ArchivedFile, ArchivedView, BlobDigest, Blobs, Catalogue, PortError};
use semascan_inspection::record::isometry;
use semascan_inspection::spec::InspectionSpec;
use semascan_model::record::{InspectionRecord, ViewRecord};
use semascan_model::{InspectionId, SemanticCloud, SemanticMesh, Taxonomy};
use semascan_perception::fuse::KeptDepth;
use std::fs::{self, File};
use std::io::{self, Write};

/// Bytes for which there must be room, so that something more can be kept.
const ROOM: usize = 1 << 20;

impl Archive for DataFolder {
    fn record(&self, id: InspectionId) -> Result<Option<InspectionRecord>, PortError> {
        DataFolder::record(self, id).map_err(|error| match error {
            StoreError::Port(error) => error,
            StoreError::Io { path, source } => PortError::of(path.display(), &source),
            error => PortError::of(self.result_path(id).display(), &error),
        })
    }

    fn file(&self, id: InspectionId, name: &str) -> Result<Option<ArchivedFile>, PortError> {
        // A name that the record does not know may lead anywhere.
        let is_known = name == RECORD
            || Archive::record(self, id)?
                .and_then(|r| r.files)
                .is_some_and(|files| files.names.iter().any(|n| n == name));
        if !is_known {
            return Ok(None);
        }
        let folder = self.result_path(id);
        let path = match regular_file::inside(&folder, name) {
            Ok(path) => path,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(PortError::of(folder.join(name).display(), &error)),
        };
        let failed = |error: io::Error| PortError::of(path.display(), &error);
        let content = match regular_file::open(&path) {
            Ok(content) => content,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(failed(error)),
        };
        let bytes = content.metadata().map_err(failed)?.len();
        let noted = format!("inspections/{id}/{name}");
        let files = self.catalogue().files(id)?.into_iter();
        let sha256 = files.filter(|file| file.name == noted && file.bytes == bytes).map(|file| file.sha256).next();
        Ok(Some(ArchivedFile { content: Box::new(content), bytes, sha256 }))
    }

    fn model(&self, id: InspectionId) -> Result<Option<(Taxonomy, SemanticCloud)>, PortError> {
        let folder = self.result_path(id);
        match read_inspection(&folder) {
            Ok(saved) => Ok(Some((saved.taxonomy, saved.cloud)).filter(|(_, cloud)| !cloud.is_empty())),
            Err(SavedError::NoRecord { .. }) => Ok(None),
            Err(SavedError::Io { source, .. }) if source.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(PortError::of(folder.display(), &error)),
        }
    }

    fn mesh(&self, id: InspectionId) -> Result<Option<(Taxonomy, SemanticMesh)>, PortError> {
        let Some(mut file) = self.file(id, "mesh.ply")? else { return Ok(None) };
        let path = self.result_path(id).join("mesh.ply");
        let mut bytes = Vec::new();
        file.content.read_to_end(&mut bytes).map_err(|error| PortError::of(path.display(), &error))?;
        let name = path.display().to_string();
        let model = ply::read(&name, &bytes).map_err(|error| PortError::new(&name, error))?;
        Ok(Some((model.taxonomy, model.mesh)).filter(|(_, mesh)| !mesh.triangles.is_empty()))
    }

    fn depths(
        &self,
        record: &InspectionRecord,
        each: &mut dyn FnMut(&KeptDepth<'_>),
    ) -> Result<Option<String>, PortError> {
        let path = self.capture_path(record.id);
        if !path.exists() {
            return Ok(Some("its capture is not kept".to_owned()));
        }
        let mut capture = CaptureReader::open(&path).map_err(super::captures::named)?;
        let mut wanted: Vec<&ViewRecord> = record.views.iter().filter(|view| view.accepted).collect();
        // Views that showed nothing new were captured and are not in the record: their times tell which one is which.
        let by_stamp = wanted.iter().all(|view| view.stamp.is_some());
        while let Some(recorded) = capture.next_view().filter(|_| !wanted.is_empty()) {
            let recorded = recorded.map_err(super::captures::named)?;
            let Ok(view) = recorded.view else { continue };
            let is_it = |known: &&ViewRecord| match (by_stamp, known.stamp, view.stamp) {
                (true, Some(known), Some(own)) => known.to_bits() == own.to_bits(),
                _ => known.index == recorded.index,
            };
            let Some(place) = wanted.iter().position(is_it) else { continue };
            let known = wanted.remove(place);
            let Some(pose) = &known.pose else { continue };
            each(&KeptDepth {
                index: known.index,
                intrinsics: view.intrinsics,
                metres: view.depth.metres.as_slice().into(),
                table_from_camera: isometry(pose),
            });
        }
        let missing = wanted.len();
        Ok((missing > 0)
            .then(|| format!("its capture does not have {missing} of the views that are part of the model")))
    }

    fn view(&self, id: InspectionId, index: u32) -> Result<Option<ArchivedView>, PortError> {
        let Some(row) = self.catalogue().inspection(id)? else { return Ok(None) };
        let path = self.capture_path(id);
        if !path.exists() {
            return Ok(None);
        }
        let spec: InspectionSpec = serde_json::from_str(&row.spec)
            .map_err(|error| PortError::new(format!("the settings of inspection {id}"), error))?;
        let wanted = if spec.source.leaves_out() {
            // Views that showed nothing new were captured and not inspected: they are counted in one order, not in the other.
            let views = self.catalogue().views(id)?;
            let Some(view) = views.into_iter().find(|view| view.index == index) else { return Ok(None) };
            let record: ViewRecord = serde_json::from_str(&view.record)
                .map_err(|error| PortError::new(format!("the record of view {index} of inspection {id}"), error))?;
            let Some(stamp) = record.stamp else {
                let reason = "keyframes of a source without capture times: which captured view it is cannot be told";
                return Err(PortError::new(format!("view {index} of inspection {id}"), reason));
            };
            Wanted::Stamp(stamp)
        } else {
            Wanted::Index(index)
        };
        CaptureReader::find(&path, wanted, index).map_err(super::captures::named)
    }

    fn writable(&self) -> Result<(), PortError> {
        let error = |error: io::Error| PortError::of(self.path().display(), &error);
        // A name that whoever opens the folder next removes.
        let probe = beside(&self.path().join("probe"), &uuid::Uuid::now_v7().to_string());
        let probe = probe.ok_or_else(|| error(io::Error::from(io::ErrorKind::InvalidFilename)))?;
        let written = File::create_new(&probe).and_then(|mut file| file.write_all(&vec![0; ROOM]));
        let removed = fs::remove_file(&probe);
        // Where it could not be made there is nothing to be removed.
        written.and(removed).map_err(error)
    }

    fn criteria(&self, sha256: &str) -> Result<Option<CheckedCriteria>, PortError> {
        let Ok(digest) = sha256.parse::<BlobDigest>() else { return Ok(None) };
        let Some(text) = self.blobs().get(&digest)? else { return Ok(None) };
        let failed = |error: &dyn std::fmt::Display| PortError::new(format!("the criteria {sha256}"), error);
        let text = String::from_utf8(text).map_err(|error| failed(&error))?;
        CheckedCriteria::parse(&text).map(Some).map_err(|error| failed(&error))
    }
}
