//! Values of options: what is out of range is refused where it is typed.

use starpipe::base::units::RAD_PER_DEG;
use starpipe::camera::focal_length_px;
use starpipe::model::sensitivity::{self, Spacing};
use starpipe::model::simulate;
use starpipe::study::robustness::Parameter;
use std::fmt::Display;
use std::path::PathBuf;
use std::str::FromStr;

/// A direction on the sky, in degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Direction {
    pub(crate) ra_deg: f64,
    pub(crate) dec_deg: f64,
}

/// Any number that is one.
pub(crate) fn finite(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(format!("'{text}' is not a number")),
    }
}

fn within(
    text: &str,
    what: impl Display,
    accepts: impl Fn(f64) -> bool,
    limits: &str,
) -> Result<f64, String> {
    let value = finite(text)?;
    if accepts(value) {
        Ok(value)
    } else {
        Err(format!("{what} must be {limits}"))
    }
}

/// A number above zero.
pub(crate) fn positive(text: &str) -> Result<f64, String> {
    within(text, "the number", |v| v > 0.0, "above 0")
}

/// A number that is zero or above it.
pub(crate) fn not_negative(text: &str) -> Result<f64, String> {
    within(text, "the number", |v| v >= 0.0, "0 or above")
}

/// A number above zero, one at most.
pub(crate) fn share(text: &str) -> Result<f64, String> {
    within(
        text,
        "the part",
        |v| v > 0.0 && v <= 1.0,
        "above 0 and at most 1",
    )
}

/// A right ascension in degrees.
pub(crate) fn right_ascension(text: &str) -> Result<f64, String> {
    let limits = "from 0 to 360 degrees";
    let accepts = |v| (0.0..=360.0).contains(&v);
    within(text, "the right ascension", accepts, limits)
}

/// A declination in degrees.
pub(crate) fn declination(text: &str) -> Result<f64, String> {
    let limits = "from -90 to 90 degrees";
    within(
        text,
        "the declination",
        |v| (-90.0..=90.0).contains(&v),
        limits,
    )
}

/// A mean number of stars.
pub(crate) fn star_count(text: &str) -> Result<f64, String> {
    let limits = "above 0 and at most 10000";
    within(text, "the number of stars", |v| v > 0.0 && v <= 1e4, limits)
}

/// A part of something, in percent.
pub(crate) fn part(text: &str) -> Result<f64, String> {
    let limits = "0 to 100 percent";
    within(text, "the part", |v| (0.0..=100.0).contains(&v), limits)
}

/// A multiple of something, in percent.
pub(crate) fn multiple(text: &str) -> Result<f64, String> {
    let limits = "0 to 10000 percent";
    within(text, "the multiple", |v| (0.0..=1e4).contains(&v), limits)
}

/// Values of one parameter, evenly spaced.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Sweep {
    pub(crate) parameter: Parameter,
    pub(crate) values: Vec<f64>,
}

/// More values than this are a mistake.
const SWEEP_VALUES_MAX: usize = 1000;

impl FromStr for Sweep {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, range) = named_range(text, "NAME=FROM:TO:COUNT")?;
        let known = Parameter::ALL.iter().find(|known| known.name() == name);
        let parameter = *known.ok_or_else(|| {
            let names = Parameter::ALL.map(Parameter::name).join(", ");
            format!("'{name}' is not one of {names}")
        })?;
        let check = match parameter {
            Parameter::FieldOfView => field_of_view,
            Parameter::Stars => star_count,
            Parameter::CentroidError | Parameter::MagError => not_negative,
            Parameter::Missing => part,
            Parameter::FalseStars => multiple,
        };
        let [from, to, count] = range[..] else {
            return Err(not_of_form(text, "NAME=FROM:TO:COUNT"));
        };
        let (from, to, count) = (check(from)?, check(to)?, whole(count)?);
        if !(1..=SWEEP_VALUES_MAX).contains(&count) {
            return Err(format!("the count must be 1 to {SWEEP_VALUES_MAX}"));
        }
        Ok(Self {
            parameter,
            values: Spacing::Linear.values(from, to, count),
        })
    }
}

/// A sweep of the sensitivity.
#[derive(Debug, Clone)]
pub(crate) struct LimitSweep(pub(crate) sensitivity::Sweep);

impl FromStr for LimitSweep {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, steps) = named_steps(text)?;
        let Steps {
            ends,
            count,
            spacing,
        } = steps;
        sensitivity::Sweep::new(&name, ends, count, spacing)
            .map(Self)
            .map_err(|error| error.to_string())
    }
}

/// FROM:TO:COUNT[:log].
pub(crate) struct Steps {
    pub(crate) ends: (f64, f64),
    pub(crate) count: usize,
    pub(crate) spacing: Spacing,
}

