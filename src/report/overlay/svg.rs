//! A drawing as SVG, its picture as JPEG within it.

use super::canvas::Canvas;
use super::encode;
use super::picture::Picture;
use crate::report::figure::{Rgb, beginning, write_shape};
use base64::Engine;
use base64::engine::general_purpose::STANDARD as BASE64;
use memchr::memmem;
use std::fmt::Write;
use std::io;

/// The mark of overlays.
const COMMENT: &str = "<!-- starpipe overlay -->";

/// Whether the file that begins with `head` is an overlay as SVG.
pub fn is_overlay(head: &[u8]) -> bool {
    memmem::find(head, COMMENT.as_bytes()).is_some()
}

/// The drawing over `picture`.
///
/// # Errors
/// If the picture cannot be encoded, which does not occur for frames within the limits of their size.
pub(super) fn document(canvas: &Canvas, picture: Picture) -> io::Result<String> {
    let (picture_width, picture_height) = (picture.width, picture.height);
    let jpeg = BASE64.encode(encode::jpeg(&picture.into_image())?);
    let mut svg = beginning(canvas.size.sides(), COMMENT, Rgb::BACKDROP);
    // Writing into a string does not fail.
    let _ = writeln!(
        svg,
        "<image width=\"{picture_width}\" height=\"{picture_height}\" href=\"data:image/jpeg;base64,{jpeg}\"/>"
    );
    for shape in &canvas.shapes {
        let _ = write_shape(&mut svg, shape);
    }
    svg.push_str("</svg>\n");
    Ok(svg)
}
