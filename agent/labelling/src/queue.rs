//! Where a label would teach most: regions of a model ordered by the uncertainty of their labels times their area.
//!
//! What more labels can teach is the part of the uncertainty that is in the networks. Findings have it where several networks
//! looked; the map keeps the whole uncertainty alone. So each region says which of the two it was ordered by: the whole is
//! never less than the part. Surface that a person labelled is not listed.

use crate::{Corrected, Labeller, corrected_labels};
use semascan_geometry::measure::seen_vertex_areas;
use semascan_model::finding::{FindingId, FindingKind};
use semascan_model::record::{InspectionRecord, Outcome};
use semascan_model::review::{ReviewEntry, Subject};
use semascan_model::{SemanticMesh, Taxonomy};
use serde::Serialize;
use std::collections::BTreeMap;

/// Edge of the cells that surface is divided into, metres: what one looks at and labels at once.
const QUEUE_CELL: f64 = 0.02;

/// Which uncertainty a region is ordered by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Basis {
    /// The part that is in the networks.
    ModelPart,
    /// The whole standard uncertainty, because the part is not known.
    Whole,
}

/// A region of a model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct QueuedRegion {
    /// The finding that it is; absent for other surface.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub finding: Option<FindingId>,
    /// Component class as measured.
    pub component: u16,
    /// Its middle, metres, table frame.
    pub position: [f64; 3],
    /// Square metres.
    pub area: f64,
    /// Mean standard uncertainty of its labels, 0 to 1.
    pub sigma: f64,
    /// Which uncertainty that is.
    pub basis: Basis,
    /// Uncertainty times area, square metres: what the order is by.
    pub worth: f64,
}

/// The queue of an inspection.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TeachingQueue {
    /// Whole standard uncertainty times area over its surface that nobody labelled, square metres.
    pub worth: f64,
    /// Its regions, the one that would teach most first.
    pub regions: Vec<NamedRegion>,
}

/// A region with the name of its component.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NamedRegion {
    /// The component.
    pub name: String,
    /// The region.
    #[serde(flatten)]
    pub region: QueuedRegion,
}

/// Why an inspection says nothing about what a label would teach.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NothingToTeach {
    /// It runs.
    #[error("it has not ended")]
    Running,
    /// There is no surface.
    #[error("it did not come to a model")]
    NoModel,
    /// Nothing is there to order by.
    #[error("its labels have no uncertainty: they come from the source, or people labelled all that has one")]
    NoUncertainty,
}

/// How the queue is ordered, for people.
pub fn queue_convention() -> String {
    format!(
        "worth: mean standard uncertainty of the labels (0 to 1) times area; basis model_part: the part of the networks alone, \
         whole: all of it, where the part is not known; surface by cells of {} mm",
        1e3 * QUEUE_CELL
    )
}

/// Whether the inspection of `record` has a model to learn from.
///
/// # Errors
/// [`NothingToTeach`].
pub fn check_teachable(record: &InspectionRecord) -> Result<(), NothingToTeach> {
    match &record.outcome {
        Outcome::Running => Err(NothingToTeach::Running),
        _ if record.points == 0 => Err(NothingToTeach::NoModel),
        _ => Ok(()),
    }
}

/// The queue of the inspection of `record`, whose model is `mesh` with the classes of `taxonomy`; `entries` is what people said of it.
///
/// # Errors
/// [`NothingToTeach`].
pub fn teaching_queue(
    mesh: &SemanticMesh,
    taxonomy: &Taxonomy,
    record: &InspectionRecord,
    entries: &[ReviewEntry],
) -> Result<TeachingQueue, NothingToTeach> {
    check_teachable(record)?;
    let corrected = corrected_labels(mesh, taxonomy, record, entries);
    let regions = queued_regions(mesh, &corrected, record, entries);
    if regions.is_empty() {
        return Err(NothingToTeach::NoUncertainty);
    }
    let whole = regions.iter().filter(|region| region.basis == Basis::Whole);
    let worth = whole.map(|region| region.worth).sum();
    let named = |region: QueuedRegion| NamedRegion { name: name(taxonomy, region.component), region };
    Ok(TeachingQueue { worth, regions: regions.into_iter().map(named).collect() })
}

