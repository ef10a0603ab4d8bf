//! The loop of the lasso while it is drawn.

#![allow(unreachable_pub)] // The component macro makes a public structure of the properties.

use crate::ui::Ui;
use leptos::prelude::*;

/// A closed line over the 3D view.
#[component]
pub(super) fn Loop(ui: Ui) -> impl IntoView {
    let path = ui.part(|s| s.features.correct.path.clone());
    let corners = move || {
        path.with(|path| path.iter().map(|at| format!("{:.5},{:.5}", at.x, at.y)).collect::<Vec<_>>().join(" "))
    };
    view! {
        <Show when=move || path.with(|path| path.len() > 1)>
            <svg class="lasso" viewBox="0 0 1 1" preserveAspectRatio="none" aria-hidden="true" data-testid="correct-loop">
                <polygon points=corners></polygon>
            </svg>
        </Show>
    }
}
