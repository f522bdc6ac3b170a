//! A frame that is found, against the camera that it is said to be of.

use super::{Background, Knowledge};
use crate::base::statistics::Estimate;
use crate::base::units::DEG_PER_RAD;
use crate::detect::DetectConfig;
use crate::frame::Frame;
use crate::identify::{Identification, IndexedCatalog, Outcome, View};
use crate::photometry::FramePhotometry;
use crate::photometry::comparison::{self, Comparison, Description, Seen};
use crate::sky::observer::Observation;

/// What was found of a frame.
pub(super) struct Found<'a> {
    pub detect: &'a DetectConfig,
    pub size_px: [usize; 2],
    pub background: &'a Background,
    pub spot_sigma_px: f64,
    pub outcome: &'a Outcome,
    pub photometry: Option<&'a FramePhotometry>,
    pub observation: Option<&'a Observation>,
    pub header_zenith_distance_deg: Option<f64>,
    pub sky: &'a IndexedCatalog<'a>,
}

/// The level from which on the camera's pixels are full, where the frame's levels can be the camera's: files may hold those of
/// few bits multiplied.
pub(super) fn saturation_adu(description: &Description, frame: &Frame) -> Option<f64> {
    let sensor = &description.sensor;
    let full_scale_adu = sensor.full_scale_adu() as f32;
    let is_beyond = |pixel: &f32| *pixel > full_scale_adu;
    (!frame.pixels.iter().any(is_beyond)).then(|| sensor.saturation_adu())
}

/// What to say of a frame beside its camera: contradictions, or why it was not held against it.
pub(super) fn notes(
    description: Option<&Description>,
    comparison: Option<&Comparison>,
) -> Vec<String> {
    match (description, comparison) {
        (_, Some(held)) => held.contradictions.clone(),
        (Some(_), None) => {
            vec!["the exposure is not known, and so nothing is predicted of the camera".to_owned()]
        }
        (None, None) => Vec::new(),
    }
}

impl Found<'_> {
    /// Holds it against `description`; nothing comes of it where the exposure is not known.
    pub(super) fn against(
        &self,
        description: &Description,
        knowledge: &Knowledge,
    ) -> Option<Comparison> {
        let photometry = self.photometry;
        let zero_point = photometry.and_then(|measured| measured.zero_point.as_ref());
        let limit = photometry.and_then(|measured| measured.completeness.limit.as_ref().ok());
        let identification = match self.outcome {
            Outcome::Identified(found) => Some(found),
            Outcome::NotIdentified(_) => None,
        };
        let v_mag = |catalog: usize| f64::from(self.sky.stars()[catalog].v_mag);
        let matched = identification.map(|found| found.matches.iter().map(|m| v_mag(m.catalog)));
        let zenith_deg = self.observation.map(|seen| {
            let apparent = seen.apparent.as_ref();
            let zenith_rad = apparent.map_or(seen.zenith_distance_rad, |a| a.zenith_distance_rad);
            zenith_rad * DEG_PER_RAD
        });
        let field_vmag =
            identification.map_or(Vec::new(), |found| self.field_vmag(found, knowledge));
        comparison::compare(
            description,
            &Seen {
                detect: self.detect.clone(),
                size_px: self.size_px,
                exposure_s: knowledge.exposure_s,
                level_adu: self.background.level_adu,
                noise_adu: self.background.noise_adu,
                spot_sigma_px: identification.map(|_| self.spot_sigma_px),
                pixel_scale_rad: identification.map(|found| 1.0 / found.camera.focal_length_px),
                zenith_distance_deg: zenith_deg,
                header_zenith_distance_deg: self.header_zenith_distance_deg,
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
                faintest_vmag: matched.and_then(|matched| matched.reduce(f64::max)),
                field_vmag: &field_vmag,
            },
        )
    }

    /// The V magnitudes of all of the catalogue's stars in the frame.
    fn field_vmag(&self, found: &Identification, knowledge: &Knowledge) -> Vec<f64> {
        let view = View {
            camera: &found.camera,
            icrs_to_camera: &found.icrs_to_camera,
            years_since_j2000: knowledge.years_since_j2000(),
        };
        let stars = view.stars_to(self.sky, self.sky.faintest_v_mag());
        let inside = stars
            .iter()
            .filter(|star| found.camera.contains(&star.pixel));
        inside.map(|star| f64::from(star.v_mag)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::data_sheet::Preset;

    #[test]
    fn a_cameras_full_pixel_counts_where_the_levels_are_its_own() {
        let description = Description {
            sensor: Preset::Experiment1.sensor(),
            zenith_distance_deg: None,
            extinction: None,
        };
        let frame = |highest: f32| Frame::new(3, 3, vec![highest; 9]).unwrap();
        let full_adu = description.sensor.saturation_adu();
        assert!(full_adu < 4095.0);
        assert_eq!(saturation_adu(&description, &frame(4095.0)), Some(full_adu));
        // Twelve bits at the upper end of sixteen.
        assert_eq!(saturation_adu(&description, &frame(4096.0)), None);
    }
}
