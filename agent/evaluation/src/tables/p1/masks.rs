//! [Eye-in-hand 2020], Tables 1 and 2: IoU of the masks of a network, and of the same masks after LCCCP fusion
//! segmentation, by object.
//!
//! The objects that networks of this product are trained on are the components of starter motors; the paper's toys and
//! the YCB objects are not among them, so its figures stand in rows of their own. IoU is the paper's: correct / (true
//! or said to be), over the pixels of all views together.

use super::published;
use crate::network_scores::{labelling, test_source};
use crate::tables::setting::NOT_TRAINED;
use crate::tables::{NetworkSetting, Progress};
use crate::{NetworkError, PixelScores, RiskCoverage, TestDomain, TestViews};
use semascan_perception::segment::geometric::PatchMethod;
use semascan_perception::segment::geometric::fusion_segmentation::FusionConfig;
use semascan_perception::segment::network::{NetworkConfig, NetworkSegmenter, SelectError, Task};
use semascan_perception::segment::{GeometricSegmenter, RecordedSegmenter, Segmenter};
use serde::Serialize;
use std::io::{self, Write};

/// The paper's network, on the compact backbone.
const DETECTOR: &str = "mask-rcnn-edge";
/// The paper's objects, of which it prints figures.
const PUBLISHED: [(u32, &str); 9] = [
    (1, "cylinder"),
    (1, "half-cylinder"),
    (1, "L-block"),
    (1, "cuboid"),
    (1, "box"),
    (2, "lemon"),
    (2, "orange"),
    (2, "plum"),
    (2, "mug"),
];

/// Masks of one network in one domain.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DomainMasks {
    /// The domain.
    pub domain: TestDomain,
    /// As the network gives them.
    pub network: PixelScores,
    /// Fitted to the geometry.
    pub fused: PixelScores,
}

/// Masks of one network.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Masks {
    /// Its model.
    pub model: String,
    /// By domain; empty: not trained here.
    pub domains: Vec<DomainMasks>,
}

/// The paper's figures of an object, per cent.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Published {
    /// The paper's table.
    pub table: u32,
    /// The object.
    pub object: String,
    /// Mask R-CNN, and after fusion.
    pub iou: [f64; 2],
}

/// The tables.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MaskTables {
    /// How the figures are to be read.
    pub setting: String,
    /// Objects of ours, in the order of the figures.
    pub objects: Vec<String>,
    /// Ours.
    pub masks: Vec<Masks>,
    /// The paper's.
    pub published: Vec<Published>,
}

/// Judges the masks of the models that are there; `on_step` gets how many steps are done, and of how many.
///
/// # Errors
/// [`NetworkError`] if a model that is there cannot be used.
pub fn run(setting: &NetworkSetting, mut on_step: impl FnMut(usize, usize)) -> Result<MaskTables, NetworkError> {
    let mut progress = Progress::new(&mut on_step);
    let mut masks = vec![Masks { model: DETECTOR.into(), domains: Vec::new() }];
    let mut networks: Vec<(usize, NetworkSegmenter)> = Vec::new();
    let (shelf, source) = (setting.shelf()?, test_source());
    if let Some(folder) = shelf.find(DETECTOR) {
        networks.push((0, shelf.single(&folder, 0, &source)?));
    }
    let chosen = match shelf.chosen(&source.taxonomy) {
        Err(NetworkError::Select(SelectError::None { .. })) => Vec::new(),
        chosen => chosen?,
    };
    // Defects have no masks in these tables.
    let chosen: Vec<_> = chosen.into_iter().filter(|(_, m)| m.task != Task::Defect).collect();
    let folders = labelling(&chosen);
    if let Some((_, manifest)) = chosen.iter().find(|(folder, _)| folders.contains(folder)) {
        networks.push((masks.len(), shelf.segmenter(&folders, &source, &NetworkConfig::default())?));
        masks.push(Masks { model: manifest.name.clone(), domains: Vec::new() });
    }
    if !networks.is_empty() {
        progress.expect(TestDomain::ALL.len() * setting.test.count());
        for domain in TestDomain::ALL {
            for (place, scores) in score(&mut networks, &setting.test, domain, &mut progress)? {
                masks[place].domains.push(scores);
            }
        }
    }
    let iou = |(table, object): (u32, &str)| {
        Some(Published { table, object: object.into(), iou: published::mask_iou(object)? })
    };
    Ok(MaskTables {
        setting: describe(&setting.test),
        objects: TestViews::taxonomy().components.iter().skip(1).map(|c| c.name.clone()).collect(),
        masks,
        published: PUBLISHED.into_iter().filter_map(iou).collect(),
    })
}

