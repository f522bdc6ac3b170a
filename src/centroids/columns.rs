//! The columns of lists of centroids, by the names that programs give them.

use super::list::ListedCentroid;
use crate::base::coords::PixelPoint;
use crate::base::format::excerpt;
use crate::detect::DetectionFlags;
use crate::photometry::instrumental_mag;
use csv::StringRecord;

/// Names of x and y, and the position of the centre of the first pixel: the columns of starpipe, of
/// photutils and SEP, which count from 0, and of SExtractor, which counts from 1.
const POSITIONS: [(&str, &str, f64); 11] = [
    ("x", "y", 0.0),
    ("x_px", "y_px", 0.0),
    ("x_centroid", "y_centroid", 0.0),
    ("xcentroid", "ycentroid", 0.0),
    ("x_fit", "y_fit", 0.0),
    ("x_center", "y_center", 0.0),
    ("xcenter", "ycenter", 0.0),
    ("x_peak", "y_peak", 0.0),
    ("xwin_image", "ywin_image", 1.0),
    ("xpsf_image", "ypsf_image", 1.0),
    ("x_image", "y_image", 1.0),
];
const V_MAGS: [&str; 1] = ["vmag"];
const MAGS: [&str; 7] = [
    "mag",
    "magnitude",
    "mag_auto",
    "mag_best",
    "mag_psf",
    "mag_iso",
    "mag_aper",
];
const FLUXES: [&str; 12] = [
    "flux",
    "flux_auto",
    "flux_best",
    "flux_psf",
    "flux_iso",
    "flux_aper",
    "flux_fit",
    "kron_flux",
    "segment_flux",
    "aperture_sum",
    "flux_e",
    "counts",
];

/// Magnitudes from this on mean that there is none: 99 and −99 are common.
const NO_MAG: f64 = 90.0;

/// Meaning of the brightness column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Brightness {
    JohnsonV,
    Mag,
    Flux,
}

impl Brightness {
    /// Magnitude and flux of a number in the column.
    fn mag_and_flux(self, value: f64) -> (f64, Option<f64>) {
        match self {
            Self::Flux => (instrumental_mag(value), Some(value)),
            Self::JohnsonV | Self::Mag if value.abs() < NO_MAG => (value, None),
            Self::JohnsonV | Self::Mag => (f64::NAN, None),
        }
    }

    fn is_usable(self, value: f64) -> bool {
        self.mag_and_flux(value).0.is_finite()
    }
}

/// Position and name of a column.
#[derive(Debug, Clone)]
pub(super) struct CentroidColumn {
    position: usize,
    pub name: String,
}

/// The columns that are used.
pub(super) struct CentroidColumns {
    x: CentroidColumn,
    y: CentroidColumn,
    /// Position of the centre of the first pixel on both axes.
    first_pixel: f64,
    brightness: Option<(CentroidColumn, Brightness)>,
    /// What only a table of starpipe has.
    measured: Option<MeasuredColumns>,
    /// Whether a comma in a number is the decimal point.
    has_decimal_commas: bool,
}

/// Columns of the tables of starpipe. Their magnitudes are the catalogue's, and say nothing about the
/// frame.
struct MeasuredColumns {
    frame: CentroidColumn,
    sigmas: [CentroidColumn; 2],
    flags: CentroidColumn,
}

impl CentroidColumns {
    /// The columns with these headings. Of several brightnesses the first is used of which `rows`
    /// have any.
    pub fn find<R: Iterator<Item = StringRecord>>(
        headings: &StringRecord,
        separator: u8,
        rows: impl Fn() -> R,
    ) -> Result<Self, String> {
        if headings.iter().all(str::is_empty) {
            let expected = "expected a heading with the columns x, y and flux, vmag or mag";
            return Err(format!("the file is empty; {expected}"));
        }
        let column = |name: &str| {
            let position = headings.iter().position(|h| h.eq_ignore_ascii_case(name))?;
            let name = name.to_owned();
            Some(CentroidColumn { position, name })
        };
        let positions = POSITIONS
            .iter()
            .find_map(|(x, y, first)| Some((column(x)?, column(y)?, *first)));
        let (x, y, first_pixel) = positions.ok_or_else(|| no_positions(headings))?;
        let mut columns = Self {
            x,
            y,
            first_pixel,
            brightness: None,
            measured: MeasuredColumns::find(column),
            has_decimal_commas: separator == b';',
        };
        let of = |names: &[&str], kind| {
            let found: Vec<_> = names.iter().filter_map(|name| column(name)).collect();
            found.into_iter().map(move |column| (column, kind))
        };
        let is_catalog = columns.measured.is_some();
        let magnitudes = of(&V_MAGS, Brightness::JohnsonV).chain(of(&MAGS, Brightness::Mag));
        let magnitudes = magnitudes.filter(|_| !is_catalog);
        let all: Vec<_> = magnitudes.chain(of(&FLUXES, Brightness::Flux)).collect();
        let has_values = |(column, kind): &&(CentroidColumn, Brightness)| {
            rows().any(|row| {
                let value = columns.number(&row, column);
                value.is_ok_and(|value| kind.is_usable(value))
            })
        };
        let used = match &all[..] {
            [] | [_] => all.first(),
            several => several.iter().find(has_values).or(all.first()),
        };
        columns.brightness = used.cloned();
        Ok(columns)
    }

