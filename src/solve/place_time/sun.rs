//! The Sun: what it hides, and where it would be.

use super::sky::ObservedSky;
use crate::base::coords::{Icrs, UnitVector};
use crate::base::epoch::ObservationDate;
use crate::base::units::{ARCSEC_PER_RAD, DEG_PER_RAD};
use crate::ephemeris::observer::Site;
use crate::ephemeris::solar_system::moon_and_sun;

/// True altitude of the Sun, in radians.
pub(super) fn altitude_rad(date: &ObservationDate, site: Site, zenith: &UnitVector<Icrs>) -> f64 {
    let (_, sun) = moon_and_sun(date, Some(site));
    libm::asin(zenith.dot(&sun).clamp(-1.0, 1.0))
}

/// By how many magnitudes the fainter of the named stars are fainter than what the sky lit by the Sun hides from
/// any camera; below 0 where it hides nothing.
pub(super) fn hidden_mag(sky: &ObservedSky, sun_rad: f64) -> f64 {
    /// Fewer stars may be anything.
    const MIN_STARS: usize = 10;
    /// A spot with so small a share of the light of its pixels is lost in the noise of any detector.
    const HIDDEN_MAG: f64 = 6.3;
    /// Filters and what is known of twilight may be off by this.
    const MARGIN_MAG: f64 = 2.0;
    let Some(faint) = sky.faint_v_mag().filter(|_| sky.stars.len() >= MIN_STARS) else {
        return f64::NEG_INFINITY;
    };
    let pixel_arcsec = ARCSEC_PER_RAD / sky.found.camera.central_focal_length_px();
    let sky_mag = twilight_mag_arcsec2(sun_rad) - 5.0 * libm::log10(pixel_arcsec);
    faint - sky_mag - HIDDEN_MAG - MARGIN_MAG
}

/// Brightness of the zenith in V, in magnitudes in a square arcsecond; above the horizon not brighter than a
/// blue sky.
///
/// # Reference
/// Patat, Ugolnikov & Postylyakov 2006, A&A 455, 385, table 3, for the Sun 5° to 15° below the horizon; half as
/// steep above that.
fn twilight_mag_arcsec2(sun_rad: f64) -> f64 {
    const BRIGHTEST: f64 = 4.0;
    let below_5_deg = -sun_rad * DEG_PER_RAD - 5.0;
    if below_5_deg < 0.0 {
        return (11.84 + 0.8 * below_5_deg).max(BRIGHTEST);
    }
    let lower = below_5_deg.min(10.0);
    11.84 + 1.518 * lower - 0.057 * lower * lower
}

/// How unlikely frames of stars are with the Sun there.
pub(super) fn cost(sun_rad: f64) -> f64 {
    const MAX: f64 = 30.0;
    let altitude_deg = sun_rad * DEG_PER_RAD;
    let twilight = ((altitude_deg + 12.0) / 4.0).max(0.0);
    (twilight * twilight).min(MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sky_grows_darker_as_the_sun_sinks() {
        let at = |deg: f64| twilight_mag_arcsec2(deg.to_radians());
        assert_eq!(at(30.0), 4.0);
        assert!((at(-5.0) - 11.84).abs() < 1e-9);
        assert!((at(-10.0) - 18.0).abs() < 0.1);
        assert!((at(-18.0) - 21.3).abs() < 0.1);
        let altitudes = (-40..30).map(f64::from);
        assert!(altitudes.map(at).is_sorted_by(|low, high| low >= high));
    }
}
