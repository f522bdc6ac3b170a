//! The settings of an upload: hints, or a list of stars in place of a picture.

use crate::base::coords::PixelPoint;
use crate::centroids::{CentroidList, CentroidListError, ListedCentroid, XylistOptions};
use crate::doors::scale::{ScaleRange, ScaleUnit};
use crate::identify::Photometry;
use crate::solve::SolveOptions;
use serde_json::{Map, Value};

/// Tolerance of an estimated scale without an error, in percent.
const SCALE_ERR: f64 = 10.0;

/// More rows of a list are refused: they would take too much memory.
const MAX_ROWS: usize = 100_000;

/// Why a setting cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("\"{name}\" must be {expected}")]
pub struct SettingError {
    name: String,
    expected: &'static str,
}

/// What an upload states. Its hints may be wrong.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Upload {
    /// The scale.
    pub scale: Option<ScaleRange>,
    /// Right ascension and declination of the frame's centre.
    near_deg: Option<[f64; 2]>,
    radius_deg: Option<f64>,
    /// Width and height of the picture of which a list is.
    sides: [Option<usize>; 2],
    /// Standard error of the places in a list, in pixels.
    error_px: Option<f64>,
    /// Places of stars, brightest first; the first pixel is (1, 1).
    places: Option<Vec<[f64; 2]>>,
}

impl Upload {
    /// What the settings state. Numbers may be texts.
    ///
    /// # Errors
    /// A setting that is used, with a value that it cannot have.
    pub fn from_json(settings: &Map<String, Value>) -> Result<Self, SettingError> {
        let settings = Settings(settings);
        let radius_deg = settings.number("radius")?;
        Ok(Self {
            scale: settings.scale()?,
            near_deg: settings.near_deg()?,
            radius_deg: radius_deg.filter(|deg| *deg > 0.0 && *deg <= 180.0),
            sides: [
                settings.side("image_width")?,
                settings.side("image_height")?,
            ],
            error_px: settings
                .number("positional_error")?
                .filter(|error_px| *error_px > 0.0),
            places: settings.places()?,
        })
    }

    /// Whether it has a list in place of a picture.
    pub fn has_list(&self) -> bool {
        self.places.is_some()
    }

    /// `options` with the direction that is stated.
    #[must_use]
    pub fn in_options(&self, options: SolveOptions) -> SolveOptions {
        let radius_deg = self.radius_deg.unwrap_or(options.radius_deg);
        SolveOptions {
            near_deg: self.near_deg,
            radius_deg,
            ..options
        }
    }

    /// The list of stars: its own, or the one in `file`, where that is a table of FITS with places.
    ///
    /// # Errors
    /// The table is too long.
    pub fn list(&self, file: &[u8]) -> Option<Result<CentroidList, CentroidListError>> {
        let list = match &self.places {
            Some(places) => Ok(Self::stated_list(places)),
            None => XylistOptions::default().read_bytes(file, MAX_ROWS)?,
        };
        Some(list.map(|list| self.completed(list)))
    }

    /// A list with what is stated beside it.
    fn completed(&self, mut list: CentroidList) -> CentroidList {
        for (stated, side) in self
            .sides
            .into_iter()
            .zip([&mut list.width, &mut list.height])
        {
            *side = stated.or(*side);
        }
        for centroid in &mut list.centroids {
            centroid.sigma_px = self.error_px;
        }
        list
    }

    fn stated_list(places: &[[f64; 2]]) -> CentroidList {
        let centroid = |(rank, [x, y]): (usize, &[f64; 2])| ListedCentroid {
            row: rank as u64 + 1,
            ..ListedCentroid::new(
                PixelPoint::new(x - 1.0, y - 1.0),
                ListedCentroid::mag_of_rank(rank),
            )
        };
        CentroidList {
            width: None,
            height: None,
            photometry: Photometry::Instrumental,
            has_brightness: false,
            centroids: places.iter().enumerate().map(centroid).collect(),
        }
    }
}

