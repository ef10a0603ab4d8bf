//! The list of places where a label would teach most.

#![allow(unreachable_pub)] // The component macro makes a public structure of the properties.

use super::{CorrectEvent, TeachingRegion};
use crate::ui::Ui;
use crate::words::{decimal, t};
use leptos::prelude::*;
use semascan_model::ClassDef;

/// The list, asked for when it is opened.
#[component]
pub(super) fn TeachingList(ui: Ui) -> impl IntoView {
    let is_open = ui.part(|s| s.features.correct.shows_teaching);
    let nothing = ui.part(|s| s.features.correct.teaching.as_ref().and_then(|teaching| teaching.nothing.clone()));
    let is_asked = ui.part(|s| s.features.correct.teaching.is_none());
    let regions = ui.part(|s| s.features.correct.regions().to_vec());
    let taught = ui.part(|s| s.features.correct.taught);
    let done = ui.part(|s| {
        let components: Vec<ClassDef> = s.legend.rows.iter().map(|row| row.class.clone()).collect();
        s.features.correct.taught(&components, &s.legend.defects)
    });
    let entry = move |(place, region): (usize, TeachingRegion)| {
        let is_done = move || done.with(|done| done.get(place).copied().unwrap_or_default());
        let (sigma, area) = (decimal(region.sigma, 2), decimal(region.area * 1e6, 0));
        let figures = t!("teach.entry", sigma, area);
        view! {
            <li>
                <button
                    class="finding" type="button" data-testid=format!("teach-{}", place + 1) title=t!("teach.choose")
                    aria-pressed=move || (taught.get() == Some(place)).to_string() data-done=move || is_done().to_string()
                    on:click=move |_| ui.send_feature(CorrectEvent::Teach(place))
                >
                    <span class="entry-number">{place + 1}</span>
                    <span class="finding-name">
                        {region.name} {region.finding.is_some().then(|| format!(", {}", t!("teach.finding")))} " " <small>{figures}</small>
                    </span>
                    {move || is_done().then(|| view! { <span class="decision" data-decision="accept">{t!("teach.done")}</span> })}
                </button>
            </li>
        }
    };
    view! {
        <button
            class="text-button" type="button" data-testid="teach-open" aria-expanded=move || is_open.get().to_string()
            on:click=move |_| ui.send_feature(CorrectEvent::AskTeaching(!is_open.get_untracked()))
        >
            {t!("teach.title")}
        </button>
        <Show when=move || is_open.get()>
            {move || is_asked.get().then(|| view! { <p class="empty">{t!("review.asking")}</p> })}
            {move || nothing.get().map(|reason| view! { <p class="empty" data-testid="teach-nothing">{t!("teach.nothing", reason)}</p> })}
            <ol class="findings">{move || regions.get().into_iter().enumerate().map(entry).collect_view()}</ol>
        </Show>
    }
}
