//! The planes that pixels are mapped to: gnomonic, or the polynomial of the angle.

use crate::base::coords::{Camera, UnitVector};
use crate::camera::{CameraModel, Distortion, Projection};
use crate::frame::FitsHeader;
use nalgebra::{DMatrix, DVector, Vector3};

/// Number of odd powers of the angle: 1 to 19.
const POWERS: usize = 10;
/// Angles at which the polynomial is fitted.
const FIT_ANGLES: usize = 200;

/// A plane.
pub(super) enum Plane {
    /// `TAN`, for pinholes.
    Gnomonic,
    /// `ZPN`, for other lenses: with the angle ζ from the axis in radians, the distance in focal
    /// lengths is the sum of these times ζ, ζ³, ζ⁵ and so on.
    Zenithal([f64; POWERS]),
}

impl Plane {
    /// The plane of a camera. Its radial distortion is part of it, as far as a projection can have it.
    pub(super) fn from_camera(camera: &CameraModel) -> Self {
        if camera.is_pinhole() {
            Self::Gnomonic
        } else {
            Self::Zenithal(radial_powers(camera))
        }
    }

    /// The place of a direction that a camera sees, in focal lengths.
    pub(super) fn place_of(&self, direction: &UnitVector<Camera>) -> [f64; 2] {
        match self {
            Self::Gnomonic => {
                let place = Projection::Pinhole.image_of(direction);
                place.unwrap_or([f64::NAN; 2])
            }
            Self::Zenithal(powers) => {
                let place = Projection::Equidistant.image_of(direction);
                place.unwrap_or([f64::NAN; 2]).map(|along| {
                    let square = direction.angle_to(&UnitVector::BORESIGHT).powi(2);
                    along
                        * powers
                            .iter()
                            .rev()
                            .fold(0.0, |sum, power| sum * square + power)
                })
            }
        }
    }

    /// Its code, and a comment.
    pub(super) const fn code_and_name(&self) -> (&'static str, &'static str) {
        match self {
            Self::Gnomonic => ("TAN", "gnomonic projection"),
            Self::Zenithal(_) => ("ZPN", "polynomial of the angle from the axis"),
        }
    }

    /// Adds its parameters.
    pub(super) fn add_to(&self, header: &mut FitsHeader) {
        let Self::Zenithal(powers) = self else {
            return;
        };
        for (number, value) in powers
            .iter()
            .enumerate()
            .filter(|(_, value)| **value != 0.0)
        {
            header.real(&format!("PV2_{}", 2 * number + 1), *value, "");
        }
    }
}

/// The polynomial of the angle that is the camera's radial distance from its axis.
fn radial_powers(camera: &CameraModel) -> [f64; POWERS] {
    let distortion = camera.distortion();
    let radial = distortion.map(Distortion::radial);
    let round = camera.with_distortion(radial);
    let max_rad = camera.radius_rad();
    let seen = (1..=FIT_ANGLES).filter_map(|i| {
        let angle_rad = max_rad * i as f64 / FIT_ANGLES as f64;
        let (sin, cos) = libm::sincos(angle_rad);
        let pixel = round.pixel_of(&UnitVector::from_unit(Vector3::new(sin, 0.0, cos)))?;
        let [u, _] = round.offset_of(&pixel);
        Some((angle_rad / max_rad, u / camera.focal_length_px() / max_rad))
    });
    let (angles, radii): (Vec<f64>, Vec<f64>) = seen.unzip();
    let design = DMatrix::from_fn(angles.len(), POWERS, |row, power| {
        angles[row].powi(2 * power as i32 + 1)
    });
    let solved = design.svd(true, true).solve(&DVector::from(radii), 1e-13);
    let solved = solved.unwrap_or_else(|_| DVector::zeros(POWERS));
    std::array::from_fn(|power| solved[power] / max_rad.powi(2 * power as i32))
}
