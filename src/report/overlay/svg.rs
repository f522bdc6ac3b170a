//! A drawing as SVG, its picture as JPEG within it.

use super::canvas::{Canvas, DrawnShape, Rgb, Stroke};
use super::encode;
use super::letters::text_width;
use super::picture::Picture;
use crate::base::format::xml_escaped;
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
    let (width, height) = (canvas.size.width, canvas.size.height);
    let (picture_width, picture_height) = (picture.width, picture.height);
    let jpeg = BASE64.encode(encode::jpeg(&picture.into_image())?);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\" font-family=\"DejaVu Sans, Verdana, sans-serif\" fill=\"none\" \
         stroke-linecap=\"round\" stroke-linejoin=\"round\">\n{COMMENT}\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"{}\"/>\n\
         <image width=\"{picture_width}\" height=\"{picture_height}\" href=\"data:image/jpeg;base64,{jpeg}\"/>\n",
        hex(Rgb::BACKDROP),
    );
    for shape in &canvas.shapes {
        // Writing into a string does not fail.
        let _ = write_shape(&mut svg, shape);
    }
    svg.push_str("</svg>\n");
    Ok(svg)
}

fn write_shape(svg: &mut String, shape: &DrawnShape) -> std::fmt::Result {
    match shape {
        DrawnShape::Circle {
            center: [x, y],
            radius,
            stroke,
        } => writeln!(
            svg,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius:.1}\" {}/>",
            attributes(stroke)
        ),
        DrawnShape::Line { points, stroke } => {
            let points: Vec<String> = points
                .iter()
                .map(|[x, y]| format!("{x:.1},{y:.1}"))
                .collect();
            let (points, stroke) = (points.join(" "), attributes(stroke));
            writeln!(svg, "<polyline points=\"{points}\" {stroke}/>")
        }
        DrawnShape::Text {
            text,
            at: [x, y],
            size,
            halo,
            color,
        } => writeln!(
            // The width keeps names apart in other fonts, too.
            svg,
            "<text x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"{size:.1}\" textLength=\"{:.1}\" \
             lengthAdjust=\"spacingAndGlyphs\" fill=\"{}\" stroke=\"#000\" stroke-opacity=\"0.78\" \
             stroke-width=\"{halo:.1}\" paint-order=\"stroke\">{}</text>",
            text_width(text, *size),
            hex(*color),
            xml_escaped(text),
        ),
    }
}

fn attributes(stroke: &Stroke) -> String {
    let Stroke { width, color, dash } = stroke;
    let dash = dash.map_or(String::new(), |length| {
        format!(" stroke-dasharray=\"{length:.1}\"")
    });
    format!(
        "stroke=\"{}\" stroke-width=\"{width:.2}\"{dash}",
        hex(*color)
    )
}

fn hex(Rgb([r, g, b]): Rgb) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_become_elements_and_letters_are_escaped() {
        let mut svg = String::new();
        let stroke = Stroke {
            width: 1.5,
            color: Rgb([255, 0, 16]),
            dash: Some(4.0),
        };
        let points = vec![[0.0, 1.0], [2.25, 3.0]];
        write_shape(&mut svg, &DrawnShape::Line { points, stroke }).unwrap();
        assert_eq!(
            svg,
            "<polyline points=\"0.0,1.0 2.2,3.0\" stroke=\"#ff0010\" stroke-width=\"1.50\" stroke-dasharray=\"4.0\"/>\n"
        );
        let text = DrawnShape::Text {
            text: "<a&b>".to_owned(),
            at: [1.0, 2.0],
            size: 10.0,
            halo: 1.0,
            color: Rgb::WHITE,
        };
        write_shape(&mut svg, &text).unwrap();
        assert!(svg.contains(">&lt;a&amp;b&gt;</text>"));
    }
}
