//! The labels of a model with everything that people said about them: a plain function of the model and the log.
//!
//! Entries are applied in the order of the log, so that of two people who name the same surface differently the later one
//! counts; how often that happened is part of the result. What changes labels:
//!
//! - a relabelled patch, of any of its three kinds;
//! - a finding of which a person changed the class: its region gets that class, or no defect where it was found in error;
//! - a finding that a person drew and named a defect for: the surface within its outline has it.
//!
//! A brush stroke (a patch of points) may be finer than the mesh, as one along a crack is: strokes are kept beside the labels of
//! vertices, and what lies beneath them, so that the place at a pixel can be asked for.
//!
//! Decisions (accept, reject, rework) are about the part and change no label. A vertex that no network and no source labelled
//! and no person named stays unknown.

use semascan_geometry::measure::PatchSurface;
use semascan_inspection::findings::{MeasuredRegion, measure_regions};
use semascan_inspection::review::drawn_name;
use semascan_model::finding::{Finding, FindingId, FindingKind};
use semascan_model::record::{InspectionRecord, LabelSource};
use semascan_model::review::{ReviewAction, ReviewEntry, Subject, SurfacePatch};
use semascan_model::{ClassDef, PointFlags, SemanticMesh, Taxonomy};
use serde::Serialize;
use std::collections::BTreeMap;

/// Greatest distance of a finding's position from the region that it is, in voxels.
const FARTHEST_POSITION: f64 = 2.0;

/// Who says what a vertex is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Labeller {
    /// Nobody: its label says nothing.
    #[default]
    Nobody,
    /// The inspection.
    Measured,
    /// A person, in this entry of the log.
    Person(u64),
}

impl Labeller {
    /// Whether a person says it.
    pub fn is_person(self) -> bool {
        matches!(self, Self::Person(_))
    }
}

/// One kind of label (components or defects), one value for each vertex of the mesh.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CorrectedLabels {
    /// Class of each vertex.
    pub classes: Vec<u16>,
    /// Who says so.
    pub by: Vec<Labeller>,
}

/// A brush stroke: the surface nearer than the radius to one of its points.
#[derive(Clone, Debug, PartialEq)]
pub struct Stroke {
    /// Place of its entry in the log.
    pub sequence: u64,
    /// Table frame, metres.
    pub points: Vec<[f64; 3]>,
    /// Metres.
    pub radius: f64,
    /// The component that it names; `None` where the component stays.
    pub component: Option<u16>,
    /// The defect that it names; `None` where the defect stays.
    pub defect: Option<u16>,
}

/// Two entries that name the same surface differently.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Contradiction {
    /// Place in the log of the earlier one.
    pub earlier: u64,
    /// Place in the log of the later one, which counts.
    pub later: u64,
    /// Vertices that both name, each in another way.
    pub vertices: u64,
}

/// An entry that should label surface and does not.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct WithoutEffect {
    /// Its place in the log.
    pub sequence: u64,
    /// Why.
    pub reason: String,
}

/// A model's labels with the log applied.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Corrected {
    /// Component classes.
    pub components: CorrectedLabels,
    /// Defect classes.
    pub defects: CorrectedLabels,
    /// Component classes without the strokes.
    pub components_beneath: CorrectedLabels,
    /// Defect classes without the strokes.
    pub defects_beneath: CorrectedLabels,
    /// The strokes, in order.
    pub strokes: Vec<Stroke>,
    /// Entries that labelled surface.
    pub applied: u64,
    /// Entries among them that were made on another generation of the model: their places are those of that one.
    pub of_other_model: u64,
    /// Vertices that have another component or defect than was measured.
    pub changed: u64,
    /// Entries that contradict each other, in order.
    pub contradictions: Vec<Contradiction>,
    /// Entries that should have labelled surface and could not, in order.
    pub without_effect: Vec<WithoutEffect>,
}

