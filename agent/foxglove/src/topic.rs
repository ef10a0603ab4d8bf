//! What is published: topics and their schemas.

use crate::schema::{COMPRESSED_IMAGE, FRAME_TRANSFORMS, LOG, POINT_CLOUD, SCENE_UPDATE, Schema};

/// A topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Topic {
    /// The model's points with what they mean.
    Points,
    /// The final mesh as a glTF scene, component by component.
    Mesh,
    /// Where the cameras stood.
    Transforms,
    /// What the cameras saw of the room: frusta.
    Cameras,
    /// What was found, by outlines and names.
    Findings,
    /// The picture of the latest view, small.
    Picture,
    /// What happened.
    Log,
}

/// Every topic; its place is the number of its channel.
pub const TOPICS: [Topic; 7] =
    [Topic::Points, Topic::Mesh, Topic::Transforms, Topic::Cameras, Topic::Findings, Topic::Picture, Topic::Log];

impl Topic {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Points => "/semascan/points",
            Self::Mesh => "/semascan/mesh",
            Self::Transforms => "/tf",
            Self::Cameras => "/semascan/cameras",
            Self::Findings => "/semascan/findings",
            Self::Picture => "/semascan/picture",
            Self::Log => "/semascan/log",
        }
    }

    /// What its messages are.
    pub fn schema(self) -> Schema {
        match self {
            Self::Points => POINT_CLOUD,
            Self::Mesh | Self::Cameras | Self::Findings => SCENE_UPDATE,
            Self::Transforms => FRAME_TRANSFORMS,
            Self::Picture => COMPRESSED_IMAGE,
            Self::Log => LOG,
        }
    }

    /// The number of its channel.
    pub fn channel(self) -> u32 {
        TOPICS.iter().position(|topic| *topic == self).unwrap_or_default() as u32
    }
}
