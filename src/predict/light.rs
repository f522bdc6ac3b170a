//! Photometric constants and black bodies: photons and lux of a star and of the sky.
//!
//! Mathematical functions are those of [`libm`], here and wherever simulated frames depend on them:
//! the same on every machine.

use crate::camera::data_sheet::Response;

/// Illuminance of a star of V = 0 above the atmosphere, in lx.
#[doc(alias = "E_0")]
pub(super) const ILLUMINANCE_OF_MAG_0_LX: f64 = 2.65e-6;
/// Photons of a star of V = 0 above the atmosphere in the paper's band, per second and m² (eq. 4).
#[doc(alias = "Phi_0")]
pub(super) const PAPER_PHOTONS_OF_MAG_0: f64 = 5e10;
/// First and last wavelength of table 1 of the paper, in nm.
pub(super) const PAPER_BAND_NM: (f64, f64) = (360.0, 780.0);
/// Brightness ratio of one magnitude in the paper (eqs. 1, 5).
pub(super) const PAPER_MAG_RATIO: f64 = 2.512;
/// Luminance of a sky of V = 0 per square arcsecond, in cd/m².
const LUMINANCE_OF_MAG_0_CD_M2: f64 = 10.8e4;

/// Photons of a star of V = 0 above the atmosphere at [`FLUX_NM`], per second, m² and nm: 1005 per
/// second, cm² and Å.
///
/// 3.63e-9 erg s⁻¹ cm⁻² Å⁻¹ over the energy of a photon (Bessell, Castelli & Plez 1998, A&A 333,
/// 231, table A2).
const PHOTONS_OF_MAG_0: f64 = 1005.0 * 1e4 * 10.0;
const FLUX_NM: f64 = 550.0;
/// Color temperature of the night sky, assumed to be sunlight reflected by the Moon.
pub(super) const SKY_TEMPERATURE_K: f64 = 5800.0;

/// V magnitudes per square arcsecond of a luminance in cd/m².
pub(super) fn mag_arcsec2(luminance_cd_m2: f64) -> f64 {
    -2.5 * libm::log10(luminance_cd_m2 / LUMINANCE_OF_MAG_0_CD_M2)
}

/// Luminance in cd/m² of a brightness in V magnitudes per square arcsecond.
pub(super) fn luminance_cd_m2(mag_arcsec2: f64) -> f64 {
    LUMINANCE_OF_MAG_0_CD_M2 * libm::pow(10.0, -0.4 * mag_arcsec2)
}

/// Photons per second, m² and nm at a wavelength in nm, of a black body of V = 0 above the
/// atmosphere.
pub(super) fn photons_of_mag_0(wavelength_nm: f64, temperature_k: f64) -> f64 {
    /// hc/k, in nm K.
    const SECOND_RADIATION_CONSTANT: f64 = 1.438_776_877e7;
    let photons = |nm: f64| {
        let exponent = SECOND_RADIATION_CONSTANT / (nm * temperature_k);
        nm.powi(-4) / libm::expm1(exponent)
    };
    PHOTONS_OF_MAG_0 * photons(wavelength_nm) / photons(FLUX_NM)
}

/// Range of the colors B−V of stars, in magnitudes.
pub(super) const BV_RANGE_MAG: (f64, f64) = (-0.35, 2.0);

/// Temperature in kelvin of the black body of this B−V, which is clamped to the range of stars.
///
/// # Reference
/// Ballesteros 2012, EPL 97, 34008, eq. 14: within 2 % of stars' effective temperatures.
pub fn temperature_k_of(bv_mag: f64) -> f64 {
    let scaled = 0.92 * bv_mag.clamp(BV_RANGE_MAG.0, BV_RANGE_MAG.1);
    4600.0 * (1.0 / (scaled + 1.7) + 1.0 / (scaled + 0.62))
}

/// Luminous efficiency of the eye by wavelength.
///
/// # Reference
/// Tong, Li & Wang 2014, table 1.
#[doc(alias = "S_e")]
pub(super) fn luminous_efficiency() -> Vec<(f64, f64)> {
    let table = include_bytes!("luminous-efficiency.csv");
    match Response::parse("luminous-efficiency.csv".as_ref(), table) {
        Ok(Response::Table(points)) => points,
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_1_has_43_bands_and_its_sum() {
        let table = luminous_efficiency();
        assert_eq!(table.len(), 43);
        assert_eq!((table[0].0, table[42].0), PAPER_BAND_NM);
        let sum: f64 = table.iter().map(|(_, s)| s).sum();
        assert!((sum - 11.6018).abs() < 1e-4, "{sum}");
    }

    #[test]
    fn photons_of_black_bodies_are_those_of_the_literature() {
        // Totals of 400 to 900 nm for V = 0, in photons per second and m²: 4.2e10 at 9600 K, 4.7e10
        // at 5800 K, 6.4e10 at 4000 K, to the two digits given.
        for (temperature_k, expected) in [(9600.0, 4.2e10), (5800.0, 4.7e10), (4000.0, 6.4e10)] {
            let total: f64 = (400..900)
                .map(|nm| photons_of_mag_0(f64::from(nm) + 0.5, temperature_k))
                .sum();
            assert!(
                (total / expected - 1.0).abs() < 0.02,
                "{temperature_k}: {total:e}"
            );
        }
        // An energy of 3.63e-9 erg at 550 nm, hc/λ = 3.6117e-12 erg: 1005 photons.
        assert!((3.63e-9 / 3.6117e-12 - 1005.0f64).abs() < 1.0);
    }

    #[test]
    fn the_sun_is_as_hot_as_its_color_says_and_no_color_is_beyond_the_formula() {
        // Effective temperatures: the Sun (B−V 0.65), Vega (0.00) and a K5 dwarf (1.15).
        for (bv_mag, expected_k, tolerance_k) in [
            (0.65, 5772.0, 60.0),
            (0.0, 10_000.0, 400.0),
            (1.15, 4440.0, 150.0),
        ] {
            let found_k = temperature_k_of(bv_mag);
            assert!(
                (found_k - expected_k).abs() < tolerance_k,
                "{bv_mag}: {found_k}"
            );
        }
        let ends = [-9.0, 9.0].map(temperature_k_of);
        assert!(ends[0] < 25_000.0 && ends[1] > 3000.0, "{ends:?}");
    }

    #[test]
    fn luminance_and_magnitude_are_inverse() {
        // A sky of 21.5 has 2.7e-4 cd/m², one of 18 has 6.8e-3.
        assert!((luminance_cd_m2(21.5) - 2.71e-4).abs() < 1e-6);
        assert!((luminance_cd_m2(18.0) - 6.81e-3).abs() < 1e-5);
        assert!((mag_arcsec2(luminance_cd_m2(20.3)) - 20.3).abs() < 1e-12);
    }
}