/// The labels of `mesh`, the model of the inspection with `record`, after `entries`, which are about it and in order.
/// `taxonomy` has the classes of the mesh.
pub fn corrected_labels(
    mesh: &SemanticMesh,
    taxonomy: &Taxonomy,
    record: &InspectionRecord,
    entries: &[ReviewEntry],
) -> Corrected {
    let measured = |looked: bool, classes: &[u16]| {
        let by = mesh.vertices.flags.iter().map(|flags| match looked && !flags.has(PointFlags::UNLABELLED) {
            true => Labeller::Measured,
            false => Labeller::Nobody,
        });
        CorrectedLabels { classes: classes.to_vec(), by: by.collect() }
    };
    let looked = record.labels != LabelSource::None;
    let looked_for_defects = record.findings.as_ref().is_some_and(|findings| findings.not_looked.is_none());
    let mut corrected = Corrected {
        components: measured(looked, &mesh.vertices.labels),
        defects: measured(looked && looked_for_defects, &mesh.vertices.defects),
        ..Corrected::default()
    };
    corrected.components_beneath.clone_from(&corrected.components);
    corrected.defects_beneath.clone_from(&corrected.defects);
    let surface = PatchSurface::new(mesh);
    let mut regions = FindingRegions::new(mesh, record);
    let mut contradictions: BTreeMap<(u64, u64), u64> = BTreeMap::new();
    for entry in entries {
        let labelled = match labelled(entry, taxonomy, &surface, &mut regions, record, entries) {
            Ok(Some(labelled)) => labelled,
            Ok(None) => continue,
            Err(reason) => {
                corrected.without_effect.push(WithoutEffect { sequence: entry.sequence, reason });
                continue;
            }
        };
        corrected.applied += 1;
        let generation = record.files.as_ref().map(|files| &files.generation);
        let of_other = matches!((&entry.versions.model, generation), (Some(then), Some(now)) if then != now);
        corrected.of_other_model += u64::from(of_other);
        let is_stroke = labelled.stroke.is_some();
        if let Some((points, radius)) = labelled.stroke {
            let (component, defect) = (labelled.component, labelled.defect);
            corrected.strokes.push(Stroke { sequence: entry.sequence, points, radius, component, defect });
        }
        for v in labelled.vertices.iter().map(|v| *v as usize) {
            let beneath = [
                (&mut corrected.components_beneath, labelled.component),
                (&mut corrected.defects_beneath, labelled.defect),
            ];
            for (labels, class) in beneath {
                if let Some(class) = class.filter(|_| !is_stroke) {
                    (labels.classes[v], labels.by[v]) = (class, Labeller::Person(entry.sequence));
                }
            }
            let mut contradicts = None;
            let named = [(&mut corrected.components, labelled.component), (&mut corrected.defects, labelled.defect)];
            for (labels, class) in named {
                let Some(class) = class else { continue };
                match labels.by[v] {
                    Labeller::Person(earlier) if labels.classes[v] != class => contradicts = Some(earlier),
                    _ => {}
                }
                (labels.classes[v], labels.by[v]) = (class, Labeller::Person(entry.sequence));
            }
            if let Some(earlier) = contradicts {
                *contradictions.entry((earlier, entry.sequence)).or_default() += 1;
            }
        }
    }
    let list = contradictions.into_iter();
    corrected.contradictions =
        list.map(|((earlier, later), vertices)| Contradiction { earlier, later, vertices }).collect();
    let differs = |labels: &CorrectedLabels, measured: &[u16], v: usize| {
        labels.by[v].is_person() && labels.classes[v] != measured[v]
    };
    let is_changed = |v: &usize| {
        differs(&corrected.components, &mesh.vertices.labels, *v)
            || differs(&corrected.defects, &mesh.vertices.defects, *v)
    };
    corrected.changed = (0..mesh.len()).filter(is_changed).count() as u64;
    corrected
}

impl Corrected {
    /// Numbers the classes, which are those of `own`, by their names as `all` does. Of a class that `own` does not name nothing
    /// is known.
    pub fn renumber(&mut self, own: &Taxonomy, all: &Taxonomy) {
        let component = |class: u16| renumbered(class, &own.components, &all.components);
        let defect = |class: u16| renumbered(class, &own.defects, &all.defects);
        self.components.renumber(&component);
        self.components_beneath.renumber(&component);
        self.defects.renumber(&defect);
        self.defects_beneath.renumber(&defect);
        for stroke in &mut self.strokes {
            stroke.component = stroke.component.and_then(component);
            stroke.defect = stroke.defect.and_then(defect);
        }
    }
}

impl CorrectedLabels {
    fn renumber(&mut self, renumbered: &dyn Fn(u16) -> Option<u16>) {
        let most = self.classes.iter().copied().max().unwrap_or(0);
        let table: Vec<Option<u16>> = (0..=most).map(renumbered).collect();
        for (class, by) in self.classes.iter_mut().zip(&mut self.by) {
            match table[usize::from(*class)] {
                Some(number) => *class = number,
                None => (*class, *by) = (0, Labeller::Nobody),
            }
        }
    }
}

