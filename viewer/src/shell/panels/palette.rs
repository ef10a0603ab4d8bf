//! The command palette: a field that finds commands by their words.

use super::key_name::key_name;
use crate::shell::commands::{Offer, found, offers};
use crate::state::Event;
use crate::ui::{Ui, modal};
use crate::words::t;
use leptos::prelude::*;

/// A modal dialog, open while the state says so.
#[component]
pub(super) fn Palette(ui: Ui) -> impl IntoView {
    let open = ui.part(|s| s.palette_open);
    let dialog = NodeRef::<leptos::html::Dialog>::new();
    modal::follow(dialog, open);
    view! {
        <dialog
            class="dialog palette" data-testid="palette" aria-label=t!("palette.title") node_ref=dialog
            on:close=move |_| ui.send(Event::Palette(false))
            on:click=move |e| if modal::is_backdrop(&e) { ui.send(Event::Palette(false)) }
        >
            <Show when=move || open.get()><Search ui/></Show>
        </dialog>
    }
}

/// The field and what it finds. What can be done is what could be when the palette was opened.
#[component]
fn Search(ui: Ui) -> impl IntoView {
    let all = StoredValue::new(ui.read(offers));
    let query = RwSignal::new(String::new());
    let place = RwSignal::new(0_usize);
    let list = Memo::new(move |_| found(all.get_value(), &query.get()));
    let field = NodeRef::<leptos::html::Input>::new();
    let entries = NodeRef::<leptos::html::Ul>::new();
    Effect::new(move |_| {
        if let Some(field) = field.get() {
            // Fails only where the element is not in the page.
            let _ = field.focus();
        }
    });
    // What is chosen stays in sight.
    Effect::new(move |_| {
        let chosen = entries.get().and_then(|list| list.children().item(place.get() as u32));
        if let Some(entry) = chosen {
            let options = web_sys::ScrollIntoViewOptions::new();
            options.set_block(web_sys::ScrollLogicalPosition::Nearest);
            entry.scroll_into_view_with_scroll_into_view_options(&options);
        }
    });
    let perform = move |offer: Offer| {
        ui.send(Event::Palette(false));
        offer.action.perform(ui);
    };
    let on_key = move |event: web_sys::KeyboardEvent| {
        let last = list.with_untracked(Vec::len).saturating_sub(1);
        let here = place.get_untracked();
        match event.key().as_str() {
            "ArrowDown" => place.set(if here >= last { 0 } else { here + 1 }),
            "ArrowUp" => place.set(if here == 0 { last } else { here - 1 }),
            "Enter" => {
                if let Some(offer) = list.with_untracked(|list| list.get(here).cloned()) {
                    perform(offer);
                }
            }
            _ => return,
        }
        event.prevent_default();
    };
    view! {
        <input
            class="palette-field" type="text" role="combobox" aria-expanded="true" aria-controls="palette-list"
            aria-label=t!("palette.find") placeholder=t!("palette.find") autocomplete="off" spellcheck="false"
            data-testid="palette-field" node_ref=field on:keydown=on_key
            aria-activedescendant=move || list.with(|list| (!list.is_empty()).then(|| format!("palette-{}", place.get())))
            on:input=move |event| {
                query.set(event_target_value(&event));
                place.set(0);
            }
        />
        <ul class="palette-list" id="palette-list" role="listbox" aria-label=t!("palette.title") node_ref=entries>
            {move || list.get().into_iter().enumerate().map(|(index, offer)| {
                let (group, label, keys) = (offer.group, offer.label.clone(), offer.keys);
                view! {
                    <li
                        class="palette-entry" id=format!("palette-{index}") role="option" data-testid="palette-entry"
                        aria-selected=move || (place.get() == index).to_string()
                        on:click=move |_| perform(offer.clone())
                    >
                        <span class="palette-group">{group}</span>
                        <span class="palette-label">{label}</span>
                        {(!keys.is_empty()).then(|| keys.split(' ').map(|key| view! { <kbd>{key_name(key)}</kbd> }).collect_view())}
                    </li>
                }
            }).collect_view()}
        </ul>
        <p class="empty palette-none" role="status">
            {move || list.with(Vec::is_empty).then_some(t!("palette.none"))}
        </p>
    }
}
