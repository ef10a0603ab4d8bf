//! Views of a capture in an MCAP file, as `semascan serve|inspect --data` records them: they come back bit for bit, so that
//! the same settings give the same model. A file that was cut is read to its last whole view.

use semascan_captures::{CaptureEnd, CaptureError, CaptureReader};
use semascan_formats::regular_file;
use semascan_inspection::source::{Source, SourceError, SourceInfo, TrueMesh};
use semascan_perception::view::View;
use std::path::{Path, PathBuf};

/// The first bytes of an MCAP file.
const MAGIC: &[u8] = b"\x89MCAP0\r\n";

/// The views of a capture.
pub struct McapSource {
    path: PathBuf,
    info: SourceInfo,
    truth: Option<TrueMesh>,
    reader: CaptureReader,
    /// Views to read at most.
    limit: u32,
    next: u32,
    is_cut_said: bool,
}

impl McapSource {
    /// Whether `path` is an MCAP file, or is called one.
    pub fn is_capture(path: &Path) -> bool {
        if path.is_dir() {
            return false;
        }
        path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("mcap"))
            || regular_file::open(path).is_ok_and(|mut file| {
                let mut first = [0; MAGIC.len()];
                std::io::Read::read_exact(&mut file, &mut first).is_ok() && first == MAGIC
            })
    }

    /// Opens the capture at `path`.
    ///
    /// # Errors
    /// [`SourceError`] naming the file: it cannot be read, or is no capture.
    pub fn open(path: &Path) -> Result<Self, SourceError> {
        Self::first_views(path, u32::MAX)
    }

    /// Opens the first `limit` views of the capture at `path`.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn first_views(path: &Path, limit: u32) -> Result<Self, SourceError> {
        regular_file::check(path).map_err(|source| SourceError::Io { path: path.to_owned(), source })?;
        let reader = CaptureReader::open(path).map_err(named)?;
        let mut info = reader.info().source_info(&path.display().to_string());
        info.settings.push(("recorded_from".to_owned(), reader.info().uri.clone()));
        let truth = reader.truth().cloned();
        Ok(Self { path: path.to_owned(), info, truth, reader, limit, next: 0, is_cut_said: false })
    }
}

impl Source for McapSource {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_view(&mut self) -> Option<Result<View, SourceError>> {
        if self.next >= self.limit {
            return None;
        }
        let Some(recorded) = self.reader.next_view() else {
            if self.reader.end() == Some(CaptureEnd::Cut) && !self.is_cut_said {
                self.is_cut_said = true;
                let said = format!("was cut off after its {} whole views", self.next);
                tracing::warn!("{}: {said}", self.path.display());
                self.info.settings.push(("recording".to_owned(), said));
            }
            return None;
        };
        self.next += 1;
        let recorded = match recorded.map_err(named) {
            Ok(recorded) => recorded,
            Err(error) => return Some(Err(error)),
        };
        for (name, value) in recorded.settings.into_iter().flatten() {
            match self.info.settings.iter_mut().find(|(own, _)| *own == name) {
                Some((_, own)) => *own = value,
                None => self.info.settings.push((name, value)),
            }
        }
        Some(recorded.view.map_err(|reason| SourceError::Format { path: self.path.clone(), reason }))
    }

    fn rewind(&mut self) -> bool {
        match CaptureReader::open(&self.path) {
            Ok(reader) => {
                (self.reader, self.next) = (reader, 0);
                true
            }
            Err(_) => false,
        }
    }

    fn truth(&self) -> Option<&TrueMesh> {
        self.truth.as_ref()
    }
}

