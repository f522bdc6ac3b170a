//! Lists of centroids as CSV.

use super::centroid_list::{CentroidList, ListedCentroid};
use crate::base::coords::PixelPoint;
use crate::base::format::printable;
use crate::detect::DetectionFlags;
use crate::identify::Photometry;
use crate::photometry::instrumental_mag;
use csv::StringRecord;
use std::fmt;

/// Why a list of centroids cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub struct CentroidListError {
    /// The line, from 1 and with the heading, where it is one line's.
    pub line: Option<u64>,
    /// What was found and expected.
    pub problem: String,
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
        }
    }

    fn of_list(problem: impl Into<String>) -> Self {
        Self {
            line: None,
            problem: problem.into(),
        }
    }
}

/// What is known of a list besides its content.
#[derive(Debug, Clone, Default)]
pub struct CentroidListOptions {
    /// Width of the frame in pixels.
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

/// Meaning of the brightness column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Brightness {
    JohnsonV,
    Mag,
    Flux,
}

/// Position and name of a column.
struct Column {
    position: usize,
    name: String,
}

struct Columns {
    x: Column,
    y: Column,
    brightness: Column,
    kind: Brightness,
    /// What only a table of `starpipe process` has.
    measured: Option<MeasuredColumns>,
}

/// Columns of a table of `starpipe process`. Its magnitudes are the catalogue's, and say nothing
/// about the frame.
struct MeasuredColumns {
    frame: Column,
    sigmas: [Column; 2],
    flags: Column,
}

impl CentroidList {
    /// Parses CSV with a heading: `x` and `y` (or `x_px`, `y_px`) in pixels, and `vmag`, `mag` or
    /// `flux`; others are ignored. A table of `starpipe process` gives errors and flags, too.
    ///
    /// # Errors
    /// [`CentroidListError`]: a column is missing, a value is no number or outside the frame, the
    /// list is empty, or has several frames of which none is chosen.
    pub fn parse(csv: &[u8], options: &CentroidListOptions) -> Result<Self, CentroidListError> {
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .flexible(true)
            .comment(Some(b'#'))
            .from_reader(csv);
        let columns = Columns::find(reader.headers().map_err(not_a_table)?)
            .map_err(CentroidListError::of_list)?;
        let mut centroids = Vec::new();
        // As tables have it.
        let chosen = options.frame.as_deref().map(printable);
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
            let centroid = columns
                .centroid(&record)
                .and_then(|centroid| check_inside(&centroid.position, options).map(|()| centroid))
                .map_err(|problem| CentroidListError::of_line(line, problem))?;
            centroids.push(centroid);
        }
        frames.check().map_err(CentroidListError::of_list)?;
        if centroids.is_empty() {
            return Err(CentroidListError::of_list(
                "found a heading without centroids below it",
            ));
        }
        let (width, height) = frame_size(&centroids, options);
        Ok(Self {
            width,
            height,
            photometry: match columns.kind {
                Brightness::JohnsonV => Photometry::JohnsonV,
                Brightness::Mag | Brightness::Flux => Photometry::Instrumental,
            },
            centroids,
        })
    }
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

