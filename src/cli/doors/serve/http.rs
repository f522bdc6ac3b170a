//! Small things of HTTP: kinds of content, replies, names of files.

use axum::body::Body;
use axum::http::{HeaderMap, header};
use axum::response::{IntoResponse, Response};
use serde_json::Value;
use starpipe::base::format::printable;

pub(super) const JSON: &str = "application/json";
/// So nova.astrometry.net calls its JSON, too; its clients ask for that.
pub(super) const TEXT: &str = "text/plain; charset=utf-8";
pub(super) const FITS: &str = "application/fits";
pub(super) const HTML: &str = "text/html; charset=utf-8";

/// A reply of this kind.
pub(super) fn reply(kind: &'static str, content: impl Into<Body>) -> Response {
    ([(header::CONTENT_TYPE, kind)], content.into()).into_response()
}

/// A reply of the protocol of nova.astrometry.net.
pub(super) fn nova_reply(answer: &Value) -> Response {
    reply(TEXT, answer.to_string())
}

/// A header as text; empty where it is absent.
pub(super) fn text_of(headers: &HeaderMap, name: header::HeaderName) -> &str {
    let value = headers.get(name).and_then(|value| value.to_str().ok());
    value.unwrap_or_default()
}

/// What an upload is called: a name to show, never a path.
pub(super) fn shown_name(stated: Option<&str>) -> String {
    const MAX_LETTERS: usize = 100;
    let stated = stated.unwrap_or_default();
    let last = stated.rsplit(['/', '\\']).next().unwrap_or_default();
    let name: String = printable(last).chars().take(MAX_LETTERS).collect();
    match name.trim() {
        "" | "." | ".." => "upload".to_owned(),
        name => name.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_no_paths() {
        for (stated, shown) in [
            ("a.png", "a.png"),
            ("/etc/../a.png", "a.png"),
            ("C:\\night\\a b.png", "a b.png"),
            ("..", "upload"),
            ("a/", "upload"),
            ("", "upload"),
        ] {
            assert_eq!(shown_name(Some(stated)), shown);
        }
        let odd = shown_name(Some("a\u{1b}[31m\nb\0.png"));
        assert!(!odd.contains(['\u{1b}', '\n', '\0']), "{odd:?}");
        assert_eq!(shown_name(Some(&"é".repeat(500))).chars().count(), 100);
    }
}
