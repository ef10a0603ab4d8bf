//! Labels that were corrected once on the model and projected into every view, against the true masks of the views: with the
//! edges of masks as the model has them, left open, and refined by the picture.

mod lines;
mod part_truth;
mod person;

use super::{InspectError, inspect};
use crate::{Confusion, PixelScores, TestDomain};
use lines::Sampled;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use part_truth::PartTruth;
use person::{Corrections, VertexTruth, correct};
use semascan_geometry::measure::SurfaceIndex;
use semascan_inspection::Inspected;
use semascan_inspection::source::{Source, SourceError};
use semascan_inspection::spec::{InspectionSpec, LabelSource};
use semascan_labelling::{
    CapturedView, EmptySpace, IGNORE, LabelledModel, MeasuringVolume, RimTreatment, Selection, ViewMasks,
    corrected_labels,
};
use semascan_model::record::{InspectionRecord, ViewRecord};
use semascan_model::{SemanticMesh, Taxonomy};
use semascan_perception::view::{RecordedLabels, View};
use semascan_simulation::{VirtualCell, VirtualCellSpec};
use serde::Serialize;
use std::io::{self, Write};

/// Voxels from the true surface up to which a vertex lies on it.
const FARTHEST: f64 = 1.5;

/// What is inspected.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Config {
    /// Seeds of the motors.
    pub motors: Vec<u64>,
    /// Views of each.
    pub views: u32,
    /// Columns and rows.
    pub size: (u32, u32),
    /// The world that they are seen in: one with whole motors, [`TestDomain::VirtualCell`] or [`TestDomain::Shifted`].
    pub domain: TestDomain,
    /// Where labels come from before they are corrected.
    pub labels: LabelSource,
    /// Voxel edge in millimetres; by default that of the inspection.
    pub voxel_mm: Option<f64>,
}

impl Default for Config {
    /// Ten motors that no network was trained on.
    fn default() -> Self {
        Self {
            motors: (1001..=1010).collect(),
            views: 12,
            size: (640, 480),
            domain: TestDomain::VirtualCell,
            labels: LabelSource::Network,
            voxel_mm: None,
        }
    }
}

/// How masks are made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Masks {
    /// Of the labels as they were measured; edges as the model has them.
    Measured,
    /// Of the corrected labels; edges as the model has them.
    Corrected,
    /// The same, on those pixels alone that the refined masks label.
    CorrectedWhereRefined,
    /// Of the corrected labels; edges left open.
    RimOpen,
    /// Of the corrected labels; edges refined by the picture.
    RimRefined,
    /// The same, and gaps along silhouettes closed: what a network is taught by.
    GapsClosed,
}

impl Masks {
    /// In the order of the table.
    pub const ALL: [Self; 6] = [
        Self::Measured,
        Self::Corrected,
        Self::CorrectedWhereRefined,
        Self::RimOpen,
        Self::RimRefined,
        Self::GapsClosed,
    ];

    /// For people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Measured => "as measured",
            Self::Corrected => "corrected",
            Self::CorrectedWhereRefined => "  same pixels as refined",
            Self::RimOpen => "corrected, rims left open",
            Self::RimRefined => "corrected, rims refined",
            Self::GapsClosed => "  and gaps closed",
        }
    }
}

/// Figures of one kind of masks over all views.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// How the masks are made.
    pub masks: Masks,
    /// Components, outside of what is left open.
    pub components: PixelScores,
    /// Share of all pixels whose component is left open.
    pub open: f64,
    /// The same among the pixels that truly show a component.
    pub open_on_part: f64,
    /// Defects, outside of what is left open.
    pub defects: PixelScores,
    /// Share of the pixels that truly show a component whose defect is left open.
    pub defects_open_on_part: f64,
    /// Share of the pixels of each component class, none first, whose component is left open; `None` where there are none.
    pub components_open: Vec<Option<f64>>,
    /// The same of defect classes.
    pub defects_open: Vec<Option<f64>>,
}

