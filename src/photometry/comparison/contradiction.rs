//! Contradictions between a frame and the stated camera.

use super::measurement::{FrameMeasurement, ObservingSetup};
use crate::base::statistics::Estimate;
use crate::base::units::ARCSEC_PER_RAD;
use crate::predict::Budget;
use std::fmt;

/// One contradiction between a frame and the stated camera.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Contradiction {
    /// The frame has another size than the detector.
    Size {
        /// Columns and rows of the frame.
        frame_px: [usize; 2],
        /// Columns and rows of the camera.
        camera_px: [usize; 2],
    },
    /// The pixel scale differs: another lens, or binned pixels.
    PixelScale {
        /// Measured pixel scale, in radians.
        measured_rad: f64,
        /// The camera's, in radians.
        camera_rad: f64,
    },
    /// The spots have another size: another focus.
    SpotSize {
        /// Standard deviation of the measured spots, in pixels.
        measured_px: f64,
        /// The camera's, in pixels.
        camera_px: f64,
    },
    /// The background lies below the camera's bias.
    BelowBias {
        /// Median background of the frame, in ADU.
        background_adu: f64,
        /// The camera's bias, in ADU.
        bias_adu: f64,
    },
    /// The noise differs: another gain, bias or read noise.
    Noise {
        /// Measured background noise, in electrons.
        measured_e: f64,
        /// Noise expected from the background, in electrons.
        expected_e: f64,
    },
    /// The zero point differs: another throughput, exposure or gain.
    ZeroPoint {
        /// Measured minus predicted zero point, in magnitudes.
        difference_mag: f64,
    },
    /// The stated zenith distance is not that of site, date and attitude.
    ZenithDistance {
        /// Stated zenith distance, in degrees.
        stated_deg: f64,
        /// Zenith distance from site, date and attitude, in degrees.
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
                "the pixel scale is {:.2}″; the camera's focal length and pixel pitch give {:.2}″",
                measured_rad * ARCSEC_PER_RAD,
                camera_rad * ARCSEC_PER_RAD
            ),
            Self::SpotSize {
                measured_px,
                camera_px,
            } => write!(
                f,
                "the spots of stars have a standard deviation of {measured_px:.2} px; that in the camera's description is {camera_px:.2} px"
            ),
            Self::BelowBias {
                background_adu,
                bias_adu,
            } => write!(
                f,
                "the background level is {background_adu:.1}, below the camera's bias of {bias_adu}"
            ),
            Self::Noise {
                measured_e,
                expected_e,
            } => write!(
                f,
                "the background noise is {measured_e:.1} electrons; its level and the camera's gain, bias and read noise give {expected_e:.1}"
            ),
            Self::ZeroPoint { difference_mag } => {
                let cause = if difference_mag < 0.0 {
                    "less light arrives than predicted: haze, dew, a smaller aperture, or another exposure or gain"
                } else {
                    "more light arrives than predicted: another aperture, exposure or gain"
                };
                write!(
                    f,
                    "the zero point differs by {difference_mag:+.2} mag from the predicted one; {cause}"
                )
            }
            Self::ZenithDistance {
                stated_deg,
                observed_deg,
            } => write!(
                f,
                "the stated zenith distance is {stated_deg:.1}°, but site, date and attitude give {observed_deg:.1}°"
            ),
        }
    }
}

/// Contradictions of `frame` with the stated camera, of which `budget` and the zero point's
/// difference follow.
pub(super) fn find(
    stated: &ObservingSetup,
    frame: &FrameMeasurement,
    budget: &Budget,
    zero_point_difference: Option<Estimate>,
) -> Vec<Contradiction> {
    let all = [
        size(stated, frame),
        pixel_scale(stated, frame),
        spot_size(stated, frame),
        below_bias(stated, frame),
        noise(stated, frame, budget.background_noise_e),
        zero_point_difference.and_then(zero_point),
        zenith_distance(stated, frame),
    ];
    all.into_iter().flatten().collect()
}

fn size(stated: &ObservingSetup, frame: &FrameMeasurement) -> Option<Contradiction> {
    let camera_px = [stated.sheet.width_px, stated.sheet.height_px];
    (frame.size_px != camera_px).then_some(Contradiction::Size {
        frame_px: frame.size_px,
        camera_px,
    })
}

fn pixel_scale(stated: &ObservingSetup, frame: &FrameMeasurement) -> Option<Contradiction> {
    const TOLERANCE: f64 = 0.05;
    let measured_rad = frame.pixel_scale_rad?;
    let camera_rad = stated.sheet.pixel_scale_rad();
    differs_by(1.0 + TOLERANCE, measured_rad, camera_rad).then_some(Contradiction::PixelScale {
        measured_rad,
        camera_rad,
    })
}

fn spot_size(stated: &ObservingSetup, frame: &FrameMeasurement) -> Option<Contradiction> {
    const TOLERANCE_FACTOR: f64 = 1.5;
    let measured_px = frame.spot_sigma_px?;
    let camera_px = stated.sheet.spot_sigma_px;
    differs_by(TOLERANCE_FACTOR, measured_px, camera_px).then_some(Contradiction::SpotSize {
        measured_px,
        camera_px,
    })
}

fn below_bias(stated: &ObservingSetup, frame: &FrameMeasurement) -> Option<Contradiction> {
    let (background_adu, bias_adu) = (frame.background_adu, stated.sheet.bias_adu);
    (background_adu < bias_adu - frame.noise_adu).then_some(Contradiction::BelowBias {
        background_adu,
        bias_adu,
    })
}

fn noise(
    stated: &ObservingSetup,
    frame: &FrameMeasurement,
    expected_e: f64,
) -> Option<Contradiction> {
    const TOLERANCE_FACTOR: f64 = 1.5;
    let measured_e = frame.noise_adu * stated.sheet.gain_e_per_adu;
    differs_by(TOLERANCE_FACTOR, measured_e, expected_e).then_some(Contradiction::Noise {
        measured_e,
        expected_e,
    })
}

fn differs_by(factor: f64, measured: f64, stated: f64) -> bool {
    measured > stated * factor || measured < stated / factor
}

fn zero_point(Estimate { value, sigma }: Estimate) -> Option<Contradiction> {
    const TOLERANCE_MAG: f64 = 0.5;
    (value.abs() > TOLERANCE_MAG.max(5.0 * sigma)).then_some(Contradiction::ZeroPoint {
        difference_mag: value,
    })
}

fn zenith_distance(stated: &ObservingSetup, frame: &FrameMeasurement) -> Option<Contradiction> {
    /// Beyond half the field, which the stated direction may be off the centre.
    const TOLERANCE_DEG: f64 = 1.0;
    let stated_deg = stated
        .zenith_distance_deg
        .or(frame.header_zenith_distance_deg)?;
    let observed_deg = frame.zenith_distance_deg?;
    let half_px = frame.size_px[0].max(frame.size_px[1]) as f64 / 2.0;
    let half_field_deg = frame
        .pixel_scale_rad
        .map_or(0.0, |rad| (half_px * rad).to_degrees());
    let difference_deg = (stated_deg - observed_deg).abs();
    (difference_deg > TOLERANCE_DEG + half_field_deg).then_some(Contradiction::ZenithDistance {
        stated_deg,
        observed_deg,
    })
}
