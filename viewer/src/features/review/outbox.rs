//! Decisions in the browser's storage until they have arrived. Each has an entry of its own: tabs of the same person share the
//! storage, and one that wrote a list would lose what another has put into it.

#[cfg(target_arch = "wasm32")]
use super::Unsent;
use semascan_model::review::ReviewId;
#[cfg(target_arch = "wasm32")]
use web_sys::Storage;

/// What the keys of entries begin with; place and name of the decision follow.
const PREFIX: &str = "semascan.unsent-review.";

/// The key of the decision `id` behind those of `keys`, which are in order.
fn next_key(keys: &[String], id: ReviewId) -> String {
    let place = keys.last().and_then(|key| key.strip_prefix(PREFIX)?.get(..10)?.parse::<u32>().ok());
    format!("{PREFIX}{:010}.{}", place.map_or(0, |place| place.saturating_add(1)), id.0)
}

/// The key of the decision `id`, if it has one.
fn key_of(keys: &[String], id: ReviewId) -> Option<&String> {
    let name = id.0.to_string();
    keys.iter().find(|key| key.ends_with(&name))
}

/// The keys of all entries, the oldest first.
#[cfg(target_arch = "wasm32")]
fn keys(storage: &Storage) -> Vec<String> {
    let all = (0..storage.length().unwrap_or_default()).filter_map(|place| storage.key(place).ok().flatten());
    let mut keys: Vec<String> = all.filter(|key| key.starts_with(PREFIX)).collect();
    keys.sort_unstable();
    keys
}

/// All that is kept, the oldest first.
#[cfg(target_arch = "wasm32")]
pub(super) fn kept(storage: &Storage) -> Vec<Unsent> {
    let texts = keys(storage).into_iter().filter_map(|key| storage.get_item(&key).ok().flatten());
    texts.filter_map(|text| serde_json::from_str(&text).ok()).collect()
}

/// Keeps a decision; whether it is kept.
#[cfg(target_arch = "wasm32")]
pub(super) fn keep(storage: &Storage, unsent: &Unsent) -> bool {
    let (keys, id) = (keys(storage), unsent.review.id);
    let set = |text: String| storage.set_item(&next_key(&keys, id), &text).is_ok();
    key_of(&keys, id).is_some() || serde_json::to_string(unsent).is_ok_and(set)
}

/// Keeps a decision no more.
#[cfg(target_arch = "wasm32")]
pub(super) fn forget(storage: &Storage, id: ReviewId) {
    if let Some(key) = key_of(&keys(storage), id) {
        // What is sent again is known to the agent.
        let _ = storage.remove_item(key);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use uuid::Uuid;

    #[test]
    fn entries_stand_in_the_order_in_which_they_were_made_and_are_found_by_name() {
        let id = |n: u128| ReviewId(Uuid::from_u128(n));
        let mut keys = Vec::new();
        for n in [9, 3, 5] {
            keys.push(next_key(&keys, id(n)));
        }
        assert!(keys.is_sorted() && keys.iter().all(|key| key.starts_with(PREFIX)));
        assert_eq!(key_of(&keys, id(3)), Some(&keys[1]));
        assert_eq!(key_of(&keys, id(4)), None);
        // Two tabs may take the same place: their entries stay apart.
        assert_ne!(next_key(&keys, id(1)), next_key(&keys, id(2)));
    }
}
