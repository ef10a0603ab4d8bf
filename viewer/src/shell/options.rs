//! What the page's address asks for: `?renderer=`, `?theme=`, `?ws=`.

use crate::display::Theme;
use crate::link::refusal::host_of;
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
    /// Host of the stream where it is not the page's own: whose model is shown.
    pub foreign_host: Option<String>,
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
            // Without a path, as the operator's list of agents has it, it is the stream's own.
            Some(value) if host_of(&value).is_some_and(|host| value.ends_with(host)) => format!("{value}{STREAM_PATH}"),
            Some(value) if host_of(&value).is_some() => value,
            Some(value) => {
                complaints.push(format!("ws={value} is no address of a live stream; it begins with ws:// or wss://."));
                own
            }
            None => own,
        };
        let foreign_host = host_of(&stream).filter(|h| !h.eq_ignore_ascii_case(host)).map(str::to_owned);
        Self { backend: backend.unwrap_or_default(), theme, stream, foreign_host, complaints }
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
        assert_eq!((options.stream.as_str(), options.foreign_host.as_deref()), ("wss://other/ws", Some("other")));
        assert_eq!((options.backend, options.theme), (BackendChoice::WebGl2, Some(Theme::Dark)));
    }

    #[test]
    fn another_agent_is_named_and_the_own_one_is_not_another() {
        let bare = read(&[("ws", "ws://10.0.0.7:8787")]);
        assert_eq!(
            (bare.stream.as_str(), bare.foreign_host.as_deref()),
            ("ws://10.0.0.7:8787/ws", Some("10.0.0.7:8787"))
        );
        assert_eq!(read(&[("ws", "ws://127.0.0.1:8787/ws")]).foreign_host, None);
        let disguised = read(&[("ws", "ws://127.0.0.1:8787@evil.example/ws")]);
        assert_eq!(disguised.foreign_host.as_deref(), Some("evil.example"));
        assert_eq!(read(&[("ws", "ws:///ws")]).complaints.len(), 1);
    }

    #[test]
    fn what_is_not_understood_is_said_and_left_aside() {
        let options = read(&[("renderer", "vulkan"), ("theme", "pink"), ("ws", "javascript:alert(1)")]);
        assert_eq!(options.complaints.len(), 3);
        assert_eq!(options.stream, "ws://127.0.0.1:8787/ws");
    }
}
