//! Compares a solved frame with the stated camera.

use super::context::Context;
use super::solution::{Background, Outcome};
use crate::base::statistics::Estimate;
use crate::base::units::DEG_PER_RAD;
use crate::frame::Frame;
use crate::identify::{Identification, Priors, View};
use crate::photometry::FramePhotometry;
use crate::photometry::comparison::{Comparison, FrameMeasurement, StatedCamera, compare};
use crate::sky::observer::Observation;

/// What is known of a frame after photometry.
pub(super) struct Solved<'a> {
    pub context: &'a Context<'a>,
    pub frame: &'a Frame,
    pub priors: &'a Priors,
    pub background: Background,
    pub spot_sigma_px: f64,
    pub outcome: &'a Outcome,
    pub photometry: Option<&'a FramePhotometry>,
    pub observation: Option<&'a Observation>,
}

impl Solved<'_> {
    /// The comparison with `camera`; `None` where the exposure is unknown.
    pub(super) fn compare_with(&self, camera: &StatedCamera) -> Option<Comparison> {
        let photometry = self.photometry;
        let zero_point = photometry.and_then(|measured| measured.zero_point.as_ref());
        let limit = photometry.and_then(|measured| measured.completeness.limit.as_ref().ok());
        let found = self.outcome.identification();
        let field_vmag = found.map_or(Vec::new(), |found| self.field_vmag(found));
        let frame = FrameMeasurement {
            detect: self.context.detect.clone(),
            size_px: [self.frame.width, self.frame.height],
            exposure_s: self.priors.exposure_s,
            level_adu: self.background.level_adu,
            noise_adu: self.background.noise_adu,
            spot_sigma_px: found.map(|_| self.spot_sigma_px),
            pixel_scale_rad: found.map(|found| 1.0 / found.camera.focal_length_px),
            zenith_distance_deg: self.observation.map(zenith_distance_deg),
            header_zenith_distance_deg: self.frame.metadata.zenith_distance_deg,
            zero_point_vmag: zero_point.map(|zero| Estimate {
                value: zero.v_mag,
                sigma: zero.sigma_mag,
            }),
            zero_point_colors_mag: photometry
                .map_or(&[], |measured| &measured.zero_point_colors_mag),
            has_color_term: zero_point.is_some_and(|zero| zero.color_term.is_some()),
            limit_vmag: limit.map(|limit| Estimate {
                value: limit.v_mag,
                sigma: limit.sigma_mag,
            }),
            faintest_vmag: found.and_then(|found| self.faintest_vmag(found)),
            field_vmag: &field_vmag,
        };
        compare(camera, &frame)
    }

    /// V magnitude of the faintest identified star.
    fn faintest_vmag(&self, found: &Identification) -> Option<f64> {
        let catalog = self.context.sky.catalog();
        let v_mag = found.matches.iter().map(|m| catalog.star(m.star).v_mag);
        v_mag.map(f64::from).reduce(f64::max)
    }

    /// V magnitudes of all catalogue stars in the frame.
    fn field_vmag(&self, found: &Identification) -> Vec<f64> {
        let view = View {
            camera: &found.camera,
            icrs_to_camera: &found.icrs_to_camera,
            years_since_j2000: self.priors.years_since_j2000(),
        };
        let sky = self.context.sky;
        let stars = view.stars_to(sky, sky.faintest_v_mag());
        let inside = stars
            .iter()
            .filter(|star| found.camera.contains(&star.pixel));
        inside.map(|star| f64::from(star.v_mag)).collect()
    }
}

/// Zenith distance of the frame's centre, in degrees: apparent above the horizon, true below it.
fn zenith_distance_deg(observation: &Observation) -> f64 {
    let apparent = observation.apparent.as_ref();
    let zenith_rad = apparent.map_or(observation.zenith_distance_rad, |a| a.zenith_distance_rad);
    zenith_rad * DEG_PER_RAD
}