/// The number that `all` has for the class that is `class` in `own`.
fn renumbered(class: u16, own: &[ClassDef], all: &[ClassDef]) -> Option<u16> {
    if class == 0 {
        return Some(0);
    }
    let name = &own.iter().find(|known| known.id == class)?.name;
    all.iter().find(|known| known.name == *name).map(|known| known.id)
}

/// What an entry says of which surface.
struct Labelled {
    vertices: Vec<u32>,
    /// Points and radius of a patch of points, which may be finer than the mesh.
    stroke: Option<(Vec<[f64; 3]>, f64)>,
    /// `None` where the component stays.
    component: Option<u16>,
    /// `None` where the defect stays.
    defect: Option<u16>,
}

/// What an entry says of the surface; `None` where it says nothing, an error why it could not be applied.
fn labelled(
    entry: &ReviewEntry,
    taxonomy: &Taxonomy,
    surface: &PatchSurface<'_>,
    regions: &mut FindingRegions<'_>,
    record: &InspectionRecord,
    entries: &[ReviewEntry],
) -> Result<Option<Labelled>, String> {
    let component_of = |name: &Option<String>| class(&taxonomy.components, "component", name.as_deref());
    let defect_of = |name: &Option<String>| class(&taxonomy.defects, "defect", name.as_deref());
    let labelled = match &entry.review.action {
        ReviewAction::Relabel { patch, component, defect } => {
            let stroke = match patch {
                SurfacePatch::Points { points, radius } if surface.is_near(points) => Some((points.clone(), *radius)),
                _ => None,
            };
            let (component, defect) = (component_of(component)?, defect_of(defect)?);
            Labelled { component, defect, vertices: surface.vertices_of(patch), stroke }
        }
        ReviewAction::NewFinding { outline, defect: defect @ Some(_), .. } => {
            let (vertices, defect) = (surface.within_curve(outline), defect_of(defect)?);
            Labelled { component: None, defect, vertices, stroke: None }
        }
        ReviewAction::Reclassify { component, defect } => {
            let Subject::Finding { finding } = &entry.review.subject else { return Ok(None) };
            let Some(vertices) = vertices_of_finding(*finding, surface, regions, record, entries)? else {
                return Ok(None);
            };
            let (component, defect) = (component_of(component)?, Some(defect_of(defect)?.unwrap_or(0)));
            Labelled { component, defect, vertices, stroke: None }
        }
        ReviewAction::NewFinding { defect: None, .. }
        | ReviewAction::Accept
        | ReviewAction::Reject
        | ReviewAction::Rework
        | ReviewAction::Comment
        | ReviewAction::Measure { .. }
        | ReviewAction::Withdraw { .. } => return Ok(None),
    };
    if labelled.vertices.is_empty() && labelled.stroke.is_none() {
        return Err("no surface of the model lies in its patch".into());
    }
    Ok(Some(labelled))
}

/// The class of this name; `none` is 0 in any taxonomy.
fn class(classes: &[ClassDef], kind: &str, name: Option<&str>) -> Result<Option<u16>, String> {
    let Some(name) = name else { return Ok(None) };
    if name == "none" {
        return Ok(Some(0));
    }
    let found = classes.iter().find(|class| class.name == name);
    found.map(|class| Some(class.id)).ok_or_else(|| format!("the model has no {kind} {name:?}"))
}

/// The vertices of a finding with a defect, measured or drawn; `None` for findings of other kinds, which are no surface.
fn vertices_of_finding(
    finding: FindingId,
    surface: &PatchSurface<'_>,
    regions: &mut FindingRegions<'_>,
    record: &InspectionRecord,
    entries: &[ReviewEntry],
) -> Result<Option<Vec<u32>>, String> {
    for entry in entries {
        if let ReviewAction::NewFinding { outline, .. } = &entry.review.action
            && drawn_name(entry.review.id) == finding
        {
            return Ok(Some(surface.within_curve(outline)));
        }
    }
    let list = record.findings.iter().flat_map(|findings| &findings.list);
    let found = list.into_iter().find(|measured| measured.id == finding);
    let measured = found.ok_or_else(|| format!("the record has no finding {finding}"))?;
    let FindingKind::Defect { defect } = &measured.kind else { return Ok(None) };
    let vertices = regions.vertices_of(measured, defect.class);
    vertices.map(Some).ok_or_else(|| format!("the mesh has no region of finding {finding}"))
}

/// The regions of the measured findings on the mesh, measured when the first is asked for.
struct FindingRegions<'a> {
    mesh: &'a SemanticMesh,
    voxel: f64,
    measured: Option<Vec<MeasuredRegion>>,
}

