//! A catalogue star.

use super::StarId;
use crate::base::coords::{Icrs, UnitVector};
use crate::base::units::RAD_PER_ARCSEC;
use nalgebra::Vector3;

/// The epoch of all positions in a [`Catalog`](super::Catalog), as a Julian year.
pub(super) const J2000_YEAR: f64 = 2000.0;
/// The largest |V| and |B−V| that the compact form holds.
pub(super) const MAG_LIMIT: f32 = 32.0;
/// The fastest proper motion that the compact form holds, in mas a year.
pub(super) const PM_LIMIT_MAS_PER_YR: f32 = 32_767.0;

/// The index of a star in [`Catalog::stars`](super::Catalog::stars), brightest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct StarIndex(u32);

impl StarIndex {
    /// The star at `index`.
    ///
    /// # Panics
    /// If `index` is 2³² or more; no catalogue has as many stars.
    pub fn new(index: usize) -> Self {
        Self(u32::try_from(index).expect("a catalog has fewer than 2^32 stars"))
    }

    /// The index as a number.
    pub const fn get(self) -> usize {
        self.0 as usize
    }
}

impl From<u32> for StarIndex {
    fn from(index: u32) -> Self {
        Self(index)
    }
}

/// Caveats about a star: a set of flags.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct StarFlags(u8);

impl StarFlags {
    /// No flags.
    pub const NONE: Self = Self(0);
    /// The position is the joint position of two or more stars (SKY2000 `f_pos`).
    pub const BLENDED_POSITION: Self = Self(1);
    /// The V magnitude is the joint magnitude of two or more stars (SKY2000 `f_Vmag`).
    pub const BLENDED_MAGNITUDE: Self = Self(1 << 1);
    /// A double or multiple star with a measured separation (SKY2000 `sep`), or one of a pair of
    /// which Tycho-2 gives the photocentre.
    pub const MULTIPLE: Self = Self(1 << 2);
    /// A variable or suspected variable star (SKY2000 `varTyp` or `Vname`).
    pub const VARIABLE: Self = Self(1 << 3);
    /// The V magnitude is derived from other magnitudes (SKY2000 `Vder`, Tycho-2, Gaia).
    pub const DERIVED_MAGNITUDE: Self = Self(1 << 4);
    /// The proper motion is unknown, and zero here.
    pub const NO_PROPER_MOTION: Self = Self(1 << 5);

    /// The brightness of a variable star varies by at most 0.1 mag (SKY2000 `varAmp`, or `magMin` less
    /// `magMax`).
    pub const SMALL_AMPLITUDE: Self = Self(1 << 6);
    /// The companion of a double star is fainter by at least 4 mag (SKY2000 `Dmag`).
    pub const FAINT_COMPANION: Self = Self(1 << 7);

    /// Whether every flag of `other` is in this set.
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// The flags of both sets.
    pub const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// `self` if `condition`, else no flags.
    pub(super) const fn only_if(self, condition: bool) -> Self {
        if condition { self } else { Self::NONE }
    }

    /// The byte of the compact form.
    pub(super) const fn bits(self) -> u8 {
        self.0
    }

    /// Decodes the byte of the compact form.
    pub(super) const fn from_bits(bits: u8) -> Self {
        Self(bits)
    }

    /// Whether its light is that of one star, and constant within a few hundredths of a magnitude.
    pub(crate) const fn is_constant_and_single(self) -> bool {
        let varies = self.contains(Self::VARIABLE) && !self.contains(Self::SMALL_AMPLITUDE);
        let is_double = self.contains(Self::MULTIPLE) && !self.contains(Self::FAINT_COMPANION);
        let is_blend =
            self.contains(Self::BLENDED_POSITION) || self.contains(Self::BLENDED_MAGNITUDE);
        !(varies || is_double || is_blend)
    }
}

/// A catalogue star at epoch J2000.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Star {
    /// The identifier in the catalogue.
    pub id: StarId,
    /// Direction at epoch J2000.
    pub direction: UnitVector<Icrs>,
    /// Proper motion in right ascension times cos(declination), in milliarcseconds a year.
    pub pm_ra_mas_per_yr: f32,
    /// Proper motion in declination, in milliarcseconds a year.
    pub pm_dec_mas_per_yr: f32,
    /// Johnson V magnitude.
    pub v_mag: f32,
    /// Johnson B−V, where known.
    pub bv_mag: Option<f32>,
    /// Caveats about the star.
    pub flags: StarFlags,
}

impl Star {
    /// A star of which only identifier, direction and V magnitude are known.
    pub fn new(id: StarId, direction: UnitVector<Icrs>, v_mag: f32) -> Self {
        Self {
            id,
            direction,
            pm_ra_mas_per_yr: 0.0,
            pm_dec_mas_per_yr: 0.0,
            v_mag,
            bv_mag: None,
            flags: StarFlags::NO_PROPER_MOTION,
        }
    }

