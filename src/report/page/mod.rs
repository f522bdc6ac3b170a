//! What was found, and how sure is that? A page to look at, in one file.
//!
//! ([`FrameReport`](super::FrameReport), [`Solution`](crate::solve::Solution), [`Shown`](super::overlay::Shown))
//! → [`html`] → the page of a frame
//!
//! [`PageContent`] → [`PageContent::to_html`] → a page of anything else, as a command describes it
//!
//! Pages need neither network nor other files. Nothing is read or written. All begin alike (`base.html`):
//!
//! 1. The answer and its doubts, as text that is there without scripts, too.
//! 2. What can be seen: the picture of a frame with its detections, or figures and small pictures.
//! 3. Tables that sort and filter (`table.js`). Their rows come from numbers in the page.
//! 4. Where the answer is from: version, options, catalog.

mod data;
mod document;
mod frame;
mod table;
mod template;

pub use document::{Fact, PageContent, PageFigure, Thumbnail};
pub use frame::html;
pub use frame::{FrameView, preview, view};
pub use table::PageTable;

use memchr::memmem;

/// Whether the file that begins with `head` is a page written by starpipe.
pub fn is_page(head: &[u8]) -> bool {
    const GENERATOR: &[u8] = b"<meta name=\"generator\" content=\"starpipe\">";
    memmem::find(head, GENERATOR).is_some()
}