impl Columns {
    fn find(headings: &StringRecord) -> Result<Self, String> {
        if headings.iter().all(str::is_empty) {
            return Err(
                "the file is empty; expected a heading with the columns x, y and flux, vmag or mag"
                    .to_owned(),
            );
        }
        let column = |names: &[&str]| {
            names.iter().find_map(|name| {
                let position = headings
                    .iter()
                    // The first heading may begin with a byte order mark.
                    .position(|h| h.trim_start_matches('\u{feff}').eq_ignore_ascii_case(name))?;
                let name = (*name).to_owned();
                Some(Column { position, name })
            })
        };
        let found = || {
            let named: Vec<&str> = headings.iter().collect();
            let columns = if named.len() == 1 {
                "the single column"
            } else {
                "the columns"
            };
            format!("line 1 has {columns} {}", named.join(", "))
        };
        let Some(x) = column(&["x", "x_px"]) else {
            return Err(format!(
                "{}; expected x or x_px among them, with commas between",
                found()
            ));
        };
        let Some(y) = column(&["y", "y_px"]) else {
            return Err(format!(
                "{}; expected y or y_px among them, with commas between",
                found()
            ));
        };
        let measured = MeasuredColumns::find(column);
        let kinds: &[_] = match measured {
            Some(_) => &[("flux", Brightness::Flux)],
            None => &[
                ("vmag", Brightness::JohnsonV),
                ("mag", Brightness::Mag),
                ("flux", Brightness::Flux),
            ],
        };
        let brightness = kinds
            .iter()
            .find_map(|&(name, kind)| Some((column(&[name])?, kind)));
        let Some((brightness, kind)) = brightness else {
            return Err(format!(
                "{}; expected flux, vmag or mag among them, with commas between",
                found()
            ));
        };
        Ok(Self {
            x,
            y,
            brightness,
            kind,
            measured,
        })
    }

    /// The frame of a row, in a table that names it.
    fn frame_of<'a>(&self, record: &'a StringRecord) -> Option<&'a str> {
        record.get(self.measured.as_ref()?.frame.position)
    }

    fn centroid(&self, record: &StringRecord) -> Result<ListedCentroid, String> {
        let position = PixelPoint::new(number(record, &self.x)?, number(record, &self.y)?);
        let value = number(record, &self.brightness)?;
        let (mag, flux) = match self.kind {
            Brightness::Flux if value > 0.0 => (instrumental_mag(value), Some(value)),
            Brightness::Flux => return Err(format!("column flux: {value} is not above 0")),
            Brightness::JohnsonV | Brightness::Mag => (value, None),
        };
        let mut centroid = ListedCentroid {
            flux,
            ..ListedCentroid::new(position, mag)
        };
        if let Some(measured) = &self.measured {
            centroid.sigma_px = measured.sigma_px(record)?;
            centroid.flags = measured.flags(record);
        }
        Ok(centroid)
    }
}

impl MeasuredColumns {
    /// `None` unless all of them are there.
    fn find(column: impl Fn(&[&str]) -> Option<Column>) -> Option<Self> {
        Some(Self {
            frame: column(&["frame"])?,
            sigmas: [column(&["sigma_x"])?, column(&["sigma_y"])?],
            flags: column(&["flags"])?,
        })
    }

    /// The standard error on one axis; `None` where the table has none.
    fn sigma_px(&self, record: &StringRecord) -> Result<Option<f64>, String> {
        let mut variance_px2 = 0.0;
        for column in &self.sigmas {
            if record.get(column.position).is_none_or(str::is_empty) {
                return Ok(None);
            }
            let sigma_px = number(record, column)?;
            if sigma_px <= 0.0 {
                return Err(format!("column {}: {sigma_px} is not above 0", column.name));
            }
            variance_px2 += sigma_px.powi(2) / 2.0;
        }
        Ok(Some(variance_px2.sqrt()))
    }

    fn flags(&self, record: &StringRecord) -> DetectionFlags {
        let text = record.get(self.flags.position).unwrap_or_default();
        let has = |flag: &str| text.split_whitespace().any(|word| word == flag);
        DetectionFlags {
            saturated: has("saturated"),
            hot_pixel: has("hot_pixel"),
            trail: has("trail"),
            extended: has("extended"),
            blended: has("blended"),
            border: has("border"),
        }
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
    fn check(mut self) -> Result<(), String> {
        const MOST_NAMED: usize = 3;
        self.found.sort();
        self.found.dedup();
        let count = self.found.len();
        let mut names = self.found[..count.min(MOST_NAMED)].join(", ");
        if count > MOST_NAMED {
            names += ", …";
        }
        match self.chosen {
            None if count > 1 => Err(format!(
                "found the rows of {count} frames ({names}), expected those of one: choose it with --frame"
            )),
            Some(chosen) if count == 0 => Err(format!(
                "found no column that names a frame, expected rows of {chosen}"
            )),
            Some(chosen) if !self.found.iter().any(|frame| frame == chosen) => {
                Err(format!("found rows of {names}, expected some of {chosen}"))
            }
            _ => Ok(()),
        }
    }
}

fn number(record: &StringRecord, column: &Column) -> Result<f64, String> {
    let name = &column.name;
    let Some(text) = record.get(column.position) else {
        return Err(format!(
            "column {name} is missing: the line ends after {} of at least {} columns",
            record.len(),
            column.position + 1
        ));
    };
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(format!("column {name}: '{text}' is not a number")),
    }
}

