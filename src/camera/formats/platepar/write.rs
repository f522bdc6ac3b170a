//! [`CameraModel`] → platepar.

use super::super::error::FormatError;
use super::super::error::TOLERANCE_PX;
use super::super::fit::{CHECK_POINTS, FIT_POINTS, LensSample, samples};
use super::super::pointing::Pointing;
use super::super::sky::{RmsSky, sidereal_time_deg};
use super::plate::{DEGREES, DistortionKind, Warp};
use crate::CameraModel;
use crate::base::coords::{Camera, Icrs, PixelPoint, Rotation, UnitVector};
use crate::base::least_squares::levenberg_marquardt;
use crate::base::units::{DEG_PER_RAD, RAD_PER_DEG};
use nalgebra::Vector3;
use serde_json::{Map, Value, json};

/// A platepar may be off by as much, in pixels.
const LARGEST_PX: f64 = 1.0;

/// The lens and the pointing as an RMS platepar (JSON, version 2), with RMS's refraction.
///
/// The plate is the simplest of `radial5-odd`, `radial7-odd`, `radial9-odd`, `poly3+radial`,
/// `poly3+radial3` and `poly3+radial5` that is everywhere right to [`TOLERANCE_PX`], or else the best of
/// them; both directions, sky to image and image to sky, are fitted. From sky to image an equidistant lens
/// without skew, decentring and monomials is exact in the first or the second. `largest_error_px` tells the
/// error in both; RMS ignores it. The photometry is RMS's default, the station has no name.
///
/// # Errors
/// [`FormatError::Unsuitable`] for mirrored images and dates without a time, [`FormatError::TooFarOff`] if
/// the best plate is off by more than 1 pixel.
pub fn platepar(camera: &CameraModel, pointing: &Pointing) -> Result<String, FormatError> {
    let unsuitable = |found, expected| FormatError::Unsuitable {
        format: "a platepar",
        found,
        expected,
    };
    if camera.mirrored {
        return Err(unsuitable(
            "one is mirrored",
            "images that are not mirrored",
        ));
    }
    let modified_julian_date = pointing.date.modified_julian_date();
    let modified_julian_date =
        modified_julian_date.ok_or_else(|| unsuitable("date has no time", "dates with a time"))?;
    let julian_date = modified_julian_date + 2_400_000.5;
    let plate = best_plate(camera).ok_or(FormatError::TooFarOff {
        format: "a platepar",
        found_px: f64::INFINITY,
        expected_px: LARGEST_PX,
    })?;
    if plate.largest_px > LARGEST_PX {
        return Err(FormatError::TooFarOff {
            format: "a platepar",
            found_px: plate.largest_px,
            expected_px: LARGEST_PX,
        });
    }
    Ok(json_of(camera, pointing, julian_date, &plate))
}

/// A plate without its pointing.
struct PlateModel {
    kind: DistortionKind,
    scale_px_deg: f64,
    equal_aspect: bool,
    reverse: Warp,
    forward: Warp,
    largest_px: f64,
}

