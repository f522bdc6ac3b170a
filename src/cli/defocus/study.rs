//! What is asked for, and the work.

use super::args::{CentroidingArg, DefocusArgs, Normalisation};
use super::noise::{self, Noise};
use crate::cli::exit::CommandError;
use crate::cli::output::messages::report_warning;
use crate::cli::progress::bar;
use anyhow::anyhow;
use indicatif::ProgressBar;
use rayon::prelude::*;
use starpipe::model::defocus::{
    Centroiding, EnergyStudy, ErrorCurve, ErrorGrid, ErrorPoint, Expected, Grid, IsoLine, Lens,
    PeakStudy, Reach, Surface, SurfaceError,
};
use starpipe::model::sensitivity::{Budget, Detector, Rule, Scenario, Spacing};

/// The numbers that a designer is told rest on so many trials at least.
const LEAST_TRIALS: usize = 1000;
/// A star so much brighter than the limit is found at any reasonable radius.
const BRIGHTER_MAG: f64 = 1.5;

/// What stars are measured.
#[derive(Debug, Clone)]
pub(super) enum Star {
    Peak(PeakStudy),
    Energy(Box<EnergyStudy>),
}

impl Star {
    fn measure(&self, grid: Grid, seed: u64, progress: &ProgressBar) -> anyhow::Result<ErrorGrid> {
        let done = || progress.inc(1);
        Ok(match self {
            Self::Peak(study) => ErrorGrid::measure(
                grid,
                seed,
                |spot, noise, random| Ok::<_, anyhow::Error>(study.measure(spot, noise, random)),
                done,
            )?,
            Self::Energy(study) => ErrorGrid::measure(
                grid,
                seed,
                |spot, noise, random| study.measure(spot, noise, random),
                done,
            )?,
        })
    }

    fn with_trials(&self, trials: usize) -> Self {
        let mut star = self.clone();
        match &mut star {
            Self::Peak(study) => study.trials = trials,
            Self::Energy(study) => study.trials = trials,
        }
        star
    }

    pub(super) fn trials(&self) -> usize {
        match self {
            Self::Peak(study) => study.trials,
            Self::Energy(study) => study.trials,
        }
    }

    pub(super) fn v_mag(&self) -> Option<f64> {
        match self {
            Self::Peak(_) => None,
            Self::Energy(study) => Some(study.v_mag),
        }
    }
}

/// All that is asked for.
pub(super) struct Plan {
    pub(super) stars: Vec<Star>,
    pub(super) grid: Grid,
    pub(super) noise: Noise,
    pub(super) lens: Option<Lens>,
    /// The radius that the camera has now.
    pub(super) present_px: Option<f64>,
    pub(super) required_px: Vec<f64>,
    pub(super) seed: u64,
}

/// A radius at the own noise.
pub(super) struct Row {
    pub(super) spot_px: f64,
    pub(super) point: ErrorPoint,
    pub(super) theory: Theory,
}

/// What the error is held against.
pub(super) enum Theory {
    Expected(Expected),
    Reach(Reach),
}

/// What came of one star.
pub(super) struct Study {
    pub(super) star: Star,
    pub(super) errors: ErrorGrid,
    /// The closed form at each point of the grid, where there is one.
    pub(super) expected: Option<Vec<Expected>>,
    pub(super) surface: Result<Surface, SurfaceError>,
    /// Of each noise of the grid.
    pub(super) curves: Vec<Option<ErrorCurve>>,
    /// At the own noise.
    pub(super) rows: Vec<Row>,
    pub(super) own: ErrorCurve,
    pub(super) isolines: Vec<IsoLine>,
}

impl Plan {
    pub(super) fn of(
        arguments: &DefocusArgs,
        pool: &rayon::ThreadPool,
    ) -> Result<Self, CommandError> {
        let has_camera = arguments.scenario.camera.is_some() || arguments.scenario.preset.is_some();
        let normalisation = arguments.normalisation.unwrap_or(match has_camera {
            true => Normalisation::Energy,
            false => Normalisation::Peak,
        });
        check(arguments, normalisation, has_camera)?;
        let scenario = has_camera.then(|| arguments.scenario.scenario());
        let scenario = scenario.transpose()?;
        let darks = noise::of_darks(arguments, scenario.as_ref(), pool)?;
        let lens = scenario
            .as_ref()
            .map(|scenario| Lens::of(&scenario.camera, arguments.focused_px));
        let present_px = scenario
            .as_ref()
            .map(|scenario| scenario.camera.spot_sigma_px);
        let (stars, grid, noise) = match (normalisation, scenario) {
            (Normalisation::Energy, Some(scenario)) => of_energy(arguments, scenario, darks)?,
            _ => of_peak(arguments, darks)?,
        };
        Ok(Self {
            stars,
            grid,
            noise,
            lens,
            present_px,
            required_px: arguments.required_error.clone(),
            seed: arguments.seed,
        })
    }

