//! indi-allsky: the lens and its pointing, as the overlay of stars (`VIRTUALSKY`) has them.
//!
//! With θ the angle from the axis of the lens and D the diameter of the image circle, a star is at the
//! distance r = D/2 · √2 sin(θ/2) · (2 − r₀²)^−k from the axis, r₀ = √2 sin(θ/2): k is −½ for
//! orthographic, 0 for equisolid and ½ for stereographic lenses. The axis is at half the size of the image,
//! plus `OFFSET_X` to the right and `OFFSET_Y` upwards. Stars are precessed to the date, but not refracted.
//!
//! # Reference
//! indi-allsky, `indi_allsky/lens_solver/projection.py`.

use super::error::FormatError;
use super::fit::grid;
use super::pointing::Pointing;
use super::sky::RmsSky;
use crate::CameraModel;
use crate::base::coords::{PixelPoint, Rotation};
use crate::base::least_squares::levenberg_marquardt;
use crate::base::units::DEG_PER_RAD;
use crate::camera::Projection;
use crate::ephemeris::places::StarPlaces;
use nalgebra::{Matrix3, Vector3};
use serde_json::json;
use std::f64::consts::{FRAC_PI_2, SQRT_2};

/// Points along each side of the frame at which the lens is fitted.
const POINTS: usize = 31;
/// The settings may be off by as much, in pixels.
const LARGEST_PX: f64 = 10.0;

/// The settings of indi-allsky that describe a lens and where it points.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct IndiAllskyLens {
    /// `LENS_AZIMUTH`: by how much the image is turned, in degrees.
    pub azimuth_deg: f64,
    /// `LENS_ALTITUDE`: altitude of the axis in degrees.
    pub altitude_deg: f64,
    /// `POINTING_AZIMUTH`: azimuth of the axis in degrees, from north through east.
    pub pointing_azimuth_deg: f64,
    /// `IMAGE_CIRCLE_DIAMETER`: the horizon's, of a lens that looks to the zenith; whole pixels.
    pub diameter_px: f64,
    /// `OFFSET_X` of the axis from half the width, to the right; whole pixels.
    pub offset_x_px: f64,
    /// `OFFSET_Y` of the axis from half the height, upwards; whole pixels.
    pub offset_y_px: f64,
    /// `RADIAL_DISTORTION`: k.
    pub radial_distortion: f64,
    /// Largest error in pixels, above the horizon.
    pub largest_error_px: f64,
}

/// A direction in horizontal axes (east, north, up), unrefracted, and its pixel.
struct HorizontalPoint {
    direction: Vector3<f64>,
    pixel: [f64; 2],
}

/// The settings of indi-allsky that come nearest to a lens and its pointing, above the horizon. Distortion
/// and refraction are fitted by what there is; offsets and diameter are whole pixels there.
///
/// # Errors
/// [`FormatError::Unsuitable`] for mirrored images, dates without a time, and axes below the horizon,
/// [`FormatError::TooFarOff`] if the fit is off by more than 10 pixels.
pub fn indi_allsky(
    camera: &CameraModel,
    pointing: &Pointing,
) -> Result<IndiAllskyLens, FormatError> {
    let unsuitable = |found, expected| FormatError::Unsuitable {
        format: "indi-allsky",
        found,
        expected,
    };
    let too_far_off = |found_px| FormatError::TooFarOff {
        format: "indi-allsky's lens",
        found_px,
        expected_px: LARGEST_PX,
    };
    if camera.mirrored {
        return Err(unsuitable(
            "one is mirrored",
            "images that are not mirrored",
        ));
    }
    let date = pointing.date.modified_julian_date();
    let date = date.ok_or_else(|| unsuitable("date has no time", "dates with a time"))?;
    let (points, to_lens) = points(camera, pointing, date + 2_400_000.5);
    if to_lens[(2, 2)] < 0.0 {
        return Err(unsuitable("one looks down", "lenses that look up"));
    }
    let start = start(camera);
    let solved = fit(&points, &to_lens, &start, 0).ok_or_else(|| too_far_off(f64::INFINITY))?;
    // The diameter and the offsets are whole numbers; the rest makes up for that.
    let mut whole = solved.clone();
    let shift_px = [camera.width_px / 2.0, camera.height_px / 2.0];
    whole[0] = solved[0].round();
    whole[1] = (solved[1] - shift_px[0]).round() + shift_px[0];
    whole[2] = (solved[2] - shift_px[1]).round() + shift_px[1];
    let solved = fit(&points, &to_lens, &whole, 3).ok_or_else(|| too_far_off(f64::INFINITY))?;
    let lens = lens_of(
        &solved,
        &to_lens,
        shift_px,
        largest_px(&points, &to_lens, &solved),
    );
    if lens.largest_error_px <= LARGEST_PX {
        Ok(lens)
    } else {
        Err(too_far_off(lens.largest_error_px))
    }
}

