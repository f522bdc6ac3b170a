//! The stars that tell the zero point of a frame.
//!
//! They are chosen by V where nearly all are detected. A choice by flux would prefer stars that noise or color
//! makes brighter, and one by its error would lose the bright stars where the spots are not those of the model.

use super::association::FrameStar;
use super::completeness::Fall;
use super::identified_frame::IdentifiedFrame;
use super::measured::MeasuredMagnitude;
use super::zero_point::{MIN_STARS, NoZeroPoint, StandardStar};
use crate::detect::Detection;
use crate::identify::IndexedCatalog;

/// Stars of known magnitude with their fluxes.
pub(super) struct Standards {
    /// Those fit for a zero point, whether or not others as faint are detected.
    stars: Vec<StandardStar>,
    /// How many are detected in all.
    detected: usize,
}

impl Standards {
    /// Of the stars `clear` of a frame.
    pub fn select(clear: &[&FrameStar], frame: &IdentifiedFrame, sky: &IndexedCatalog) -> Self {
        let detection =
            |star: &&FrameStar| Some((**star, &frame.detections.sources[star.detection?]));
        let detected = clear
            .iter()
            .filter_map(|star| detection(star).filter(|(_, found)| found.flux_adu > 0.0));
        let camera = &frame.identification.camera;
        // Where the field of an all-sky lens ends, in units of the distance of the corners.
        let edge_sq = (camera.field_radius_px() / camera.radius_px()).powi(2);
        Self {
            detected: detected.clone().count(),
            stars: detected
                .filter_map(|(star, found)| standard_star(&star, found, frame, sky, edge_sq))
                .collect(),
        }
    }

    /// Those that are so bright that nearly all as bright are detected. Where they are too few, all, each
    /// without the light that it owes to being one of those detected.
    pub fn chosen(&self, fall: Option<&Fall>) -> Vec<StandardStar> {
        let Some(fall) = fall else {
            return self.stars.clone();
        };
        let is_complete = |star: &&StandardStar| fall.is_complete_at(star.v_mag);
        let complete: Vec<StandardStar> = self.stars.iter().filter(is_complete).copied().collect();
        if complete.len() >= MIN_STARS {
            return complete;
        }
        let unbiased = |star: &StandardStar| StandardStar {
            instrumental_mag: star.instrumental_mag
                + fall.brightening_mag(star.v_mag, star.sigma_mag),
            ..*star
        };
        self.stars.iter().map(unbiased).collect()
    }

    /// Why they make no zero point.
    pub fn lack(&self) -> NoZeroPoint {
        match (self.detected, self.stars.len()) {
            (detected, _) if detected < MIN_STARS => NoZeroPoint::FewDetected { detected },
            (detected, fit) => NoZeroPoint::FewFit { detected, fit },
        }
    }
}

/// `star` with its measured magnitude, if it is fit for the zero point. `edge_sq` is the distance from the
/// centre where the field ends, over that of the corners, squared.
fn standard_star(
    star: &FrameStar,
    detection: &Detection,
    frame: &IdentifiedFrame,
    sky: &IndexedCatalog,
    edge_sq: f64,
) -> Option<StandardStar> {
    /// Largest light of undetected neighbors that is subtracted, or added, over the star's own.
    const MAX_NEIGHBORS_LIGHT: f64 = 0.1;
    let known = sky.catalog().star(star.star);
    let is_alone = star.neighbors_light.abs() < MAX_NEIGHBORS_LIGHT;
    let is_fit =
        is_alone && detection.flags.has_clean_flux() && known.flags.is_constant_and_single();
    let camera = &frame.identification.camera;
    let measured = MeasuredMagnitude::of(frame, star, detection);
    is_fit.then(|| StandardStar {
        v_mag: star.v_mag,
        bv_mag: known.bv_mag.map(f64::from),
        instrumental_mag: measured.instrumental_mag,
        sigma_mag: measured.sigma_mag,
        off_centre_sq: camera.off_centre_sq(&detection.position) / edge_sq,
    })
}
