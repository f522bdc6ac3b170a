//! Predictions and studies. Their results are the program's JSON.

use crate::camera::Stated;
use crate::catalogs;
use crate::darks::Darks;
use crate::errors::{detached, exception, json};
use crate::interrupt::on_threads;
use pyo3::prelude::*;
use rayon::prelude::*;
use serde::Serialize;
use starpipe::identify::Photometry;
use starpipe::lab::robustness::{
    CaseResult, Mirrored, ProtocolCase, TrialProtocol, TrialResults, run_one, standard_cases,
};
use starpipe::lab::spot_radius::{Caller, DarkNoise, DefocusPlan, DefocusReport, Noise};
use starpipe::lab::validation::{self, Accumulator, FrameRecord, StarRecord, Validator};
use starpipe::predict::PredictionRow;
use starpipe::{Catalog, Interrupted, Workspace};
use std::num::NonZeroUsize;
use std::path::PathBuf;

/// The limiting magnitude of a camera.
#[pyfunction]
pub fn limit(py: Python<'_>, stated: Stated) -> PyResult<String> {
    let scenario = stated.scenario()?;
    detached(py, || {
        let row = PredictionRow::new(&scenario, stated.preset(), Catalog::built_in());
        json(&row.map_err(exception)?)
    })
}

/// The tables and the summary of a validation, as JSON.
#[derive(Serialize)]
struct Validation {
    summary: validation::ValidationSummary,
    frames: Vec<FrameRecord>,
    stars: Vec<StarRecord>,
}

/// Simulates frames at random attitudes, solves them, and compares them with the truth.
#[pyfunction]
#[pyo3(signature = (stated, catalog, frames, seed, scale_known, threads))]
pub fn validate(
    py: Python<'_>,
    stated: Stated,
    catalog: Option<PathBuf>,
    frames: u64,
    seed: u64,
    scale_known: bool,
    threads: NonZeroUsize,
) -> PyResult<String> {
    let protocol = validation::ValidationProtocol {
        site: None,
        setup: stated.setup()?,
        scale_known,
        seed,
    };
    on_threads(py, threads, |interrupt| {
        let indexed = catalogs::open((catalog, None), interrupt)?;
        let validator = Validator::new(indexed, &protocol).map_err(exception)?;
        let mut all = Accumulator::new(validator.facts(), validator.limit_vmag());
        let (mut frame_rows, mut star_rows) = (Vec::new(), Vec::new());
        let solve = |workspace: &mut Workspace, number| {
            interrupt.check().map_err(exception)?;
            validator.run_one(number, workspace).map_err(exception)
        };
        let solved = (0..frames)
            .into_par_iter()
            .map_init(|| Workspace::new().with_interrupt(interrupt), solve)
            .collect::<PyResult<Vec<_>>>()?;
        for solved in solved {
            all.add_frame(&solved.frame);
            solved.stars.iter().for_each(|star| all.add_star(star));
            frame_rows.push(solved.frame);
            star_rows.extend(solved.stars);
        }
        json(&Validation {
            summary: all.finish(),
            frames: frame_rows,
            stars: star_rows,
        })
    })
}

/// The lists of a robustness study.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Lists {
    fov_deg: Option<f64>,
    stars: f64,
    centroid_error_px: f64,
    mag_error: f64,
    missing_percent: f64,
    false_stars_percent: f64,
    scale_error_percent: Option<f64>,
    shape: [usize; 2],
}

