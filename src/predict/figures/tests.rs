//! What the paper says of its figures, held against the model.
//!
//! Where a statement holds in part only, the test says for which part, and pins down the rest:
//! docs/sensitivity.md has the table.

use super::*;
use crate::camera::data_sheet::Preset;
use crate::predict::{Budget, Parameter};
use std::collections::BTreeSet;

/// The limit of experiment 1 with these parameters.
fn limit(parameters: &[(&str, f64)]) -> f64 {
    let mut scenario = Scenario::of(Preset::Experiment1);
    for (name, value) in parameters {
        Parameter::named(name).unwrap().set(&mut scenario, *value);
    }
    Budget::checked(&scenario).unwrap().limit_vmag
}

/// By how much the limit grows from one value of a parameter to another, at an exposure.
fn gain(exposure_s: f64, name: &str, [from, to]: [f64; 2]) -> f64 {
    let at = |value| limit(&[("exposure_s", exposure_s), (name, value)]);
    at(to) - at(from)
}

const SHORT_S: f64 = 0.04;
const LONG_S: f64 = 0.5;

/// Asserts a value in magnitudes to the digits given.
fn about(found: f64, expected: f64) {
    assert!((found - expected).abs() < 0.005, "{found} for {expected}");
}

/// The part of the limit's variance along a parameter that a straight line explains.
fn straightness(exposure_s: f64, name: &str, [from, to]: [f64; 2]) -> f64 {
    let values = Spacing::Linear.values(from, to, 51);
    let limits: Vec<f64> = values
        .iter()
        .map(|value| limit(&[("exposure_s", exposure_s), (name, *value)]))
        .collect();
    let mean = |of: &[f64]| of.iter().sum::<f64>() / of.len() as f64;
    let (x_mean, y_mean) = (mean(&values), mean(&limits));
    let sum = |of: &dyn Fn(f64, f64) -> f64| -> f64 {
        let pairs = values.iter().zip(&limits);
        pairs.map(|(x, y)| of(x - x_mean, y - y_mean)).sum()
    };
    sum(&|x, y| x * y).powi(2) / (sum(&|x, _| x * x) * sum(&|_, y| y * y))
}

#[test]
fn there_are_eleven_each_with_two_curves_and_a_name_of_its_own() {
    let base = Scenario::of(Preset::Experiment1);
    let mut names = BTreeSet::new();
    for figure in PaperFigure::ALL {
        let curves = figure.curves(&base, &figure.sweep().unwrap()).unwrap();
        assert_eq!(curves.len(), 2, "{}", figure.id);
        assert!(curves.iter().all(|curve| curve.points.len() == VALUES));
        names.insert(figure.file_stem());
    }
    assert_eq!(names.len(), 11);
    assert!(names.contains("figure-3a-lens-transmission"), "{names:?}");
    assert!(
        names.contains("figure-4a-transmission-of-the-air-555-nm"),
        "{names:?}"
    );
}

#[test]
fn section_3_1_1_transmission_and_efficiency_are_nearly_linear_over_their_upper_half() {
    // Small where lenses and detectors differ, and as large as that of any factor over the whole
    // range.
    const RANGES: [[f64; 2]; 3] = [[0.7, 1.0], [0.5, 1.0], [0.1, 1.0]];
    for (name, exposure_s, gains) in [
        ("lens_transmission", SHORT_S, [0.38, 0.75, 2.49]),
        ("lens_transmission", LONG_S, [0.35, 0.69, 2.38]),
        ("quantum_efficiency", SHORT_S, [0.38, 0.74, 2.48]),
        ("quantum_efficiency", LONG_S, [0.34, 0.67, 2.33]),
    ] {
        assert!(straightness(exposure_s, name, [0.5, 1.0]) > 0.99);
        // Over all of it the curve is the logarithm that it is.
        let whole = straightness(exposure_s, name, [0.1, 1.0]);
        assert!((0.91..0.93).contains(&whole), "{name}: {whole}");
        for (range, expected) in RANGES.into_iter().zip(gains) {
            about(gain(exposure_s, name, range), expected);
        }
    }
}

