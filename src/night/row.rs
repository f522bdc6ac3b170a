//! A frame of a night as a row of its series.

use super::almanac::Almanac;
use super::cells::NightCells;
use super::no_sky::NoSky;
use super::start::horizon_attitude;
use crate::base::coords::{Camera, Horizon, Rotation};
use crate::base::epoch::ObservationDate;
use crate::base::format::{finite, to_decimals};
use crate::base::statistics::{Estimate, median_of};
use crate::base::table::table_row;
use crate::base::units::{ARCSEC_PER_RAD, DEG_PER_RAD};
use crate::identify::Identification;
use crate::sky::{Place, SkyCell, SkyMap};
use crate::solve::{Outcome, Solution};
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, TAU};

table_row! {
    /// A frame of a night. A text is empty where there is none.
    #[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
    NightRow in "night" {
        frame: String, "", "meta.id;meta.main", "File of the frame";
        date: String, "", "time.epoch", "Date in UTC";
        mjd: Option<f64>, "d", "time.epoch", "Date in UTC as Modified Julian Date";
        status: String, "", "meta.code.status", "identified, not_identified, unread or passed_over";
        reason_code: String, "", "meta.code.error", "Why its stars are not identified, or the kind of a skipped frame";
        pointing: String, "", "meta.code", "frame: from the stars of the frame; held: from the fixed mount and the date";
        altitude_deg: Option<f64>, "deg", "pos.az.alt", "Apparent altitude of the boresight";
        azimuth_deg: Option<f64>, "deg", "pos.az.azi", "Azimuth of the boresight, from north through east";
        qw: Option<f64>, "", "pos.az", "Quaternion that rotates (east, north, zenith) into camera axes, real part";
        qx: Option<f64>, "", "pos.az", "x component of the quaternion qw, qx, qy, qz";
        qy: Option<f64>, "", "pos.az", "y component of the quaternion qw, qx, qy, qz";
        qz: Option<f64>, "", "pos.az", "z component of the quaternion qw, qx, qy, qz";
        pointing_sigma_arcsec: Option<f64>, "arcsec", "stat.error;pos.az", "Standard error of the pointing, the largest of the three axes";
        shift_arcmin: Option<f64>, "arcmin", "pos.angDistance", "Angle between the measured and the assumed orientation of the camera";
        pixel_scale_arcsec: Option<f64>, "arcsec", "instr.pixel", "Pixel scale on the axis";
        detected: Option<u64>, "", "meta.number", "Detections";
        trails: Option<u64>, "", "meta.number", "Trails of satellites, aircraft and meteors";
        matched: Option<u64>, "", "meta.number", "Identified stars";
        spot_sigma_px: Option<f64>, "pix", "instr.det.psf", "Standard deviation of a star's spot";
        limit_vmag: Option<f64>, "mag", "phot.mag;em.opt.V;stat.max", "V magnitude at which half of the stars are detected";
        limit_sigma_mag: Option<f64>, "mag", "stat.error;phot.mag", "Standard error of limit_vmag";
        expected_limit_vmag: Option<f64>, "mag", "phot.mag;em.opt.V;meta.modelled", "Limiting magnitude predicted from the camera description";
        limit_difference_mag: Option<f64>, "mag", "arith.diff;phot.mag", "Measured minus predicted limiting magnitude";
        clear_limit_vmag: Option<f64>, "mag", "phot.mag;em.opt.V", "Median of the limiting magnitudes in clear cells above 30 degrees altitude";
        clear_limit_difference_mag: Option<f64>, "mag", "arith.diff;phot.mag", "Median of measured minus expected limiting magnitudes in clear cells above 30 degrees altitude";
        zenith_mag_arcsec2: Option<f64>, "mag.arcsec**-2", "phot.mag.sb;em.opt.V", "Brightness of the zenith";
        zenith_sigma_mag: Option<f64>, "mag", "stat.error;phot.mag.sb", "Standard error of zenith_mag_arcsec2";
        naked_eye_limit_vmag: Option<f64>, "mag", "phot.mag;em.opt.V", "Naked-eye limiting magnitude at the zenith";
        extinction_mag_per_airmass: Option<f64>, "mag", "obs.atmos.extinction", "Extinction per airmass";
        extinction_sigma_mag: Option<f64>, "mag", "stat.error;obs.atmos.extinction", "Standard error of the extinction";
        extinction_measured: bool, "", "meta.code", "Whether the extinction is measured with the stars of the frame; otherwise mostly the typical value";
        zero_point_vmag: Option<f64>, "mag", "phot.calib.zeroPoint", "V magnitude of a star outside the atmosphere with a flux of 1 ADU/s";
        zero_point_sigma_mag: Option<f64>, "mag", "stat.error;phot.calib.zeroPoint", "Standard error of the zero point";
        dimming_mag: Option<f64>, "mag", "arith.diff;phot.mag", "Loss of starlight at the zenith since the clearest of the first frames";
        cloud_share: Option<f64>, "", "obs.atmos", "Cloud cover: fraction of the sky in the frame that is behind clouds";
        cloud_share_sigma: Option<f64>, "", "stat.error;obs.atmos", "Standard error of the cloud cover";
        moon_altitude_deg: Option<f64>, "deg", "pos.az.alt", "Altitude of the Moon";
        moon_azimuth_deg: Option<f64>, "deg", "pos.az.azi", "Azimuth of the Moon";
        moon_illuminated: Option<f64>, "", "phys.area;arith.ratio", "Illuminated fraction of the Moon's disk";
        sun_altitude_deg: Option<f64>, "deg", "pos.az.alt", "Altitude of the Sun";
        twilight: String, "", "meta.code", "day, civil, nautical, astronomical or night";
    } and {
        /// What the sky map shows, cell by cell: no column.
        cells: Option<NightCells>,
    }
}

