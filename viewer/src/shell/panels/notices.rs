//! Short messages in the corner of the page.

use crate::state::Event;
use crate::state::notices::Level;
use crate::ui::Ui;
use crate::ui::icons::{CLOSE, DONE, Icon, WARNING};
use crate::words::t;
use leptos::prelude::*;

/// The messages on screen. The list is a live region: what is added to it is spoken.
#[component]
pub(super) fn NoticeList(ui: Ui) -> impl IntoView {
    let notices = ui.part(|s| s.notices.iter().cloned().collect::<Vec<_>>());
    view! {
        // By number and level alone: a notice that is said again keeps its place on the page.
        <For each=move || notices.get() key=|n| (n.id, n.level) let:notice>
            <NoticeCard ui id=notice.id level=notice.level/>
        </For>
    }
}

#[component]
fn NoticeCard(ui: Ui, id: u64, level: Level) -> impl IntoView {
    let notice = ui.part(move |s| s.notices.iter().find(|n| n.id == id).cloned());
    let text = move || notice.with(|n| n.as_ref().map(|n| n.text.clone()));
    let count = move || notice.with(|n| n.as_ref().map(|n| n.count).filter(|count| *count > 1));
    let icon = if level == Level::Info { DONE } else { WARNING };
    view! {
        <div class="notice" data-testid="notice" data-level=level.key()>
            <Icon path=icon/>
            <p>
                {text}
                {move || count().map(|count| view! { <span class="notice-count">{format!("×{count}")}</span> })}
            </p>
            <button class="tool" type="button" aria-label=t!("notices.dismiss") on:click=move |_| ui.send(Event::Dismiss(id))>
                <Icon path=CLOSE/>
            </button>
        </div>
    }
}
