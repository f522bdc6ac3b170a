//! Drawings as SVG.

use super::color::Rgb;
use super::shape::{Anchor, DrawnShape, Halo, Letters, Stroke};
use crate::base::format::xml_escaped;
use memchr::memmem;
use std::fmt::{Result, Write};

/// Says what the drawing is.
pub(super) const COMMENT: &str = "<!-- starpipe figure -->";

/// Whether the file that begins with `head` is a figure as SVG.
pub fn is_figure(head: &[u8]) -> bool {
    memmem::find(head, COMMENT.as_bytes()).is_some()
}

/// The beginning of a drawing of this width and height, which `</svg>` ends.
pub(in crate::report) fn beginning(
    [width, height]: [usize; 2],
    comment: &str,
    background: Rgb,
) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\" font-family=\"DejaVu Sans, Verdana, sans-serif\" fill=\"none\" \
         stroke-linecap=\"round\" stroke-linejoin=\"round\">\n{comment}\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"{}\"/>\n",
        hex(background),
    )
}

pub(in crate::report) fn write_shape(svg: &mut String, shape: &DrawnShape) -> Result {
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
        DrawnShape::Disk {
            center: [x, y],
            radius,
            color,
            note,
        } => {
            let (color, end) = (hex(*color), end("circle", note));
            writeln!(
                svg,
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius:.1}\" fill=\"{color}\"{end}"
            )
        }
        DrawnShape::Polygon {
            points,
            color,
            note,
        } => {
            svg.push_str("<path d=\"");
            for (number, [x, y]) in points.iter().enumerate() {
                write!(svg, "{}{x:.1} {y:.1}", if number == 0 { "M" } else { "L" })?;
            }
            // The edge covers the seam to the next polygon.
            let (color, end) = (hex(*color), end("path", note));
            writeln!(
                svg,
                "Z\" fill=\"{color}\" stroke=\"{color}\" stroke-width=\"{}\"{end}",
                DrawnShape::SEAM_PX
            )
        }
        DrawnShape::Text(letters) => write_text(svg, letters),
    }
}

/// The end of an element, with what a pointer shows.
fn end(element: &str, note: &str) -> String {
    if note.is_empty() {
        return "/>".to_owned();
    }
    format!("><title>{}</title></{element}>", xml_escaped(note))
}

fn write_text(svg: &mut String, letters: &Letters) -> Result {
    let [x, y] = letters.at;
    write!(
        svg,
        "<text x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"{:.1}\"",
        letters.size
    )?;
    match letters.anchor {
        Anchor::Start => (),
        Anchor::Middle => svg.push_str(" text-anchor=\"middle\""),
        Anchor::End => svg.push_str(" text-anchor=\"end\""),
    }
    if letters.is_upright {
        write!(svg, " transform=\"rotate(-90 {x:.1} {y:.1})\"")?;
    }
    if let Some(width) = letters.width {
        write!(
            svg,
            " textLength=\"{width:.1}\" lengthAdjust=\"spacingAndGlyphs\""
        )?;
    }
    write!(svg, " fill=\"{}\"", hex(letters.color))?;
    if let Some(Halo { width, color }) = letters.halo {
        write!(
            svg,
            " stroke=\"{}\" stroke-opacity=\"0.78\" stroke-width=\"{width:.1}\" paint-order=\"stroke\"",
            hex(color)
        )?;
    }
    writeln!(svg, ">{}</text>", xml_escaped(&letters.text))
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
        svg.clear();
        let disk = DrawnShape::Disk {
            center: [1.0, 2.0],
            radius: 3.0,
            color: Rgb::BLACK,
            note: "<a&b>".to_owned(),
        };
        write_shape(&mut svg, &disk).unwrap();
        assert!(svg.ends_with("><title>&lt;a&amp;b&gt;</title></circle>\n"));
        svg.clear();
        let text = DrawnShape::Text(Letters {
            text: "<a&b>".to_owned(),
            at: [1.0, 2.0],
            size: 10.0,
            color: Rgb::BLACK,
            anchor: Anchor::End,
            is_upright: true,
            halo: None,
            width: None,
        });
        write_shape(&mut svg, &text).unwrap();
        assert_eq!(
            svg,
            "<text x=\"1.0\" y=\"2.0\" font-size=\"10.0\" text-anchor=\"end\" \
             transform=\"rotate(-90 1.0 2.0)\" fill=\"#000000\">&lt;a&amp;b&gt;</text>\n"
        );
    }
}
