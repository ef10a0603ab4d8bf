//! The panels that are not a tool's, and where all panels are mounted. The page's skeleton is `www/index.html`; each panel
//! is mounted into one of its elements.
//!
//! # Names that tests rely on
//!
//! | selector | what |
//! |---|---|
//! | `#viewport` | the canvas; `data-backend` (`webgpu`, `webgl2`, `none`), `data-points`, `data-triangles`, `data-frames`, `data-hash` and `data-agent-hash` (16 hex digits), `data-phase`, `data-connection`, `data-inspection`, `data-resumed` (how often a lost connection was resumed by difference) |
//! | `[data-testid=connection]` | `data-state` = `connecting`, `connected`, `reconnecting`, `refused`, `file`, `recorded`, `broken` |
//! | `[data-testid=foreign-agent]` | the agent that is followed where it is not the page's own; `data-host` |
//! | `[data-testid=phase]` | the phase; `data-phase` as that of `progress` |
//! | `#failure` | what `www/boot.js` says when the viewer has stopped |
//! | `[data-testid=part]` | the part's name |
//! | `[data-testid=progress]` | `data-phase` = `unknown`, `waiting`, `running`, `finished`, `failed`, `interrupted` (the connection was lost meanwhile), `data-done`, `data-expected`, `data-rejected` |
//! | `[data-testid=stage-<stage>]` | timing of a stage; `data-last-us`, `data-mean-us` (absent until known) |
//! | `[data-testid=view-<i>]` | button of a view; `data-accepted` = `true`, `false`; `data-domain` = `inside`, `outside`, `unknown`, `no-network`; `aria-pressed` |
//! | `[data-testid=view-detail]` | the selected view at large |
//! | `[data-testid=overlay-<kind>]` | radio in it: `none`, `labels`, `sigma`, `contribution`, as far as there are any |
//! | `[data-testid=legend-row-<class>]` | row of component class number `<class>`; `data-class-name`, `data-points` (of the surface), `data-shown` (without hidden marks), `data-area-mm2` (absent until it is known), `data-confidence` |
//! | `[data-testid=export-note]` | what exports leave out; `data-points`, `data-held` |
//! | `[data-testid=legend-visible-<class>]`, `legend-only-<class>`, `legend-all` | its checkbox, its "only" button, "show all" |
//! | `[data-testid=color-mode-<mode>]` | radio: `appearance`, `component`, `confidence`, `views`, `defect`, `sigma` |
//! | `[data-testid=color-scale]` | the scale of the colour ramp, or the defect classes; in it `scale-unknown`, the colour of what is not known |
//! | `[data-testid=show-outliers]`, `show-background` | switches |
//! | `[data-testid=theme-toggle]`, `fit`, `copy-link`, `save-picture`, `help-open` | buttons |
//! | `[data-testid=help]`, `language-<code>` | the dialog of shortcuts; in it a button for each language |
//! | `[data-testid=show-points]`, `show-mesh` | radio: what the model is shown as; `show-mesh` makes the mesh where there is none |
//! | `[data-testid=mesh]` | the mesh's panel; `data-state` = `none`, `running`, `ready`; `data-triangles`, `data-outdated` |
//! | `[data-testid=mesh-progress]`, `mesh-cancel`, `mesh-update` | progress of the meshing; its cancel button; make an outdated mesh anew |
//! | `[data-testid=correct]` | corrections; `data-marks` (not signed), `data-earlier` (in the log); in it `correct-brush`, `correct-outline`, `correct-class`, `correct-width`, `correct-undo`, `correct-redo`, `correct-sign`; `teach-open`, `teach-<n>` (`data-done`), `teach-nothing` |
//! | `[data-testid=reference-file]`, `reference`, `reference-forget` | file input; what is compared with; its button |
//! | `[data-testid=reference-unit]`, `reference-unit-offer` | select: unit of the reference; button: take the unit that fits |
//! | `[data-testid=reference-mismatch]`, `reference-warnings` | why deviations mean nothing; what the reader had to say |
//! | `[data-testid=tolerance]` | number input, millimetres |
//! | `[data-testid=deviation]` | figures; `data-mean-mm`, `data-rms-mm`, `data-p95-mm` |
//! | `[data-testid=color-mode-deviation]` | radio, there with a reference |
//! | `[data-testid=export-mesh-ply]`, `export-mesh-obj`, `export-mesh-stl`, `export-mesh-glb` | buttons, there with a mesh |
//! | `[data-testid=export-ply]`, `export-glb` | buttons |
//! | `[data-testid=export-choice]`, `export-detail`, `export-unit`, `export-up`, `export-solids` | how mesh files are written |
//! | `[data-testid=inspect-card]` | what lies at the picked point; `data-component`, `data-x-mm`, `data-y-mm`, `data-z-mm`, `data-surface` (`points`, `mesh`) |
//! | `[data-testid=inspect-status]` | the same in a sentence, or that nothing lies there; a live region |
//! | `[data-testid=inspect-pin]`, `inspect-close` | its buttons |
//! | `[data-testid=picked-ring]`, `hover`, `label-<n>` | at the picked point, where the mouse rests, a pinned label; `data-behind`, of labels `data-occluded` |
//! | `[data-testid=other]` | where somebody else points; `data-place`, `data-color`, `data-behind`, `data-occluded` |
//! | `[data-testid=labels]`, `label-entry-<n>`, `labels-remove-all` | the list of the labels |
//! | `[data-testid=evidence-open]`, `evidence`, `evidence-close` | the offer of photographs, their card, its button |
//! | `[data-testid=evidence-picture]` | the photograph; `data-view`, `data-u`, `data-v` (the pixel), `data-full` = `true`, `false` once its pixels are there |
//! | `[data-testid=evidence-near]`, `evidence-whole`, `evidence-look`, `evidence-view`, `evidence-project`, `evidence-strength` | its controls |
//! | `[data-testid=review]`, `verdict`, `finding-<n>`, `finding-detail` | the findings; `data-unsent`; what counts; the rows; the chosen one |
//! | `[data-testid=ruling-<accept, rework, reject, comment>]`, `ruling-title`, `draft-form`, `draft-reason`, `draft-person`, `draft-sign`, `draft-cancel`, `unsent` | deciding |
//! | `[data-testid=measure]`, `measure-prompt` | the panel; `data-kind` = `none`, `distance`, `angle`; what to pick next |
//! | `[data-testid=measure-distance]`, `measure-angle`, `measure-unit-<mm, inch>` | toggle buttons; radios |
//! | `[data-testid=measurement-<n>]`, `measure-label-<n>` | a measurement: `data-mm` or `data-degrees`, `data-uncertainty` (k = 2); its figure in the view |
//! | `[data-testid=measure-copy]`, `measure-remove-all` | buttons |
//! | `[data-testid=measure-keep-form]`, `measure-keep-reason`, `measure-keep-person`, `measure-keep-sign` | keeping measurements with the inspection |
//! | `[data-testid=kept-<n>]`, `kept-label-<review>`, `measure-kept`, `measure-withdraw-form` | what is kept; its figure in the view; whether that is shown; withdrawing one |
//! | `[data-testid=section]` | the panel; `data-state` = `off`, `waiting` (for a mesh), `cut`; `data-closed`, `data-open` (outlines) |
//! | `[data-testid=section-plane]`, `section-box`, `section-reset` | switches, a button |
//! | `[data-testid=section-<x, y, z>]`, `section-camera`, `section-surface` | radios, buttons: what the plane lies across |
//! | `[data-testid=section-slider]`, `section-offset`, `section-flip` | its offset as a slider and as a number; its side |
//! | `[data-testid=section-summary]`, `section-figures` | what was cut; `data-length-mm`, `data-area-mm2` |
//! | `[data-testid=section-svg]`, `section-dxf` | buttons |
//! | `[data-testid=section-read]`, `section-prompt`, `section-status`, `section-reading-<n>`, `section-label-<n>` | reading thicknesses; a reading: `data-mm`, `data-kind`; its figure in the view (0: at the pointer) |
//! | `[data-testid=section-<x, y, z>-<from, to>]`, with `-slider` | the ends of the box |
//! | `[data-testid=timeline]` | the timeline; `data-at`, `data-stops`; in it `timeline-load`, `timeline-place`, `timeline-slider`, `timeline-back`, `timeline-play`, `timeline-on`, `timeline-close` |
//! | `[data-testid=export-inspection]`, `export-inspection-full` | the inspection as a file, the latter with photographs |
//! | `[data-testid=palette]`, `palette-open`, `palette-field`, `palette-entry` | the command palette, its button, its field, what it finds |
//! | `[data-testid=open-file]`, `close-file` | the field that files are chosen with; back to the agent |
//! | `[data-testid=notice]` | a message; `data-level` = `info`, `warning`, `error` |
//! | `[data-testid=banner]` | a lost connection, or a model that is not the agent's, over a model on screen |
//! | `[data-testid=viewport-message]` | what stands in place of the model; `data-state` |
//! | `#status` | the live region |