#[test]
fn section_3_1_2_the_aperture_matters_and_most_where_it_is_small() {
    let slope = |exposure_s, from: f64| gain(exposure_s, "aperture_mm", [from, from + 5.0]) / 5.0;
    for exposure_s in [SHORT_S, LONG_S] {
        assert!(slope(exposure_s, 5.0) > 10.0 * slope(exposure_s, 100.0));
    }
    about(gain(SHORT_S, "aperture_mm", [5.0, 50.0]), 5.00);
    about(gain(SHORT_S, "aperture_mm", [50.0, 100.0]), 1.50);
    about(gain(LONG_S, "aperture_mm", [5.0, 50.0]), 4.97);
    about(gain(LONG_S, "aperture_mm", [50.0, 100.0]), 1.42);
    about(gain(SHORT_S, "aperture_mm", [100.0, 200.0]), 1.47);
    about(gain(LONG_S, "aperture_mm", [100.0, 200.0]), 1.25);
}

#[test]
fn section_3_1_3_the_focal_length_matters_little_but_where_it_is_short_and_the_exposure_long() {
    about(gain(SHORT_S, "focal_length_mm", [100.0, 500.0]), 0.03);
    about(gain(SHORT_S, "focal_length_mm", [20.0, 500.0]), 0.44);
    about(gain(LONG_S, "focal_length_mm", [100.0, 500.0]), 0.25);
    // Here it does not hold: a pixel of 20 mm focal length sees 64 times the sky of one of 160 mm.
    about(gain(LONG_S, "focal_length_mm", [20.0, 500.0]), 1.50);
}

#[test]
fn section_3_1_4_a_share_twice_as_large_helps_more_than_an_area_twice_as_large() {
    const AREA_UM2: f64 = 8.6 * 8.3;
    let area = [AREA_UM2, 2.0 * AREA_UM2];
    let share = [1.0 / 9.0, 2.0 / 9.0];
    for (exposure_s, by_share, by_area) in [(SHORT_S, 0.75, 0.74), (LONG_S, 0.75, 0.65)] {
        about(gain(exposure_s, "peak_share", share), by_share);
        about(gain(exposure_s, "pixel_area_um2", area), by_area);
    }
    // With the share held, a larger pixel has more sky and nothing else.
    let with_share = |exposure_s, area_um2| {
        limit(&[
            ("exposure_s", exposure_s),
            ("pixel_area_um2", area_um2),
            ("peak_share", 1.0 / 9.0),
        ])
    };
    about(
        with_share(SHORT_S, area[1]) - with_share(SHORT_S, area[0]),
        -0.01,
    );
    about(
        with_share(LONG_S, area[1]) - with_share(LONG_S, area[0]),
        -0.10,
    );
}

#[test]
fn section_3_1_5_dark_current_harms_long_exposures_more() {
    for (dark, short, long) in [(1e4, -0.07, -0.46), (1e5, -0.46, -1.44)] {
        about(gain(SHORT_S, "dark_current_e_s", [0.0, dark]), short);
        about(gain(LONG_S, "dark_current_e_s", [0.0, dark]), long);
    }
}

#[test]
fn section_3_1_6_a_longer_exposure_helps_most_where_it_is_short() {
    for aperture_mm in [100.0, 50.0] {
        let at = |exposure_s| limit(&[("aperture_mm", aperture_mm), ("exposure_s", exposure_s)]);
        let slope = |from: f64| (at(from + 0.01) - at(from)) / 0.01;
        let ratio = slope(0.01) / slope(0.5);
        assert!((36.0..39.0).contains(&ratio), "{ratio}");
        // For each doubling it is nearly the same: noise of reading at first, then that of the sky.
        about(at(0.01) - at(0.005), 0.75);
    }
    about(
        limit(&[("exposure_s", 1.0)]) - limit(&[("exposure_s", 0.5)]),
        0.65,
    );
}

