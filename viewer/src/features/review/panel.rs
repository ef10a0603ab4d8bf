//! The panel of the findings: the list, the chosen finding with the criteria behind it, and the form of a decision.

use super::controller::ReviewController;
use super::{Draft, Reason, Review, ReviewEvent, Ruling, Signature, Signed, Standing, Unsent, new_name, words};
use crate::features::view::{Controller, FeatureView, Host};
use crate::state::AppState;
use crate::ui::Ui;
use crate::words::t;
use leptos::prelude::*;
use semascan_model::finding::FindingKind;
use semascan_model::review::Subject;
use semascan_model::verdict::Decision;
use std::rc::Rc;

/// Findings that the list shows until all are asked for: the panels below stay in sight.
const FEW: usize = 5;

impl FeatureView for Review {
    fn panel(ui: Ui) -> AnyView {
        view! { <ReviewPanel ui/> }.into_any()
    }

    fn controller(host: &Host) -> Option<Rc<dyn Controller>> {
        Some(ReviewController::new(host))
    }
}

#[component]
fn ReviewPanel(ui: Ui) -> impl IntoView {
    let is_shown = ui.part(|s| s.features.review.standing != Standing::Nothing || s.features.review.is_open());
    let decision = ui.part(|s| s.features.review.case.decision);
    let failed = ui.part(|s| match &s.features.review.standing {
        Standing::Unknown(reason) => Some(reason.clone()),
        _ => None,
    });
    let unsent = ui.part(|s| s.features.review.unsent.len());
    view! {
        <Show when=move || is_shown.get() || unsent.get() != 0>
            <section class="panel" aria-labelledby="review-title" data-testid="review" data-unsent=move || unsent.get().to_string()>
                <header class="panel-head">
                    <h2 id="review-title">{t!("review.panel")}</h2>
                    {move || decision.get().map(|decision| view! { <Badge decision testid="verdict"/> })}
                </header>
                {move || failed.get().map(|reason| view! { <p class="empty">{t!("review.not_said", reason)}</p> })}
                <List ui/>
                <Chosen ui/>
                <Rulings ui/>
                <DraftForm ui/>
                <Show when=move || unsent.get() != 0>
                    <p class="empty" role="status" data-testid="unsent">
                        {move || t!("review.waiting", count = unsent.get())}
                    </p>
                </Show>
            </section>
        </Show>
    }
}

/// A decision as a coloured word.
#[component]
fn Badge(decision: Decision, #[prop(optional)] testid: Option<&'static str>) -> impl IntoView {
    view! {
        <span class="decision" data-decision=decision.name() data-testid=testid>{words::decision(decision)}</span>
    }
}