fn name(taxonomy: &Taxonomy, component: u16) -> String {
    let class = taxonomy.components.iter().find(|class| class.id == component);
    class.map_or_else(|| format!("class {component}"), |class| class.name.clone())
}

/// The regions of a model, the one that would teach most first. Empty where no label has an uncertainty.
fn queued_regions(
    mesh: &SemanticMesh,
    corrected: &Corrected,
    record: &InspectionRecord,
    entries: &[ReviewEntry],
) -> Vec<QueuedRegion> {
    let mut regions = surface(mesh, corrected, record.voxel.unwrap_or(1e-3));
    regions.extend(findings(record, entries));
    regions.sort_by(|a, b| b.worth.total_cmp(&a.worth));
    regions
}

/// Measured findings that no entry is about, where their networks' part is known.
fn findings<'a>(record: &'a InspectionRecord, entries: &'a [ReviewEntry]) -> impl Iterator<Item = QueuedRegion> + 'a {
    let list = record.findings.iter().flat_map(|findings| &findings.list);
    let is_open = |id: FindingId| !entries.iter().any(|e| e.review.subject == Subject::Finding { finding: id });
    list.filter(move |finding| is_open(finding.id)).filter_map(|finding| {
        let FindingKind::Defect { .. } = &finding.kind else { return None };
        let region = finding.region.as_ref()?;
        let (area, sigma) = (region.area.value, region.sigma.model?.mean);
        (sigma > 0.0).then_some(QueuedRegion {
            finding: Some(finding.id),
            component: finding.component.class,
            position: region.position,
            area,
            sigma,
            basis: Basis::ModelPart,
            worth: sigma * area,
        })
    })
}

/// Cells of measured surface by component.
fn surface(mesh: &SemanticMesh, corrected: &Corrected, voxel: f64) -> Vec<QueuedRegion> {
    let areas = seen_vertex_areas(mesh, voxel as f32);
    let mut cells: BTreeMap<([i32; 3], u16), Cell> = BTreeMap::new();
    for (v, area) in areas.into_iter().enumerate() {
        let component = known_sigma(corrected.components.by[v], mesh.vertices.sigma[v]);
        let defect = known_sigma(corrected.defects.by[v], mesh.vertices.defect_sigma[v]);
        let Some(sigma) = [component, defect].into_iter().flatten().reduce(f64::max) else { continue };
        let position = mesh.vertices.positions[v].map(f64::from);
        let key = position.map(|c| (c / QUEUE_CELL).floor() as i32);
        let cell = cells.entry((key, mesh.vertices.labels[v])).or_default();
        cell.area += area;
        cell.worth += area * sigma;
        cell.moment = [0, 1, 2].map(|k| cell.moment[k] + area * position[k]);
    }
    let listed = cells.into_iter().filter(|(_, cell)| cell.worth > 0.0);
    listed
        .map(|((_, component), Cell { area, worth, moment })| QueuedRegion {
            finding: None,
            component,
            position: moment.map(|sum| sum / area),
            area,
            sigma: worth / area,
            basis: Basis::Whole,
            worth,
        })
        .collect()
}

/// The uncertainty of a label that nobody corrected; labels that were dropped because they are uncertain have theirs too.
fn known_sigma(by: Labeller, sigma: f32) -> Option<f64> {
    (!by.is_person() && sigma.is_finite()).then(|| f64::from(sigma))
}

#[derive(Default)]
struct Cell {
    area: f64,
    worth: f64,
    moment: [f64; 3],
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::{entry, plate, record, taxonomy, worn_finding};
    use semascan_model::PointFlags;
    use semascan_model::finding::Spread;
    use semascan_model::review::{ReviewAction, SurfacePatch};

