//! Reports satellites, aeroplanes and meteors.

use super::digits::{
    DIRECTION_DECIMALS, FLUX_DIGITS, HORIZON_DECIMALS, MAG_DECIMALS, PIXEL_DECIMALS, SIGMA_DIGITS,
};
use super::frame_report::TrailReport;
use crate::base::coords::{Icrs, PixelPoint, UnitVector};
use crate::base::format::{finite, to_decimals, to_significant, turn_deg};
use crate::base::statistics::GAUSSIAN_FWHM;
use crate::base::units::{ARCSEC_PER_RAD, DEG_PER_RAD};
use crate::detect::Trail;
use crate::ephemeris::observer::Observation;
use crate::photometry::instrumental_mag;
use crate::solve::Solution;

/// The trails of a frame, where they were searched.
pub(super) fn reports(solution: &Solution) -> Option<Vec<TrailReport>> {
    let trails = solution.trails.as_ref()?;
    Some(trails.iter().map(|trail| report(solution, trail)).collect())
}

fn report(solution: &Solution, trail: &Trail) -> TrailReport {
    let photometry = solution.photometry.as_ref();
    let v_mag = photometry.and_then(|measured| {
        let flux = trail.flux_adu() / measured.exposure_s.unwrap_or(1.0);
        Some(measured.zero_point.as_ref()?.v_mag + instrumental_mag(flux))
    });
    let [begin, end] = [trail.begin, trail.end].map(|end| TrailEnd::of(solution, &end));
    let length_rad = begin
        .direction
        .zip(end.direction)
        .map(|(begin, end)| begin.angle_to(&end));
    let per_arcsec = v_mag
        .zip(length_rad)
        .map(|(v_mag, rad)| v_mag + 2.5 * libm::log10(rad * ARCSEC_PER_RAD));
    let mag = |v_mag: f64| finite(v_mag, MAG_DECIMALS);
    TrailReport {
        x_begin: to_decimals(trail.begin.x, PIXEL_DECIMALS),
        y_begin: to_decimals(trail.begin.y, PIXEL_DECIMALS),
        x_end: to_decimals(trail.end.x, PIXEL_DECIMALS),
        y_end: to_decimals(trail.end.y, PIXEL_DECIMALS),
        sigma_across_px: to_significant(trail.across_sigma_px, SIGMA_DIGITS),
        length_px: to_decimals(trail.length_px(), PIXEL_DECIMALS),
        width_px: to_significant(GAUSSIAN_FWHM * trail.width_sigma_px, SIGMA_DIGITS),
        flux: to_significant(trail.flux_adu(), FLUX_DIGITS),
        flux_per_px: to_significant(trail.flux_per_px_adu, FLUX_DIGITS),
        snr: to_significant(trail.snr, FLUX_DIGITS),
        log10_false_alarm: to_decimals(trail.log10_false_alarm, 1),
        vmag: v_mag.and_then(mag),
        vmag_per_arcsec: per_arcsec.and_then(mag),
        length_deg: length_rad.and_then(|rad| finite(rad * DEG_PER_RAD, DIRECTION_DECIMALS)),
        ra_begin_deg: begin.ra_deg(),
        dec_begin_deg: begin.dec_deg(),
        ra_end_deg: end.ra_deg(),
        dec_end_deg: end.dec_deg(),
        altitude_begin_deg: begin.altitude_deg(),
        azimuth_begin_deg: begin.azimuth_deg(),
        altitude_end_deg: end.altitude_deg(),
        azimuth_end_deg: end.azimuth_deg(),
    }
}

/// Where an end is seen, where that is known.
struct TrailEnd {
    direction: Option<UnitVector<Icrs>>,
    observed: Option<Observation>,
}

impl TrailEnd {
    fn of(solution: &Solution, pixel: &PixelPoint) -> Self {
        let found = solution.outcome.identification();
        let direction = found.and_then(|found| found.direction_of(pixel));
        let observed = direction.and_then(|direction| {
            Observation::new(solution.site?, &solution.date?.date, &direction)
        });
        Self {
            direction,
            observed,
        }
    }

    fn ra_deg(&self) -> Option<f64> {
        let (ra_rad, _) = self.direction?.to_ra_dec();
        Some(turn_deg(ra_rad * DEG_PER_RAD, DIRECTION_DECIMALS))
    }

    fn dec_deg(&self) -> Option<f64> {
        let (_, dec_rad) = self.direction?.to_ra_dec();
        Some(to_decimals(dec_rad * DEG_PER_RAD, DIRECTION_DECIMALS))
    }

    /// Apparent altitude.
    fn altitude_deg(&self) -> Option<f64> {
        let zenith_deg = self.observed?.apparent?.zenith_distance_rad * DEG_PER_RAD;
        Some(to_decimals(90.0 - zenith_deg, HORIZON_DECIMALS))
    }

    fn azimuth_deg(&self) -> Option<f64> {
        let azimuth_deg = self.observed?.azimuth_rad * DEG_PER_RAD;
        Some(turn_deg(azimuth_deg, HORIZON_DECIMALS))
    }
}
