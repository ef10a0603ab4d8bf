//! The scale of the colours that mean deviations, over the 3D view.

#![allow(unreachable_pub)] // The component macro makes a public structure of the properties.

use crate::display::{ColorMode, deviation_colors};
use crate::ui::Ui;
use crate::words::{localized, t};
use leptos::prelude::*;

/// Four tolerances to either side, in millimetres.
#[component]
pub(super) fn DeviationScale(ui: Ui) -> impl IntoView {
    let shown = ui.part(|s| s.display.color_mode == ColorMode::Deviation);
    let tolerance = ui.part(|s| s.features.deviation.tolerance);
    let is_doubtful = ui.part(|s| s.features.deviation.figures.is_some_and(|f| f.mismatch.is_some()));
    let top = f64::from(deviation_colors::TOP);
    let ticks = move || [-top, -1.0, 1.0, top].map(|tolerances| tick(tolerances * tolerance.get()));
    view! {
        <Show when=move || shown.get()>
            <figure class="scale is-raised is-wide" data-testid="color-scale">
                <figcaption>{t!("deviation.scale")}</figcaption>
                <div class="scale-ramp" aria-hidden="true" style:background-image=deviation_colors::css_gradient()></div>
                <div class="scale-ticks is-banded">
                    {move || ticks().into_iter().map(|text| view! { <span>{text}</span> }).collect_view()}
                </div>
                {move || is_doubtful.get().then(|| view! {
                    <p class="scale-unknown" data-testid="scale-doubt">{t!("deviation.doubt")}</p>
                })}
                <div class="scale-ticks"><span>{t!("deviation.inside")}</span><span>{t!("deviation.within")}</span><span>{t!("deviation.outside")}</span></div>
            </figure>
        </Show>
    }
}

/// A deviation in metres as signed millimetres, no longer than needed.
fn tick(metres: f64) -> String {
    let millimetres = metres * 1e3;
    localized(format!("{millimetres:+.3}").trim_end_matches('0').trim_end_matches('.'))
}