fn named(error: CaptureError) -> SourceError {
    match error {
        CaptureError::Io { path, source } => SourceError::Io { path, source },
        CaptureError::Mcap { path, source } => SourceError::Format { path, reason: source.to_string() },
        CaptureError::Format { path, reason } => SourceError::Format { path, reason },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use semascan_captures::{CaptureInfo, CaptureWriter};
    use semascan_perception::view::PoseEvidence;
    use semascan_simulation::{VirtualCell, VirtualCellSpec};
    use std::fs;

    const MOTOR: &str = "virtual:starter-motor?seed=5&views=4&size=160x120&cell=4";

    fn motor() -> VirtualCell {
        VirtualCell::open(&VirtualCellSpec::parse(MOTOR).expect("a source")).expect("a cell")
    }

    /// Records the views of the motor; the third is one that the source could not give. Returns what was recorded.
    fn record(path: &Path, finish: bool) -> Vec<Result<View, SourceError>> {
        let mut source = motor();
        let info = CaptureInfo::new(source.info(), source.truth());
        let mut writer = CaptureWriter::create(path, &info, source.truth()).expect("a capture");
        let mut views = Vec::new();
        while let Some(view) = source.next_view() {
            let view = match views.len() {
                2 => Err(SourceError::Format { path: "depth/2.png".into(), reason: "is cut".into() }),
                // Every kind of evidence; a signed zero and a subnormal come back as they are.
                1 => view.map(|view| View {
                    pose: PoseEvidence::None,
                    stamp: Some(-0.0),
                    labels: None,
                    truth: None,
                    ..view
                }),
                3 => view.map(|view| View {
                    pose: PoseEvidence::World {
                        table_from_camera: view.truth.as_ref().expect("simulated").table_from_camera,
                        covariance: semascan_perception::view::covariance_of_prior(1e-3, 1e-310),
                    },
                    ..view
                }),
                _ => view,
            };
            let settings = [("given".to_owned(), views.len().to_string())];
            writer.append(&view, &settings).expect("taken in");
            writer.sync().expect("on the disk");
            views.push(view);
        }
        if finish {
            writer.finish().expect("finished");
        }
        // Dropping the writer writes nothing: so a capture looks whose writer was killed.
        views
    }

    fn assert_same(found: &Result<View, SourceError>, expected: &Result<View, SourceError>, place: usize) {
        match (found, expected) {
            (Ok(found), Ok(expected)) => {
                assert_eq!(found.index as usize, place);
                assert_eq!(found.stamp.map(f64::to_bits), expected.stamp.map(f64::to_bits));
                assert_eq!(found.intrinsics, expected.intrinsics);
                assert_eq!(found.rgb, expected.rgb);
                let bits = |view: &View| view.depth.metres.iter().map(|z| z.to_bits()).collect::<Vec<_>>();
                assert_eq!(bits(found), bits(expected));
                assert_eq!((&found.pose, &found.truth), (&expected.pose, &expected.truth));
                assert_eq!(found.labels, expected.labels);
            }
            (Err(found), Err(expected)) => assert!(found.to_string().ends_with(&expected.to_string()), "{found}"),
            (found, expected) => panic!("view {place}: {found:?} for {expected:?}"),
        }
    }

    #[test]
    fn views_source_and_truth_come_back_bit_for_bit_and_again_after_a_rewind() {
        let root = tempfile::tempdir().expect("a folder");
        let path = root.path().join("motor.mcap");
        let views = record(&path, true);
        assert_eq!(views.len(), 4);
        assert!(matches!(&views[0], Ok(View { pose: PoseEvidence::Chain { .. }, labels: Some(_), .. })));
        let mut source = McapSource::open(&path).expect("a capture");
        let (original, truth) = (motor(), source.truth().cloned().expect("truth"));
        let expected = original.truth().expect("truth");
        assert_eq!((&truth.vertices, &truth.triangles), (&expected.vertices, &expected.triangles));
        assert_eq!((&truth.labels, &truth.defects), (&expected.labels, &expected.defects));
        assert_eq!(truth.taxonomy, expected.taxonomy);
        let (info, expected) = (source.info().clone(), original.info());
        assert_eq!((&info.part, &info.taxonomy), (&expected.part, &expected.taxonomy));
        assert_eq!(
            (info.view_count, info.turntable, info.volume),
            (expected.view_count, expected.turntable, expected.volume)
        );
        for _ in 0..2 {
            for (place, expected) in views.iter().enumerate() {
                assert_same(&source.next_view().expect("a view"), expected, place);
                let given = source.info().settings.iter().find(|(name, _)| name == "given").expect("a setting");
                assert_eq!(given.1, place.to_string());
            }
            assert!(source.next_view().is_none() && source.next_view().is_none());
            assert!(!source.info().settings.iter().any(|(name, _)| name == "recording"), "it was not cut");
            assert!(source.rewind());
        }
        assert_eq!(
            std::iter::from_fn(|| McapSource::first_views(&path, 2).ok())
                .take(1)
                .map(|mut s| std::iter::from_fn(|| s.next_view()).count())
                .sum::<usize>(),
            2
        );
    }

    #[test]
    fn a_capture_that_was_cut_anywhere_is_read_to_its_last_whole_view() {
        let root = tempfile::tempdir().expect("a folder");
        let (path, cut) = (root.path().join("whole.mcap"), root.path().join("cut.mcap"));
        let views = record(&path, false);
        let bytes = fs::read(&path).expect("reads");
        // Where each view is whole: the length of a file that has no more.
        let mut most = 0;
        let mut seen = std::collections::BTreeSet::new();
        for at in (0..=200).map(|i| bytes.len() * i / 200) {
            fs::write(&cut, &bytes[..at]).expect("writes");
            let mut source = match McapSource::open(&cut) {
                Ok(source) => source,
                Err(error) => {
                    assert!(most == 0 && error.to_string().contains("cut.mcap"), "{at}: {error}");
                    continue;
                }
            };
            let found: Vec<_> = std::iter::from_fn(|| source.next_view()).collect();
            for (place, (found, expected)) in found.iter().zip(&views).enumerate() {
                assert_same(found, expected, place);
            }
            assert!(found.len() >= most, "{at}: a longer file has fewer views");
            assert!(source.info().settings.iter().any(|(name, _)| name == "recording"), "{at}: it is not said");
            most = found.len();
            seen.insert(most);
        }
        assert_eq!(seen.into_iter().collect::<Vec<_>>(), [0, 1, 3, 4], "view 2 is a few bytes behind view 1");
    }

    #[test]
    fn a_damaged_capture_names_the_file_and_gives_no_wrong_view() {
        let root = tempfile::tempdir().expect("a folder");
        let (path, damaged) = (root.path().join("whole.mcap"), root.path().join("damaged.mcap"));
        let views = record(&path, true);
        let bytes = fs::read(&path).expect("reads");
        let mut refused = 0;
        for (i, at) in (0..300).map(|i| bytes.len() * i / 300 + i % 7).enumerate() {
            let mut spoiled = bytes.clone();
            let Some(byte) = spoiled.get_mut(at) else { continue };
            *byte ^= 1 << (i % 8);
            fs::write(&damaged, &spoiled).expect("writes");
            let Ok(mut source) = McapSource::open(&damaged) else {
                refused += 1;
                continue;
            };
            for (place, expected) in views.iter().enumerate() {
                match (source.next_view(), expected) {
                    (Some(Ok(found)), Ok(_)) => assert_same(&Ok(found), expected, place),
                    (Some(Err(error)), Ok(_)) => {
                        refused += 1;
                        assert!(error.to_string().contains("damaged.mcap"), "{error}");
                        break;
                    }
                    (Some(Err(_)), Err(_)) => {}
                    (None, _) => {
                        refused += 1;
                        break;
                    }
                    (Some(Ok(_)), Err(_)) => panic!("{at}: a view that was none"),
                }
            }
        }
        assert!(refused > 250, "{refused} of 300 were noticed; the rest lies in the index");
    }

    #[test]
    fn what_is_no_capture_is_refused_with_its_name() {
        let root = tempfile::tempdir().expect("a folder");
        let refused = |name: &str, bytes: &[u8]| {
            let path = root.path().join(name);
            fs::write(&path, bytes).expect("writes");
            match McapSource::open(&path) {
                Ok(_) => panic!("{name} is no capture"),
                Err(error) => error.to_string(),
            }
        };
        assert!(refused("empty.mcap", b"").contains("empty.mcap"));
        assert!(refused("text.mcap", b"not an MCAP file at all").contains("text.mcap"));
        let mut other = std::io::Cursor::new(Vec::new());
        let mut writer = ::mcap::Writer::new(&mut other).expect("a file");
        let channel = writer.add_channel(0, "/chatter", "json", &Default::default()).expect("a channel");
        let header = ::mcap::records::MessageHeader { channel_id: channel, sequence: 0, log_time: 0, publish_time: 0 };
        writer.write_to_known_channel(&header, b"{}").expect("written");
        writer.finish().expect("finished");
        drop(writer);
        let said = refused("foreign.mcap", &other.into_inner());
        assert!(said.contains("holds no capture of semascan"), "{said}");
    }
}
