//! From the options to a plan.

use super::args::{CentroidingArg, DefocusArgs, Normalisation};
use super::darks::dark_noise;
use crate::cli::exit::CommandError;
use crate::cli::output::messages::report_warning;
use anyhow::{Error, anyhow};
use starpipe::lab::defocus::{Centroiding, DefocusLens, EnergyStudy, PeakStudy, SpotNoiseGrid};
use starpipe::lab::spot_radius::{
    BRIGHTER_THAN_LIMIT_MAG, DarkNoise, DefocusError, DefocusPlan, DefocusStar, Noise, NoiseError,
    default_v_mag,
};
use starpipe::predict::Scenario;

/// The plan that the options ask for.
pub(super) fn plan(
    arguments: &DefocusArgs,
    pool: &rayon::ThreadPool,
) -> Result<DefocusPlan, CommandError> {
    let options = &arguments.scenario;
    let has_camera = options.camera.is_some() || options.preset.is_some();
    let normalisation = arguments.normalisation.unwrap_or(match has_camera {
        true => Normalisation::Energy,
        false => Normalisation::Peak,
    });
    check(arguments, normalisation, has_camera)?;
    let scenario = match has_camera {
        true => Some(options.scenario()?),
        false => None,
    };
    let darks = match &arguments.darks[..] {
        [] => None,
        paths => Some(dark_noise(paths, scenario.as_ref(), pool)?),
    };
    let sheet = scenario.as_ref().map(|scenario| &scenario.camera);
    let lens = sheet.map(|sheet| DefocusLens::of(sheet, arguments.focused_px));
    let present_px = sheet.map(|sheet| sheet.spot_sigma_px);
    let (stars, grid, noise) = match (normalisation, scenario) {
        (Normalisation::Energy, Some(scenario)) => energy(arguments, scenario, darks)?,
        _ => peak(arguments, darks)?,
    };
    Ok(DefocusPlan {
        stars,
        grid,
        noise,
        lens,
        present_px,
        required_px: arguments.required_error.clone(),
        seed: arguments.seed,
    })
}

/// Star, grid and noise of the paper's experiment.
fn peak(
    arguments: &DefocusArgs,
    darks: Option<DarkNoise>,
) -> Result<(Vec<DefocusStar>, SpotNoiseGrid, Noise), Error> {
    let default = PeakStudy::default();
    let star = PeakStudy {
        peak: arguments.peak.unwrap_or(default.peak),
        half_window_px: arguments.half_window_px.into(),
        trials: arguments.count.map_or(default.trials, |n| n as usize),
    };
    let default = SpotNoiseGrid::of_paper();
    let grid = SpotNoiseGrid {
        spots_px: arguments
            .radius_px
            .clone()
            .map_or(default.spots_px, |r| r.0),
        noises: arguments
            .noise_relative
            .clone()
            .map_or(default.noises, |r| r.0),
    };
    let noise = match (darks, arguments.at_noise) {
        (Some(darks), _) => Noise::of_all_pixels(darks).map_err(with_advice)?,
        (None, Some(relative)) => Noise::of_relative(relative, "--at-noise"),
        (None, None) => Noise::of_paper(),
    };
    Ok((vec![DefocusStar::Peak(star)], grid, noise))
}

/// Stars, grid and noise of a camera.
fn energy(
    arguments: &DefocusArgs,
    scenario: Scenario,
    darks: Option<DarkNoise>,
) -> Result<(Vec<DefocusStar>, SpotNoiseGrid, Noise), Error> {
    let noise = match darks {
        Some(darks) => Noise::of_good_pixels(darks, &scenario),
        None => Noise::of_camera(&scenario),
    };
    let noise = noise.map_err(with_advice)?;
    let scenario = noise.replacing_in(scenario);
    let magnitudes = match &arguments.vmag[..] {
        [] => vec![chosen_v_mag(&scenario)?],
        given => given.to_vec(),
    };
    let star = |&v_mag: &f64| {
        let mut star = EnergyStudy::new(scenario.clone(), v_mag);
        star.half_window_px = arguments.half_window_px.into();
        star.centroiding = arguments
            .centroid
            .map_or(star.centroiding, Centroiding::from);
        star.trials = arguments.count.map_or(star.trials, |n| n as usize);
        DefocusStar::Energy(Box::new(star))
    };
    let default = SpotNoiseGrid::around(noise.value());
    let grid = SpotNoiseGrid {
        spots_px: arguments
            .radius_px
            .clone()
            .map_or(default.spots_px, |r| r.0),
        noises: arguments.noise_e.clone().map_or(default.noises, |r| r.0),
    };
    Ok((magnitudes.iter().map(star).collect(), grid, noise))
}

fn chosen_v_mag(scenario: &Scenario) -> Result<f64, Error> {
    let v_mag = default_v_mag(scenario).map_err(|error| match error {
        DefocusError::NoLimit => anyhow!("{error}; give one with --vmag"),
        other => other.into(),
    })?;
    report_warning(chosen_for_you(v_mag));
    Ok(v_mag)
}

/// What is said of a star that nobody chose.
pub(super) fn chosen_for_you(v_mag: f64) -> String {
    format!(
        "no --vmag: the star has V {v_mag}, about {BRIGHTER_THAN_LIMIT_MAG} mag brighter than the camera's limit"
    )
}

/// Adds which option helps.
fn with_advice(error: NoiseError) -> Error {
    match error {
        NoiseError::NoRelativeNoise => {
            anyhow!("{error}; give the bit depth with --camera")
        }
        NoiseError::Zero => anyhow!("{error}: give the noise with --read-noise-e or --darks"),
        other => other.into(),
    }
}

/// Refuses options that contradict each other.
fn check(
    arguments: &DefocusArgs,
    normalisation: Normalisation,
    has_camera: bool,
) -> Result<(), CommandError> {
    let usage = |message: &str| Err(CommandError::Usage(message.to_owned()));
    if !has_camera && !arguments.scenario.parameters.is_empty() {
        return usage(
            "camera parameters are given without a camera: expected --camera or --preset",
        );
    }
    if !has_camera && normalisation == Normalisation::Energy {
        return usage("--normalisation energy needs a camera: expected --camera or --preset");
    }
    let has_other_centroid = arguments
        .centroid
        .is_some_and(|centroid| centroid != CentroidingArg::FixedWindow);
    let of_peak = [
        (arguments.noise_relative.is_some(), "--noise-relative"),
        (arguments.at_noise.is_some(), "--at-noise"),
        (arguments.peak.is_some(), "--peak"),
    ];
    let of_energy = [
        (!arguments.vmag.is_empty(), "--vmag"),
        (arguments.noise_e.is_some(), "--noise-e"),
        (has_other_centroid, "a --centroid other than fixed-window"),
    ];
    let (refused, other) = match normalisation {
        Normalisation::Energy => (of_peak, "peak"),
        Normalisation::Peak => (of_energy, "energy"),
    };
    match refused.iter().find(|(is_given, _)| *is_given) {
        Some((_, option)) => usage(&format!("{option} applies to --normalisation {other} only")),
        None => Ok(()),
    }
}
