//! How does a camera stand that does not move?

use super::frames::LensFrame;
use crate::base::coords::{Camera, UnitVector};
use crate::base::statistics::median;
use std::f64::consts::{PI, TAU};

/// Where a camera that does not move looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mount {
    /// Altitude of its boresight above the horizon, in radians, refracted.
    pub altitude_rad: f64,
    /// Azimuth of its boresight, from north through east, in radians.
    pub azimuth_rad: f64,
    /// Angle of the image's up from the vertical plane, clockwise in the image, in radians. Near the zenith
    /// it only has a meaning together with the azimuth.
    pub tilt_rad: f64,
    /// Largest angle by which a frame differs, in radians.
    pub scatter_rad: f64,
}

/// Largest angle by which the frames of a camera that does not move differ.
const STILL_RAD: f64 = 0.01;

impl Mount {
    /// `None` if site and time of two frames or more are not known, or the camera has moved.
    pub(super) fn measure(frames: &[LensFrame]) -> Option<Self> {
        let places = frames.iter().map(|frame| {
            let zenith = frame.joint.icrs_to_camera.apply(frame.places.zenith()?);
            Some((zenith, frame.observation?.azimuth_rad))
        });
        let places: Option<Vec<_>> = places.collect();
        let places = places.filter(|places| places.len() >= 2)?;
        let sum = places.iter().map(|(zenith, _)| zenith.as_vector()).sum();
        let zenith: UnitVector<Camera> = UnitVector::from_vector(sum);
        let (_, first) = places[0];
        let turned = |azimuth_rad: f64| (azimuth_rad - first + PI).rem_euclid(TAU) - PI;
        let mut turns: Vec<f64> = places.iter().map(|(_, azimuth)| turned(*azimuth)).collect();
        let middle = median(&mut turns);
        let up = zenith.as_vector();
        let cos_altitude = libm::hypot(up.x, up.y);
        let scatter = places.iter().map(|(of_frame, azimuth)| {
            let around = cos_altitude * (turned(*azimuth) - middle).abs();
            of_frame.angle_to(&zenith).max(around)
        });
        let scatter_rad = scatter.fold(0.0, f64::max);
        (scatter_rad < STILL_RAD).then_some(Self {
            altitude_rad: libm::atan2(up.z, cos_altitude),
            azimuth_rad: (first + middle).rem_euclid(TAU),
            tilt_rad: libm::atan2(up.x, -up.y),
            scatter_rad,
        })
    }
}
