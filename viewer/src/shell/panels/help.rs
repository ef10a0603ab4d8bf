//! The table of shortcuts.

use crate::state::Event;
use crate::ui::icons::{CLOSE, Icon};
use crate::ui::{Ui, modal};
use leptos::prelude::*;

/// The keys of a shortcut, and what it does.
type Shortcut = (&'static [&'static str], &'static str);

/// What the pointer and the keys do, in groups.
const GROUPS: [(&str, &[Shortcut]); 8] = [
    (
        "Pointer",
        &[
            (&["Click"], "What lies there; while measuring, a point"),
            (&["Drag"], "Orbit"),
            (&["Shift", "Drag"], "Pan (or right button, two fingers)"),
            (&["Wheel"], "Zoom to the pointer (or pinch)"),
            (&["Double click"], "Fit the model into view"),
        ],
    ),
    (
        "Camera",
        &[
            (&["←", "→", "↑", "↓"], "Orbit; with Shift, pan"),
            (&["+", "−"], "Zoom"),
            (&["F"], "Fit the model into view"),
            (&["H"], "Copy a link to this view"),
            (&["Shift", "H"], "Save the picture, with what its colours mean"),
            (&["1", "…", "7"], "Isometric, front, back, left, right, top, bottom"),
        ],
    ),
    (
        "Points",
        &[
            (&["Enter"], "Pick in the middle of the view"),
            (&["L"], "Pin a label at the picked point"),
            (&["E"], "Photographs of the picked point"),
            (&[",", "."], "The better, the next of them"),
            (&["M"], "Measure a distance"),
            (&["G"], "Measure an angle"),
            (&["Del"], "Remove the newest label or, while measuring, measurement; with Shift, all"),
            (&["Esc"], "Take a point back, end measuring, close"),
        ],
    ),
    (
        "Section",
        &[
            (&["S"], "Section plane on or off"),
            (&["D", "U"], "Deeper or up by 1 mm; with Shift, 0.1 mm"),
            (&["V"], "Cut the other side away"),
            (&["W"], "Read thicknesses; Enter reads in the middle of the view"),
        ],
    ),
    (
        "Findings",
        &[
            (&["J"], "Next finding"),
            (&["K"], "Previous finding"),
            (&["Y"], "Accept it or, with none chosen, the part"),
            (&["R"], "Rework"),
            (&["X"], "Reject"),
            (&["I"], "Remark"),
        ],
    ),
    (
        "Corrections",
        &[
            (&["Q"], "Brush: drag over the surface (the right button orbits)"),
            (&["Shift", "Q"], "New finding: drag around it, or click its corners"),
            (&["[", "]"], "Narrower, wider"),
            (&["Z"], "Undo; with Shift, redo"),
        ],
    ),
    (
        "Display",
        &[
            (&["C"], "Next colour mode; with Shift, previous"),
            (&["A"], "Show all components"),
            (&["O"], "Show or hide outliers"),
            (&["B"], "Show or hide the background"),
            (&["T"], "Light or dark theme"),
        ],
    ),
    (
        "Views and page",
        &[
            (&["[", "]"], "While an inspection is played: one view back, one on"),
            (&["N"], "Next view"),
            (&["P"], "Previous view"),
            (&["Esc"], "Close the view"),
            (&["Ctrl", "K"], "Every command, by its name"),
            (&["?"], "This help"),
        ],
    ),
];

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
                <h2 id="help-title">"Keyboard and pointer"</h2>
                <button
                    class="tool" type="button" aria-label="Close" on:click=move |_| ui.send(Event::Help(false))
                >
                    <Icon path=CLOSE/>
                </button>
            </header>
            <div class="dialog-body">
                {GROUPS.into_iter().map(|(title, rows)| view! {
                    <section class="keys">
                        <h3>{title}</h3>
                        <dl>
                            {rows.iter().map(|(keys, what)| view! {
                                <div>
                                    <dt>{keys.iter().map(|k| view! { <kbd>{*k}</kbd> }).collect_view()}</dt>
                                    <dd>{*what}</dd>
                                </div>
                            }).collect_view()}
                        </dl>
                    </section>
                }).collect_view()}
            </div>
        </dialog>
    }
}
