//! What stands on a key, or what the pointer does, as the person's keyboard calls it.

use crate::words::t;

/// The name of a key; letters and signs are the same everywhere.
pub(super) fn key_name(key: &'static str) -> &'static str {
    match key {
        "Shift" => t!("key.shift"),
        "Ctrl" => t!("key.ctrl"),
        "Enter" => t!("key.enter"),
        "Del" => t!("key.del"),
        "Click" => t!("key.click"),
        "Drag" => t!("key.drag"),
        "Wheel" => t!("key.wheel"),
        "Double click" => t!("key.double_click"),
        other => other,
    }
}
