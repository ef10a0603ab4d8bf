//! What the page's address asks for: `?renderer=`, `?theme=`, `?ws=`, a past inspection: `?inspection=`, `?speed=`, `?from=`, another
//! one that it is compared with: `?reference=`, a file beside the page: `?model=`, or a pane of a page around this one: `?pane`.

use crate::display::Theme;
use crate::link::refusal::host_of;
use crate::render::BackendChoice;
use crate::words::{languages, t};
use semascan_model::InspectionId;

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
    /// Path of a file, relative to the page, that is shown in the place of an agent's model.
    pub model: Option<String>,
    /// The past inspection whose mesh the model is compared with.
    pub reference: Option<InspectionId>,
    /// Whether the page is one of several that look from the same place.
    pub is_pane: bool,
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
                complaints.push(t!("options.renderer", value));
            }
            choice
        });
        let theme = parameter("theme").and_then(|value| {
            let theme = Theme::from_key(&value);
            if theme.is_none() {
                complaints.push(t!("options.theme", value));
            }
            theme
        });
        if let Some(value) = parameter("language").filter(|value| !languages().contains_key(value)) {
            let known = languages().keys().map(String::as_str).collect::<Vec<_>>().join(", ");
            complaints.push(t!("options.language", value, known));
        }
        let own = format!("{}://{host}{STREAM_PATH}", if secure { "wss" } else { "ws" });
        let stream = match parameter("ws") {
            // Without a path, as the operator's list of agents has it, it is the stream's own.
            Some(value) if host_of(&value).is_some_and(|host| value.ends_with(host)) => format!("{value}{STREAM_PATH}"),
            Some(value) if host_of(&value).is_some() => value,
            Some(value) => {
                complaints.push(t!("options.ws", value));
                own
            }
            None => own,
        };
        let stream = match past_inspection(&parameter, &mut complaints) {
            Some(query) => format!("{stream}{}{query}", if stream.contains('?') { '&' } else { '?' }),
            None => stream,
        };
        let foreign_host = host_of(&stream).filter(|h| !h.eq_ignore_ascii_case(host)).map(str::to_owned);
        let model = parameter("model").filter(|path| {
            // Beside the page or below it: a link must not make a page load what it likes from elsewhere.
            let is_near = !path.is_empty()
                && !path.starts_with(['/', '\\'])
                && !path.contains(':')
                && path.split(['/', '\\']).all(|folder| folder != "..");
            if !is_near {
                complaints.push(t!("options.model", path));
            }
            is_near
        });
        let reference = parameter("reference").and_then(|text| {
            let reference = text.parse::<InspectionId>().ok();
            if reference.is_none() {
                complaints.push(t!("options.reference", text));
            }
            reference
        });
        let is_pane = parameter("pane").is_some();
        Self {
            backend: backend.unwrap_or_default(),
            theme,
            stream,
            foreign_host,
            model,
            reference,
            is_pane,
            complaints,
        }
    }
}

/// The query of the stream that asks for a past inspection, as the page's own address does; `None` where it asks for none.
fn past_inspection(parameter: &impl Fn(&str) -> Option<String>, complaints: &mut Vec<String>) -> Option<String> {
    let inspection = parameter("inspection")?;
    let Ok(inspection) = inspection.parse::<InspectionId>() else {
        complaints.push(t!("options.inspection", inspection));
        return None;
    };
    let mut query = format!("inspection={inspection}");
    if let Some(speed) = parameter("speed") {
        match speed.parse::<f64>() {
            Ok(number) if number > 0.0 && number.is_finite() => query.push_str(&format!("&speed={number}")),
            _ => complaints.push(t!("options.speed", speed)),
        }
    }
    if let Some(from) = parameter("from") {
        match from.parse::<u64>() {
            Ok(number) => query.push_str(&format!("&from={number}")),
            Err(_) => complaints.push(t!("options.from", from)),
        }
    }
    Some(query)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_file_beside_the_page_is_opened_by_its_address() {
        let model = |path: &str| read(&[("model", path)]).model;
        assert_eq!(model("results/scene 1.glb").as_deref(), Some("results/scene 1.glb"));
        for path in ["", "/etc/a.ply", "//evil/a.ply", "https://evil/a.ply", "a/../../b.ply", "..\\a.ply", "\\\\evil"] {
            assert_eq!(model(path), None, "{path}");
        }
        assert!(read(&[("model", "/a.ply")]).complaints[0].contains("/a.ply"));
    }

    #[test]
    fn an_inspection_is_compared_with_another_that_is_kept() {
        let id = "018f3f6e-0000-7000-8000-000000000001";
        let options = read(&[("inspection", id), ("reference", id), ("pane", "")]);
        assert_eq!(options.reference.map(|id| id.to_string()).as_deref(), Some(id));
        assert!(options.is_pane && options.complaints.is_empty());
        let wrong = read(&[("reference", "../secret")]);
        assert!(wrong.reference.is_none() && !wrong.is_pane && wrong.complaints[0].contains("../secret"));
    }

    #[test]
    fn a_past_inspection_is_asked_for_as_the_address_says() {
        let id = "018f3f6e-0000-7000-8000-000000000001";
        let options = read(&[("inspection", id), ("speed", "10"), ("from", "12")]);
        assert_eq!(options.stream, format!("ws://127.0.0.1:8787/ws?inspection={id}&speed=10&from=12"));
        assert!(options.complaints.is_empty() && options.foreign_host.is_none());
        let elsewhere = read(&[("inspection", id), ("ws", "ws://10.0.0.7:8787")]);
        assert_eq!(elsewhere.stream, format!("ws://10.0.0.7:8787/ws?inspection={id}"));
        assert_eq!(elsewhere.foreign_host.as_deref(), Some("10.0.0.7:8787"));
        let wrong = read(&[("inspection", "x&y"), ("speed", "2")]);
        assert_eq!((wrong.stream.as_str(), wrong.complaints.len()), ("ws://127.0.0.1:8787/ws", 1));
        let half = read(&[("inspection", id), ("speed", "0"), ("from", "-1")]);
        assert_eq!((half.stream, half.complaints.len()), (format!("ws://127.0.0.1:8787/ws?inspection={id}"), 2));
    }

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