/// Scores of every network in one domain, by its place.
fn score(
    networks: &mut [(usize, NetworkSegmenter)],
    views: &TestViews,
    domain: TestDomain,
    progress: &mut Progress<'_>,
) -> Result<Vec<(usize, DomainMasks)>, NetworkError> {
    let fitter = GeometricSegmenter {
        fusion: FusionConfig::PAPER,
        ..GeometricSegmenter::new(RecordedSegmenter, PatchMethod::LCCCP)
    };
    let nothing = RiskCoverage::new(TestViews::taxonomy().component_count());
    let mut scores = vec![(nothing.clone(), nothing); networks.len()];
    for seed in &views.motors {
        let motor = views.motor(domain, *seed)?;
        networks.iter_mut().for_each(|(_, network)| network.look_at(motor.volume()));
        for view in motor.views() {
            let Some(labels) = &view.labels else { continue };
            for ((_, network), (plain, fused)) in networks.iter_mut().zip(&mut scores) {
                let said = network.segment(&view)?;
                plain.add(&said.components, &labels.components);
                fused.add(&fitter.fit(&view, &said).components, &labels.components);
            }
            progress.step();
        }
    }
    let row = |((place, _), (plain, fused)): (&(usize, _), (RiskCoverage, RiskCoverage))| {
        (*place, DomainMasks { domain, network: plain.unfiltered(), fused: fused.unfiltered() })
    };
    Ok(networks.iter().zip(scores).map(row).collect())
}

fn describe(test: &TestViews) -> String {
    format!(
        "ours: components of {} simulated motors that nothing was trained on, {} views each, {}x{}; LCCCP fusion as in Tables \
         3 to 5. Published: Mask R-CNN (R-50-FPN) on 1200 labelled pictures of real toys, and YCB. Other objects and networks: \
         not comparable",
        test.motors.len(),
        test.views,
        test.size.0,
        test.size.1
    )
}

/// Writes the tables for people.
///
/// # Errors
/// If `out` fails.
pub fn print(out: &mut dyn Write, report: &MaskTables) -> io::Result<()> {
    write!(out, "{:<30}", "P1, Tables 1, 2: mask IoU, %")?;
    for domain in TestDomain::ALL {
        write!(out, "{:>26}", format!("{}: net, fused", domain.name()))?;
    }
    writeln!(out, "{:>26}", "P1: network, fusion")?;
    for masks in &report.masks {
        if masks.domains.is_empty() {
            writeln!(out, "{}: {NOT_TRAINED}", masks.model)?;
            continue;
        }
        writeln!(out, "{}", masks.model)?;
        for (i, object) in report.objects.iter().enumerate() {
            line(out, object, masks, |scores| scores.iou.get(i).copied().flatten())?;
        }
        line(out, "mean", masks, |scores| Some(scores.mean_iou))?;
    }
    for p in &report.published {
        writeln!(
            out,
            "{:<30}{:>78}{:>17.2}{:>9.2}",
            format!("{} (Table {})", p.object, p.table),
            NOT_TRAINED,
            p.iou[0],
            p.iou[1]
        )?;
    }
    writeln!(out, "{}", report.setting)
}

fn line(
    out: &mut dyn Write,
    name: &str,
    masks: &Masks,
    figure: impl Fn(&PixelScores) -> Option<f64>,
) -> io::Result<()> {
    write!(out, "  {name:<28}")?;
    for domain in &masks.domains {
        let text = |scores| figure(scores).map_or_else(|| "-".to_owned(), |iou| format!("{:.2}", iou * 100.0));
        write!(out, "{:>17}{:>9}", text(&domain.network), text(&domain.fused))?;
    }
    writeln!(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::network_fixtures::{manifest, onnx, write};

    #[test]
    fn masks_are_judged_before_and_after_fusion() {
        let root = tempfile::tempdir().expect("a folder");
        let networks = NetworkSetting { models: Some(root.path().to_owned()), ..NetworkSetting::quick() };
        let nothing = run(&networks, |_, _| {}).expect("nothing to judge");
        assert!(nothing.masks.iter().all(|m| m.domains.is_empty()));
        let dark = onnx::classifier(&[&[0.0; 3], &[-9.0; 3]], &[0.0, 5.0]);
        write(&root.path().join("dark"), manifest("semantic", &["none", "housing"]), &[dark]);
        let mut last_step = (0, 0);
        let report = run(&networks, |done, all| last_step = (done, all)).expect("a table");
        assert_eq!(last_step, (6, 6));
        let [detector, chosen] = &report.masks[..] else { panic!("two models") };
        assert!(detector.domains.is_empty());
        assert_eq!((chosen.domains.len(), report.published.len()), (3, 9));
        assert!(chosen.domains.iter().all(|d| d.network != d.fused && d.network.pixels == d.fused.pixels));
        let mut text = Vec::new();
        print(&mut text, &report).expect("printed");
        let text = String::from_utf8(text).expect("UTF-8");
        for word in ["mask-rcnn-edge: not trained here", "solenoid", "cuboid (Table 1)", "92.44", "not comparable"] {
            assert!(text.contains(word), "{word}: {text}");
        }
    }
}
