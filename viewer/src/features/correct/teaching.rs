//! Where a label would teach most, as the agent says it, and what of that has been corrected since.

use super::Naming;
use glam::DVec3;
use semascan_model::review::{ReviewAction, SurfacePatch};
use serde::Deserialize;

/// How near to the middle of a region a correction is one of it, metres: half the cells that the agent divides surface into.
const REACH: f64 = 0.01;

/// The answer of `/inspections/{inspection}/teaching`, as far as it is shown.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct Teaching {
    /// Why there is nothing.
    #[serde(default)]
    pub nothing: Option<String>,
    /// The regions, the one that would teach most first.
    pub regions: Vec<TeachingRegion>,
    /// Corrections that were in the log when it was asked for.
    #[serde(skip)]
    pub known: usize,
}

/// A region of the surface.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct TeachingRegion {
    /// Component class as measured.
    pub component: u16,
    /// Its name.
    pub name: String,
    /// Its middle, metres, table frame.
    pub position: [f64; 3],
    /// Square metres.
    pub area: f64,
    /// Mean uncertainty of its labels.
    pub sigma: f64,
    /// The finding that it is, as the agent names it.
    #[serde(default)]
    pub finding: Option<String>,
}

impl Teaching {
    /// Nothing, and why.
    pub fn none(reason: String) -> Self {
        Self { nothing: Some(reason), ..Self::default() }
    }
}

impl TeachingRegion {
    /// The class with which the brush begins there.
    pub fn naming(&self) -> Naming {
        Naming::Component(self.component)
    }

    /// Whether one of these corrections is of this region.
    pub fn is_among(&self, corrections: &[ReviewAction]) -> bool {
        corrections.iter().any(|action| self.is_near(action))
    }

    fn is_near(&self, action: &ReviewAction) -> bool {
        let near = |at: DVec3, reach: f64| at.distance(DVec3::from(self.position)) <= REACH + reach;
        let any = |points: &[[f64; 3]], reach: f64| points.iter().any(|point| near(DVec3::from(*point), reach));
        match action {
            ReviewAction::Relabel { patch: SurfacePatch::Points { points, radius }, .. } => any(points, *radius),
            ReviewAction::Relabel { patch: SurfacePatch::Voxels { edge, cells }, .. } => {
                cells.iter().any(|cell| near((DVec3::from(cell.map(f64::from)) + 0.5) * *edge, *edge))
            }
            ReviewAction::Relabel { patch: SurfacePatch::Outline { outline }, .. }
            | ReviewAction::NewFinding { outline, .. } => any(outline, 0.0),
            _ => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn region() -> TeachingRegion {
        let position = [0.1, 0.0, 0.0];
        TeachingRegion { component: 2, name: "gear".into(), position, area: 1e-4, sigma: 0.3, finding: None }
    }

    fn relabelled(patch: SurfacePatch) -> ReviewAction {
        ReviewAction::Relabel { patch, component: Some("gear".into()), defect: None }
    }

    #[test]
    fn a_region_is_done_by_what_is_corrected_within_it() {
        let stroke = |x: f64| relabelled(SurfacePatch::Points { points: vec![[x, 0.0, 0.0]], radius: 0.003 });
        assert!(region().is_among(&[ReviewAction::Accept, stroke(0.108)]));
        assert!(!region().is_among(&[stroke(0.12)]));
        let cells = |x: i32| relabelled(SurfacePatch::Voxels { edge: 0.001, cells: vec![[x, 0, 0]] });
        assert!(region().is_among(&[cells(100)]) && !region().is_among(&[cells(50)]));
        let outline = vec![[0.105, 0.0, 0.0]; 3];
        assert!(region().is_among(&[ReviewAction::NewFinding { outline, component: "gear".into(), defect: None }]));
        assert_eq!(region().naming(), Naming::Component(2));
    }

    #[test]
    fn what_the_agent_says_is_understood() {
        let text = r#"{"convention": "c", "worth": 1.0, "count": 3, "regions": [{"component": 2, "name": "gear",
            "position": [0.1, 0, 0], "area": 1e-4, "sigma": 0.3, "basis": "whole", "worth": 3e-5}]}"#;
        assert_eq!(serde_json::from_str::<Teaching>(text).expect("understood").regions, [region()]);
        let none = r#"{"convention": "c", "nothing": "no uncertainty", "worth": 0.0, "count": 0, "regions": []}"#;
        assert_eq!(
            serde_json::from_str::<Teaching>(none).expect("understood").nothing.as_deref(),
            Some("no uncertainty")
        );
    }
}
