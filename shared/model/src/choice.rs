//! What was possible: messages about a name that nobody knows list the names that there are, the nearest first.

/// Names are alike from this Jaro-Winkler similarity on (0: nothing in common, 1: the same).
const ALIKE: f64 = 0.8;
/// Letters from which on a part of a name is taken for it.
const LEAST_PART: usize = 3;

/// The name among `possible` that `given` is most likely a slip of; `None` where none is alike.
pub fn nearest<'a>(given: &str, possible: &[&'a str]) -> Option<&'a str> {
    let given = given.to_lowercase();
    let similarity = |name: &str| {
        let name = name.to_lowercase();
        // A part of a name is more alike than its letters say: `motor` for `starter-motor`.
        let part = given.len() >= LEAST_PART && name.contains(&given);
        strsim::jaro_winkler(&given, &name).max(if part { ALIKE } else { 0.0 })
    };
    let best = possible.iter().copied().max_by(|a, b| similarity(a).total_cmp(&similarity(b)))?;
    (similarity(best) >= ALIKE).then_some(best)
}

/// What was possible in place of `given`, as the end of a message: `did you mean "seed"? There are seed, size, views`.
pub fn possible_instead(given: &str, possible: &[&str]) -> String {
    let list = if possible.is_empty() { "none".to_owned() } else { possible.join(", ") };
    match nearest(given, possible) {
        Some(name) => format!("did you mean {name:?}? There are {list}"),
        None => format!("there are {list}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_is_told_from_another_word() {
        let keys = ["seed", "part-seed", "views", "size"];
        for (slip, meant) in [("sede", "seed"), ("Seed", "seed"), ("view", "views"), ("partseed", "part-seed")] {
            assert_eq!(nearest(slip, &keys), Some(meant), "{slip}");
        }
        assert_eq!(nearest("motor", &["mesh", "starter-motor"]), Some("starter-motor"));
        assert_eq!(nearest("colour", &keys), None);
        assert_eq!(possible_instead("colour", &keys), "there are seed, part-seed, views, size");
        assert!(possible_instead("sise", &keys).starts_with("did you mean \"size\"? There are seed,"));
        assert_eq!(possible_instead("x", &[]), "there are none");
    }
}