/// [`indi_allsky`] as the part of indi-allsky's configuration that it belongs to.
///
/// # Errors
/// As [`indi_allsky`].
pub fn indi_allsky_json(camera: &CameraModel, pointing: &Pointing) -> Result<String, FormatError> {
    let lens = indi_allsky(camera, pointing)?;
    let json = json!({
        "LENS_ALTITUDE": lens.altitude_deg,
        "LENS_AZIMUTH": lens.azimuth_deg,
        "VIRTUALSKY": {
            "IMAGE_CIRCLE_DIAMETER": lens.diameter_px as i64,
            "LATITUDE_OFFSET": 0.0,
            "LONGITUDE_OFFSET": 0.0,
            "OFFSET_X": lens.offset_x_px as i64,
            "OFFSET_Y": lens.offset_y_px as i64,
            "POINTING_AZIMUTH": lens.pointing_azimuth_deg,
            "PRECESSION": true,
            "RADIAL_DISTORTION": lens.radial_distortion,
        },
    });
    Ok(format!("{json:#}\n"))
}

/// What the frame sees above the horizon, and the matrix from horizontal axes to those of the lens.
fn points(
    camera: &CameraModel,
    pointing: &Pointing,
    julian_date: f64,
) -> (Vec<HorizontalPoint>, Matrix3<f64>) {
    let site = &pointing.site;
    let sky = RmsSky::new(julian_date, site.lat_deg(), site.lon_deg(), false);
    let places = StarPlaces::at(&pointing.date, Some(*site), None);
    let apparent = places.apparent_attitude(&pointing.icrs_to_camera);
    let to_horizon = sky.to_horizon();
    let direction = |pixel: &PixelPoint| {
        let seen = apparent.inverse().apply(&camera.direction_of(pixel)?);
        let above = !places.is_below_horizon(&seen);
        above.then(|| to_horizon * places.astrometric(&seen).as_vector())
    };
    let points = grid(camera.width_px, camera.height_px, POINTS)
        .filter_map(|pixel| {
            let direction = direction(&PixelPoint::new(pixel[0], pixel[1]))?;
            Some(HorizontalPoint { direction, pixel })
        })
        .collect();
    let to_lens = camera.lens_axes() * pointing.icrs_to_camera.matrix() * to_horizon.transpose();
    (points, to_lens)
}

/// The first guess: diameter, axis, k and no turn.
fn start(camera: &CameraModel) -> Vec<f64> {
    let projection = camera.projection();
    let k = match projection {
        Projection::Orthographic => -0.5,
        Projection::Stereographic | Projection::Pinhole => 0.5,
        Projection::Equidistant => 0.15,
        Projection::Equisolid => 0.0,
    };
    let radius = match projection {
        Projection::Pinhole => 2.0,
        _ => projection.radius(FRAC_PI_2 - 1e-9),
    };
    let (axis, focal_px) = (camera.axis(), camera.focal_length_px());
    vec![2.0 * focal_px * radius, axis.x, axis.y, k, 0.0, 0.0, 0.0]
}

