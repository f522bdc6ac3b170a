//! What an overlay is drawn over.

use crate::frame::{Colors, Frame};

/// A frame to draw.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct Shown<'a> {
    /// Its name.
    pub title: &'a str,
    /// Its pixels.
    pub frame: &'a Frame<'a>,
    /// Its colors, where they are known.
    pub colors: Option<&'a Colors>,
}

impl<'a> Shown<'a> {
    /// A frame in grey.
    pub fn new(title: &'a str, frame: &'a Frame<'a>) -> Self {
        Self {
            title,
            frame,
            colors: None,
        }
    }
}
