//! [Remanufacturing paper], Table 6: models of ten unseen motors, labelled by networks, judged by component.
//!
//! Each motor is inspected as `semascan inspect virtual:starter-motor?seed=N&views=5 --labels network --uncertain drop
//! --sigma T` inspects it. Accuracy is correct / retained, completeness retained / all points of a component; points of
//! the ten models count together, then components count alike.

use super::super::{NetworkSetting, Progress};
use super::P0Error;
use crate::network_scores::Shelf;
use crate::{DefectArea, TruthReport, defect_areas, judge};
use semascan_inspection::source::Source;
use semascan_inspection::spec::{InspectionSpec, LabelSource, NetworkSpec};
use semascan_model::Taxonomy;
use semascan_perception::fuse::Uncertain;
use semascan_simulation::{VirtualCell, VirtualCellSpec};
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::{self, Write};

/// The paper's figures, shares of 1: by component in the order of [`COMPONENTS`], then the mean.
const PUBLISHED: [(&str, [f64; 6]); 4] = [
    ("UD_opt,EF accuracy", [0.961, 0.944, 0.931, 0.907, 0.953, 0.939]),
    ("MD_opt,EF accuracy", [0.940, 0.916, 0.935, 0.844, 0.949, 0.917]),
    ("UD_opt,EF completeness", [0.933, 0.979, 0.990, 0.942, 0.969, 0.962]),
    ("MD_opt,EF completeness", [0.931, 0.972, 0.980, 0.916, 0.924, 0.944]),
];
/// The paper's components in its order; `electric` is the electrical connection.
const COMPONENTS: [&str; 5] = ["carrier", "housing", "solenoid", "electrical connection", "gear"];

/// Figures of one component, or of all together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Figures {
    /// Correct / retained.
    pub accuracy: f64,
    /// Retained / all.
    pub completeness: f64,
}

/// One component over all motors.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Component {
    /// Its name.
    pub name: String,
    /// Points whose true component it is.
    pub points: u64,
    /// Its figures.
    #[serde(flatten)]
    pub figures: Figures,
    /// Areas of its defects.
    pub defects: Vec<NamedArea>,
}

/// Area of a defect on a component over all motors, square metres.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NamedArea {
    /// The defect.
    pub name: String,
    /// Its areas.
    #[serde(flatten)]
    pub area: DefectArea,
}

/// One motor.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Motor {
    /// Its seed.
    pub seed: u64,
    /// Over all its points.
    #[serde(flatten)]
    pub figures: Figures,
    /// Points judged.
    pub points: u64,
    /// Views that were left out.
    pub rejected: u32,
}

/// The table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Table6 {
    /// How the figures are to be read.
    pub setting: String,
    /// Threshold of sigma.
    pub sigma: f32,
    /// By component.
    pub components: Vec<Component>,
    /// Mean over the components.
    pub mean: Figures,
    /// Over all points; those that are truly no component are among them.
    pub points: Figures,
    /// By motor.
    pub motors: Vec<Motor>,
    /// The paper's: name, by component in its order, mean.
    pub published: Vec<(String, [f64; 6])>,
}

/// Sums over the motors.
#[derive(Default)]
struct Sums {
    /// Points, retained and correct of each true class.
    classes: BTreeMap<u16, [u64; 3]>,
    areas: BTreeMap<(u16, u16), DefectArea>,
}

/// Inspects and judges every motor at threshold `sigma`.
///
/// # Errors
/// [`P0Error`] naming the motor.
pub fn run(
    shelf: &Shelf,
    setting: &NetworkSetting,
    sigma: f32,
    progress: &mut Progress<'_>,
) -> Result<Table6, P0Error> {
    let (mut sums, mut motors, mut taxonomy) = (Sums::default(), Vec::new(), Taxonomy::from_names::<&str>(&[], &[]));
    for &seed in &setting.test.motors {
        let (motor, truth, areas, classes) = inspect(shelf, setting, sigma, seed)?;
        sums.add(&truth, &areas);
        motors.push(motor);
        taxonomy = classes;
        progress.step();
    }
    let components: Vec<Component> = sums.components(&taxonomy);
    let n = components.len().max(1) as f64;
    let mean = Figures {
        accuracy: components.iter().map(|c| c.figures.accuracy).sum::<f64>() / n,
        completeness: components.iter().map(|c| c.figures.completeness).sum::<f64>() / n,
    };
    let all = sums.classes.values().fold([0; 3], |a, b| [a[0] + b[0], a[1] + b[1], a[2] + b[2]]);
    Ok(Table6 {
        setting: describe(setting),
        sigma,
        components,
        mean,
        points: figures(all),
        motors,
        published: PUBLISHED.iter().map(|(name, values)| ((*name).to_owned(), *values)).collect(),
    })
}

type Inspected = (Motor, TruthReport, Vec<DefectArea>, Taxonomy);

