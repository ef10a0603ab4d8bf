//! The foot of everything that a person signs: why, and their name. Enter signs; where the agent knows who they are, the name is
//! given.

#![allow(unreachable_pub)] // The component macro makes a public structure of the properties.

use super::ReviewEvent;
use crate::ui::Ui;
use crate::words::t;
use leptos::prelude::*;

/// What a person gives with their signature.
#[derive(Clone, Debug, PartialEq)]
pub struct Signed {
    /// Their name.
    pub person: String,
    /// Why; empty where that is not said.
    pub reason: String,
}

/// Whether a reason must be given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// It must be, and its field is where the person writes next.
    Needed,
    /// It need not be.
    Free,
}

/// The form.
///
/// * `id`: what its parts are called in tests begins with this.
/// * `label`: what is signed, for screen readers.
/// * `because`: words before the reason.
/// * `button`: words on the button.
/// * `on_cancel`: gives it up; without it there is nothing to give up.
#[component]
pub fn Signature(
    ui: Ui,
    id: &'static str,
    label: String,
    because: String,
    reason: Reason,
    #[prop(into)] button: Signal<String>,
    #[prop(into)] is_ready: Signal<bool>,
    on_sign: UnsyncCallback<Signed>,
    #[prop(optional)] on_cancel: Option<UnsyncCallback<()>>,
) -> impl IntoView {
    let account = ui.read(|s| s.account.clone());
    let is_known = account.as_ref().is_some_and(|account| account.login);
    let name = match account {
        Some(account) if account.login => account.name,
        _ => ui.read(|s| s.features.review.person.clone()),
    };
    let (person, why) = (RwSignal::new(name), RwSignal::new(String::new()));
    let field = NodeRef::<leptos::html::Input>::new();
    Effect::new(move |_| {
        if let Some(field) = field.get().filter(|_| reason == Reason::Needed) {
            // Fails only where the element is not in the page.
            let _ = field.focus();
        }
    });
    let is_whole = move || {
        is_ready.get() && !person.get().trim().is_empty() && (reason == Reason::Free || !why.get().trim().is_empty())
    };
    let sign = move |event: web_sys::SubmitEvent| {
        event.prevent_default();
        if !is_whole() {
            return;
        }
        if !is_known {
            ui.send_feature(ReviewEvent::Person(person.get_untracked()));
        }
        on_sign.run(Signed { person: person.get_untracked(), reason: why.get_untracked() });
    };
    view! {
        <form class="draft" data-testid=format!("{id}-form") on:submit=sign aria-label=label>
            <label>
                <span>{because}</span>
                <input
                    type="text" data-testid=format!("{id}-reason") maxlength="2000" autocomplete="off" node_ref=field
                    placeholder=(reason == Reason::Free).then_some(t!("review.not_needed"))
                    on:input=move |event| why.set(event_target_value(&event))
                />
            </label>
            <label>
                <span>{t!("review.name")}</span>
                <input
                    type="text" data-testid=format!("{id}-person") maxlength="200" autocomplete="name" prop:readonly=is_known
                    prop:value=move || person.get() on:input=move |event| person.set(event_target_value(&event))
                />
            </label>
            <div class="row-actions">
                <button class="button" type="submit" data-testid=format!("{id}-sign") prop:disabled=move || !is_whole()>
                    {move || button.get()}
                </button>
                {on_cancel.map(|cancel| view! {
                    <button class="text-button" type="button" data-testid=format!("{id}-cancel") on:click=move |_| cancel.run(())>
                        {t!("common.cancel")}
                    </button>
                })}
            </div>
        </form>
    }
}
