//! Platepar → ([`CameraModel`], [`Pointing`]).

use super::super::error::FormatError;
use super::super::error::TOLERANCE_PX;
use super::super::fit::{LensGuess, LensSample, camera_like, grid};
use super::super::pointing::Pointing;
use super::super::sky::RmsSky;
use super::plate::{DistortionKind, OmittedTerms, Warp};
use crate::CameraModel;
use crate::base::coords::{Camera, Icrs, Rotation, UnitVector};
use crate::base::epoch::ObservationDate;
use crate::base::least_squares::solve_pair;
use crate::base::units::{DEG_PER_RAD, RAD_PER_DEG};
use crate::camera::{Distortion, DistortionModel, Projection};
use crate::ephemeris::observer::Site;
use nalgebra::{Matrix3, Vector3};
use serde_json::Value;

/// The lens and the pointing of an RMS platepar in JSON. Where sky and image are converted by different
/// numbers, those from the sky to the image count.
///
/// The lens is equidistant. `radial3-odd` to `radial7-odd` without asymmetry are taken over exactly,
/// others are fitted. The site has the air of the standard atmosphere, the date whole seconds; the attitude
/// is that at the Julian date of the file.
///
/// # Errors
/// [`FormatError`] if the file is something else, or the fit is off by more than [`TOLERANCE_PX`].
pub fn from_platepar(text: &str) -> Result<(CameraModel, Pointing), FormatError> {
    from_platepar_within(text, TOLERANCE_PX)
}

/// [`from_platepar`], with another limit to the error of a fit.
///
/// # Errors
/// [`FormatError`] if the file is something else, or the fit is off by more.
pub fn from_platepar_within(
    text: &str,
    tolerance_px: f64,
) -> Result<(CameraModel, Pointing), FormatError> {
    let json: Value = serde_json::from_str(text).map_err(|error| FormatError::NotJson {
        found: error.to_string(),
    })?;
    let file = File { json };
    let (kind, left, warp) = file.warp()?;
    let plate = PlateLens {
        size_px: file.size_px()?,
        scale_px_deg: file.within("F_scale", 1e-3, 1e7, "pixels per degree, above 0")?,
        warp,
    };
    let is_exact = match kind {
        DistortionKind::Radial { terms, all_powers } => terms <= 3 && !all_powers && left.asymmetry,
        DistortionKind::Polynomial { .. } => false,
    };
    let exact = plate.exact_camera();
    exact.check_frame()?;
    plate.check_fold()?;
    let (camera, turn) = if is_exact {
        (exact, Matrix3::identity())
    } else {
        plate.fitted_camera(tolerance_px)?
    };
    let pointing = file.pointing(&turn)?;
    Ok((camera, pointing))
}

/// The entries of a platepar.
struct File {
    json: Value,
}

impl File {
    fn number(&self, key: &'static str) -> Result<f64, FormatError> {
        let expected = "a number";
        let value = self.json.get(key).filter(|value| !value.is_null());
        let value = value.ok_or(FormatError::Missing { key, expected })?;
        let number = value.as_f64().filter(|number| number.is_finite());
        number.ok_or_else(|| FormatError::Value {
            key,
            found: value.to_string(),
            expected,
        })
    }

    fn within(
        &self,
        key: &'static str,
        low: f64,
        high: f64,
        expected: &'static str,
    ) -> Result<f64, FormatError> {
        let number = self.number(key)?;
        if (low..=high).contains(&number) {
            return Ok(number);
        }
        let found = number.to_string();
        Err(FormatError::Value {
            key,
            found,
            expected,
        })
    }

    fn size_px(&self) -> Result<[f64; 2], FormatError> {
        let expected = "a size from 1 to 1000000 pixels";
        let size = |key| self.within(key, 1.0, 1e6, expected).map(f64::trunc);
        Ok([size("X_res")?, size("Y_res")?])
    }

    fn flag(&self, key: &str) -> bool {
        self.json.get(key).and_then(Value::as_bool).unwrap_or(false)
    }

