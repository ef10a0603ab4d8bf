//! What lies over the 3D view: the colour modes, the scale that says what a colour means, the button that fits the
//! model into view, and what stands there when there is no model to see.

use crate::camera::CameraInput;
use crate::display::color_ramp::{UNKNOWN, css_gradient};
use crate::display::{ColorMode, css_color};
use crate::features::mounted;
use crate::state::color_key::ColorKey;
use crate::state::connection::{Connection, GraphicsStatus};
use crate::state::{AppState, Event, units};
use crate::ui::icons::{DOWNLOAD, FIT, Icon, LINK, MODEL, UNLINKED, WARNING};
use crate::ui::{Command, Ui};
use crate::words::t;
use leptos::prelude::*;
use semascan_model::ClassDef;
use semascan_protocol::Phase;

/// Everything over the canvas.
#[component]
pub(super) fn Overlay(ui: Ui) -> impl IntoView {
    view! {
        <div class="overlay-top">
            <ColorModes ui/>
            <div class="tools">
                <button
                    class="tool is-raised" type="button" data-testid="copy-link" aria-label=t!("command.link")
                    title=t!("overlay.link") on:click=move |_| ui.ask(Command::CopyLink)
                >
                    <Icon path=LINK/>
                </button>
                <button
                    class="tool is-raised" type="button" data-testid="save-picture" aria-label=t!("overlay.save")
                    title=t!("overlay.save.title") on:click=move |_| ui.ask(Command::SavePicture)
                >
                    <Icon path=DOWNLOAD/>
                </button>
                <button
                    class="tool is-raised" type="button" data-testid="fit" aria-label=t!("command.fit")
                    title=t!("overlay.fit") on:click=move |_| ui.ask(Command::Camera(CameraInput::Fit))
                >
                    <Icon path=FIT/>
                </button>
            </div>
        </div>
        <LinkBanner ui/>
        <Message ui/>
        <ColorScale ui/>
        {mounted::overlays(ui)}
    }
}

/// What the colours mean: one of those that the model has.
#[component]
fn ColorModes(ui: Ui) -> impl IntoView {
    let mode = ui.part(|s| s.display.color_mode);
    let has_reference = ui.part(|s| s.display.has_reference);
    let modes = ui.part(AppState::color_modes);
    let choice = move |option: ColorMode| {
        view! {
            <label class="segment" title=option.explanation()>
                <input
                    type="radio" name="color-mode" value=option.key()
                    data-testid=format!("color-mode-{}", option.key())
                    prop:checked=move || mode.get() == option
                    on:change=move |_| ui.send(Event::ColorMode(option))
                />
                <span>{option.label()}</span>
            </label>
        }
    };
    view! {
        <fieldset class="segments is-raised" data-testid="color-modes">
            <legend class="visually-hidden">{t!("overlay.color_by")}</legend>
            <For each=move || modes.get() key=|mode| mode.key() children=choice/>
            <Show when=move || has_reference.get()>{choice(ColorMode::Deviation)}</Show>
        </fieldset>
    }
}

/// The scale of the ramp, or the defect classes. What is said of deviations and photographs is their tools'; components are in the
/// legend.
#[component]
fn ColorScale(ui: Ui) -> impl IntoView {
    let key = ui.part(|s| {
        let is_elsewhere =
            matches!(s.display.color_mode, ColorMode::Component | ColorMode::Deviation | ColorMode::Photo);
        Some(ColorKey::of(s)).filter(|_| !is_elsewhere)
    });
    let has_model = ui.part(AppState::has_model);
    // What is not known has a colour that is on no ramp, and the legend says which and why.
    let unknown = |(what, why): (&'static str, &'static str)| {
        view! {
            <p class="scale-unknown" data-testid="scale-unknown">
                <span class="scale-dot" style:background-color=css_color(UNKNOWN)></span>
                <span>{what} <span class="scale-why">{format!(" {why}")}</span></span>
            </p>
        }
    };
    let class = |class: ClassDef| {
        view! {
            <li>
                <span class="scale-dot" style:background-color=css_color(class.color)></span>
                {class.name}
            </li>
        }
    };
    move || match key.get() {
        None | Some(ColorKey::Appearance | ColorKey::Photographs) => ().into_any(),
        Some(ColorKey::Nothing { .. }) if !has_model.get() => ().into_any(),
        Some(ColorKey::Nothing { title, unknown: why }) => view! {
            <figure class="scale is-raised" data-testid="color-scale">
                <figcaption>{title}</figcaption>
                {unknown(why)}
            </figure>
        }
        .into_any(),
        Some(ColorKey::Ramp { title, ticks, unknown: why }) => view! {
            <figure class="scale is-raised" data-testid="color-scale">
                <figcaption>{title}</figcaption>
                <div class="scale-ramp" aria-hidden="true" style:background-image=css_gradient()></div>
                <div class="scale-ticks">{ticks.into_iter().map(|t| view! { <span>{t}</span> }).collect_view()}</div>
                {why.map(unknown)}
            </figure>
        }
        .into_any(),
        Some(ColorKey::Classes { title, classes }) => {
            let none = classes.is_empty().then(|| view! { <li>{t!("overlay.no_defects")}</li> });
            view! {
                <figure class="scale is-raised" data-testid="color-scale">
                    <figcaption>{title}</figcaption>
                    <ul class="scale-classes">{classes.into_iter().map(class).collect_view()} {none}</ul>
                </figure>
            }
            .into_any()
        }
    }
}