/// Identifies simulated lists of centroids: the standard table, or one row where a field of view is
/// given.
#[pyfunction]
#[pyo3(signature = (lists, catalog, trials, seed, threads))]
pub fn robustness(
    py: Python<'_>,
    lists: Lists,
    catalog: Option<PathBuf>,
    trials: u64,
    seed: u64,
    threads: NonZeroUsize,
) -> PyResult<String> {
    const MIN_TRUE_STARS: usize = 8;
    let [height_px, width_px] = lists.shape;
    let base = TrialProtocol {
        fov_deg: lists.fov_deg.unwrap_or_default(),
        width_px,
        height_px,
        mean_stars: lists.stars,
        centroid_sigma_px: lists.centroid_error_px,
        mag_sigma: lists.mag_error,
        missing: lists.missing_percent / 100.0,
        false_stars: lists.false_stars_percent / 100.0,
        bright_false_stars: 0,
        scale_error: lists.scale_error_percent.map(|percent| percent / 100.0),
        mirrored: Mirrored::Half,
        photometry: Photometry::Instrumental,
    };
    let cases = match lists.fov_deg {
        None => standard_cases(&base),
        Some(fov_deg) => vec![ProtocolCase {
            label: format!("{fov_deg}° field"),
            protocol: base,
        }],
    };
    on_threads(py, threads, |interrupt| {
        let indexed = catalogs::open((catalog, None), interrupt)?;
        let mut rows = Vec::new();
        for case in &cases {
            let trial = |number| {
                interrupt.check()?;
                Ok(run_one(indexed, &case.protocol, seed, number))
            };
            let results = (0..trials).into_par_iter().map(trial);
            let results = results
                .collect::<Result<Vec<_>, Interrupted>>()
                .map_err(exception)?;
            let results = TrialResults::new(results);
            rows.push(CaseResult::new(case, &results, MIN_TRUE_STARS));
        }
        json(&rows)
    })
}

/// The error of centroids over the radius of the spot: of a camera, or of the paper's experiment.
#[pyfunction]
#[pyo3(signature = (stated, darks, vmag, required_error_px, trials, seed, threads))]
pub fn defocus(
    py: Python<'_>,
    stated: Option<Stated>,
    darks: Option<PyRef<'_, Darks>>,
    vmag: Vec<f64>,
    required_error_px: Vec<f64>,
    trials: Option<usize>,
    seed: u64,
    threads: NonZeroUsize,
) -> PyResult<String> {
    let noise = |exposure_s| {
        let darks = darks.as_ref();
        darks.map(|darks| DarkNoise::at_exposure(&darks.measured, exposure_s))
    };
    let plan = match stated {
        Some(stated) => of_camera(stated, noise, &vmag, trials)?,
        None => of_paper(noise(None), trials)?,
    };
    let plan = DefocusPlan {
        required_px: required_error_px,
        seed,
        ..plan
    };
    on_threads(py, threads, |interrupt| {
        let caller = Caller {
            done: &|| (),
            interrupt,
        };
        let studies = plan.run(&caller).map_err(exception)?;
        json(&DefocusReport::new(&plan, &studies))
    })
}

fn of_camera(
    stated: Stated,
    noise: impl Fn(Option<f64>) -> Option<DarkNoise>,
    vmag: &[f64],
    trials: Option<usize>,
) -> PyResult<DefocusPlan> {
    let scenario = stated.scenario()?;
    let noise = match noise(Some(scenario.conditions.exposure_s)) {
        Some(darks) => Noise::of_good_pixels(darks, &scenario),
        None => Noise::of_camera(&scenario),
    };
    let noise = noise.map_err(exception)?;
    let plan = DefocusPlan::of_camera(scenario, noise, vmag).map_err(exception)?;
    Ok(with_trials(plan, trials))
}

fn of_paper(darks: Option<DarkNoise>, trials: Option<usize>) -> PyResult<DefocusPlan> {
    let noise = match darks {
        Some(darks) => Noise::of_all_pixels(darks).map_err(exception)?,
        None => Noise::of_paper(),
    };
    Ok(with_trials(DefocusPlan::of_paper(noise), trials))
}

fn with_trials(plan: DefocusPlan, trials: Option<usize>) -> DefocusPlan {
    match trials {
        Some(trials) => plan.with_trials(trials),
        None => plan,
    }
}
