//! What is known of a frame beforehand: by options, by its file's header, by its name.

use crate::base::coords::{Icrs, UnitVector};
use crate::base::epoch::ObservationDate;
use crate::base::units::{ARCSEC_PER_RAD, DEG_PER_RAD, RAD_PER_DEG};
use crate::camera;
use crate::camera::data_sheet::Sensor;
use crate::frame::FrameMetadata;
use crate::identify::{Hints, Outcome, StarField};
use crate::sky::observer::{Observation, Site};
use serde::Serialize;

/// What is known of the camera's scale beforehand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScaleHint {
    /// The scale.
    pub scale: Scale,
    /// By which fraction the true scale may be larger or smaller, in (0, 1).
    pub tolerance: f64,
}

/// A camera's scale, in one of the two ways in which people know it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scale {
    /// Horizontal field of view, in radians.
    FieldOfView(f64),
    /// Angle that a pixel at the frame's centre spans, in radians.
    Pixel(f64),
}

impl ScaleHint {
    /// The scale of a camera as it is described.
    pub fn of_camera(sensor: &Sensor) -> Self {
        Self {
            scale: Scale::Pixel(sensor.pixel_scale_rad()),
            tolerance: DESCRIBED_SCALE_TOLERANCE,
        }
    }

    /// Smallest and largest pixel scale at the centre of a frame of this width, in radians.
    pub fn pixel_scale_rad(&self, width_px: f64) -> (f64, f64) {
        let pixel_rad = |scale: f64| match self.scale {
            Scale::FieldOfView(fov_rad) => {
                // Beyond a half turn there is no pinhole camera left to speak of.
                let fov_rad = (fov_rad * scale).min(MAX_FOV_RAD);
                1.0 / camera::focal_length_px(width_px, fov_rad)
            }
            Scale::Pixel(pixel_rad) => pixel_rad * scale,
        };
        (
            pixel_rad(1.0 - self.tolerance),
            pixel_rad(1.0 + self.tolerance),
        )
    }
}

/// The widest field of view of a pinhole camera that still has a scale.
const MAX_FOV_RAD: f64 = 179.0 * RAD_PER_DEG;

/// What is known of a frame beforehand; by default nothing.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Knowledge {
    /// The camera's scale.
    pub scale: Option<ScaleHint>,
    /// The boresight lies within so many radians of this direction.
    pub near: Option<(UnitVector<Icrs>, f64)>,
    /// When the frame was taken.
    pub date: Option<FrameDate>,
    /// Where it was taken.
    pub site: Option<Site>,
    /// How long it was exposed, in seconds.
    pub exposure_s: Option<f64>,
}

/// When a frame was taken, and who says so.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameDate {
    /// The date.
    pub date: ObservationDate,
    /// Where it is from.
    pub source: DateSource,
}

/// Where a frame's date is from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum DateSource {
    /// It was given beforehand.
    #[serde(rename = "option")]
    Option,
    /// From the header of the frame's file.
    #[serde(rename = "file header")]
    FileHeader,
    /// From the name of the frame's file.
    #[serde(rename = "file name")]
    FileName,
}

impl Knowledge {
    /// The same with a site, where none is known.
    pub(super) fn or_site(self, site: Option<Site>) -> Self {
        Self {
            site: self.site.or(site),
            ..self
        }
    }

    /// The same with an exposure, where none is known.
    pub(super) fn or_exposure(self, exposure_s: Option<f64>) -> Self {
        Self {
            exposure_s: self.exposure_s.or(exposure_s),
            ..self
        }
    }

    /// The same as identification takes it, for a frame of this width.
    pub fn hints(&self, width_px: f64) -> Hints {
        Hints {
            pixel_scale_rad: self.scale.map(|hint| hint.pixel_scale_rad(width_px)),
            near: self.near,
        }
    }

    /// Julian years from J2000.0 to the frame's date; 0 where that is not known.
    pub(super) fn years_since_j2000(&self) -> f64 {
        self.date
            .map_or(0.0, |known| known.date.years_since_j2000())
    }

