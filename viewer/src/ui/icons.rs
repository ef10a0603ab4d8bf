//! The icons: 16 px, drawn with strokes in the colour of the text. Decoration only; the control that holds one is named.

#![allow(unreachable_pub)] // The component macro makes a public structure of the properties.

use leptos::prelude::*;

/// An icon made of one path on a 16 x 16 grid.
#[component]
pub(crate) fn Icon(path: &'static str) -> impl IntoView {
    view! {
        <svg class="icon" viewBox="0 0 16 16" aria-hidden="true" focusable="false">
            <path d=path></path>
        </svg>
    }
}

/// Frame with corners: fit the model into view.
pub(crate) const FIT: &str = "M2.5 5.5v-3h3M10.5 2.5h3v3M13.5 10.5v3h-3M5.5 13.5h-3v-3M6 6h4v4H6z";
/// Question mark.
pub(crate) const HELP: &str = "M5.75 6a2.25 2.25 0 1 1 3.4 1.94c-.7.42-1.15.9-1.15 1.66M8 12.1v.1";
/// Magnifying glass.
pub(crate) const SEARCH: &str = "M7 11.5a4.5 4.5 0 1 0 0-9 4.5 4.5 0 0 0 0 9M10.25 10.25 13.75 13.75";
/// Open folder.
pub(crate) const OPEN: &str = "M1.75 12.75v-9.5h4l1.5 1.75h5v2M1.75 12.75l2-5.75h10.5l-2 5.75z";
/// Half-filled circle.
pub(crate) const THEME: &str = "M8 2.5a5.5 5.5 0 1 0 0 11zM8 2.5a5.5 5.5 0 0 1 0 11";
/// Cross.
pub(crate) const CLOSE: &str = "M4 4l8 8M12 4l-8 8";
/// Arrow into a tray.
pub(crate) const DOWNLOAD: &str = "M8 2.5v7.5M4.75 6.9 8 10.1l3.25-3.2M2.75 13.25h10.5";
/// Triangle with an exclamation mark.
pub(crate) const WARNING: &str = "M8 2.25 14.25 13.25H1.75zM8 6.5v3M8 11.3v.1";
/// Circled tick.
pub(crate) const DONE: &str = "M8 1.75a6.25 6.25 0 1 0 0 12.5 6.25 6.25 0 0 0 0-12.5M5.25 8.25l2 2 3.5-4.25";
/// Chevron to the left.
pub(crate) const PREVIOUS: &str = "M10 3.5 5.5 8l4.5 4.5";
/// Chevron to the right.
pub(crate) const NEXT: &str = "M6 3.5 10.5 8 6 12.5";
/// Camera.
pub(crate) const CAMERA: &str =
    "M2 5.25h2.75l1-1.75h4.5l1 1.75H14v7.5H2zM8 11a2.25 2.25 0 1 0 0-4.5A2.25 2.25 0 0 0 8 11";
/// Box in perspective.
pub(crate) const MODEL: &str = "M8 1.75 13.5 4.9v6.2L8 14.25 2.5 11.1V4.9zM2.75 5 8 8l5.25-3M8 8v6";
/// Two links of a chain.
pub(crate) const LINK: &str =
    "M6.5 4.5 8 3a3.2 3.2 0 0 1 5 4.5L11.5 9M9.5 11.5 8 13a3.2 3.2 0 0 1-5-4.5L4.5 7M6 10l4-4";
/// Interrupted line.
pub(crate) const UNLINKED: &str =
    "M6.5 4.5 8 3a3.2 3.2 0 0 1 5 4.5L11.5 9M9.5 11.5 8 13a3.2 3.2 0 0 1-5-4.5L4.5 7M2.5 2.5l11 11";
/// Map pin.
pub(crate) const PIN: &str = "M8 14.25S3.25 9.6 3.25 6.25a4.75 4.75 0 0 1 9.5 0C12.75 9.6 8 14.25 8 14.25M8 7.9a1.65 1.65 0 1 0 0-3.3 1.65 1.65 0 0 0 0 3.3";
