//! The panel of the corrections: tool, class and width, what is drawn, and its signing.

use super::controller::CorrectController;
use super::overlay::Loop;
use super::teaching_list::TeachingList;
use super::{Correct, CorrectEvent, Naming, Tool};
use crate::features::review::{Reason, ReviewEvent, Signature, Signed, Unsent, new_name};
use crate::features::view::{Controller, FeatureView, Host};
use crate::ui::Ui;
use crate::words::{localized, t};
use leptos::prelude::*;
use semascan_model::ClassDef;
use std::rc::Rc;

impl FeatureView for Correct {
    fn panel(ui: Ui) -> AnyView {
        view! { <CorrectPanel ui/> }.into_any()
    }

    fn overlay(ui: Ui) -> AnyView {
        view! { <Loop ui/> }.into_any()
    }

    fn controller(host: &Host) -> Option<Rc<dyn Controller>> {
        Some(CorrectController::new(host))
    }
}

#[component]
fn CorrectPanel(ui: Ui) -> impl IntoView {
    let may = ui.part(|s| s.may_review() && s.features.review.is_open());
    let tool = ui.part(|s| s.features.correct.tool);
    let prompt = ui.part(|s| s.features.correct.prompt());
    let marks = ui.part(|s| s.features.correct.drawn().count());
    let can_redo = ui.part(|s| s.features.correct.can_redo());
    let earlier = ui.part(|s| s.features.correct.earlier.actions.len());
    let shows_earlier = ui.part(|s| s.features.correct.shows_earlier);
    let can_close = ui.part(|s| {
        let correct = &s.features.correct;
        correct.marks.last().is_some_and(|m| m.is_open && m.tool == Tool::Outline && m.points.len() >= 3)
    });
    let choice = move |option: Tool| {
        let is_chosen = move || tool.get() == Some(option);
        view! {
            <button
                class="button" type="button" title=option.title() data-testid=format!("correct-{}", option.key())
                aria-pressed=move || is_chosen().to_string()
                on:click=move |_| ui.send_feature(CorrectEvent::Choose((!is_chosen()).then_some(option)))
            >
                {option.label()}
            </button>
        }
    };
    let act =
        move |event: CorrectEvent, id: &'static str, title: &'static str, label: &'static str, is_on: Signal<bool>| {
            view! {
                <button
                    class="text-button" type="button" data-testid=id title=title prop:disabled=move || !is_on.get()
                    on:click=move |_| ui.send_feature(event.clone())
                >
                    {label}
                </button>
            }
        };
    let has_marks = Signal::derive(move || marks.get() != 0);
    view! {
        <Show when=move || may.get()>
            <section
                class="panel" aria-labelledby="correct-title" data-testid="correct"
                data-marks=move || marks.get().to_string() data-earlier=move || earlier.get().to_string()
            >
                <header class="panel-head"><h2 id="correct-title">{t!("correct.panel")}</h2></header>
                <div class="buttons">{Tool::ALL.into_iter().map(choice).collect_view()}</div>
                <Show when=move || tool.get().is_some()>
                    <ClassChoice ui/>
                    <Show when=move || tool.get() == Some(Tool::Brush)><Width ui/></Show>
                    <p class="empty" role="status" data-testid="correct-prompt">{move || prompt.get()}</p>
                    <Show when=move || can_close.get()>
                        <button
                            class="button" type="button" data-testid="correct-close"
                            on:click=move |_| ui.send_feature(CorrectEvent::Close)
                        >
                            {t!("correct.close")}
                        </button>
                    </Show>
                </Show>
                <Show when=move || has_marks.get() || can_redo.get()>
                    <div class="row-actions">
                        {act(CorrectEvent::Undo, "correct-undo", t!("correct.undo.title"), t!("correct.undo"), has_marks)}
                        {act(CorrectEvent::Redo, "correct-redo", t!("correct.redo.title"), t!("correct.redo"), can_redo.into())}
                        {act(CorrectEvent::Discard, "correct-discard", t!("correct.discard.title"), t!("correct.discard"), has_marks)}
                    </div>
                </Show>
                <Show when=move || has_marks.get()><SignForm ui/></Show>
                <TeachingList ui/>
                <Show when=move || earlier.get() != 0>
                    <label class="switch-row">
                        <span>{move || t!("correct.earlier", count = earlier.get())}</span>
                        <input
                            class="switch" type="checkbox" role="switch" data-testid="correct-earlier"
                            prop:checked=move || shows_earlier.get()
                            on:change=move |e| ui.send_feature(CorrectEvent::ShowEarlier(event_target_checked(&e)))
                        />
                    </label>
                </Show>
            </section>
        </Show>
    }
}