/// One motor.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Motor {
    /// Its seed.
    pub seed: u64,
    /// Voxel edge, metres.
    pub voxel: f64,
    /// Vertices of the model with a wrong component, before and after the correction, as shares.
    pub wrong: (f64, f64),
    /// Strokes that corrected it.
    pub strokes: usize,
    /// Mean IoU of the components in the refined masks.
    pub mean_iou: f64,
}

/// The table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// What was inspected.
    pub config: Config,
    /// Names of the component classes, none first.
    pub classes: Vec<String>,
    /// Names of the defect classes, none first.
    pub defects: Vec<String>,
    /// By motor.
    pub motors: Vec<Motor>,
    /// By masks, over all views together.
    pub rows: Vec<Row>,
}

/// Why there is no table.
#[derive(Debug, thiserror::Error)]
pub enum LabelsError {
    /// The motor cannot be simulated.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// It could not be inspected.
    #[error("motor {seed}: {source}")]
    Inspect {
        /// Its seed.
        seed: u64,
        /// Why.
        source: InspectError,
    },
    /// Its masks were not taken.
    #[error("masks of motor {seed}: {source}")]
    Masks {
        /// Its seed.
        seed: u64,
        /// Why.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// There is nothing to compare with.
    #[error("motor {seed}: {what}")]
    Unknown {
        /// Its seed.
        seed: u64,
        /// What is missing.
        what: &'static str,
    },
}

/// A view with the masks that a data set of its inspection has.
#[derive(Debug)]
pub struct MaskedView<'a> {
    /// Seed of the motor.
    pub seed: u64,
    /// Name of the motor.
    pub part: &'a str,
    /// The view, with its true labels.
    pub view: &'a View,
    /// The pose that the inspection found.
    pub table_from_camera: Isometry3<f64>,
    /// Corrected labels, projected, with refined rims and closed gaps.
    pub masks: &'a ViewMasks,
    /// The classes of the masks.
    pub taxonomy: &'a Taxonomy,
}

