//! The selected view at large: its picture with labels, uncertainty or contributions over it, what became of it and
//! how long it took.

use super::picture::Picture;
use crate::state::timings::{STAGES, stage_label};
use crate::state::views::{ViewEntry, ViewOverlay};
use crate::state::{Event, units};
use crate::ui::Ui;
use crate::ui::icons::{CLOSE, Icon, NEXT, PREVIOUS, WARNING};
use leptos::prelude::*;

/// A card over the viewport while a view is selected.
#[component]
pub(super) fn ViewDetail(ui: Ui) -> impl IntoView {
    let selected = ui.part(|s| s.views.selected().cloned());
    let overlay = RwSignal::new(ViewOverlay::default());
    view! {
        {move || selected.get().map(|view| view! { <Card ui view overlay/> })}
    }
}

#[component]
fn Card(ui: Ui, view: ViewEntry, overlay: RwSignal<ViewOverlay>) -> impl IntoView {
    let index = view.index;
    let times = ui.part(move |s| s.timings.of_view(index));
    let step = move |by: i32| move |_| ui.send(Event::StepView(by));
    let overlays: Vec<ViewOverlay> =
        ViewOverlay::ALL.into_iter().filter(|o| *o == ViewOverlay::None || view.overlay(*o).is_some()).collect();
    let choice = move |option: ViewOverlay| {
        view! {
            <label class="segment">
                <input
                    type="radio" name="overlay" value=option.key() data-testid=format!("overlay-{}", option.key())
                    prop:checked=move || overlay.get() == option
                    on:change=move |_| overlay.set(option)
                />
                <span>{option.label()}</span>
            </label>
        }
    };
    let (accepted, reason, added) = (view.accepted, view.reason.clone(), view.points_added);
    view! {
        <section class="detail" data-testid="view-detail" aria-label=format!("View {}", index + 1)>
            <header class="detail-head">
                <h2>{format!("View {}", index + 1)}</h2>
                <button class="tool" type="button" aria-label="Previous view" title="Previous view (P)" on:click=step(-1)>
                    <Icon path=PREVIOUS/>
                </button>
                <button class="tool" type="button" aria-label="Next view" title="Next view (N)" on:click=step(1)>
                    <Icon path=NEXT/>
                </button>
                <button
                    class="tool" type="button" aria-label="Close" title="Close (Esc)"
                    on:click=move |_| ui.send(Event::SelectView(None))
                >
                    <Icon path=CLOSE/>
                </button>
            </header>
            <div class="detail-picture">
                {move || {
                    let alt = format!("Picture of view {}", index + 1);
                    view! { <Picture view=view.clone() overlay=overlay.get() alt/> }
                }}
            </div>
            {(overlays.len() > 1).then(|| view! {
                <fieldset class="segments detail-overlays">
                    <legend class="visually-hidden">"Over the picture"</legend>
                    {overlays.into_iter().map(choice).collect_view()}
                </fieldset>
            })}
            {(!accepted).then(|| view! {
                <p class="callout callout-warning">
                    <Icon path=WARNING/> <span>{format!("Rejected. {}", units::sentence(&reason))}</span>
                </p>
            })}
            <dl class="detail-figures">
                <div><dt>"Points added"</dt><dd>{units::count(added)}</dd></div>
                {STAGES.into_iter().enumerate().map(|(i, stage)| view! {
                    <div>
                        <dt>{stage_label(stage)}</dt>
                        <dd>{move || times.get()[i].map_or_else(|| "–".into(), units::duration)}</dd>
                    </div>
                }).collect_view()}
            </dl>
        </section>
    }
}
