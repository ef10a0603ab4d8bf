//! The viewer's files: embedded in the binary, or from a folder while they are being worked on.
//!
//! A file is held once, whoever is being sent it: an answer refers to it, and copies nothing.

use super::client_log::Excerpt;
use super::server::ServeError;
use axum::body::{Body, Bytes};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use std::borrow::Cow;
use std::collections::HashMap;
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::SystemTime;

/// Files that a binary holds: the content of the one of that name.
pub type EmbeddedFiles = fn(&str) -> Option<Cow<'static, [u8]>>;

/// Largest file of a folder that is served.
const LARGEST: u64 = 64 << 20;
/// Bytes of a folder's files that are held; past that they are read again.
const HELD: usize = 128 << 20;

/// Where the viewer's files come from.
#[derive(Clone, Debug)]
pub enum WebFiles {
    /// The binary that serves them.
    Embedded(EmbeddedFiles),
    /// A folder; a file is read again when it has changed.
    Folder(WebFolder),
}

/// A folder of files, and those of them that were read.
#[derive(Clone, Debug)]
pub struct WebFolder {
    folder: PathBuf,
    read: Arc<Mutex<HashMap<PathBuf, ReadFile>>>,
}

#[derive(Clone, Debug)]
struct ReadFile {
    modified: Option<SystemTime>,
    content: Bytes,
}

impl WebFolder {
    /// The folder at `folder`.
    pub fn new(folder: PathBuf) -> Self {
        Self { folder, read: Arc::default() }
    }

    /// The file `name` of the folder; nothing that is not a plain file in it, wherever links lead.
    fn read(&self, name: &str) -> Option<Bytes> {
        let folder = self.folder.canonicalize().ok()?;
        let path = folder.join(name).canonicalize().ok().filter(|path| path.starts_with(&folder))?;
        let about = std::fs::metadata(&path).ok().filter(|about| about.is_file() && about.len() <= LARGEST)?;
        let modified = about.modified().ok();
        let mut read = self.read.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(file) = read.get(&path)
            && modified.is_some()
            && file.modified == modified
            && file.content.len() as u64 == about.len()
        {
            return Some(file.content.clone());
        }
        let content = Bytes::from(std::fs::read(&path).ok()?);
        if read.values().map(|file| file.content.len()).sum::<usize>() + content.len() > HELD {
            read.clear();
        }
        read.insert(path, ReadFile { modified, content: content.clone() });
        Some(content)
    }
}

impl WebFiles {
    /// The files of the folder at `folder`.
    pub fn folder(folder: impl Into<PathBuf>) -> Self {
        Self::Folder(WebFolder::new(folder.into()))
    }

    /// Whether there is anything to serve from.
    ///
    /// # Errors
    /// [`ServeError::Files`] if the folder is not there, or is none.
    pub(super) fn check(&self) -> Result<(), ServeError> {
        let Self::Folder(WebFolder { folder, .. }) = self else { return Ok(()) };
        let wrong = match std::fs::metadata(folder) {
            Ok(about) if about.is_dir() => return Ok(()),
            Ok(_) => "the viewer's files are served from a folder, and this is none".to_owned(),
            Err(error) => format!("the folder of the viewer's files cannot be read: {error}"),
        };
        Err(ServeError::Files { folder: folder.clone(), reason: wrong })
    }

    /// The file at URL path `path`, compressed as `headers` accept it.
    pub(super) fn serve(&self, path: &str, headers: &HeaderMap) -> Response {
        let name = match path.trim_start_matches('/') {
            "" => "index.html",
            name => name,
        };
        let plain = Path::new(name).components().all(|c| matches!(c, Component::Normal(_)));
        if !plain || name.contains('\0') || name.ends_with(".br") || name.ends_with(".gz") {
            return not_found(name);
        }
        for (suffix, encoding) in accepted(headers) {
            let Some(content) = self.read(&format!("{name}{suffix}")) else { continue };
            let mut response = Response::new(Body::from(content));
            let h = response.headers_mut();
            h.insert(header::CONTENT_TYPE, HeaderValue::from_static(content_type(name)));
            if let Some(encoding) = encoding {
                h.insert(header::CONTENT_ENCODING, HeaderValue::from_static(encoding));
            }
            h.insert(header::VARY, HeaderValue::from_static("accept-encoding"));
            h.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-cache"));
            return response;
        }
        not_found(name)
    }

    fn read(&self, name: &str) -> Option<Bytes> {
        match self {
            Self::Embedded(files) => files(name).map(|content| match content {
                Cow::Borrowed(content) => Bytes::from_static(content),
                // A binary for development reads its files from disk.
                Cow::Owned(content) => content.into(),
            }),
            Self::Folder(folder) => folder.read(name),
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
        format!("no file {}", Excerpt(name))
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
        let files = WebFiles::folder(dir.path());
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
    #[test]
    fn a_file_is_held_once_and_read_again_when_it_has_changed() {
        let (dir, files) = folder();
        let read = |name: &str| files.read(name).expect("a file");
        assert_eq!(read("index.html").as_ptr(), read("index.html").as_ptr());
        std::fs::write(dir.path().join("index.html"), "changed since").expect("writes");
        assert_eq!(read("index.html"), "changed since");
        let embedded = WebFiles::Embedded(|_| Some(Cow::Borrowed(b"inside")));
        assert_eq!(embedded.read("a").map(|b| b.as_ptr()), embedded.read("a").map(|b| b.as_ptr()));
    }

    #[cfg(unix)]
    #[test]
    fn links_out_of_the_folder_and_what_is_no_file_are_not_served() {
        let (dir, files) = folder();
        let secret = tempfile::NamedTempFile::new().expect("a file elsewhere");
        std::os::unix::fs::symlink(secret.path(), dir.path().join("out.html")).expect("links");
        std::os::unix::fs::symlink("index.html", dir.path().join("in.html")).expect("links");
        std::fs::create_dir(dir.path().join("sub")).expect("makes a folder");
        let socket = std::os::unix::net::UnixListener::bind(dir.path().join("socket")).expect("binds");
        for (path, expected) in [
            ("/out.html", StatusCode::NOT_FOUND),
            ("/in.html", StatusCode::OK),
            ("/sub", StatusCode::NOT_FOUND),
            ("/socket", StatusCode::NOT_FOUND),
        ] {
            assert_eq!(status(&files, path), expected, "{path}");
        }
        drop(socket);
    }

    #[test]
    fn a_folder_that_is_not_there_is_named() {
        let (dir, files) = folder();
        assert!(files.check().is_ok());
        for wrong in ["missing", "index.html"] {
            let error = WebFiles::folder(dir.path().join(wrong)).check().expect_err(wrong).to_string();
            assert!(error.contains(wrong), "{error}");
        }
    }
}