#[component]
fn List(ui: Ui) -> impl IntoView {
    let rows = ui.part(|s| {
        let case = &s.features.review.case;
        let row = |(i, finding): (usize, &semascan_model::finding::Finding)| {
            let decision = case.decided(finding.id).or(case.follows(finding.id));
            let is_decided = case.decided(finding.id).is_some();
            (
                i,
                finding.id,
                words::finding(finding),
                words::area(finding),
                decision,
                is_decided,
                case.is_contested(finding.id),
            )
        };
        case.findings().iter().enumerate().map(row).collect::<Vec<_>>()
    });
    let selected = ui.part(|s| s.features.review.selected);
    let shows_all = RwSignal::new(false);
    // Whoever goes on by keyboard sees where they are.
    let is_short = move || {
        let chosen = rows.with(|rows| rows.iter().position(|row| selected.get() == Some(row.1)));
        !shows_all.get() && chosen.is_none_or(|place| place < FEW)
    };
    let nothing = ui.part(|s| {
        let review = &s.features.review;
        match (&review.standing, &review.case.findings, &review.case.not_looked) {
            (Standing::Known, _, Some(why)) => Some(t!("review.not_looked", why)),
            (Standing::Known, Some(findings), None) if findings.is_empty() => Some(t!("review.nothing").into()),
            (Standing::Known, None, None) => Some(t!("review.nothing_known").into()),
            (Standing::Asked, None, _) => Some(t!("review.asking").into()),
            _ => None,
        }
    });
    view! {
        {move || nothing.get().map(|text| view! { <p class="empty" data-testid="review-nothing">{text}</p> })}
        <ol class="findings">
            {move || rows.get().into_iter().take(if is_short() { FEW } else { usize::MAX }).map(|(i, id, name, area, decision, is_decided, is_contested)| view! {
                <li>
                    <button
                        class="finding" type="button" data-testid=format!("finding-{}", i + 1)
                        aria-pressed=move || (selected.get() == Some(id)).to_string()
                        on:click=move |_| ui.send_feature(ReviewEvent::Select((selected.get_untracked() != Some(id)).then_some(id)))
                    >
                        <span class="entry-number">{i + 1}</span>
                        <span class="finding-name">{name.clone()} " " <small>{area}</small></span>
                        {match (is_contested, decision) {
                            (true, _) => view! { <span class="decision" data-decision="person">{t!("review.contested")}</span> }.into_any(),
                            (false, Some(decision)) => view! { <Badge decision/> }.into_any(),
                            (false, None) => ().into_any(),
                        }}
                        {is_decided.then(|| view! { <span class="visually-hidden">{t!("review.by_person")}</span> })}
                    </button>
                </li>
            }).collect_view()}
        </ol>
        <Show when=move || rows.with(|rows| rows.len() > FEW) && (shows_all.get() || is_short())>
            <button
                class="text-button" type="button" data-testid="findings-all" aria-expanded=move || shows_all.get().to_string()
                on:click=move |_| shows_all.update(|all| *all = !*all)
            >
                {move || if shows_all.get() { t!("review.fewer").into() } else { t!("review.all", count = rows.with(Vec::len)) }}
            </button>
        </Show>
    }
}

/// The figures of the chosen finding, and the criteria that are about it.
#[component]
fn Chosen(ui: Ui) -> impl IntoView {
    let chosen = ui.part(|s| {
        let review = &s.features.review;
        review.chosen().map(|(place, finding)| {
            let lines = review.case.lines_of(finding.id).map(|line| (line.decision, line.reason.clone()));
            (place, words::finding(finding), words::figures(finding), lines.collect::<Vec<_>>())
        })
    });
    view! {
        {move || chosen.get().map(|(place, name, figures, lines)| view! {
            <div class="finding-detail" data-testid="finding-detail" aria-live="polite">
                <h3>{format!("{} · {name}", place + 1)}</h3>
                <dl class="card-figures">
                    {figures.into_iter().map(|(name, value)| view! { <div><dt>{name}</dt><dd>{value}</dd></div> }).collect_view()}
                </dl>
                <ClassChoice ui/>
                <ul class="criteria">
                    {lines.into_iter().map(|(decision, reason)| view! { <li><Badge decision/> " " {reason}</li> }).collect_view()}
                </ul>
            </div>
        })}
    }
}

