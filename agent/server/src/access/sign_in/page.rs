//! The page on which a login at an identity provider ends that came to nothing. It says nothing that a browser sent.

use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};

/// A page with `status` that says `heading` and `text`, neither of which has markup.
pub(super) fn refused_page(status: StatusCode, heading: &str, text: &str) -> Response {
    let html = format!(
        "<!doctype html>\n<html lang=\"en\" data-theme=\"system\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{heading} · Semascan</title>\n\
         <link rel=\"icon\" href=\"/favicon.svg\" type=\"image/svg+xml\">\n<link rel=\"stylesheet\" href=\"/style.css\">\n\
         <script src=\"/theme.js\"></script>\n</head>\n<body class=\"login\">\n<main class=\"login-card is-raised\">\n\
         <h1 class=\"brand-name\">{heading}</h1>\n<p role=\"alert\">{text}</p>\n\
         <div class=\"login-form\"><a class=\"button\" href=\"/login.html\">Back to the login</a></div>\n</main>\n</body>\n</html>\n"
    );
    let kind = HeaderValue::from_static("text/html; charset=utf-8");
    let kept = HeaderValue::from_static("no-store");
    (status, [(header::CONTENT_TYPE, kind), (header::CACHE_CONTROL, kept)], html).into_response()
}
