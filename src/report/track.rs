//! The report of a tracked frame: one line for each.

use super::digits::{PIXEL_DECIMALS, SIGMA_DIGITS};
use super::frame_report::{AttitudeReport, DistortionReport, SCHEMA};
use super::{build, reason};
use crate::base::format::{finite, json_escaped, significant, to_decimals};
use crate::base::units::DEG_PER_RAD;
use crate::camera::CameraModel;
use crate::solve::Outcome;
use crate::track::{AngularRate, Attitude, Loss, Track};
use nalgebra::Vector3;
use serde::Serialize;
use std::io;

/// The report of one frame of a sequence.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct TrackReport {
    /// Version of the JSON, that of the other reports.
    pub schema: u32,
    /// Name of the frame, usually a path.
    pub frame: String,
    /// Its time in seconds, where times are known.
    pub time_s: Option<f64>,
    /// `tracked`, `acquired` (by a full solution) or `lost`.
    pub mode: &'static str,
    /// Why there is no attitude.
    pub reason: Option<String>,
    /// Code of the reason.
    pub reason_code: Option<&'static str>,
    /// Why the frame was not tracked, but solved in full.
    pub not_tracked: Option<NotTrackedReport>,
    /// The attitude, from this frame alone.
    pub attitude: Option<AttitudeReport>,
    /// Angular rate about the camera's axes, in degrees per second.
    pub rate_deg_s: Option<AxesReport>,
    /// Its standard errors.
    pub rate_sigma_deg_s: Option<AxesReport>,
    /// The same in degrees per frame, where times are not known.
    pub rate_deg_frame: Option<AxesReport>,
    /// Its standard errors.
    pub rate_sigma_deg_frame: Option<AxesReport>,
    /// Stars that the attitude was fitted to.
    pub stars_used: usize,
    /// log10 of the probability that chance gives as good an agreement.
    pub log10_false_alarm: Option<f64>,
    /// The camera as refined until now.
    pub optics: Option<TrackOpticsReport>,
    /// Run times.
    pub timing_ms: TrackTimingReport,
}

/// Why a frame was not tracked.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct NotTrackedReport {
    /// Code, see [`Loss::code`].
    pub code: &'static str,
    /// The reason as a sentence.
    pub text: String,
}

/// A number for each axis of the camera.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AxesReport {
    /// About the image's x axis.
    pub x: Option<f64>,
    /// About the image's y axis.
    pub y: Option<f64>,
    /// About the boresight.
    pub z: Option<f64>,
}

/// The refined camera.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrackOpticsReport {
    /// Focal length over pixel pitch.
    pub focal_length_px: f64,
    /// Its standard error, in pixels.
    pub focal_length_sigma_px: Option<f64>,
    /// Whether the image is a mirror image of the sky.
    pub mirrored: bool,
    /// Distortion, if there is one.
    pub distortion: Option<DistortionReport>,
}

/// Run times, in milliseconds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrackTimingReport {
    /// Reading, decoding and calibrating.
    pub read: f64,
    /// Tracking, or the full solution.
    pub track: f64,
    /// All of it.
    pub total: f64,
}

impl TrackReport {
    /// The report of `track`; `frame` is the name of the frame, and `read_ms` and `track_ms` are the
    /// times that reading and tracking took.
    pub fn new(frame: &str, track: &Track, [read_ms, track_ms]: [f64; 2]) -> Self {
        let lost = track.solution.as_ref().filter(|_| track.attitude.is_none());
        let reason = lost.and_then(|solution| match &solution.outcome {
            Outcome::NotIdentified(reason) => Some((reason::text(reason, solution), reason.code())),
            Outcome::Identified(_) => None,
        });
        let (reason, reason_code) = reason.unzip();
        let rate = |is_per_frame: bool| {
            let rate = track.rate.filter(|rate| rate.is_per_frame == is_per_frame);
            rate.map(|rate: AngularRate| {
                (axes(&rate.rad, rate_digits), axes(&rate.sigma_rad, sigma))
            })
        };
        let (rate_deg_s, rate_sigma_deg_s) = rate(false).unzip();
        let (rate_deg_frame, rate_sigma_deg_frame) = rate(true).unzip();
        let camera = track.camera.as_ref();
        let at = camera.map_or("centre", |(camera, _)| build::boresight_of(camera));
        Self {
            schema: SCHEMA,
            frame: frame.to_owned(),
            time_s: track.time_s.map(|time_s| to_decimals(time_s, 6)),
            mode: track.mode.code(),
            reason,
            reason_code,
            not_tracked: track.loss.as_ref().map(not_tracked),
            attitude: track
                .attitude
                .as_ref()
                .map(|found| attitude(track, found, at)),
            rate_deg_s,
            rate_sigma_deg_s,
            rate_deg_frame,
            rate_sigma_deg_frame,
            stars_used: track.stars_used,
            log10_false_alarm: track.log10_false_alarm.and_then(|log10| finite(log10, 2)),
            optics: track
                .camera
                .as_ref()
                .map(|(camera, sigma_px)| optics(camera, *sigma_px)),
            timing_ms: TrackTimingReport {
                read: to_decimals(read_ms, 3),
                track: to_decimals(track_ms, 3),
                total: to_decimals(read_ms + track_ms, 3),
            },
        }
    }

    /// Whether the frame has an attitude.
    pub fn has_attitude(&self) -> bool {
        self.attitude.is_some()
    }

    /// The report as one line of JSON.
    ///
    /// # Errors
    /// None for reports that [`new`](Self::new) made.
    pub fn to_json_line(&self) -> io::Result<String> {
        Ok(json_escaped(serde_json::to_string(self)?))
    }

