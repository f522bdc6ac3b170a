//! Reads lists of centroids from CSV files.

use super::stdin::is_stdin;
use anyhow::{Context, anyhow, bail};
use csv::StringRecord;
use starpipe::base::coords::PixelPoint;
use starpipe::identify::Photometry;
use starpipe::photometry::instrumental_mag;
use starpipe::pipeline::{CentroidList, ListedCentroid};
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Width and height of the frame in pixels, if known.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct FrameSize {
    pub(crate) width: Option<u32>,
    pub(crate) height: Option<u32>,
}

/// Largest coordinate of a frame whose size is unknown; larger ones are errors in the list.
const MAX_COORDINATE_PX: f64 = 1e6;
/// Largest size of a list: some millions of centroids.
const MAX_BYTES: u64 = 1 << 28;
/// How far outside the frame a centroid may lie, in pixels: stars at the border are cut.
const BORDER_PX: f64 = 5.0;

/// Reads the list in the file `path`, or in standard input if that is `-`.
pub(crate) fn read(path: &Path, size: FrameSize) -> anyhow::Result<CentroidList> {
    let reading = || format!("reading {}", path.display());
    let stream: Box<dyn Read> = if is_stdin(path) {
        Box::new(io::stdin().lock())
    } else {
        Box::new(File::open(path).with_context(reading)?)
    };
    let list = limited(stream, MAX_BYTES).and_then(|bytes| parse(&bytes[..], size));
    list.with_context(reading)
}

/// All bytes of `stream`, at most `limit`.
fn limited(stream: impl Read, limit: u64) -> anyhow::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    stream.take(limit + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit {
        bail!("too large: found more than {limit} bytes");
    }
    Ok(bytes)
}

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
}

/// Parses a list. Lines in errors are counted from 1, heading included.
fn parse(input: impl Read, size: FrameSize) -> anyhow::Result<CentroidList> {
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .flexible(true)
        .comment(Some(b'#'))
        .from_reader(input);
    let columns = Columns::find(reader.headers().map_err(not_a_table)?)?;
    let mut centroids = Vec::new();
    for record in reader.records() {
        let record = record.map_err(not_a_table)?;
        // Spreadsheets write such lines at the end of a table.
        if record.iter().all(str::is_empty) {
            continue;
        }
        let line = record.position().map_or(0, csv::Position::line);
        let centroid = columns
            .centroid(&record)
            .with_context(|| format!("line {line}"))?;
        check_inside(&centroid.position, size).with_context(|| format!("line {line}"))?;
        centroids.push(centroid);
    }
    if centroids.is_empty() {
        bail!("found a heading without centroids below it");
    }
    let (width, height) = frame_size(&centroids, size);
    Ok(CentroidList {
        width,
        height,
        photometry: match columns.kind {
            Brightness::JohnsonV => Photometry::JohnsonV,
            Brightness::Mag | Brightness::Flux => Photometry::Instrumental,
        },
        centroids,
    })
}

/// Describes an error of the CSV reader with its line.
fn not_a_table(error: csv::Error) -> anyhow::Error {
    let line = error.position().map_or(1, csv::Position::line);
    match error.kind() {
        csv::ErrorKind::Utf8 { err, .. } => anyhow!(
            "line {line}: found bytes that are not UTF-8 in column {}, expected a CSV table",
            err.field() + 1
        ),
        _ => error.into(),
    }
}

