//! Identifiers of stars that have only a place.

use crate::base::coords::{Icrs, UnitVector};
use std::f64::consts::{PI, TAU};
use std::fmt;

/// The place of a star, truncated to 0.01 s of right ascension and 0.1″ of declination, as in
/// `J053516.47-052323.1`.
///
/// # Reference
/// Designations by position: IAU Commission 5, Specifications concerning designations for astronomical
/// radiation sources outside the solar system.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PlaceId(u64);

/// Steps of right ascension in a turn, and of declination from pole to pole.
const RA_STEPS: u64 = 24 * 3600 * 100;
const DEC_STEPS: u64 = 180 * 3600 * 10;

impl PlaceId {
    /// The place of a star at J2000.
    pub fn of(direction: &UnitVector<Icrs>) -> Self {
        let (ra_rad, dec_rad) = direction.to_ra_dec();
        let ra = ((ra_rad / TAU * RA_STEPS as f64) as u64).min(RA_STEPS - 1);
        // Declinations are truncated towards the equator.
        let from_equator = (dec_rad / PI * DEC_STEPS as f64).trunc() as i64;
        let dec = (from_equator + DEC_STEPS as i64 / 2).cast_unsigned();
        Self(ra << 32 | dec.min(DEC_STEPS))
    }

    /// The number of the compact form.
    pub(super) const fn packed(self) -> u64 {
        self.0
    }

    /// The inverse of [`packed`](Self::packed); `None` out of range.
    pub(super) fn from_packed(packed: u64) -> Option<Self> {
        let (ra, dec) = (packed >> 32, packed & u64::from(u32::MAX));
        (ra < RA_STEPS && dec <= DEC_STEPS).then_some(Self(packed))
    }

    /// Parses a place as it is printed.
    pub(super) fn parse(text: &str) -> Option<Self> {
        let text = text.strip_prefix('J').filter(|text| text.is_ascii())?;
        let (ra, dec) = text.split_at_checked(9)?;
        let from_equator = dec.strip_prefix(['+', '-'])?;
        let dec_steps = i64::try_from(steps(from_equator, 1)?).ok()?;
        let sign = if dec.starts_with('-') { -1 } else { 1 };
        let dec = DEC_STEPS as i64 / 2 + sign * dec_steps;
        Self::from_packed(steps(ra, 2)? << 32 | u64::try_from(dec).ok()?)
    }
}

/// The number of steps in `hhmmss.ss` or `ddmmss.s`, with so many digits after the point.
fn steps(text: &str, decimals: usize) -> Option<u64> {
    let (whole, parts) = text.split_once('.')?;
    if whole.len() != 6 || parts.len() != decimals {
        return None;
    }
    let number = |text: &str| {
        let is_number = text.bytes().all(|digit| digit.is_ascii_digit());
        is_number.then(|| text.parse::<u64>().ok())?
    };
    let [large, minutes, seconds] = [&whole[..2], &whole[2..4], &whole[4..]].map(number);
    let seconds = (large? * 60 + minutes?) * 60 + seconds?;
    Some(seconds * 10u64.pow(decimals as u32) + number(parts)?)
}

impl fmt::Display for PlaceId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (ra, dec) = (self.0 >> 32, self.0 & u64::from(u32::MAX));
        let [hours, minutes, seconds] = [ra / 360_000, ra / 6000 % 60, ra / 100 % 60];
        let sign = if dec < DEC_STEPS / 2 { '-' } else { '+' };
        let from_equator = dec.abs_diff(DEC_STEPS / 2);
        let [deg, min, sec] = [36_000, 600, 10].map(|steps| from_equator / steps);
        write!(
            f,
            "J{hours:02}{minutes:02}{seconds:02}.{:02}{sign}{deg:02}{:02}{:02}.{}",
            ra % 100,
            min % 60,
            sec % 60,
            from_equator % 10
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::units::RAD_PER_DEG;

    #[test]
    fn a_place_is_truncated_and_read_as_it_is_printed() {
        for (ra_deg, dec_deg, printed) in [
            (83.818_646, -5.389_775, "J053516.47-052323.1"),
            (0.0, 0.0, "J000000.00+000000.0"),
            (359.999_99, 89.999_99, "J235959.99+895959.9"),
            (10.000_01, -90.0, "J004000.00-900000.0"),
        ] {
            let direction = UnitVector::from_ra_dec(ra_deg * RAD_PER_DEG, dec_deg * RAD_PER_DEG);
            let id = PlaceId::of(&direction);
            assert_eq!(id.to_string(), printed);
            assert_eq!(PlaceId::parse(printed), Some(id));
            assert_eq!(PlaceId::from_packed(id.packed()), Some(id));
        }
        for wrong in [
            "J",
            "J053516.47",
            "J253516.47-052323.2",
            "J053516x47-052323.2",
            "J053516.47-952323.2",
            "J053516.47-052323.25",
            "J05 516.47-052323.2",
        ] {
            assert_eq!(PlaceId::parse(wrong), None, "{wrong}");
        }
    }
}