/// Settings by name.
struct Settings<'a>(&'a Map<String, Value>);

impl Settings<'_> {
    fn stated(&self, name: &str) -> Option<&Value> {
        self.0.get(name).filter(|value| !value.is_null())
    }

    fn number(&self, name: &str) -> Result<Option<f64>, SettingError> {
        let value = self.stated(name).map(number_of);
        value.map_or(Ok(None), |number| {
            number.map(Some).ok_or_else(|| refused(name, "a number"))
        })
    }

    fn side(&self, name: &str) -> Result<Option<usize>, SettingError> {
        let side = self.number(name)?;
        let is_side = |side: &f64| side.fract() == 0.0 && (1.0..=1e6).contains(side);
        match side {
            Some(side) if is_side(&side) => Ok(Some(side as usize)),
            Some(_) => Err(refused(name, "a number of pixels")),
            None => Ok(None),
        }
    }

    fn scale(&self) -> Result<Option<ScaleRange>, SettingError> {
        let unit = match self.stated("scale_units").and_then(Value::as_str) {
            None | Some("degwidth" | "degw" | "dw" | "") => ScaleUnit::DegreesWide,
            Some("arcminwidth" | "amw" | "aw") => ScaleUnit::ArcminutesWide,
            Some("arcsecperpix" | "app") => ScaleUnit::ArcsecondsPerPixel,
            Some("focalmm") => ScaleUnit::FocalLengthMm,
            Some(_) => {
                let expected = "degwidth, arcminwidth, arcsecperpix or focalmm";
                return Err(refused("scale_units", expected));
            }
        };
        let ends = [self.number("scale_lower")?, self.number("scale_upper")?];
        let estimate = self.number("scale_est")?;
        let error = self.number("scale_err")?.unwrap_or(SCALE_ERR) / 100.0;
        let is_estimate = self.stated("scale_type").and_then(Value::as_str) == Some("ev");
        let [low, high] = match estimate {
            Some(middle) if is_estimate || ends == [None, None] => {
                [middle * (1.0 - error), middle * (1.0 + error)].map(Some)
            }
            _ => ends,
        };
        let is_stated = low.or(high).is_some();
        Ok(is_stated.then_some(ScaleRange { unit, low, high }))
    }

    fn near_deg(&self) -> Result<Option<[f64; 2]>, SettingError> {
        let centre = [self.number("center_ra")?, self.number("center_dec")?];
        let [Some(ra_deg), Some(dec_deg)] = centre else {
            return Ok(None);
        };
        if dec_deg.abs() > 90.0 {
            return Err(refused("center_dec", "from -90 to 90"));
        }
        Ok(Some([ra_deg.rem_euclid(360.0), dec_deg]))
    }

    fn places(&self) -> Result<Option<Vec<[f64; 2]>>, SettingError> {
        let (Some(x), Some(y)) = (self.stated("x"), self.stated("y")) else {
            return Ok(None);
        };
        let numbers = |name: &str, list: &Value| -> Result<Vec<f64>, SettingError> {
            let list = list.as_array();
            let found = list.and_then(|list| list.iter().map(number_of).collect());
            found.ok_or_else(|| refused(name, "a list of numbers"))
        };
        let (x, y) = (numbers("x", x)?, numbers("y", y)?);
        if x.len() != y.len() {
            return Err(refused("y", "as long as \"x\""));
        }
        if x.len() > MAX_ROWS {
            return Err(refused("x", "a list of at most 100000 numbers"));
        }
        Ok(Some(x.into_iter().zip(y).map(|(x, y)| [x, y]).collect()))
    }
}

fn number_of(value: &Value) -> Option<f64> {
    let number = value
        .as_f64()
        .or_else(|| value.as_str()?.trim().parse().ok());
    number.filter(|number| number.is_finite())
}

