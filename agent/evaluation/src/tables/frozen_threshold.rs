//! The threshold of sigma, chosen on validation motors and then left alone.
//!
//! [Remanufacturing paper] drops pixels with sigma above 0.5 without saying how that was found, and what sigma is
//! decides what it means. Here the rule is: the largest threshold, to a hundredth, at which the false detection rate on
//! the validation motors falls to [`GOAL`] of what it is without one, in the randomised views and in the virtual cell
//! alike. It is the one that costs least completeness. Test motors have no say in it.

use super::{NetworkSetting, Progress};
use crate::network_scores::{Shelf, labelling, score_networks, test_source};
use crate::{NetworkError, RiskPoint, TestDomain, TestViews};
use semascan_perception::segment::network::{NetworkConfig, UncertaintySettings};
use serde::Serialize;
use std::io::{self, Write};

/// Share of the false detection rate that may remain: a little below the half that is asked for, so that it holds on
/// other motors too.
const GOAL: f64 = 0.45;
/// Where it is chosen. The shifted domain stands for cells that nobody knows yet.
const DOMAINS: [TestDomain; 2] = [TestDomain::Randomised, TestDomain::VirtualCell];

/// A threshold, and where it comes from.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FrozenThreshold {
    /// Labels with a larger sigma are dropped.
    pub sigma: f32,
    /// How it was found.
    pub rule: String,
    /// What it does on the validation motors; empty if it was given.
    pub validation: Vec<ValidationPoint>,
}

/// The validation motors of one domain.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ValidationPoint {
    /// The domain.
    pub domain: TestDomain,
    /// The largest threshold that reaches the goal here.
    pub own: Option<f32>,
    /// Without any threshold.
    pub unfiltered: RiskPoint,
    /// With the frozen one.
    pub filtered: RiskPoint,
}

/// Steps that [`freeze`] takes.
pub(super) fn steps(setting: &NetworkSetting) -> usize {
    if setting.sigma.is_some() { 0 } else { DOMAINS.len() * setting.validation.len() * setting.test.views as usize }
}

/// The threshold for the models that an inspection takes from `shelf`.
///
/// # Errors
/// [`NetworkError`] if they cannot be judged.
pub fn freeze(
    shelf: &Shelf,
    setting: &NetworkSetting,
    progress: &mut Progress<'_>,
) -> Result<FrozenThreshold, NetworkError> {
    if let Some(sigma) = setting.sigma {
        return Ok(FrozenThreshold { sigma, rule: "given".into(), validation: Vec::new() });
    }
    let source = test_source();
    let chosen = labelling(&shelf.chosen(&source.taxonomy)?);
    let mut networks = [shelf.segmenter(&chosen, &source, &NetworkConfig::default())?];
    let views = TestViews { motors: setting.validation.clone(), ..setting.test.clone() };
    let mut curves = Vec::new();
    for domain in DOMAINS {
        let scores = score_networks(&mut networks, &views, domain, || progress.step())?;
        curves.extend(scores.into_iter().map(|s| (domain, s.components)));
    }
    let own: Vec<Option<f32>> = curves.iter().map(|(_, c)| c.threshold(GOAL)).collect();
    let reached = own.iter().all(Option::is_some);
    let default = UncertaintySettings::default().threshold;
    let sigma = if reached { own.iter().flatten().copied().fold(1.0, f32::min) } else { default };
    let motors = format!("{} motors, seeds {:?}", views.motors.len(), views.motors);
    let rule = if reached {
        format!(
            "the largest at which FDR falls to {GOAL} of what it is without, on {motors}, randomised and virtual cell"
        )
    } else {
        format!("the default: none brings FDR to {GOAL} of what it is without, on {motors}")
    };
    let validation = curves.iter().zip(own).map(|((domain, curve), own)| ValidationPoint {
        domain: *domain,
        own,
        unfiltered: curve.point(1.0),
        filtered: curve.point(sigma),
    });
    Ok(FrozenThreshold { sigma, rule, validation: validation.collect() })
}

impl FrozenThreshold {
    /// Writes it for people.
    pub(super) fn print(&self, out: &mut dyn Write) -> io::Result<()> {
        writeln!(out, "sigma threshold {}: {}", self.sigma, self.rule)?;
        for v in &self.validation {
            let (a, b) = (v.unfiltered, v.filtered);
            writeln!(
                out,
                "  validation, {}: FDR {:.4} -> {:.4}, mean IoU {:.4} -> {:.4}, completeness {:.4}{}",
                v.domain.name(),
                a.false_detection_rate,
                b.false_detection_rate,
                a.mean_iou,
                b.mean_iou,
                b.completeness,
                v.own.map_or_else(String::new, |own| format!(" (alone: {own})"))
            )?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::network_fixtures::{manifest, onnx, write};

    #[test]
    fn a_threshold_is_given_or_chosen_on_the_validation_motors_alone() {
        let root = tempfile::tempdir().expect("a folder");
        let member = |bias: f32| onnx::classifier(&[&[0.0; 3], &[-9.0; 3]], &[0.0, bias]);
        write(&root.path().join("dark"), manifest("semantic", &["none", "housing"]), &[member(2.0), member(7.0)]);
        let mut setting = NetworkSetting { models: Some(root.path().to_owned()), ..NetworkSetting::quick() };
        let shelf = setting.shelf().expect("an engine");
        let run = |setting: &NetworkSetting| {
            let mut steps_done = 0;
            let mut report = |done: usize, _| steps_done = done;
            let frozen = freeze(&shelf, setting, &mut Progress::new(&mut report)).expect("runs");
            (frozen, steps_done)
        };
        let (chosen, steps_done) = run(&setting);
        assert_eq!((steps_done, steps(&setting), chosen.validation.len()), (4, 4, 2));
        let own: Vec<f32> = chosen.validation.iter().filter_map(|v| v.own).collect();
        let expected = if own.len() == 2 { own[0].min(own[1]) } else { UncertaintySettings::default().threshold };
        assert_eq!(chosen.sigma, expected);
        for v in chosen.validation.iter().filter(|v| v.own.is_some() && own.len() == 2) {
            assert!(v.filtered.false_detection_rate <= GOAL * v.unfiltered.false_detection_rate, "{v:?}");
        }
        setting.test.motors = vec![77];
        assert_eq!(run(&setting).0, chosen, "test motors have no say in it");
        setting.sigma = Some(0.3);
        let (given, steps_done) = run(&setting);
        assert_eq!((given.sigma, given.rule.as_str(), steps_done, steps(&setting)), (0.3, "given", 0, 0));
    }
}
