//! The result of identification.

use crate::base::coords::{Camera, Icrs, PixelPoint, Rotation, UnitVector};
use crate::camera::CameraModel;
use crate::identify::field::SourceIndex;
use crate::sky::catalog::StarIndex;
use crate::sky::places::{AttitudeFrame, StarPlaces};
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::FRAC_1_SQRT_2;

/// Fewest stars that can be identified: a triangle, and one star that confirms it.
pub const MIN_STARS: usize = 4;

/// An identified star field.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Identification {
    /// The camera's geometry: pixel to direction.
    pub camera: CameraModel,
    /// The attitude: from apparent directions, in ICRS axes, to camera axes.
    pub icrs_to_camera: Rotation<Icrs, Camera>,
    /// Where the catalogue's stars appear.
    pub places: StarPlaces,
    /// Whether the lens was known, and held.
    pub lens_is_known: bool,
    /// Covariance of the attitude error, as small rotations about the camera's x, y and z axes, in
    /// rad².
    pub attitude_covariance_rad2: Matrix3<f64>,
    /// Standard error of the focal length, in pixels.
    pub focal_length_sigma_px: f64,
    /// Standard deviation on each axis, in pixels, that the stated centroid errors lack to explain
    /// the residuals: the error of the lens model, and of spots that are not the detector's. The
    /// errors of attitude and focal length include it.
    pub excess_sigma_px: f64,
    /// The identified stars, in the order of the observed stars.
    pub matches: Vec<StarMatch>,
    /// Root mean square of the residuals, in pixels.
    pub rms_px: f64,
    /// log10 of the false-alarm probability: that chance gives as good an answer, counting all
    /// hypotheses tried.
    pub log10_false_alarm: f64,
}

impl Identification {
    /// Adds an error of the positions that all of them share, in pixels on each axis: only the attitude
    /// follows it.
    pub fn add_common_error(&mut self, sigma_px: f64) {
        let sigma_rad = sigma_px / self.camera.focal_length_px();
        for axis in 0..2 {
            self.attitude_covariance_rad2[(axis, axis)] += sigma_rad * sigma_rad;
        }
    }

    /// Adds the errors of aberration by the Earth's motion at an unknown date.
    pub fn add_unknown_aberration(&mut self) {
        /// The Earth's mean speed about the Sun over that of light.
        const SPEED_C: f64 = 9.936e-5;
        let ecliptic_pole = Vector3::new(0.0, -0.397_777, 0.917_482);
        let boresight = self.icrs_to_camera.boresight();
        let in_ecliptic = boresight.as_vector().cross(&ecliptic_pole).norm();
        let along = SPEED_C * in_ecliptic * FRAC_1_SQRT_2;
        self.focal_length_sigma_px = libm::hypot(
            self.focal_length_sigma_px,
            along * self.camera.central_focal_length_px(),
        );
    }

    /// Where the camera sees what appears in this direction; `None` if it does not.
    pub fn pixel_of(&self, apparent: &UnitVector<Icrs>) -> Option<PixelPoint> {
        self.camera.pixel_of(&self.icrs_to_camera.apply(apparent))
    }

    /// The direction in which a pixel's light appears; `None` outside the lens's field.
    pub fn apparent_direction_of(&self, pixel: &PixelPoint) -> Option<UnitVector<Icrs>> {
        let direction = self.camera.direction_of(pixel)?;
        Some(self.icrs_to_camera.inverse().apply(&direction))
    }

    /// The attitude relative to these directions.
    pub fn attitude(&self, frame: AttitudeFrame) -> Rotation<Icrs, Camera> {
        self.places.attitude(&self.icrs_to_camera, frame)
    }

    /// Standard errors of the attitude about the camera's x, y and z axes, in radians.
    pub fn attitude_sigma_rad(&self) -> [f64; 3] {
        self.attitude_covariance_rad2
            .diagonal()
            .map(f64::sqrt)
            .into()
    }
}

/// An observed star and the catalogue star that it is.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct StarMatch {
    /// The observed star.
    pub source: SourceIndex,
    /// The catalogue star.
    pub star: StarIndex,
    /// Apparent direction of its light: that of the star, or of the light of all stars blended with
    /// it.
    pub light: UnitVector<Icrs>,
    /// Distance between the observed position and that of its light, in pixels of an ideal pinhole
    /// camera.
    pub residual_px: f64,
    /// Probability that the name is chance.
    pub p_chance: f64,
}

/// Why the search identified no stars.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SearchFailure {
    /// Fewer stars than identification needs.
    #[error("{found} stars are too few to identify; {needed} are needed")]
    TooFewStars {
        /// Stars found.
        found: usize,
        /// Stars needed.
        needed: usize,
    },
    /// No hypothesis reached the required false-alarm probability.
    #[error("no pointing agrees with the stars well enough")]
    NoMatch {
        /// log10 of the false-alarm probability of the best hypothesis, if there was one.
        best_log10_false_alarm: Option<f64>,
    },
    /// A pointing was found, but too few stars have a sure name under it.
    #[error("a pointing agrees with the brightest stars, and too few stars confirm it by name")]
    NotConfirmed {
        /// log10 of its false-alarm probability.
        log10_false_alarm: f64,
    },
    /// The search was ended early ([`Workspace::with_interrupt`](super::Workspace::with_interrupt)).
    #[error("the search was ended before it was complete")]
    Interrupted,
}

impl SearchFailure {
    /// Code for programs.
    pub const fn code(&self) -> &'static str {
        match self {
            Self::TooFewStars { .. } => "too_few_stars",
            Self::NoMatch { .. } => "no_match",
            Self::NotConfirmed { .. } => "not_confirmed",
            Self::Interrupted => "interrupted",
        }
    }
}
