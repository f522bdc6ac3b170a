//! What tracking says of a frame.

use crate::base::coords::{Camera, Icrs, PixelPoint, Rotation, UnitVector};
use crate::camera::CameraModel;
use crate::catalog::StarIndex;
use crate::ephemeris::places::{AttitudeFrame, StarPlaces};
use crate::solve::Solution;
use nalgebra::{Matrix3, Vector3};

/// How the attitude of a frame was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// From windows around predicted stars.
    Tracked,
    /// By a full solution.
    Acquired,
    /// It was not found.
    Lost,
}

impl Mode {
    /// Code for programs.
    pub const fn code(self) -> &'static str {
        match self {
            Self::Tracked => "tracked",
            Self::Acquired => "acquired",
            Self::Lost => "lost",
        }
    }
}

/// An attitude and its error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Attitude {
    /// Rotation from apparent directions, in ICRS axes, to camera axes.
    pub icrs_to_camera: Rotation<Icrs, Camera>,
    /// Covariance of the small rotation about the camera's x, y and z axes, in rad².
    pub covariance_rad2: Matrix3<f64>,
}

/// The angular rate of the camera about its own axes. Stars turn the other way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AngularRate {
    /// In radians per second, or per frame where times are not known.
    pub rad: Vector3<f64>,
    /// Its standard errors.
    pub sigma_rad: Vector3<f64>,
    /// Whether it is per frame.
    pub is_per_frame: bool,
}

/// Why a frame was not tracked.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Loss {
    /// There is no attitude before it.
    NoAttitude,
    /// There is one attitude before it, and so no rate.
    NoRate,
    /// Its size is not that of the frames before it.
    OtherSize,
    /// Its time is not after that of the frame before it.
    NotLater,
    /// The stars may be too far from their predicted places.
    TooUncertain {
        /// Radius in which they would have to be searched for, in pixels.
        radius_px: f64,
    },
    /// Too few stars stand alone in the predicted field.
    TooFewStars {
        /// Stars predicted.
        predicted: usize,
    },
    /// The stars are not where they were predicted.
    NoAgreement {
        /// Stars predicted.
        predicted: usize,
        /// Those that agree with one attitude.
        agreeing: usize,
        /// log10 of the probability that chance gives as good an agreement.
        log10_false_alarm: f64,
    },
}

impl Loss {
    /// Code for programs.
    pub const fn code(&self) -> &'static str {
        match self {
            Self::NoAttitude => "no_attitude",
            Self::NoRate => "no_rate",
            Self::OtherSize => "other_size",
            Self::NotLater => "not_later",
            Self::TooUncertain { .. } => "too_uncertain",
            Self::TooFewStars { .. } => "too_few_predicted",
            Self::NoAgreement { .. } => "no_agreement",
        }
    }
}

/// A star that was tracked.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct TrackedStar {
    /// The catalogue star.
    pub star: StarIndex,
    /// Its centroid.
    pub position: PixelPoint,
    /// Standard error of the centroid on each axis, in pixels.
    pub sigma_px: f64,
    /// Its apparent direction.
    pub direction: UnitVector<Icrs>,
}

/// What tracking says of one frame.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Track {
    /// How the attitude was found.
    pub mode: Mode,
    /// Time of the frame, in seconds, where it was given.
    pub time_s: Option<f64>,
    /// The attitude, from this frame alone; `None` where it is lost.
    pub attitude: Option<Attitude>,
    /// Where stars appear in it: at the time of the last full solution.
    pub places: StarPlaces,
    /// Which directions the reported attitude refers to.
    pub attitude_frame: AttitudeFrame,
    /// The rate, from this frame and those before it; `None` before the second attitude.
    pub rate: Option<AngularRate>,
    /// Stars that the attitude was fitted to.
    pub stars_used: usize,
    /// log10 of the probability that chance gives as good an agreement.
    pub log10_false_alarm: Option<f64>,
    /// The camera after this frame, and the standard error of its focal length in pixels.
    pub camera: Option<(CameraModel, f64)>,
    /// Why the frame was not tracked.
    pub loss: Option<Loss>,
    /// The full solution, where there is one: with the reason, where the frame is lost.
    pub solution: Option<Box<Solution>>,
}