/// Status of a frame whose stars are identified.
const IDENTIFIED: &str = "identified";
/// Status of a frame that shows no sky of the night.
const PASSED_OVER: &str = "passed_over";
/// Decimals of magnitudes, of angles in degrees, and of the elements of a quaternion.
const MAG_DECIMALS: i32 = 3;
const ANGLE_DECIMALS: i32 = 4;
const QUATERNION_DECIMALS: i32 = 9;
/// Decimals of a date: a tenth of a second.
const DAY_DECIMALS: i32 = 6;

impl NightRow {
    /// The row of a frame that was read. `clear_ground_vmag` is the zero point through one airmass of the
    /// clearest frame of the start.
    pub fn from_solution(frame: &str, solution: &Solution, clear_ground_vmag: Option<f64>) -> Self {
        let mut row = Self {
            frame: frame.to_owned(),
            status: IDENTIFIED.to_owned(),
            detected: Some(solution.sources.len() as u64),
            trails: solution.trails.as_ref().map(|trails| trails.len() as u64),
            spot_sigma_px: solution.spot_sigma_px.and_then(|px| finite(px, 4)),
            ..Self::default()
        };
        row.set_date(solution);
        match &solution.outcome {
            Outcome::Identified(found) => row.set_pointing(found),
            Outcome::NotIdentified(reason) => {
                row.status = "not_identified".to_owned();
                row.reason_code = reason.code().to_owned();
                if solution.sky.is_some() {
                    row.pointing = "held".to_owned();
                }
            }
        }
        row.set_limits(solution);
        if let Some(sky) = &solution.sky {
            // Else a longer exposure cannot be told from clearer air.
            let clearest = clear_ground_vmag.filter(|_| solution.exposure_s.is_some());
            row.set_sky(sky, clearest);
        }
        row
    }

    /// The row of a frame that could not be read.
    pub fn unread(frame: &str) -> Self {
        Self {
            frame: frame.to_owned(),
            status: "unread".to_owned(),
            ..Self::default()
        }
    }

    /// The row of a frame that was read, and that shows no sky of the night.
    pub fn passed_over(frame: &str, solution: &Solution, kind: NoSky) -> Self {
        let date = solution.date.map(|known| known.date.to_iso());
        Self {
            frame: frame.to_owned(),
            date: date.unwrap_or_default(),
            status: PASSED_OVER.to_owned(),
            reason_code: kind.code().to_owned(),
            ..Self::default()
        }
    }

    /// What it is, if it was passed over.
    pub fn no_sky(&self) -> Option<NoSky> {
        (self.status == PASSED_OVER).then(|| NoSky::of_code(&self.reason_code))?
    }

    /// Whether its stars are identified.
    pub fn is_identified(&self) -> bool {
        self.status == IDENTIFIED
    }

    /// Whether it could not be read.
    pub fn is_unread(&self) -> bool {
        self.status == "unread"
    }

    /// How the camera stands, by the stars of the frame.
    pub fn horizon_to_camera(&self) -> Option<Rotation<Horizon, Camera>> {
        let quaternion = [self.qw?, self.qx?, self.qy?, self.qz?];
        Some(Rotation::from_quaternion(quaternion))
    }

    /// Sets by how much the camera differs from how it is held.
    pub fn set_shift(&mut self, shift_rad: f64) {
        self.shift_arcmin = finite(shift_rad * ARCSEC_PER_RAD / 60.0, 2);
    }

    /// The same for a table, which has no cells.
    #[must_use]
    pub fn without_cells(&self) -> Self {
        Self {
            cells: None,
            ..self.clone()
        }
    }

    fn set_date(&mut self, solution: &Solution) {
        let Some(date) = solution.date.map(|known| known.date) else {
            return;
        };
        self.date = date.to_iso();
        self.mjd = date
            .modified_julian_date()
            .map(|mjd| to_decimals(mjd, DAY_DECIMALS));
        let almanac = solution.site.and_then(|site| Almanac::at(&date, site));
        if let Some(almanac) = almanac {
            let angle = |deg: f64| Some(to_decimals(deg, ANGLE_DECIMALS));
            self.moon_altitude_deg = angle(almanac.moon_altitude_deg);
            self.moon_azimuth_deg = angle(almanac.moon_azimuth_deg);
            self.moon_illuminated = finite(almanac.moon_illuminated, 3);
            self.sun_altitude_deg = angle(almanac.sun_altitude_deg);
            self.twilight = almanac.twilight().to_owned();
        }
    }

