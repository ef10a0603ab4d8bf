//! An opened model as events of the link: model, picture and state follow a file as they follow an agent.

use super::OpenedModel;
use crate::link::{DecodedChunk, LinkEvent};
use semascan_model::{CHUNK_EDGE, SemanticCloud};
use semascan_protocol::server_message::Body;
use semascan_protocol::{Inspection, Phase, Progress};
use std::collections::BTreeMap;

impl OpenedModel {
    /// What happens when it takes the place of what was shown.
    pub fn events(&self) -> Vec<LinkEvent> {
        // Without a name of an inspection the agent is asked nothing about it.
        let mut inspection = Inspection {
            epoch: 1,
            part: self.part().to_owned(),
            source: self.name.clone(),
            voxel: self.voxel.into(),
            ..Inspection::default()
        };
        inspection.set_taxonomy(&self.taxonomy);
        let mut chunks: BTreeMap<[i32; 3], SemanticCloud> = BTreeMap::new();
        let edge = self.voxel * CHUNK_EDGE as f32;
        for point in self.mesh.vertices.iter() {
            let id = point.position.map(|c| (c / edge).floor() as i32);
            chunks.entry(id).or_default().push(point);
        }
        let progress = Progress {
            phase: Phase::Finished.into(),
            points: self.mesh.len() as u64,
            chunks: chunks.len() as u32,
            complete_epoch: 1,
            ..Progress::default()
        };
        let voxel = self.voxel;
        let chunks = chunks
            .into_iter()
            .map(|(id, cloud)| LinkEvent::Chunk(DecodedChunk { id, revision: 1, epoch: 1, voxel, hash: 0, cloud }));
        std::iter::once(LinkEvent::Cleared(inspection))
            .chain(chunks)
            .chain([LinkEvent::Message(Body::Progress(progress))])
            .collect()
    }
}

#[cfg(test)]
#[allow(clippy::expect_used)]
mod tests {
    use super::*;
    use crate::scene::HeldModel;
    use crate::state::progress::Standing;
    use crate::state::{AppState, Event};

    #[test]
    fn a_file_is_shown_in_the_place_of_what_was_there() {
        let obj =
            b"o lid\nv 0 0 0\nv 100 0 0\nv 100 100 0\nf 1 2 3\no base\nv 0 0 5\nv 100 0 5\nv 100 100 5\nf 4 5 6\n";
        let opened = OpenedModel::read("box.obj", obj).expect("a mesh");
        let (mut model, mut state) = (HeldModel::new(), AppState::default());
        state.reduce(&Event::Opened(opened.name.clone()));
        for event in opened.events().into_iter().chain(opened.events()) {
            model.apply(&event);
            if !event.is_bulk() {
                state.reduce(&Event::from(event));
            }
        }
        assert_eq!((model.point_count(), model.voxel()), (6, opened.voxel));
        assert_eq!((state.inspection.part.as_str(), state.connection.key()), ("box", "file"));
        assert_eq!(state.standing(), Standing::Known(Phase::Finished));
        assert_eq!(state.legend.rows.len(), 3);
        assert!(!state.may_review() && !state.model_differs());
    }
}
