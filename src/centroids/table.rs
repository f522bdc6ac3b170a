//! Lists of centroids as tables.

use super::columns::{Brightness, CentroidColumns};
use super::list::CentroidList;
use super::text::ListText;
use crate::base::coords::PixelPoint;
use crate::base::files;
use crate::base::format::{excerpt, table_name};
use crate::base::remedy::Remedy;
use crate::camera::FrameSizeError;
use crate::identify::Photometry;
use std::fmt;

/// Why a list of centroids cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub struct CentroidListError {
    /// The line, from 1 and with the heading, where it is one line's.
    pub line: Option<u64>,
    /// What was found and expected.
    pub problem: String,
    remedies: &'static [Remedy],
}

impl fmt::Display for CentroidListError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(line) = self.line {
            write!(f, "line {line}: ")?;
        }
        f.write_str(&self.problem)
    }
}

impl CentroidListError {
    fn of_line(line: u64, problem: String) -> Self {
        Self {
            line: Some(line),
            problem,
            remedies: &[],
        }
    }

    /// The problem of a row, from 1; 0 is one that is not known.
    pub(super) fn of_row(row: u64, problem: String) -> Self {
        Self::of_list(match row {
            0 => problem,
            row => format!("row {row}: {problem}"),
        })
    }

    pub(super) fn of_list(problem: impl Into<String>) -> Self {
        Self {
            line: None,
            problem: problem.into(),
            remedies: &[],
        }
    }

    /// The options that may help.
    pub const fn remedies(&self) -> &'static [Remedy] {
        self.remedies
    }
}

impl From<FrameSizeError> for CentroidListError {
    fn from(error: FrameSizeError) -> Self {
        Self::of_list(error.to_string())
    }
}

/// What is known of a list besides its content.
#[derive(Debug, Clone, Default)]
#[non_exhaustive]
pub struct CentroidListOptions {
    /// Width of the frame in pixels, stated or its camera's.
    pub width: Option<u32>,
    /// Its height.
    pub height: Option<u32>,
    /// The frame whose rows are used, where the list is of several.
    pub frame: Option<String>,
}

/// Largest coordinate of a frame whose size is unknown; larger ones are errors in the list.
const MAX_COORDINATE_PX: f64 = 1e6;
/// How far outside the frame a centroid may lie, in pixels: stars at the border are cut.
const BORDER_PX: f64 = 5.0;

impl CentroidList {
    /// Parses a table with a heading: positions in pixels in `x` and `y`, and `vmag`, `mag` or
    /// `flux`, or the names that photutils, SEP and SExtractor have for them; others are ignored. A
    /// table of starpipe gives errors and flags, too. Without a brightness the rows are in its order.
    ///
    /// A number that is missing or none is NaN: [`usable`](Self::usable) leaves such rows out.
    ///
    /// # Errors
    /// [`CentroidListError`]: a column is missing, a position outside the frame, no row is usable, or
    /// the list has several frames of which none is chosen.
    pub fn parse(table: &[u8], options: &CentroidListOptions) -> Result<Self, CentroidListError> {
        let table = files::without_byte_order_mark(table)
            .map_err(|error| CentroidListError::of_list(error.to_string()))?;
        let ListText { text, separator } = ListText::decode(table);
        let mut reader = self::reader(&text, separator);
        let headings = reader.headers().map_err(not_a_table)?;
        let rows = || self::reader(&text, separator).into_records().flatten();
        let columns =
            CentroidColumns::find(headings, separator, rows).map_err(CentroidListError::of_list)?;
        let size = [options.width, options.height].map(|side| side.map(|side| side as usize));
        let mut centroids = Vec::new();
        // The problem of the first row that is not usable, with its line.
        let mut first_problem = None;
        // As tables have it.
        let chosen = options.frame.as_deref().map(table_name);
        let mut frames = Frames::new(chosen.as_deref());
        for record in reader.records() {
            let record = record.map_err(not_a_table)?;
            // Spreadsheets write such lines at the end of a table.
            if record.iter().all(str::is_empty) {
                continue;
            }
            if !frames.is_wanted(columns.frame_of(&record)) {
                continue;
            }
            let line = record.position().map_or(0, csv::Position::line);
            let mut centroid = columns.centroid(&record, centroids.len());
            centroid.row = line;
            if centroid.problem().is_none() {
                check_inside(&centroid.position, size)
                    .map_err(|problem| CentroidListError::of_line(line, problem))?;
            } else if first_problem.is_none() {
                first_problem = columns.problem(&record).map(|problem| (line, problem));
            }
            centroids.push(centroid);
        }
        frames.check()?;
        if centroids
            .iter()
            .all(|centroid| centroid.problem().is_some())
        {
            return Err(match first_problem {
                Some((line, problem)) => CentroidListError::of_line(line, problem),
                None => CentroidListError::of_list("found a heading without centroids below it"),
            });
        }
        let [width, height] = size;
        Ok(Self {
            width,
            height,
            photometry: match columns.brightness() {
                Some(Brightness::JohnsonV) => Photometry::JohnsonV,
                Some(Brightness::Mag | Brightness::Flux) | None => Photometry::Instrumental,
            },
            has_brightness: columns.brightness().is_some(),
            centroids,
        })
    }
}