#[test]
fn section_3_2_1_below_a_fifth_the_air_takes_magnitudes_fast() {
    for (exposure_s, below, above) in [(SHORT_S, -2.47, 1.69), (LONG_S, -2.44, 1.58)] {
        let below_mag = gain(exposure_s, "zenith_transmission", [0.2, 0.02]);
        let above_mag = gain(exposure_s, "zenith_transmission", [0.2, 0.95]);
        about(below_mag, below);
        about(above_mag, above);
        // Per step of transmission: six times as steep.
        assert!(-below_mag / 0.18 > 6.0 * (above_mag / 0.75));
    }
}

#[test]
fn section_3_2_2_beyond_70_degrees_the_limit_falls_fast() {
    for exposure_s in [SHORT_S, LONG_S] {
        let to_70 = gain(exposure_s, "zenith_distance_deg", [0.0, 70.0]);
        let beyond = gain(exposure_s, "zenith_distance_deg", [70.0, 80.0]);
        assert!(beyond / 10.0 < 9.0 * to_70 / 70.0, "{to_70} {beyond}");
    }
    for (range, short, long) in [
        ([0.0, 60.0], -0.34, -0.32),
        ([0.0, 70.0], -0.66, -0.62),
        ([70.0, 80.0], -0.97, -0.94),
    ] {
        about(gain(SHORT_S, "zenith_distance_deg", range), short);
        about(gain(LONG_S, "zenith_distance_deg", range), long);
    }
}

#[test]
fn section_3_2_3_the_sky_matters_little_where_the_exposure_is_short() {
    about(gain(SHORT_S, "sky_illuminance_lx", [1e-4, 0.01]), -0.01);
    about(gain(SHORT_S, "sky_illuminance_lx", [1e-4, 0.1]), -0.10);
    about(gain(LONG_S, "sky_illuminance_lx", [1e-4, 0.01]), -0.12);
    // Ten times the moonlit sky, for long: no longer small.
    about(gain(LONG_S, "sky_illuminance_lx", [1e-4, 0.1]), -0.67);
}

/// What one can buy, or choose, more of or less of.
const LEVERS: [&str; 10] = [
    "lens_transmission",
    "quantum_efficiency",
    "focal_length_mm",
    "pixel_area_um2",
    "peak_share",
    "read_noise_e",
    "dark_current_e_s",
    "sky_illuminance_lx",
    "zenith_transmission",
    "snr",
];

#[test]
fn section_4_nothing_doubled_gains_as_much_as_the_aperture_but_a_sharper_spot() {
    let base = Scenario::of(Preset::Experiment1);
    // Doubled or halved, whichever is better; a part of the light ends at all of it.
    let best = |exposure_s, name: &str| {
        let parameter = Parameter::named(name).unwrap();
        let value = parameter.get(&base).unwrap();
        [value / 2.0, value * 2.0]
            .map(|to| {
                if parameter.limits().accept(to) {
                    to
                } else {
                    1.0
                }
            })
            .map(|to| gain(exposure_s, name, [value, to]))
            .into_iter()
            .fold(f64::NEG_INFINITY, f64::max)
    };
    for exposure_s in [SHORT_S, LONG_S] {
        let aperture = best(exposure_s, "aperture_mm");
        for name in LEVERS {
            let found = best(exposure_s, name);
            assert!(found < aperture - 0.3, "{name}: {found}, {aperture}");
        }
        // Half the sigma is a quarter of the spot's area: the light of the brightest pixel is 3.4
        // times as much.
        about(best(exposure_s, "spot_sigma_px"), 1.32);
    }
    about(best(SHORT_S, "aperture_mm"), 1.47);
    about(best(LONG_S, "aperture_mm"), 1.25);
}