impl Steps {
    /// Of `range`, which is `text` or the end of it; `form` is what that should look like.
    fn of(range: &str, text: &str, form: &str) -> Result<Self, String> {
        let parts: Vec<&str> = range.split(':').collect();
        let (from, to, count, spacing) = match parts[..] {
            [from, to, count] => (from, to, count, Spacing::Linear),
            [from, to, count, "log"] => (from, to, count, Spacing::Log),
            _ => return Err(not_of_form(text, form)),
        };
        Ok(Self {
            ends: (finite(from)?, finite(to)?),
            count: whole(count)?,
            spacing,
        })
    }
}

impl FromStr for Steps {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::of(text, text, "FROM:TO:COUNT or FROM:TO:COUNT:log")
    }
}

/// The parts of NAME=FROM:TO:COUNT[:log].
fn named_steps(text: &str) -> Result<(String, Steps), String> {
    const FORM: &str = "NAME=FROM:TO:COUNT or NAME=FROM:TO:COUNT:log";
    let (name, range) = text
        .split_once('=')
        .ok_or_else(|| not_of_form(text, FORM))?;
    Ok((name.replace('-', "_"), Steps::of(range, text, FORM)?))
}

/// What a study is over.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Studied {
    /// A parameter of the camera, of the conditions, or of the scene.
    Parameter(simulate::Parameter),
    /// The horizontal field of view, in degrees: the focal length follows it, pixels and spot stay as they are.
    FieldOfView,
}

impl Studied {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Parameter(parameter) => parameter.name(),
            Self::FieldOfView => FIELD_OF_VIEW,
        }
    }

    /// What an axis of it is called.
    pub(crate) fn title(self) -> String {
        match self {
            Self::Parameter(parameter) => parameter.title(),
            Self::FieldOfView => "horizontal field of view (°)".to_owned(),
        }
    }

    pub(crate) fn set(self, setup: &mut simulate::Setup, value: f64) {
        match self {
            Self::Parameter(parameter) => parameter.set(setup, value),
            Self::FieldOfView => {
                let sensor = &mut setup.scenario.sensor;
                let pitch_um = (sensor.pitch_x_um * sensor.pitch_y_um).sqrt();
                let focal_px = focal_length_px(sensor.width_px as f64, value * RAD_PER_DEG);
                sensor.focal_length_mm = focal_px * pitch_um * 1e-3;
            }
        }
    }
}

const FIELD_OF_VIEW: &str = "fov_deg";

/// A sweep of a study.
#[derive(Debug, Clone)]
pub(crate) struct StudySweep {
    pub(crate) studied: Studied,
    pub(crate) values: Vec<f64>,
    pub(crate) spacing: Spacing,
}

impl FromStr for StudySweep {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, steps) = named_steps(text)?;
        let Steps {
            ends,
            count,
            spacing,
        } = steps;
        let values = spacing
            .checked_values(ends, count)
            .map_err(|error| error.to_string())?;
        let studied = if name == FIELD_OF_VIEW {
            Studied::FieldOfView
        } else {
            let found = simulate::Parameter::named(&name);
            Studied::Parameter(found.map_err(|error| error.to_string())?)
        };
        for &value in &values {
            match studied {
                Studied::FieldOfView => drop(field_of_view(&value.to_string())?),
                Studied::Parameter(parameter) if !parameter.limits().accept(value) => {
                    let expected = parameter.limits();
                    return Err(format!("{name} would be {value}, expected {expected}"));
                }
                Studied::Parameter(_) => (),
            }
        }
        Ok(Self {
            studied,
            values,
            spacing,
        })
    }
}

/// The name and the parts of NAME=PART:PART:...
fn named_range<'a>(text: &'a str, form: &str) -> Result<(&'a str, Vec<&'a str>), String> {
    let (name, range) = text
        .split_once('=')
        .ok_or_else(|| not_of_form(text, form))?;
    Ok((name, range.split(':').collect()))
}

fn not_of_form(text: &str, form: &str) -> String {
    format!("'{text}' is not of the form {form}")
}

fn whole(text: &str) -> Result<usize, String> {
    let count = text.trim().parse();
    count.map_err(|_| format!("'{text}' is not a whole number"))
}

/// A horizontal field of view in degrees.
pub(crate) fn field_of_view(text: &str) -> Result<f64, String> {
    within(
        text,
        "the field of view",
        |v| v > 0.0 && v < 180.0,
        "above 0 and below 180 degrees",
    )
}

/// An exposure in seconds.
pub(crate) fn exposure(text: &str) -> Result<f64, String> {
    let limits = "from 0.000001 to 1000000 s";
    within(text, "the exposure", |v| (1e-6..=1e6).contains(&v), limits)
}

/// An exposure, and the file or directory whose frames have it; else all.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ExposureOf {
    pub(crate) exposure_s: f64,
    pub(crate) path: Option<PathBuf>,
}

