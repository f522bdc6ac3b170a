//! The budget of the paper's experiments, quantity by quantity, against figures worked out apart
//! from this code.

use super::*;
use crate::base::statistics::normal_cdf;
use crate::camera::data_sheet::{Preset, Response};
use crate::predict::{Extinction, Parameter, SkyBrightness};

fn budget(preset: Preset) -> Budget {
    Budget::new(&Scenario::of(preset))
}

/// Asserts that `found` is `expected` to `relative` of it.
fn close(what: &str, found: f64, expected: f64, relative: f64) {
    assert!(
        (found / expected - 1.0).abs() < relative,
        "{what}: {found} for {expected}"
    );
}

#[test]
fn the_limits_of_the_paper_are_met() {
    // Eqs. (13) and (14).
    assert!((budget(Preset::Experiment1).limit_vmag - 8.15).abs() < 0.01);
    assert!((budget(Preset::Experiment2).limit_vmag - 9.01).abs() < 0.03);
}

#[test]
fn every_quantity_of_experiment_1_is_what_a_hand_calculation_gives() {
    let found = budget(Preset::Experiment1);
    close(
        "A: π/4 · (0.1 m)²",
        found.aperture_area_m2,
        7.853_981_6e-3,
        1e-7,
    );
    close(
        "A_P: 8.6 µm · 8.3 µm / (0.16 m)²",
        found.pixel_solid_angle_sr,
        2.788_281e-9,
        1e-6,
    );
    close(
        "A_P in arcsec²: times 206264.8²",
        found.pixel_area_arcsec2,
        118.629,
        1e-4,
    );
    close("sec 0", found.airmass, 1.0, 1e-12);
    close(
        "τ at 555 nm: exp(−0.31786)",
        found.zenith_transmission,
        0.727_705,
        1e-5,
    );
    close("Φ₀", found.mag_0_photons_s_m2, 5e10, 1e-12);
    // Σ Φ₀ S̄_e τ K Q over table 1 and table 2, by a script of its own: 1.757159e10 electrons per
    // second and m².
    close(
        "Σ Φ₀ S̄_e τ K Q A",
        found.mag_0_e_s,
        1.757_159_3e10 * 7.853_981_6e-3,
        1e-6,
    );
    close("μ", found.peak_share, 1.0 / 9.0, 1e-12);
    close("E_B", found.sky_illuminance_lx, 0.01, 1e-12);
    close(
        "M_B: lg(2.65e-4) / lg 2.512",
        found.sky_mag,
        -8.941_446,
        1e-6,
    );
    // 0.01 lx over π is 3.1831e-3 cd/m².
    close("L_B", found.sky_luminance_cd_m2, 3.183_099e-3, 1e-6);
    // 1.757159e10 · 2.788281e-9 / 2.65e-4 · 7.853982e-3 · 0.04.
    close("B", found.background_e, 58.082, 1e-3);
    close("N_C", found.sensor_noise_e, 52.5, 1e-12);
    close("n_B: √B", found.sky_noise_e, 7.6211, 1e-3);
    // 18 + 6 √(58.08 + 2756.25 + 9).
    close("S", found.star_e, 336.811, 1e-5);
    close("n_S: √S", found.star_noise_e, 18.3524, 1e-4);
    // √(336.81 + 58.08 + 2756.25).
    close("N", found.noise_e, 56.1352, 1e-4);
    close("R_SN", found.snr, 6.0, 1e-9);
    // 2.65e-6 lx / 2.512^8.1504 and its 0.7277-th part.
    close("E of the star", found.star_illuminance_lx, 1.455_2e-9, 1e-3);
    close(
        "E' of the star",
        found.star_illuminance_ground_lx,
        1.059e-9,
        1e-3,
    );
    assert_eq!((found.dark_e, found.quantisation_noise_e), (0.0, 0.0));
    assert_eq!(found.bands.len(), 43);
}

#[test]
fn experiment_2_looks_through_more_air_for_longer() {
    let found = budget(Preset::Experiment2);
    close("sec 45°", found.airmass, std::f64::consts::SQRT_2, 1e-12);
    close(
        "Σ Φ₀ S̄_e τ^sec Z K Q A",
        found.mag_0_e_s,
        1.538_816_3e10 * 7.853_981_6e-3,
        1e-6,
    );
    close("B", found.background_e, 127.16, 1e-3);
    close("S", found.star_e, 340.690, 1e-4);
}

