//! Options of solving by name: what each of them may be, for the command line, Python and the page alike.

use super::options::SolveOptions;
use crate::base::angle::{declination_deg, right_ascension_deg};
use crate::base::clock::UtcOffset;
use crate::base::epoch::ObservationDate;
use crate::ephemeris::observer::{Air, Site};
use serde::Serialize;
use serde::de::value::{Error as NoWord, StrDeserializer};
use serde::de::{DeserializeOwned, IntoDeserializer};
use serde_json::Value;
use std::fmt::Display;
use std::ops::{Bound, RangeBounds};
use std::str::FromStr;

/// Where ranges begin that are open at 0.
const ABOVE_0: f64 = f64::MIN_POSITIVE;

/// Why an option cannot be set.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{name} {reason}")]
#[non_exhaustive]
pub struct SolveOptionError {
    /// Name of the option: words joined by underscores.
    pub name: String,
    /// What goes on after the name: `must be more than 0, not -3`.
    pub reason: String,
}

impl SolveOptions {
    /// The same with what is stated by names: a map, or a struct with fields of these names. Values are as
    /// people write them on the command line; what is null is not stated.
    ///
    /// # Errors
    /// What is no option, and values outside an option's range.
    ///
    /// # Example
    /// ```
    /// use starpipe::SolveOptions;
    /// use std::collections::BTreeMap;
    ///
    /// let stated = BTreeMap::from([("fov", "20"), ("near", "05h35m17s,-05d23m28s")]);
    /// let options = SolveOptions::default().with(&stated)?;
    /// assert_eq!(options.fov_deg, Some(20.0));
    /// # Ok::<(), starpipe::solve::SolveOptionError>(())
    /// ```
    pub fn with(mut self, stated: &impl Serialize) -> Result<Self, SolveOptionError> {
        let refused = |name: &str, reason| SolveOptionError {
            name: name.to_owned(),
            reason,
        };
        let Ok(Value::Object(stated)) = serde_json::to_value(stated) else {
            return Err(refused("the options", "must have names".to_owned()));
        };
        for (name, value) in &stated {
            let set = match value {
                Value::Null => Ok(()),
                Value::String(text) => self.set(name, text),
                value => self.set(name, &value.to_string()),
            };
            set.map_err(|reason| refused(name, reason))?;
        }
        Ok(self)
    }

    fn set(&mut self, name: &str, text: &str) -> Result<(), String> {
        let number = Number(text);
        match name {
            "fov" => number.put(&mut self.fov_deg, ABOVE_0..360.0, "degrees"),
            "pixel_scale" => number.put(&mut self.pixel_scale_arcsec, ABOVE_0..=36e3, "arcseconds"),
            "scale_error" => number.put(&mut self.scale_error_percent, ABOVE_0..100.0, "percent"),
            "near" => put(&mut self.near_deg, direction(text)),
            "radius" => number.put(&mut self.radius_deg, ABOVE_0..=180.0, "degrees"),
            "date" => put(&mut self.date, parsed::<ObservationDate>(text)),
            "utc_offset" => put(&mut self.utc_offset, parsed::<UtcOffset>(text)),
            "site" => put(&mut self.site, parsed::<Site>(text)),
            "air" => put(&mut self.air, air(text)),
            "velocity" => put(&mut self.velocity_km_s, velocity(text)),
            "frame_of" => word(text, &mut self.attitude_frame, "icrs or apparent"),
            "exposure" => number.put(&mut self.exposure_s, 1e-6..=1e6, "s"),
            "zenith_distance" => number.put(&mut self.zenith_distance_deg, 0.0..90.0, "degrees"),
            "extinction" => number.put(
                &mut self.extinction_mag_per_airmass,
                0.0..=10.0,
                "magnitudes",
            ),
            "sigma" => number.put(&mut self.sigma, ABOVE_0.., ""),
            "false_alarms" => number.put(&mut self.false_alarms_per_mpx, ABOVE_0.., ""),
            "max_stars" => put(&mut self.max_stars, star_count(text)),
            "centroid" => word(text, &mut self.centroid, "gaussian-fit or grey-weighted"),
            "name_odds" => number.put(&mut self.name_odds, 1.0.., ""),
            "effort" => word(text, &mut self.effort, "fast, normal or thorough"),
            "refine_lens" => put(&mut self.refine_lens, switch(text)),
            "only" if text == "pointing" => put(&mut self.attitude_only, Ok(true)),
            "only" => must_be("pointing", text),
            "attitude_only" => put(&mut self.attitude_only, switch(text)),
            "sky" => put(&mut self.sky, switch(text)),
            "trails" => put(&mut self.trails, switch(text)),
            "time_limit" => number.put(&mut self.time_limit_s, ABOVE_0.., "s"),
            _ => Err("is not an option".to_owned()),
        }
    }
}

fn put<T: From<V>, V>(field: &mut T, value: Result<V, String>) -> Result<(), String> {
    *field = value?.into();
    Ok(())
}

fn must_be<T>(what: &str, text: &str) -> Result<T, String> {
    Err(format!("must be {what}, not {text}"))
}

/// The text of a number.
struct Number<'t>(&'t str);

impl Number<'_> {
    fn put<T: From<f64>>(
        &self,
        field: &mut T,
        range: impl RangeBounds<f64>,
        unit: &str,
    ) -> Result<(), String> {
        match self.within(&range) {
            Some(value) => put(field, Ok(value)),
            None => must_be(format!("{} {unit}", words_of(&range)).trim_end(), self.0),
        }
    }

    fn within(&self, range: &impl RangeBounds<f64>) -> Option<f64> {
        let value: f64 = self.0.trim().parse().ok()?;
        (value.is_finite() && range.contains(&value)).then_some(value)
    }
}

