//! What of a table lies in a region of the sky, by coordinates in degrees.

use crate::base::coords::UnitVector;
use crate::base::units::{DEG_PER_RAD, RAD_PER_DEG};
use crate::catalog::deep::region::Region;
use std::ops::RangeInclusive;

/// Positions of other epochs are this near to those of J2000.
pub(super) const MOTION_DEG: f64 = 0.1;

/// A region and what moves into it, in degrees.
pub(super) struct Reach {
    region: Region,
    ra_deg: f64,
    dec_deg: f64,
    radius_deg: f64,
    /// Right ascensions differ by no more from that of the centre.
    half_width_deg: f64,
}

/// The least and the greatest of some numbers, where they are known.
pub(super) type Extent = Option<[f64; 2]>;

impl Reach {
    pub(super) fn of(region: &Region) -> Self {
        let radius_rad = region.radius_rad + MOTION_DEG * RAD_PER_DEG;
        let (ra_rad, dec_rad) = region.centre.to_ra_dec();
        let (ra_deg, dec_deg) = (ra_rad * DEG_PER_RAD, dec_rad * DEG_PER_RAD);
        let radius_deg = radius_rad * DEG_PER_RAD;
        let has_pole = dec_deg.abs() + radius_deg >= 89.9;
        let half_width_deg = match has_pole {
            true => 180.0,
            // The widest point of a circle: sin Δα = sin r / cos δ.
            false => {
                let sine = libm::sin(radius_rad) / libm::cos(dec_rad);
                libm::asin(sine.clamp(0.0, 1.0)) * DEG_PER_RAD + 1e-6
            }
        };
        Self {
            region: Region {
                radius_rad,
                ..*region
            },
            ra_deg,
            dec_deg,
            radius_deg,
            half_width_deg,
        }
    }

    /// Whether rows with coordinates in these ranges may lie in it.
    pub(super) fn may_meet(&self, ra: Extent, dec: Extent) -> bool {
        let dec_meets = dec.is_none_or(|[least, greatest]| {
            least <= self.dec_deg + self.radius_deg && greatest >= self.dec_deg - self.radius_deg
        });
        let ra_meets = ra.is_none_or(|[least, greatest]| {
            // Right ascensions may be counted from -180 degrees.
            self.half_width_deg >= 180.0
                || [-360.0, 0.0, 360.0].iter().any(|turn| {
                    let centre = self.ra_deg + turn;
                    least <= centre + self.half_width_deg
                        && greatest >= centre - self.half_width_deg
                })
        });
        dec_meets && ra_meets
    }

    /// Whether a position may lie in it, or is none on the sky.
    pub(super) fn may_have(&self, ra_deg: f64, dec_deg: f64) -> bool {
        const DECLINATIONS: RangeInclusive<f64> = -90.0..=90.0;
        const RIGHT_ASCENSIONS: RangeInclusive<f64> = -180.0..=360.0;
        if !DECLINATIONS.contains(&dec_deg) || !RIGHT_ASCENSIONS.contains(&ra_deg) {
            return true;
        }
        if (dec_deg - self.dec_deg).abs() > self.radius_deg {
            return false;
        }
        let direction = UnitVector::from_ra_dec(ra_deg * RAD_PER_DEG, dec_deg * RAD_PER_DEG);
        self.region.contains(&direction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reach(ra_deg: f64, dec_deg: f64, radius_deg: f64) -> Reach {
        Reach::of(&Region {
            centre: UnitVector::from_ra_dec(ra_deg * RAD_PER_DEG, dec_deg * RAD_PER_DEG),
            radius_rad: radius_deg * RAD_PER_DEG,
            per_sq_deg: 1.0,
        })
    }

    #[test]
    fn ranges_across_the_equinox_and_at_a_pole_are_met() {
        let near = reach(359.5, 0.0, 1.0);
        assert!(near.may_meet(Some([0.0, 0.3]), Some([0.0, 0.1])));
        assert!(near.may_meet(Some([358.7, 358.8]), None));
        assert!(near.may_meet(Some([-1.0, -0.9]), None));
        assert!(!near.may_meet(Some([1.0, 358.0]), None));
        assert!(!near.may_meet(Some([0.0, 0.3]), Some([1.2, 3.0])));
        assert!(near.may_meet(None, None));
        let polar = reach(10.0, 89.5, 1.0);
        assert!(polar.may_meet(Some([200.0, 201.0]), Some([89.0, 89.9])));
        assert!(!polar.may_meet(Some([200.0, 201.0]), Some([87.0, 88.0])));
        let whole = Reach::of(&Region::WHOLE_SKY);
        assert!(whole.may_meet(Some([200.0, 201.0]), Some([-87.0, -86.0])));
    }

    #[test]
    fn no_position_in_the_region_is_left_out() {
        for (ra_deg, dec_deg, radius_deg) in
            [(0.1, 60.0, 5.0), (200.0, -84.9, 4.0), (90.0, 2.0, 30.0)]
        {
            let reach = reach(ra_deg, dec_deg, radius_deg);
            let mut inside = 0;
            for number in 0..40_000 {
                let (ra, dec) = (
                    f64::from(number % 200) * 1.8,
                    f64::from(number / 200) * 0.9 - 90.0,
                );
                let direction = UnitVector::from_ra_dec(ra * RAD_PER_DEG, dec * RAD_PER_DEG);
                if reach.region.contains(&direction) {
                    inside += 1;
                    assert!(reach.may_have(ra, dec));
                    assert!(
                        reach.may_meet(Some([ra, ra]), Some([dec, dec])),
                        "{ra} {dec}"
                    );
                } else {
                    assert!(!reach.may_have(ra, dec));
                }
            }
            assert!(inside > 10, "{inside}");
        }
        assert!(reach(0.0, 0.0, 1.0).may_have(50.0, 91.0));
    }
}
