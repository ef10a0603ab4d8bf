//! The table of shortcuts.

use super::key_name::key_name;
use crate::state::Event;
use crate::ui::icons::{CLOSE, Icon};
use crate::ui::{Command, Ui, modal};
use crate::words::{self, t};
use leptos::prelude::*;

/// The keys of a shortcut, and what it does.
type Shortcut = (&'static [&'static str], &'static str);

/// What the pointer and the keys do, in groups.
fn groups() -> [(&'static str, Vec<Shortcut>); 8] {
    [
        (
            t!("help.pointer"),
            vec![
                (&["Click"], t!("help.click")),
                (&["Drag"], t!("help.drag")),
                (&["Shift", "Drag"], t!("help.pan")),
                (&["Wheel"], t!("help.wheel")),
                (&["Double click"], t!("command.fit")),
            ],
        ),
        (
            t!("common.camera"),
            vec![
                (&["←", "→", "↑", "↓"], t!("help.arrows")),
                (&["+", "−"], t!("help.zoom")),
                (&["F"], t!("command.fit")),
                (&["H"], t!("command.link")),
                (&["Shift", "H"], t!("help.save")),
                (&["1", "…", "7"], t!("help.views")),
            ],
        ),
        (
            t!("common.points"),
            vec![
                (&["Enter"], t!("command.pick_middle")),
                (&["L"], t!("command.pin")),
                (&["E"], t!("evidence.card")),
                (&[",", "."], t!("help.photographs")),
                (&["M"], t!("help.distance")),
                (&["G"], t!("help.angle")),
                (&["Del"], t!("help.delete")),
                (&["Esc"], t!("help.escape")),
            ],
        ),
        (
            t!("section.panel"),
            vec![
                (&["S"], t!("help.section")),
                (&["D", "U"], t!("help.deeper")),
                (&["V"], t!("command.flip")),
                (&["W"], t!("help.thickness")),
            ],
        ),
        (
            t!("review.panel"),
            vec![
                (&["J"], t!("command.next_finding")),
                (&["K"], t!("command.previous_finding")),
                (&["Y"], t!("help.accept")),
                (&["R"], t!("ruling.rework")),
                (&["X"], t!("ruling.reject")),
                (&["I"], t!("ruling.comment")),
            ],
        ),
        (
            t!("help.corrections"),
            vec![
                (&["Q"], t!("help.brush")),
                (&["Shift", "Q"], t!("help.outline")),
                (&["[", "]"], t!("help.width")),
                (&["Z"], t!("help.undo")),
            ],
        ),
        (
            t!("display.panel"),
            vec![
                (&["C"], t!("help.color_mode")),
                (&["A"], t!("help.components")),
                (&["O"], t!("help.outliers")),
                (&["B"], t!("help.background")),
                (&["T"], t!("command.theme")),
            ],
        ),
        (
            t!("help.page"),
            vec![
                (&["[", "]"], t!("help.timeline")),
                (&["N"], t!("command.next_view")),
                (&["P"], t!("command.previous_view")),
                (&["Esc"], t!("help.close_view")),
                (&["Ctrl", "K"], t!("help.palette")),
                (&["?"], t!("help.help")),
            ],
        ),
    ]
}

/// A modal dialog, open while the state says so.
#[component]
pub(super) fn Help(ui: Ui) -> impl IntoView {
    let open = ui.part(|s| s.help_open);
    let dialog = NodeRef::<leptos::html::Dialog>::new();
    modal::follow(dialog, open);
    view! {
        <dialog
            class="dialog" data-testid="help" aria-labelledby="help-title" node_ref=dialog
            on:close=move |_| ui.send(Event::Help(false))
            on:click=move |e| if modal::is_backdrop(&e) { ui.send(Event::Help(false)) }
        >
            <header class="dialog-head">
                <h2 id="help-title">{t!("help.title")}</h2>
                <button
                    class="tool" type="button" aria-label=t!("common.close") on:click=move |_| ui.send(Event::Help(false))
                >
                    <Icon path=CLOSE/>
                </button>
            </header>
            <div class="dialog-body">
                {groups().into_iter().map(|(title, rows)| view! {
                    <section class="keys">
                        <h3>{title}</h3>
                        <dl>
                            {rows.into_iter().map(|(keys, what)| view! {
                                <div>
                                    <dt>{keys.iter().map(|k| view! { <kbd>{key_name(k)}</kbd> }).collect_view()}</dt>
                                    <dd>{what}</dd>
                                </div>
                            }).collect_view()}
                        </dl>
                    </section>
                }).collect_view()}
                <section class="keys">
                    <h3 id="help-language">{t!("language.title")}</h3>
                    <div class="buttons" role="group" aria-labelledby="help-language">
                        {words::languages().iter().map(|(code, name)| view! {
                            <button
                                class="button" type="button" lang=code.as_str() data-testid=format!("language-{code}")
                                aria-pressed=(words::language() == code).to_string()
                                on:click=move |_| ui.ask(Command::Language(code))
                            >
                                {name.as_str()}
                            </button>
                        }).collect_view()}
                    </div>
                </section>
            </div>
        </dialog>
    }
}
