//! What the live stream has said of the inspection by now, to be told in Foxglove's schemas. It follows the stream as any viewer
//! does: what another tool sees is what a viewer sees.

use crate::drawing::{frustum, nothing, table_from_camera, transform};
use crate::packed_points::{STRIDE, cloud, pack};
use crate::schema::{CompressedImage, FrameTransforms, Log, SceneUpdate, log};
use crate::topic::Topic;
use prost::Message;
use prost_types::Timestamp;
use semascan_protocol::chunk::ChunkDecoder;
use semascan_protocol::server_message::Body;
use semascan_protocol::{Inspection, Phase, Progress, StageEvent, StageState, ViewReport, WireError, decode_server};
use std::collections::{BTreeMap, BTreeSet, VecDeque};

/// Lines of the log that wait to be sent; of more the oldest are dropped.
const MOST_LINES: usize = 200;

/// The model and its views as the stream has told them, and what of that is new.
#[derive(Default)]
pub struct Scene {
    inspection: Inspection,
    /// Packed points of each chunk.
    chunks: BTreeMap<[i32; 3], Vec<u8>>,
    /// Those of the next epoch, of which not all are there yet: until then the old ones are shown.
    successor: Option<BTreeMap<[i32; 3], Vec<u8>>>,
    views: BTreeMap<u32, ViewReport>,
    phase: Phase,
    /// Lines that have not been sent.
    lines: VecDeque<Log>,
    /// Topics with something new.
    news: BTreeSet<Topic>,
    decoder: ChunkDecoder,
}

impl Scene {
    /// Follows a message of the stream.
    ///
    /// # Errors
    /// [`WireError`] if it is none.
    pub fn follow(&mut self, message: &[u8]) -> Result<(), WireError> {
        match decode_server(message)?.body {
            Some(Body::Welcome(welcome)) => self.begin(welcome.inspection.unwrap_or_default()),
            Some(Body::Clear(clear)) => {
                let inspection = clear.inspection.unwrap_or_default();
                if clear.successor {
                    self.inspection = inspection;
                    self.successor = Some(BTreeMap::new());
                } else {
                    self.begin(inspection);
                }
            }
            Some(Body::Chunk(update)) => {
                let chunk = self.decoder.decode(&update)?;
                self.coming().insert(chunk.id, pack(&chunk.cloud));
                self.note_points();
            }
            Some(Body::Gone(gone)) => {
                if let Some(id) = gone.id {
                    self.coming().remove(&id.to_array());
                    self.note_points();
                }
            }
            Some(Body::View(report)) => self.view(report),
            Some(Body::Progress(progress)) => self.progress(&progress),
            Some(Body::Stage(event)) => self.stage(&event),
            // Findings are asked for again.
            Some(Body::Review(_)) => drop(self.news.insert(Topic::Findings)),
            Some(Body::Refused(_) | Body::Page(_) | Body::Pointer(_)) | None => {}
        }
        Ok(())
    }

    /// The inspection, by its id; empty while there is none.
    pub fn inspection(&self) -> &str {
        &self.inspection.id
    }

    /// Whether the inspection has come to its end, so that it has findings and a mesh.
    pub fn is_finished(&self) -> bool {
        self.phase == Phase::Finished
    }

    /// A topic is new as a whole, as to somebody who has just subscribed to it.
    pub fn renew(&mut self, topic: Topic) {
        self.news.insert(topic);
    }

    /// Topics with something new, which is then taken as told.
    pub fn take_news(&mut self) -> BTreeSet<Topic> {
        std::mem::take(&mut self.news)
    }

    /// Whether any of `topics` has something new.
    pub fn has_news(&self, mut topics: impl Iterator<Item = Topic>) -> bool {
        topics.any(|topic| self.news.contains(&topic))
    }

    /// The messages of a topic that say how things stand; those of findings and mesh come from elsewhere. Lines of the log are sent
    /// once.
    pub fn messages(&mut self, topic: Topic, timestamp: Timestamp) -> Vec<Vec<u8>> {
        match topic {
            Topic::Points => vec![cloud(timestamp, self.points()).encode_to_vec()],
            Topic::Transforms => {
                let posed = self.views.values().filter_map(|view| Some((view.index, table_from_camera(view)?)));
                let mut transforms: Vec<_> =
                    posed.map(|(index, pose)| transform(timestamp, frame_of(index), &pose)).collect();
                // The latest one has a name of its own, for the picture.
                transforms.extend(
                    transforms
                        .last()
                        .cloned()
                        .map(|latest| crate::schema::FrameTransform { child_frame_id: "camera".to_owned(), ..latest }),
                );
                if transforms.is_empty() { Vec::new() } else { vec![FrameTransforms { transforms }.encode_to_vec()] }
            }
            Topic::Cameras => {
                let entities = self.views.values().filter_map(|view| frustum(timestamp, view)).collect();
                vec![SceneUpdate { entities, ..nothing(timestamp) }.encode_to_vec()]
            }
            Topic::Picture => self.picture(timestamp).map(|picture| picture.encode_to_vec()).into_iter().collect(),
            Topic::Log => {
                self.lines.drain(..).map(|line| Log { timestamp: Some(timestamp), ..line }.encode_to_vec()).collect()
            }
            Topic::Findings | Topic::Mesh => Vec::new(),
        }
    }

