//! The header: what is inspected, whether the link stands, theme and help.

use crate::display::ColorScheme;
use crate::features::tour::TourEvent;
use crate::shell::action::FILE_FIELD;
use crate::state::connection::Connection;
use crate::state::{Event, units};
use crate::ui::icons::{CLOSE, HELP, Icon, OPEN, SEARCH, THEME, UNLINKED};
use crate::ui::{Command, Ui};
use crate::words::t;
use leptos::prelude::*;
use wasm_bindgen::JsCast;
use web_sys::HtmlInputElement;

/// What can be chosen: inspections, models, and the files that these name.
const ACCEPT: &str = ".semascan,.ply,.glb,.gltf,.obj,.stl,.pcd,.mtl,.bin,.png,.jpg,.jpeg,.webp";

/// Brand, part, connection, buttons.
#[component]
pub(super) fn Header(ui: Ui) -> impl IntoView {
    let part = ui.part(|s| s.inspection.part.clone());
    let source = ui.part(|s| s.inspection.source.clone());
    let foreign = ui.part(|s| s.foreign_agent.clone());
    let is_offered = ui.part(|s| s.features.tour.is_offered && s.has_model());
    let dark = ui.part(|s| s.display.color_scheme() == ColorScheme::Dark);
    let is_file = ui.part(|s| s.connection.is_file() && !s.connection.is_recorded());
    let take_file = move |event: web_sys::Event| {
        let Some(input) = event.target().and_then(|t| t.dyn_into::<HtmlInputElement>().ok()) else { return };
        if let Some(files) = input.files() {
            ui.ask(Command::OpenFiles(files));
        }
        // The same file may be chosen again.
        input.set_value("");
    };
    let toggle = move |_| ui.send(Event::Theme(ui.read(|s| s.display.toggled_theme())));
    view! {
        <a class="brand" href="./" aria-label="Semascan">
            <svg class="brand-mark" viewBox="0 0 24 24" aria-hidden="true" focusable="false">
                <path d="M12 2.5 20.2 7.2v9.6L12 21.5 3.8 16.8V7.2z"></path>
                <circle cx="12" cy="12" r="3.4"></circle>
            </svg>
            <span class="brand-name">"Semascan"</span>
        </a>
        <div class="subject">
            <h1 class="subject-part" data-testid="part">
                {move || Some(part.get()).filter(|p| !p.is_empty()).unwrap_or_else(|| t!("header.no_part").into())}
            </h1>
            {move || foreign.get().map(|name| (name.clone(), name)).map(|(host, name)| view! {
                <p
                    class="foreign" data-testid="foreign-agent" data-host=host
                    title=t!("header.foreign")
                >
                    <Icon path=UNLINKED/> <span>{t!("header.model_of")} <strong>{name}</strong></span>
                </p>
            })}
            <p class="subject-source" title=move || source.get()>{move || source.get()}</p>
        </div>
        <ConnectionStatus ui/>
        <Show when=move || is_offered.get()>
            <span class="tour-offer" data-testid="tour-offer">
                <button class="text-button" type="button" data-testid="tour-begin" on:click=move |_| ui.send_feature(TourEvent::Begin)>
                    {t!("tour.offer")}
                </button>
                <button
                    class="tool" type="button" aria-label=t!("tour.not_now") title=t!("tour.not_now")
                    on:click=move |_| ui.send_feature(TourEvent::End)
                >
                    <Icon path=CLOSE/>
                </button>
            </span>
        </Show>
        <Show when=move || is_file.get()>
            <button class="text-button" type="button" data-testid="close-file" on:click=move |_| ui.ask(Command::Reload)>
                {t!("header.close_file")}
            </button>
        </Show>
        <button
            class="tool palette-open" type="button" data-testid="palette-open" aria-label=t!("palette.title") title=t!("header.palette")
            on:click=move |_| ui.send(Event::Palette(true))
        >
            <Icon path=SEARCH/>
        </button>
        <label class="tool file-button" title=t!("header.open")>
            <input
                id=FILE_FIELD class="visually-hidden" type="file" multiple=true accept=ACCEPT data-testid="open-file"
                aria-label=t!("command.open") on:change=take_file
            />
            <Icon path=OPEN/>
        </label>
        <button
            class="tool" type="button" data-testid="theme-toggle"
            aria-label=move || if dark.get() { t!("header.to_light") } else { t!("header.to_dark") }
            title=move || if dark.get() { t!("header.light") } else { t!("header.dark") }
            on:click=toggle
        >
            <Icon path=THEME/>
        </button>
        <button
            class="tool" type="button" data-testid="help-open" aria-label=t!("header.help")
            title=t!("header.help.title") on:click=move |_| ui.send(Event::Help(true))
        >
            <Icon path=HELP/>
        </button>
    }
}

/// Where the connection stands.
#[component]
fn ConnectionStatus(ui: Ui) -> impl IntoView {
    let connection = ui.part(|s| s.connection.clone());
    let agent = ui.part(|s| match &s.connection {
        Connection::Connected { agent } => t!("header.connected", agent),
        Connection::Reconnecting { reason, .. } | Connection::Refused { reason } | Connection::Broken { reason } => {
            units::sentence(reason)
        }
        Connection::File { name } => t!("header.file", name),
        Connection::Recorded => t!("header.recorded").into(),
        Connection::Connecting { .. } => String::new(),
    });
    view! {
        <p class="link" data-testid="connection" data-state=move || connection.get().key() title=move || agent.get()>
            <span class="link-dot" aria-hidden="true"></span>
            <span class="link-label">{move || connection.get().label()}</span>
        </p>
    }
}