fn reader(text: &[u8], separator: u8) -> csv::Reader<&[u8]> {
    csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .flexible(true)
        .comment(Some(b'#'))
        .delimiter(separator)
        .from_reader(text)
}

/// Describes an error of the CSV reader with its line.
fn not_a_table(error: csv::Error) -> CentroidListError {
    let line = error.position().map_or(1, csv::Position::line);
    match error.kind() {
        csv::ErrorKind::Utf8 { err, .. } => {
            let column = err.field() + 1;
            CentroidListError::of_line(
                line,
                format!("found bytes that are not UTF-8 in column {column}, expected a CSV table"),
            )
        }
        _ => CentroidListError::of_list(error.to_string()),
    }
}

/// The frames that a table has rows of.
struct Frames<'a> {
    /// The one that is used, if it is chosen.
    chosen: Option<&'a str>,
    /// All of them, in order.
    found: Vec<String>,
}

impl<'a> Frames<'a> {
    fn new(chosen: Option<&'a str>) -> Self {
        Self {
            chosen,
            found: Vec::new(),
        }
    }

    /// Whether a row of this frame is used. A row that names none is.
    fn is_wanted(&mut self, frame: Option<&str>) -> bool {
        let Some(frame) = frame else {
            return true;
        };
        if self.found.last().is_none_or(|last| last != frame) {
            self.found.push(frame.to_owned());
        }
        self.chosen.is_none_or(|chosen| chosen == frame)
    }

    /// Refuses a table of several frames of which none is chosen, and one without the chosen one.
    fn check(mut self) -> Result<(), CentroidListError> {
        const MAX_NAMED: usize = 3;
        self.found.sort();
        self.found.dedup();
        let count = self.found.len();
        let mut names = self.found[..count.min(MAX_NAMED)].join(", ");
        if count > MAX_NAMED {
            names += ", …";
        }
        let names = excerpt(&names);
        match self.chosen {
            None if count > 1 => Err(CentroidListError {
                remedies: &[Remedy::Frame],
                ..CentroidListError::of_list(format!(
                    "found rows of {count} frames ({names}), expected rows of one frame"
                ))
            }),
            Some(chosen) if count == 0 => Err(CentroidListError::of_list(format!(
                "found no column with frame names, expected rows of {chosen}"
            ))),
            Some(chosen) if !self.found.iter().any(|frame| frame == chosen) => Err(
                CentroidListError::of_list(format!("found rows of {names}, but none of {chosen}")),
            ),
            _ => Ok(()),
        }
    }
}

