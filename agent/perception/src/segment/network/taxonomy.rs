//! Which classes an inspection has when its labels come from networks: matched by name, never by number.

use super::manifest::{Manifest, Task};
use semascan_model::{ClassDef, Taxonomy};

/// The classes of `known` (a source's, whose truth refers to them) and those that `models` bring beyond them.
pub fn extended(known: &Taxonomy, models: &[&Manifest]) -> Taxonomy {
    let mut taxonomy = known.clone();
    for model in models {
        let classes = match model.task {
            Task::Defect => &mut taxonomy.defects,
            _ => &mut taxonomy.components,
        };
        for class in &model.classes {
            if class_number(classes, &class.name).is_none() {
                let id = classes.len() as u16;
                classes.push(ClassDef::new(id, class.name.clone(), class.rgb().unwrap_or_default()));
            }
        }
    }
    taxonomy
}

/// How many of the classes of `model`, none left out, are among those of its kind in `known`.
pub(super) fn shared(model: &Manifest, known: &Taxonomy) -> usize {
    let classes = if model.task == Task::Defect { &known.defects } else { &known.components };
    model.classes.iter().skip(1).filter(|class| class_number(classes, &class.name).is_some()).count()
}

/// For each class of `model` its number in `classes`; the name that is missing there otherwise.
pub(super) fn numbers(model: &Manifest, classes: &[ClassDef]) -> Result<Vec<u16>, String> {
    model.classes.iter().map(|class| class_number(classes, &class.name).ok_or_else(|| class.name.clone())).collect()
}

/// Number of the class called `name`; case and the kind of gap between words do not matter.
pub fn class_number(classes: &[ClassDef], name: &str) -> Option<u16> {
    let plain = |text: &str| text.trim().to_lowercase().replace(['-', '_'], " ");
    classes.iter().find(|c| plain(&c.name) == plain(name)).map(|c| c.id)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::segment::network::fixtures;

    #[test]
    fn classes_are_matched_by_name_and_unknown_ones_are_added() {
        let known = Taxonomy::from_names(&["solenoid", "Electrical-Connection"], &["wear"]);
        let components = fixtures::manifest("semantic", &["none", "electrical connection", "fan", "solenoid"]);
        let defects = fixtures::manifest("defect", &["none", "corrosion"]);
        let all = extended(&known, &[&components, &defects]);
        let names = |classes: &[ClassDef]| classes.iter().map(|c| c.name.clone()).collect::<Vec<_>>();
        assert_eq!(names(&all.components), ["none", "solenoid", "Electrical-Connection", "fan"]);
        assert_eq!(names(&all.defects), ["none", "wear", "corrosion"]);
        assert!(all.components.iter().enumerate().all(|(i, c)| usize::from(c.id) == i));
        assert_eq!(numbers(&components, &all.components), Ok(vec![0, 2, 3, 1]));
        assert_eq!(numbers(&components, &known.components), Err("fan".into()));
    }
}
