//! Notices that the model has changed since it was measured.

use super::MeasureEvent;
use crate::features::FeatureEvent;
use crate::features::view::{Controller, Host};
use crate::scene::ModelChange;
use crate::ui::Ui;
use std::rc::Rc;

/// See the module.
pub(super) struct MeasureController {
    ui: Ui,
}

impl MeasureController {
    pub(super) fn new(host: &Host) -> Rc<Self> {
        Rc::new(Self { ui: host.ui })
    }
}

impl Controller for MeasureController {
    fn handle(&self, _: &FeatureEvent) {}

    fn model_changed(&self, change: ModelChange) {
        if change != ModelChange::None && self.ui.read(|s| s.features.measure.is_current()) {
            self.ui.send_feature(MeasureEvent::Outdated);
        }
    }
}
