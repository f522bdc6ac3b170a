//! An identified frame, and what is known of places in it.

use super::place::PlaceErrors;
use crate::base::coords::PixelPoint;
use crate::base::units::DEG_PER_RAD;
use crate::catalog::Catalog;
use crate::identify::Identification;
use crate::solve::Solution;

/// An identified frame with what is known of places in it.
pub(super) struct View<'a> {
    pub solution: &'a Solution,
    pub found: &'a Identification,
    pub catalog: &'a Catalog,
    pub places: PlaceErrors,
    /// Angle across the frame, or the circle of its lens.
    pub field_deg: f64,
}

impl<'a> View<'a> {
    pub fn new(solution: &'a Solution, found: &'a Identification, catalog: &'a Catalog) -> Self {
        let across = [found.camera.fov_x_rad(), found.camera.fov_y_rad()];
        let widest = across.into_iter().flatten().fold(0.0, f64::max);
        let field_rad = if widest > 0.0 {
            widest
        } else {
            2.0 * found.camera.radius_rad()
        };
        Self {
            solution,
            found,
            catalog: solution.catalog(catalog),
            places: PlaceErrors::new(solution, found),
            field_deg: field_rad * DEG_PER_RAD,
        }
    }

    /// Whether the sky is seen at a place: nothing is in front of it, and the lens sees it.
    pub fn shows(&self, place: &PixelPoint) -> bool {
        let area = self.solution.sky_area.as_ref();
        self.found.camera.contains(place) && area.is_none_or(|area| area.shows(place))
    }

    /// The magnitude that a clear night shows at a glance in a field of this width: 7 at 5°, 4 at 60°, 3 in the
    /// whole sky. What is brighter is annotated, `fainter_mag` beyond it.
    pub fn limit_mag(&self, fainter_mag: f64) -> f64 {
        const AT_5_DEG: f64 = 7.0;
        /// 3 magnitudes from 5° to 60°.
        const PER_DECADE: f64 = 2.78;
        const LIMITS: [f64; 2] = [3.0, 9.0];
        let limit = AT_5_DEG - PER_DECADE * libm::log10(self.field_deg / 5.0);
        limit.clamp(LIMITS[0], LIMITS[1]) + fainter_mag
    }
}
