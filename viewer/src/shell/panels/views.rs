//! The captured views as a strip of pictures; a click shows a view's camera in the model and the view at large.

use super::picture::Picture;
use crate::state::views::{ViewEntry, ViewOverlay};
use crate::state::{Event, units};
use crate::ui::icons::{CAMERA, Icon, WARNING};
use crate::ui::{Command, Ui};
use crate::words::t;
use leptos::prelude::*;
use semascan_protocol::{Domain, Phase};

/// The strip, newest view at its end and kept in sight unless the person has scrolled away or selected one.
#[component]
pub(super) fn ViewStrip(ui: Ui) -> impl IntoView {
    let views = ui.part(|s| s.views.iter().cloned().collect::<Vec<_>>());
    let count = ui.part(|s| s.views.iter().len());
    let selected = ui.part(|s| s.views.selected().map(|v| v.index));
    let earlier = ui.part(|s| s.views.earlier());
    let cut = ui.part(|s| s.views.is_cut() && s.views.earlier().is_none());
    // The last of the strip: only a new one is brought into sight, not the earlier ones that were asked for.
    let last = ui.part(|s| s.views.iter().next_back().map(|v| v.index));
    let pending = ui.part(|s| {
        let missing = s.progress.views_expected.saturating_sub(s.progress.views_done);
        // Views that are still to come get a place each, as far as the strip shows them anyway.
        if s.progress.phase == Phase::Running { missing.min(24) } else { 0 }
    });
    let list = NodeRef::<leptos::html::Ol>::new();
    // The buttons are in the page one frame after the state knows of them.
    let reveal_soon = move |selector: String| {
        request_animation_frame(move || {
            let button = list.get_untracked().and_then(|l| l.query_selector(&selector).ok().flatten());
            if let Some(button) = button {
                reveal(&button);
            }
        });
    };
    Effect::new(move |_| {
        if last.get().is_some() && selected.get_untracked().is_none() {
            reveal_soon("li:nth-last-child(1 of .view) button".into());
        }
    });
    let is_file = ui.part(|s| s.connection.is_file());
    Effect::new(move |_| {
        if let Some(index) = selected.get() {
            reveal_soon(format!("[data-testid=view-{index}]"));
        }
    });
    view! {
        <h2 class="visually-hidden">{t!("common.views")}</h2>
        <Show when=move || count.get() == 0 && pending.get() == 0>
            <p class="strip-empty"><Icon path=CAMERA/> {move || if is_file.get() { t!("views.of_file") } else { t!("views.empty") }}</p>
        </Show>
        <ol class="strip" node_ref=list>
            {move || earlier.get().map(|before| view! {
                <li class="view-earlier">
                    <button
                        class="button" type="button" data-testid="earlier-views"
                        title=t!("views.before", number = before + 1)
                        on:click=move |_| ui.ask(Command::EarlierViews(before))
                    >{t!("views.earlier")}</button>
                </li>
            })}
            {move || cut.get().then(|| view! {
                <li class="view-earlier" data-testid="views-cut">{t!("views.cut")}</li>
            })}
            <For
                each=move || views.get()
                key=|v| (v.index, v.accepted, v.thumbnail_jpeg.len(), v.overlay_png.len())
                let:view
            >
                <ViewCard ui view selected/>
            </For>
            {move || (0..pending.get()).map(|_| view! { <li class="view-pending" aria-hidden="true"></li> }).collect_view()}
        </ol>
    }
}

/// One view.
#[component]
fn ViewCard(ui: Ui, view: ViewEntry, selected: Memo<Option<u32>>) -> impl IntoView {
    let index = view.index;
    let is_selected = move || selected.get() == Some(index);
    let toggle = move |_| ui.send(Event::SelectView((!is_selected()).then_some(index)));
    let (accepted, reason) = (view.accepted, view.reason.clone());
    let (domain, doubt) = (view.domain, domain_doubt(view.domain).filter(|_| accepted));
    let title = match doubt {
        Some((_, sentence)) => t!("views.doubted", number = index + 1, doubt = sentence),
        None if accepted => t!("views.number", number = index + 1),
        None => t!("views.was_rejected", number = index + 1, reason = units::sentence(&reason)),
    };
    view! {
        <li class="view">
            <button
                class="view-button" class:is-rejected=!accepted type="button"
                data-testid=format!("view-{index}") data-accepted=accepted.to_string()
                data-domain=domain_name(domain)
                aria-pressed=move || is_selected().to_string() title=title
                on:click=toggle
            >
                <Picture view overlay=ViewOverlay::Labels alt=String::new()/>
                <span class="view-number"><span class="visually-hidden">{t!("common.view")} " "</span>{index + 1}</span>
                {doubt.map(|(words, _)| view! {
                    <span class="view-reason"><Icon path=WARNING/> <span>{words}</span></span>
                })}
                {(!accepted).then(|| view! {
                    <span class="view-reason"><Icon path=WARNING/> <span><span class="visually-hidden">{t!("progress.rejected")} ": "</span>{reason}</span></span>
                })}
            </button>
        </li>
    }
}

/// As the page's attribute names it.
fn domain_name(domain: Domain) -> &'static str {
    match domain {
        Domain::Unknown => "unknown",
        Domain::Outside => "outside",
        Domain::Inside => "inside",
        Domain::NoNetwork => "no-network",
    }
}

/// What is said of a view that is not known to be like those that the networks were trained for: in a few words, and in a
/// sentence.
fn domain_doubt(domain: Domain) -> Option<(&'static str, &'static str)> {
    match domain {
        Domain::Unknown => Some((t!("views.domain_unknown"), t!("views.domain_unknown.why"))),
        Domain::Outside => Some((t!("views.domain_outside"), t!("views.domain_outside.why"))),
        Domain::Inside | Domain::NoNetwork => None,
    }
}

/// Scrolls the strip, and nothing else, until the element is in sight.
fn reveal(element: &web_sys::Element) {
    let options = web_sys::ScrollIntoViewOptions::new();
    options.set_block(web_sys::ScrollLogicalPosition::Nearest);
    options.set_inline(web_sys::ScrollLogicalPosition::Nearest);
    element.scroll_into_view_with_scroll_into_view_options(&options);
}