/// What the tool in hand says of the surface.
#[component]
fn ClassChoice(ui: Ui) -> impl IntoView {
    let tool = ui.part(|s| s.features.correct.tool);
    let classes = ui.part(|s| {
        let components: Vec<ClassDef> = s.legend.rows.iter().map(|row| row.class.clone()).collect();
        (components, s.legend.defects.clone())
    });
    let chosen = ui.part(|s| s.features.correct.naming().key());
    let options = move |of: &[ClassDef], make: fn(u16) -> Naming, none: &'static str| {
        let option = |class: &ClassDef| {
            let name = if class.id == 0 { none.to_owned() } else { class.name.clone() };
            (make(class.id).key(), name)
        };
        let list: Vec<_> = of.iter().map(option).collect();
        list.into_iter()
            .map(|(key, name)| {
                let value = key.clone();
                view! { <option value=value prop:selected=move || chosen.get() == key>{name}</option> }
            })
            .collect_view()
    };
    view! {
        <label class="field-row">
            <span>{move || if tool.get() == Some(Tool::Outline) { t!("correct.it_is") } else { t!("correct.surface_is") }}</span>
            <select
                data-testid="correct-class"
                on:change=move |e| {
                    if let Some(naming) = Naming::from_key(&event_target_value(&e)) {
                        ui.send_feature(CorrectEvent::Name(naming));
                    }
                }
            >
                {move || {
                    let (components, defects) = classes.get();
                    match tool.get() {
                        Some(Tool::Outline) => options(&defects, Naming::Defect, t!("correct.unnamed")).into_any(),
                        _ => view! {
                            <optgroup label=t!("common.defect")>{options(&defects, Naming::Defect, t!("correct.sound"))}</optgroup>
                            <optgroup label=t!("common.component")>{options(&components, Naming::Component, t!("correct.no_component"))}</optgroup>
                        }
                        .into_any(),
                    }
                }}
            </select>
        </label>
    }
}

/// How wide the brush paints.
#[component]
fn Width(ui: Ui) -> impl IntoView {
    let width = ui.part(|s| 2e3 * s.features.correct.radius);
    let step = move |by: i32, id: &'static str, name: &'static str, sign: &'static str| {
        view! {
            <button
                class="tool" type="button" data-testid=id aria-label=name title=name
                on:click=move |_| ui.send_feature(CorrectEvent::Step(by))
            >
                {sign}
            </button>
        }
    };
    view! {
        <div class="field-row">
            <span>{t!("correct.width")}</span>
            {step(-1, "correct-narrower", t!("correct.narrower"), "−")}
            <output data-testid="correct-width">{move || format!("{} mm", localized(&width.get().to_string()))}</output>
            {step(1, "correct-wider", t!("correct.wider"), "+")}
        </div>
    }
}

/// The name under the marks, and why, as far as that is said.
#[component]
fn SignForm(ui: Ui) -> impl IntoView {
    let whole = ui.part(|s| s.features.correct.marks.iter().filter(|mark| mark.is_whole()).count());
    let button = Signal::derive(move || t!("correct.sign", count = whole.get()));
    view! {
        <Signature
            ui id="correct" label=t!("correct.sign.label").to_owned() because=t!("common.because").to_owned() reason=Reason::Free button
            is_ready=Signal::derive(move || whole.get() != 0) on_sign=UnsyncCallback::new(move |signed| sign(ui, &signed))
        />
    }
}

/// Sends the marks as reviews.
fn sign(ui: Ui, signed: &Signed) {
    let reviews: Vec<Unsent> = ui.read(|s| {
        let (case, defects) = (&s.features.review.case, &s.legend.defects);
        let components: Vec<ClassDef> = s.legend.rows.iter().map(|row| row.class.clone()).collect();
        let actions = s.features.correct.marks.iter().filter_map(|mark| mark.action(&components, defects));
        actions.map(|action| case.unsent(new_name(), action, &signed.person, &signed.reason)).collect()
    });
    for unsent in reviews {
        ui.send_feature(ReviewEvent::Decided(Box::new(unsent)));
    }
    ui.send_feature(CorrectEvent::Signed);
}
