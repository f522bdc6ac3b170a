//! What the routes of a job answer.

use crate::base::coords::PixelPoint;
use crate::doors::field::Field;
use crate::report::{AnnotationReport, FrameReport};
use crate::solve::Solution;
use serde::{Deserialize, Serialize};

/// `jobs/ID/calibration`: where the picture is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// Right ascension of the centre, in degrees.
    pub ra: f64,
    /// Declination of the centre, in degrees.
    pub dec: f64,
    /// Width of the field: the pixel scale times the columns.
    pub width_arcsec: f64,
    /// Height of the field.
    pub height_arcsec: f64,
    /// Half of its diagonal, in degrees.
    pub radius: f64,
    /// Pixel scale at the centre, in arcseconds.
    pub pixscale: f64,
    /// Position angle of the direction to later rows, in degrees.
    pub orientation: f64,
    /// 1 where the determinant of `CD` is positive, else −1.
    pub parity: f64,
}

impl From<&Field> for Calibration {
    fn from(field: &Field) -> Self {
        let [ra, dec] = field.centre_deg;
        let [width_arcsec, height_arcsec] = field.size_deg.map(|side_deg| side_deg * 3600.0);
        Self {
            ra,
            dec,
            width_arcsec,
            height_arcsec,
            radius: field.radius_deg(),
            pixscale: field.pixel_scale_arcsec,
            orientation: field.orientation_deg,
            parity: if field.is_mirrored { 1.0 } else { -1.0 },
        }
    }
}

/// One of `jobs/ID/annotations`: what has a name in the picture, and where it is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MarkedObject {
    /// `bright` for stars, `ngc` and `ic` for deep-sky objects; `body`, `constellation` and `radiant`, which
    /// astrometry.net does not have.
    #[serde(rename = "type")]
    pub kind: String,
    /// Its name, and its designation where it has another.
    pub names: Vec<String>,
    /// Its place in the rows of the file; the first pixel is (1, 1).
    pub pixelx: f64,
    /// The row.
    pub pixely: f64,
    /// Half of its longer side, in pixels; 0 where it has no size.
    pub radius: f64,
    /// V magnitude, where it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vmag: Option<f64>,
}

/// One note on the picture, its header or its hints.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct NoteOfJob {
    /// For programs: `scale_wrong`, `direction_wrong` and so on.
    pub code: String,
    /// The sentence.
    pub text: String,
}

/// What a job found, or why it found nothing.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct JobAnswers {
    /// Where the picture is; `None` where it is not identified.
    pub calibration: Option<Calibration>,
    /// What has a name in it.
    pub annotations: Vec<MarkedObject>,
    /// What is odd: hints that were dropped, among others.
    pub notes: Vec<NoteOfJob>,
    /// What it shows, in one sentence.
    pub sentence: Option<String>,
    /// Why it is not identified.
    pub reason: Option<String>,
}

impl JobAnswers {
    /// The answers for a picture, or a list of stars.
    pub fn new(report: &FrameReport, solution: &Solution) -> Self {
        // The number of a star in its catalogue says nothing to people.
        let has_name = |shown: &&AnnotationReport| {
            shown.kind != "star" || shown.id.as_ref() != Some(&shown.name)
        };
        let marked = report.annotations.iter().filter(has_name);
        let notes = report.notes.iter().map(|note| NoteOfJob {
            code: note.code.to_owned(),
            text: note.text.clone(),
        });
        Self {
            calibration: Field::new(solution).as_ref().map(Calibration::from),
            annotations: marked.map(|shown| marked_object(report, shown)).collect(),
            notes: notes.collect(),
            sentence: report.sentence.clone(),
            reason: report.reason.clone(),
        }
    }

    /// The answers where the picture cannot be read.
    pub fn failed(reason: String) -> Self {
        Self {
            reason: Some(reason),
            ..Self::default()
        }
    }

    /// `jobs/ID/objects_in_field` and the tags: the names of what is in the picture.
    pub fn names(&self) -> Vec<&str> {
        let names = self.annotations.iter().flat_map(|object| &object.names);
        names.map(String::as_str).collect()
    }
}

fn marked_object(report: &FrameReport, shown: &AnnotationReport) -> MarkedObject {
    let kind = match (shown.kind, &shown.id) {
        ("star", _) => "bright",
        ("deep_sky", Some(id)) if id.starts_with("IC ") => "ic",
        ("deep_sky", _) => "ngc",
        (kind, _) => kind,
    };
    let names = match kind {
        "bright" => vec![shown.label.clone()],
        _ => {
            let others = shown.id.iter().filter(|id| **id != shown.name);
            std::iter::once(&shown.name)
                .chain(others)
                .cloned()
                .collect()
        }
    };
    let [pixelx, pixely] = report.file_pixel(&PixelPoint::new(shown.x, shown.y));
    MarkedObject {
        kind: kind.to_owned(),
        names,
        pixelx,
        pixely,
        radius: shown.radius_px.unwrap_or(0.0),
        vmag: shown.vmag,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::RowOrder;
    use crate::{Catalog, Context, IndexedCatalog, Workspace, solve_file};

    #[test]
    fn answers_are_in_the_rows_of_the_file() {
        let catalog = Catalog::built_in().limited_to(6.0);
        let indexed = IndexedCatalog::build(&catalog, &|_| ());
        let context = Context::new(&indexed);
        let file = "fixtures/orion/orion.png";
        let mut solution = solve_file(file, None, &context, &mut Workspace::new()).unwrap();
        let answers = |solution: &Solution| {
            JobAnswers::new(&FrameReport::new(file, solution, &catalog), solution)
        };
        let top_down = answers(&solution);
        solution.row_order = Some(RowOrder::BottomUp);
        let bottom_up = answers(&solution);
        let parities = [&top_down, &bottom_up].map(|answers| answers.calibration.unwrap().parity);
        // A picture as one sees it has its rows downward.
        assert_eq!(parities, [1.0, -1.0]);
        let rows = solution.height as f64 + 1.0;
        for (first, second) in top_down.annotations.iter().zip(&bottom_up.annotations) {
            assert_eq!(first.names, second.names);
            assert!((first.pixely - (rows - second.pixely)).abs() < 1e-9);
        }
        for name in ["Rigel", "Orion"] {
            assert!(top_down.names().contains(&name), "{:?}", top_down.names());
        }
    }
}
