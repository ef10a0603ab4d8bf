//! Short messages in the corner of the page.

use super::Ui;
use super::icons::{CLOSE, DONE, Icon, WARNING};
use crate::app::Event;
use crate::app::notices::{Level, Notice};
use leptos::prelude::*;

/// The messages on screen. The list is a live region: what is added to it is spoken.
#[component]
pub(super) fn NoticeList(ui: Ui) -> impl IntoView {
    let notices = ui.part(|s| s.notices.iter().cloned().collect::<Vec<_>>());
    view! {
        <For each=move || notices.get() key=|n| (n.id, n.count) let:notice>
            <NoticeCard ui notice/>
        </For>
    }
}

#[component]
fn NoticeCard(ui: Ui, notice: Notice) -> impl IntoView {
    let Notice { id, level, text, count, .. } = notice;
    let icon = if level == Level::Info { DONE } else { WARNING };
    view! {
        <div class="notice" data-testid="notice" data-level=level.key()>
            <Icon path=icon/>
            <p>{text} {(count > 1).then(|| view! { <span class="notice-count">{format!("×{count}")}</span> })}</p>
            <button class="tool" type="button" aria-label="Dismiss" on:click=move |_| ui.send.run(Event::Dismiss(id))>
                <Icon path=CLOSE/>
            </button>
        </div>
    }
}
