//! What is to be written, complete in itself: it crosses to the worker as one block of bytes.
//!
//! Layout, little endian: numbers, hidden classes, the cut, the inspection and the figures as messages of the protocol, the mesh.
//! Both ends are the same build: the layout is no public contract, but lengths are checked all the same.

use super::format::Format;
use crate::columns;
use crate::display::Cut;
use crate::state::AppState;
use crate::state::export_choice::{Content, Detail, ExportChoice, Solids, UP_AXES};
use prost::Message;
use semascan_formats::{ExportFilter, FileFrame};
use semascan_model::{LengthUnit, ModelFigures, SemanticCloud, SemanticMesh};
use semascan_protocol::{Figures, Inspection};
use std::sync::Arc;

/// Length of a message that is not there.
const NONE: u32 = u32::MAX;

/// An export that can be written anywhere.
#[derive(Clone, Debug, PartialEq)]
pub struct Task {
    pub(super) format: Format,
    pub(super) choice: ExportChoice,
    /// What is left out.
    pub(super) filter: ExportFilter,
    pub(super) cut: Cut,
    pub(super) inspection: Inspection,
    /// What is known of the model.
    pub(super) figures: Option<ModelFigures>,
    /// The whole mesh, or the whole model as vertices without triangles. Metres, table frame.
    pub(super) mesh: Arc<SemanticMesh>,
}

impl Task {
    /// Writing the points of the model `whole` (table frame, metres), as `state` has it.
    pub fn of_points(whole: SemanticCloud, state: &AppState, format: Format) -> Self {
        let boundary = vec![false; whole.len()];
        Self::of_mesh(Arc::new(SemanticMesh { vertices: whole, boundary, triangles: Vec::new() }), state, format)
    }

    /// Writing the model's mesh, as `state` has it.
    pub fn of_mesh(mesh: Arc<SemanticMesh>, state: &AppState, format: Format) -> Self {
        let content = state.export.content;
        let hidden = state.legend.rows.iter().filter(|row| !row.visible);
        let filter = match content {
            Content::All => ExportFilter::default(),
            Content::Shown | Content::Kept => ExportFilter {
                hidden_labels: hidden.map(|row| row.class.id).collect(),
                skip_flags: state.display.hidden_flags().bits(),
            },
        };
        Self {
            format,
            choice: state.export,
            filter,
            cut: if content == Content::Kept { state.display.cut } else { Cut::default() },
            inspection: state.inspection.clone(),
            // Those of the agent where the model is final, else those of an up-to-date mesh.
            figures: state.measured.as_ref().or(state.features.mesh.figures.as_ref()).cloned(),
            mesh,
        }
    }

    /// The task as bytes.
    pub fn encode(&self) -> Vec<u8> {
        let Self { format, choice, filter, cut, inspection, figures, mesh } = self;
        let numbers = [
            place(&Format::ALL, *format),
            place(&Content::ALL, choice.content),
            place(&Detail::ALL, choice.detail),
            place(&Solids::ALL, choice.solids),
            place(&LengthUnit::ALL, choice.frame.unit),
            UP_AXES.iter().position(|(up, _)| *up == choice.frame.up).unwrap_or(0) as u32,
            u32::from(filter.skip_flags),
            filter.hidden_labels.len() as u32,
            u32::from(cut.plane.is_some()),
            u32::from(cut.limits.is_some()),
        ];
        let mut bytes = Vec::with_capacity(4096 + columns::mesh_bytes(mesh));
        bytes.extend_from_slice(bytemuck::cast_slice(&numbers));
        filter.hidden_labels.iter().for_each(|label| bytes.extend_from_slice(&label.to_le_bytes()));
        let (normal, offset) = cut.plane.unwrap_or_default();
        bytes.extend_from_slice(bytemuck::cast_slice(&normal));
        bytes.extend_from_slice(&offset.to_le_bytes());
        bytes.extend_from_slice(bytemuck::cast_slice(&cut.limits.unwrap_or_default()));
        put(&mut bytes, Some(inspection.encode_to_vec()));
        put(&mut bytes, figures.as_ref().map(|figures| Figures::from(figures).encode_to_vec()));
        columns::put_mesh(&mut bytes, mesh);
        bytes
    }

