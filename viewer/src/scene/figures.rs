//! What the state counts of the model while it grows.

use super::HeldModel;
use crate::display::HiddenFlags;
use crate::state::legend::ClassCount;
use semascan_model::PointFlags;

/// Counts of the model by component class: of the points that are part of the surface, and of those that `hidden` leaves in
/// the picture; the place in the list is the class.
pub fn class_counts(model: &HeldModel, hidden: HiddenFlags) -> Vec<ClassCount> {
    let mut list = Vec::new();
    let mut at = |class: u16, set: &dyn Fn(&mut ClassCount)| {
        let place = usize::from(class);
        if list.len() <= place {
            list.resize(place + 1, ClassCount::default());
        }
        set(&mut list[place]);
    };
    for (class, stats) in model.class_stats(PointFlags::LEFT_OUT) {
        at(class, &|count| (count.points, count.confidence) = (stats.points as u64, stats.mean_confidence()));
    }
    for (class, stats) in model.class_stats(hidden.bits()) {
        at(class, &|count| count.shown = stats.points as u64);
    }
    for (class, stats) in model.class_stats(0) {
        at(class, &|count| (count.held, count.background) = (stats.points as u64, stats.points as u64));
    }
    for (class, stats) in model.class_stats(PointFlags::BACKGROUND) {
        at(class, &|count| count.background -= stats.points as u64);
    }
    list
}