fn inspect(shelf: &Shelf, setting: &NetworkSetting, sigma: f32, seed: u64) -> Result<Inspected, P0Error> {
    let test = &setting.test;
    let (w, h) = test.size;
    let uri = format!("virtual:starter-motor?seed={seed}&views={}&size={w}x{h}&cell={}", test.views, test.cell);
    let cell = VirtualCell::open(&VirtualCellSpec::parse(&uri)?)?;
    let chosen = shelf.chosen(&cell.info().taxonomy)?;
    let network = NetworkSpec {
        models: chosen.iter().map(|(folder, _)| folder.display().to_string()).collect(),
        threshold: Some(sigma),
        uncertain: Uncertain::Drop,
        ..NetworkSpec::default()
    };
    let spec = InspectionSpec { labels: LabelSource::Network, network, ..InspectionSpec::default() };
    let inspected = super::super::inspect(spec, Box::new(cell))?;
    let cloud = &inspected.cloud;
    let truth = inspected.source.truth().ok_or(P0Error::NoView(seed))?;
    let report = judge(cloud, truth);
    let areas = defect_areas(&inspected.mesh, truth, inspected.model.read().config().voxel);
    let taxonomy = inspected.source.info().taxonomy.clone();
    let rejected = inspected.recorded.rejections().len() as u32;
    let figures = Figures { accuracy: report.accuracy, completeness: report.completeness };
    Ok((Motor { seed, figures, points: report.points, rejected }, report, areas, taxonomy))
}

fn figures([points, retained, correct]: [u64; 3]) -> Figures {
    let share = |part: u64, whole: u64| if whole == 0 { 1.0 } else { part as f64 / whole as f64 };
    Figures { accuracy: share(correct, retained), completeness: share(retained, points) }
}

impl Sums {
    fn add(&mut self, truth: &TruthReport, areas: &[DefectArea]) {
        for c in &truth.components {
            let sums = self.classes.entry(c.class).or_default();
            *sums = [sums[0] + c.points, sums[1] + c.retained, sums[2] + c.correct];
        }
        for a in areas {
            let sum = self.areas.entry((a.component, a.defect)).or_default();
            *sum = DefectArea {
                component: a.component,
                defect: a.defect,
                said: sum.said + a.said,
                truth: sum.truth + a.truth,
                both: sum.both + a.both,
                on_mesh: sum.on_mesh + a.on_mesh,
            };
        }
    }

    /// In the paper's order, then what else there is.
    fn components(&self, taxonomy: &Taxonomy) -> Vec<Component> {
        let name =
            |class: u16| taxonomy.components.get(usize::from(class)).map_or_else(String::new, |c| c.name.clone());
        let mut components: Vec<Component> = self
            .classes
            .iter()
            .filter(|(class, sums)| **class != 0 && sums[0] > 0)
            .map(|(class, sums)| Component {
                name: name(*class),
                points: sums[0],
                figures: figures(*sums),
                defects: self.areas.values().filter(|a| a.component == *class).map(|a| named(*a, taxonomy)).collect(),
            })
            .collect();
        let place = |c: &Component| COMPONENTS.iter().position(|name| *name == c.name).unwrap_or(COMPONENTS.len());
        components.sort_by_key(place);
        components
    }
}

fn named(area: DefectArea, taxonomy: &Taxonomy) -> NamedArea {
    let defect = taxonomy.defects.get(usize::from(area.defect));
    NamedArea { name: defect.map_or_else(String::new, |d| d.name.clone()), area }
}

fn describe(setting: &NetworkSetting) -> String {
    let test = &setting.test;
    format!(
        "ours: virtual cell, {} motors that nothing was trained or chosen on (seeds {:?}), {} views of {}x{}, the pipeline of \
         inspect with --labels network --uncertain drop; truth: class of the nearest vertex of the true mesh. Published: ten \
         real motors, labelled by hand. Other parts and hardware: not comparable",
        test.motors.len(),
        test.motors,
        test.views,
        test.size.0,
        test.size.1
    )
}

/// Writes the table for people.
///
/// # Errors
/// If `out` fails.
pub fn print(out: &mut dyn Write, report: &Table6) -> io::Result<()> {
    write!(out, "{:<36}", format!("P0, Table 6, %, sigma {}", report.sigma))?;
    report.components.iter().try_for_each(|c| write!(out, "{:>14.13}", c.name))?;
    writeln!(out, "{:>10}{:>10}", "mean", "points")?;
    for (name, of) in [("accuracy", accuracy as fn(&Figures) -> f64), ("completeness", |f| f.completeness)] {
        write!(out, "{name:<36}")?;
        report.components.iter().try_for_each(|c| write!(out, "{:>14.2}", of(&c.figures) * 100.0))?;
        writeln!(out, "{:>10.2}{:>10.2}", of(&report.mean) * 100.0, of(&report.points) * 100.0)?;
    }
    for (name, values) in &report.published {
        write!(out, "{:<36}", format!("P0: {name}"))?;
        values[..5].iter().try_for_each(|v| write!(out, "{:>14.1}", v * 100.0))?;
        writeln!(out, "{:>10.1}", values[5] * 100.0)?;
    }
    writeln!(
        out,
        "\n{:<36}{:>14}{:>14}{:>14}{:>16}",
        "defects, cm2", "said", "true, seen", "both", "true, whole mesh"
    )?;
    for c in &report.components {
        for d in &c.defects {
            let [said, truth, both, on_mesh] =
                [d.area.said, d.area.truth, d.area.both, d.area.on_mesh].map(|a| a * 1e4);
            let name = format!("{}, {}", c.name, d.name);
            writeln!(out, "{name:<36}{said:>14.2}{truth:>14.2}{both:>14.2}{on_mesh:>16.2}")?;
        }
    }
    for m in &report.motors {
        let (a, c) = (m.figures.accuracy * 100.0, m.figures.completeness * 100.0);
        let rejected = if m.rejected == 0 { String::new() } else { format!(", {} views left out", m.rejected) };
        writeln!(out, "motor {}: accuracy {a:.2}, completeness {c:.2}, {} points{rejected}", m.seed, m.points)?;
    }
    writeln!(out, "{}", report.setting)
}

fn accuracy(figures: &Figures) -> f64 {
    figures.accuracy
}
