//! Where are the detections? Regions that SAOImage DS9 and other viewers draw over the frame.
//!
//! [`FrameReport`] → text. Regions are in the pixels of the file: (1, 1) is the centre of its first one, as in
//! FITS.
//!
//! # Reference
//! SAOImage DS9 reference manual, "Regions".

use super::frame_report::{FrameReport, StarReport};
use crate::base::coords::PixelPoint;
use std::fmt::Write;

/// The first line, by which DS9 knows the format.
pub const FIRST_LINE: &str = "# Region file format: DS9 version 4.1";

/// The detections of a frame: circles with names are identified, boxes are not, points with a cross are
/// not shaped like stars.
pub fn ds9(report: &FrameReport) -> String {
    let mut text = format!("{FIRST_LINE}\nglobal color=cyan width=1\nimage\n");
    for star in &report.stars {
        let [x, y] = report.file_pixel(&PixelPoint::new(star.x, star.y));
        // Writing to a string does not fail.
        let _ = writeln!(text, "{}", region(star, x, y));
    }
    text
}

fn region(star: &StarReport, x: f64, y: f64) -> String {
    /// Radius in pixels.
    const RADIUS_PX: f64 = 6.0;
    if let Some(name) = star.name.as_ref().or(star.id.as_ref()) {
        return format!("circle({x:.3},{y:.3},{RADIUS_PX}) # text={{{name}}}");
    }
    if !star.is_star_like() {
        return format!("point({x:.3},{y:.3}) # point=x color=magenta");
    }
    let side = 2.0 * RADIUS_PX;
    format!("box({x:.3},{y:.3},{side},{side},0) # color=orange")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalog::Catalog;
    use crate::frame::RowOrder;
    use crate::identify::SearchFailure;
    use crate::solve::sample;
    use crate::solve::{Outcome, Reason};

    #[test]
    fn regions_are_in_the_pixels_of_the_file() {
        let reason = Reason::Search(SearchFailure::TooFewStars {
            found: 2,
            needed: 4,
        });
        let solution = sample::solution(400, 300, Outcome::NotIdentified(reason));
        let mut report = FrameReport::new("a.fits", &solution, Catalog::built_in());
        let star = |x, y| StarReport {
            x,
            y,
            ..StarReport::default()
        };
        report.stars = vec![star(0.0, 0.0), star(10.5, 299.0)];
        report.stars[1].name = Some("Vega (3 alp Lyr)".to_owned());
        let lines = |report: &FrameReport| -> Vec<String> {
            ds9(report).lines().skip(3).map(str::to_owned).collect()
        };
        assert_eq!(
            lines(&report),
            [
                "box(1.000,1.000,12,12,0) # color=orange",
                "circle(11.500,300.000,6) # text={Vega (3 alp Lyr)}",
            ]
        );
        report.row_order = Some(RowOrder::BottomUp);
        report.stars[0].flags = vec!["trail"];
        assert_eq!(
            lines(&report),
            [
                "point(1.000,300.000) # point=x color=magenta",
                "circle(11.500,1.000,6) # text={Vega (3 alp Lyr)}",
            ]
        );
    }
}