    fn set_pointing(&mut self, found: &Identification) {
        self.pointing = "frame".to_owned();
        self.matched = Some(found.matches.len() as u64);
        self.pixel_scale_arcsec = finite(
            ARCSEC_PER_RAD / found.camera.central_focal_length_px(),
            ANGLE_DECIMALS,
        );
        let largest_rad = found
            .attitude_sigma_rad()
            .into_iter()
            .fold(0.0_f64, f64::max);
        self.pointing_sigma_arcsec = finite(largest_rad * ARCSEC_PER_RAD, 2);
        let Some(attitude) = horizon_attitude(found) else {
            return;
        };
        let quaternion = attitude.to_quaternion();
        let [w, x, y, z] = quaternion.map(|part| Some(to_decimals(part, QUATERNION_DECIMALS)));
        (self.qw, self.qx, self.qy, self.qz) = (w, x, y, z);
        let boresight = attitude.matrix().row(2).transpose();
        let zenith_rad = libm::acos(boresight.z.clamp(-1.0, 1.0));
        let azimuth_rad = libm::atan2(boresight.x, boresight.y).rem_euclid(TAU);
        self.altitude_deg = finite((FRAC_PI_2 - zenith_rad) * DEG_PER_RAD, ANGLE_DECIMALS);
        self.azimuth_deg = finite(azimuth_rad * DEG_PER_RAD, ANGLE_DECIMALS);
    }

    fn set_limits(&mut self, solution: &Solution) {
        let photometry = solution.photometry.as_ref();
        let limit = photometry.and_then(|measured| measured.completeness.limit.as_ref().ok());
        self.limit_vmag = limit.and_then(|limit| mag(limit.v_mag));
        self.limit_sigma_mag = limit.and_then(|limit| mag(limit.sigma_mag));
        let comparison = solution.comparison.as_ref();
        self.expected_limit_vmag = comparison.and_then(|expected| mag(expected.limit_vmag));
        let difference = limit
            .zip(comparison)
            .map(|(limit, expected)| limit.v_mag - expected.limit_vmag);
        self.limit_difference_mag = difference.and_then(mag);
    }

    fn set_sky(&mut self, sky: &SkyMap, clear_ground_vmag: Option<f64>) {
        let clear = &sky.clear_sky;
        if let Some(zenith) = &sky.zenith {
            self.zenith_mag_arcsec2 = mag(zenith.light.mag_arcsec2.value);
            self.zenith_sigma_mag = mag(zenith.light.mag_arcsec2.sigma);
            self.naked_eye_limit_vmag = finite(zenith.naked_eye_limit_vmag, 2);
        }
        self.cells = NightCells::from_sky(sky);
        let share = sky.cloud_share.as_ref();
        let of_share =
            |value: fn(&Estimate) -> f64| share.and_then(|share| finite(value(share), 4));
        self.cloud_share = of_share(|share| share.value);
        self.cloud_share_sigma = of_share(|share| share.sigma);
        // Else the clear sky may be that of another frame.
        if !self.is_identified() {
            return;
        }
        self.zero_point_vmag = mag(clear.zero_point_vmag.value);
        self.zero_point_sigma_mag = mag(clear.zero_point_vmag.sigma);
        if clear.has_horizon {
            self.extinction_mag_per_airmass = mag(clear.extinction_mag.value);
            self.extinction_sigma_mag = mag(clear.extinction_mag.sigma);
            self.extinction_measured = clear.is_extinction_measured;
        }
        self.dimming_mag =
            clear_ground_vmag.and_then(|clearest| mag(clearest - clear.ground_vmag()));
        let limits: Vec<[f64; 2]> = sky.cells.iter().filter_map(clear_limit).collect();
        let middle = |part: usize| mag(median_of(limits.iter().map(|limit| limit[part]))?);
        self.clear_limit_vmag = middle(0);
        self.clear_limit_difference_mag = middle(1);
    }

    /// Its date, where it has one.
    pub(super) fn observed(&self) -> Option<ObservationDate> {
        self.date.parse().ok()
    }
}

fn mag(value: f64) -> Option<f64> {
    finite(value, MAG_DECIMALS)
}

/// The limit of a clear cell that is not low, and its difference from the expected one.
fn clear_limit(cell: &SkyCell) -> Option<[f64; 2]> {
    const CLEAR: f64 = 0.9;
    const LOW_DEG: f64 = 30.0;
    let is_low =
        matches!(cell.place, Place::Horizon { altitude_deg, .. } if altitude_deg[0] < LOW_DEG);
    if is_low || cell.clear? < CLEAR {
        return None;
    }
    let limit_vmag = cell.limit_vmag?.value;
    Some([limit_vmag, limit_vmag - cell.expected_limit_vmag?])
}