impl<'a> FindingRegions<'a> {
    fn new(mesh: &'a SemanticMesh, record: &InspectionRecord) -> Self {
        Self { mesh, voxel: record.voxel.unwrap_or(1e-3), measured: None }
    }

    /// The vertices of a finding: those of the region of its classes that its position lies in.
    fn vertices_of(&mut self, finding: &Finding, defect: u16) -> Option<Vec<u32>> {
        let (mesh, voxel) = (self.mesh, self.voxel);
        let position = glam::DVec3::from_array(finding.region.as_ref()?.position);
        let regions = self.measured.get_or_insert_with(|| measure_regions(mesh, voxel));
        let distance = |region: &MeasuredRegion| {
            let place = |v: &u32| glam::DVec3::from_array(mesh.vertices.positions[*v as usize].map(f64::from));
            let distances = region.vertices.iter().map(|v| place(v).distance(position));
            distances.fold(f64::INFINITY, f64::min)
        };
        let alike = regions.iter().filter(|r| r.component == finding.component.class && r.defect == defect);
        let (region, distance) = alike.map(|r| (r, distance(r))).min_by(|a, b| a.1.total_cmp(&b.1))?;
        (distance <= FARTHEST_POSITION * voxel).then(|| region.vertices.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::{entry, plate, record, taxonomy, worn_finding};
    use semascan_model::review::SurfacePatch;

    fn dot(x: f64, radius: f64) -> SurfacePatch {
        SurfacePatch::Points { points: vec![[x, 0.0, 0.0]], radius }
    }

    fn relabel(sequence: u64, patch: SurfacePatch, component: Option<&str>, defect: Option<&str>) -> ReviewEntry {
        let (component, defect) = (component.map(str::to_owned), defect.map(str::to_owned));
        entry(sequence, Subject::Part, ReviewAction::Relabel { patch, component, defect })
    }

    /// The vertex of the plate at a place in whole millimetres.
    fn at(x: i32, y: i32) -> usize {
        ((y + 20) * 41 + x + 20) as usize
    }

    #[test]
    fn a_patch_has_the_class_that_a_person_gave_it_and_all_else_what_was_measured() {
        let mesh = plate();
        let log = [relabel(4, dot(0.0, 3.5e-3), Some("gear"), None)];
        let corrected = corrected_labels(&mesh, &taxonomy(), &record(vec![]), &log);
        assert_eq!(corrected.components.classes[at(0, 0)], 2);
        assert_eq!(corrected.components.by[at(3, 0)], Labeller::Person(4));
        assert_eq!(
            (corrected.components.classes[at(4, 0)], corrected.components.by[at(4, 0)]),
            (1, Labeller::Measured)
        );
        // The defect was not named: it stays measured.
        assert_eq!((corrected.defects.classes[at(0, 0)], corrected.defects.by[at(0, 0)]), (0, Labeller::Measured));
        assert_eq!((corrected.applied, corrected.changed), (1, 37));
        assert!(corrected.contradictions.is_empty() && corrected.without_effect.is_empty());
    }

    #[test]
    fn of_two_that_contradict_each_other_the_later_counts_and_it_is_counted() {
        let mesh = plate();
        let log = [
            relabel(1, dot(0.0, 3.5e-3), None, Some("wear")),
            relabel(2, dot(0.004, 3.5e-3), None, Some("none")),
            relabel(3, dot(0.004, 1.5e-3), None, Some("none")),
        ];
        let corrected = corrected_labels(&mesh, &taxonomy(), &record(vec![]), &log);
        assert_eq!((corrected.defects.classes[at(0, 0)], corrected.defects.classes[at(3, 0)]), (1, 0));
        let both = |v: &usize| {
            let (x, y) = ((v % 41) as f64 - 20.0, (v / 41) as f64 - 20.0);
            x.hypot(y) < 3.5 && (x - 4.0).hypot(y) < 3.5
        };
        let vertices = (0..mesh.len()).filter(both).count() as u64;
        assert_eq!(corrected.contradictions, [Contradiction { earlier: 1, later: 2, vertices }]);
        assert!(vertices > 5);
        assert_eq!(corrected_labels(&mesh, &taxonomy(), &record(vec![]), &log), corrected, "the same again");
    }

    #[test]
    fn a_finding_that_is_none_loses_its_defect_and_a_drawn_one_gives_it() {
        let mut mesh = plate();
        for v in 0..mesh.len() {
            let [x, y, _] = mesh.vertices.positions[v];
            mesh.vertices.defects[v] = u16::from(x.abs() < 5.5e-3 && y.abs() < 5.5e-3);
        }
        let finding = worn_finding();
        let subject = || Subject::Finding { finding: finding.id };
        let record = record(vec![finding.clone()]);
        let none = entry(1, subject(), ReviewAction::Reclassify { component: None, defect: None });
        let corrected = corrected_labels(&mesh, &taxonomy(), &record, std::slice::from_ref(&none));
        assert!(corrected.defects.classes.iter().all(|d| *d == 0));
        assert_eq!((corrected.changed, corrected.defects.by[at(5, 5)]), (121, Labeller::Person(1)));
        assert_eq!(corrected.defects.by[at(6, 5)], Labeller::Measured);
        // Another class, and another component.
        let change = ReviewAction::Reclassify { component: Some("gear".into()), defect: Some("crack".into()) };
        let corrected = corrected_labels(&mesh, &taxonomy(), &record, &[entry(1, subject(), change)]);
        assert_eq!((corrected.defects.classes[at(5, 5)], corrected.components.classes[at(5, 5)]), (2, 2));
        // A drawn finding, and the same found in error.
        let outline = vec![[0.0095, 0.0095, 0.0], [0.0155, 0.0095, 0.0], [0.0155, 0.0155, 0.0], [0.0095, 0.0155, 0.0]];
        let drawn = ReviewAction::NewFinding { outline, component: "housing".into(), defect: Some("crack".into()) };
        let drawn = entry(2, Subject::Part, drawn);
        let corrected = corrected_labels(&mesh, &taxonomy(), &record, std::slice::from_ref(&drawn));
        assert_eq!((corrected.defects.classes[at(12, 12)], corrected.changed), (2, 36));
        let finding = drawn_name(drawn.review.id);
        let error = entry(3, Subject::Finding { finding }, ReviewAction::Reclassify { component: None, defect: None });
        let corrected = corrected_labels(&mesh, &taxonomy(), &record, &[drawn, error]);
        assert_eq!(corrected.defects.by[at(12, 12)], Labeller::Person(3));
        assert_eq!((corrected.defects.classes[at(12, 12)], corrected.changed), (0, 0));
        // A decision changes no label.
        let reject = entry(1, subject(), ReviewAction::Reject);
        let corrected = corrected_labels(&mesh, &taxonomy(), &record, &[reject]);
        assert_eq!((corrected.applied, corrected.changed), (0, 0));
        assert!(corrected.without_effect.is_empty());
    }

    #[test]
    fn what_cannot_be_applied_is_said_and_what_nobody_labelled_is_unknown() {
        let mut mesh = plate();
        mesh.vertices.flags[at(1, 1)] = PointFlags(PointFlags::UNLABELLED);
        let log = [
            relabel(1, dot(5.0, 1e-3), Some("gear"), None),
            relabel(2, dot(0.0, 1e-2), Some("anchor"), None),
            entry(
                3,
                Subject::Finding { finding: FindingId::from_bytes([9; 16]) },
                ReviewAction::Reclassify { component: None, defect: None },
            ),
        ];
        let corrected = corrected_labels(&mesh, &taxonomy(), &record(vec![]), &log);
        let said: Vec<(u64, &str)> = corrected.without_effect.iter().map(|w| (w.sequence, w.reason.as_str())).collect();
        assert_eq!(said[0], (1, "no surface of the model lies in its patch"));
        assert_eq!(said[1], (2, "the model has no component \"anchor\""));
        assert!(said[2].0 == 3 && said[2].1.contains("no finding"), "{said:?}");
        assert_eq!(corrected.components.by[at(1, 1)], Labeller::Nobody);
        // Where nobody looked for defects there are none that are known; what a person says of them is.
        let mut blind = record(vec![]);
        blind.findings.as_mut().expect("looked").not_looked = Some("no network".into());
        let log = [relabel(1, dot(0.0, 1.5e-3), None, Some("wear"))];
        let corrected = corrected_labels(&mesh, &taxonomy(), &blind, &log);
        assert_eq!(corrected.defects.by[at(9, 9)], Labeller::Nobody);
        assert_eq!((corrected.defects.by[at(0, 0)], corrected.defects.classes[at(0, 0)]), (Labeller::Person(1), 1));
        let mut other = record(vec![]);
        other.files.as_mut().expect("files").generation = "another".into();
        assert_eq!(corrected_labels(&mesh, &taxonomy(), &other, &log).of_other_model, 1);
    }
}