    fn list(&self, keys: [&'static str; 2]) -> Result<Vec<f64>, FormatError> {
        let expected = "a list of numbers";
        let key = keys[0];
        let value = keys.iter().find_map(|key| self.json.get(*key));
        let value = value.ok_or(FormatError::Missing { key, expected })?;
        let numbers = value.as_array().and_then(|list| {
            let finite = |value: &Value| value.as_f64().filter(|n| n.is_finite());
            list.iter().map(finite).collect::<Option<Vec<f64>>>()
        });
        numbers.ok_or_else(|| FormatError::Value {
            key,
            found: value.to_string(),
            expected,
        })
    }

    fn warp(&self) -> Result<(DistortionKind, OmittedTerms, Warp), FormatError> {
        let name = self.json.get("distortion_type").and_then(Value::as_str);
        let name = name.unwrap_or("poly3+radial");
        let kind = DistortionKind::named(name).ok_or_else(|| FormatError::Value {
            key: "distortion_type",
            found: format!("'{name}'"),
            expected: "poly3+radial to poly3+radial5, radial3-all to radial5-all or radial3-odd to \
                       radial9-odd",
        })?;
        let left = OmittedTerms {
            axis: self.flag("force_distortion_centre"),
            aspect: self.flag("equal_aspect"),
            asymmetry: !self.flag("asymmetry_corr"),
        };
        let (x, y) = (
            self.list(["x_poly_rev", "x_poly"])?,
            self.list(["y_poly_rev", "y_poly"])?,
        );
        let warp = Warp::from_lists(kind, left, self.size_px()?, [&x, &y]);
        let warp = warp.ok_or_else(|| FormatError::Value {
            key: "x_poly_rev",
            found: format!("{} numbers", x.len().min(y.len())),
            expected: "as many as the distortion type has",
        })?;
        Ok((kind, left, warp))
    }

    /// The attitude of a camera that is turned against the plate's reference.
    fn pointing(&self, turn: &Matrix3<f64>) -> Result<Pointing, FormatError> {
        let (lat_deg, lon_deg) = (self.number("lat")?, self.number("lon")?);
        let height_m = self.number("elev")?;
        let site = Site::new(lat_deg, lon_deg, height_m);
        let site = site.map_err(|error| FormatError::Value {
            key: "lat, lon, elev",
            found: error.to_string(),
            expected: "a site",
        })?;
        let julian_date = self.number("JD")?;
        let date = ObservationDate::from_modified_julian_date(julian_date - 2_400_000.5);
        let date = date.ok_or_else(|| FormatError::Value {
            key: "JD",
            found: julian_date.to_string(),
            expected: "a Julian date of the years 1850 to 2100",
        })?;
        let sky = RmsSky::new(
            julian_date,
            lat_deg,
            site.lon_deg(),
            self.flag("refraction"),
        );
        let [ra_rad, dec_rad, up_pa_rad] = [
            self.number("RA_d")?,
            self.number("dec_d")?,
            self.number("pos_angle_ref")?,
        ]
        .map(|deg| deg * RAD_PER_DEG);
        let reference = UnitVector::<Icrs>::from_ra_dec(ra_rad, dec_rad);
        let axis = sky.apparent(&reference);
        let of_date = Rotation::looking_at(&axis, up_pa_rad);
        let apparent = Rotation::<Icrs, Camera>::from_matrix(turn * of_date.matrix() * sky.to_date);
        let boresight = sky.true_direction(&apparent.boresight());
        Ok(Pointing {
            icrs_to_camera: apparent.turned_to(&boresight),
            site,
            date,
        })
    }
}

/// The lens of a platepar.
struct PlateLens {
    size_px: [f64; 2],
    scale_px_deg: f64,
    warp: Warp,
}

impl PlateLens {
    /// The camera of a radial plate without asymmetry and with odd powers up to the seventh, and that of
    /// the same scale of other plates.
    fn exact_camera(&self) -> CameraModel {
        let [width_px, height_px] = self.size_px;
        let along_x_px = self.scale_px_deg * DEG_PER_RAD;
        let Warp::Radial {
            axis_px,
            aspect,
            radial,
            half_px,
            ..
        } = &self.warp
        else {
            let camera = CameraModel::pinhole(width_px, height_px, along_x_px, false);
            return camera.with_projection(Projection::Equidistant);
        };
        let along_y_px = along_x_px / (1.0 + aspect);
        let focal_px = 0.5 * (along_x_px + along_y_px);
        let camera = CameraModel::pinhole(width_px, height_px, focal_px, false)
            .with_projection(Projection::Equidistant);
        let radius_px = camera.radius_px();
        // The radius that k belongs to, in units of R of the ideal offset.
        let unit = radius_px * along_x_px / (focal_px * half_px);
        let mut terms_px = vec![0.0; DistortionModel::Stretched.terms()];
        let mut power = unit * unit;
        for (term_px, k) in terms_px.iter_mut().zip(radial.iter().take(3)) {
            *term_px = -k * power * radius_px;
            power *= unit * unit;
        }
        // Half the size is half a pixel beyond the centre.
        (terms_px[3], terms_px[4]) = (axis_px[0] + 0.5, axis_px[1] + 0.5);
        terms_px[7] = (along_x_px - along_y_px) / (2.0 * focal_px) * radius_px;
        let distortion = Distortion::new(DistortionModel::Stretched, radius_px, &terms_px);
        camera.with_distortion(Some(distortion))
    }

