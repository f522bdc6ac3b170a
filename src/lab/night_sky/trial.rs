//! A frame, and its cells, compared with the truth.

use super::conditions::TrialConditions;
use super::truth::{TrueCell, TrueNightSky};
use crate::base::format::to_decimals;
use crate::lab::robustness::Answer;
use crate::sky::{Place, SkyCell, SkyMap};
use crate::solve::Solution;
use serde::{Deserialize, Serialize};

/// Decimals of magnitudes, shares and angles.
const DECIMALS: i32 = 4;
/// Cells below are not compared: there the air changes much within one.
const LOWEST_DEG: f64 = 10.0;
/// The cells whose limits are compared are this likely clear.
const SURELY_CLEAR: f64 = 0.9;

/// A frame and its cells.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SkyTrial {
    /// The frame.
    pub frame: TrialFrameRow,
    /// Its cells above 10° of altitude.
    pub cells: Vec<TrialCellRow>,
}

/// What was drawn of a frame, and what was measured. Magnitudes are V; sigmas are stated errors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[expect(missing_docs, reason = "docs/sky.md describes the columns")]
pub struct TrialFrameRow {
    pub frame: u64,
    pub date: String,
    pub sky_mag_arcsec2: f64,
    pub exposure_s: f64,
    pub bits: u32,
    pub gain_e_per_adu: f64,
    pub bias_known: bool,
    pub cloud_mag: f64,
    pub cloud_size_px: f64,
    pub cloud_light: f64,
    pub moon_altitude_deg: f64,
    pub moon_illuminated: f64,
    pub status: Answer,
    pub detected: usize,
    pub named: usize,
    pub measured: bool,
    pub no_brightness: Option<String>,
    pub true_zenith_mag_arcsec2: f64,
    pub zenith_mag_arcsec2: Option<f64>,
    pub zenith_sigma_mag: Option<f64>,
    pub true_extinction_mag: f64,
    pub extinction_mag: Option<f64>,
    pub extinction_sigma_mag: Option<f64>,
    pub scatter_mag: Option<f64>,
    pub true_cloud_share: Option<f64>,
    pub cloud_share: Option<f64>,
    pub cloud_share_sigma: Option<f64>,
    pub limit_difference_mag: Option<f64>,
}

/// What was drawn of a cell, and what was measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[expect(missing_docs, reason = "docs/sky.md describes the columns")]
pub struct TrialCellRow {
    pub frame: u64,
    pub altitude_deg: f64,
    pub azimuth_deg: f64,
    pub true_mag_arcsec2: f64,
    pub mag_arcsec2: Option<f64>,
    pub sigma_mag: Option<f64>,
    pub true_clouds_mag: f64,
    pub clouds_mag: Option<f64>,
    pub clouds_sigma_mag: Option<f64>,
    pub clear: Option<f64>,
    pub clear_low: Option<f64>,
    pub clear_high: Option<f64>,
    pub true_limit_vmag: Option<f64>,
    pub limit_vmag: Option<f64>,
    pub limit_sigma_mag: Option<f64>,
    pub limit_difference_mag: Option<f64>,
}

impl SkyTrial {
    pub(super) fn new(
        number: u64,
        conditions: &TrialConditions,
        solution: &Solution,
        truth: &TrueNightSky,
    ) -> Self {
        let sky = solution.sky.as_ref();
        let cells = sky.map_or(&[][..], |sky| &sky.cells);
        // Their solid angles weigh the share of clouds.
        let (mut behind_sr, mut known_sr) = (0.0, 0.0);
        let mut rows = Vec::new();
        for cell in cells {
            let Some(drawn) = truth.cell(&cell.place, cell.threshold_adu) else {
                continue;
            };
            if cell.clear.is_some() {
                known_sr += cell.solid_angle_sr;
                behind_sr += cell.solid_angle_sr * drawn.cloud_share;
            }
            rows.extend(TrialCellRow::new(number, cell, &drawn));
        }
        rows.retain(|row| row.altitude_deg > LOWEST_DEG);
        let true_cloud_share = (known_sr > 0.0).then(|| decimals(behind_sr / known_sr));
        Self {
            frame: TrialFrameRow {
                true_cloud_share,
                limit_difference_mag: mean_limit_difference(&rows),
                ..TrialFrameRow::new(number, conditions, solution, truth)
            },
            cells: rows,
        }
    }
}

