//! What does a frame show, and how sure is that? A page to look at, in one file.
//!
//! ([`FrameReport`], [`Solution`], [`Shown`]) → HTML, which needs neither network nor other files. Nothing is
//! read or written.
//!
//! 1. The answer and its doubts, as text that is there without scripts, too.
//! 2. The picture, as JPEG, with the detections over it; it zooms and moves.
//! 3. Figures: magnitude against flux, residuals, completeness with the predicted limit.
//! 4. The table of the detections.
//!
//! `page.js` draws 2 to 4 from the numbers in the page.

mod data;

use super::overlay::{OverlayOptions, Shown, photograph};
use super::{FrameReport, TextOptions};
use crate::pipeline::Solution;
use base64::Engine;
use base64::engine::general_purpose::STANDARD as BASE64;
use data::PageData;
use image::codecs::jpeg::JpegEncoder;
use memchr::memmem;
use minijinja::value::{Serde, Value};
use minijinja::{Environment, context};
use std::io;

/// Quality of the picture, as JPEG counts it.
const JPEG_QUALITY: u8 = 85;

/// The page of a frame; without `shown`, as for a list of centroids, without its picture.
///
/// # Errors
/// If the picture cannot be encoded, which does not occur for frames within the limits of their size.
pub fn html(
    report: &FrameReport,
    solution: &Solution,
    shown: Option<&Shown<'_>>,
    options: &OverlayOptions,
) -> io::Result<String> {
    let picture = shown
        .map(|shown| jpeg(shown, solution, options))
        .transpose()?;
    let picture = picture.map(|jpeg| format!("data:image/jpeg;base64,{}", BASE64.encode(jpeg)));
    let mut environment = Environment::new();
    environment
        .add_template("frame.html", include_str!("frame.html"))
        .map_err(io::Error::other)?;
    let page = environment.get_template("frame.html").and_then(|page| {
        page.render(context! {
            report => Value::from(Serde(report)),
            title => shown.map_or(report.frame.as_str(), |shown| shown.title),
            text => report.to_text(TextOptions::default()),
            picture,
            data => script_data(&PageData::of(report, solution)),
            style => include_str!("page.css"),
            script => include_str!("page.js"),
        })
    });
    page.map_err(io::Error::other)
}

/// Whether the file that begins with `head` is a page written by starpipe.
#[doc(hidden)]
pub fn is_page(head: &[u8]) -> bool {
    const GENERATOR: &[u8] = b"<meta name=\"generator\" content=\"starpipe\">";
    memmem::find(head, GENERATOR).is_some()
}

/// The frame without marks, as JPEG.
fn jpeg(shown: &Shown<'_>, solution: &Solution, options: &OverlayOptions) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let picture = photograph(shown, solution.background.as_ref(), options);
    let encoder = JpegEncoder::new_with_quality(&mut bytes, JPEG_QUALITY);
    picture
        .write_with_encoder(encoder)
        .map_err(io::Error::other)?;
    Ok(bytes)
}

/// JSON that may stand in a script: a name cannot end it.
fn script_data(data: &PageData) -> String {
    let json = serde_json::to_string(data).expect("numbers and texts only");
    json.replace('<', "\\u003c")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::SearchFailure;
    use crate::pipeline::{Outcome, Reason};
    use crate::report::{frame_report::StarReport, sample};
    use crate::sky::catalog::Catalog;

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
        let page = html(&report, &solution, None, &OverlayOptions::default()).unwrap();
        assert!(!page.contains("<script>alert") && !page.contains("</script><b>"));
        assert!(page.contains("&lt;script&gt;alert(1)&lt;&#x2f;script&gt;.tif"));
        assert_eq!(page.matches("</script>").count(), 2);
        assert!(is_page(page.as_bytes()));
    }

    #[test]
    fn a_page_needs_no_other_file() {
        let (solution, report) = frame();
        let page = html(&report, &solution, None, &OverlayOptions::default()).unwrap();
        for reference in ["src=\"", "http:", "https:", "url(", "@import"] {
            let found = page
                .replace("http://www.w3.org/2000/svg", "")
                .contains(reference);
            assert!(!found, "{reference}");
        }
    }
}