impl FromStr for ExposureOf {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (seconds, path) = match text.split_once(':') {
            Some((_, "")) => return Err(not_of_form(text, "SECONDS or SECONDS:PATH")),
            Some((seconds, path)) => (seconds, Some(PathBuf::from(path))),
            None => (text, None),
        };
        Ok(Self {
            exposure_s: exposure(seconds)?,
            path,
        })
    }
}

/// A zenith distance in degrees.
pub(crate) fn zenith_distance(text: &str) -> Result<f64, String> {
    let limits = "from 0 to below 90 degrees";
    within(
        text,
        "the zenith distance",
        |v| (0.0..90.0).contains(&v),
        limits,
    )
}

/// Extinction in magnitudes for each airmass.
pub(crate) fn extinction(text: &str) -> Result<f64, String> {
    let limits = "from 0 to 10 magnitudes";
    within(
        text,
        "the extinction",
        |v| (0.0..=10.0).contains(&v),
        limits,
    )
}

/// A pixel scale in arcseconds.
pub(crate) fn pixel_scale(text: &str) -> Result<f64, String> {
    within(
        text,
        "the pixel scale",
        |v| v > 0.0 && v <= 36_000.0,
        "above 0 and at most 36000 arcseconds",
    )
}

/// A relative error in percent.
pub(crate) fn percent(text: &str) -> Result<f64, String> {
    within(
        text,
        "the error of the scale",
        |v| v > 0.0 && v < 100.0,
        "above 0 and below 100 percent",
    )
}

/// A radius on the sky in degrees.
pub(crate) fn radius(text: &str) -> Result<f64, String> {
    within(
        text,
        "the radius",
        |v| v > 0.0 && v <= 180.0,
        "above 0 and at most 180 degrees",
    )
}

/// Right ascension and declination in degrees, with a comma between them.
pub(crate) fn direction(text: &str) -> Result<Direction, String> {
    let (ra, dec) = text.split_once(',').ok_or(
        "right ascension and declination in degrees are needed, with a comma between them",
    )?;
    let ra_deg = within(
        ra,
        "right ascension",
        |v| (0.0..=360.0).contains(&v),
        "from 0 to 360 degrees",
    )?;
    let dec_deg = within(
        dec,
        "declination",
        |v| (-90.0..=90.0).contains(&v),
        "from -90 to 90 degrees",
    )?;
    Ok(Direction { ra_deg, dec_deg })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_finite() {
        assert_eq!(finite(" -1.5 "), Ok(-1.5));
        for text in ["NaN", "inf", "-inf", "", "ten", "1,5"] {
            assert!(finite(text).is_err(), "{text}");
        }
    }

    #[test]
    fn a_direction_is_on_the_sky() {
        let orion = Direction {
            ra_deg: 83.8,
            dec_deg: -1.2,
        };
        assert_eq!(direction("83.8,-1.2"), Ok(orion));
        assert_eq!(direction("83.8, -1.2"), Ok(orion));
        for text in ["400,0", "-1,0", "0,91", "0", "0,NaN", "1,2,3"] {
            assert!(direction(text).is_err(), "{text}");
        }
    }

    #[test]
    fn a_study_may_be_over_the_field_of_view() {
        let sweep: StudySweep = "fov-deg=5:20:4".parse().unwrap();
        assert_eq!(sweep.values, [5.0, 10.0, 15.0, 20.0]);
        let mut setup = simulate::Setup {
            scenario: sensitivity::Scenario::of(
                starpipe::camera::data_sheet::Preset::NanosatTracker,
            ),
            scene: simulate::Scene::default(),
        };
        sweep.studied.set(&mut setup, 10.0);
        let scenario = setup.scenario;
        let half_width_um = 0.5 * scenario.sensor.width_px as f64 * scenario.sensor.pitch_x_um;
        let half_rad = (half_width_um * 1e-3 / scenario.sensor.focal_length_mm).atan();
        assert!((2.0 * half_rad.to_degrees() - 10.0).abs() < 1e-9);
        for (text, expected) in [
            ("fov_deg=20:5:4", "expected a rising one"),
            ("fov_deg=5:180:4", "below 180 degrees"),
            ("fov_deg=0:20:4", "above 0, ..."),
            ("apertur=5:20:4", "did you mean 'aperture_mm'?"),
            ("aperture_mm=5:20", "is not of the form NAME=FROM:TO:COUNT"),
        ] {
            let error = text.parse::<StudySweep>().unwrap_err();
            let expected = expected.trim_end_matches(", ...");
            assert!(error.contains(expected), "{error}");
        }
    }

    #[test]
    fn ranges_leave_out_what_makes_no_sense() {
        assert!(field_of_view("180").is_err() && field_of_view("0").is_err());
        assert!(percent("100").is_err() && percent("10").is_ok());
        assert!(radius("181").is_err() && radius("180").is_ok());
        assert!(pixel_scale("-1").is_err() && positive("0").is_err());
    }
}
