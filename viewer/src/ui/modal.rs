//! Modal dialogs that are open while the state says so.

use leptos::html::Dialog;
use leptos::prelude::*;

/// Opens and closes a dialog as `open` says.
pub(crate) fn follow(dialog: NodeRef<Dialog>, open: Memo<bool>) {
    Effect::new(move |_| {
        let (Some(dialog), open) = (dialog.get(), open.get()) else { return };
        match (open, dialog.open()) {
            // Fails only where the element is not in the page.
            (true, false) => drop(dialog.show_modal()),
            (false, true) => dialog.close(),
            _ => {}
        }
    });
}

/// Whether a click was beside the dialog: on the element itself, not on what it holds.
pub(crate) fn is_backdrop(event: &web_sys::MouseEvent) -> bool {
    event.target().is_some() && event.target() == event.current_target()
}
