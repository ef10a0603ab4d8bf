//! A simulated person who corrects the labels of a model: with a brush on the surface, not pixel by pixel.
//!
//! Strokes are 10, 5 and 3 mm wide, the wide ones first. The person sets the brush where the label is wrong, names the class
//! that is there, and uses a width only where nearly all of the surface under it has that class; with the narrowest one it
//! is enough that a stroke mends clearly more than it spoils. What is left after that, such as the last millimetre beside
//! a border, stays as it is. Where defects are too thin for a brush the person draws lines (`lines`).

use super::lines::{PENS, Sampled};
use jiff::Timestamp;
use semascan_geometry::measure::NearestPoints;
use semascan_model::record::{InspectionRecord, SoftwareRecord};
use semascan_model::review::{Review, ReviewAction, ReviewEntry, ReviewId, ReviewedVersions, Subject, SurfacePatch};
use semascan_model::{ClassDef, SemanticMesh, Taxonomy};
use std::collections::BTreeMap;
use uuid::Uuid;

/// Half the widths of the strokes, metres.
const RADII: [f64; 3] = [5e-3, 2.5e-3, 1.5e-3];
/// Share of the surface under a brush that must have its class.
const PURE: f64 = 0.95;
/// Wrong vertices under a brush from which on it is worth a stroke.
const WORTH: usize = 3;
/// Points that a patch may have.
const MOST_POINTS: usize = 20_000;

/// The classes that the surface of a model truly has, by vertex.
pub(super) struct VertexTruth {
    pub(super) components: Vec<u16>,
    pub(super) defects: Vec<u16>,
}

/// What the person did.
pub(super) struct Corrections {
    /// The log, one entry for each class and width.
    pub(super) entries: Vec<ReviewEntry>,
    /// Strokes in all.
    pub(super) strokes: usize,
}

/// Corrects the labels of `mesh`.
pub(super) fn correct(
    mesh: &SemanticMesh,
    truth: &VertexTruth,
    sampled: &Sampled,
    seed: u64,
    taxonomy: &Taxonomy,
    record: &InspectionRecord,
) -> Corrections {
    let nearest = NearestPoints::new(&mesh.vertices.positions);
    let (components, _) = strokes(mesh, &nearest, &mesh.vertices.labels, &truth.components);
    let (defects, painted) = strokes(mesh, &nearest, &mesh.vertices.defects, &truth.defects);
    let lines = sampled.lines(mesh, &painted, seed);
    let mut corrections = Corrections { entries: Vec::new(), strokes: 0 };
    let name = |classes: &[ClassDef], class: u16| classes.iter().find(|c| c.id == class).map(|c| c.name.clone());
    for ((width, class), points) in components {
        let component = name(&taxonomy.components, class);
        corrections.add(record, points, RADII[width], |patch| ReviewAction::Relabel {
            patch,
            component: component.clone(),
            defect: None,
        });
    }
    for ((width, class), points) in defects {
        let defect = name(&taxonomy.defects, class);
        corrections.add(record, points, RADII[width], |patch| ReviewAction::Relabel {
            patch,
            component: None,
            defect: defect.clone(),
        });
    }
    for ((class, pen), points) in lines {
        let defect = name(&taxonomy.defects, class);
        corrections.add(record, points, PENS[pen], |patch| ReviewAction::Relabel {
            patch,
            component: None,
            defect: defect.clone(),
        });
    }
    corrections
}

impl Corrections {
    fn add(
        &mut self,
        record: &InspectionRecord,
        points: Vec<[f64; 3]>,
        radius: f64,
        action: impl Fn(SurfacePatch) -> ReviewAction,
    ) {
        self.strokes += points.len();
        for points in points.chunks(MOST_POINTS) {
            let sequence = self.entries.len() as u64 + 1;
            let patch = SurfacePatch::Points { points: points.to_vec(), radius };
            self.entries.push(entry(record, sequence, action(patch)));
        }
    }
}

/// Centres of strokes by width (place in [`RADII`]) and class.
type Strokes = BTreeMap<(usize, u16), Vec<[f64; 3]>>;

