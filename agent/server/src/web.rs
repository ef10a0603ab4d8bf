//! The viewer's files: embedded in the binary, or from a folder while they are being worked on.

use axum::body::Body;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use std::borrow::Cow;
use std::path::{Component, Path, PathBuf};

/// Files that a binary holds: the content of the one of that name.
pub type EmbeddedFiles = fn(&str) -> Option<Cow<'static, [u8]>>;

/// Scripts from this origin only, and WebAssembly; sockets to this host (`ws:` for Safari, which does not count them
/// to `'self'`).
const CONTENT_SECURITY_POLICY: &str = "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; \
    connect-src 'self' ws: wss:; img-src 'self' blob: data:; style-src 'self'; worker-src 'self' blob:; \
    object-src 'none'; base-uri 'none'; frame-ancestors 'none'";

/// Where the viewer's files come from.
#[derive(Clone, Debug)]
pub enum WebFiles {
    /// The binary that serves them.
    Embedded(EmbeddedFiles),
    /// A folder, read at every request.
    Folder(PathBuf),
}

impl WebFiles {
    /// The file at URL path `path`, compressed as `headers` accept it.
    pub(super) fn serve(&self, path: &str, headers: &HeaderMap) -> Response {
        let name = match path.trim_start_matches('/') {
            "" => "index.html",
            name => name,
        };
        let plain = Path::new(name).components().all(|c| matches!(c, Component::Normal(_)));
        if !plain || name.ends_with(".br") || name.ends_with(".gz") {
            return not_found(name);
        }
        for (suffix, encoding) in accepted(headers) {
            let Some(content) = self.read(&format!("{name}{suffix}")) else { continue };
            let mut response = Response::new(Body::from(content.into_owned()));
            let h = response.headers_mut();
            h.insert(header::CONTENT_TYPE, HeaderValue::from_static(content_type(name)));
            if let Some(encoding) = encoding {
                h.insert(header::CONTENT_ENCODING, HeaderValue::from_static(encoding));
            }
            h.insert(header::VARY, HeaderValue::from_static("accept-encoding"));
            h.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-cache"));
            h.insert(header::CONTENT_SECURITY_POLICY, HeaderValue::from_static(CONTENT_SECURITY_POLICY));
            h.insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
            h.insert(header::REFERRER_POLICY, HeaderValue::from_static("no-referrer"));
            return response;
        }
        not_found(name)
    }

    fn read(&self, name: &str) -> Option<Cow<'static, [u8]>> {
        match self {
            Self::Embedded(files) => files(name),
            Self::Folder(folder) => std::fs::read(folder.join(name)).ok().map(Cow::Owned),
        }
    }
}

/// Encodings that the client accepts, best first: (file suffix, header value); the plain file always comes last.
fn accepted(headers: &HeaderMap) -> Vec<(&'static str, Option<&'static str>)> {
    let accept = headers.get(header::ACCEPT_ENCODING).and_then(|v| v.to_str().ok()).unwrap_or("");
    let takes = |name: &str| {
        accept.split(',').map(str::trim).any(|e| {
            let mut parts = e.split(';');
            parts.next().map(str::trim) == Some(name) && !parts.any(|q| matches!(q.trim(), "q=0" | "q=0.0"))
        })
    };
    let mut list = Vec::new();
    if takes("br") {
        list.push((".br", Some("br")));
    }
    if takes("gzip") {
        list.push((".gz", Some("gzip")));
    }
    list.push(("", None));
    list
}

fn content_type(name: &str) -> &'static str {
    match Path::new(name).extension().and_then(|e| e.to_str()) {
        Some("html") => "text/html; charset=utf-8",
        Some("css") => "text/css; charset=utf-8",
        Some("js" | "mjs") => "text/javascript; charset=utf-8",
        Some("wasm") => "application/wasm",
        Some("svg") => "image/svg+xml",
        Some("png") => "image/png",
        Some("json" | "webmanifest") => "application/json",
        Some("woff2") => "font/woff2",
        _ => "application/octet-stream",
    }
}

fn not_found(name: &str) -> Response {
    let text = if name == "index.html" {
        "This agent was built without its viewer. Build it with `cargo xtask web`, then build the agent again.".into()
    } else {
        format!("no file {name}")
    };
    (StatusCode::NOT_FOUND, text).into_response()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder() -> (tempfile::TempDir, WebFiles) {
        let dir = tempfile::tempdir().expect("temporary folder");
        std::fs::write(dir.path().join("index.html"), "plain").expect("writes");
        std::fs::write(dir.path().join("index.html.br"), "brotli").expect("writes");
        let files = WebFiles::Folder(dir.path().to_owned());
        (dir, files)
    }

    fn status(files: &WebFiles, path: &str) -> StatusCode {
        files.serve(path, &HeaderMap::new()).status()
    }

    #[test]
    fn the_best_accepted_encoding_is_served() {
        let (_dir, files) = folder();
        let mut headers = HeaderMap::new();
        assert!(files.serve("/", &headers).headers().get(header::CONTENT_ENCODING).is_none());
        headers.insert(header::ACCEPT_ENCODING, HeaderValue::from_static("gzip, deflate, br"));
        assert_eq!(files.serve("/", &headers).headers()[header::CONTENT_ENCODING], "br");
        headers.insert(header::ACCEPT_ENCODING, HeaderValue::from_static("br;q=0, gzip"));
        assert!(files.serve("/", &headers).headers().get(header::CONTENT_ENCODING).is_none());
    }

    #[test]
    fn nothing_outside_of_the_folder_is_served() {
        let (_dir, files) = folder();
        assert_eq!(status(&files, "/index.html"), StatusCode::OK);
        for path in ["/../index.html", "/a/../index.html", "//etc/passwd", "/missing.js", "/index.html.br"] {
            assert_eq!(status(&files, path), StatusCode::NOT_FOUND, "{path}");
        }
    }
}
