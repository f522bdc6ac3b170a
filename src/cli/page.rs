//! Pages of a command's results, which `--html` asks for.
//!
//! Each command describes its page ([`Page`]) from its own report, with its figures and tables.

use super::exit::CommandError;
use super::output::files::NewFile;
use super::output::overwrite;
use anyhow::Context;
use clap::Args;
use starpipe::catalog::Catalog;
use starpipe::frame::{self, Buffers};
use starpipe::report::figure::Sheet;
use starpipe::report::page::{Fact, PageContent, PageFigure, PageTable, Thumbnail};
use std::ffi::OsStr;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub(crate) struct HtmlOption {
    /// Also write a page for a browser: the result, its notes, figures and tables in one file
    /// [default FILE: named after the command, next to the other results]
    #[arg(long, value_name = "FILE.html", require_equals = true, value_parser = page_name)]
    html: Option<Option<PathBuf>>,
}

fn page_name(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let extension = path.extension().and_then(OsStr::to_str);
    match extension.map(str::to_ascii_lowercase).as_deref() {
        Some("html" | "htm") => Ok(path),
        _ => Err("expected a file name ending in .html".to_owned()),
    }
}

impl HtmlOption {
    /// The file of the page, if there is to be one; `default` where none is named.
    pub(crate) fn path(&self, default: impl FnOnce() -> PathBuf) -> Option<PathBuf> {
        let asked = self.html.as_ref()?;
        Some(asked.clone().unwrap_or_else(default))
    }

    /// As [`path`](Self::path), and refuses to overwrite one of `inputs`, or a file that is not a page of
    /// starpipe.
    pub(crate) fn checked_path(
        &self,
        inputs: &[PathBuf],
        default: impl FnOnce() -> PathBuf,
    ) -> Result<Option<PathBuf>, CommandError> {
        let path = self.path(default);
        if let Some(path) = &path {
            overwrite::check_page(inputs, path)?;
        }
        Ok(path)
    }
}

/// The file of a page.
pub(crate) fn file(path: &Path, page: &PageContent) -> anyhow::Result<NewFile> {
    let html = page.to_html().context("writing the page")?;
    Ok((path.to_owned(), html.into_bytes()))
}

/// A figure of a page.
pub(crate) fn figure(sheet: &Sheet, caption: &str) -> PageFigure {
    PageFigure {
        caption: caption.to_owned(),
        svg: sheet.svg(),
        is_wide: sheet.is_wide(),
        is_colored: sheet.is_colored(),
    }
}

/// A table of a page, from a command's CSV.
pub(crate) fn table(title: &str, csv: &str) -> anyhow::Result<PageTable> {
    PageTable::from_csv(title, csv).context("reading a table of the page")
}

/// The command line.
pub(crate) fn options() -> Fact {
    let words = std::env::args_os().skip(1);
    let words: Vec<String> = words.map(|word| quoted(&word.to_string_lossy())).collect();
    Fact::new("Command", format!("starpipe {}", words.join(" ")))
}

/// A word as a shell takes it.
fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "_-./=:,+%@".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}

/// The catalog of stars.
pub(crate) fn catalog(catalog: &Catalog) -> Fact {
    Fact::new(
        "Catalog",
        format!("{}, {} stars", catalog.title(), catalog.stars().len()),
    )
}

/// A note on how many frames have which note, if any has one.
pub(crate) fn codes_note<'a>(codes: impl Iterator<Item = (&'a str, u64)>) -> Option<String> {
    let counted: Vec<String> = codes
        .map(|(code, frames)| format!("{code} {frames}"))
        .collect();
    let any = !counted.is_empty();
    any.then(|| format!("Frames with a note, by its code: {}.", counted.join(", ")))
}

/// Frames that are read for small pictures: many may be gone, or no images.
const MAX_TRIED: usize = 4 * Thumbnail::MAX;

/// Small pictures of frames that are named as files, or as images of files (`mosaic.fits[1]`), each with what is
/// to be said of it: the first ones of those that can be read.
pub(crate) fn thumbnails(frames: impl IntoIterator<Item = (String, String)>) -> Vec<Thumbnail> {
    let mut buffers = Buffers::new();
    let picture = |(name, text): (String, String)| {
        let (path, page) = file_and_page(&name);
        let frame = frame::read_page_with(path, page, &mut buffers).ok()?;
        let picture = Thumbnail::new(name, text, &frame).ok();
        buffers.recycle(frame);
        picture
    };
    frames
        .into_iter()
        .take(MAX_TRIED)
        .filter_map(picture)
        .take(Thumbnail::MAX)
        .collect()
}

fn file_and_page(name: &str) -> (&str, Option<NonZeroUsize>) {
    let parts = name
        .strip_suffix(']')
        .and_then(|name| name.rsplit_once('['));
    let image = parts.and_then(|(path, page)| Some((path, page.parse().ok()?)));
    match image {
        Some((path, page)) if !Path::new(name).exists() => (path, Some(page)),
        _ => (name, None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_is_shown_as_it_can_be_typed() {
        for (word, shown) in [
            ("--html=a.html", "--html=a.html"),
            ("my night/*.fits", "'my night/*.fits'"),
            ("it's", "'it'\\''s'"),
            ("", "''"),
        ] {
            assert_eq!(quoted(word), shown);
        }
    }

    #[test]
    fn an_image_of_a_file_has_its_number() {
        let (path, page) = file_and_page("a/mosaic.fits[12]");
        assert_eq!(
            (path, page.map(NonZeroUsize::get)),
            ("a/mosaic.fits", Some(12))
        );
        assert_eq!(file_and_page("a[b].fits"), ("a[b].fits", None));
        assert_eq!(file_and_page("a.fits[x]"), ("a.fits[x]", None));
    }

    #[test]
    fn a_page_is_html() {
        assert!(page_name("a.html").is_ok() && page_name("A.HTM").is_ok());
        assert_eq!(
            page_name("night.fits").unwrap_err(),
            "expected a file name ending in .html"
        );
    }
}
