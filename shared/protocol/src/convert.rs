//! Between wire messages and the data model.

use super::{ChunkId, ClassDef, Inspection};
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
