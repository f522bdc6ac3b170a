//! Predictions as text for people: the budget with the paper's symbols, or a table for each sweep.

use super::budget::Budget;
use super::faintest::Faintest;
use super::prediction::{DetectorReport, Prediction};
use super::rows::PredictionRow;
use super::scenario::Reading;
use crate::base::format::{five_digits, printable};
use serde::Serialize;
use std::fmt::Write as _;

/// A quantity: symbol, description, value, unit.
type Line = (&'static str, &'static str, f64, &'static str);

impl Reading {
    /// The reading in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Paper => "the paper's reading",
            Self::Physical => "physical reading",
        }
    }
}

impl PredictionRow {
    /// `rows` as text of several lines, each with its end: the budget of one scenario, or tables of
    /// sweeps.
    pub fn to_text(rows: &[Self]) -> String {
        match rows {
            [] => String::new(),
            [row, ..] if row.swept.is_none() => row.heading_text() + &row.budget_text(),
            [first, ..] => first.heading_text() + &sweeps_text(rows),
        }
    }

    fn heading_text(&self) -> String {
        let prediction = &self.prediction;
        let preset = self
            .preset
            .map_or(String::new(), |name| format!("{name}: "));
        let reading = prediction.reading.words();
        printable(&format!("{preset}{}, {reading}", prediction.camera)) + "\n"
    }

    fn budget_text(&self) -> String {
        let prediction = &self.prediction;
        let mut text = format!(
            "  limit  V {:.2}: signal-to-noise ratio of {} in the brightest pixel\n",
            prediction.limit_vmag,
            five_digits(prediction.snr),
        );
        for (title, lines) in budget_parts(prediction) {
            let _ = writeln!(text, "\n  {title}");
            for (symbol, description, value, unit) in lines {
                let value = five_digits(value);
                let line = format!("    {symbol:<5} {description:<55} {value:>13} {unit}");
                let _ = writeln!(text, "{}", line.trim_end());
            }
        }
        text += &detectors_text(&prediction.peak_pixel, &prediction.detector);
        text + &self
            .faintest
            .as_ref()
            .map_or_else(String::new, faintest_text)
    }
}

/// A quantity of the budget of a limit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BudgetRow {
    /// The part of the budget that it belongs to.
    pub part: &'static str,
    /// Its symbol in the paper, or empty.
    pub symbol: &'static str,
    /// What it is.
    pub quantity: &'static str,
    /// Its value.
    pub value: f64,
    /// Unit of the value.
    pub unit: &'static str,
}

impl PredictionRow {
    /// The budget of the limit, as the text has it.
    pub fn budget_rows(&self) -> impl Iterator<Item = BudgetRow> {
        let parts = budget_parts(&self.prediction).into_iter();
        parts.flat_map(|(part, lines)| {
            let row = move |(symbol, quantity, value, unit)| BudgetRow {
                part,
                symbol,
                quantity,
                value,
                unit,
            };
            lines.into_iter().map(row)
        })
    }
}

/// The parts of a budget with their titles.
fn budget_parts(prediction: &Prediction) -> [(&'static str, Vec<Line>); 5] {
    [
        ("camera", camera(prediction)),
        ("conditions", conditions(prediction)),
        ("from star to pixel", on_the_way(&prediction.budget)),
        ("noise of the brightest pixel", noise(&prediction.budget)),
        ("star at the limit", faintest_star(&prediction.budget)),
    ]
}

/// What is found of the stars, by both rules.
fn detectors_text(peak: &DetectorReport, filter: &DetectorReport) -> String {
    let mut text = format!(
        "\n  {:<37} {:>20} {:>20}\n",
        "stars detected", "brightest pixel", "matched filter"
    );
    let v_mag = |v_mag: Option<f64>| v_mag.map_or("none".to_owned(), |v_mag| format!("{v_mag:.2}"));
    let values = |d: &DetectorReport| {
        [
            v_mag(d.limit50_vmag),
            v_mag(d.limit90_vmag),
            five_digits(d.threshold_sigma),
            five_digits(d.false_alarms_per_mpx),
        ]
    };
    let names = [
        "50 % of the stars of V",
        "90 % of the stars of V",
        "threshold, in standard deviations",
        "false detections per million pixels",
    ];
    for ((name, peak), filter) in names.iter().zip(values(peak)).zip(values(filter)) {
        let _ = writeln!(text, "    {name:<36} {peak:>19} {filter:>20}");
    }
    text
}

fn faintest_text(faintest: &Faintest) -> String {
    let found = five_digits((faintest.stars_found * 10.0).round() / 10.0);
    let expected = format!("{:.2} ± {:.2}", faintest.mean_vmag, faintest.sigma_mag);
    format!(
        "    {:<36} {found:>40}\n    {:<36} {expected:>40}\n",
        "catalog stars detected in the field", "expected faintest of these, V",
    )
}

/// Lines of parameters, by their names.
fn parameters(
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
    parameters(
        prediction,
        &[
            ("D", "aperture", "aperture_mm", "mm"),
            ("f", "focal length", "focal_length_mm", "mm"),
            (
                "K",
                "peak transmission of the lens",
                "lens_transmission",
                "",
            ),
            ("Q", "peak quantum efficiency", "quantum_efficiency", ""),
            ("", "pixel area", "pixel_area_um2", "µm²"),
            ("", "spot, standard deviation", "spot_sigma_px", "px"),
            ("", "dark current", "dark_current_e_s", "e/s"),
        ],
    )
}

fn conditions(prediction: &Prediction) -> Vec<Line> {
    parameters(
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
            (
                "E_B",
                "sky brightness as illuminance",
                "sky_illuminance_lx",
                "lx",
            ),
            (
                "",
                "sky brightness as luminance",
                "sky_luminance_cd_m2",
                "cd/m²",
            ),
            (
                "",
                "sky brightness in V magnitudes",
                "sky_mag_arcsec2",
                "mag/arcsec²",
            ),
            ("R_SN", "required signal-to-noise ratio", "snr", ""),
        ],
    )
}

