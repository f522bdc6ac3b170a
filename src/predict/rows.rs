//! Predictions as rows for JSON and CSV: of one scenario, or of each value of a sweep.

use super::check::ScenarioError;
use super::completeness::Detector;
use super::faintest::Faintest;
use super::prediction::Prediction;
use super::scenario::Scenario;
use super::sweep::Sweep;
use crate::camera::data_sheet::{DataSheet, Preset};
use crate::catalog::Catalog;
use rayon::prelude::*;
use serde::Serialize;

/// A prediction with its preset and the swept parameter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PredictionRow {
    /// The prediction.
    #[serde(flatten)]
    pub prediction: Prediction,
    /// The faintest star expected among those of the catalogue, averaged over the sky; not in
    /// sweeps.
    pub faintest: Option<Faintest>,
    /// Name of the preset, if the scenario is one.
    pub preset: Option<&'static str>,
    /// The swept parameter, in sweeps.
    pub swept: Option<SweptValue>,
}

/// A value of the parameter of a sweep.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SweptValue {
    /// Name of the parameter.
    pub parameter: &'static str,
    /// Its value.
    pub value: f64,
}

/// Why a scenario or a value of a sweep has no prediction.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PredictionError {
    /// The scenario is invalid or has no limit.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// The scenario has no limit at a value of the sweep.
    #[error("{} of {}: {error}", .swept.parameter, .swept.value)]
    Swept {
        /// The value.
        swept: SweptValue,
        /// The error.
        error: ScenarioError,
    },
}

impl PredictionRow {
    /// The prediction for `scenario`, with the faintest star expected among those of `catalog`.
    ///
    /// # Errors
    /// [`PredictionError::Scenario`].
    pub fn new(
        scenario: &Scenario,
        preset: Option<Preset>,
        catalog: &Catalog,
    ) -> Result<Self, PredictionError> {
        let (prediction, detector) = Prediction::with_detector(scenario)?;
        Ok(Self {
            prediction,
            faintest: faintest(&scenario.camera, &detector, catalog),
            preset: preset.map(Preset::name),
            swept: None,
        })
    }

    /// The predictions for each value of `sweep`, without the faintest star: it would cost more
    /// than all else.
    ///
    /// # Errors
    /// [`PredictionError`].
    pub fn of_sweep(
        scenario: &Scenario,
        preset: Option<Preset>,
        sweep: &Sweep,
    ) -> Result<Vec<Self>, PredictionError> {
        let row = |(scenario, &value): (&Scenario, &f64)| {
            let swept = SweptValue {
                parameter: sweep.parameter.name(),
                value,
            };
            let prediction = Prediction::new(scenario)
                .map_err(|error| PredictionError::Swept { swept, error })?;
            Ok(Self {
                prediction,
                faintest: None,
                preset: preset.map(Preset::name),
                swept: Some(swept),
            })
        };
        let scenarios = sweep.scenarios(scenario)?;
        let rows: Vec<_> = scenarios.par_iter().zip(&sweep.values).map(row).collect();
        // Collected first: the error is that of the first value, on any number of threads.
        rows.into_iter().collect()
    }

    /// Whether `rows` all have the same limits, by the rule of the brightest pixel and by the
    /// filter.
    pub fn have_same_limits(rows: &[Self]) -> bool {
        let limits = |row: &Self| {
            let prediction = &row.prediction;
            (prediction.limit_vmag, prediction.detector.limit50_vmag)
        };
        rows.windows(2)
            .all(|pair| limits(&pair[0]) == limits(&pair[1]))
    }

    /// The row of a CSV table.
    pub fn table_row(&self) -> PredictionTableRow {
        let prediction = &self.prediction;
        let budget = &prediction.budget;
        PredictionTableRow {
            parameter: self.swept.map(|swept| swept.parameter),
            value: self.swept.map(|swept| swept.value),
            limit_vmag: budget.limit_vmag,
            star_e: budget.star_e,
            background_e: budget.background_e,
            noise_e: budget.noise_e,
            snr: budget.snr,
            airmass: budget.airmass,
            detector_limit50_vmag: prediction.detector.limit50_vmag,
            detector_limit90_vmag: prediction.detector.limit90_vmag,
            peak_limit50_vmag: prediction.peak_pixel.limit50_vmag,
            dark_e: budget.dark_e,
            sensor_noise_e: budget.sensor_noise_e,
            background_noise_e: budget.background_noise_e,
            atmosphere_transmission: budget.atmosphere_transmission,
            sky_mag_arcsec2: budget.sky_mag_arcsec2,
            pixel_area_arcsec2: budget.pixel_area_arcsec2,
            peak_share: budget.peak_share,
            mag_0_e_s: budget.mag_0_e_s,
        }
    }
}

/// The faintest star expected in a field with as many stars as the catalogue has in one on average.
fn faintest(sheet: &DataSheet, detector: &Detector, catalog: &Catalog) -> Option<Faintest> {
    let field_sr = sheet.pixel_solid_angle_sr() * (sheet.width_px * sheet.height_px) as f64;
    let part_of_sky = (field_sr / (4.0 * std::f64::consts::PI)).min(1.0);
    let v_mags = catalog.stars().iter().map(|star| f64::from(star.v_mag));
    Faintest::in_part_of_sky(v_mags, part_of_sky, detector)
}

/// A row of a CSV table, without nested fields.
#[derive(Debug, Clone, Serialize)]
pub struct PredictionTableRow {
    parameter: Option<&'static str>,
    value: Option<f64>,
    limit_vmag: f64,
    star_e: f64,
    background_e: f64,
    noise_e: f64,
    snr: f64,
    airmass: f64,
    detector_limit50_vmag: Option<f64>,
    detector_limit90_vmag: Option<f64>,
    peak_limit50_vmag: Option<f64>,
    dark_e: f64,
    sensor_noise_e: f64,
    background_noise_e: f64,
    atmosphere_transmission: f64,
    sky_mag_arcsec2: f64,
    pixel_area_arcsec2: f64,
    peak_share: f64,
    mag_0_e_s: f64,
}
