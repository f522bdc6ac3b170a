//! The page of anything but a frame, from a plain description.

use super::table::PageTable;
use super::template::{PageKind, picture_address, render};
use crate::frame::Frame;
use crate::report::overlay::thumbnail;
use minijinja::context;
use minijinja::value::{Serde, Value};
use serde::Serialize;
use std::io;

const DOCUMENT: PageKind = PageKind {
    template: "document.html",
    script: include_str!("document.js"),
};

/// What a page says, in the order in which it says it.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct PageContent {
    /// Name of the page.
    pub title: String,
    /// What was asked, in a sentence.
    pub question: String,
    /// The answer, in a sentence.
    pub answer: String,
    /// The numbers of the answer, with their errors.
    pub facts: Vec<Fact>,
    /// Doubts, and what may help.
    pub notes: Vec<String>,
    /// The report as text.
    pub text: String,
    /// Figures.
    pub figures: Vec<PageFigure>,
    /// Title of the small pictures.
    pub thumbnails_title: String,
    /// Small pictures of frames.
    pub thumbnails: Vec<Thumbnail>,
    /// Tables.
    #[serde(skip)]
    pub tables: Vec<PageTable>,
    /// Options, catalog and whatever else the answer depends on.
    pub provenance: Vec<Fact>,
}

/// A named value.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Fact {
    /// Its name.
    pub name: String,
    /// The value with its unit.
    pub value: String,
}

impl Fact {
    /// A named value.
    pub fn new(name: impl Into<String>, value: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            value: value.into(),
        }
    }
}

/// A figure.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct PageFigure {
    /// What it shows.
    pub caption: String,
    /// The drawing: an element `svg`, which is taken as it is.
    pub svg: String,
    /// Whether it needs the whole width of the page.
    pub is_wide: bool,
    /// Whether its colors have a meaning, and stay as they are on a dark page.
    pub is_colored: bool,
}

/// A small picture of a frame.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Thumbnail {
    /// Name of the frame.
    pub name: String,
    /// What is to be said of it.
    pub text: String,
    /// The address that holds the picture.
    address: String,
    size_px: [u32; 2],
}

impl Thumbnail {
    /// Pictures on a page; the rest of the frames is in its tables.
    pub const MAX: usize = 40;

    /// A picture of `frame`, at most 240 pixels wide.
    ///
    /// # Errors
    /// If it cannot be encoded, which does not occur for pictures of this size.
    pub fn new(name: String, text: String, frame: &Frame<'_>) -> io::Result<Self> {
        const MAX_PX: usize = 240;
        let picture = thumbnail(frame, MAX_PX);
        Ok(Self {
            name,
            text,
            address: picture_address(&picture)?,
            size_px: [picture.width(), picture.height()],
        })
    }
}

impl PageContent {
    /// The page as HTML.
    ///
    /// # Errors
    /// If a number cannot be written as JSON, which does not occur with these types.
    pub fn to_html(&self) -> io::Result<String> {
        let titles: Vec<String> = self.tables.iter().map(PageTable::title).collect();
        let values = context! { titles, ..Value::from(Serde(self)) };
        render(&DOCUMENT, values, &self.tables)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_text_and_neither_tags_nor_the_end_of_a_script() {
        let name = "</script><b>\"'".to_owned();
        let frame = Frame::new(64, 48, vec![0.5; 64 * 48]).unwrap();
        let page = PageContent {
            title: name.clone(),
            answer: name.clone(),
            facts: vec![Fact::new(name.clone(), name.clone())],
            notes: vec![name.clone()],
            thumbnails: vec![Thumbnail::new(name.clone(), name.clone(), &frame).unwrap()],
            tables: vec![PageTable::from_csv(&name, "a,b\n</script><b>,1\n").unwrap()],
            provenance: vec![Fact::new("options", name.clone())],
            ..PageContent::default()
        };
        let html = page.to_html().unwrap();
        assert!(!html.contains("</script><b>"));
        assert_eq!(html.matches("</script>").count(), 2);
        assert_eq!(html.matches("<svg").count(), 0);
    }
}
