//! [Remanufacturing paper], Table 5, lower half: what an ensemble and its uncertainty are worth, and what a threshold
//! of it costs (the risk-coverage curve). And the defect network, which the paper has an outlook on.

use super::super::{NetworkSetting, Progress};
use crate::network_scores::{Shelf, labelling, score_networks, test_source};
use crate::{NetworkError, PixelScores, RiskPoint, TestDomain, TestViews};
use semascan_perception::segment::network::{NetworkConfig, Task};
use serde::Serialize;
use std::io::{self, Write};

/// The paper's figures: name there, mean IoU, false detection rate where printed.
const PUBLISHED: [(&str, f64, Option<f64>); 6] = [
    ("UD_opt,t (single)", 0.9662, None),
    ("UD_opt,E (ensemble)", 0.9707, Some(0.0770)),
    ("UD_opt,EF (filtered)", 0.9529, Some(0.0315)),
    ("MD_opt,t (single)", 0.9464, None),
    ("MD_opt,E (ensemble)", 0.9574, Some(0.0759)),
    ("MD_opt,EF (filtered)", 0.9359, Some(0.0248)),
];
/// The paper's mean IoU for corrosion in pictures of real motors.
const PUBLISHED_CORROSION: f64 = 0.9634;
/// Points of the curve that people are shown: every so many hundredths.
const SHOWN: [f32; 9] = [0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 1.0];

/// One domain.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Domain {
    /// The domain.
    pub domain: TestDomain,
    /// Each member alone, asked once; empty where there is one only.
    pub singles: Vec<PixelScores>,
    /// The ensemble and its augmentations.
    pub ensemble: PixelScores,
    /// The same, uncertain labels dropped: misses in IoU.
    pub filtered: PixelScores,
    /// What every threshold does.
    pub risk_coverage: Vec<RiskPoint>,
    /// Defects, nothing dropped; `None` where no network looks for them.
    pub defects: Option<PixelScores>,
}

/// The table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Table5 {
    /// How the figures are to be read.
    pub setting: String,
    /// The models, as an inspection takes them.
    pub models: Vec<String>,
    /// Threshold of sigma.
    pub sigma: f32,
    /// Component classes, in the order of the figures.
    pub components: Vec<String>,
    /// Defect classes, in the order of the figures.
    pub defects: Vec<String>,
    /// Ours.
    pub domains: Vec<Domain>,
    /// The paper's: name, mean IoU, false detection rate.
    pub published: Vec<(String, f64, Option<f64>)>,
    /// The paper's mean IoU for corrosion.
    pub published_corrosion: f64,
}

/// Judges the models that an inspection takes, each member, and the filter at `sigma`.
///
/// # Errors
/// [`NetworkError`]
pub fn run(
    shelf: &Shelf,
    setting: &NetworkSetting,
    sigma: f32,
    progress: &mut Progress<'_>,
) -> Result<Table5, NetworkError> {
    let source = test_source();
    let chosen = shelf.chosen(&source.taxonomy)?;
    let config = NetworkConfig::default();
    let mut networks = vec![shelf.segmenter(&labelling(&chosen), &source, &config)?];
    let ensemble = chosen.iter().find(|(_, m)| m.task != Task::Defect && m.networks.len() > 1);
    if let Some((folder, manifest)) = ensemble {
        for member in 0..manifest.networks.len() {
            networks.push(shelf.single(folder, member, &source)?);
        }
    }
    let looks_for_defects = chosen.iter().any(|(_, m)| m.task == Task::Defect);
    let mut domains = Vec::new();
    for domain in TestDomain::ALL {
        let scores = score_networks(&mut networks, &setting.test, domain, || progress.step())?;
        let [all, singles @ ..] = scores.as_slice() else { continue };
        domains.push(Domain {
            domain,
            singles: singles.iter().map(|s| s.components.unfiltered()).collect(),
            ensemble: all.components.unfiltered(),
            filtered: all.components.at(sigma).scores(),
            risk_coverage: all.components.curve(),
            defects: looks_for_defects.then(|| all.defects.unfiltered()),
        });
    }
    let names = |classes: &[semascan_model::ClassDef]| classes.iter().skip(1).map(|c| c.name.clone()).collect();
    let taxonomy = TestViews::taxonomy();
    let augmentations: Vec<String> = config.augmentations.iter().map(|a| format!("{a:?}").to_lowercase()).collect();
    let setting = format!(
        "ours: {} motors that nothing was trained or chosen on, {} views each; mean over the five components of the IoU of \
         all pixels together; FDR = wrong / all retained pixels that are said to be a component; dropped pixels are misses \
         in IoU; ensemble with {}. Published: real motors, VGG16 (UD) and ResNet34 (MD), ten of them as test. Not comparable",
        setting.test.motors.len(),
        setting.test.views,
        augmentations.join(" and ")
    );
    Ok(Table5 {
        setting,
        models: chosen.iter().map(|(_, m)| format!("{} {}", m.name, m.version)).collect(),
        sigma,
        components: names(&taxonomy.components),
        defects: names(&taxonomy.defects),
        domains,
        published: PUBLISHED.iter().map(|(name, iou, fdr)| ((*name).to_owned(), *iou, *fdr)).collect(),
        published_corrosion: PUBLISHED_CORROSION,
    })
}