    /// Whether the star is brighter than `v_mag` (Johnson V), its V rounded to 0.001 mag.
    pub fn is_brighter_than(&self, v_mag: f64) -> bool {
        f64::from(mmag(self.v_mag)) / 1000.0 < v_mag
    }

    /// The direction of the star `years_since_j2000` Julian years after J2000.0.
    ///
    /// Linear motion across the line of sight. Neglects radial velocity (less than 1″ in 30 years
    /// for the fastest stars), parallax (less than 1″) and aberration (up to 20.5″, but nearly
    /// constant over a field).
    ///
    /// # Reference
    /// ESA 1997, The Hipparcos and Tycho Catalogues (SP-1200), vol. 1, eq. 1.5.4, without ζ₀.
    pub fn direction_at(&self, years_since_j2000: f64) -> UnitVector<Icrs> {
        const RAD_PER_MAS: f64 = RAD_PER_ARCSEC / 1000.0;
        let east_rad = f64::from(self.pm_ra_mas_per_yr) * RAD_PER_MAS * years_since_j2000;
        let north_rad = f64::from(self.pm_dec_mas_per_yr) * RAD_PER_MAS * years_since_j2000;
        if east_rad == 0.0 && north_rad == 0.0 {
            return self.direction;
        }
        // As `east_north`, but without trigonometry: this runs over whole catalogues.
        let position = self.direction.as_vector();
        let from_axis = (position.x * position.x + position.y * position.y).sqrt();
        let (sin_ra, cos_ra) = if from_axis > 0.0 {
            (position.y / from_axis, position.x / from_axis)
        } else {
            (0.0, 1.0)
        };
        let east = Vector3::new(-sin_ra, cos_ra, 0.0);
        let north = Vector3::new(-position.z * cos_ra, -position.z * sin_ra, from_axis);
        UnitVector::from_vector(position + east * east_rad + north * north_rad)
    }
}

/// A magnitude in whole thousandths.
pub(super) fn mmag(mag: f32) -> i16 {
    (f64::from(mag) * 1000.0).round() as i16
}

/// A magnitude in magnitudes: the `f32` nearest to the decimal number, as parsing would give.
pub(super) fn mag_from_mmag(mmag: i16) -> f32 {
    f32::from(mmag) / 1000.0
}

/// A magnitude within ±32, rounded to 0.001 mag as in the compact form.
pub(super) fn rounded_mag(mag: f64) -> f32 {
    mag_from_mmag((mag * 1000.0).round() as i16)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::units::{ARCSEC_PER_RAD, RAD_PER_DEG};

    const TOLERANCE_ARCSEC: f64 = 1e-5;

    fn star_at(ra_deg: f64, dec_deg: f64) -> Star {
        let direction = UnitVector::from_ra_dec(ra_deg * RAD_PER_DEG, dec_deg * RAD_PER_DEG);
        Star::new(StarId::Skymap(1), direction, 5.0)
    }

    #[test]
    fn proper_motion_moves_a_star_east_and_north() {
        let mut star = star_at(100.0, 60.0);
        star.pm_ra_mas_per_yr = 500.0;
        star.pm_dec_mas_per_yr = -200.0;
        let (east, north) = star.direction.east_north();
        let moved = star.direction_at(20.0);
        let east_arcsec = moved.as_vector().dot(&east) * ARCSEC_PER_RAD;
        let north_arcsec = moved.as_vector().dot(&north) * ARCSEC_PER_RAD;
        assert!((east_arcsec - 10.0).abs() < TOLERANCE_ARCSEC);
        assert!((north_arcsec + 4.0).abs() < TOLERANCE_ARCSEC);
        assert!((moved.as_vector().norm() - 1.0).abs() < 1e-15);
        let (ra_rad, _) = moved.to_ra_dec();
        // 10″ along the parallel of 60° is 20″ of right ascension.
        let ra_arcsec = (ra_rad - 100.0 * RAD_PER_DEG) * ARCSEC_PER_RAD;
        assert!((ra_arcsec - 20.0).abs() < 1e-2, "{ra_arcsec}");
    }

    #[test]
    fn a_star_without_motion_stays_and_a_polar_star_moves() {
        let still = star_at(10.0, 10.0);
        assert_eq!(still.direction_at(25.0), still.direction);
        let mut polar = Star::new(
            StarId::Skymap(1),
            UnitVector::from_vector(Vector3::z()),
            5.0,
        );
        polar.pm_dec_mas_per_yr = 1000.0;
        let moved_arcsec = polar.direction_at(5.0).angle_to(&polar.direction) * ARCSEC_PER_RAD;
        assert!((moved_arcsec - 5.0).abs() < TOLERANCE_ARCSEC);
    }

    #[test]
    fn flags_are_a_set() {
        let both = StarFlags::MULTIPLE.union(StarFlags::VARIABLE);
        assert!(both.contains(StarFlags::MULTIPLE) && both.contains(StarFlags::NONE));
        assert!(!both.contains(StarFlags::BLENDED_POSITION));
        assert_eq!(StarFlags::from_bits(both.bits()), both);
    }
}