/// What takes the masks of every view, motor by motor.
pub type TakeMasks<'a> = &'a mut dyn FnMut(&MaskedView<'_>) -> Result<(), Box<dyn std::error::Error + Send + Sync>>;

/// Inspects, corrects and projects every motor; `on_step` gets how many are done, and of how many, `on_masks` each view.
///
/// # Errors
/// [`LabelsError`] naming the motor.
pub fn run(config: &Config, on_step: &dyn Fn(usize, usize), on_masks: TakeMasks<'_>) -> Result<Report, LabelsError> {
    let mut motors = Vec::new();
    let mut sums: Option<Vec<Sums>> = None;
    let (mut classes, mut defects) = (Vec::new(), Vec::new());
    for &seed in &config.motors {
        on_step(motors.len(), config.motors.len());
        let (motor, own, taxonomy) = motor(config, seed, on_masks)?;
        motors.push(motor);
        match &mut sums {
            Some(sums) => sums.iter_mut().zip(&own).for_each(|(sum, one)| sum.merge(one)),
            None => sums = Some(own),
        }
        classes = taxonomy.components.into_iter().map(|class| class.name).collect();
        defects = taxonomy.defects.into_iter().map(|class| class.name).collect();
    }
    let rows = sums.into_iter().flatten().zip(Masks::ALL).map(|(sum, masks)| sum.row(masks)).collect();
    Ok(Report { config: config.clone(), classes, defects, motors, rows })
}

fn motor(config: &Config, seed: u64, on_masks: TakeMasks<'_>) -> Result<(Motor, Vec<Sums>, Taxonomy), LabelsError> {
    let unknown = |what| LabelsError::Unknown { seed, what };
    let (width, height) = config.size;
    let domain = if config.domain == TestDomain::Shifted { "shifted" } else { "standard" };
    let views = config.views;
    let uri = format!("virtual:starter-motor?seed={seed}&views={views}&size={width}x{height}&domain={domain}");
    let cell = VirtualCellSpec::parse(&uri)?;
    let mut spec = InspectionSpec { labels: config.labels, ..InspectionSpec::default() };
    spec.source.voxel_mm = config.voxel_mm;
    let inspected =
        inspect(spec, Box::new(VirtualCell::open(&cell)?)).map_err(|source| LabelsError::Inspect { seed, source })?;
    let mut views = VirtualCell::open(&cell)?;
    let truth = views.truth().ok_or(unknown("its true mesh is not known"))?;
    let voxel = inspected.record.voxel.ok_or(unknown("its voxels are not known"))?;
    let truth = PartTruth::at_model(truth, &views, &inspected.recorded.true_poses)
        .ok_or(unknown("its true poses are not known"))?;
    let sampled = Sampled::around_defects(&truth);
    let truth = vertex_truth(&inspected.mesh, &truth, voxel);
    let taxonomy = inspected.source.info().taxonomy.clone();
    if taxonomy != views.info().taxonomy {
        return Err(unknown("its networks know other classes than the truth"));
    }
    let Inspected { mesh, record, .. } = &inspected;
    let Corrections { entries, strokes } = correct(mesh, &truth, &sampled, seed, &taxonomy, record);
    let measured = corrected_labels(mesh, &taxonomy, record, &[]);
    let corrected = corrected_labels(mesh, &taxonomy, record, &entries);
    let as_measured = LabelledModel::new(mesh, &measured, voxel, Selection::default());
    let as_corrected = LabelledModel::new(mesh, &corrected, voxel, Selection::default());
    let mut sums = vec![Sums::new(&taxonomy); Masks::ALL.len()];
    let space = empty_space(&mut views, record, voxel)?;
    let mut views = VirtualCell::open(&cell)?;
    while let Some(view) = views.next_view() {
        let view = view?;
        let (Some(labels), Some(recorded)) = (&view.labels, record.views.iter().find(|v| v.index == view.index)) else {
            continue;
        };
        let Some(captured) = captured(&view, recorded, space.as_ref()) else { continue };
        let before = as_measured.project(&captured).masks;
        let after = as_corrected.project(&captured);
        let refined = after.masks_with(&captured, RimTreatment::Refine);
        let open = after.masks_with(&captured, RimTreatment::Open);
        let closed = after.masks_with(&captured, RimTreatment::Close);
        let (table_from_camera, masks) = (captured.table_from_camera, &closed);
        on_masks(&MaskedView { seed, part: &record.part, view: &view, table_from_camera, masks, taxonomy: &taxonomy })
            .map_err(|source| LabelsError::Masks { seed, source })?;
        let mut restricted = after.masks.clone();
        restrict(&mut restricted.components, &refined.components);
        restrict(&mut restricted.defects, &refined.defects);
        for (sum, masks) in sums.iter_mut().zip([&before, &after.masks, &restricted, &open, &refined, &closed]) {
            sum.add(labels, &masks.components, &masks.defects);
        }
    }
    let wrong = |classes: &[u16]| {
        let wrong = classes.iter().zip(&truth.components).filter(|(a, b)| a != b).count();
        wrong as f64 / classes.len().max(1) as f64
    };
    let wrong = (wrong(&mesh.vertices.labels), wrong(&corrected.components.classes));
    let refined = sums.iter().zip(Masks::ALL).find(|(_, masks)| *masks == Masks::RimRefined);
    let mean_iou = refined.map_or(0.0, |(refined, _)| refined.components.scores().mean_iou);
    Ok((Motor { seed, voxel, wrong, strokes, mean_iou }, sums, taxonomy))
}

/// The classes of the true surface at each vertex; none where the true surface is farther than [`FARTHEST`] voxels.
fn vertex_truth(mesh: &SemanticMesh, truth: &PartTruth<'_>, voxel: f64) -> VertexTruth {
    let surface = SurfaceIndex::new(&truth.mesh.vertices, &truth.mesh.triangles);
    let (mut components, mut defects) = (Vec::new(), Vec::new());
    for nearest in surface.closest_of_all(&mesh.vertices.positions) {
        let there = nearest.filter(|nearest| f64::from(nearest.distance) <= FARTHEST * voxel);
        let component = there.and_then(|n| truth.mesh.labels.get(n.vertex as usize)).copied().unwrap_or(0);
        components.push(component);
        defects.push(there.map_or(0, |n| truth.defect_at(n.point, component)));
    }
    VertexTruth { components, defects }
}

/// Where the part can be, without what its views saw to be empty.
fn empty_space(
    views: &mut VirtualCell,
    record: &InspectionRecord,
    voxel: f64,
) -> Result<Option<EmptySpace>, SourceError> {
    let Some((least, greatest)) = views.info().volume else { return Ok(None) };
    let mut space = EmptySpace::new(MeasuringVolume { least, greatest }, voxel);
    while let Some(view) = views.next_view() {
        let view = view?;
        let recorded = record.views.iter().find(|v| v.index == view.index);
        if let Some(captured) = recorded.and_then(|recorded| captured(&view, recorded, None)) {
            space.see(&captured);
        }
    }
    Ok(Some(space))
}

/// A view at the pose that the inspection found for it; `None` where it found none.
fn captured<'a>(view: &'a View, recorded: &ViewRecord, space: Option<&'a EmptySpace>) -> Option<CapturedView<'a>> {
    let pose = recorded.pose.as_ref().filter(|_| recorded.accepted)?;
    let q = pose.rotation;
    let rotation = UnitQuaternion::try_new(Quaternion::new(q.w, q.x, q.y, q.z), 1e-6)?;
    let [x, y, z] = pose.translation;
    let table_from_camera = Isometry3::from_parts(Translation3::new(x, y, z), rotation);
    Some(CapturedView::of(view, table_from_camera, recorded, space))
}

/// Leaves open what is open in `other`.
fn restrict(labels: &mut [u16], other: &[u16]) {
    labels.iter_mut().zip(other).filter(|(_, other)| **other == IGNORE).for_each(|(label, _)| *label = IGNORE);
}

/// Pixels of one kind of masks.
#[derive(Clone, Debug)]
struct Sums {
    components: Confusion,
    defects: Confusion,
    pixels: u64,
    on_part: u64,
    open: u64,
    open_on_part: u64,
    defects_open_on_part: u64,
    /// Pixels of each true class: left open, and all.
    components_open: Vec<[u64; 2]>,
    defects_open: Vec<[u64; 2]>,
}

impl Sums {
    fn new(taxonomy: &Taxonomy) -> Self {
        Self {
            components: Confusion::new(taxonomy.components.len()),
            defects: Confusion::new(taxonomy.defects.len()),
            pixels: 0,
            on_part: 0,
            open: 0,
            open_on_part: 0,
            defects_open_on_part: 0,
            components_open: vec![[0; 2]; taxonomy.components.len()],
            defects_open: vec![[0; 2]; taxonomy.defects.len()],
        }
    }

    fn add(&mut self, truth: &RecordedLabels, components: &[u16], defects: &[u16]) {
        for (at, &component) in truth.components.iter().enumerate() {
            let on_part = u64::from(component != 0);
            for (open, class, label) in [
                (&mut self.components_open, component, components[at]),
                (&mut self.defects_open, truth.defects[at], defects[at]),
            ] {
                if let Some([open, all]) = open.get_mut(usize::from(class)) {
                    *open += u64::from(label == IGNORE);
                    *all += 1;
                }
            }
            self.pixels += 1;
            self.on_part += on_part;
            match components[at] {
                IGNORE => {
                    self.open += 1;
                    self.open_on_part += on_part;
                }
                label => self.components.add(component, Some(label)),
            }
            match defects[at] {
                IGNORE => self.defects_open_on_part += on_part,
                label => self.defects.add(truth.defects[at], Some(label)),
            }
        }
    }

    fn merge(&mut self, other: &Self) {
        self.components.merge(&other.components);
        self.defects.merge(&other.defects);
        self.pixels += other.pixels;
        self.on_part += other.on_part;
        self.open += other.open;
        self.open_on_part += other.open_on_part;
        self.defects_open_on_part += other.defects_open_on_part;
        let lists =
            [(&mut self.components_open, &other.components_open), (&mut self.defects_open, &other.defects_open)];
        for ([open, all], [more_open, more]) in lists.into_iter().flat_map(|(own, other)| own.iter_mut().zip(other)) {
            *open += more_open;
            *all += more;
        }
    }

    fn row(&self, masks: Masks) -> Row {
        let share = |part: u64, all: u64| part as f64 / all.max(1) as f64;
        let by_class = |counts: &[[u64; 2]]| -> Vec<Option<f64>> {
            counts.iter().map(|[open, all]| (*all > 0).then(|| share(*open, *all))).collect()
        };
        Row {
            masks,
            components: self.components.scores(),
            open: share(self.open, self.pixels),
            open_on_part: share(self.open_on_part, self.on_part),
            defects: self.defects.scores(),
            defects_open_on_part: share(self.defects_open_on_part, self.on_part),
            components_open: by_class(&self.components_open),
            defects_open: by_class(&self.defects_open),
        }
    }
}

/// Prints the table.
///
/// # Errors
/// If `out` fails.
pub fn print(out: &mut impl Write, report: &Report) -> io::Result<()> {
    let Report { config, classes, defects, motors, rows } = report;
    writeln!(
        out,
        "labels of {} motors ({}), {} views of {}x{}, from {}, corrected on the model with strokes of 3 to 10 mm and, along \
         what is thinner, lines of 1.5 and 0.8 mm",
        motors.len(),
        config.domain.name(),
        config.views,
        config.size.0,
        config.size.1,
        config.labels.name()
    )?;
    writeln!(
        out,
        "{:<8} {:>8} {:>14} {:>14} {:>8} {:>9}",
        "motor", "voxel mm", "wrong before %", "wrong after %", "strokes", "mean IoU"
    )?;
    for Motor { seed, voxel, wrong, strokes, mean_iou } in motors {
        let (before, after) = (100.0 * wrong.0, 100.0 * wrong.1);
        writeln!(out, "{seed:<8} {:>8.3} {before:>14.2} {after:>14.2} {strokes:>8} {mean_iou:>9.4}", voxel * 1e3)?;
    }
    writeln!(
        out,
        "{:<27} {:>9} {:>11} {:>8} {:>10} {:>12} {:>12}",
        "masks", "mean IoU", "with none", "open %", "on part %", "defects IoU", "open on part"
    )?;
    for row in rows {
        writeln!(
            out,
            "{:<27} {:>9.4} {:>11.4} {:>8.2} {:>10.2} {:>12.4} {:>11.2}%",
            row.masks.name(),
            row.components.mean_iou,
            row.components.mean_iou_with_none,
            100.0 * row.open,
            100.0 * row.open_on_part,
            row.defects.mean_iou,
            100.0 * row.defects_open_on_part
        )?;
    }
    let Some(refined) = rows.iter().find(|row| row.masks == Masks::RimRefined) else { return Ok(()) };
    writeln!(out, "{:<27} {:>9} {:>8}", "by class, rims refined", "IoU", "open %")?;
    for (names, scores, open) in
        [(classes, &refined.components, &refined.components_open), (defects, &refined.defects, &refined.defects_open)]
    {
        for ((name, iou), open) in names.iter().skip(1).zip(&scores.iou).zip(open.iter().skip(1)) {
            let iou = iou.map_or_else(|| "-".to_owned(), |iou| format!("{iou:.4}"));
            let open = open.map_or_else(|| "-".to_owned(), |open| format!("{:.1}", 100.0 * open));
            writeln!(out, "  {name:<25} {iou:>9} {open:>8}")?;
        }
    }
    Ok(())
}
