//! The tools on the page: panels, overlays and controllers, made of the table in [`super`].

use super::view::{Controller, FeatureView, Host};
use crate::ui::Ui;
use leptos::prelude::{AnyView, CollectView, IntoAny};
use std::rc::Rc;

macro_rules! define_mounting {
    ($($module:ident: $State:ident),+ $(,)?) => {
        /// The panels of the tools, in the order of the table.
        pub fn panels(ui: Ui) -> AnyView {
            vec![$(<super::$module::$State as FeatureView>::panel(ui)),+].collect_view().into_any()
        }

        /// What the tools lay over the 3D view.
        pub fn overlays(ui: Ui) -> AnyView {
            vec![$(<super::$module::$State as FeatureView>::overlay(ui)),+].collect_view().into_any()
        }

        /// The controllers of the tools that have one.
        pub fn controllers(host: &Host) -> Vec<Rc<dyn Controller>> {
            [$(<super::$module::$State as FeatureView>::controller(host)),+].into_iter().flatten().collect()
        }
    };
}

for_each_feature!(define_mounting);
