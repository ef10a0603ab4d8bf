//! Notices that the model has changed since points of it were picked.

use super::InspectEvent;
use crate::features::FeatureEvent;
use crate::features::view::{Controller, Host};
use crate::scene::ModelChange;
use crate::ui::Ui;
use std::rc::Rc;

/// See the module.
pub(super) struct InspectController {
    ui: Ui,
}

impl InspectController {
    pub(super) fn new(host: &Host) -> Rc<Self> {
        Rc::new(Self { ui: host.ui })
    }
}

impl Controller for InspectController {
    fn handle(&self, _: &FeatureEvent) {}

    fn model_changed(&self, change: ModelChange) {
        if change != ModelChange::None && self.ui.read(|s| s.features.inspect.is_current()) {
            self.ui.send_feature(InspectEvent::Outdated);
        }
    }
}