/// The pixel of a direction in the axes of the lens.
fn image(parameters: &[f64], direction: &Vector3<f64>) -> Option<[f64; 2]> {
    let [diameter_px, x, y, k] = *parameters.first_chunk::<4>()?;
    let sine = libm::hypot(direction.x, direction.y);
    if sine == 0.0 {
        return Some([x, y]);
    }
    let r = SQRT_2 * libm::sin(0.5 * libm::atan2(sine, direction.z));
    let bend = libm::pow((2.0 - r * r).max(1e-12), -k);
    let per_sine = 0.5 * diameter_px * r * bend / sine;
    Some([x + direction.x * per_sine, y + direction.y * per_sine])
}

/// From horizontal axes to those of the turned lens.
fn turned(parameters: &[f64], to_lens: &Matrix3<f64>) -> Matrix3<f64> {
    let quaternion = [1.0, parameters[4], parameters[5], parameters[6]];
    Rotation::<(), ()>::from_quaternion(quaternion).matrix() * to_lens
}

/// The best parameters, but for the first ones, which are `fixed`.
fn fit(
    points: &[HorizontalPoint],
    to_lens: &Matrix3<f64>,
    start: &[f64],
    fixed: usize,
) -> Option<Vec<f64>> {
    let all = |free: &[f64]| {
        start[..fixed]
            .iter()
            .chain(free)
            .copied()
            .collect::<Vec<f64>>()
    };
    let steps = [1e-2, 1e-2, 1e-2, 1e-5, 1e-6, 1e-6, 1e-6];
    let found = levenberg_marquardt(&start[fixed..], &steps[fixed..], |free, residuals| {
        let parameters = all(free);
        let to_lens = turned(&parameters, to_lens);
        points.iter().all(|point| {
            image(&parameters, &(to_lens * point.direction)).is_some_and(|[x, y]| {
                residuals.extend([x - point.pixel[0], y - point.pixel[1]]);
                true
            })
        })
    })?;
    Some(all(&found))
}

fn largest_px(points: &[HorizontalPoint], to_lens: &Matrix3<f64>, parameters: &[f64]) -> f64 {
    let to_lens = turned(parameters, to_lens);
    let error = |point: &HorizontalPoint| {
        image(parameters, &(to_lens * point.direction)).map_or(f64::INFINITY, |[x, y]| {
            libm::hypot(x - point.pixel[0], y - point.pixel[1])
        })
    };
    points.iter().map(error).fold(0.0, f64::max)
}