    /// The packed points of all chunks.
    fn points(&self) -> Vec<u8> {
        let length = self.chunks.values().map(Vec::len).sum();
        let mut bytes = Vec::with_capacity(length);
        self.chunks.values().for_each(|chunk| bytes.extend(chunk));
        debug_assert_eq!(bytes.len() % STRIDE, 0);
        bytes
    }

    fn picture(&self, timestamp: Timestamp) -> Option<CompressedImage> {
        let view = self.views.values().next_back().filter(|view| !view.thumbnail_jpeg.is_empty())?;
        Some(CompressedImage {
            timestamp: Some(timestamp),
            frame_id: "camera".to_owned(),
            data: view.thumbnail_jpeg.to_vec(),
            format: "jpeg".to_owned(),
        })
    }

    fn begin(&mut self, inspection: Inspection) {
        self.chunks.clear();
        self.successor = None;
        self.views.clear();
        self.phase = Phase::Unspecified;
        if !inspection.id.is_empty() {
            self.say(log::Level::Info, format!("inspection of {} begins", inspection.part));
        }
        self.inspection = inspection;
        self.news.extend([Topic::Points, Topic::Mesh, Topic::Cameras, Topic::Findings]);
    }

    fn coming(&mut self) -> &mut BTreeMap<[i32; 3], Vec<u8>> {
        self.successor.as_mut().unwrap_or(&mut self.chunks)
    }

    fn note_points(&mut self) {
        if self.successor.is_none() {
            self.news.insert(Topic::Points);
        }
    }

    fn view(&mut self, report: ViewReport) {
        if !report.accepted {
            self.say(log::Level::Warning, format!("view {} was left out: {}", report.index + 1, report.reason));
        }
        // Of the pictures only that of the latest view is shown.
        if let Some(mut before) = self.views.last_entry() {
            before.get_mut().thumbnail_jpeg.clear();
        }
        let report = ViewReport {
            overlay_png: Default::default(),
            sigma_png: Default::default(),
            contribution_png: Default::default(),
            ..report
        };
        self.views.insert(report.index, report);
        self.news.extend([Topic::Transforms, Topic::Cameras, Topic::Picture]);
    }

    fn progress(&mut self, progress: &Progress) {
        if progress.complete_epoch == self.inspection.epoch
            && let Some(successor) = self.successor.take()
        {
            self.chunks = successor;
            self.news.insert(Topic::Points);
        }
        if progress.phase() == self.phase {
            return;
        }
        self.phase = progress.phase();
        match self.phase {
            Phase::Finished => {
                self.say(
                    log::Level::Info,
                    format!("finished: {} points of {} views", progress.points, progress.views_done),
                );
                self.news.extend([Topic::Findings, Topic::Mesh]);
            }
            Phase::Failed => self.say(log::Level::Error, format!("failed: {}", progress.message)),
            Phase::Unspecified | Phase::Waiting | Phase::Running => {}
        }
    }

    fn stage(&mut self, event: &StageEvent) {
        if event.state() == StageState::Failed {
            let stage = event.stage().as_str_name().trim_start_matches("STAGE_").to_lowercase();
            self.say(log::Level::Warning, format!("view {}: {stage} failed: {}", event.view + 1, event.message));
        }
    }

    fn say(&mut self, level: log::Level, message: String) {
        if self.lines.len() == MOST_LINES {
            self.lines.pop_front();
        }
        self.lines.push_back(Log { level: level.into(), message, name: "semascan".to_owned(), ..Log::default() });
        self.news.insert(Topic::Log);
    }
}

