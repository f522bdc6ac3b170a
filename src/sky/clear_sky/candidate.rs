//! The stars by which the clear sky may be measured.

use super::relation::{Unknowns, row_of};
use crate::base::coords::{Icrs, UnitVector};
use crate::photometry::MeasuredMagnitude;
use crate::sky::neighbor::neighbor;
use crate::sky::stars::SkyStar;

/// How much the extinction differs from one direction to another, in magnitudes per airmass: some percent
/// of it. Without it, low stars would count too much.
const AIR_SIGMA_MAG: f64 = 0.005;

/// A star by which it may be measured.
pub(super) struct ClearSkyStar {
    pub row: Unknowns,
    /// V magnitude less the instrumental one.
    pub offset_mag: f64,
    /// Standard error of that by its own flux.
    pub sigma_mag: f64,
    /// The same by the air in its direction.
    pub air_sigma_mag: f64,
    pub direction: UnitVector<Icrs>,
    /// The candidate next to it, as long as it is near: clouds dim both.
    pub neighbor: Option<usize>,
}

impl ClearSkyStar {
    /// Those among `stars`, of which V magnitudes are about `mean_vmag`.
    pub fn all_of(stars: &[SkyStar], mean_vmag: f64) -> Vec<Self> {
        let of = |star| Self::of(star, mean_vmag);
        let mut all: Vec<Self> = stars.iter().filter_map(of).collect();
        let places = all.iter().map(|star| (star.direction, star.sigma_mag));
        let places: Vec<_> = places.collect();
        for (one, candidate) in all.iter_mut().enumerate() {
            candidate.neighbor = neighbor(&places, one);
        }
        all
    }

    fn of(star: &SkyStar, mean_vmag: f64) -> Option<Self> {
        let MeasuredMagnitude {
            instrumental_mag,
            sigma_mag,
        } = star.measured?;
        Some(Self {
            row: Unknowns::from(row_of(
                star.airmass,
                star.off_axis_sq,
                star.bv_mag,
                star.v_mag - mean_vmag,
            )),
            offset_mag: star.v_mag - instrumental_mag,
            sigma_mag,
            air_sigma_mag: AIR_SIGMA_MAG * star.airmass.unwrap_or(0.0),
            direction: star.direction,
            neighbor: None,
        })
    }

    /// By how much it is brighter than a fit says.
    pub fn residual_mag(&self, unknowns: &Unknowns) -> f64 {
        self.offset_mag - unknowns.dot(&self.row)
    }

    /// Its standard error if it were as bright as the fit says.
    pub fn expected_sigma_mag(&self, unknowns: &Unknowns) -> f64 {
        let by_flux_mag = self.sigma_mag * libm::pow(10.0, 0.4 * self.residual_mag(unknowns));
        libm::hypot(by_flux_mag, self.air_sigma_mag)
    }

    /// Whether it counts, by the error that it would have.
    pub fn counts(&self, unknowns: &Unknowns, largest_mag: f64) -> bool {
        self.expected_sigma_mag(unknowns) < largest_mag
    }
}
