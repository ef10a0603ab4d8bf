//! Which marked points are shown, and the theme.

use crate::display::Theme;
use crate::state::Event;
use crate::ui::Ui;
use leptos::prelude::*;

/// Switches of the display.
#[component]
pub(super) fn DisplayPanel(ui: Ui) -> impl IntoView {
    let outliers = ui.part(|s| s.display.outliers);
    let background = ui.part(|s| s.display.background);
    let theme = ui.part(|s| s.display.theme);
    let choice = move |option: Theme| {
        view! {
            <label class="segment">
                <input
                    type="radio" name="theme" value=option.key() data-testid=format!("theme-{}", option.key())
                    prop:checked=move || theme.get() == option
                    on:change=move |_| ui.send(Event::Theme(option))
                />
                <span>{option.label()}</span>
            </label>
        }
    };
    view! {
        <section class="panel" aria-labelledby="display-title">
            <header class="panel-head"><h2 id="display-title">"Display"</h2></header>
            <label class="switch-row">
                <span>"Outliers" <small>"points that stand alone"</small></span>
                <input
                    class="switch" type="checkbox" role="switch" data-testid="show-outliers"
                    prop:checked=move || outliers.get()
                    on:change=move |e| ui.send(Event::ShowOutliers(event_target_checked(&e)))
                />
            </label>
            <label class="switch-row">
                <span>"Background" <small>"outside the measuring volume"</small></span>
                <input
                    class="switch" type="checkbox" role="switch" data-testid="show-background"
                    prop:checked=move || background.get()
                    on:change=move |e| ui.send(Event::ShowBackground(event_target_checked(&e)))
                />
            </label>
            <fieldset class="switch-row">
                <legend class="visually-hidden">"Theme"</legend>
                <span aria-hidden="true">"Theme"</span>
                <div class="segments">{Theme::ALL.into_iter().map(choice).collect_view()}</div>
            </fieldset>
        </section>
    }
}
