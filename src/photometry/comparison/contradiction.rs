//! Ways in which a frame contradicts the camera that it is said to be from.

use crate::base::units::ARCSEC_PER_RAD;
use std::fmt;

/// One contradiction between a frame and the stated camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Contradiction {
    /// The frame has another size than the camera's detector.
    Size {
        /// Columns and rows of the frame.
        frame_px: [usize; 2],
        /// Columns and rows of the camera.
        camera_px: [usize; 2],
    },
    /// Another lens, or binned pixels.
    PixelScale {
        /// Measured pixel scale, in radians.
        measured_rad: f64,
        /// The camera's, in radians.
        camera_rad: f64,
    },
    /// Another focus.
    SpotSize {
        /// Standard deviation of the measured spots, in pixels.
        measured_px: f64,
        /// The camera's, in pixels.
        camera_px: f64,
    },
    /// The background lies below the camera's bias.
    BelowBias {
        /// Median level of the background, in ADU.
        background_adu: f64,
        /// The camera's bias, in ADU.
        bias_adu: f64,
    },
    /// Another gain, bias or read noise.
    Noise {
        /// Measured background noise, in electrons.
        measured_e: f64,
        /// Noise expected of the background's level, in electrons.
        expected_e: f64,
    },
    /// Another throughput, exposure or gain.
    ZeroPoint {
        /// Measured minus predicted zero point, in magnitudes.
        difference_mag: f64,
    },
    /// The stated zenith distance is not that of site, date and attitude.
    ZenithDistance {
        /// Stated zenith distance, in degrees.
        stated_deg: f64,
        /// That of site, date and attitude, in degrees.
        observed_deg: f64,
    },
}

impl Contradiction {
    /// Code for programs.
    pub const fn code(&self) -> &'static str {
        match self {
            Self::Size { .. } => "size_differs",
            Self::PixelScale { .. } => "pixel_scale_differs",
            Self::SpotSize { .. } => "spot_size_differs",
            Self::BelowBias { .. } => "background_below_bias",
            Self::Noise { .. } => "noise_differs",
            Self::ZeroPoint { .. } => "zero_point_differs",
            Self::ZenithDistance { .. } => "zenith_distance_differs",
        }
    }
}

impl fmt::Display for Contradiction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Size {
                frame_px: [width, height],
                camera_px: [camera_width, camera_height],
            } => write!(
                f,
                "the frame has {width} × {height} pixels, the camera {camera_width} × {camera_height}"
            ),
            Self::PixelScale {
                measured_rad,
                camera_rad,
            } => write!(
                f,
                "a pixel spans {:.2}″, by the camera's focal length and pitch {:.2}″",
                measured_rad * ARCSEC_PER_RAD,
                camera_rad * ARCSEC_PER_RAD
            ),
            Self::SpotSize {
                measured_px,
                camera_px,
            } => write!(
                f,
                "the stars' spots have a standard deviation of {measured_px:.2} px, the camera's {camera_px:.2} px"
            ),
            Self::BelowBias {
                background_adu,
                bias_adu,
            } => write!(
                f,
                "the background's level is {background_adu:.1}, below the camera's bias of {bias_adu}"
            ),
            Self::Noise {
                measured_e,
                expected_e,
            } => write!(
                f,
                "the background's noise is {measured_e:.1} electrons, that of its level by the camera's gain, bias and read noise {expected_e:.1}"
            ),
            Self::ZeroPoint { difference_mag } => {
                let cause = if difference_mag < 0.0 {
                    "less light arrives than the camera should see: haze, a stop, dew, another exposure or gain"
                } else {
                    "more light arrives than the camera should see: another aperture, exposure or gain"
                };
                write!(
                    f,
                    "the zero point is {difference_mag:+.2} mag off the camera's; {cause}"
                )
            }
            Self::ZenithDistance {
                stated_deg,
                observed_deg,
            } => write!(
                f,
                "the zenith distance is stated as {stated_deg:.1}°, by site, date and attitude it is {observed_deg:.1}°"
            ),
        }
    }
}
