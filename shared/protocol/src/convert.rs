//! Between wire messages and the data model.

use super::{ChunkId, ClassDef, FeatureFigures, Figures, Inspection};
use semascan_model as model;
use semascan_model::Taxonomy;

impl ChunkId {
    /// From integer chunk coordinates.
    pub fn from_array([x, y, z]: [i32; 3]) -> Self {
        Self { x, y, z }
    }

    /// Integer chunk coordinates.
    pub fn to_array(self) -> [i32; 3] {
        [self.x, self.y, self.z]
    }
}

impl Inspection {
    /// The taxonomy, as far as the message holds a valid one: lists that are not dense are renumbered in order.
    pub fn taxonomy(&self) -> Taxonomy {
        Taxonomy { components: classes(&self.components), defects: classes(&self.defects) }
    }

    /// Puts a taxonomy into the message.
    pub fn set_taxonomy(&mut self, taxonomy: &Taxonomy) {
        self.components = taxonomy.components.iter().map(class_message).collect();
        self.defects = taxonomy.defects.iter().map(class_message).collect();
    }
}

impl From<&model::ModelFigures> for Figures {
    fn from(figures: &model::ModelFigures) -> Self {
        let list = |figures: &[model::FeatureFigures]| figures.iter().map(|f| FeatureFigures::from(*f)).collect();
        Self {
            components: list(&figures.components),
            defects: list(&figures.defects),
            findings: list(&figures.findings),
            instances: list(&figures.instances),
        }
    }
}

impl From<model::FeatureFigures> for FeatureFigures {
    fn from(f: model::FeatureFigures) -> Self {
        Self {
            id: f.id.into(),
            component: f.component.into(),
            points: f.points,
            area: f.area,
            confidence: f.confidence,
            sigma: f.sigma,
        }
    }
}

impl Figures {
    /// The figures as the data model has them, without those of classes or instances that cannot be.
    pub fn figures(&self) -> model::ModelFigures {
        let one = |f: &FeatureFigures| {
            Some(model::FeatureFigures {
                id: u16::try_from(f.id).ok()?,
                component: u16::try_from(f.component).ok()?,
                points: f.points,
                area: f.area,
                confidence: f.confidence,
                sigma: f.sigma,
            })
        };
        let list = |figures: &[FeatureFigures]| figures.iter().filter_map(one).collect();
        model::ModelFigures {
            components: list(&self.components),
            defects: list(&self.defects),
            findings: list(&self.findings),
            instances: list(&self.instances),
        }
    }
}

fn classes(list: &[ClassDef]) -> Vec<model::ClassDef> {
    let named = |(i, c): (usize, &ClassDef)| {
        let [_, r, g, b] = c.color.to_be_bytes();
        model::ClassDef::new(i as u16, c.name.clone(), [r, g, b])
    };
    list.iter().take(usize::from(u16::MAX)).enumerate().map(named).collect()
}

fn class_message(c: &model::ClassDef) -> ClassDef {
    let [r, g, b] = c.color;
    ClassDef { id: c.id.into(), name: c.name.clone(), color: u32::from_be_bytes([0, r, g, b]) }
}
