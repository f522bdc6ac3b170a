//! The result of identification.

use crate::base::coords::{Camera, Icrs, PixelPoint, Rotation, UnitVector};
use crate::camera::CameraModel;
use crate::catalog::StarIndex;
use crate::ephemeris::places::{AttitudeFrame, StarPlaces};
use crate::identify::field::SourceIndex;
use crate::identify::predict::SkyView;
use nalgebra::{Matrix3, Vector2, Vector3};
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
    /// Standard error of the frame's centre along x and y, in pixels: 0 unless the frame's size is a guess.
    pub centre_sigma_px: [f64; 2],
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

/// How far the centre of a frame may lie beyond the pixel that it is taken to be, along x and y.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct UnknownCentre {
    /// Mean, in pixels.
    pub mean_px: Vector2<f64>,
    /// Mean square.
    pub square_px2: Vector2<f64>,
    /// Standard deviation of the distance of the lens's axis from the true centre, on each axis, in pixels.
    pub axis_sigma_px: f64,
}

impl Identification {
    /// Adds the errors of a frame whose centre is not known: the attitude of a pinhole is that of the
    /// centre. That of any other lens is of its axis, which the stars tell.
    pub(crate) fn add_unknown_centre(&mut self, centre: &UnknownCentre) {
        /// The scale in the centre of a pinhole changes by this times the square of the angle from the axis.
        const SCALE: f64 = 0.75;
        self.centre_sigma_px = centre.square_px2.map(f64::sqrt).into();
        if !self.camera.is_pinhole() {
            return;
        }
        let focal_px = self.camera.central_focal_length_px();
        let mean_rad = centre.mean_px / focal_px;
        let square_rad2 = centre.square_px2 / (focal_px * focal_px);
        // A centre farther along x is a turn about y, one farther along y a turn about −x.
        let along_x = if self.camera.mirrored { -1.0 } else { 1.0 };
        let covariance = &mut self.attitude_covariance_rad2;
        covariance[(0, 0)] += square_rad2.y;
        covariance[(1, 1)] += square_rad2.x;
        let common = -along_x * mean_rad.x * mean_rad.y;
        covariance[(0, 1)] += common;
        covariance[(1, 0)] += common;
        // The way from one pixel to another, and that over the axis of the lens, differ by the excess of the
        // triangle: half of what the two offsets span.
        let axis_rad = centre.axis_sigma_px / focal_px;
        covariance[(2, 2)] += axis_rad * axis_rad * square_rad2.sum() / 4.0;
        let scale = SCALE * square_rad2.sum();
        self.focal_length_sigma_px = libm::hypot(self.focal_length_sigma_px, scale * focal_px);
    }

    /// Standard errors of the fields of view along x and y, in radians, from those of the focal length and
    /// of the frame's size; `None` where an edge does not see the sky.
    pub fn fov_sigma_rad(&self) -> [Option<f64>; 2] {
        let camera = &self.camera;
        let share = self.focal_length_sigma_px / camera.central_focal_length_px();
        let longer = camera.with_focal_length(camera.focal_length_px() * (1.0 + share));
        let centre = camera.centre();
        let [right, lower] = [camera.width_px - 0.5, camera.height_px - 0.5];
        let edges = [
            [
                PixelPoint::new(right, centre.y),
                PixelPoint::new(right - 1.0, centre.y),
            ],
            [
                PixelPoint::new(centre.x, lower),
                PixelPoint::new(centre.x, lower - 1.0),
            ],
        ];
        let fields = [
            [camera.fov_x_rad(), longer.fov_x_rad()],
            [camera.fov_y_rad(), longer.fov_y_rad()],
        ];
        [0, 1].map(|axis| {
            let [field, with_longer] = fields[axis];
            let of_scale = field? - with_longer?;
            let [edge, inside] = edges[axis].map(|pixel| camera.direction_of(&pixel));
            let pixel_rad = libm::acos(edge?.dot(&inside?).min(1.0));
            // The centre is off by half of what the side is.
            let of_side = 2.0 * self.centre_sigma_px[axis] * pixel_rad;
            Some(libm::hypot(of_scale, of_side))
        })
    }

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

    /// The catalogue's direction at a pixel; `None` outside the lens's field.
    pub fn direction_of(&self, pixel: &PixelPoint) -> Option<UnitVector<Icrs>> {
        let apparent = self.apparent_direction_of(pixel)?;
        Some(self.places.astrometric(&apparent))
    }

    /// What the camera sees of the catalogue.
    pub fn view(&self) -> SkyView<'_> {
        SkyView {
            camera: &self.camera,
            icrs_to_camera: &self.icrs_to_camera,
            places: self.places,
        }
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
    #[error("too few stars to identify the frame: found {found}, at least {needed} are needed")]
    TooFewStars {
        /// Stars found.
        found: usize,
        /// Stars needed.
        needed: usize,
    },
    /// No hypothesis reached the required false-alarm probability.
    #[error("no pointing matches the stars well enough")]
    NoMatch {
        /// log10 of the false-alarm probability of the best hypothesis, if there was one.
        best_log10_false_alarm: Option<f64>,
    },
    /// A pointing was found, but too few stars have a sure name under it.
    #[error("a pointing matches the brightest stars, but too few of the other stars confirm it")]
    NotConfirmed {
        /// log10 of its false-alarm probability.
        log10_false_alarm: f64,
    },
    /// The search was ended early ([`Workspace::with_interrupt`](super::Workspace::with_interrupt)).
    #[error("the search was interrupted")]
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
