//! A mark on the surface: a stroke of the brush, a patch that was taken at once, or an outline around something that was not found.

use super::Naming;
use crate::features::inspect::PickedPoint;
use crate::words::t;
use glam::Vec3;
use semascan_model::ClassDef;
use semascan_model::review::{ReviewAction, SurfacePatch};
use std::collections::BTreeMap;

/// Most points of a mark: what the agent takes at once.
const MOST_POINTS: usize = 20_000;
/// Distance between points of a stroke, in its radius: nearer ones add nothing.
const SPACING: f32 = 0.4;
/// Farthest two picks of a stroke may lie apart to be joined, in its radius: beyond that it went on over another surface.
const JOINED: f32 = 5.0;
/// Voxels between corners of an outline.
const OUTLINE_SPACING: f32 = 0.5;

/// What draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tool {
    /// Gives the surface that it goes over another class.
    Brush,
    /// Gives a segment another class: the connected surface that has the class of the clicked place.
    Segment,
    /// Gives what is seen within a loop another class.
    Lasso,
    /// Draws around something that was not found.
    Outline,
}

impl Tool {
    /// All, in the order of the buttons.
    pub const ALL: [Self; 4] = [Self::Brush, Self::Segment, Self::Lasso, Self::Outline];

    /// Stable name for tests and styles.
    pub fn key(self) -> &'static str {
        match self {
            Self::Brush => "brush",
            Self::Segment => "segment",
            Self::Lasso => "lasso",
            Self::Outline => "outline",
        }
    }

    /// Name for people.
    pub fn label(self) -> &'static str {
        match self {
            Self::Brush => t!("correct.brush"),
            Self::Segment => t!("correct.segment"),
            Self::Lasso => t!("correct.lasso"),
            Self::Outline => t!("correct.outline"),
        }
    }

    /// What it does, and its key.
    pub fn title(self) -> &'static str {
        match self {
            Self::Brush => t!("correct.brush.title"),
            Self::Segment => t!("correct.segment.title"),
            Self::Lasso => t!("correct.lasso.title"),
            Self::Outline => t!("correct.outline.title"),
        }
    }
}

/// A mark.
#[derive(Clone, Debug, PartialEq)]
pub struct Mark {
    /// Counts the marks of a page.
    pub number: u32,
    /// What it was drawn with.
    pub tool: Tool,
    /// What it says of the surface.
    pub naming: Naming,
    /// Half the width of a stroke, or how far a patch reaches around its points, metres.
    pub radius: f32,
    /// Where it goes along on the surface, or what it takes of it, metres, table frame.
    pub points: Vec<Vec3>,
    /// How many of its picks lie on each component, none left out.
    pub components: BTreeMap<u16, u32>,
    /// It is still being drawn.
    pub is_open: bool,
}

impl Mark {
    /// Lets the mark go on to a picked point.
    pub fn extend(&mut self, point: &PickedPoint) {
        let there = Vec3::from(point.position);
        if !there.is_finite() || self.points.len() >= MOST_POINTS {
            return;
        }
        if point.component != 0 {
            *self.components.entry(point.component).or_default() += 1;
        }
        let spacing = match self.tool {
            Tool::Brush | Tool::Segment | Tool::Lasso => SPACING * self.radius,
            Tool::Outline => OUTLINE_SPACING * point.voxel,
        };
        if let Some(last) = self.points.last().copied() {
            let distance = last.distance(there);
            if distance < spacing {
                return;
            }
            if self.tool == Tool::Brush && distance <= JOINED * self.radius {
                let steps = (distance / spacing).floor().max(1.0) as u32;
                self.points.extend((1..steps).map(|step| last.lerp(there, step as f32 / steps as f32)));
            }
        }
        self.points.push(there);
    }

    /// The component that an outline lies on: that of most of its picks.
    pub fn component(&self) -> Option<u16> {
        self.components
            .iter()
            .max_by_key(|(class, picks)| (**picks, std::cmp::Reverse(**class)))
            .map(|(class, _)| *class)
    }

    /// Whether it says anything.
    pub fn is_whole(&self) -> bool {
        match self.tool {
            Tool::Brush | Tool::Segment | Tool::Lasso => !self.points.is_empty(),
            Tool::Outline => !self.is_open && self.points.len() >= 3 && self.component().is_some(),
        }
    }