    #[test]
    fn the_most_uncertain_surface_comes_first_and_what_a_person_labelled_not_at_all() {
        let mut mesh = plate();
        for v in 0..mesh.len() {
            let [x, y, _] = mesh.vertices.positions[v];
            mesh.vertices.sigma[v] = if x > 0.0 && y > 0.0 { 0.4 } else { 0.1 };
        }
        let unreviewed = corrected_labels(&mesh, &taxonomy(), &record(vec![]), &[]);
        let regions = queued_regions(&mesh, &unreviewed, &record(vec![]), &[]);
        assert!(regions[0].position[0] > 0.0 && regions[0].position[1] > 0.0, "{regions:?}");
        assert!((regions[0].sigma - 0.4).abs() < 0.03 && regions[0].basis == Basis::Whole);
        assert!(regions.windows(2).all(|pair| pair[0].worth >= pair[1].worth));
        let area: f64 = regions.iter().map(|r| r.area).sum();
        assert!((area - 1.6e-3).abs() < 0.1e-3, "{area}");
        // Labels that were dropped as uncertain teach most of all.
        let mut dropped = mesh.clone();
        for v in (0..mesh.len()).filter(|v| mesh.vertices.positions[*v][0] < -0.001) {
            dropped.vertices.sigma[v] = 1.0;
            dropped.vertices.flags[v] = PointFlags(PointFlags::UNLABELLED);
        }
        let unlabelled = corrected_labels(&dropped, &taxonomy(), &record(vec![]), &[]);
        let first = &queued_regions(&dropped, &unlabelled, &record(vec![]), &[])[0];
        assert!(first.position[0] < 0.0 && first.sigma > 0.8, "{first:?}");
        // A person labels the uncertain quarter.
        let patch = SurfacePatch::Voxels { edge: 0.05, cells: vec![[0, 0, 0]] };
        let action = |component: &str, defect: &str| ReviewAction::Relabel {
            patch: patch.clone(),
            component: Some(component.into()),
            defect: Some(defect.into()),
        };
        let log = [entry(1, Subject::Part, action("gear", "none"))];
        let reviewed = corrected_labels(&mesh, &taxonomy(), &record(vec![]), &log);
        let regions = queued_regions(&mesh, &reviewed, &record(vec![]), &log);
        assert!(
            !regions.is_empty() && regions.iter().all(|r| r.position[0] < 0.0 || r.position[1] < 0.0),
            "{regions:?}"
        );
    }

    #[test]
    fn a_finding_is_ordered_by_the_part_of_its_networks_until_somebody_looked_at_it() {
        let mesh = plate();
        let mut finding = worn_finding();
        let region = finding.region.as_mut().expect("a region");
        region.sigma.model = Some(Spread { mean: 0.25, least: 0.1, greatest: 0.4 });
        let record = record(vec![finding.clone()]);
        let corrected = corrected_labels(&mesh, &taxonomy(), &record, &[]);
        let regions = queued_regions(&mesh, &corrected, &record, &[]);
        assert_eq!(regions.len(), 1, "labels of the surface have no uncertainty");
        assert_eq!((regions[0].finding, regions[0].basis), (Some(finding.id), Basis::ModelPart));
        assert!((regions[0].worth - 0.25 * 1.2e-4).abs() < 1e-12);
        let looked = [entry(1, Subject::Finding { finding: finding.id }, ReviewAction::Accept)];
        assert!(queued_regions(&mesh, &corrected, &record, &looked).is_empty());
        let queue = teaching_queue(&mesh, &taxonomy(), &record, &[]).expect("a finding");
        assert_eq!(
            (queue.worth, queue.regions.len()),
            (0.0, 1),
            "what the whole uncertainty says of the rest is not known"
        );
        assert_eq!(teaching_queue(&mesh, &taxonomy(), &record, &looked), Err(NothingToTeach::NoUncertainty));
        let running = InspectionRecord { outcome: Outcome::Running, ..record };
        assert_eq!(check_teachable(&running), Err(NothingToTeach::Running));
    }
}