    /// The task that `bytes` hold; `None` if they are not what [`Self::encode`] makes.
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        let mut rest = bytes;
        let numbers: [u32; 10] = columns::take(&mut rest, 10)?.try_into().ok()?;
        let [format, content, detail, solids, unit, up, skip_flags, hidden, plane, limits] = numbers;
        let hidden_labels = columns::take::<u16>(&mut rest, hidden as usize)?.into_iter().collect();
        let normal: [f32; 3] = columns::take(&mut rest, 3)?.try_into().ok()?;
        let offset = *columns::take::<f32>(&mut rest, 1)?.first()?;
        let corners: [[f32; 3]; 2] = columns::take(&mut rest, 2)?.try_into().ok()?;
        let inspection = Inspection::decode(take(&mut rest)?.as_slice()).ok()?;
        let figures = match take(&mut rest) {
            Some(figures) => Some(Figures::decode(figures.as_slice()).ok()?.figures()),
            None => None,
        };
        let up = UP_AXES.get(up as usize)?.0;
        Some(Self {
            format: *Format::ALL.get(format as usize)?,
            choice: ExportChoice {
                frame: FileFrame { unit: *LengthUnit::ALL.get(unit as usize)?, up },
                detail: *Detail::ALL.get(detail as usize)?,
                solids: *Solids::ALL.get(solids as usize)?,
                content: *Content::ALL.get(content as usize)?,
            },
            filter: ExportFilter { hidden_labels, skip_flags: u16::try_from(skip_flags).ok()? },
            cut: Cut { plane: (plane != 0).then_some((normal, offset)), limits: (limits != 0).then_some(corners) },
            inspection,
            figures,
            mesh: Arc::new(columns::take_mesh(&mut rest).filter(|_| rest.is_empty())?),
        })
    }
}

/// Where a value stands among all that there are.
fn place<T: PartialEq>(all: &[T], value: T) -> u32 {
    all.iter().position(|other| *other == value).unwrap_or(0) as u32
}

fn put(bytes: &mut Vec<u8>, message: Option<Vec<u8>>) {
    let length = message.as_ref().map_or(NONE, |message| message.len() as u32);
    bytes.extend_from_slice(&length.to_le_bytes());
    bytes.extend_from_slice(&message.unwrap_or_default());
}

fn take(rest: &mut &[u8]) -> Option<Vec<u8>> {
    match *columns::take::<u32>(rest, 1)?.first()? {
        NONE => None,
        length => columns::take(rest, length as usize),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::{MeshFormat, PointFormat};
    use semascan_model::{FeatureFigures, PointFlags, SemanticPoint};

    fn task() -> Task {
        let point = SemanticPoint { label: 3, flags: PointFlags(1), views: 7, ..SemanticPoint::UNKNOWN };
        Task {
            format: Format::Mesh(MeshFormat::Stl),
            choice: ExportChoice { detail: Detail::Tenth, content: Content::Kept, ..ExportChoice::default() },
            filter: ExportFilter { hidden_labels: [2, 500].into(), skip_flags: 6 },
            cut: Cut { plane: Some(([0.0, 1.0, 0.0], 0.25)), limits: Some([[-1.0; 3], [1.0; 3]]) },
            inspection: Inspection { part: "motor".into(), voxel: 0.1 + 0.2, ..Inspection::default() },
            figures: Some(ModelFigures {
                components: vec![FeatureFigures {
                    id: 3,
                    component: 3,
                    points: 9,
                    area: Some(0.1 + 0.2),
                    confidence: 1.0 / 3.0,
                    sigma: 0.0,
                }],
                ..ModelFigures::default()
            }),
            mesh: Arc::new(SemanticMesh {
                vertices: [point; 3].into_iter().collect(),
                boundary: vec![true, false, true],
                triangles: vec![[0, 1, 2]],
            }),
        }
    }

    #[test]
    fn a_task_crosses_to_the_worker_as_it_is() {
        let all = task();
        assert_eq!(Task::decode(&all.encode()), Some(all.clone()));
        let bare = Task {
            format: Format::Points(PointFormat::Glb),
            cut: Cut::default(),
            filter: ExportFilter::default(),
            figures: None,
            ..all
        };
        assert_eq!(Task::decode(&bare.encode()), Some(bare));
    }

    #[test]
    fn a_block_that_is_cut_short_or_too_long_is_no_task() {
        let bytes = task().encode();
        assert!((0..bytes.len()).all(|length| Task::decode(&bytes[..length]).is_none()));
        assert_eq!(Task::decode(&[bytes, vec![0]].concat()), None);
    }
}
