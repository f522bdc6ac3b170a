//! Parsers of option values, which refuse values out of range.

use starpipe::base::angle::Angle;
use starpipe::ephemeris::observer::Air;
use std::fmt::Display;

/// Largest side of a frame, in pixels.
pub(crate) const MAX_SIDE_PX: i64 = 1_000_000;

/// A direction on the sky, in degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Direction {
    pub(crate) ra_deg: f64,
    pub(crate) dec_deg: f64,
}

/// A number; neither NaN nor infinite.
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

/// Odds to one.
pub(crate) fn odds(text: &str) -> Result<f64, String> {
    within(text, "the odds", |v| v >= 1.0, "1 or above")
}

/// A number of zero or above.
pub(crate) fn not_negative(text: &str) -> Result<f64, String> {
    within(text, "the number", |v| v >= 0.0, "0 or above")
}

/// A number above zero and at most one.
pub(crate) fn share(text: &str) -> Result<f64, String> {
    within(
        text,
        "the part",
        |v| v > 0.0 && v <= 1.0,
        "above 0 and at most 1",
    )
}

/// A right ascension: degrees, or hours, minutes and seconds. In degrees.
pub(crate) fn right_ascension(text: &str) -> Result<f64, String> {
    const DEG_PER_HOUR: f64 = 15.0;
    let value = match Angle::parse(text) {
        Some(Angle::Hours(hours) | Angle::Sexagesimal(hours)) => hours * DEG_PER_HOUR,
        Some(Angle::Decimal(degrees) | Angle::Degrees(degrees)) => degrees,
        None => finite(text)?,
    };
    if (0.0..=360.0).contains(&value) {
        return Ok(value);
    }
    Err("the right ascension must be from 0 to 360 degrees, or from 0 to 24 hours".to_owned())
}

/// A declination: degrees, or degrees, minutes and seconds. In degrees.
pub(crate) fn declination(text: &str) -> Result<f64, String> {
    let angle = Angle::parse(text).and_then(Angle::in_degrees);
    let value = angle.map_or_else(|| finite(text), Ok)?;
    if (-90.0..=90.0).contains(&value) {
        return Ok(value);
    }
    Err("the declination must be from -90 to 90 degrees".to_owned())
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

/// A horizontal field of view in degrees.
pub(crate) fn field_of_view(text: &str) -> Result<f64, String> {
    within(
        text,
        "the field of view",
        |v| v > 0.0 && v < 180.0,
        "above 0 and below 180 degrees",
    )
}

/// The same of any lens, in degrees.
pub(crate) fn field_of_any_lens(text: &str) -> Result<f64, String> {
    within(
        text,
        "the field of view",
        |v| v > 0.0 && v < 360.0,
        "above 0 and below 360 degrees",
    )
}

/// An exposure in seconds.
pub(crate) fn exposure(text: &str) -> Result<f64, String> {
    let limits = "from 0.000001 to 1000000 s";
    within(text, "the exposure", |v| (1e-6..=1e6).contains(&v), limits)
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

/// Right ascension and declination in degrees, separated by a comma.
pub(crate) fn direction(text: &str) -> Result<Direction, String> {
    let (ra, dec) = text
        .split_once(',')
        .ok_or("expected right ascension and declination, separated by a comma")?;
    Ok(Direction {
        ra_deg: right_ascension(ra)?,
        dec_deg: declination(dec)?,
    })
}

/// Pressure in hPa and temperature in °C.
pub(crate) fn air(text: &str) -> Result<Air, String> {
    let (pressure, temperature) = text
        .split_once(',')
        .ok_or("expected pressure and temperature, separated by a comma")?;
    let pressure_hpa = within(
        pressure,
        "the pressure",
        |v| (0.0..=1200.0).contains(&v),
        "from 0 to 1200 hPa",
    )?;
    let temperature_c = within(
        temperature,
        "the temperature",
        |v| (-100.0..=70.0).contains(&v),
        "from -100 to 70 °C",
    )?;
    Ok(Air::new(pressure_hpa, temperature_c))
}

/// A velocity in km/s, along three axes.
pub(crate) fn velocity(text: &str) -> Result<[f64; 3], String> {
    /// A tenth of the speed of light.
    const MAX_KM_S: f64 = 3e4;
    let along: Vec<f64> = text.split(',').map(finite).collect::<Result<_, _>>()?;
    let km_s: [f64; 3] = along
        .try_into()
        .map_err(|_| "expected three numbers, separated by commas".to_owned())?;
    let is_slow = km_s.iter().all(|along| along.abs() <= MAX_KM_S);
    is_slow
        .then_some(km_s)
        .ok_or_else(|| format!("the velocity must be at most {MAX_KM_S} km/s along each axis"))
}

pub(crate) fn not_of_form(text: &str, form: &str) -> String {
    format!("'{text}' is not of the form {form}")
}

pub(crate) fn whole(text: &str) -> Result<usize, String> {
    let count = text.trim().parse();
    count.map_err(|_| format!("'{text}' is not a whole number"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_read_in_degrees_and_in_sixtieths() {
        let expected = (83.822_083, -5.391_111);
        for text in [
            "83.822083,-5.391111",
            "05h35m17.3s,-05d23m28s",
            "5:35:17.3, -5:23:28",
            "83.822083,-05:23:28",
        ] {
            let found = direction(text).unwrap();
            assert!(
                (found.ra_deg - expected.0).abs() < 1e-6,
                "{text}: {found:?}"
            );
            assert!(
                (found.dec_deg - expected.1).abs() < 1e-6,
                "{text}: {found:?}"
            );
        }
        assert_eq!(declination("-0:30"), Ok(-0.5));
        assert_eq!(right_ascension("12h"), Ok(180.0));
        for text in [
            "5:61,0",
            "25h,0",
            "1:2:3:4,0",
            "5h35x,0",
            "::,0",
            "5,91d",
            "NaN,0",
            "1e999,0",
        ] {
            assert!(direction(text).is_err(), "{text}");
        }
    }

    #[test]
    fn nan_infinity_and_words_are_refused() {
        assert_eq!(finite(" -1.5 "), Ok(-1.5));
        for text in ["NaN", "inf", "-inf", "", "ten", "1,5"] {
            assert!(finite(text).is_err(), "{text}");
        }
    }

    #[test]
    fn a_direction_off_the_sky_is_refused() {
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
    fn values_out_of_range_are_refused() {
        assert!(field_of_view("180").is_err() && field_of_view("0").is_err());
        assert!(percent("100").is_err() && percent("10").is_ok());
        assert!(radius("181").is_err() && radius("180").is_ok());
        assert!(pixel_scale("-1").is_err() && positive("0").is_err());
    }
}
