//! What the page's address asks for: `?renderer=`, `?theme=`, `?ws=`.

use crate::display::Theme;
use crate::render::BackendChoice;

/// Path of the live stream on the server that served the page.
pub const STREAM_PATH: &str = "/ws";

/// The page's options.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// Which graphics interface to use.
    pub backend: BackendChoice,
    /// The theme, if the address names one.
    pub theme: Option<Theme>,
    /// Address of the live stream.
    pub stream: String,
    /// What was asked for and is not understood, for people.
    pub complaints: Vec<String>,
}

impl Options {
    /// Reads the options.
    ///
    /// * `secure` and `host`: of the page's own address, for the default address of the stream.
    /// * `parameter`: the decoded value of a query parameter.
    pub fn read(secure: bool, host: &str, parameter: impl Fn(&str) -> Option<String>) -> Self {
        let mut complaints = Vec::new();
        let backend = parameter("renderer").and_then(|value| {
            let choice = BackendChoice::from_parameter(&value);
            if choice.is_none() {
                complaints.push(format!("renderer={value} is not known; use webgpu or webgl2."));
            }
            choice
        });
        let theme = parameter("theme").and_then(|value| {
            let theme = Theme::from_key(&value);
            if theme.is_none() {
                complaints.push(format!("theme={value} is not known; use light, dark or system."));
            }
            theme
        });
        let own = format!("{}://{host}{STREAM_PATH}", if secure { "wss" } else { "ws" });
        let stream = match parameter("ws") {
            Some(value) if value.starts_with("ws://") || value.starts_with("wss://") => value,
            Some(value) => {
                complaints.push(format!("ws={value} is no address of a live stream; it begins with ws:// or wss://."));
                own
            }
            None => own,
        };
        Self { backend: backend.unwrap_or_default(), theme, stream, complaints }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(query: &[(&str, &str)]) -> Options {
        Options::read(false, "127.0.0.1:8787", |name| {
            query.iter().find(|(key, _)| *key == name).map(|(_, value)| (*value).to_owned())
        })
    }

    #[test]
    fn without_parameters_the_page_follows_its_own_server() {
        let options = read(&[]);
        assert_eq!(options.stream, "ws://127.0.0.1:8787/ws");
        assert_eq!((options.backend, options.theme), (BackendChoice::Auto, None));
        assert!(options.complaints.is_empty());
        assert_eq!(Options::read(true, "cell.example", |_| None).stream, "wss://cell.example/ws");
    }

    #[test]
    fn parameters_override() {
        let options = read(&[("renderer", "webgl2"), ("theme", "dark"), ("ws", "wss://other/ws")]);
        assert_eq!(options.stream, "wss://other/ws");
        assert_eq!((options.backend, options.theme), (BackendChoice::WebGl2, Some(Theme::Dark)));
    }

    #[test]
    fn what_is_not_understood_is_said_and_left_aside() {
        let options = read(&[("renderer", "vulkan"), ("theme", "pink"), ("ws", "javascript:alert(1)")]);
        assert_eq!(options.complaints.len(), 3);
        assert_eq!(options.stream, "ws://127.0.0.1:8787/ws");
    }
}