/// The frame of a view's camera.
fn frame_of(view: u32) -> String {
    format!("view_{}", view + 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::schema::PointCloud;
    use semascan_model::SemanticPoint;
    use semascan_protocol::chunk::{VoxelChunk, encode};
    use semascan_protocol::{ChunkGone, ChunkId, Clear, Intrinsics, Pose, ServerMessage, Welcome};

    fn told(scene: &mut Scene, body: Body) {
        scene.follow(&ServerMessage { body: Some(body) }.encode_to_vec()).expect("a message");
    }

    fn chunk(id: [i32; 3], points: u8, epoch: u32) -> Body {
        let origin = id.map(|c| c as f32 * 0.032);
        let voxels = (0..points).map(|n| {
            let position = [origin[0] + (f32::from(n) + 0.5) * 1e-3, origin[1] + 5e-4, origin[2] + 5e-4];
            ([n, 0, 0], SemanticPoint { position, label: 1, ..SemanticPoint::UNKNOWN })
        });
        let chunk = VoxelChunk { id, voxel: 1e-3, voxels: voxels.collect() };
        Body::Chunk(encode(&chunk, epoch, 1).expect("a chunk").update)
    }

    fn points(scene: &mut Scene) -> usize {
        let messages = scene.messages(Topic::Points, Timestamp::default());
        let cloud = PointCloud::decode(messages[0].as_slice()).expect("a cloud");
        assert_eq!((cloud.frame_id.as_str(), cloud.point_stride), ("table", 32));
        cloud.data.len() / 32
    }

    fn inspection(epoch: u32) -> Inspection {
        Inspection { id: "a".into(), epoch, part: "motor".into(), ..Inspection::default() }
    }

    #[test]
    fn points_are_those_of_the_newest_chunks_and_of_the_old_epoch_until_the_next_is_whole() {
        let mut scene = Scene::default();
        told(&mut scene, Body::Welcome(Welcome { inspection: Some(inspection(1)), ..Welcome::default() }));
        told(&mut scene, chunk([0; 3], 3, 1));
        told(&mut scene, chunk([1, 0, 0], 2, 1));
        assert_eq!(points(&mut scene), 5);
        told(&mut scene, Body::Gone(ChunkGone { epoch: 1, id: Some(ChunkId { x: 1, y: 0, z: 0 }), revision: 2 }));
        assert_eq!(points(&mut scene), 3);
        assert!(scene.take_news().contains(&Topic::Points));

        told(&mut scene, Body::Clear(Clear { inspection: Some(inspection(2)), successor: true }));
        told(&mut scene, chunk([0; 3], 7, 2));
        assert_eq!(points(&mut scene), 3);
        assert!(!scene.has_news([Topic::Points].into_iter()));
        let whole = Progress { phase: Phase::Running.into(), complete_epoch: 2, ..Progress::default() };
        told(&mut scene, Body::Progress(whole));
        assert_eq!(points(&mut scene), 7);
        told(&mut scene, Body::Clear(Clear { inspection: Some(Inspection::default()), successor: false }));
        assert_eq!(points(&mut scene), 0);
    }

    #[test]
    fn a_view_is_a_frame_a_frustum_and_a_picture_and_one_without_a_pose_is_none_of_them() {
        let mut scene = Scene::default();
        told(&mut scene, Body::Welcome(Welcome { inspection: Some(inspection(1)), ..Welcome::default() }));
        let pose = Pose { qx: 0.0, qy: 0.0, qz: 0.0, qw: 1.0, tx: 0.1, ty: 0.0, tz: 0.3 };
        let lens = Intrinsics { width: 640, height: 480, fx: 600.0, fy: 600.0, cx: 320.0, cy: 240.0 };
        told(
            &mut scene,
            Body::View(ViewReport {
                accepted: true,
                table_from_camera: Some(pose),
                intrinsics: Some(lens),
                thumbnail_jpeg: vec![1, 2, 3],
                ..ViewReport::default()
            }),
        );
        told(&mut scene, Body::View(ViewReport { index: 1, reason: "blurred".into(), ..ViewReport::default() }));
        let time = Timestamp { seconds: 5, nanos: 0 };
        let transforms = scene.messages(Topic::Transforms, time);
        let transforms = FrameTransforms::decode(transforms[0].as_slice()).expect("transforms").transforms;
        let names: Vec<_> = transforms.iter().map(|t| t.child_frame_id.as_str()).collect();
        assert_eq!(names, ["view_1", "camera"]);
        assert_eq!(transforms[0].translation.as_ref().map(|t| t.x), Some(0.1));
        let cameras = scene.messages(Topic::Cameras, time);
        let cameras = SceneUpdate::decode(cameras[0].as_slice()).expect("a scene");
        assert_eq!((cameras.deletions.len(), cameras.entities.len()), (1, 1));
        assert_eq!(cameras.entities[0].lines[0].points.len(), 16);
        // The latest view has no picture, and that of an earlier one is not taken for it.
        assert!(scene.messages(Topic::Picture, time).is_empty());
        let lines = scene.messages(Topic::Log, time);
        let last = Log::decode(lines[1].as_slice()).expect("a line");
        assert_eq!((lines.len(), last.message.as_str()), (2, "view 2 was left out: blurred"));
        assert!(scene.messages(Topic::Log, time).is_empty());
    }
}
