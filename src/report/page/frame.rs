//! The page of a frame.
//!
//! `frame.js` draws the detections over the picture, and the figures: magnitude against flux, residuals,
//! completeness with the predicted limit.

use super::data::PageData;
use super::template::{PageKind, picture_address, render, render_view, shown_data};
use crate::catalog::Catalog;
use crate::frame::Frame;
use crate::report::overlay::{OverlayOptions, Shown, jpeg, photograph, thumbnail};
use crate::report::{FrameReport, TextOptions, sky_figure};
use crate::solve::Solution;
use minijinja::context;
use minijinja::value::{Serde, Value};
use std::io;

const FRAME: PageKind = PageKind {
    template: "frame.html",
    script: concat!(
        include_str!("frame.js"),
        "showFrame(document, JSON.parse(document.getElementById(\"data\").textContent));\n"
    ),
};

/// The page of a frame; without `shown`, as for a list of centroids, without its picture.
///
/// # Errors
/// If the picture cannot be encoded, which does not occur for frames within the limits of their size.
pub fn html(
    report: &FrameReport,
    solution: &Solution,
    catalog: &Catalog,
    shown: Option<&Shown<'_>>,
    options: &OverlayOptions,
) -> io::Result<String> {
    let data = PageData::new(report, solution, catalog);
    let picture = shown.map(|shown| picture(shown, solution, options));
    let title = shown.map_or(report.frame.as_str(), |shown| shown.title);
    let values = values(report, title, picture.transpose()?, &data);
    render(&FRAME, values, &data)
}

/// What a page with views of its own shows of a frame: elements, and the data of `showFrame` in `frame.js`,
/// which brings them to life.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FrameView {
    /// The answer, the picture and the table, as elements.
    pub html: String,
    /// JSON.
    pub data: String,
}

/// The view of a frame on another page.
///
/// # Errors
/// As [`html`].
pub fn view(
    report: &FrameReport,
    solution: &Solution,
    catalog: &Catalog,
    shown: &Shown<'_>,
    options: &OverlayOptions,
) -> io::Result<FrameView> {
    let data = PageData::new(report, solution, catalog);
    let picture = picture(shown, solution, options)?;
    let values = values(report, shown.title, Some(picture), &data);
    Ok(FrameView {
        html: render_view(&FRAME, values)?,
        data: shown_data(&data)?,
    })
}

/// A frame in grey, as JPEG of at most `most_px` columns, to look at before it is solved.
///
/// # Errors
/// As [`html`].
pub fn preview(frame: &Frame<'_>, most_px: usize) -> io::Result<Vec<u8>> {
    jpeg(&thumbnail(frame, most_px))
}

fn picture(shown: &Shown<'_>, solution: &Solution, options: &OverlayOptions) -> io::Result<String> {
    picture_address(&photograph(shown, solution.background.as_ref(), options))
}

/// What the template takes.
fn values(
    report: &FrameReport,
    title: &str,
    picture: Option<String>,
    data: &PageData<'_>,
) -> Value {
    let notes: Vec<String> = report.notes.iter().map(|note| note.text.clone()).collect();
    let sky = data.sky.iter();
    let layers: Vec<[&str; 2]> = sky.map(|layer| [layer.key, layer.title]).collect();
    context! {
        report => Value::from(Serde(report)),
        title,
        notes,
        text => report.to_text(TextOptions::default()),
        picture,
        layers,
        sky => sky_figure::svg(report),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::format::is_deceptive;
    use crate::identify::SearchFailure;
    use crate::report::frame_report::StarReport;
    use crate::report::page::is_page;
    use crate::solve::{Outcome, Reason, sample};

    /// A frame with one detection that is not identified.
    fn frame() -> (Solution, FrameReport) {
        let reason = Reason::Search(SearchFailure::TooFewStars {
            found: 1,
            needed: 4,
        });
        let solution = sample::solution(400, 300, Outcome::NotIdentified(reason));
        let mut report = FrameReport::new("a.tif", &solution, Catalog::built_in());
        report.stars.push(StarReport::default());
        (solution, report)
    }

    #[test]
    fn names_are_text_and_neither_tags_nor_the_end_of_a_script() {
        let (solution, mut report) = frame();
        report.frame = "<script>alert(1)</script>.tif".to_owned();
        report.stars[0].name = Some("</script><b>".to_owned());
        let page = html(
            &report,
            &solution,
            Catalog::built_in(),
            None,
            &OverlayOptions::default(),
        )
        .unwrap();
        assert!(!page.contains("<script>alert") && !page.contains("</script><b>"));
        assert!(page.contains("&lt;script&gt;alert(1)&lt;&#x2f;script&gt;.tif"));
        assert_eq!(page.matches("</script>").count(), 2);
        assert!(is_page(page.as_bytes()));
    }

    #[test]
    fn names_show_what_would_change_how_they_are_drawn() {
        let (solution, mut report) = frame();
        let name = "a\n\t\u{1b}[31m\u{202e}\u{85}\u{2066}\"'.tif";
        report.frame = name.to_owned();
        let page = html(
            &report,
            &solution,
            Catalog::built_in(),
            None,
            &OverlayOptions::default(),
        )
        .unwrap();
        let is_raw = |c: char| c != '\n' && (c.is_control() || is_deceptive(c));
        assert!(!page.contains(is_raw) && !page.contains("<title>a\n"));
        assert!(
            page.contains("<title>a\\n\\t\\u{1b}[31m\\u{202e}\\u{85}\\u{2066}&quot;&#x27;.tif")
        );
        let data = "a\\\\n\\\\t\\\\u{1b}[31m\\\\u{202e}\\\\u{85}\\\\u{2066}\\\"'.tif";
        assert_eq!(shown_data(&[name]).unwrap(), format!("[\"{data}\"]"));
    }

    #[test]
    fn a_view_has_the_answer_and_neither_style_nor_scripts() {
        let (solution, report) = frame();
        let pixels = Frame::new(400, 300, vec![0.5; 400 * 300]).unwrap();
        let shown = Shown::new("a <b>.tif", &pixels);
        let view = view(
            &report,
            &solution,
            Catalog::built_in(),
            &shown,
            &OverlayOptions::default(),
        )
        .unwrap();
        assert!(view.html.contains("Not identified") && view.html.contains("id=\"view\""));
        assert!(view.html.contains("a &lt;b&gt;.tif"));
        for mark in ["<script", "<style", "<html", "style=\""] {
            assert!(!view.html.contains(mark), "{mark}");
        }
        let data: serde_json::Value = serde_json::from_str(&view.data).unwrap();
        assert_eq!(data["width"], 400);
    }

    #[test]
    fn a_page_needs_no_other_file() {
        let (solution, report) = frame();
        let page = html(
            &report,
            &solution,
            Catalog::built_in(),
            None,
            &OverlayOptions::default(),
        )
        .unwrap();
        for reference in ["src=\"", "http:", "https:", "url(", "@import"] {
            let found = page
                .replace("http://www.w3.org/2000/svg", "")
                .contains(reference);
            assert!(!found, "{reference}");
        }
    }
}