/// Writes the table for people.
///
/// # Errors
/// If `out` fails.
pub fn print(out: &mut dyn Write, report: &Table5) -> io::Result<()> {
    writeln!(out, "P0, Table 5: ensemble and filter at sigma {} ({})", report.sigma, report.models.join(", "))?;
    writeln!(
        out,
        "{:<36}{:>10}{:>10}{:>14}   IoU of {}",
        "",
        "mean IoU",
        "FDR",
        "completeness",
        report.components.join(", ")
    )?;
    for d in &report.domains {
        singles(out, d)?;
        scores(out, &format!("{}: ensemble", d.domain.name()), &d.ensemble)?;
        scores(out, &format!("{}: filtered", d.domain.name()), &d.filtered)?;
    }
    for (name, iou, fdr) in &report.published {
        let fdr = fdr.map_or_else(|| "-".to_owned(), |f| format!("{f:.4}"));
        writeln!(out, "{:<36}{iou:>10.4}{fdr:>10}", format!("P0: {name}"))?;
    }
    write!(out, "\nrisk and coverage{:>19}", "sigma at most")?;
    for domain in &report.domains {
        write!(out, "   {:<28}", domain.domain.name())?;
    }
    writeln!(out, "   (completeness, FDR, mean IoU)")?;
    for shown in SHOWN {
        write!(out, "{shown:>36.2}")?;
        for domain in &report.domains {
            let point = domain.risk_coverage.iter().find(|p| (p.threshold - shown).abs() < 1e-6);
            if let Some(p) = point {
                write!(out, "   {:>8.4}{:>10.4}{:>10.4}", p.completeness, p.false_detection_rate, p.mean_iou)?;
            }
        }
        writeln!(out)?;
    }
    write!(out, "\n{:<36}", "IoU of defects in the pictures")?;
    report.defects.iter().try_for_each(|name| write!(out, "{name:>12}"))?;
    writeln!(out)?;
    for d in &report.domains {
        write!(out, "{:<36}", d.domain.name())?;
        match &d.defects {
            Some(scores) => scores.iou.iter().try_for_each(|iou| match iou {
                Some(iou) => write!(out, "{iou:>12.4}"),
                None => write!(out, "{:>12}", "-"),
            })?,
            None => write!(out, "{:>12}", "no network looks for them")?,
        }
        writeln!(out)?;
    }
    writeln!(out, "{:<36}{:>12.4}", "P0: mean IoU, real corrosion", report.published_corrosion)?;
    writeln!(out, "{}", report.setting)
}

fn singles(out: &mut dyn Write, domain: &Domain) -> io::Result<()> {
    let n = domain.singles.len();
    if n == 0 {
        return Ok(());
    }
    let of = |figure: fn(&PixelScores) -> f64| {
        let values = domain.singles.iter().map(figure);
        let (low, high) = values.clone().fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
        (values.sum::<f64>() / n as f64, low, high)
    };
    let (iou, fdr) = (of(|s| s.mean_iou), of(|s| s.false_detection_rate));
    writeln!(
        out,
        "{:<36}{:>10.4}{:>10.4}{:>14}   mean IoU {:.4} to {:.4}",
        format!("{}: {n} single networks", domain.domain.name()),
        iou.0,
        fdr.0,
        "",
        iou.1,
        iou.2
    )
}

fn scores(out: &mut dyn Write, name: &str, s: &PixelScores) -> io::Result<()> {
    write!(out, "{name:<36}{:>10.4}{:>10.4}{:>14.4}  ", s.mean_iou, s.false_detection_rate, s.completeness)?;
    for iou in s.iou.iter().flatten() {
        write!(out, " {iou:.3}")?;
    }
    writeln!(out)
}
