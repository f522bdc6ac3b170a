//! Detects swapped coordinates, and hours read as degrees.

use crate::base::units::RAD_PER_DEG;
use crate::catalog::Star;
use crate::catalog::import::ImportTally;
use crate::catalog::position::EXPECTED_DEC;

/// Whether right ascension and declination are probably swapped.
pub(super) fn look_swapped(tally: &ImportTally) -> bool {
    let errors = &tally.summary.unreadable;
    let beyond_pole = errors.iter().filter(|error| error.expected == EXPECTED_DEC);
    let most = beyond_pole.count() * 2 > errors.len();
    // Within 90° of the equinox, as declinations are.
    let is_near_equinox = |star: &Star| star.direction.as_vector().x > -1e-9;
    most && tally.stars.iter().all(is_near_equinox)
}

/// Whether the right ascensions, read as degrees, are probably hours.
pub(super) fn look_like_hours(stars: &[Star]) -> bool {
    /// More stars than this, over such a range of declinations, do not all have right ascensions
    /// below 24° by chance.
    const STARS: usize = 50;
    const DEC_RANGE_DEG: f64 = 60.0;
    if stars.len() <= STARS {
        return false;
    }
    let (mut lowest, mut highest) = (f64::INFINITY, f64::NEG_INFINITY);
    for star in stars {
        let (ra_rad, dec_rad) = star.direction.to_ra_dec();
        if ra_rad > 24.0 * RAD_PER_DEG {
            return false;
        }
        (lowest, highest) = (lowest.min(dec_rad), highest.max(dec_rad));
    }
    highest - lowest > DEC_RANGE_DEG * RAD_PER_DEG
}