/// Refuses positions outside the frame, which extends half a pixel beyond the centres of its border
/// pixels.
fn check_inside(position: &PixelPoint, size: &CentroidListOptions) -> Result<(), String> {
    let axes = [
        ("x", position.x, size.width),
        ("y", position.y, size.height),
    ];
    for (name, value, side) in axes {
        let limit = side.map_or(MAX_COORDINATE_PX, f64::from) - 0.5;
        if !(-0.5 - BORDER_PX..=limit + BORDER_PX).contains(&value) {
            return Err(format!(
                "column {name}: {value} is more than {BORDER_PX} px outside the frame, which extends from -0.5 to {limit} px"
            ));
        }
    }
    Ok(())
}

/// Width and height of the frame: as given, else as far as the centroids reach.
fn frame_size(centroids: &[ListedCentroid], size: &CentroidListOptions) -> (usize, usize) {
    let reach = |coordinate: fn(&PixelPoint) -> f64| {
        let largest = centroids
            .iter()
            .map(|c| coordinate(&c.position))
            .fold(0.0, f64::max);
        largest.round() as usize + 1
    };
    let given = |side: Option<u32>| side.map(|side| side as usize);
    (
        given(size.width).unwrap_or_else(|| reach(|p| p.x)),
        given(size.height).unwrap_or_else(|| reach(|p| p.y)),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> Result<CentroidList, CentroidListError> {
        CentroidList::parse(text.as_bytes(), &CentroidListOptions::default())
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
        assert_eq!((list.width, list.height), (12, 21));
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
        // What is no star stays in the list and out of the star field.
        assert!(list.centroids[1].flags.trail);
        let field = list.star_field(0.0);
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
            "found the rows of 2 frames (a.png, b.png), expected those of one: choose it with --frame"
        );
        let missing = of_frame("c.png").unwrap_err().to_string();
        assert_eq!(
            missing,
            "found rows of a.png, b.png, expected some of c.png"
        );
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
    fn errors_name_line_and_column() {
        for (row, expected) in [
            ("1,NaN,3", "line 3: column y: 'NaN' is not a number"),
            ("inf,2,3", "line 3: column x: 'inf' is not a number"),
            ("1,2,", "line 3: column flux: '' is not a number"),
            ("1,2,-4", "line 3: column flux: -4 is not above 0"),
            ("1,2,0", "line 3: column flux: 0 is not above 0"),
            ("1,2", "line 3: column flux is missing"),
            (
                "-7,2,3",
                "line 3: column x: -7 is more than 5 px outside the frame",
            ),
            ("1,1e300,3", "line 3: column y: 1000000"),
        ] {
            let error = error(&format!("x,y,flux\n5,5,5\n{row}\n"));
            assert!(error.starts_with(expected), "{error}");
        }
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
            ("x,y,c\n1,2,3\n", "expected flux, vmag or mag"),
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
        assert_eq!((list.width, list.height), (100, 3));
    }

    #[test]
    fn a_star_on_the_border_may_have_its_centre_outside() {
        let list = parsed("x,y,mag\n-1.2,2,3\n9,-5.5,3\n").unwrap();
        assert_eq!(list.centroids.len(), 2);
        assert_eq!((list.width, list.height), (10, 3));
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