/// Refuses positions outside a frame of this width and height, as far as they are known. It extends half a
/// pixel beyond the centres of its border pixels.
pub(super) fn check_inside(
    position: &PixelPoint,
    [width, height]: [Option<usize>; 2],
) -> Result<(), String> {
    let axes = [("x", position.x, width), ("y", position.y, height)];
    for (name, value, side) in axes {
        let limit = side.map_or(MAX_COORDINATE_PX, |side| side as f64) - 0.5;
        if !(-0.5 - BORDER_PX..=limit + BORDER_PX).contains(&value) {
            return Err(format!(
                "column {name}: {value} is more than {BORDER_PX} px outside the frame, which extends from -0.5 to {limit} px"
            ));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::centroids::LeftOut;
    use crate::centroids::frame::ListFrame;
    use crate::detect::DetectionFlags;
    use crate::ephemeris::places::StarPlaces;

    fn parsed(text: &str) -> Result<CentroidList, CentroidListError> {
        CentroidList::parse(text.as_bytes(), &CentroidListOptions::default())
    }

    fn guessed(list: &CentroidList) -> [usize; 2] {
        ListFrame::from_list(list, &[]).unwrap().size.sides()
    }

    fn error(text: &str) -> String {
        format!("{}", parsed(text).unwrap_err())
    }

    #[test]
    fn columns_may_have_any_order_and_case_and_others_are_ignored() {
        let list = parsed("id, VMAG , Y_px,note,X_PX\n7, 6.5, 20.2 ,hello, 10.6\n").unwrap();
        assert_eq!(list.photometry, Photometry::JohnsonV);
        assert_eq!(list.centroids[0].position, PixelPoint::new(10.6, 20.2));
        assert_eq!(list.centroids[0].mag, 6.5);
        assert_eq!(guessed(&list), [12, 21]);
    }

    #[test]
    fn flux_becomes_an_instrumental_magnitude() {
        let list = parsed("x,y,flux\n1,2,100\n").unwrap();
        assert_eq!(list.photometry, Photometry::Instrumental);
        assert_eq!(list.centroids[0].mag, -5.0);
        assert_eq!(list.centroids[0].flux, Some(100.0));
    }

    const TABLE: &str = "frame,x,y,sigma_x,sigma_y,flux,id,vmag,flags\n\
                         a.png,1,2,0.3,0.4,100,SKYMAP 00000001,5.5,saturated border\n\
                         a.png,3,4,0.1,0.1,50,,,trail\n\
                         b.png,5,6,,,20,,,\n";

    fn of_frame(frame: &str) -> Result<CentroidList, CentroidListError> {
        let options = CentroidListOptions {
            frame: Some(frame.to_owned()),
            ..CentroidListOptions::default()
        };
        CentroidList::parse(TABLE.as_bytes(), &options)
    }

    #[test]
    fn a_table_of_process_gives_fluxes_errors_and_flags() {
        let list = of_frame("a.png").unwrap();
        assert_eq!(list.photometry, Photometry::Instrumental);
        assert_eq!(list.centroids.len(), 2);
        assert_eq!(list.centroids[0].flux, Some(100.0));
        let sigma_px = list.centroids[0].sigma_px.unwrap();
        assert!((sigma_px - 0.125_f64.sqrt()).abs() < 1e-12, "{sigma_px}");
        assert!(list.centroids[0].flags.saturated && list.centroids[0].flags.border);
        // Sources that are not stars stay in the list but not in the star field.
        assert!(list.centroids[1].flags.trail);
        let field = list.star_field(StarPlaces::default());
        assert_eq!(field.stars.len(), 1);
        assert!(field.stars[0].is_saturated);
        let other = of_frame("b.png").unwrap();
        assert_eq!(other.centroids[0].sigma_px, None);
        assert_eq!(other.centroids[0].flags, DetectionFlags::default());
    }

    #[test]
    fn one_frame_of_a_table_must_be_chosen() {
        assert_eq!(
            error(TABLE),
            "found rows of 2 frames (a.png, b.png), expected rows of one frame"
        );
        let missing = of_frame("c.png").unwrap_err().to_string();
        assert_eq!(missing, "found rows of a.png, b.png, but none of c.png");
        let one: String = TABLE
            .lines()
            .take(3)
            .map(|line| format!("{line}\n"))
            .collect();
        assert_eq!(parsed(&one).unwrap().centroids.len(), 2);
    }

    #[test]
    fn a_byte_order_mark_comments_and_blank_lines_are_ignored() {
        let list = parsed("\u{feff}x,y,mag\r\n# a remark\r\n1,2,3\r\n\r\n,,\r\n").unwrap();
        assert_eq!(list.centroids.len(), 1);
    }

    #[test]
    fn a_list_without_a_usable_row_names_line_and_column_of_the_first() {
        for (row, expected) in [
            ("1,NaN,3", "line 2: column y: 'NaN' is not a number"),
            ("inf,2,3", "line 2: column x: 'inf' is not a number"),
            ("1,2,", "line 2: column flux: '' is not a number"),
            ("1,2,-4", "line 2: column flux: -4 is not above 0"),
            ("1,2,0", "line 2: column flux: 0 is not above 0"),
            ("1,2", "line 2: column flux is missing"),
            (
                "-7,2,3",
                "line 2: column x: -7 is more than 5 px outside the frame",
            ),
            ("1,1e300,3", "line 2: column y: 1000000"),
        ] {
            let error = error(&format!("x,y,flux\n{row}\n"));
            assert!(error.starts_with(expected), "{error}");
        }
    }

    #[test]
    fn rows_that_are_no_stars_are_left_out_and_counted() {
        let list = parsed(
            "x,y,flux\n5,5,5\nnan,5,3\n5,,3\n1,2\n6,6,0\n7,7,-1\n8,8,1e9\n8,8.2,4\n8,8,1e9\n",
        )
        .unwrap();
        let (usable, left_out) = list.usable();
        let places: Vec<f64> = usable.centroids.iter().map(|c| c.position.x).collect();
        assert_eq!(places, [8.0, 5.0]);
        assert_eq!(guessed(&usable), [9, 9]);
        let texts: Vec<String> = left_out.iter().map(LeftOut::to_string).collect();
        assert_eq!(
            texts,
            [
                "3 rows of the list are left out, the first in line 3: a number is missing",
                "2 rows of the list are left out, the first in line 6: the flux is not above 0",
                "2 rows of the list are left out, the first in line 9: they are within 0.5 px of a brighter one",
            ]
        );
        let measured =
            "frame,x,y,sigma_x,sigma_y,flux,flags\na,1,2,0,0.4,100,\na,9,2,0.3,0.4,90,\n";
        let (usable, left_out) = parsed(measured).unwrap().usable();
        assert_eq!((usable.centroids.len(), left_out.len()), (1, 1));
    }

    #[test]
    fn the_columns_of_other_programs_are_understood() {
        let at = |text: &str| {
            let list = parsed(text).unwrap();
            let first = list.centroids[0];
            (first.position.x, first.position.y, first.flux)
        };
        for (text, expected) in [
            ("x_centroid,y_centroid,flux\n1,2,3\n", (1.0, 2.0, Some(3.0))),
            (
                "id xcentroid ycentroid flux\n1 1 2 3\n",
                (1.0, 2.0, Some(3.0)),
            ),
            ("x;y;flux\n1,5;2,5;3\n", (1.5, 2.5, Some(3.0))),
            ("x\ty\tflux\n1.5\t2.5\t3\n", (1.5, 2.5, Some(3.0))),
            ("X_IMAGE,Y_IMAGE,FLUX_AUTO\n1,2,3\n", (0.0, 1.0, Some(3.0))),
            (
                "# 1 X_IMAGE place\n# 2 Y_IMAGE place\n# 3 FLUX_BEST flux\n 5.5 6.5 7\n",
                (4.5, 5.5, Some(7.0)),
            ),
            ("x,y,mag,flux\n1,2,nan,3\n3,4,,5\n", (1.0, 2.0, Some(3.0))),
            ("x,y,mag,flux\n1,2,99,3\n", (1.0, 2.0, Some(3.0))),
        ] {
            assert_eq!(at(text), expected, "{text}");
        }
        let archive = "frame,id,x_centroid,y_centroid,x_centroid_err,y_centroid_err,flux,flags,vmag\n\
                       a,,1,2,0.3,0.3,100,\"saturated,border\",5\n";
        let list = parsed(archive).unwrap();
        assert_eq!(list.photometry, Photometry::Instrumental);
        assert!(list.centroids[0].flags.saturated && list.centroids[0].flags.border);
        assert!((list.centroids[0].sigma_px.unwrap() - 0.3).abs() < 1e-12);
    }

    #[test]
    fn without_a_brightness_the_rows_are_in_its_order() {
        let list = parsed("x,y\n1,2\n9,4\n5,8\n").unwrap();
        assert!(!list.has_brightness);
        let (usable, _) = list.usable();
        let places: Vec<f64> = usable.centroids.iter().map(|c| c.position.x).collect();
        assert_eq!(places, [1.0, 9.0, 5.0]);
    }

    #[test]
    fn lists_in_utf_16_are_refused_by_name() {
        let utf_16: Vec<u8> = "\u{feff}x,y,flux"
            .encode_utf16()
            .flat_map(u16::to_le_bytes)
            .collect();
        let error = CentroidList::parse(&utf_16, &CentroidListOptions::default()).unwrap_err();
        assert!(error.to_string().contains("UTF-16"), "{error}");
    }

    #[test]
    fn errors_of_missing_columns_list_those_found() {
        for (heading, expected) in [
            ("", "the file is empty"),
            (
                "a,b,c\n1,2,3\n",
                "line 1 has the columns a, b, c; expected x or x_px",
            ),
            ("x,b,c\n1,2,3\n", "expected y or y_px"),
            ("x,y,mag\n", "a heading without centroids"),
        ] {
            let error = error(heading);
            assert!(error.contains(expected), "{error}");
        }
    }

    #[test]
    fn a_position_outside_a_known_frame_is_refused() {
        let size = CentroidListOptions {
            width: Some(100),
            ..CentroidListOptions::default()
        };
        let error =
            CentroidList::parse("x,y,mag\n99.4,2,3\n105,2,3\n".as_bytes(), &size).unwrap_err();
        assert!(format!("{error}").starts_with("line 3: column x: 105 is more than 5 px outside"));
        let list = CentroidList::parse("x,y,mag\n9,2,3\n".as_bytes(), &size).unwrap();
        assert_eq!(guessed(&list), [100, 3]);
    }

    #[test]
    fn a_star_on_the_border_may_have_its_centre_outside() {
        let list = parsed("x,y,mag\n-1.2,2,3\n9,-5.5,3\n").unwrap();
        assert_eq!(list.centroids.len(), 2);
        assert_eq!(guessed(&list), [10, 3]);
    }

    #[test]
    fn binary_content_is_refused() {
        for (text, expected) in [
            (
                &b"x,y,mag\n1,\xff\xfe,3\n"[..],
                "line 2: found bytes that are not UTF-8 in column 2",
            ),
            (
                b"\x89PNG\r\n\x1a\n",
                "line 1: found bytes that are not UTF-8",
            ),
        ] {
            let error = CentroidList::parse(text, &CentroidListOptions::default())
                .unwrap_err()
                .to_string();
            assert!(error.starts_with(expected), "{error}");
        }
    }
}