#![allow(unreachable_pub)] // The component macro makes a public structure of each panel's properties.

mod display;
mod export;
mod header;
mod help;
mod key_name;
mod legend;
mod notices;
mod overlay;
mod palette;
mod picture;
mod progress;
mod view_detail;
mod views;

use crate::features::mounted;
use crate::state::AppState;
use crate::ui::Ui;
use leptos::mount::mount_to;
use leptos::prelude::*;
use wasm_bindgen::{JsCast, JsValue};
use web_sys::{Document, HtmlElement};

/// Mounts every panel into the page's skeleton.
///
/// # Errors
/// A missing element of the skeleton, by its id.
pub(in crate::shell) fn mount(document: &Document, ui: Ui) -> Result<(), JsValue> {
    let place = |id: &str| -> Result<HtmlElement, JsValue> {
        let element =
            document.get_element_by_id(id).ok_or_else(|| JsValue::from_str(&format!("the page has no #{id}")))?;
        element.set_text_content(None);
        Ok(element.unchecked_into())
    };
    mount_to(place("header")?, move || view! { <header::Header ui/> }).forget();
    mount_to(place("overlay")?, move || view! { <overlay::Overlay ui/> <view_detail::ViewDetail ui/> }).forget();
    mount_to(place("views")?, move || view! { <views::ViewStrip ui/> }).forget();
    mount_to(place("panels")?, move || {
        view! {
            <progress::ProgressPanel ui/>
            <legend::LegendPanel ui/>
            {mounted::panels(ui)}
            <display::DisplayPanel ui/>
            <export::ExportPanel ui/>
        }
    })
    .forget();
    mount_to(place("help")?, move || view! { <help::Help ui/> <palette::Palette ui/> }).forget();
    mount_to(place("notices")?, move || view! { <notices::NoticeList ui/> }).forget();
    let status = ui.part(AppState::status);
    mount_to(place("status")?, move || move || status.get()).forget();
    Ok(())
}
