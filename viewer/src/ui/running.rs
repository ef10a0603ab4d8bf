//! A row that says how far something is, with the way to end it.

#![allow(unreachable_pub)] // The component macro makes a public structure of the properties.

use crate::words::t;
use leptos::prelude::*;

/// * `name`: of what is being done.
/// * `done`: how much of how much; nothing is shown while nothing is done.
/// * `meter`, `cancel`: test ids.
/// * `on_cancel`: ends it.
#[component]
pub(crate) fn Running(
    name: Memo<&'static str>,
    done: Memo<Option<(u32, u32)>>,
    meter: &'static str,
    cancel: &'static str,
    on_cancel: UnsyncCallback<()>,
) -> impl IntoView {
    view! {
        <Show when=move || done.with(Option::is_some)>
            <div class="switch-row">
                <span>{name}</span>
                <progress
                    class="meter" data-testid=meter aria-label=name max="100"
                    prop:value=move || done.get().map_or(0, |(done, total)| done * 100 / total)
                ></progress>
                <button class="text-button" type="button" data-testid=cancel on:click=move |_| on_cancel.run(())>
                    {t!("common.cancel")}
                </button>
            </div>
        </Show>
    }
}
