//! A saved inspection, published as if it had just ended: what clients see is the model that it left.

use super::live::{LiveModel, Published};
use super::messages::{inspection, view_report};
use rayon::prelude::*;
use semascan_geometry::measure::model_figures;
use semascan_geometry::mesh::{MeshError, MeshOptions, mesh_cloud};
use semascan_inspection::event::EventKind;
use semascan_model::record::{InspectionRecord, Outcome};
use semascan_model::{SemanticCloud, SemanticPoint, Taxonomy};
use semascan_protocol::chunk::{CHUNK_EDGE, ChunkEncoder, VoxelChunk};
use semascan_protocol::{self as wire, WireError};
use std::collections::BTreeMap;

/// The map of a saved inspection is not rebuilt any more.
const EPOCH: u32 = 1;
/// Largest voxel address of a point: beyond it there is no chunk.
const FARTHEST: f64 = 1e9;

/// Why a saved inspection cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum SavedError {
    /// Its record does not say how large its voxels are.
    #[error("the record does not say the voxel edge of its {points} points")]
    NoVoxel {
        /// Points that it has.
        points: usize,
    },
    /// It cannot be meshed, and so not be measured.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A part of the model cannot be coded.
    #[error("chunk {id:?} of the model: {source}")]
    Chunk {
        /// The chunk.
        id: [i32; 3],
        /// Why.
        source: WireError,
    },
}

/// Publishes a saved inspection to `live`. Returns how many points are not shown because they share a voxel with another,
/// or are nowhere.
///
/// # Errors
/// [`SavedError`] if it has points that cannot be shown.
pub fn publish_saved(
    live: &LiveModel,
    record: &InspectionRecord,
    taxonomy: &Taxonomy,
    cloud: &SemanticCloud,
) -> Result<usize, SavedError> {
    let voxel = match record.voxel {
        Some(voxel) => voxel as f32,
        None if cloud.is_empty() => 1.0,
        None => return Err(SavedError::NoVoxel { points: cloud.len() }),
    };
    let (chunks, left) = chunks(cloud, voxel);
    let encode = |encoder: &mut ChunkEncoder, chunk: &VoxelChunk| {
        let id = chunk.id;
        let encoded = encoder.encode(chunk, EPOCH, 1).map_err(|source| SavedError::Chunk { id, source })?;
        Ok(Published { id, encoded: Some(encoded) })
    };
    let published: Result<Vec<Published>, SavedError> =
        chunks.par_iter().map_init(ChunkEncoder::default, encode).collect();
    let published = published?;
    let started = EventKind::Started {
        part: record.part.clone(),
        source: record.source.clone(),
        taxonomy: taxonomy.clone(),
        views_expected: Some(record.views.len() as u32),
        turntable: None,
    };
    live.begin(inspection(record.id, &started));
    live.set_voxel(voxel.into());
    for view in &record.views {
        live.view(view_report(view, None, taxonomy));
    }
    live.publish(published);
    live.whole();
    let hash = live.hash();
    let mesh = mesh_cloud(cloud, voxel, &MeshOptions::default(), &())?;
    let figures = model_figures(cloud, &mesh, voxel);
    live.update_progress(|p| {
        p.figures = Some((&figures).into());
        p.views_done = record.views.len() as u32;
        p.views_rejected = record.views.iter().filter(|v| !v.accepted).count() as u32;
        p.model_hash = hash;
        let (phase, message) = match &record.outcome {
            Outcome::Finished => (wire::Phase::Finished, String::new()),
            Outcome::Stopped => (wire::Phase::Finished, format!("stopped after {} views", record.views.len())),
            Outcome::Running => (wire::Phase::Failed, "the inspection was killed before its end".into()),
            Outcome::Failed { reason } => (wire::Phase::Failed, reason.clone()),
        };
        p.set_phase(phase);
        p.message = message;
    });
    Ok(left)
}