/// The settings of fitted parameters.
fn lens_of(
    parameters: &[f64],
    to_lens: &Matrix3<f64>,
    shift_px: [f64; 2],
    largest_error_px: f64,
) -> IndiAllskyLens {
    let to_lens = turned(parameters, to_lens);
    let axis = to_lens.row(2);
    let altitude_rad = libm::atan2(axis[2], libm::hypot(axis[0], axis[1]));
    let heading_rad = libm::atan2(axis[0], axis[1]);
    // What is level, 90° to the right of the heading, is imaged at an angle that depends on the turn alone.
    let (sin, cos) = libm::sincos(heading_rad);
    let across = to_lens * Vector3::new(cos, -sin, 0.0);
    let turn_rad = heading_rad - libm::atan2(across.y, -across.x);
    let turn = |rad: f64| (rad * DEG_PER_RAD).rem_euclid(360.0);
    IndiAllskyLens {
        azimuth_deg: turn(turn_rad),
        altitude_deg: altitude_rad * DEG_PER_RAD,
        pointing_azimuth_deg: turn(heading_rad),
        diameter_px: parameters[0],
        offset_x_px: parameters[1] - shift_px[0],
        offset_y_px: shift_px[1] - parameters[2],
        radial_distortion: parameters[3],
        largest_error_px,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::coords::{Icrs, UnitVector};
    use crate::ephemeris::observer::{Air, Site};
    use std::f64::consts::PI;

    /// indi-allsky's pixel of an altitude and an azimuth, written from its description.
    fn pixel(lens: &IndiAllskyLens, size_px: [f64; 2], altitude: f64, azimuth: f64) -> [f64; 2] {
        let tilt = (90.0 - lens.altitude_deg).to_radians();
        let heading = lens.pointing_azimuth_deg.to_radians();
        let across = altitude.cos() * (azimuth - heading).sin();
        let along = altitude.cos() * (azimuth - heading).cos();
        let up = altitude.sin();
        let forward = tilt.cos() * along - tilt.sin() * up;
        let axis = tilt.sin() * along + tilt.cos() * up;
        let from_axis = across.hypot(forward).atan2(axis);
        let psi = heading + across.atan2(forward) - lens.azimuth_deg.to_radians();
        let half_px = lens.diameter_px / 2.0;
        let mut r = half_px * (from_axis / 2.0).sin() / (PI / 4.0).sin();
        r *= (2.0 - (r / half_px).powi(2)).powf(-lens.radial_distortion);
        [
            size_px[0] / 2.0 + lens.offset_x_px - r * psi.sin(),
            size_px[1] / 2.0 - lens.offset_y_px - r * psi.cos(),
        ]
    }

    fn pointing(zenith_distance_rad: f64) -> Pointing {
        let site = Site::new(48.2, 16.4, 200.0).unwrap();
        // Hardly any air: what is tested is the geometry.
        let site = site.with_air(Air::new(1e-6, 10.0));
        let date = "2024-03-01T22:00:00Z".parse().unwrap();
        let places = StarPlaces::at(&date, Some(site), None);
        let zenith = *places.zenith().unwrap();
        let (ra_rad, dec_rad) = zenith.to_ra_dec();
        let boresight = UnitVector::from_ra_dec(ra_rad + 0.1, dec_rad - zenith_distance_rad);
        Pointing {
            icrs_to_camera: Rotation::looking_at(&boresight, 0.7),
            site,
            date,
        }
    }

    #[test]
    fn the_settings_image_the_sky_as_the_lens_does() {
        for (projection, focal_px, tilt_rad, tolerance_px) in [
            (Projection::Equisolid, 420.0, 0.02, 1.5),
            (Projection::Stereographic, 330.0, 0.3, 1.5),
            (Projection::Equidistant, 400.0, 0.02, 4.0),
        ] {
            let camera = CameraModel::pinhole(1280.0, 1100.0, focal_px, false);
            let camera = camera.with_projection(projection).limited_to(1.5);
            let pointing = pointing(tilt_rad);
            let lens = indi_allsky(&camera, &pointing).unwrap();
            assert!(lens.largest_error_px < tolerance_px, "{lens:?}");
            let julian_date = pointing.date.modified_julian_date().unwrap() + 2_400_000.5;
            let sky = RmsSky::new(julian_date, 48.2, 16.4, false);
            let mut seen = 0;
            for star in 0..200 {
                let star = f64::from(star);
                let star = UnitVector::<Icrs>::from_ra_dec(star * 0.7, (star * 0.37).sin() * 1.5);
                let direction = sky.to_horizon() * star.as_vector();
                let altitude_rad = direction.z.asin();
                let azimuth_rad = direction.x.atan2(direction.y);
                let camera_sees = camera.pixel_of(&pointing.icrs_to_camera.apply(&star));
                let Some(expected) =
                    camera_sees.filter(|p| altitude_rad > 0.1 && camera.contains(p))
                else {
                    continue;
                };
                let size_px = [camera.width_px, camera.height_px];
                let [x, y] = pixel(&lens, size_px, altitude_rad, azimuth_rad);
                let off_px = expected.distance_to(&PixelPoint::new(x, y));
                assert!(off_px < tolerance_px, "{lens:?} {expected:?} {x} {y}");
                seen += 1;
            }
            assert!(seen > 30, "{seen}");
            let json = indi_allsky_json(&camera, &pointing).unwrap();
            assert!(json.contains("\"IMAGE_CIRCLE_DIAMETER\": "), "{json}");
        }
    }
}