/// Says that what is seen is not live, or not whole, while there is a model to be seen.
#[component]
fn LinkBanner(ui: Ui) -> impl IntoView {
    let text = ui.part(|s| match &s.connection {
        _ if !s.has_model() => None,
        Connection::Reconnecting { reason, .. } => Some(t!("banner.lost", reason = units::sentence(reason))),
        Connection::Refused { reason } => Some(t!("connection.was_refused", reason = units::sentence(reason))),
        Connection::Broken { reason } => Some(t!("banner.broken", reason = units::sentence(reason))),
        _ if s.is_cut => {
            // Points are counted with a frame, and the agent may not have said yet how many there are.
            let here = match (s.legend.held_points(), s.progress.points) {
                (held, all) if held > 0 && all > held => {
                    t!("banner.here", held = units::count(held), all = units::count(all))
                }
                _ => String::new(),
            };
            Some(t!("banner.cut", here))
        }
        _ if s.halvings > 0 => {
            let (held, step) = (units::count(s.legend.held_points()), 1_u32 << s.halvings.min(31));
            Some(t!("banner.thinned", step, held))
        }
        _ if s.model_differs() => Some(t!("banner.differs").into()),
        _ => None,
    });
    move || {
        text.get().map(|text| {
            view! {
                <p class="banner is-raised" data-testid="banner"><Icon path=UNLINKED/> <span>{text}</span></p>
            }
        })
    }
}

/// What stands in the place of the model.
#[derive(Clone, PartialEq)]
struct Empty {
    key: &'static str,
    icon: &'static str,
    title: &'static str,
    text: String,
    busy: bool,
    reload: bool,
}

impl Empty {
    fn new(key: &'static str, icon: &'static str, title: &'static str, text: impl Into<String>) -> Self {
        Self { key, icon, title, text: text.into(), busy: false, reload: false }
    }

    /// The most important thing that keeps the model from being seen, if anything does.
    fn of(state: &AppState) -> Option<Self> {
        if let GraphicsStatus::Unavailable { reason } = &state.graphics {
            let text = t!("empty.gpu.text", reason);
            return Some(Self { reload: true, ..Self::new("gpu", WARNING, t!("empty.gpu"), text) });
        }
        if state.has_model() {
            return None;
        }
        Some(match (&state.connection, state.progress.phase) {
            (Connection::Connecting { .. }, _) => Self {
                busy: true,
                ..Self::new("connecting", UNLINKED, t!("empty.connecting"), t!("empty.connecting.text"))
            },
            (Connection::Reconnecting { reason, .. }, _) => {
                let text = t!("empty.reconnecting.text", reason = units::sentence(reason));
                Self { busy: true, ..Self::new("reconnecting", UNLINKED, t!("empty.reconnecting"), text) }
            }
            _ if state.features.timeline.is_open() => {
                Self::new("before", MODEL, t!("timeline.before"), t!("timeline.before.text"))
            }
            (Connection::File { name }, _) => {
                Self { busy: true, ..Self::new("opening", MODEL, t!("empty.opening"), t!("empty.opening.text", name)) }
            }
            (Connection::Refused { reason }, _) => {
                Self { reload: true, ..Self::new("refused", WARNING, t!("empty.refused"), units::sentence(reason)) }
            }
            (Connection::Broken { reason }, _) => {
                Self { reload: true, ..Self::new("broken", WARNING, t!("empty.broken"), units::sentence(reason)) }
            }
            (_, Phase::Failed) => {
                let why = Some(state.progress.message.as_str()).filter(|m| !m.is_empty());
                Self::new(
                    "failed",
                    WARNING,
                    t!("empty.failed"),
                    units::sentence(why.unwrap_or(t!("empty.failed.text"))),
                )
            }
            (_, Phase::Finished) => Self::new("finished", MODEL, t!("empty.finished"), t!("empty.finished.text")),
            (_, Phase::Running) => {
                Self { busy: true, ..Self::new("running", MODEL, t!("empty.running"), t!("empty.running.text")) }
            }
            (_, Phase::Waiting | Phase::Unspecified) => {
                Self::new("waiting", MODEL, t!("empty.waiting"), t!("empty.waiting.text"))
            }
        })
    }
}

#[component]
fn Message(ui: Ui) -> impl IntoView {
    let empty = ui.part(Empty::of);
    move || {
        empty.get().map(|Empty { key, icon, title, text, busy, reload }| {
            view! {
                <div class="message is-raised" data-testid="viewport-message" data-state=key>
                    <span class="message-icon" class:is-busy=busy><Icon path=icon/></span>
                    <h2>{title}</h2>
                    <p>{text}</p>
                    {reload.then(|| view! {
                        <button class="button" type="button" on:click=move |_| ui.ask(Command::Reload)>{t!("common.reload")}</button>
                    })}
                </div>
            }
        })
    }
}
