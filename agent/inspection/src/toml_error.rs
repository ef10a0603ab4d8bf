//! Errors of TOML files, for people.

use semascan_model::choice::nearest;

/// The error of a reader with its place; where it says that a name is unknown and which there are, the nearest of these too.
pub fn explain_toml(error: &toml::de::Error) -> String {
    let text = error.to_string();
    // serde: unknown field `x`, expected one of `a`, `b`.
    let names: Vec<&str> = error.message().split('`').skip(1).step_by(2).collect();
    match names.split_first() {
        Some((given, possible)) if error.message().starts_with("unknown ") => match nearest(given, possible) {
            Some(name) => format!("{}; did you mean {name:?}?", text.trim_end()),
            None => text.trim_end().to_owned(),
        },
        _ => text.trim_end().to_owned(),
    }
}
