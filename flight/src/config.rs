//! What does not change from image to image.

use crate::{Camera, Error};

/// A detector and an exposure.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub struct Sensor {
    /// V magnitude of a star that makes one electron a second.
    pub zero_point_mag: f64,
    /// Exposure, in seconds.
    pub exposure_s: f64,
    /// Electrons in a unit of the image (ADU).
    pub gain_e_per_adu: f64,
    /// Read noise, in electrons.
    pub read_noise_e: f64,
    /// Electrons of the sky and of the dark current, a second and pixel.
    pub background_e_s: f64,
    /// Level of the image (ADU) from which on pixels are saturated.
    pub saturation_adu: f64,
    /// Time from one row to the next where the rows are read one after the other (rolling shutter), in seconds; else 0.
    pub row_time_s: f64,
}

/// What does not change from image to image.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub struct Config {
    /// The camera's geometry.
    pub camera: Camera,
    /// The camera's detector.
    pub sensor: Sensor,
    /// Standard deviation of a star's image, in pixels.
    pub spot_sigma_px: f64,
    /// Significance from which on something counts as a star, in standard deviations of the noise.
    pub detection_sigma: f64,
    /// What the errors of positions lack in theory, on each axis: lens, pixels, catalogue.
    pub position_floor_px: f64,
    /// Standard error of the focal length, as a share of it.
    pub scale_error: f64,
    /// log10 of the false-alarm probability that an identification must stay below.
    pub max_log10_false_alarm: f64,
    /// Most stars of an image.
    pub max_stars: u32,
}

impl Config {
    pub(crate) fn check(&self) -> Result<(), Error> {
        let Self { sensor, .. } = self;
        let fits = [
            (0.3..=4.0).contains(&self.spot_sigma_px),
            (3.0..=100.0).contains(&self.detection_sigma),
            (0.0..=5.0).contains(&self.position_floor_px),
            (0.0..=0.05).contains(&self.scale_error),
            (-100.0..=-2.0).contains(&self.max_log10_false_alarm),
            (4..=256).contains(&self.max_stars),
            sensor.zero_point_mag.is_finite(),
            sensor.exposure_s > 0.0 && sensor.exposure_s.is_finite(),
            sensor.gain_e_per_adu > 0.0 && sensor.gain_e_per_adu.is_finite(),
            sensor.read_noise_e >= 0.0 && sensor.read_noise_e.is_finite(),
            sensor.background_e_s >= 0.0 && sensor.background_e_s.is_finite(),
            sensor.saturation_adu > 0.0,
            (0.0..=1.0).contains(&sensor.row_time_s),
        ];
        if fits.iter().all(|fits| *fits) {
            Ok(())
        } else {
            Err(Error::Config)
        }
    }
}