/// A range in words: `more than 0 and less than 360`.
fn words_of(range: &impl RangeBounds<f64>) -> String {
    let least = match range.start_bound() {
        Bound::Included(&from) if from > ABOVE_0 || from == 0.0 => format!("at least {from}"),
        _ => "more than 0".to_owned(),
    };
    match range.end_bound() {
        Bound::Included(to) => format!("{least} and at most {to}"),
        Bound::Excluded(to) => format!("{least} and less than {to}"),
        Bound::Unbounded => least,
    }
}

fn star_count(text: &str) -> Result<usize, String> {
    let stars = Number(text).within(&(4.0..));
    let whole = stars.filter(|stars| stars.fract() == 0.0);
    whole.map_or_else(
        || must_be("a whole number of at least 4", text),
        |stars| Ok(stars as usize),
    )
}

fn switch(text: &str) -> Result<bool, String> {
    text.parse().or_else(|_| must_be("true or false", text))
}

fn parsed<T: FromStr<Err: Display>>(text: &str) -> Result<T, String> {
    text.parse()
        .map_err(|error: T::Err| format!("is invalid: {error}"))
}

/// Puts the value that is stored as this word, one of `words`.
fn word<T: DeserializeOwned>(text: &str, field: &mut T, words: &str) -> Result<(), String> {
    let word: StrDeserializer<'_, NoWord> = text.into_deserializer();
    put(
        field,
        T::deserialize(word).or_else(|_| must_be(words, text)),
    )
}

/// Right ascension and declination in degrees.
fn direction(text: &str) -> Result<[f64; 2], String> {
    const FORM: &str = "right ascension (a number from 0 to 360 degrees, or from 0 to 24 hours) and \
                        declination (from -90 to 90 degrees), separated by a comma";
    let parse = |(ra, dec)| Some([right_ascension_deg(ra)?, declination_deg(dec)?]);
    let found = text.split_once(',').and_then(parse);
    found.map_or_else(|| must_be(FORM, text), Ok)
}

/// Pressure in hPa and temperature in °C.
fn air(text: &str) -> Result<Air, String> {
    const FORM: &str = "pressure (from 0 to 1200 hPa) and temperature (from -100 to 70 °C), \
                        separated by a comma";
    let parse = |(pressure, temperature)| {
        let pressure_hpa = Number(pressure).within(&(0.0..=1200.0))?;
        let temperature_c = Number(temperature).within(&(-100.0..=70.0))?;
        Some(Air::new(pressure_hpa, temperature_c))
    };
    let found = text.split_once(',').and_then(parse);
    found.map_or_else(|| must_be(FORM, text), Ok)
}

/// A velocity along three axes: of at most a tenth of the speed of light.
fn velocity(text: &str) -> Result<[f64; 3], String> {
    const FORM: &str = "three numbers from -30000 to 30000 km/s, separated by commas";
    let along = |text| Number(text).within(&(-3e4..=3e4));
    let found: Option<Vec<f64>> = text.split(',').map(along).collect();
    let found = found.and_then(|along| along.try_into().ok());
    found.map_or_else(|| must_be(FORM, text), Ok)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    fn set(name: &str, text: &str) -> Result<SolveOptions, SolveOptionError> {
        SolveOptions::default().with(&BTreeMap::from([(name, text)]))
    }

    #[test]
    fn directions_are_read_in_degrees_and_in_sixtieths() {
        for text in [
            "83.822083,-5.391111",
            "05h35m17.3s,-05d23m28s",
            "5:35:17.3, -5:23:28",
            "83.822083,-05:23:28",
        ] {
            let [ra_deg, dec_deg] = set("near", text).unwrap().near_deg.unwrap();
            assert!((ra_deg - 83.822_083).abs() < 1e-6, "{text}: {ra_deg}");
            assert!((dec_deg + 5.391_111).abs() < 1e-6, "{text}: {dec_deg}");
        }
    }

    #[test]
    fn words_are_those_that_are_told() {
        for (name, words) in [
            ("frame_of", "icrs apparent"),
            ("centroid", "gaussian-fit grey-weighted"),
            ("effort", "fast normal thorough"),
            ("sky", "true false"),
        ] {
            let refused = set(name, "none").unwrap_err();
            for word in words.split(' ') {
                assert!(refused.reason.contains(word), "{refused}");
                assert!(set(name, word).is_ok(), "{name} {word}");
            }
        }
    }

    #[test]
    fn values_out_of_range_are_refused() {
        for (name, texts) in [
            (
                "near",
                "400,0; -1,0; 0,91; 0; 0,NaN; 1,2,3; 5:61,0; 25h,0; 5h35x,0; ::,0; 5,91d; 1e999,0",
            ),
            ("fov", "360; 0; NaN; inf; ; ten; 1,5"),
            ("scale_error", "0; 100"),
            ("radius", "0; 181"),
            ("pixel_scale", "-1; 36001"),
            ("max_stars", "3; 4.5"),
            ("air", "1000; 1300,0; 1000,80"),
            ("velocity", "1,2; 1,2,40000"),
            ("fov_deg", "10"),
        ] {
            for text in texts.split("; ") {
                assert!(set(name, text).is_err(), "{name} {text}");
            }
        }
        let told = |name, text| set(name, text).unwrap_err().to_string();
        assert_eq!(told("sigma", "-3"), "sigma must be more than 0, not -3");
        let expected = "zenith_distance must be at least 0 and less than 90 degrees, not 90";
        assert_eq!(told("zenith_distance", "90"), expected);
    }
}
