//! What is kept with the inspection: signing measurements of the list, those that people kept, and withdrawing one.

#![allow(unreachable_pub)] // The component macro makes a public structure of the properties.

use super::{MeasureEvent, Picking, kept};
use crate::features::review::{Reason, ReviewEvent, Signature, Signed, new_name};
use crate::state::AppState;
use crate::ui::Ui;
use crate::ui::icons::{CLOSE, Icon};
use crate::words::t;
use leptos::prelude::*;
use semascan_model::measurement::KeptMeasurement;
use semascan_model::review::{ReviewAction, ReviewId};

/// See the module.
#[component]
pub(super) fn Kept(ui: Ui) -> impl IntoView {
    let may = ui.part(|s| s.may_review() && s.features.review.is_open());
    let loose = ui.part(|s| s.features.measure.loose().count());
    let all = ui.part(|s| s.features.measure.kept.clone());
    let shows = ui.part(|s| s.features.measure.shows_kept);
    let withdrawing = ui.part(|s| {
        let measure = &s.features.measure;
        let place = measure.kept.iter().position(|kept| measure.withdrawing == Some(kept.review))?;
        Some((place, measure.kept[place].review))
    });
    let button = Signal::derive(move || t!("measure.keep", count = loose.get()));
    view! {
        <Show when=move || may.get() && loose.get() != 0>
            <Signature
                ui id="measure-keep" label=t!("measure.keep.label").to_owned() because=t!("measure.keep.note").to_owned()
                reason=Reason::Free button is_ready=true on_sign=UnsyncCallback::new(move |signed| keep(ui, &signed))
            />
        </Show>
        <Show when=move || !all.get().is_empty()>
            <label class="switch-row">
                <span>{move || t!("measure.kept", count = all.get().len())}</span>
                <input
                    class="switch" type="checkbox" role="switch" data-testid="measure-kept" prop:checked=move || shows.get()
                    on:change=move |e| ui.send_feature(MeasureEvent::ShowKept(event_target_checked(&e)))
                />
            </label>
            <Show when=move || shows.get()>
                <ul class="entries" aria-label=t!("measure.kept.list")>
                    <For each=move || all.get().into_iter().enumerate() key=|(i, kept)| (*i, kept.review, kept.is_of_earlier_model) let((i, kept))>
                        <Entry ui number={i + 1} kept/>
                    </For>
                </ul>
            </Show>
        </Show>
        {move || withdrawing.get().filter(|_| may.get()).map(|(place, review)| {
            let because = t!("measure.withdraw.because", number = place + 1);
            view! {
                <Signature
                    ui id="measure-withdraw" label=because.clone() because reason=Reason::Needed button=t!("common.sign").to_owned() is_ready=true
                    on_sign=UnsyncCallback::new(move |signed| {
                        send(ui, ReviewAction::Withdraw { review }, &signed);
                        ui.send_feature(MeasureEvent::Withdraw(None));
                    })
                    on_cancel=UnsyncCallback::new(move |()| ui.send_feature(MeasureEvent::Withdraw(None)))
                />
            }
        })}
    }
}

#[component]
fn Entry(ui: Ui, number: usize, kept: KeptMeasurement) -> impl IntoView {
    let unit = ui.part(|s| s.features.measure.unit);
    let may = ui.part(AppState::may_review);
    let (review, kind) = (kept.review, kept.measurement.kind);
    let name = (!kept::is_plain(kind)).then(|| format!("{}, ", kind.name_within()));
    let earlier = kept.is_of_earlier_model.then_some(t!("measure.kept.earlier"));
    let (person, note) = (kept.person, (!kept.note.is_empty()).then(|| format!(": {}", kept.note)));
    let measurement = kept.measurement;
    view! {
        <li class="entry" data-testid=format!("kept-{number}") data-kind=kind.key() data-review=review.to_string()>
            <span class="entry-number">{number}</span>
            <span class="entry-text">
                <span class="visually-hidden">{kind.name()} " "</span>
                {move || kept::value_and_uncertainty(&measurement, unit.get())}
                <small>{name} {earlier} {person} {note}</small>
            </span>
            <Show when=move || may.get()>
                <button
                    class="tool" type="button" aria-label=t!("measure.withdraw", number)
                    title=t!("measure.withdraw.title")
                    on:click=move |_| ui.send_feature(MeasureEvent::Withdraw(Some(review)))
                >
                    <Icon path=CLOSE/>
                </button>
            </Show>
        </li>
    }
}

/// Keeps what is in the list and not kept yet.
fn keep(ui: Ui, signed: &Signed) {
    let records: Vec<_> =
        ui.read(|s| s.features.measure.loose().filter_map(|m| Some((m.number, kept::record(m)?))).collect());
    let mut reviews = Vec::new();
    for (number, record) in records {
        let review = send(ui, ReviewAction::Measure { measurement: Box::new(record) }, signed);
        reviews.push((number, review));
    }
    ui.send_feature(MeasureEvent::Kept(reviews));
}

/// Sends what is done with the part; gives the name of the review.
fn send(ui: Ui, action: ReviewAction, signed: &Signed) -> ReviewId {
    let id = new_name();
    let unsent = ui.read(|s| s.features.review.case.unsent(id, action, &signed.person, &signed.reason));
    ui.send_feature(ReviewEvent::Decided(Box::new(unsent)));
    id
}