    /// The report as one line for people.
    pub fn to_text(&self) -> String {
        let Self { frame, mode, .. } = self;
        let Some(attitude) = &self.attitude else {
            let reason = self.reason.as_deref().unwrap_or("no attitude");
            return format!("{frame}: {mode}: {reason}\n");
        };
        let sigma = &attitude.sigma_arcsec;
        let per_second = self.rate_deg_s.as_ref().map(|rate| (rate, "s"));
        let rate = per_second.or(self.rate_deg_frame.as_ref().map(|rate| (rate, "frame")));
        let rate = rate.map_or(String::new(), |(rate, unit)| {
            let of = |axis: Option<f64>| axis.unwrap_or(0.0);
            let [x, y, z] = [of(rate.x), of(rate.y), of(rate.z)];
            format!(", rate {x:+.4} {y:+.4} {z:+.4} °/{unit}")
        });
        format!(
            "{frame}: {mode}: RA {:.5}°, Dec {:+.5}°, up {:.4}°; errors {}″ {}″, roll {}″; {} stars{rate}\n",
            attitude.ra_deg,
            attitude.dec_deg,
            attitude.up_pa_deg,
            sigma.x,
            sigma.y,
            sigma.roll,
            self.stars_used,
        )
    }
}

fn not_tracked(loss: &Loss) -> NotTrackedReport {
    let text = match loss {
        Loss::NoAttitude => "there is no earlier attitude".to_owned(),
        Loss::NoRate => {
            "there is only one earlier attitude, so the angular rate is unknown".to_owned()
        }
        Loss::OtherSize => "the size of the frame differs from that of the previous one".to_owned(),
        Loss::NotLater => "the time of the frame is not after that of the previous one".to_owned(),
        Loss::TooUncertain { radius_px } => {
            format!("the predicted positions of the stars are uncertain by {radius_px:.0} px")
        }
        Loss::TooFewStars { predicted } => {
            format!("only {predicted} isolated stars are in the predicted field")
        }
        Loss::NoAgreement {
            predicted,
            agreeing,
            log10_false_alarm,
        } => format!(
            "{agreeing} of {predicted} predicted stars agree with one attitude, with a false-alarm \
             probability of 10^{log10_false_alarm:.1}"
        ),
    };
    NotTrackedReport {
        code: loss.code(),
        text,
    }
}

fn attitude(track: &Track, found: &Attitude, at: &'static str) -> AttitudeReport {
    let seen = track
        .places
        .attitude(&found.icrs_to_camera, track.attitude_frame);
    build::attitude(&seen, &found.covariance_rad2, (at, track.attitude_frame))
}

fn optics(camera: &CameraModel, focal_sigma_px: f64) -> TrackOpticsReport {
    TrackOpticsReport {
        focal_length_px: to_decimals(camera.central_focal_length_px(), PIXEL_DECIMALS),
        focal_length_sigma_px: finite(focal_sigma_px, PIXEL_DECIMALS),
        mirrored: camera.mirrored,
        distortion: build::distortion(camera),
    }
}

fn rate_digits(rate: f64) -> Option<f64> {
    finite(rate, 7)
}

fn sigma(sigma: f64) -> Option<f64> {
    significant(sigma, SIGMA_DIGITS)
}

fn axes(rad: &Vector3<f64>, digits: impl Fn(f64) -> Option<f64>) -> AxesReport {
    let deg = rad * DEG_PER_RAD;
    AxesReport {
        x: digits(deg.x),
        y: digits(deg.y),
        z: digits(deg.z),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::coords::{Rotation, UnitVector};
    use crate::ephemeris::places::{AttitudeFrame, StarPlaces};
    use crate::track::Mode;
    use nalgebra::Matrix3;

    fn track() -> Track {
        Track {
            mode: Mode::Tracked,
            time_s: Some(0.5),
            places: StarPlaces::default(),
            attitude_frame: AttitudeFrame::default(),
            attitude: Some(Attitude {
                icrs_to_camera: Rotation::looking_at(&UnitVector::from_ra_dec(1.0, 0.5), 0.3),
                covariance_rad2: Matrix3::from_diagonal(&Vector3::new(1e-10, 4e-10, 9e-8)),
            }),
            rate: Some(AngularRate {
                rad: Vector3::new(0.01, -0.02, 0.0),
                sigma_rad: Vector3::repeat(1e-5),
                is_per_frame: false,
            }),
            stars_used: 30,
            log10_false_alarm: Some(-60.0),
            camera: Some((CameraModel::pinhole(640.0, 480.0, 1800.0, false), 0.02)),
            loss: None,
            solution: None,
        }
    }

    #[test]
    fn fields_are_in_their_units() {
        let json = TrackReport::new("a.tif", &track(), [1.0, 0.05]).to_json_line();
        let json: serde_json::Value = serde_json::from_str(&json.unwrap()).unwrap();
        assert_eq!(json["mode"], "tracked");
        assert_eq!(json["attitude"]["sigma_arcsec"]["x"], 2.063);
        assert_eq!(json["attitude"]["covariance_arcsec2"][0][0], 4.255);
        assert_eq!(json["rate_deg_s"]["x"], 0.5729578);
        assert!(json["rate_deg_frame"].is_null() && json["reason"].is_null());
        assert_eq!(json["timing_ms"]["total"], 1.05);
    }

    #[test]
    fn rates_are_per_frame_where_times_are_not_known() {
        let mut track = track();
        track.time_s = None;
        if let Some(rate) = &mut track.rate {
            rate.is_per_frame = true;
        }
        let report = TrackReport::new("a.tif", &track, [0.0; 2]);
        assert!(report.rate_deg_s.is_none() && report.rate_deg_frame.is_some());
        assert!(report.to_text().contains("°/frame"), "{}", report.to_text());
    }
}
