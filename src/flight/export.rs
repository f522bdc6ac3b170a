//! A catalogue as the flight library reads it.

use crate::catalog::{Catalog, Star, StarId};
use starpipe_flight::build::{self, BuildError, Plan};

/// Epoch of the directions.
const EPOCH_YEAR: f64 = 2000.0;

/// The stars of a catalogue to a V magnitude, and their triangles, within `budget_bytes`, for fields of view from
/// `fov_deg[0]` to `fov_deg[1]`.
///
/// # Errors
/// The fields are out of range, the stars are too many or too few, or the budget is too small.
pub fn export(
    catalog: &Catalog,
    fov_deg: [f64; 2],
    v_limit: f64,
    budget_bytes: usize,
) -> Result<Vec<u8>, BuildError> {
    let plan = Plan {
        fov_deg,
        v_limit,
        epoch_year: EPOCH_YEAR,
        budget_bytes,
    };
    let stars = catalog.stars().iter().enumerate();
    let stars: Vec<starpipe_flight::Star> = stars.map(|(index, star)| flown(index, star)).collect();
    build::catalog(&stars, &plan)
}

/// A star as the flight library has it. Its number is that of its identifier where that is a number of 32 bits, else its
/// place in the catalogue.
pub(super) fn flown(index: usize, star: &Star) -> starpipe_flight::Star {
    let number = match star.id {
        StarId::Skymap(number) => Some(number),
        StarId::Number(number) => u32::try_from(number).ok(),
        _ => None,
    };
    starpipe_flight::Star {
        direction: *star.direction.as_vector(),
        motion_mas: [star.pm_ra_mas_per_yr, star.pm_dec_mas_per_yr].map(|mas| mas.round() as i16),
        v_mag: f64::from(star.v_mag),
        id: number.unwrap_or(index as u32),
    }
}
