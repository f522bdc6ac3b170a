//! Predictions for people: the budget, quantity by quantity with the paper's symbols, or a sweep as a table.

use super::Row;
use starpipe::base::format::{five_digits as number, printable};
use starpipe::model::sensitivity::{Budget, DetectorReport, Prediction, Reading, Scenario};
use std::fmt::Write as _;

/// A quantity: symbol, words, value, unit.
type Line = (&'static str, &'static str, f64, &'static str);

pub(super) fn rendered(rows: &[Row]) -> String {
    let Some(first) = rows.first() else {
        return String::new();
    };
    match first.swept {
        None => budget(first),
        Some(_) => heading(first) + &sweeps(rows),
    }
}

fn heading(row: &Row) -> String {
    let reading = words_of(row.prediction.reading);
    let preset = row.preset.map_or(String::new(), |name| format!("{name}: "));
    printable(&format!("{preset}{}, {reading}", row.prediction.camera)) + "\n"
}

fn words_of(reading: Reading) -> &'static str {
    match reading {
        Reading::Paper => "the paper's reading",
        Reading::Physical => "physical reading",
    }
}

/// What the figures are of, in lines.
pub(super) fn caption(scenario: &Scenario) -> Vec<String> {
    let limit_vmag = Budget::new(scenario).limit_vmag;
    vec![
        scenario.camera.name.clone(),
        words_of(scenario.reading).to_owned(),
        format!(
            "dot: exposure {} s, aperture {} mm,",
            number(scenario.conditions.exposure_s),
            number(scenario.camera.aperture_mm),
        ),
        format!("limit V {limit_vmag:.2}"),
    ]
}

fn budget(row: &Row) -> String {
    let prediction = &row.prediction;
    let mut text = heading(row);
    let _ = writeln!(
        text,
        "  limit  V {:.2}: its brightest pixel has {} times the noise",
        prediction.limit_vmag,
        number(prediction.snr),
    );
    for (title, lines) in [
        ("camera", camera(prediction)),
        ("conditions", conditions(prediction)),
        ("on the way", on_the_way(&prediction.budget)),
        ("noise of the brightest pixel", noise(&prediction.budget)),
        ("the faintest star", faintest(&prediction.budget)),
    ] {
        let _ = writeln!(text, "\n  {title}");
        for (symbol, words, value, unit) in lines {
            let line = format!("    {symbol:<5} {words:<55} {:>13} {unit}", number(value));
            let _ = writeln!(text, "{}", line.trim_end());
        }
    }
    text + &detectors(row)
}

/// What is found of the stars, by both rules.
fn detectors(row: &Row) -> String {
    let prediction = &row.prediction;
    let (peak, filter) = (&prediction.peak_pixel, &prediction.detector);
    let mut text = format!(
        "\n  {:<37} {:>20} {:>20}\n",
        "what is found", "brightest pixel", "starpipe's filter"
    );
    let v_mag = |v_mag: Option<f64>| v_mag.map_or("none".to_owned(), |v_mag| format!("{v_mag:.2}"));
    let lines = |d: &DetectorReport| {
        [
            v_mag(d.limit50_vmag),
            v_mag(d.limit90_vmag),
            number(d.threshold_sigma),
            number(d.false_alarms_per_mpx),
        ]
    };
    let words = [
        "half of the stars at V",
        "nine in ten at V",
        "threshold, in standard deviations",
        "false detections in a million pixels",
    ];
    for ((words, peak), filter) in words.iter().zip(lines(peak)).zip(lines(filter)) {
        let _ = writeln!(text, "    {words:<36} {peak:>19} {filter:>20}");
    }
    if let Some(faintest) = &row.faintest {
        let expected = format!("{:.2} ± {:.2}", faintest.mean_vmag, faintest.sigma_mag);
        let found = number((faintest.stars_found * 10.0).round() / 10.0);
        let _ = writeln!(
            text,
            "    {:<36} {:>40}\n    {:<36} {:>40}",
            "catalogue's stars found in the field",
            found,
            "faintest of them to be expected at V",
            expected
        );
    }
    text
}

