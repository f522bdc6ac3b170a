//! The report of a calibration: JSON and text.

use super::SCHEMA;
use crate::base::format::{to_decimals, to_significant};
use crate::base::units::{ARCSEC_PER_RAD, DEG_PER_RAD};
use crate::camera::CameraModel;
use crate::identify::lens::{Coverage, LeftOutFrame, LensCalibration, UsedFrame};
use serde::Serialize;
use std::fmt::Write as _;

/// The report of a calibration.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LensReport {
    /// Version of the fields.
    pub schema: u32,
    /// Columns of the frames.
    pub width: usize,
    /// Rows of the frames.
    pub height: usize,
    /// The lens.
    pub lens: LensValues,
    /// Frames that were used.
    pub frames: Vec<FrameValues>,
    /// Frames that were left out.
    pub left_out: Vec<LeftOutValues>,
    /// Stars of all frames.
    pub stars: usize,
    /// Standard deviation of the residuals on each axis, from their median.
    pub rms_px: f64,
    /// The same of stars that were left out of the fit.
    pub held_out_rms_px: f64,
    /// Error on each axis that the errors of the centroids do not explain.
    pub excess_sigma_px: f64,
    /// Number of directions that the frames look into.
    pub directions: usize,
    /// Error on each axis that stars have in common in frames of one direction.
    pub common_sigma_px: f64,
    /// By how much the lenses of the directions differ, in standard errors; the errors are as much larger.
    pub direction_scatter: f64,
    /// Share of the frame in which there are stars.
    pub coverage: f64,
    /// Stars and mean residuals by place.
    pub map: Coverage,
    /// Change of the scale over time.
    pub drift: Option<DriftValues>,
    /// How the camera stands.
    pub mount: Option<MountValues>,
}

/// A lens.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LensValues {
    /// The ideal lens that is nearest.
    pub model: &'static str,
    /// Focal length at the frame's centre, or on the axis of a lens that is no pinhole.
    pub focal_length_px: f64,
    /// Standard error of the focal length that the distortion refers to.
    pub focal_length_sigma_px: f64,
    /// Whether the picture is mirrored.
    pub mirrored: bool,
    /// Where the axis meets the frame.
    pub axis_px: [f64; 2],
    /// Angle from the axis up to which it is known, if it is not known up to the corners.
    pub valid_to_deg: Option<f64>,
    /// Model of the distortion.
    pub distortion: Option<&'static str>,
    /// Terms of the distortion.
    pub coefficients_px: Vec<f64>,
    /// Their standard errors.
    pub sigma_px: Vec<f64>,
}

/// A frame that was used.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FrameValues {
    /// Its name.
    pub frame: String,
    /// Its stars.
    pub stars: usize,
    /// Standard deviation of their residuals on each axis, from their median.
    pub rms_px: f64,
    /// Its scale relative to the lens's, in millionths.
    pub scale_ppm: f64,
    /// Its standard error.
    pub scale_sigma_ppm: f64,
}

/// A frame that was left out.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LeftOutValues {
    /// Its name.
    pub frame: String,
    /// Code of the reason.
    pub code: &'static str,
    /// The reason.
    pub text: String,
}

/// A change of the scale.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DriftValues {
    /// In millionths per day.
    pub scale_ppm_per_day: f64,
    /// Its standard error.
    pub sigma_ppm_per_day: f64,
    /// Scatter of the frames' scales about it, in standard errors.
    pub scatter: f64,
}

/// How a camera stands.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MountValues {
    /// Altitude of the boresight, refracted.
    pub altitude_deg: f64,
    /// Azimuth of the boresight, from north through east.
    pub azimuth_deg: f64,
    /// Angle of image-up from the vertical, clockwise in the image.
    pub tilt_deg: f64,
    /// Largest difference of a frame.
    pub scatter_arcsec: f64,
}

impl LensReport {
    /// The report of `calibration`.
    pub fn new(calibration: &LensCalibration) -> Self {
        let camera = calibration.lens.camera();
        let ppm = |value: f64| to_significant(1e6 * value, 4);
        let frame = |used: &UsedFrame| FrameValues {
            frame: used.name.clone(),
            stars: used.stars,
            rms_px: to_decimals(used.rms_px, 4),
            scale_ppm: ppm(used.scale.value),
            scale_sigma_ppm: ppm(used.scale.sigma),
        };
        let left_out = |frame: &LeftOutFrame| LeftOutValues {
            frame: frame.name.clone(),
            code: frame.why.code(),
            text: frame.why.to_string(),
        };
        Self {
            schema: SCHEMA,
            width: camera.width_px as usize,
            height: camera.height_px as usize,
            lens: LensValues::new(calibration),
            frames: calibration.frames.iter().map(frame).collect(),
            left_out: calibration.left_out.iter().map(left_out).collect(),
            stars: calibration.stars,
            rms_px: to_decimals(calibration.rms_px, 4),
            held_out_rms_px: to_decimals(calibration.held_out_rms_px, 4),
            excess_sigma_px: to_decimals(calibration.excess_sigma_px, 4),
            directions: calibration.directions,
            common_sigma_px: to_decimals(calibration.common_sigma_px, 4),
            direction_scatter: to_decimals(calibration.direction_scatter, 3),
            coverage: to_decimals(calibration.coverage.share(), 3),
            map: calibration.coverage.clone(),
            drift: calibration.drift.map(|drift| DriftValues {
                scale_ppm_per_day: ppm(drift.per_day),
                sigma_ppm_per_day: ppm(drift.sigma_per_day),
                scatter: to_decimals(drift.scatter, 2),
            }),
            mount: calibration.mount.map(|mount| MountValues {
                altitude_deg: to_decimals(mount.altitude_rad * DEG_PER_RAD, 4),
                azimuth_deg: to_decimals(mount.azimuth_rad * DEG_PER_RAD, 4),
                tilt_deg: to_decimals(mount.tilt_rad * DEG_PER_RAD, 4),
                scatter_arcsec: to_decimals(mount.scatter_rad * ARCSEC_PER_RAD, 1),
            }),
        }
    }

