//! A mark with a name where each of the others points; `shell/anchors.rs` puts it there with every frame.

#![allow(unreachable_pub)] // The component macro makes a public structure of the properties.

use super::controller::OthersController;
use super::{Other, Others};
use crate::features::view::{Controller, FeatureView, Host};
use crate::ui::{Ui, anchor_place};
use crate::words::t;
use leptos::prelude::*;
use std::rc::Rc;

impl FeatureView for Others {
    fn overlay(ui: Ui) -> AnyView {
        view! { <Marks ui/> }.into_any()
    }

    fn controller(host: &Host) -> Option<Rc<dyn Controller>> {
        Some(OthersController::new(host))
    }
}

#[component]
fn Marks(ui: Ui) -> impl IntoView {
    // Age counts only where it shows.
    let others = ui.part(|s| {
        let list = s.features.others.list.iter().filter(|other| s.display.cut.keeps(other.position));
        list.map(|other| (other.clone().at_no_age(), other.is_old())).collect::<Vec<_>>()
    });
    let mark = |(other, is_old): (Other, bool)| {
        let name = if other.person.is_empty() { t!("others.nameless").to_owned() } else { other.person.clone() };
        view! {
            <div
                class="other anchored" class:is-old=is_old data-testid="other" data-color=other.color()
                data-place=anchor_place(other.position) data-anchor=format!("other-{}", other.viewer)
            >
                <div class="pin-text is-raised"><span>{name}</span></div>
            </div>
        }
    };
    view! { <div class="anchors">{move || others.get().into_iter().map(mark).collect_view()}</div> }
}
