//! A picture with its masks, as formats for labelled pictures take it.

use image::RgbImage;
use semascan_labelling::ViewMasks;
use semascan_model::{ClassDef, Taxonomy};
use std::collections::BTreeSet;

/// A picture with its masks.
#[derive(Clone, Copy, Debug)]
pub struct LabelledPicture<'a> {
    /// The name of its files, without an extension.
    pub name: &'a str,
    /// The name of the part that it shows: all pictures of one part belong on one side of a split.
    pub part: &'a str,
    /// The picture.
    pub rgb: &'a RgbImage,
    /// The masks, of the same size.
    pub masks: &'a ViewMasks,
    /// The classes of the masks.
    pub taxonomy: &'a Taxonomy,
}

/// The pixels of one class in a picture, or of one object of it.
pub(super) struct ClassPixels<'a> {
    pub(super) class: &'a ClassDef,
    /// Row-major.
    pub(super) mask: Vec<bool>,
}

impl<'a> LabelledPicture<'a> {
    /// The components that the picture shows, object by object.
    pub(super) fn components(&self) -> Vec<ClassPixels<'a>> {
        pixels(&self.taxonomy.components, &self.masks.components, Some(&self.masks.instances))
    }

    /// The defects that the picture shows.
    pub(super) fn defects(&self) -> Vec<ClassPixels<'a>> {
        pixels(&self.taxonomy.defects, &self.masks.defects, None)
    }
}

fn pixels<'a>(classes: &'a [ClassDef], labels: &[u16], instances: Option<&[u16]>) -> Vec<ClassPixels<'a>> {
    let mut list = Vec::new();
    for class in classes.iter().filter(|class| class.id != 0) {
        let instance = |at: usize| instances.map_or(0, |instances| instances[at]);
        let shown: BTreeSet<u16> = (0..labels.len()).filter(|at| labels[*at] == class.id).map(instance).collect();
        for number in shown {
            let mask = (0..labels.len()).map(|at| labels[at] == class.id && instance(at) == number).collect();
            list.push(ClassPixels { class, mask });
        }
    }
    list
}