    /// Where in the sky the centre of an identified frame stood, where that is known.
    pub(super) fn observation(&self, outcome: &Outcome) -> Option<Observation> {
        let Outcome::Identified(found) = outcome else {
            return None;
        };
        let (boresight, _) = found.icrs_to_camera.boresight_and_up();
        Observation::new(self.site?, &self.date?.date, &boresight)
    }

    /// What is odd about the site and the date of a frame, or is lacking for an observation.
    pub(super) fn odd_observation(
        &self,
        outcome: &Outcome,
        observation: Option<&Observation>,
    ) -> Option<String> {
        match (outcome, observation) {
            (_, Some(observation)) => below_horizon(observation),
            (Outcome::Identified(_), None) if self.site.is_some() => Some(
                "the time of day is not known, and so the site gives no zenith distance".to_owned(),
            ),
            _ => None,
        }
    }

    /// The same with `date`, where none is known.
    pub(super) fn or_date(self, date: Option<ObservationDate>, source: DateSource) -> Self {
        let other = date.map(|date| FrameDate { date, source });
        Self {
            date: self.date.or(other),
            ..self
        }
    }
}

/// How far the scale that a file's header or a camera's description gives may be off: focal lengths are nominal. A reducer or
/// a binning that it does not know is off by more.
const DESCRIBED_SCALE_TOLERANCE: f64 = 0.2;

/// The scale that a file's header gives.
pub(super) fn header_scale(metadata: &FrameMetadata) -> Option<ScaleHint> {
    Some(ScaleHint {
        scale: Scale::Pixel(metadata.pixel_scale_rad()?),
        tolerance: DESCRIBED_SCALE_TOLERANCE,
    })
}

/// What to say of a `hint` from the header that is not the scale of `field`.
pub(super) fn wrong_header(hint: &ScaleHint, field: &StarField) -> String {
    let (low_rad, high_rad) = hint.pixel_scale_rad(field.width_px);
    let [low, high] = [low_rad, high_rad].map(|rad| rad * ARCSEC_PER_RAD);
    format!(
        "the header's focal length and pixel size are not this frame's: they mean {low:.1}″ to {high:.1}″ a pixel"
    )
}

/// What to say of a frame of what cannot have been seen.
fn below_horizon(observation: &Observation) -> Option<String> {
    let depth_deg = observation.zenith_distance_rad * DEG_PER_RAD - 90.0;
    observation.apparent.is_none().then(|| {
        format!(
            "the site, the date and the attitude contradict each other: the frame's centre stands {depth_deg:.1}° below the horizon"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::units::RAD_PER_ARCSEC;

    #[test]
    fn a_field_of_view_and_its_pixel_scale_are_the_same_hint() {
        let width_px = 1000.0;
        let (low, high) = ScaleHint {
            scale: Scale::FieldOfView(10.0 * RAD_PER_DEG),
            tolerance: 0.1,
        }
        .pixel_scale_rad(width_px);
        let expected = |fov_deg: f64| 2.0 * (fov_deg / 2.0 * RAD_PER_DEG).tan() / width_px;
        assert!((low - expected(9.0)).abs() < 1e-12);
        assert!((high - expected(11.0)).abs() < 1e-12);
    }

    #[test]
    fn a_pixel_scale_widens_by_its_tolerance() {
        let hint = ScaleHint {
            scale: Scale::Pixel(10.0 * RAD_PER_ARCSEC),
            tolerance: 0.2,
        };
        let (low, high) = hint.pixel_scale_rad(123.0);
        assert!((low / RAD_PER_ARCSEC - 8.0).abs() < 1e-9);
        assert!((high / RAD_PER_ARCSEC - 12.0).abs() < 1e-9);
    }

    #[test]
    fn no_field_of_view_is_so_wide_that_its_scale_is_not_a_number() {
        let hint = ScaleHint {
            scale: Scale::FieldOfView(170.0 * RAD_PER_DEG),
            tolerance: 0.5,
        };
        let (low, high) = hint.pixel_scale_rad(500.0);
        assert!(low > 0.0 && high > low && high.is_finite());
    }
}
