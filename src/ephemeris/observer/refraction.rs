//! Refraction: how much higher a star appears through the air.
//!
//! Caveats: real refraction differs from that of a mean atmosphere by some parts in a thousand at 60°
//! from the zenith, and near the horizon by minutes of arc. Humidity is neglected: up to 0.5 %.

/// Temperature of the standard atmosphere at sea level, in kelvins.
const SEA_LEVEL_K: f64 = 288.15;
/// Its pressure there, in hectopascals.
const SEA_LEVEL_HPA: f64 = 1013.25;
/// Kelvins at 0 °C.
const KELVIN_AT_0_C: f64 = 273.15;

/// The air at a site.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Air {
    /// Index of refraction less 1.
    refractivity: f64,
    /// Height over which its pressure falls by a factor e, over the Earth's radius.
    scale: f64,
}

impl Air {
    /// The air at a pressure and a temperature, at 574 nm.
    ///
    /// # Reference
    /// IAG 1999, resolution 3 (refractivity of dry air).
    pub fn new(pressure_hpa: f64, temperature_c: f64) -> Self {
        /// Refractivity at 0 °C and 1013.25 hPa.
        const REFRACTIVITY: f64 = 292.68e-6;
        /// Scale height over the Earth's radius, per kelvin.
        const SCALE_PER_K: f64 = 29.271 / 6.371e6;
        let kelvins = temperature_c + KELVIN_AT_0_C;
        Self {
            refractivity: REFRACTIVITY * pressure_hpa / SEA_LEVEL_HPA * KELVIN_AT_0_C / kelvins,
            scale: SCALE_PER_K * kelvins,
        }
    }

    /// The air of the standard atmosphere at a height in metres; none above 44 km.
    ///
    /// # Reference
    /// U.S. Standard Atmosphere, 1976 (NOAA-S/T 76-1562), eq. 33a, extrapolated upwards.
    pub fn at_height(height_m: f64) -> Self {
        let relative_k = 1.0 - 2.255_77e-5 * height_m;
        let pressure_hpa = SEA_LEVEL_HPA * libm::pow(relative_k.max(0.0), 5.255_88);
        let temperature_c = SEA_LEVEL_K * relative_k.max(0.75) - KELVIN_AT_0_C;
        Self::new(pressure_hpa, temperature_c)
    }

    /// Refraction in radians over the sine of the true zenith distance, whose cosine is given.
    ///
    /// A continued fraction, as Marini found it for an atmosphere of one temperature. Its
    /// coefficients are fitted to the integral over a troposphere that cools by 6.5 K per kilometre
    /// and a stratosphere of one temperature. Up to 80° from the zenith it is within 0.05″ of that
    /// integral for −20 to 30 °C and 600 to 1013 hPa, at the horizon within 1′.
    ///
    /// # References
    /// - Marini 1972, Radio Science 7, 223, doi 10.1029/RS007i002p00223
    /// - Auer & Standish 2000, AJ 119, 2472, doi 10.1086/301325 (the integral)
    pub(crate) fn refraction_per_sine(&self, cosine: f64) -> f64 {
        /// Lower down the fraction has no meaning, and refraction stays as it is there.
        const LOWEST: f64 = -0.01;
        /// Below the horizon of the highest mountain nothing is seen.
        const HORIZON: f64 = -0.06;
        if cosine < HORIZON {
            return 0.0;
        }
        let Self {
            refractivity,
            scale,
        } = *self;
        let up = cosine.max(LOWEST);
        let third = 2.297 * scale.sqrt();
        let second = 2.728 * scale;
        let first = 1.0145 * scale + 0.54 * refractivity;
        refractivity / (up + first / (up + second / (up + third)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::units::{ARCSEC_PER_RAD, RAD_PER_DEG};

    /// Pressure in hPa, temperature in °C, apparent zenith distance in degrees, and refraction in
    /// arcseconds: ray integrals through the atmosphere described above, by a program of its own.
    #[rustfmt::skip]
    const INTEGRALS: &[(f64, f64, f64, f64)] = &[
        (1013.25, 15.0, 20.0, 20.798),
        (1013.25, 15.0, 45.0, 57.085),
        (1013.25, 15.0, 70.0, 155.657),
        (1013.25, 15.0, 80.0, 312.914),
        (1013.25, 15.0, 85.0, 579.131),
        (1013.25, 15.0, 89.0, 1411.147),
        (1013.25, -20.0, 20.0, 23.678),
        (1013.25, -20.0, 45.0, 64.999),
        (1013.25, -20.0, 70.0, 177.438),
        (1013.25, -20.0, 80.0, 358.029),
        (1013.25, -20.0, 85.0, 669.458),
        (1013.25, -20.0, 89.0, 1704.637),
        (747.0, -1.0, 20.0, 16.236),
        (747.0, -1.0, 45.0, 44.564),
        (747.0, -1.0, 70.0, 121.549),
        (747.0, -1.0, 80.0, 244.569),
        (747.0, -1.0, 85.0, 453.756),
        (747.0, -1.0, 89.0, 1114.639),
    ];

    #[test]
    fn refraction_is_that_of_rays_through_the_atmosphere() {
        for &(hpa, celsius, apparent_deg, expected_arcsec) in INTEGRALS {
            let true_rad = apparent_deg * RAD_PER_DEG + expected_arcsec / ARCSEC_PER_RAD;
            let share = Air::new(hpa, celsius).refraction_per_sine(true_rad.cos());
            let found_arcsec = share * true_rad.sin() * ARCSEC_PER_RAD;
            let tolerance_arcsec = if apparent_deg <= 80.0 {
                0.06
            } else {
                0.03 * expected_arcsec
            };
            assert!(
                (found_arcsec - expected_arcsec).abs() < tolerance_arcsec,
                "{hpa} {celsius} {apparent_deg}: {found_arcsec} {expected_arcsec}"
            );
        }
    }

    /// `erfa.refco(hpa, celsius, 0, 0.574)` of pyerfa 2.0.1: the coefficients of tan z and tan³ z, in
    /// arcseconds, at 50° apparent.
    #[test]
    fn refraction_at_fifty_degrees_is_that_of_erfa() {
        for (hpa, celsius, expected_arcsec) in [
            (1013.25, 15.0, 68.003),
            (747.00, -1.0, 53.089),
            (600.00, 20.0, 39.576),
        ] {
            let true_rad = 50.0 * RAD_PER_DEG + expected_arcsec / ARCSEC_PER_RAD;
            let share = Air::new(hpa, celsius).refraction_per_sine(true_rad.cos());
            let found_arcsec = share * true_rad.sin() * ARCSEC_PER_RAD;
            let off: f64 = found_arcsec - expected_arcsec;
            assert!(off.abs() < 0.1, "{found_arcsec} {expected_arcsec}");
        }
    }

    #[test]
    fn thin_air_refracts_less_and_space_not_at_all() {
        let at = |height_m| Air::at_height(height_m).refraction_per_sine(0.3);
        assert!(at(3000.0) < 0.75 * at(0.0) && at(60_000.0) == 0.0);
        assert_eq!(Air::at_height(0.0), Air::new(1013.25, 15.0));
    }
}