/// The points by chunk and voxel, and how many found their voxel taken or lie nowhere.
fn chunks(cloud: &SemanticCloud, voxel: f32) -> (Vec<VoxelChunk>, usize) {
    let mut chunks: BTreeMap<[i32; 3], BTreeMap<[u8; 3], SemanticPoint>> = BTreeMap::new();
    let mut left = 0;
    for point in cloud.iter() {
        let address = point.position.map(|c| (f64::from(c) / f64::from(voxel)).floor());
        if !address.iter().all(|c| c.abs() < FARTHEST) {
            left += 1;
            continue;
        }
        let address = address.map(|c| c as i32);
        let chunk = chunks.entry(address.map(|c| c.div_euclid(CHUNK_EDGE))).or_default();
        let taken = chunk.insert(address.map(|c| c.rem_euclid(CHUNK_EDGE) as u8), point);
        left += usize::from(taken.is_some());
    }
    let chunks = chunks.into_iter();
    (chunks.map(|(id, voxels)| VoxelChunk { id, voxel, voxels: voxels.into_iter().collect() }).collect(), left)
}

#[cfg(test)]
mod tests {
    use super::*;
    use semascan_model::record::{LabelSource, SCHEMA_VERSION, SoftwareRecord};
    use semascan_model::{InspectionId, PointFlags};

    fn record(outcome: Outcome, voxel: Option<f64>) -> InspectionRecord {
        InspectionRecord {
            schema_version: SCHEMA_VERSION,
            id: InspectionId::new(1, &[0; 10]),
            began: Default::default(),
            ended: None,
            outcome,
            files: None,
            software: SoftwareRecord { name: "semascan".into(), version: "1".into() },
            part: "motor".into(),
            source: "scene".into(),
            labels: LabelSource::Source,
            networks: None,
            settings: Vec::new(),
            voxel,
            points: 0,
            base_from_table: None,
            refinement: None,
            photometric: None,
            plan: None,
            run: None,
            views: Vec::new(),
            components: Vec::new(),
            defects: Vec::new(),
            findings: None,
            verdict: None,
            truth: None,
        }
    }

    fn cloud(positions: &[[f32; 3]]) -> SemanticCloud {
        let mut cloud = SemanticCloud::default();
        for position in positions {
            cloud.push(SemanticPoint { position: *position, flags: PointFlags(0), ..SemanticPoint::UNKNOWN });
        }
        cloud
    }

    #[test]
    fn every_point_is_published_and_the_end_says_how_it_was() {
        let taxonomy = Taxonomy::from_names(&["gear"], &["wear"]);
        // On voxel faces, across chunks, below zero; two in one voxel, and one that is nowhere.
        let points = [[0.0, 0.001, 0.0005], [0.0401, -0.0401, 0.2], [-1.0, 0.0, 0.0], [0.0001; 3], [f32::NAN; 3]];
        let cloud = cloud(&[&points[..], &[[0.0002; 3]]].concat());
        let live = LiveModel::new();
        let left = publish_saved(&live, &record(Outcome::Finished, Some(1e-3)), &taxonomy, &cloud).expect("shown");
        assert_eq!((left, live.totals().points), (2, 4));
        assert_eq!((live.progress().phase(), live.progress().model_hash), (wire::Phase::Finished, live.hash()));
        let figures = live.progress().figures.expect("measured").figures();
        assert_eq!(figures.components.iter().map(|f| f.points).sum::<u64>(), cloud.len() as u64);
        for (outcome, phase, word) in [
            (Outcome::Stopped, wire::Phase::Finished, "stopped"),
            (Outcome::Running, wire::Phase::Failed, "killed"),
            (Outcome::Failed { reason: "no view".into() }, wire::Phase::Failed, "no view"),
        ] {
            publish_saved(&live, &record(outcome, None), &taxonomy, &SemanticCloud::default()).expect("shown");
            assert_eq!(live.progress().phase(), phase);
            assert!(live.progress().message.contains(word), "{}", live.progress().message);
        }
        let unknown = publish_saved(&live, &record(Outcome::Finished, None), &taxonomy, &cloud);
        assert!(matches!(unknown, Err(SavedError::NoVoxel { points: 6 })));
    }
}