#[test]
fn a_band_is_what_the_tables_and_equation_3_say() {
    let found = budget(Preset::Experiment1);
    let band = found
        .bands
        .iter()
        .find(|band| band.wavelength_nm == 550.0)
        .unwrap();
    close(
        "Φ₀ S̄_e: 5e10 / 11.6018",
        band.star_photons_s_m2,
        4.309_676e9,
        1e-6,
    );
    close(
        "τ: exp(−(0.009 · 0.55⁻⁴ + 0.223))",
        band.atmosphere_transmission,
        0.725_167,
        1e-5,
    );
    assert_eq!(
        (band.lens_transmission, band.quantum_efficiency),
        (0.85, 0.58)
    );
}

/// A camera that a hand can reckon with.
fn plain() -> Scenario {
    let mut scenario = Scenario::of(Preset::Experiment1);
    scenario.reading = Reading::Physical;
    let sheet = &mut scenario.camera;
    sheet.lens_transmission = Response::Constant(0.8);
    sheet.quantum_efficiency = Response::Constant(0.5);
    (sheet.band_from_nm, sheet.band_to_nm) = (400.0, 700.0);
    (sheet.pitch_x_um, sheet.pitch_y_um) = (5.5, 5.5);
    (sheet.focal_length_mm, sheet.aperture_mm) = (50.0, 25.0);
    (sheet.read_noise_e, sheet.gain_e_per_adu) = (5.0, 2.0);
    sheet.dark_current_e_s = 20.0;
    (sheet.spot_sigma_px, sheet.peak_share) = (0.8, None);
    scenario.conditions.exposure_s = 0.1;
    scenario.conditions.sky = SkyBrightness::MagArcsec2(18.0);
    scenario.conditions.extinction = Extinction::MagPerAirmass(0.25);
    scenario.conditions.zenith_distance_deg = 60.0;
    scenario
}

#[test]
fn the_physical_reading_is_what_a_hand_calculation_gives() {
    let found = Budget::new(&plain());
    // Kasten & Young at 60°: 1 / (0.5 + 0.50572 · 36.07995^−1.6364) = 1.994293.
    close("X", found.airmass, 1.994_293, 1e-4);
    // A black body of 5800 K from 400 to 700 nm, by a fine sum: 2.84757e10.
    close("photons", found.mag_0_photons_s_m2, 2.847_57e10, 1e-4);
    let collected = found.mag_0_photons_s_m2 * 0.8 * 0.5 * 4.908_739e-4;
    close(
        "electrons of mag 0",
        found.mag_0_e_s,
        collected * 10f64.powf(-0.1 * 1.994_293),
        1e-5,
    );
    // (5.5 µm / 50 mm)² = 1.21e-8 sr = 514.80 arcsec²; the sky is as seen from the ground, without
    // extinction.
    close("pixel", found.pixel_area_arcsec2, 514.80, 1e-4);
    close(
        "sky",
        found.background_e,
        collected * 0.1 * 514.80 * 10f64.powf(-7.2),
        1e-4,
    );
    close("dark", found.dark_e, 2.0, 1e-12);
    close(
        "rounding: 2/√12",
        found.quantisation_noise_e,
        0.577_35,
        1e-4,
    );
    close(
        "sensor: √(25 + 2 + 1/3)",
        found.sensor_noise_e,
        5.228_129,
        1e-6,
    );
    // erf(0.5 / (√2 · 0.8))² = 0.468029².
    close("μ", found.peak_share, 0.219_051, 1e-5);
    let variance = found.background_e + 25.0 + 2.0 + 1.0 / 3.0;
    close(
        "S",
        found.star_e,
        18.0 + 6.0 * (variance + 9.0).sqrt(),
        1e-9,
    );
    let peak = found.mag_0_e_s * 0.1 * found.peak_share;
    close(
        "limit",
        found.limit_vmag,
        2.5 * (peak / found.star_e).log10(),
        1e-9,
    );
    close(
        "and back",
        found.electrons_of(found.limit_vmag, 0.1) * found.peak_share,
        found.star_e,
        1e-9,
    );
    assert!((found.vmag_of(found.electrons_of(9.0, 0.1), 0.1) - 9.0).abs() < 1e-9);
}

