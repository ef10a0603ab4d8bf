//! Figures in the reasons of a verdict, as people write them.

use semascan_model::finding::Quantity;

/// A figure and its uncertainty in a unit of this size and name.
pub(super) fn shown(value: Option<Quantity>, (size, name): (f64, &str)) -> String {
    match value {
        None => "not known, or there is none".into(),
        Some(Quantity { value, expanded: Some(u) }) => format!("{:.2} +- {:.2} {name}", value / size, u / size),
        Some(Quantity { value, expanded: None }) => format!("{:.2} {name} (uncertainty not known)", value / size),
    }
}

pub(super) fn percent(value: Option<Quantity>) -> String {
    shown(value, (0.01, "%"))
}

pub(super) fn shown_share(share: f64) -> String {
    format!("{} %", plain(share * 100.0))
}

/// A number as people write it.
pub(super) fn plain(value: f64) -> String {
    let text = format!("{value:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}