fn on_the_way(budget: &Budget) -> Vec<Line> {
    let through_air = budget.atmosphere_transmission;
    vec![
        ("X", "airmass", budget.airmass, ""),
        (
            "",
            "transmission of the atmosphere, weighted by electrons",
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
            "solid angle of a pixel in square arcseconds",
            budget.pixel_area_arcsec2,
            "arcsec²",
        ),
        (
            "μ",
            "fraction of a star's light in its brightest pixel",
            budget.peak_share,
            "",
        ),
        (
            "Φ₀",
            "photons of a star of V = 0 above the atmosphere",
            budget.mag_0_photons_s_m2,
            "/ s m²",
        ),
        (
            "",
            "electrons of a star of V = 0 in all its pixels",
            budget.mag_0_e_s,
            "e/s",
        ),
        (
            "M_B",
            "magnitude of a star with the illuminance of the sky",
            budget.sky_mag,
            "",
        ),
    ]
}

fn noise(budget: &Budget) -> Vec<Line> {
    let of_sensor = "detector noise: dark current, readout, quantization";
    vec![
        (
            "B",
            "electrons from the sky background",
            budget.background_e,
            "e",
        ),
        (
            "n_B",
            "shot noise of the sky background",
            budget.sky_noise_e,
            "e",
        ),
        ("", "electrons from dark current", budget.dark_e, "e"),
        ("", "read noise", budget.read_noise_e, "e"),
        ("", "quantization noise", budget.quantisation_noise_e, "e"),
        ("N_C", of_sensor, budget.sensor_noise_e, "e"),
        (
            "",
            "noise of sky background and detector",
            budget.background_noise_e,
            "e",
        ),
        ("n_S", "shot noise of the star", budget.star_noise_e, "e"),
        ("N", "total noise", budget.noise_e, "e"),
    ]
}

fn faintest_star(budget: &Budget) -> Vec<Line> {
    let below = budget.star_illuminance_ground_lx;
    vec![
        ("S", "electrons in the brightest pixel", budget.star_e, "e"),
        ("M_V", "V magnitude", budget.limit_vmag, ""),
        (
            "E",
            "illuminance above the atmosphere",
            budget.star_illuminance_lx,
            "lx",
        ),
        ("E'", "illuminance below the atmosphere", below, "lx"),
        (
            "φ_S",
            "photons below the atmosphere",
            budget.star_photons_s_m2,
            "/ s m²",
        ),
    ]
}

/// One table for each parameter that is swept.
fn sweeps_text(rows: &[PredictionRow]) -> String {
    let parameter = |row: &PredictionRow| row.swept.map(|swept| swept.parameter);
    let mut text = String::new();
    for rows in rows.chunk_by(|a, b| parameter(a) == parameter(b)) {
        let name = parameter(&rows[0]).unwrap_or_default();
        let _ = writeln!(
            text,
            "\n  {name:>26}  {:>7}  {:>7}  {:>10}  {:>12}  {:>10}  {:>8}",
            "limit", "filter", "star e", "background e", "noise e", "airmass"
        );
        for row in rows {
            text += &row.sweep_line();
        }
    }
    text
}

impl PredictionRow {
    fn sweep_line(&self) -> String {
        let prediction = &self.prediction;
        let filter = prediction.detector.limit50_vmag;
        format!(
            "  {:>26}  {:>7.3}  {:>7}  {:>10}  {:>12}  {:>10}  {:>8}\n",
            five_digits(self.swept.map_or(f64::NAN, |swept| swept.value)),
            prediction.limit_vmag,
            filter.map_or("none".to_owned(), |limit| format!("{limit:.3}")),
            five_digits(prediction.star_e),
            five_digits(prediction.background_e),
            five_digits(prediction.noise_e),
            five_digits(prediction.airmass),
        )
    }
}