    /// The noise in the unit of the grid.
    fn own_noise(&self) -> f64 {
        let Noise { relative, e, .. } = self.noise;
        e.or(relative).unwrap_or_default()
    }

    /// Does the work.
    pub(super) fn run(&self, pool: &rayon::ThreadPool) -> Result<Vec<Study>, CommandError> {
        let (spots, noises) = (self.grid.spots_px.len(), self.grid.noises.len());
        let points = self.stars.len() * spots * (noises + 1);
        let progress = bar(
            points as u64,
            "radii and noises {wide_bar} {pos}/{len} {eta}",
        );
        let studies = self
            .stars
            .iter()
            .map(|star| self.study(star, pool, &progress));
        let studies = studies.collect();
        progress.finish_and_clear();
        studies
    }

    fn study(
        &self,
        star: &Star,
        pool: &rayon::ThreadPool,
        progress: &ProgressBar,
    ) -> Result<Study, CommandError> {
        let at_own_noise = Grid {
            spots_px: self.grid.spots_px.clone(),
            noises: vec![self.own_noise()],
        };
        let known = star.with_trials(star.trials().max(LEAST_TRIALS));
        // The row's random numbers are not those of the grid.
        let own = pool.install(|| known.measure(at_own_noise, !self.seed, progress))?;
        let Some(curve) = ErrorCurve::through(own.at_noise(0)) else {
            return Err(self.not_found(star).into());
        };
        let errors = pool.install(|| star.measure(self.grid.clone(), self.seed, progress))?;
        let curves: Vec<_> = pool.install(|| {
            let noises = (0..self.grid.noises.len()).into_par_iter();
            noises
                .map(|number| ErrorCurve::through(errors.at_noise(number)))
                .collect()
        });
        let rows = pool.install(|| {
            let rows = own.grid.spots_px.par_iter().zip(&own.points);
            rows.map(|(&spot_px, &point)| Row {
                spot_px,
                point,
                theory: self.theory(star, spot_px),
            })
            .collect()
        });
        let levels = levels(&errors, &self.required_px);
        let isolines = pool.install(|| {
            let lines = levels.par_iter();
            lines
                .map(|&level| IsoLine::of(&errors, &curves, level))
                .collect()
        });
        Ok(Study {
            star: star.clone(),
            expected: pool.install(|| self.expected(star)),
            surface: Surface::fit(&errors),
            errors,
            curves,
            rows,
            own: curve,
            isolines,
        })
    }

    /// The closed form over the grid, in the order of its points.
    fn expected(&self, star: &Star) -> Option<Vec<Expected>> {
        let Star::Peak(study) = star else {
            return None;
        };
        let of_radius = |&spot_px: &f64| {
            let spot = study.spot(spot_px);
            let noises = self.grid.noises.iter();
            noises
                .map(|&noise| spot.expected(noise))
                .collect::<Vec<_>>()
        };
        let rows: Vec<_> = self.grid.spots_px.par_iter().map(of_radius).collect();
        Some(rows.concat())
    }

    fn theory(&self, star: &Star, spot_px: f64) -> Theory {
        match star {
            Star::Peak(study) => Theory::Expected(study.expected(spot_px, self.own_noise())),
            Star::Energy(study) => Theory::Reach(study.reach(spot_px, self.own_noise())),
        }
    }

    /// Why there is nothing to tell of a star.
    fn not_found(&self, star: &Star) -> anyhow::Error {
        let limits = self.grid.spots_px.iter().filter_map(|&spot_px| match star {
            Star::Energy(study) => study.reach(spot_px, self.own_noise()).limit_vmag,
            Star::Peak(_) => None,
        });
        let limit = limits.fold(f64::NEG_INFINITY, f64::max);
        let v_mag = star.v_mag().unwrap_or(f64::NAN);
        anyhow!(
            "a star of V {v_mag} is found too seldom at these radii to measure it: half of the stars are found at V {limit:.2} at best"
        )
    }
}

/// Stars, grid and noise of the paper's experiment.
fn of_peak(
    arguments: &DefocusArgs,
    darks: Option<noise::DarkNoise>,
) -> Result<(Vec<Star>, Grid, Noise), CommandError> {
    let default = PeakStudy::default();
    let study = PeakStudy {
        peak: arguments.peak.unwrap_or(default.peak),
        half_window_px: arguments.half_window_px.into(),
        trials: arguments
            .trials
            .map_or(default.trials, |trials| trials as usize),
    };
    let grid = Grid {
        spots_px: values(&arguments.radius_px, || {
            Spacing::Linear.values(0.4, 2.4, 200)
        }),
        noises: values(&arguments.noise_relative, || {
            Spacing::Linear.values(2e-4, 20e-4, 100)
        }),
    };
    let noise = Noise::of_peak(arguments, darks)?;
    Ok((vec![Star::Peak(study)], grid, noise))
}

