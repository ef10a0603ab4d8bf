//! What is to be written, complete in itself: it crosses to the worker as one block of bytes.
//!
//! Layout, little endian: numbers, hidden classes, the cut, texts, the classes as JSON, the figures, the mesh.
//! Both ends are the same build: the layout is no public contract, but lengths are checked all the same.

use super::format::Format;
use crate::columns;
use crate::display::Cut;
use crate::state::AppState;
use crate::state::export_choice::{Content, Detail, ExportChoice, Solids, UP_AXES};
use semascan_formats::{ExportFilter, FileFrame};
use semascan_model::{FeatureFigures, LengthUnit, ModelFigures, SemanticCloud, SemanticMesh, Taxonomy};
use std::sync::Arc;

/// Numbers of a figure: those of [`FeatureFigures`].
const NUMBERS: usize = 6;

/// What is known of an inspection.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct About {
    pub(super) part: String,
    pub(super) source: String,
    pub(super) id: String,
    /// Voxel edge, metres.
    pub(super) voxel: f64,
    pub(super) taxonomy: Taxonomy,
}

/// An export that can be written anywhere.
#[derive(Clone, Debug, PartialEq)]
pub struct Task {
    pub(super) format: Format,
    pub(super) choice: ExportChoice,
    /// What is left out.
    pub(super) filter: ExportFilter,
    pub(super) cut: Cut,
    pub(super) about: About,
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
            about: About::of(state),
            // Those of the agent where the model is final, else those of an up-to-date mesh.
            figures: state.measured.as_ref().or(state.features.mesh.figures.as_ref()).cloned(),
            mesh,
        }
    }

    /// The task as bytes.
    pub fn encode(&self) -> Vec<u8> {
        let Self { format, choice, filter, cut, about, figures, mesh } = self;
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
            u32::from(figures.is_some()),
        ];
        let mut bytes = Vec::with_capacity(4096 + columns::mesh_bytes(mesh));
        bytes.extend_from_slice(bytemuck::cast_slice(&numbers));
        filter.hidden_labels.iter().for_each(|label| bytes.extend_from_slice(&label.to_le_bytes()));
        let (normal, offset) = cut.plane.unwrap_or_default();
        bytes.extend_from_slice(bytemuck::cast_slice(&normal));
        bytes.extend_from_slice(&offset.to_le_bytes());
        bytes.extend_from_slice(bytemuck::cast_slice(&cut.limits.unwrap_or_default()));
        // What is plain data always serialises.
        let taxonomy = serde_json::to_string(&about.taxonomy).unwrap_or_default();
        for text in [&about.part, &about.source, &about.id, &taxonomy] {
            put(&mut bytes, text.len(), text.as_bytes());
        }
        bytes.extend_from_slice(&about.voxel.to_le_bytes());
        if let Some(ModelFigures { components, defects, findings, instances }) = figures {
            for list in [components, defects, findings, instances] {
                let numbers: Vec<[f64; NUMBERS]> = list.iter().map(numbers_of).collect();
                put(&mut bytes, list.len(), bytemuck::cast_slice(&numbers));
            }
        }
        columns::put_mesh(&mut bytes, mesh);
        bytes
    }

    /// The task that `bytes` hold; `None` if they are not what [`Self::encode`] makes.
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        let mut rest = bytes;
        let numbers: [u32; 11] = columns::take(&mut rest, 11)?.try_into().ok()?;
        let [format, content, detail, solids, unit, up, skip_flags, hidden, plane, limits, is_known] = numbers;
        let hidden_labels = columns::take::<u16>(&mut rest, hidden as usize)?.into_iter().collect();
        let normal: [f32; 3] = columns::take(&mut rest, 3)?.try_into().ok()?;
        let offset = *columns::take::<f32>(&mut rest, 1)?.first()?;
        let corners: [[f32; 3]; 2] = columns::take(&mut rest, 2)?.try_into().ok()?;
        let [part, source, id, taxonomy] = [(); 4].map(|()| text(&mut rest));
        let about = About {
            part: part?,
            source: source?,
            id: id?,
            taxonomy: serde_json::from_str(&taxonomy?).ok()?,
            voxel: *columns::take::<f64>(&mut rest, 1)?.first()?,
        };
        let figures = if is_known != 0 {
            let [components, defects, findings, instances] = [(); 4].map(|()| figures(&mut rest));
            Some(ModelFigures {
                components: components?,
                defects: defects?,
                findings: findings?,
                instances: instances?,
            })
        } else {
            None
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
            about,
            figures,
            mesh: Arc::new(columns::take_mesh(&mut rest).filter(|_| rest.is_empty())?),
        })
    }
}

/// Where a value stands among all that there are.
fn place<T: PartialEq>(all: &[T], value: T) -> u32 {
    all.iter().position(|other| *other == value).unwrap_or(0) as u32
}

/// Adds a column with the number of its values before it.
fn put(bytes: &mut Vec<u8>, count: usize, column: &[u8]) {
    bytes.extend_from_slice(&(count as u32).to_le_bytes());
    bytes.extend_from_slice(column);
}

fn count(rest: &mut &[u8]) -> Option<usize> {
    columns::take::<u32>(rest, 1)?.first().map(|count| *count as usize)
}

fn text(rest: &mut &[u8]) -> Option<String> {
    let length = count(rest)?;
    String::from_utf8(columns::take(rest, length)?).ok()
}

fn numbers_of(f: &FeatureFigures) -> [f64; NUMBERS] {
    // Numbers of points are far from those that a double cannot hold.
    let [id, component] = [f.id, f.component].map(f64::from);
    [id, component, f.points as f64, f.area.unwrap_or(f64::NAN), f.confidence, f.sigma]
}

fn figures(rest: &mut &[u8]) -> Option<Vec<FeatureFigures>> {
    let count = count(rest)?;
    let of = |[id, component, points, area, confidence, sigma]: [f64; NUMBERS]| FeatureFigures {
        id: id as u16,
        component: component as u16,
        points: points as u64,
        area: (!area.is_nan()).then_some(area),
        confidence,
        sigma,
    };
    Some(columns::take::<[f64; NUMBERS]>(rest, count)?.into_iter().map(of).collect())
}

impl About {
    fn of(state: &AppState) -> Self {
        let inspection = &state.inspection;
        Self {
            part: inspection.part.clone(),
            source: inspection.source.clone(),
            id: inspection.id.clone(),
            voxel: inspection.voxel,
            taxonomy: inspection.taxonomy(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::{MeshFormat, PointFormat};
    use semascan_model::{PointFlags, SemanticPoint};

    fn task() -> Task {
        let point = SemanticPoint { label: 3, flags: PointFlags(1), views: 7, ..SemanticPoint::UNKNOWN };
        Task {
            format: Format::Mesh(MeshFormat::Stl),
            choice: ExportChoice { detail: Detail::Tenth, content: Content::Kept, ..ExportChoice::default() },
            filter: ExportFilter { hidden_labels: [2, 500].into(), skip_flags: 6 },
            cut: Cut { plane: Some(([0.0, 1.0, 0.0], 0.25)), limits: Some([[-1.0; 3], [1.0; 3]]) },
            about: About {
                part: "motor ß".into(),
                source: "file".into(),
                id: String::new(),
                voxel: 0.1 + 0.2,
                taxonomy: Taxonomy::from_names(&["gear"], &["wear"]),
            },
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
