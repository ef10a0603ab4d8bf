//! Which marked points are shown, and the theme.

use crate::display::Theme;
use crate::state::Event;
use crate::ui::Ui;
use crate::words::t;
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
            <header class="panel-head"><h2 id="display-title">{t!("display.panel")}</h2></header>
            <label class="switch-row">
                <span>{t!("display.outliers")} <small>{t!("display.outliers.what")}</small></span>
                <input
                    class="switch" type="checkbox" role="switch" data-testid="show-outliers"
                    prop:checked=move || outliers.get()
                    on:change=move |e| ui.send(Event::ShowOutliers(event_target_checked(&e)))
                />
            </label>
            <label class="switch-row">
                <span>{t!("display.background")} <small>{t!("display.background.what")}</small></span>
                <input
                    class="switch" type="checkbox" role="switch" data-testid="show-background"
                    prop:checked=move || background.get()
                    on:change=move |e| ui.send(Event::ShowBackground(event_target_checked(&e)))
                />
            </label>
            <fieldset class="switch-row">
                <legend class="visually-hidden">{t!("display.theme")}</legend>
                <span aria-hidden="true">{t!("display.theme")}</span>
                <div class="segments">{Theme::ALL.into_iter().map(choice).collect_view()}</div>
            </fieldset>
        </section>
    }
}