/// The strokes that make `truth` of what was measured, and the labels after them.
fn strokes(mesh: &SemanticMesh, nearest: &NearestPoints, measured: &[u16], truth: &[u16]) -> (Strokes, Vec<u16>) {
    let mut labels = measured.to_vec();
    let mut strokes = Strokes::new();
    for (width, radius) in RADII.iter().enumerate() {
        let is_narrowest = width + 1 == RADII.len();
        for v in 0..mesh.len() {
            if labels[v] == truth[v] {
                continue;
            }
            let class = truth[v];
            let mut under = Vec::new();
            nearest.within(mesh.vertices.positions[v], *radius as f32, |n| under.push(n.index as usize));
            let of_class = under.iter().filter(|u| truth[**u] == class).count();
            let mended = under.iter().filter(|u| truth[**u] == class && labels[**u] != class).count();
            let spoiled = under.iter().filter(|u| truth[**u] != class && labels[**u] == truth[**u]).count();
            let is_pure = of_class as f64 >= PURE * under.len() as f64;
            let is_used = is_pure || (is_narrowest && mended > 2 * spoiled);
            if is_used && mended >= WORTH {
                strokes.entry((width, class)).or_default().push(mesh.vertices.positions[v].map(f64::from));
                under.iter().for_each(|u| labels[*u] = class);
            }
        }
    }
    (strokes, labels)
}

fn entry(record: &InspectionRecord, sequence: u64, action: ReviewAction) -> ReviewEntry {
    ReviewEntry {
        sequence,
        inspection: record.id,
        at: Timestamp::UNIX_EPOCH,
        versions: ReviewedVersions {
            software: SoftwareRecord { name: "semascan".into(), version: env!("CARGO_PKG_VERSION").into() },
            inspected_with: record.software.clone(),
            model: record.files.as_ref().map(|files| files.generation.clone()),
            networks: Vec::new(),
            criteria: None,
        },
        conflicts_with: Vec::new(),
        drawn: None,
        review: Review {
            id: ReviewId(Uuid::from_u128(u128::from(sequence))),
            subject: Subject::Part,
            seen: 0,
            model: None,
            action,
            person: "simulated".into(),
            reason: "as it is".into(),
            resolves: Vec::new(),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use semascan_model::SemanticPoint;

    /// A row of vertices 0.5 mm apart; the first half is of class 1, the rest of class 2.
    fn row(labels: impl Fn(usize) -> u16) -> (SemanticMesh, Vec<u16>) {
        let mut mesh = SemanticMesh::default();
        for i in 0..200 {
            let position = [i as f32 * 5e-4, 0.0, 0.0];
            mesh.push(SemanticPoint { position, label: labels(i), ..SemanticPoint::UNKNOWN }, false);
        }
        (mesh, (0..200).map(|i| 1 + u16::from(i >= 100)).collect())
    }

    fn strokes_on(labels: impl Fn(usize) -> u16) -> Strokes {
        let (mesh, truth) = row(labels);
        strokes(&mesh, &NearestPoints::new(&mesh.vertices.positions), &mesh.vertices.labels, &truth).0
    }

    #[test]
    fn what_is_right_or_too_small_for_a_brush_is_left() {
        assert!(strokes_on(|i| 1 + u16::from(i >= 100)).is_empty());
        assert!(strokes_on(|i| 1 + u16::from(i >= 98)).is_empty(), "two vertices at the border, a millimetre");
    }

    #[test]
    fn a_large_error_takes_wide_strokes_and_a_border_narrow_ones() {
        let strokes = strokes_on(|i| 1 + u16::from(i >= 60));
        let widths: Vec<usize> = strokes.keys().map(|(width, _)| *width).collect();
        assert!(widths.contains(&0) && widths.iter().all(|w| *w < 3), "{widths:?}");
        assert!(strokes.keys().all(|(_, class)| *class == 1), "nothing but class 1 is named");
        let count: usize = strokes.values().map(Vec::len).sum();
        assert!((2..=8).contains(&count), "{count} strokes for 20 mm");
    }
}
