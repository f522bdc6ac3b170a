//! Airmass as a function of the zenith distance.

use crate::base::units::DEG_PER_RAD;
use std::f64::consts::FRAC_PI_2;

/// The airmass at an apparent zenith distance in radians, clamped to 0 to π/2: 0.9997 at the
/// zenith, 38 at the horizon.
///
/// # Reference
/// Kasten & Young 1989, Appl. Opt. 28, 4735, doi 10.1364/AO.28.004735, eq. 3. Agrees with Pickering
/// 2002 (DIO 12, 1, p. 20) within 0.3 % above an altitude of 5°.
pub fn airmass_kasten_young(apparent_zenith_distance_rad: f64) -> f64 {
    let zenith_distance_rad = apparent_zenith_distance_rad.clamp(0.0, FRAC_PI_2);
    let altitude_deg = 96.079_95 - zenith_distance_rad * DEG_PER_RAD;
    let altitude_term = libm::pow(altitude_deg, -1.6364);
    1.0 / (libm::cos(zenith_distance_rad) + 0.505_72 * altitude_term)
}

/// The airmass sec z of plane-parallel layers: within 1 % up to 70° from the zenith, infinite at
/// the horizon.
pub fn airmass_plane_parallel(zenith_distance_rad: f64) -> f64 {
    1.0 / libm::cos(zenith_distance_rad)
}

/// The airmass for scattered light: 1 at the zenith, 5 at the horizon.
///
/// # Reference
/// Krisciunas & Schaefer 1991, PASP 103, 1033, eq. (3).
pub fn airmass_krisciunas_schaefer(zenith_distance_rad: f64) -> f64 {
    let sine = libm::sin(zenith_distance_rad);
    (1.0 - 0.96 * sine * sine).sqrt().recip()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::units::RAD_PER_DEG;

    /// Pickering 2002, by apparent altitude in degrees.
    fn pickering(altitude_deg: f64) -> f64 {
        let bent_deg = altitude_deg + 244.0 / (165.0 + 47.0 * altitude_deg.powf(1.1));
        1.0 / (bent_deg * RAD_PER_DEG).sin()
    }

    /// The relative difference between the paper's formula and its tables.
    const TABLE_TOLERANCE: f64 = 2e-3;

    #[test]
    fn the_airmass_of_scattered_light_follows_the_paper() {
        assert_eq!(airmass_krisciunas_schaefer(0.0), 1.0);
        // (1 − 0.96 · 0.75)^−½ at 60°.
        assert!((airmass_krisciunas_schaefer(60f64.to_radians()) - 1.889_82).abs() < 1e-5);
        assert!((airmass_krisciunas_schaefer(FRAC_PI_2) - 5.0).abs() < 1e-9);
    }

    #[test]
    fn the_airmass_is_that_of_the_published_tables() {
        // Kasten & Young 1989, table 2.
        for (altitude_deg, expected) in [
            (90.0, 1.0),
            (60.0, 1.1539),
            (30.0, 1.9939),
            (10.0, 5.5841),
            (5.0, 10.3164),
            (0.0, 37.9196),
        ] {
            let found = airmass_kasten_young((90.0 - altitude_deg) * RAD_PER_DEG);
            assert!(
                (found / expected - 1.0).abs() < TABLE_TOLERANCE,
                "{altitude_deg}: {found}"
            );
        }
    }

    #[test]
    fn two_formulas_agree_above_five_degrees() {
        for altitude_deg in 5..=90 {
            let altitude_deg = f64::from(altitude_deg);
            let found = airmass_kasten_young((90.0 - altitude_deg) * RAD_PER_DEG);
            let ratio = found / pickering(altitude_deg);
            assert!((ratio - 1.0).abs() < 3e-3, "{altitude_deg}: {ratio}");
        }
        let plane = airmass_plane_parallel(60.0 * RAD_PER_DEG);
        assert!((plane - 2.0).abs() < 1e-12);
    }
}