#[test]
fn the_limit_moves_as_it_must_with_every_lever() {
    // From the value to a larger one: fainter (+) or brighter (−).
    for (name, factor, sign) in [
        ("aperture_mm", 1.3, 1.0),
        ("lens_transmission", 1.1, 1.0),
        ("quantum_efficiency", 1.1, 1.0),
        ("exposure_s", 2.0, 1.0),
        ("focal_length_mm", 2.0, 1.0),
        ("read_noise_e", 2.0, -1.0),
        ("dark_current_e_s", 10.0, -1.0),
        ("spot_sigma_px", 1.5, -1.0),
        ("gain_e_per_adu", 5.0, -1.0),
        ("snr", 1.5, -1.0),
        ("zenith_distance_deg", 1.2, -1.0),
        ("extinction_mag_per_airmass", 2.0, -1.0),
        ("sky_luminance_cd_m2", 3.0, -1.0),
        ("sky_mag_arcsec2", 1.1, 1.0),
    ] {
        let mut scenario = plain();
        let before = Budget::new(&scenario).limit_vmag;
        let parameter = Parameter::named(name).unwrap();
        let value = parameter.get(&scenario).unwrap();
        parameter.set(&mut scenario, value * factor);
        scenario.check().unwrap();
        let after = Budget::new(&scenario).limit_vmag;
        assert!(
            (after - before) * sign > 1e-3,
            "{name}: {before} to {after}"
        );
    }
}

/// The transmission at 555 nm, which eq. (2) takes for all wavelengths, over the mean that is
/// weighted with the eye's sensitivity.
fn excess_of_eq_2(zenith_distance_deg: f64) -> f64 {
    let mut scenario = Scenario::of(Preset::Experiment1);
    scenario.conditions.zenith_distance_deg = zenith_distance_deg;
    let budget = Budget::new(&scenario);
    let sum = |of: fn(&Band) -> f64| budget.bands.iter().map(of).sum::<f64>();
    let mean = sum(|band| band.star_photons_s_m2 * band.atmosphere_transmission)
        / sum(|band| band.star_photons_s_m2);
    budget.zenith_transmission.powf(budget.airmass) / mean - 1.0
}

#[test]
fn equation_2_is_at_most_2_percent_too_large() {
    // By a script of its own.
    for (zenith_distance_deg, expected) in [(0.0, 0.0048), (45.0, 0.0065), (80.0, 0.0143)] {
        let found = excess_of_eq_2(zenith_distance_deg);
        assert!(
            (found - expected).abs() < 1e-4,
            "{zenith_distance_deg}: {found}"
        );
    }
}

#[test]
fn six_sigma_stars_are_found_in_95_percent_only_where_a_frame_has_a_false_one() {
    /// z of the quantile of 95 %.
    const Z_95: f64 = 1.644_854;
    for (preset, expected_false) in [(Preset::Experiment1, 0.89), (Preset::Experiment2, 0.90)] {
        let scenario = Scenario::of(preset);
        let budget = Budget::new(&scenario);
        let pixels = (scenario.camera.width_px * scenario.camera.height_px) as f64;
        // Of a threshold that finds 95 %.
        let threshold = (budget.star_e - Z_95 * budget.noise_e) / budget.background_noise_e;
        let falsely = pixels * normal_cdf(-threshold);
        assert!((threshold - 4.61).abs() < 0.01, "{threshold}");
        assert!((falsely - expected_false).abs() < 0.01, "{falsely}");
        // Of one that is exceeded by noise in 5 % of frames, 0.0513 times a frame.
        let threshold = 5.170;
        assert!((pixels * normal_cdf(-threshold) - 0.0513).abs() < 0.0003);
        let over = (budget.star_e - threshold * budget.background_noise_e) / budget.noise_e;
        assert!(
            (normal_cdf(over) - 0.867).abs() < 0.001,
            "{}",
            normal_cdf(over)
        );
    }
}