    /// The text for people.
    pub fn to_text(&self) -> String {
        let mut text = format!(
            "{} stars in {} frames of {} × {} px\n",
            self.stars,
            self.frames.len(),
            self.width,
            self.height
        );
        for (label, value) in self.lines() {
            let _ = writeln!(text, "  {label:<11} {value}");
        }
        let _ = writeln!(
            text,
            "\n  frame{:>40} {:>9} {:>22}",
            "stars", "rms (px)", "scale (ppm)"
        );
        for frame in &self.frames {
            let _ = writeln!(
                text,
                "  {:<36} {:>8} {:>9.3} {:>+12.1} ± {:<7.1}",
                frame.frame, frame.stars, frame.rms_px, frame.scale_ppm, frame.scale_sigma_ppm
            );
        }
        for frame in &self.left_out {
            let _ = writeln!(text, "  {} was not used: {}", frame.frame, frame.text);
        }
        text
    }

    /// What the directions of the frames say of the errors.
    fn directions_text(&self) -> String {
        let mut text = self.directions.to_string();
        if self.directions < self.frames.len() {
            let _ = write!(
                text,
                " for {} frames; frames of the same direction share an error of {:.3} px",
                self.frames.len(),
                self.common_sigma_px
            );
        }
        if self.directions == 1 {
            text += "; the stated errors do not include differences between directions";
        } else if self.direction_scatter > 1.0 {
            let _ = write!(
                text,
                "; the lens differs between directions by {:.2} standard errors, and the stated errors are \
                 increased by this factor",
                self.direction_scatter
            );
        }
        text
    }

    /// What is said of the lens, each with its name.
    pub fn lines(&self) -> Vec<(&'static str, String)> {
        let lens = &self.lens;
        let mirrored = if lens.mirrored { ", mirrored" } else { "" };
        let known = lens.valid_to_deg.map_or_else(
            || "measured up to the corners".to_owned(),
            |to_deg| format!("measured up to {to_deg:.2}° from the axis"),
        );
        let mut lines = vec![
            (
                "lens",
                format!(
                    "{}, {}, focal length {:.3} ± {:.3} px{mirrored}; {known}",
                    lens.model,
                    lens.distortion.unwrap_or("no distortion"),
                    lens.focal_length_px,
                    lens.focal_length_sigma_px
                ),
            ),
            (
                "axis",
                format!("({:.2}, {:.2}) px", lens.axis_px[0], lens.axis_px[1]),
            ),
            (
                "residuals",
                format!(
                    "{:.3} px on each axis, {:.3} px for stars not used in the fit; {:.3} px not explained by centroid errors",
                    self.rms_px, self.held_out_rms_px, self.excess_sigma_px
                ),
            ),
            (
                "coverage",
                format!("stars in {:.0} % of the frame", 100.0 * self.coverage),
            ),
            ("directions", self.directions_text()),
        ];
        if !lens.coefficients_px.is_empty() {
            let terms = lens.coefficients_px.iter().zip(&lens.sigma_px);
            let terms: Vec<String> = terms
                .map(|(value, sigma)| format!("{value:.3} ± {sigma:.3}"))
                .collect();
            lines.insert(2, ("distortion", format!("{} px", terms.join(", "))));
        }
        if let Some(drift) = &self.drift {
            lines.push((
                "drift",
                format!(
                    "scale {:+.2} ± {:.2} ppm per day; frames scatter by {:.2} standard errors",
                    drift.scale_ppm_per_day, drift.sigma_ppm_per_day, drift.scatter
                ),
            ));
        }
        if let Some(mount) = &self.mount {
            lines.push((
                "mount",
                format!(
                    "altitude {:.3}°, azimuth {:.3}°, image up {:+.3}° from the vertical; frames agree within {:.1}″",
                    mount.altitude_deg, mount.azimuth_deg, mount.tilt_deg, mount.scatter_arcsec
                ),
            ));
        }
        lines
    }
}

impl LensValues {
    fn new(calibration: &LensCalibration) -> Self {
        let lens = &calibration.lens;
        let camera: &CameraModel = lens.camera();
        let distortion = camera.distortion();
        let coefficients = distortion.map_or(&[][..], |distortion| distortion.coefficients_px());
        let sigma = lens.covariance().diagonal();
        let axis = camera.axis();
        Self {
            model: camera.projection().name(),
            focal_length_px: to_decimals(camera.central_focal_length_px(), 4),
            focal_length_sigma_px: to_significant(lens.focal_length_sigma_px(), 3),
            mirrored: camera.mirrored,
            axis_px: [axis.x, axis.y].map(|along| to_decimals(along, 3)),
            valid_to_deg: camera
                .valid_to_rad()
                .map(|rad| to_decimals(rad * DEG_PER_RAD, 4)),
            distortion: distortion.map(|distortion| distortion.model().name()),
            coefficients_px: coefficients
                .iter()
                .map(|term| to_decimals(*term, 6))
                .collect(),
            sigma_px: sigma
                .iter()
                .skip(1)
                .map(|variance| to_significant(variance.sqrt(), 3))
                .collect(),
        }
    }
}