    /// The meaning of the brightness; `None` where there is none.
    pub fn brightness(&self) -> Option<Brightness> {
        self.brightness.as_ref().map(|(_, kind)| *kind)
    }

    /// The frame of a row, in a table that names it.
    pub fn frame_of<'a>(&self, record: &'a StringRecord) -> Option<&'a str> {
        record.get(self.measured.as_ref()?.frame.position)
    }

    /// The centroid of a row; NaN stands for numbers that it lacks. Without a brightness the rows are
    /// in order of it, and this is row `rank`, from 0.
    pub fn centroid(&self, record: &StringRecord, rank: usize) -> ListedCentroid {
        let number = |column| self.number(record, column).unwrap_or(f64::NAN);
        let x = number(&self.x) - self.first_pixel;
        let y = number(&self.y) - self.first_pixel;
        let (mag, flux) = match &self.brightness {
            Some((column, kind)) => kind.mag_and_flux(number(column)),
            None => (ListedCentroid::mag_of_rank(rank), None),
        };
        let mut centroid = ListedCentroid {
            flux,
            ..ListedCentroid::new(PixelPoint::new(x, y), mag)
        };
        if let Some(measured) = &self.measured {
            let is_given = |column: &CentroidColumn| {
                record
                    .get(column.position)
                    .is_some_and(|text| !text.is_empty())
            };
            let [sigma_x, sigma_y] = &measured.sigmas;
            if is_given(sigma_x) && is_given(sigma_y) {
                centroid.sigma_px = Some(sigma_of(number(sigma_x), number(sigma_y)));
            }
            centroid.flags = measured.flags(record);
        }
        centroid
    }

    /// What is wrong with the first of a row's numbers that is not one, or not as it should be.
    pub fn problem(&self, record: &StringRecord) -> Option<String> {
        let brightness = self.brightness.as_ref().map(|(column, _)| column);
        let sigmas = self.measured.iter().flat_map(|measured| &measured.sigmas);
        let needed = [&self.x, &self.y].into_iter().chain(brightness);
        let wrong = needed.filter_map(|column| self.number(record, column).err());
        let not_positive = brightness.into_iter().chain(sigmas).filter_map(|column| {
            let value = self.number(record, column).ok()?;
            (value <= 0.0).then(|| format!("column {}: {value} is not above 0", column.name))
        });
        wrong.chain(not_positive).next()
    }

    fn number(&self, record: &StringRecord, column: &CentroidColumn) -> Result<f64, String> {
        let name = &column.name;
        let Some(text) = record.get(column.position) else {
            return Err(format!(
                "column {name} is missing: the line ends after {} of at least {} columns",
                record.len(),
                column.position + 1
            ));
        };
        let value = if self.has_decimal_commas && !text.contains('.') {
            text.replacen(',', ".", 1).parse()
        } else {
            text.parse::<f64>()
        };
        match value {
            Ok(value) if value.is_finite() => Ok(value),
            _ => Err(format!(
                "column {name}: '{}' is not a number",
                excerpt(text)
            )),
        }
    }
}

/// The standard error on one axis; NaN where one is not above 0.
fn sigma_of(sigma_x_px: f64, sigma_y_px: f64) -> f64 {
    if sigma_x_px > 0.0 && sigma_y_px > 0.0 {
        ((sigma_x_px.powi(2) + sigma_y_px.powi(2)) / 2.0).sqrt()
    } else {
        f64::NAN
    }
}

/// The error for headings without positions.
fn no_positions(headings: &StringRecord) -> String {
    let named: Vec<&str> = headings.iter().collect();
    let columns = if named.len() == 1 {
        "the single column"
    } else {
        "the columns"
    };
    let has_x = POSITIONS
        .iter()
        .any(|(x, ..)| named.iter().any(|name| name.eq_ignore_ascii_case(x)));
    let expected = if has_x { "y or y_px" } else { "x or x_px" };
    format!(
        "line 1 has {columns} {}; expected {expected} among them, or the names of photutils or \
         SExtractor, with commas, semicolons, tabs or blanks between",
        excerpt(&named.join(", "))
    )
}

impl MeasuredColumns {
    /// `None` unless all of them are there.
    fn find(column: impl Fn(&str) -> Option<CentroidColumn>) -> Option<Self> {
        let either = |names: [&str; 2]| names.into_iter().find_map(&column);
        Some(Self {
            frame: column("frame")?,
            sigmas: [
                either(["sigma_x", "x_centroid_err"])?,
                either(["sigma_y", "y_centroid_err"])?,
            ],
            flags: column("flags")?,
        })
    }

    fn flags(&self, record: &StringRecord) -> DetectionFlags {
        let text = record.get(self.flags.position).unwrap_or_default();
        let has = |flag: &str| text.split([' ', ',']).any(|word| word == flag);
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