fn refused(name: &str, expected: &'static str) -> SettingError {
    SettingError {
        name: name.to_owned(),
        expected,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::units::RAD_PER_ARCSEC;
    use serde_json::json;

    fn upload(settings: Value) -> Result<Upload, SettingError> {
        Upload::from_json(settings.as_object().unwrap())
    }

    /// The pixel scales of a frame 1000 pixels wide, in arcseconds.
    fn scale(settings: Value) -> Option<[f64; 2]> {
        let prior = upload(settings).unwrap().scale?.prior()?;
        let range = prior.pixel_scale_range_rad(1000.0);
        Some(range.map(|rad| (rad / RAD_PER_ARCSEC * 1e3).round() / 1e3))
    }

    #[test]
    fn scales_are_ranges_or_estimates() {
        let unit = "arcsecperpix";
        for settings in [
            json!({"scale_units": unit, "scale_lower": 8, "scale_upper": "12.0"}),
            json!({"scale_units": unit, "scale_type": "ul", "scale_lower": 8, "scale_upper": 12}),
            json!({"scale_units": unit, "scale_type": "ev", "scale_est": 10, "scale_err": 20}),
            json!({"scale_units": unit, "scale_est": 10, "scale_err": 20, "scale_lower": null}),
        ] {
            assert_eq!(scale(settings.clone()), Some([8.0, 12.0]), "{settings}");
        }
        // What web pages have as defaults tells nothing.
        let all = json!({"scale_units": "degwidth", "scale_lower": 0.1, "scale_upper": 180.0});
        assert_eq!(scale(all), None);
        assert_eq!(upload(json!({"session": "a"})).unwrap(), Upload::default());
    }

    #[test]
    fn a_direction_needs_both_of_its_angles() {
        let near = |settings| {
            let options = upload(settings)
                .unwrap()
                .in_options(SolveOptions::default());
            (options.near_deg, options.radius_deg)
        };
        let stated = json!({"center_ra": -10, "center_dec": "20", "radius": 3});
        assert_eq!(near(stated), (Some([350.0, 20.0]), 3.0));
        assert_eq!(near(json!({"center_ra": 10})), (None, 10.0));
        assert!(upload(json!({"center_ra": 10, "center_dec": 91})).is_err());
    }

    #[test]
    fn lists_count_from_one() {
        let settings =
            json!({"x": [1, "2.5"], "y": [10.0, 1], "image_width": 20, "image_height": 30});
        let list = upload(settings).unwrap().list(b"").unwrap().unwrap();
        assert_eq!([list.width, list.height], [Some(20), Some(30)]);
        let places: Vec<_> = list.centroids.iter().map(|star| star.position).collect();
        assert_eq!(
            places,
            [PixelPoint::new(0.0, 9.0), PixelPoint::new(1.5, 0.0)]
        );
        assert!(list.centroids[0].mag < list.centroids[1].mag);
        assert!(Upload::default().list(b"SIMPLE").is_none());
    }

    #[test]
    fn wrong_settings_are_named() {
        for (settings, expected) in [
            (
                json!({"scale_lower": "wide"}),
                "\"scale_lower\" must be a number",
            ),
            (
                json!({"scale_units": "px"}),
                "\"scale_units\" must be degwidth",
            ),
            (
                json!({"x": [1], "y": [1, 2]}),
                "\"y\" must be as long as \"x\"",
            ),
            (json!({"x": 1, "y": [1]}), "\"x\" must be a list of numbers"),
            (
                json!({"x": vec![1; MAX_ROWS + 1], "y": vec![1; MAX_ROWS + 1]}),
                "\"x\" must be a list of at most 100000 numbers",
            ),
            (
                json!({"image_width": 2.5}),
                "\"image_width\" must be a number of pixels",
            ),
        ] {
            let error = upload(settings).unwrap_err().to_string();
            assert!(error.starts_with(expected), "{error}");
        }
    }
}