impl TrialFrameRow {
    fn new(
        number: u64,
        conditions: &TrialConditions,
        solution: &Solution,
        truth: &TrueNightSky,
    ) -> Self {
        let sky = solution.sky.as_ref();
        let zenith = sky
            .and_then(|sky| sky.zenith)
            .map(|zenith| zenith.light.mag_arcsec2);
        let extinction = sky.map(|sky| &sky.clear_sky);
        let extinction = extinction.filter(|air| air.is_extinction_measured);
        let extinction = extinction.map(|air| air.extinction_mag);
        let share = sky.and_then(|sky: &SkyMap| sky.cloud_share);
        let found = solution.outcome.identification();
        Self {
            frame: number,
            date: conditions.date().to_iso(),
            sky_mag_arcsec2: decimals(conditions.sky_mag_arcsec2),
            exposure_s: decimals(conditions.exposure_s),
            bits: conditions.bits,
            gain_e_per_adu: decimals(conditions.gain_e_per_adu),
            bias_known: conditions.bias_known,
            cloud_mag: conditions.clouds.mag,
            cloud_size_px: decimals(conditions.clouds.size_px),
            cloud_light: conditions.clouds.light,
            moon_altitude_deg: decimals(conditions.moon.altitude_deg),
            moon_illuminated: decimals(conditions.moon.illuminated),
            status: truth.answer(found),
            detected: solution.sources.len(),
            named: found.map_or(0, |found| found.matches.len()),
            measured: sky.is_some(),
            no_brightness: sky
                .and_then(|sky| sky.no_brightness)
                .map(|no| no.code().to_owned()),
            true_zenith_mag_arcsec2: decimals(truth.zenith_mag_arcsec2()),
            zenith_mag_arcsec2: zenith.map(|mag| decimals(mag.value)),
            zenith_sigma_mag: zenith.map(|mag| decimals(mag.sigma)),
            true_extinction_mag: decimals(conditions.true_extinction_mag),
            extinction_mag: extinction.map(|mag| decimals(mag.value)),
            extinction_sigma_mag: extinction.map(|mag| decimals(mag.sigma)),
            scatter_mag: sky.map(|sky| decimals(sky.clear_sky.scatter_mag)),
            true_cloud_share: None,
            cloud_share: share.map(|share| decimals(share.value)),
            cloud_share_sigma: share.map(|share| decimals(share.sigma)),
            limit_difference_mag: None,
        }
    }
}

impl TrialCellRow {
    fn new(frame: u64, cell: &SkyCell, drawn: &TrueCell) -> Option<Self> {
        let Place::Horizon {
            altitude_deg,
            azimuth_deg,
        } = cell.place
        else {
            return None;
        };
        let middle = |[from, to]: [f64; 2]| decimals(0.5 * (from + to));
        let light = cell.light.map(|light| light.mag_arcsec2);
        let limits = cell.limit_vmag.zip(cell.expected_limit_vmag);
        Some(Self {
            frame,
            altitude_deg: middle(altitude_deg),
            azimuth_deg: middle(azimuth_deg),
            true_mag_arcsec2: decimals(drawn.mag_arcsec2),
            mag_arcsec2: light.map(|mag| decimals(mag.value)),
            sigma_mag: light.map(|mag| decimals(mag.sigma)),
            true_clouds_mag: decimals(drawn.clouds_mag),
            clouds_mag: cell.extinction_mag.map(|mag| decimals(mag.value)),
            clouds_sigma_mag: cell.extinction_mag.map(|mag| decimals(mag.sigma)),
            clear: cell.clear.map(decimals),
            clear_low: cell.clear_band.map(|[low, _]| decimals(low)),
            clear_high: cell.clear_band.map(|[_, high]| decimals(high)),
            true_limit_vmag: Some(decimals(drawn.limit_vmag)).filter(|mag| mag.is_finite()),
            limit_vmag: cell.limit_vmag.map(|limit| decimals(limit.value)),
            limit_sigma_mag: cell.limit_vmag.map(|limit| decimals(limit.sigma)),
            limit_difference_mag: limits.map(|(found, expected)| decimals(found.value - expected)),
        })
    }
}

/// Mean of measured minus expected limits in clear cells.
fn mean_limit_difference(cells: &[TrialCellRow]) -> Option<f64> {
    let clear = cells.iter().filter(|cell| cell.clear > Some(SURELY_CLEAR));
    let differences: Vec<f64> = clear.filter_map(|cell| cell.limit_difference_mag).collect();
    let mean = differences.iter().sum::<f64>() / differences.len() as f64;
    (!differences.is_empty()).then(|| decimals(mean))
}

fn decimals(value: f64) -> f64 {
    to_decimals(value, DECIMALS)
}