impl Columns {
    fn find(headings: &StringRecord) -> anyhow::Result<Self> {
        if headings.iter().all(str::is_empty) {
            bail!(
                "the file is empty; expected a heading with the columns x, y and flux, vmag or mag"
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
            bail!(
                "{}; expected x or x_px among them, with commas between",
                found()
            );
        };
        let Some(y) = column(&["y", "y_px"]) else {
            bail!(
                "{}; expected y or y_px among them, with commas between",
                found()
            );
        };
        let kinds = [
            ("vmag", Brightness::JohnsonV),
            ("mag", Brightness::Mag),
            ("flux", Brightness::Flux),
        ];
        let brightness = kinds
            .into_iter()
            .find_map(|(name, kind)| Some((column(&[name])?, kind)));
        let Some((brightness, kind)) = brightness else {
            bail!(
                "{}; expected flux, vmag or mag among them, with commas between",
                found()
            );
        };
        Ok(Self {
            x,
            y,
            brightness,
            kind,
        })
    }

    fn centroid(&self, record: &StringRecord) -> anyhow::Result<ListedCentroid> {
        let position = PixelPoint::new(number(record, &self.x)?, number(record, &self.y)?);
        let value = number(record, &self.brightness)?;
        let (mag, flux) = match self.kind {
            Brightness::Flux if value > 0.0 => (instrumental_mag(value), Some(value)),
            Brightness::Flux => bail!("column flux: {value} is not above 0"),
            Brightness::JohnsonV | Brightness::Mag => (value, None),
        };
        Ok(ListedCentroid {
            position,
            mag,
            flux,
        })
    }
}

fn number(record: &StringRecord, column: &Column) -> anyhow::Result<f64> {
    let name = &column.name;
    let Some(text) = record.get(column.position) else {
        bail!(
            "column {name} is missing: the line ends after {} of at least {} columns",
            record.len(),
            column.position + 1
        );
    };
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => bail!("column {name}: '{text}' is not a number"),
    }
}

/// Refuses positions outside the frame, which extends half a pixel beyond the centres of its border
/// pixels.
fn check_inside(position: &PixelPoint, size: FrameSize) -> anyhow::Result<()> {
    let axes = [
        ("x", position.x, size.width),
        ("y", position.y, size.height),
    ];
    for (name, value, side) in axes {
        let limit = side.map_or(MAX_COORDINATE_PX, f64::from) - 0.5;
        if !(-0.5 - BORDER_PX..=limit + BORDER_PX).contains(&value) {
            bail!(
                "column {name}: {value} is more than {BORDER_PX} px outside the frame, which extends from -0.5 to {limit} px"
            );
        }
    }
    Ok(())
}

/// Width and height of the frame: as given, else as far as the centroids reach.
fn frame_size(centroids: &[ListedCentroid], size: FrameSize) -> (usize, usize) {
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

    fn parsed(text: &str) -> anyhow::Result<CentroidList> {
        parse(text.as_bytes(), FrameSize::default())
    }

    fn error(text: &str) -> String {
        format!("{:#}", parsed(text).unwrap_err())
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
        let size = FrameSize {
            width: Some(100),
            height: None,
        };
        let error = parse("x,y,mag\n99.4,2,3\n105,2,3\n".as_bytes(), size).unwrap_err();
        assert!(
            format!("{error:#}").starts_with("line 3: column x: 105 is more than 5 px outside")
        );
        let list = parse("x,y,mag\n9,2,3\n".as_bytes(), size).unwrap();
        assert_eq!((list.width, list.height), (100, 3));
    }

    #[test]
    fn a_star_on_the_border_may_have_its_centre_outside() {
        let list = parsed("x,y,mag\n-1.2,2,3\n9,-5.5,3\n").unwrap();
        assert_eq!(list.centroids.len(), 2);
        assert_eq!((list.width, list.height), (10, 3));
    }

    #[test]
    fn an_endless_stream_is_refused() {
        let error = limited(io::repeat(b'1'), 1000).unwrap_err().to_string();
        assert!(error.starts_with("too large: found more than 1000 bytes"));
        assert_eq!(
            limited(io::repeat(b'1').take(1000), 1000).unwrap().len(),
            1000
        );
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
            let error = parse(text, FrameSize::default()).unwrap_err().to_string();
            assert!(error.starts_with(expected), "{error}");
        }
    }
}
