//! The templates, and what all pages are made with.

use crate::base::format::{is_deceptive, printable};
use crate::report::overlay::jpeg;
use base64::Engine;
use base64::engine::general_purpose::STANDARD as BASE64;
use image::RgbImage;
use minijinja::value::Value;
use minijinja::{Environment, Error, Output, State, context, escape_formatter};
use serde::Serialize;
use std::io;

/// A page of one kind.
pub(super) struct PageKind {
    /// Its template.
    pub(super) template: &'static str,
    /// What its script does, beside tables.
    pub(super) script: &'static str,
}

const TEMPLATES: [(&str, &str); 8] = [
    ("base.html", include_str!("base.html")),
    ("view.html", include_str!("view.html")),
    ("notes.html", include_str!("notes.html")),
    ("picture.html", include_str!("picture.html")),
    ("report.html", include_str!("report.html")),
    ("table.html", include_str!("table.html")),
    ("frame.html", include_str!("frame.html")),
    ("document.html", include_str!("document.html")),
];

/// The page of `kind` with `values` in its template and `data` for its script.
pub(super) fn render(kind: &PageKind, values: Value, data: &impl Serialize) -> io::Result<String> {
    let script = [
        "\"use strict\";\n(() => {\n",
        include_str!("table.js"),
        include_str!("figure.js"),
        include_str!("print.js"),
        kind.script,
        "})();\n",
    ];
    let values = context! {
        base => "base.html",
        data => script_data(data)?,
        style => include_str!("page.css"),
        script => script.concat(),
        version => env!("CARGO_PKG_VERSION"),
        ..values
    };
    fill(kind, values)
}

/// What is within such a page, for another one that has its style and script already.
pub(super) fn render_view(kind: &PageKind, values: Value) -> io::Result<String> {
    fill(kind, context! { base => "view.html", ..values })
}

fn fill(kind: &PageKind, values: Value) -> io::Result<String> {
    let mut environment = Environment::new();
    environment.set_formatter(format_text);
    for (name, source) in TEMPLATES {
        environment
            .add_template(name, source)
            .map_err(io::Error::other)?;
    }
    environment
        .get_template(kind.template)
        .and_then(|template| template.render(values))
        .map_err(io::Error::other)
}

/// Writes a value: texts as people may see them, escaped for HTML unless they are markup.
fn format_text(out: &mut Output, state: &mut State, value: &Value) -> Result<(), Error> {
    match value.as_str().filter(|_| !value.is_safe()) {
        Some(text) => escape_formatter(out, state, &Value::from(printable(text))),
        None => escape_formatter(out, state, value),
    }
}

/// JSON that may stand in a script: a name cannot end it.
fn script_data(data: &impl Serialize) -> io::Result<String> {
    Ok(shown_data(data)?.replace('<', "\\u003c"))
}

/// Data as JSON, whose texts are as people may see them.
pub(super) fn shown_data(data: &impl Serialize) -> io::Result<String> {
    let json = serde_json::to_string(data)?;
    let is_shown = |character: char| !character.is_control() && !is_deceptive(character);
    // In JSON the control characters of ASCII stand behind a backslash.
    if !json.contains('\\') && json.chars().all(is_shown) {
        return Ok(json);
    }
    Ok(printable_texts(serde_json::to_value(data)?).to_string())
}

/// `data` with its texts as people may see them.
fn printable_texts(data: serde_json::Value) -> serde_json::Value {
    use serde_json::Value;
    match data {
        Value::String(text) => Value::String(printable(&text)),
        Value::Array(items) => items.into_iter().map(printable_texts).collect(),
        Value::Object(fields) => fields
            .into_iter()
            .map(|(name, value)| (name, printable_texts(value)))
            .collect(),
        other => other,
    }
}

/// A picture as the address that holds it.
pub(super) fn picture_address(picture: &RgbImage) -> io::Result<String> {
    let bytes = jpeg(picture)?;
    Ok(format!("data:image/jpeg;base64,{}", BASE64.encode(bytes)))
}
