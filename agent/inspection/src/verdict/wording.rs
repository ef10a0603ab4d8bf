//! Figures in the reasons of a verdict, as people write them.

use semascan_model::finding::Quantity;

/// A figure and its uncertainty in another unit.
pub(super) fn shown(value: Option<Quantity>, unit: f64) -> String {
    match value {
        None => "not known or none".into(),
        Some(Quantity { value, expanded: Some(u) }) => format!("{:.2} +- {:.2}", value / unit, u / unit),
        Some(Quantity { value, expanded: None }) => format!("{:.2} (uncertainty not known)", value / unit),
    }
}

pub(super) fn percent(value: Option<Quantity>) -> String {
    format!("{} %", shown(value, 0.01))
}

pub(super) fn shown_share(share: f64) -> String {
    format!("{} %", plain(share * 100.0))
}

/// A number as people write it.
pub(super) fn plain(value: f64) -> String {
    let text = format!("{value:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}
