//! The model's figures as the state keeps them.

use super::HeldModel;
use crate::display::HiddenFlags;
use crate::state::legend::ClassFigures;

/// The figures of the model by component class, over the points that `hidden` leaves in the picture; the place in the
/// list is the class.
pub fn class_figures(model: &HeldModel, hidden: HiddenFlags) -> Vec<ClassFigures> {
    let mut list = Vec::new();
    for (class, stats) in model.class_stats(hidden) {
        let place = usize::from(class);
        if list.len() <= place {
            list.resize(place + 1, ClassFigures::default());
        }
        list[place] =
            ClassFigures { points: stats.points as u64, area: stats.area, confidence: stats.mean_confidence() };
    }
    list
}
