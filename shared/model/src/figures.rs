//! What a model says in figures: how large, how sure, how many points, by component, defect and instance.
//!
//! They are computed once for a model (`semascan_geometry::measure::model_figures`). The record, the property tables and
//! extras of scenes, the viewer's legend and all exports show these figures and compute none of their own.

use serde::{Deserialize, Serialize};

/// Figures of one component, defect, defect on a component, or instance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FeatureFigures {
    /// Class, or number of the instance.
    pub id: u16,
    /// The component: itself, the one that a defect is on, or the one that most of an instance's points belong to; 0 for a
    /// defect wherever it is.
    pub component: u16,
    /// Number of its points that are part of the surface: none of [`LEFT_OUT`](crate::PointFlags::LEFT_OUT) marks them.
    pub points: u64,
    /// Area of the surface that was seen, square metres; `None` where there is no mesh to measure it on.
    pub area: Option<f64>,
    /// Mean over these points of the share of the evidence that the class has, 0 to 1: that of the component, or for a
    /// defect that of the defect.
    pub confidence: f64,
    /// Mean over these points of the label's standard uncertainty, 0 to 1.
    pub sigma: f64,
}

/// Figures of a whole model. Each list is in the order of (`component`, `id`) or `id`, and holds what occurs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ModelFigures {
    /// By component class.
    pub components: Vec<FeatureFigures>,
    /// By defect class, on all components together; 0 is no defect.
    pub defects: Vec<FeatureFigures>,
    /// By component and defect class other than 0.
    pub findings: Vec<FeatureFigures>,
    /// By instance other than 0.
    pub instances: Vec<FeatureFigures>,
}

impl ModelFigures {
    /// Figures of a component class; `None` if it does not occur.
    pub fn component(&self, class: u16) -> Option<FeatureFigures> {
        of(&self.components, class)
    }

    /// Figures of a defect class on all components; `None` if it does not occur.
    pub fn defect(&self, class: u16) -> Option<FeatureFigures> {
        of(&self.defects, class)
    }

    /// Figures of an instance; `None` if it does not occur.
    pub fn instance(&self, number: u16) -> Option<FeatureFigures> {
        of(&self.instances, number)
    }

    /// Figures of what does not occur on the surface, such as a class of stray points: none of it was seen. `None` where
    /// there are no figures at all.
    pub fn absent(&self) -> Option<FeatureFigures> {
        let measured = self.components.first()?.area.is_some();
        Some(FeatureFigures { area: measured.then_some(0.0), ..FeatureFigures::default() })
    }

    /// Figures of the defects on a component, in the order of their classes.
    pub fn findings_on(&self, component: u16) -> impl Iterator<Item = FeatureFigures> {
        self.findings.iter().copied().filter(move |f| f.component == component)
    }
}

fn of(list: &[FeatureFigures], id: u16) -> Option<FeatureFigures> {
    list.iter().copied().find(|f| f.id == id)
}