/// Stars, grid and noise of a camera.
fn of_energy(
    arguments: &DefocusArgs,
    mut scenario: Scenario,
    darks: Option<noise::DarkNoise>,
) -> Result<(Vec<Star>, Grid, Noise), CommandError> {
    /// Trials at each point.
    const TRIALS: usize = 400;
    /// The default noises: from that part of the own one to that multiple, and how many.
    const NOISES: (f64, f64, usize) = (0.25, 4.0, 9);
    let noise = Noise::of_energy(&mut scenario, darks)?;
    let own = scenario.camera.read_noise_e;
    let magnitudes = match &arguments.vmag[..] {
        [] => vec![default_v_mag(&scenario)?],
        given => given.to_vec(),
    };
    let star = |&v_mag: &f64| {
        Star::Energy(Box::new(EnergyStudy {
            scenario: scenario.clone(),
            v_mag,
            centroiding: arguments
                .centroid
                .map_or(Centroiding::GaussianFit, Centroiding::from),
            half_window_px: arguments.half_window_px.into(),
            trials: arguments.trials.map_or(TRIALS, |trials| trials as usize),
        }))
    };
    let grid = Grid {
        spots_px: values(&arguments.radius_px, || {
            Spacing::Linear.values(0.2, 2.4, 45)
        }),
        noises: values(&arguments.noise_e, || {
            Spacing::Log.values(NOISES.0 * own, NOISES.1 * own, NOISES.2)
        }),
    };
    Ok((magnitudes.iter().map(star).collect(), grid, noise))
}

fn values(given: &Option<super::args::Range>, default: impl FnOnce() -> Vec<f64>) -> Vec<f64> {
    given.as_ref().map_or_else(default, |range| range.0.clone())
}

/// A star that the camera sees well as it is.
fn default_v_mag(scenario: &Scenario) -> anyhow::Result<f64> {
    let budget = Budget::checked(scenario)?;
    let limit = Detector::new(Rule::MatchedFilter, scenario, &budget).vmag_at(0.5);
    if !limit.is_finite() {
        return Err(anyhow!(
            "the camera has no limit from which a magnitude follows; --vmag gives one"
        ));
    }
    let v_mag = ((limit - BRIGHTER_MAG) * 10.0).round() / 10.0;
    report_warning(format_args!(
        "no --vmag: the star has V {v_mag}, about {BRIGHTER_MAG} brighter than the camera's limit"
    ));
    Ok(v_mag)
}

/// Errors of which lines are drawn: those required, and round ones between what the grid has.
fn levels(errors: &ErrorGrid, required_px: &[f64]) -> Vec<f64> {
    /// The mantissas of round numbers.
    const ROUND: [f64; 3] = [1.0, 2.0, 5.0];
    /// At most so many.
    const MOST: usize = 6;
    let sound = errors.points.iter().filter(|point| point.is_sound());
    let mut sorted: Vec<f64> = sound.map(|point| point.rms_px).collect();
    sorted.sort_by(f64::total_cmp);
    let (Some(&least), Some(&most)) = (sorted.first(), sorted.get(sorted.len() * 19 / 20)) else {
        return required_px.to_vec();
    };
    let decades = -5..2;
    let round = decades.flat_map(|decade| ROUND.map(|mantissa| format!("{mantissa}e{decade}")));
    let round = round.filter_map(|text| text.parse::<f64>().ok());
    let mut levels: Vec<f64> = round
        .filter(|level| (least..most).contains(level))
        .collect();
    levels.truncate(MOST);
    levels.extend(required_px);
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    levels
}

/// Refuses what contradicts itself.
fn check(
    arguments: &DefocusArgs,
    normalisation: Normalisation,
    has_camera: bool,
) -> Result<(), CommandError> {
    let refuse = |given: bool, option: &str, other: &str| match given {
        true => Err(CommandError::Usage(format!(
            "{option} goes with --normalisation {other} only"
        ))),
        false => Ok(()),
    };
    if !has_camera && !arguments.scenario.parameters.is_empty() {
        return Err(CommandError::Usage(
            "numbers of a camera are given, and no camera: expected --camera or --preset"
                .to_owned(),
        ));
    }
    match normalisation {
        Normalisation::Energy => {
            if !has_camera {
                return Err(CommandError::Usage(
                    "--normalisation energy is of a camera: expected --camera or --preset"
                        .to_owned(),
                ));
            }
            refuse(
                arguments.noise_relative.is_some(),
                "--noise-relative",
                "peak",
            )?;
            refuse(arguments.at_noise.is_some(), "--at-noise", "peak")?;
            refuse(arguments.peak.is_some(), "--peak", "peak")
        }
        Normalisation::Peak => {
            refuse(!arguments.vmag.is_empty(), "--vmag", "energy")?;
            refuse(arguments.noise_e.is_some(), "--noise-e", "energy")?;
            let is_other = arguments
                .centroid
                .is_some_and(|centroid| centroid != CentroidingArg::FixedWindow);
            refuse(
                is_other,
                "a centroid other than that of a fixed window",
                "energy",
            )
        }
    }
}