fn given(
    prediction: &Prediction,
    lines: &[(&'static str, &'static str, &str, &'static str)],
) -> Vec<Line> {
    let value = |name: &str| {
        let found = prediction
            .parameters
            .iter()
            .find(|(known, _)| *known == name);
        found.map_or(f64::NAN, |(_, value)| *value)
    };
    let line =
        |(symbol, words, name, unit): &(_, _, &str, _)| (*symbol, *words, value(name), *unit);
    lines.iter().map(line).collect()
}

fn camera(prediction: &Prediction) -> Vec<Line> {
    given(
        prediction,
        &[
            ("D", "aperture", "aperture_mm", "mm"),
            ("f", "focal length", "focal_length_mm", "mm"),
            (
                "K",
                "transmission of the lens, at most",
                "lens_transmission",
                "",
            ),
            ("Q", "quantum efficiency, at most", "quantum_efficiency", ""),
            ("", "pixel area", "pixel_area_um2", "µm²"),
            ("", "spot, standard deviation", "spot_sigma_px", "px"),
            ("", "dark current", "dark_current_e_s", "e/s"),
        ],
    )
}

fn conditions(prediction: &Prediction) -> Vec<Line> {
    given(
        prediction,
        &[
            ("T", "exposure", "exposure_s", "s"),
            ("Z", "zenith distance", "zenith_distance_deg", "°"),
            (
                "τ",
                "transmission of one airmass at 555 nm",
                "zenith_transmission",
                "",
            ),
            ("E_B", "illuminance by the sky", "sky_illuminance_lx", "lx"),
            ("", "the same as luminance", "sky_luminance_cd_m2", "cd/m²"),
            (
                "",
                "the same in V magnitudes",
                "sky_mag_arcsec2",
                "mag/arcsec²",
            ),
            ("R_SN", "signal over noise that is wanted", "snr", ""),
        ],
    )
}

fn on_the_way(budget: &Budget) -> Vec<Line> {
    let through_air = budget.atmosphere_transmission;
    vec![
        ("X", "airmass", budget.airmass, ""),
        (
            "",
            "part of a star's electrons that the air leaves",
            through_air,
            "",
        ),
        (
            "A",
            "area of the entrance pupil",
            budget.aperture_area_m2,
            "m²",
        ),
        (
            "A_P",
            "solid angle of a pixel",
            budget.pixel_solid_angle_sr,
            "sr",
        ),
        (
            "",
            "the same in square arcseconds",
            budget.pixel_area_arcsec2,
            "arcsec²",
        ),
        (
            "μ",
            "part of a star's light on its brightest pixel",
            budget.peak_share,
            "",
        ),
        (
            "Φ₀",
            "photons of V = 0 above the air",
            budget.mag_0_photons_s_m2,
            "/ s m²",
        ),
        (
            "",
            "electrons of V = 0 on all its pixels",
            budget.mag_0_e_s,
            "e/s",
        ),
        ("M_B", "magnitude as bright as the sky", budget.sky_mag, ""),
    ]
}

fn noise(budget: &Budget) -> Vec<Line> {
    let of_sensor = "noise of the sensor: dark current, reading, rounding";
    vec![
        ("B", "electrons of the sky", budget.background_e, "e"),
        ("n_B", "their shot noise", budget.sky_noise_e, "e"),
        ("", "electrons of the dark current", budget.dark_e, "e"),
        ("", "noise of reading", budget.read_noise_e, "e"),
        (
            "",
            "noise of rounding to grey levels",
            budget.quantisation_noise_e,
            "e",
        ),
        ("N_C", of_sensor, budget.sensor_noise_e, "e"),
        (
            "",
            "noise of sky and sensor",
            budget.background_noise_e,
            "e",
        ),
        ("n_S", "shot noise of the star", budget.star_noise_e, "e"),
        ("N", "all noise", budget.noise_e, "e"),
    ]
}

fn faintest(budget: &Budget) -> Vec<Line> {
    let below = budget.star_illuminance_ground_lx;
    vec![
        (
            "S",
            "its electrons on its brightest pixel",
            budget.star_e,
            "e",
        ),
        ("M_V", "its magnitude", budget.limit_vmag, ""),
        (
            "E",
            "its illuminance above the air",
            budget.star_illuminance_lx,
            "lx",
        ),
        ("E'", "its illuminance below the air", below, "lx"),
        (
            "φ_S",
            "its photons below the air",
            budget.star_photons_s_m2,
            "/ s m²",
        ),
    ]
}

/// One table for each parameter that is swept.
fn sweeps(rows: &[Row]) -> String {
    let mut text = String::new();
    for rows in rows.chunk_by(|a, b| parameter(a) == parameter(b)) {
        let name = parameter(&rows[0]);
        let _ = writeln!(
            text,
            "\n  {name:>26}  {:>7}  {:>7}  {:>10}  {:>12}  {:>10}  {:>8}",
            "limit", "filter", "star e", "background e", "noise e", "airmass"
        );
        for row in rows {
            let prediction = &row.prediction;
            let filter = prediction.detector.limit50_vmag;
            let _ = writeln!(
                text,
                "  {:>26}  {:>7.3}  {:>7}  {:>10}  {:>12}  {:>10}  {:>8}",
                number(row.swept.map_or(f64::NAN, |swept| swept.value)),
                prediction.limit_vmag,
                filter.map_or("none".to_owned(), |limit| format!("{limit:.3}")),
                number(prediction.star_e),
                number(prediction.background_e),
                number(prediction.noise_e),
                number(prediction.airmass),
            );
        }
    }
    text
}

fn parameter(row: &Row) -> &'static str {
    row.swept.map_or("", |swept| swept.parameter)
}