    /// Refuses a plate whose image folds within the circle that touches the nearest borders: what is farther
    /// out may be dark.
    fn check_fold(&self) -> Result<(), FormatError> {
        const POINTS: usize = 25;
        let [width_px, height_px] = self.size_px;
        let [half_x, half_y] = [0.5 * width_px, 0.5 * height_px];
        let nearest_px = half_x.min(half_y);
        let folded = grid(width_px, height_px, POINTS).find(|[x, y]| {
            let offset = [x - half_x, y - half_y];
            libm::hypot(offset[0], offset[1]) < nearest_px && self.inverted(offset).is_none()
        });
        let Some([x, y]) = folded else {
            return Ok(());
        };
        Err(FormatError::Value {
            key: "x_poly_rev",
            found: format!("a distortion without a solution at ({x:.0}, {y:.0}) px"),
            expected: "a distortion that can be inverted all over the frame",
        })
    }

    /// The camera that is most like the plate, and how it is turned against the plate's reference.
    fn fitted_camera(&self, tolerance_px: f64) -> Result<(CameraModel, Matrix3<f64>), FormatError> {
        use DistortionModel::{Irregular5, Stretched};
        use Projection::{Equidistant, Equisolid, Orthographic, Stereographic};
        let turn = self.turn();
        let [fitted, checked] = [25, 49].map(|count| self.samples(&turn, count));
        let too_far_off = |found_px| FormatError::TooFarOff {
            format: "a lens with radial terms up to the seventh order and monomials up to the fifth",
            found_px,
            expected_px: tolerance_px,
        };
        let most = |angle: f64, sample: &LensSample| {
            let sine = libm::hypot(sample.direction.x, sample.direction.y);
            f64::max(angle, libm::atan2(sine, sample.direction.z))
        };
        // A frame sees a bit more than its samples.
        let farthest_rad = 1.02 * checked.iter().fold(0.0, most);
        let exact = self.exact_camera();
        let guess = LensGuess {
            camera: exact.limited_to(farthest_rad),
            axis_px: exact.distortion().map_or([0.0; 2], |d| d.axis_offset_px()),
            stretch_px: 0.0,
        };
        let kinds = [
            (Equidistant, Stretched),
            (Stereographic, Stretched),
            (Equisolid, Stretched),
            (Orthographic, Stretched),
            (Equidistant, Irregular5),
        ];
        let (camera, error_px) = camera_like(&guess, [&fitted, &checked], &kinds, tolerance_px)
            .ok_or_else(|| too_far_off(f64::INFINITY))?;
        if error_px > tolerance_px {
            return Err(too_far_off(error_px));
        }
        Ok((camera, turn))
    }

    /// From the axes of the plate's reference to those of the camera: the linear terms of polynomials may
    /// turn the image, those of a lens do not.
    fn turn(&self) -> Matrix3<f64> {
        let Warp::Polynomial { along: [x, y] } = &self.warp else {
            return Matrix3::identity();
        };
        let angle_rad = libm::atan2(x[2] - y[1], 2.0 - x[1] - y[2]);
        let (sin, cos) = libm::sincos(angle_rad);
        Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0)
    }

    /// What the frame sees, in the axes of the camera.
    fn samples(&self, turn: &Matrix3<f64>, count: usize) -> Vec<LensSample> {
        let [width_px, height_px] = self.size_px;
        grid(width_px, height_px, count)
            .filter_map(|pixel| {
                let offset = [pixel[0] - 0.5 * width_px, pixel[1] - 0.5 * height_px];
                let sky_px = self.inverted(offset)?;
                let direction = self.direction(sky_px)?;
                Some(LensSample {
                    direction: turn * direction,
                    pixel,
                })
            })
            .collect()
    }

    /// What [`Warp::reverse`] images at an offset, by Newton's method.
    fn inverted(&self, offset: [f64; 2]) -> Option<[f64; 2]> {
        const STEP_PX: f64 = 0.01;
        const CONVERGED_PX: f64 = 1e-9;
        let mut at = offset;
        for _ in 0..50 {
            let [x, y] = self.warp.reverse(at);
            let off = [x - offset[0], y - offset[1]];
            if libm::hypot(off[0], off[1]) < CONVERGED_PX {
                return Some(at);
            }
            let slope = |axis: usize| {
                let mut sides = [at; 2];
                sides[0][axis] -= STEP_PX;
                sides[1][axis] += STEP_PX;
                let [low, high] = sides.map(|side| self.warp.reverse(side));
                [0, 1].map(|i: usize| (high[i] - low[i]) / (2.0 * STEP_PX))
            };
            let ([xx, yx], [xy, yy]) = (slope(0), slope(1));
            let (step, determinant) = solve_pair([[xx, xy], [yx, yy]], off);
            // Beyond a fold nothing is imaged.
            if determinant.is_nan() || determinant <= 0.0 {
                return None;
            }
            at = [at[0] - step[0], at[1] - step[1]];
        }
        None
    }

    /// The direction of an offset of the sky in pixels, in the axes of the plate's reference.
    fn direction(&self, sky_px: [f64; 2]) -> Option<Vector3<f64>> {
        let [x, y] = sky_px.map(|px| px / self.scale_px_deg * RAD_PER_DEG);
        let direction = Projection::Equidistant.direction_at([x, y])?;
        Some(*direction.as_vector())
    }
}