type Entries = Vec<(&'static str, Value)>;

fn json_of(
    camera: &CameraModel,
    pointing: &Pointing,
    julian_date: f64,
    plate: &PlateModel,
) -> String {
    let mut entries = pointing_entries(camera, pointing, julian_date);
    entries.extend(plate_entries(camera, plate));
    entries.extend(other_entries());
    let named = entries
        .into_iter()
        .map(|(name, value)| (name.to_owned(), value));
    let json = Value::from(Map::from_iter(named));
    format!("{json:#}\n")
}

fn pointing_entries(camera: &CameraModel, pointing: &Pointing, julian_date: f64) -> Entries {
    let site = &pointing.site;
    let sky = RmsSky::new(julian_date, site.lat_deg(), site.lon_deg(), true);
    let attitude = pointing.icrs_to_camera;
    let attitude = attitude.turned_to(&sky.apparent(&attitude.boresight()));
    // In the axes of the date, and of the lens.
    let of_date = camera.lens_axes() * attitude.matrix() * sky.to_date.transpose();
    let of_date = Rotation::<Icrs, Camera>::from_matrix(of_date);
    let (axis, up_pa_rad) = of_date.boresight_and_up();
    let twice_precessed = sky.to_date * axis.as_vector();
    let reference = sky.to_date.tr_mul(&sky.unrefracted(&twice_precessed));
    let (ra_rad, dec_rad) = UnitVector::<Icrs>::from_vector(reference).to_ra_dec();
    let [altitude_rad, azimuth_rad] = sky.altitude_azimuth_rad(&twice_precessed);
    let rotation_deg = rotation_from_horizon_deg(camera, &attitude, &sky);
    vec![
        ("Ho", json!(sidereal_time_deg(julian_date))),
        ("JD", json!(julian_date)),
        ("RA_d", json!(ra_rad * DEG_PER_RAD)),
        ("UT_corr", json!(0)),
        ("alt_centre", json!(altitude_rad * DEG_PER_RAD)),
        ("az_centre", json!(azimuth_rad * DEG_PER_RAD)),
        ("dec_d", json!(dec_rad * DEG_PER_RAD)),
        ("elev", json!(site.height_m())),
        ("lat", json!(site.lat_deg())),
        ("lon", json!(site.lon_deg())),
        ("measurement_apparent_to_true_refraction", json!(false)),
        (
            "pos_angle_ref",
            json!((up_pa_rad * DEG_PER_RAD).rem_euclid(360.0)),
        ),
        ("refraction", json!(true)),
        ("rotation_from_horiz", json!(rotation_deg)),
    ]
}

fn plate_entries(camera: &CameraModel, plate: &PlateModel) -> Entries {
    let size_px = [camera.width_px, camera.height_px];
    let [x_fwd, y_fwd] = plate.forward.to_lists(plate.equal_aspect, size_px);
    let [x_rev, y_rev] = plate.reverse.to_lists(plate.equal_aspect, size_px);
    let [fov_h_deg, fov_v_deg] = fields_deg(camera);
    vec![
        ("F_scale", json!(plate.scale_px_deg)),
        ("X_res", json!(size_px[0] as u64)),
        ("Y_res", json!(size_px[1] as u64)),
        ("asymmetry_corr", json!(false)),
        ("distortion_type", json!(plate.kind.name())),
        ("equal_aspect", json!(plate.equal_aspect)),
        ("force_distortion_centre", json!(false)),
        ("fov_h", json!(fov_h_deg)),
        ("fov_v", json!(fov_v_deg)),
        ("largest_error_px", json!(plate.largest_px)),
        ("x_poly", json!(x_fwd)),
        ("x_poly_fwd", json!(x_fwd)),
        ("x_poly_rev", json!(x_rev)),
        ("y_poly", json!(y_fwd)),
        ("y_poly_fwd", json!(y_fwd)),
        ("y_poly_rev", json!(y_rev)),
    ]
}

/// What is not known here, as RMS has it before a fit.
fn other_entries() -> Entries {
    vec![
        ("auto_check_fit_refined", json!(false)),
        ("auto_recalibrated", json!(false)),
        ("extinction_scale", json!(0.6)),
        ("gamma", json!(1.0)),
        ("mag_0", json!(-2.5)),
        ("mag_lev", json!(1.0)),
        ("mag_lev_stddev", json!(0.0)),
        ("star_list", json!([])),
        ("station_code", json!("None")),
        ("version", json!(2)),
        ("vignetting_coeff", json!(0.0)),
        ("vignetting_fixed", json!(true)),
    ]
}

/// Angle by which a row of pixels rises, as RMS has it: by differences of altitude and azimuth. 0 where
/// the image shows nothing at its centre.
fn rotation_from_horizon_deg(
    camera: &CameraModel,
    attitude: &Rotation<Icrs, Camera>,
    sky: &RmsSky,
) -> f64 {
    let at = |x: f64| {
        let pixel = PixelPoint::new(x, camera.height_px / 2.0);
        let direction = attitude.inverse().apply(&camera.direction_of(&pixel)?);
        Some(sky.altitude_azimuth_rad(&(sky.to_date * direction.as_vector())))
    };
    let middle_px = camera.width_px / 2.0;
    let (Some([low, from]), Some([high, to])) = (at(middle_px), at(middle_px + 10.0)) else {
        return 0.0;
    };
    libm::atan2(high - low, to - from) * DEG_PER_RAD
}

/// The fields across and down: the sums of the angles from the middle to two sides.
fn fields_deg(camera: &CameraModel) -> [f64; 2] {
    let (width_px, height_px) = (camera.width_px, camera.height_px);
    let (x, y) = (width_px / 2.0, height_px / 2.0);
    let at = |x: f64, y: f64| camera.direction_of(&PixelPoint::new(x, y));
    let middle = at(x, y);
    let angle_rad = |side: Option<UnitVector<Camera>>| {
        let both = side.as_ref().zip(middle.as_ref());
        both.map_or(camera.max_angle_rad(), |(side, middle)| {
            side.angle_to(middle)
        })
    };
    [
        [at(0.0, y), at(width_px, y)],
        [at(x, 0.0), at(x, height_px)],
    ]
    .map(|[a, b]| (angle_rad(a) + angle_rad(b)) * DEG_PER_RAD)
}

/// A direction of the sky as an angle from the axis in degrees, along x and y, and its pixel as an offset
/// from half the size.
struct PlatePoint {
    sky_deg: [f64; 2],
    pixel: [f64; 2],
}

fn points(camera: &CameraModel, count: usize) -> Vec<PlatePoint> {
    let half_px = [camera.width_px / 2.0, camera.height_px / 2.0];
    let point = |sample: LensSample| PlatePoint {
        sky_deg: from_axis_deg(&sample.direction),
        pixel: [0, 1].map(|axis: usize| sample.pixel[axis] - half_px[axis]),
    };
    samples(camera, count).into_iter().map(point).collect()
}

/// The angle from the axis of a direction in the axes of the lens, along x and y, in degrees.
fn from_axis_deg(direction: &Vector3<f64>) -> [f64; 2] {
    let sine = libm::hypot(direction.x, direction.y);
    if sine == 0.0 {
        return [0.0; 2];
    }
    let per_sine = libm::atan2(sine, direction.z) * DEG_PER_RAD / sine;
    [direction.x * per_sine, direction.y * per_sine]
}

/// The plate to write.
fn best_plate(camera: &CameraModel) -> Option<PlateModel> {
    let (fitted, checked) = (points(camera, FIT_POINTS), points(camera, CHECK_POINTS));
    let names = [
        "radial5-odd",
        "radial7-odd",
        "radial9-odd",
        "poly3+radial",
        "poly3+radial3",
        "poly3+radial5",
    ];
    let mut best: Option<PlateModel> = None;
    for kind in names.into_iter().filter_map(DistortionKind::named) {
        let Some(plate) = fit_plate(camera, kind, [&fitted, &checked]) else {
            continue;
        };
        let largest_px = plate.largest_px;
        if best
            .as_ref()
            .is_none_or(|best| largest_px < best.largest_px)
        {
            best = Some(plate);
        }
        if largest_px < TOLERANCE_PX {
            break;
        }
    }
    best
}

fn fit_plate(
    camera: &CameraModel,
    kind: DistortionKind,
    [fitted, checked]: [&[PlatePoint]; 2],
) -> Option<PlateModel> {
    let terms = camera.distortion().map_or(&[][..], |d| d.coefficients_px());
    let stretch_px = terms.get(7).copied().unwrap_or(0.0);
    let is_polynomial = matches!(kind, DistortionKind::Polynomial { .. });
    let equal_aspect = is_polynomial || stretch_px == 0.0;
    let scale_px_deg = camera.focal_length_px() * RAD_PER_DEG;
    let free = Free {
        kind,
        equal_aspect,
        half_px: camera.width_px / 2.0,
    };
    let axis = camera.axis();
    let axis_px = [
        axis.x - camera.width_px / 2.0,
        axis.y - camera.height_px / 2.0,
    ];
    let scaled = |point: &PlatePoint, scale: f64| point.sky_deg.map(|along| along * scale);
    // The scale of a radial plate is found with the reverse distortion; that of a polynomial is in its
    // terms.
    let start = free.start([-axis_px[0], -axis_px[1]], axis_px);
    let of_scale = usize::from(is_polynomial);
    let first: Vec<f64> = [1.0].into_iter().chain(start).collect();
    let steps = vec![1e-5; first.len() - of_scale];
    let complete = |p: &[f64]| {
        first[..of_scale]
            .iter()
            .chain(p)
            .copied()
            .collect::<Vec<f64>>()
    };
    let found = levenberg_marquardt(&first[of_scale..], &steps, |parameters, residuals| {
        let parameters = complete(parameters);
        let (warp, scale) = (free.warp(&parameters[1..]), scale_px_deg * parameters[0]);
        for point in fitted {
            let [x, y] = warp.reverse(scaled(point, scale));
            residuals.extend([x - point.pixel[0], y - point.pixel[1]]);
        }
        true
    })?;
    let found = complete(&found);
    let scale_px_deg = scale_px_deg * found[0];
    let reverse = free.warp(&found[1..]);
    let start = free.start(axis_px.map(|px| -px), axis_px);
    let steps = vec![1e-5; start.len()];
    let found = levenberg_marquardt(&start, &steps, |parameters, residuals| {
        let warp = free.warp(parameters);
        for point in fitted {
            let ([x, y], [to_x, to_y]) = (warp.forward(point.pixel), scaled(point, scale_px_deg));
            residuals.extend([x - to_x, y - to_y]);
        }
        true
    })?;
    let forward = free.warp(&found);
    let error_px = |point: &PlatePoint| {
        let sky = scaled(point, scale_px_deg);
        let ([x, y], [u, v]) = (reverse.reverse(sky), forward.forward(point.pixel));
        let reverse_px = libm::hypot(x - point.pixel[0], y - point.pixel[1]);
        reverse_px.max(libm::hypot(u - sky[0], v - sky[1]))
    };
    let largest_px = checked.iter().map(error_px).fold(0.0, f64::max);
    Some(PlateModel {
        kind,
        scale_px_deg,
        equal_aspect,
        reverse,
        forward,
        largest_px,
    })
}

/// The distortion of a kind by parameters of the order of 1.
struct Free {
    kind: DistortionKind,
    equal_aspect: bool,
    half_px: f64,
}

impl Free {
    /// The parameters of a plate without distortion. `shift_px` is x₀ and y₀ of polynomials.
    fn start(&self, shift_px: [f64; 2], axis_px: [f64; 2]) -> Vec<f64> {
        match self.kind {
            DistortionKind::Polynomial { terms } => {
                let along = shift_px.map(|px| {
                    let mut along = vec![0.0; terms];
                    along[0] = px / self.half_px;
                    along
                });
                along.concat()
            }
            DistortionKind::Radial { terms, .. } => {
                let mut all = axis_px.map(|px| px / self.half_px).to_vec();
                all.resize(2 + usize::from(!self.equal_aspect) + terms, 0.0);
                all
            }
        }
    }

    fn warp(&self, parameters: &[f64]) -> Warp {
        match self.kind {
            DistortionKind::Polynomial { terms } => {
                let along = [&parameters[..terms], &parameters[terms..]].map(|along| {
                    let with_degree = along.iter().zip(DEGREES);
                    let coefficient = |(p, degree): (&f64, i32)| {
                        p * libm::pow(self.half_px, f64::from(1 - degree))
                    };
                    with_degree.map(coefficient).collect()
                });
                Warp::Polynomial { along }
            }
            DistortionKind::Radial { all_powers, .. } => {
                let aspect = (!self.equal_aspect).then(|| parameters[2]);
                Warp::Radial {
                    axis_px: [parameters[0] * self.half_px, parameters[1] * self.half_px],
                    aspect: aspect.unwrap_or(0.0),
                    asymmetry: [0.0; 2],
                    radial: parameters[2 + usize::from(aspect.is_some())..].to_vec(),
                    all_powers,
                    half_px: self.half_px,
                }
            }
        }
    }
}