    /// The review that it becomes; `None` where it says nothing, or of a class that there is not.
    pub fn action(&self, components: &[ClassDef], defects: &[ClassDef]) -> Option<ReviewAction> {
        if !self.is_whole() {
            return None;
        }
        let points = self.points.iter().map(|p| p.as_dvec3().to_array()).collect();
        let name = self.naming.name(components, defects)?;
        Some(match (self.tool, self.naming) {
            (Tool::Brush | Tool::Segment | Tool::Lasso, naming) => {
                let patch = SurfacePatch::Points { points, radius: f64::from(self.radius) };
                let of = |is_named: bool| is_named.then(|| name.clone());
                let is_component = matches!(naming, Naming::Component(_));
                ReviewAction::Relabel { patch, component: of(is_component), defect: of(!is_component) }
            }
            (Tool::Outline, naming) => {
                let component = Naming::Component(self.component()?).name(components, defects)?;
                // Class 0 is none: something to look at, without a name.
                let defect = matches!(naming, Naming::Defect(class) if class != 0).then_some(name);
                ReviewAction::NewFinding { outline: points, component, defect }
            }
        })
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use semascan_model::{SemanticPoint, Taxonomy};

    /// A pick at (x, y) millimetres, on the first component.
    pub(in super::super) fn pick(x: f32, y: f32) -> PickedPoint {
        let position = [x * 1e-3, y * 1e-3, 0.0];
        PickedPoint::of(&SemanticPoint { position, label: 1, ..SemanticPoint::UNKNOWN }, 1e-3, false)
    }

    fn mark(tool: Tool, naming: Naming, picks: &[(f32, f32)]) -> Mark {
        let mut mark = Mark {
            number: 1,
            tool,
            naming,
            radius: 2e-3,
            points: Vec::new(),
            components: BTreeMap::new(),
            is_open: false,
        };
        picks.iter().for_each(|(x, y)| mark.extend(&pick(*x, *y)));
        mark
    }

    fn action(mark: &Mark) -> Option<ReviewAction> {
        let Taxonomy { components, defects } = Taxonomy::from_names(&["housing", "gear"], &["crack"]);
        mark.action(&components, &defects)
    }

    #[test]
    fn a_stroke_is_joined_where_it_stays_on_the_surface() {
        let stroke = mark(Tool::Brush, Naming::Component(2), &[(0.0, 0.0), (0.1, 0.0), (8.0, 0.0), (60.0, 0.0)]);
        let gaps: Vec<f32> = stroke.points.windows(2).map(|pair| pair[0].distance(pair[1]) * 1e3).collect();
        assert!(gaps[..gaps.len() - 1].iter().all(|gap| (0.4..=1.7).contains(gap)), "{gaps:?}");
        assert!(gaps[gaps.len() - 1] > 50.0, "another surface");
        let Some(ReviewAction::Relabel { patch: SurfacePatch::Points { points, radius }, component, defect }) =
            action(&stroke)
        else {
            panic!("a patch of points")
        };
        assert_eq!((points.len(), radius), (stroke.points.len(), f64::from(2e-3_f32)));
        assert_eq!((component.as_deref(), defect), (Some("gear"), None));
        let sound = action(&mark(Tool::Brush, Naming::Defect(0), &[(0.0, 0.0)]));
        assert!(matches!(sound, Some(ReviewAction::Relabel { component: None, defect: Some(d), .. }) if d == "none"));
    }

    #[test]
    fn an_outline_is_a_finding_on_what_it_lies_on() {
        let corners = [(0.0, 0.0), (5.0, 0.0), (5.0, 5.0)];
        let outline = mark(Tool::Outline, Naming::Defect(1), &corners);
        let Some(ReviewAction::NewFinding { outline: curve, component, defect }) = action(&outline) else {
            panic!("a finding")
        };
        assert_eq!((curve.len(), component.as_str(), defect.as_deref()), (3, "housing", Some("crack")));
        let remark = action(&mark(Tool::Outline, Naming::Defect(0), &corners));
        assert!(matches!(remark, Some(ReviewAction::NewFinding { defect: None, .. })));
        assert_eq!(action(&mark(Tool::Outline, Naming::Defect(1), &corners[..2])), None, "no outline");
        assert_eq!(action(&Mark { is_open: true, ..outline.clone() }), None, "not closed yet");
        assert_eq!(action(&Mark { components: BTreeMap::new(), ..outline }), None, "on nothing that is known");
        assert_eq!(action(&mark(Tool::Brush, Naming::Defect(9), &corners)), None, "no such class");
    }

    #[test]
    fn a_mark_without_end_is_cut() {
        let mut stroke = mark(Tool::Brush, Naming::Defect(1), &[]);
        (0..40_000).for_each(|i| stroke.extend(&pick(i as f32, 0.0)));
        assert!(stroke.points.len() <= MOST_POINTS + 20, "{}", stroke.points.len());
        let before = stroke.points.len();
        stroke.extend(&PickedPoint { position: [f32::NAN; 3], ..pick(0.0, 0.0) });
        assert_eq!(stroke.points.len(), before);
    }
}