/// What the chosen finding is, for whoever may say that it is something else.
#[component]
fn ClassChoice(ui: Ui) -> impl IntoView {
    let offered = ui.part(|s| {
        let (_, finding) = s.features.review.chosen().filter(|_| s.may_review())?;
        let now = match &finding.kind {
            FindingKind::Defect { defect } | FindingKind::Drawn { defect: Some(defect), .. } => defect.name.clone(),
            FindingKind::Drawn { defect: None, .. } => String::new(),
            FindingKind::Completeness { .. } | FindingKind::Deviation { .. } => return None,
        };
        let names = s.legend.defects.iter().filter(|class| class.id != 0).map(|class| class.name.clone());
        Some((now, names.collect::<Vec<_>>()))
    });
    view! {
        {move || offered.get().map(|(now, names)| {
            let is_unnamed = now.is_empty();
            let option = move |name: String| {
                let (value, is_now) = (name.clone(), name == now);
                view! { <option value=value selected=is_now>{name}</option> }
            };
            view! {
                <label class="field-row">
                    <span>{t!("correct.it_is")}</span>
                    <select
                        data-testid="finding-class"
                        on:change=move |e| {
                            let name = event_target_value(&e);
                            ui.send_feature(ReviewEvent::Reclassify(Some(name).filter(|name| !name.is_empty())));
                        }
                    >
                        {is_unnamed.then(|| view! { <option selected=true disabled=true>{t!("correct.unnamed")}</option> })}
                        {names.into_iter().map(option).collect_view()}
                        <option value="">{t!("review.in_error.choice")}</option>
                    </select>
                </label>
            }
        })}
    }
}

/// The decisions by one key each.
#[component]
fn Rulings(ui: Ui) -> impl IntoView {
    let may = ui.part(AppState::may_review);
    let is_open = ui.part(|s| s.features.review.is_open());
    let about = ui.part(|s| match s.features.review.chosen() {
        Some((place, _)) => t!("review.decide.finding", number = place + 1),
        None => t!("review.decide.part").to_owned(),
    });
    let ruling = ui.part(|s| s.features.review.draft.as_ref().and_then(Draft::ruling));
    view! {
        <Show when=move || is_open.get() && may.get()>
            <h3 class="ruling-title" data-testid="ruling-title">{move || about.get()}</h3>
            <div class="buttons">
                {Ruling::ALL.into_iter().map(|option| view! {
                    <button
                        class="button" type="button" data-testid=format!("ruling-{}", option.key())
                        title=format!("{} ({})", option.label(), option.shortcut())
                        aria-pressed=move || (ruling.get() == Some(option)).to_string()
                        on:click=move |_| ui.send_feature(ReviewEvent::Draft(option))
                    >
                        {option.label()}
                    </button>
                }).collect_view()}
            </div>
        </Show>
        <Show when=move || is_open.get() && !may.get()>
            <p class="empty">{t!("review.may_not")}</p>
        </Show>
    }
}

/// Reason and name of a decision. Enter sends it, Escape gives it up.
#[component]
fn DraftForm(ui: Ui) -> impl IntoView {
    let draft = ui.part(|s| s.features.review.draft.clone());
    move || {
        draft.get().map(|draft| {
            let (words, about) = (draft.words(), about(ui, &draft.subject));
            let decide = move |signed: Signed| {
                let unsent = ui.read(|s| {
                    let case = &s.features.review.case;
                    let review = draft.review(new_name(), case, &signed.person, &signed.reason);
                    Unsent { inspection: case.inspection.clone(), review }
                });
                ui.send_feature(ReviewEvent::Decided(Box::new(unsent)));
                ui.send_feature(ReviewEvent::Discard);
                if ui.read(|s| s.features.review.selected.is_some()) {
                    ui.send_feature(ReviewEvent::Step(1));
                }
            };
            view! {
                <Signature
                    ui id="draft" label=t!("review.draft", what = words, about) because=t!("review.draft.because", what = words, about)
                    reason=Reason::Needed button=t!("common.sign").to_owned() is_ready=true on_sign=UnsyncCallback::new(decide)
                    on_cancel=UnsyncCallback::new(move |()| ui.send_feature(ReviewEvent::Discard))
                />
            }
        })
    }
}

/// What a decision is about, in words.
fn about(ui: Ui, subject: &Subject) -> String {
    match subject {
        Subject::Finding { finding } => ui.read(|s| match s.features.review.case.finding(*finding) {
            Some((place, _)) => t!("review.about.number", number = place + 1),
            None => t!("review.about.finding").to_owned(),
        }),
        Subject::Component { component } => component.clone(),
        Subject::Part => t!("review.about.part").to_owned(),
    }
}
