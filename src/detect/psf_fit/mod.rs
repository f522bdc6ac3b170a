//! The effective PSF of a frame from its bright stars, where a round Gaussian does not describe
//! them.
//!
//! 1. Bright, isolated stars are fitted with a size and an elongation of their own (`stars`).
//! 2. These are fitted by polynomials over the field (`field`).
//! 3. The light of all stars, stretched to one size and elongation, gives the weights of a mixture
//!    of Gaussians (`mixture`).
//! 4. Each half of the stars is compared with the PSF of the other half. The PSF is used where its
//!    residuals are well below those of a round Gaussian; they give the noise model.

mod field;
mod mixture;
mod stars;

use super::candidates::Peak;
use super::effective_psf::{EffectivePsf, FieldForm, FieldFrame, FieldLobe, SpotMoments};
use super::fit::{FitBuffers, FrameMaps, NoiseModel};
use super::psf::MAX_WINDOW_PX;
use super::star_model::{StarModel, noise_of};
use crate::base::statistics::median;
use field::moments_over_field;
use mixture::LobeGrid;
use stars::{PsfStar, StarFitter};

/// Fewer stars than this do not tell the PSF.
const MIN_STARS: usize = 5;
/// Fewer do not tell how its form changes over the field.
const MIN_STARS_OF_FIELD: usize = 12;
/// Rounds of moments over the field and weights of the mixture.
const ROUNDS: usize = 2;
/// Steps of the stars' fits in each round.
const STEPS: usize = 2;
/// Elongations and errors of the spot below this are those of a round Gaussian.
const MIN_ELONGATION: f64 = 0.06;
/// Else the variance by light must fall to this part of that of a round Gaussian.
const MAX_VARIANCE_RATIO: f64 = 0.8;
/// The PSF changes its form over the field where that lowers the variance by light to this part.
const MAX_RADIAL_RATIO: f64 = 0.9;

/// Measures the effective PSF, and sets the noise model to that of its residuals. `None` where a
/// round Gaussian does as well, or too few stars tell.
pub(crate) fn measure_psf(
    maps: &FrameMaps<'_>,
    peaks: &[Peak],
    model: &mut StarModel,
    buffers: &mut FitBuffers,
) -> Option<EffectivePsf> {
    let radius_px = radius_px(maps);
    let mut fitter = StarFitter::new(NoiseModel {
        model_error2: stars::MODEL_ERROR2,
        ..model.noise
    });
    let stars = stars::bright_stars(maps, peaks, radius_px, &mut fitter);
    if stars.len() < MIN_STARS {
        return None;
    }
    let light = typical_light(&stars, maps);
    let variance = |noise: NoiseModel| light * (noise.shot_adu + noise.model_error2 * light);
    let round = variance(noise_of_round(maps, &stars, buffers));
    let mut best = Measured::of(FieldForm::Fixed, maps, stars.clone(), &mut fitter, buffers);
    if stars.len() >= MIN_STARS_OF_FIELD {
        let radial = Measured::of(FieldForm::Radial, maps, stars, &mut fitter, buffers);
        if variance(radial.noise) < MAX_RADIAL_RATIO * variance(best.noise) {
            best = radial;
        }
    }
    let [_, e1, e2] = best.psf.typical;
    let is_better = variance(best.noise) < MAX_VARIANCE_RATIO * round;
    let is_needed = is_better || best.is_varied || e1.hypot(e2) > MIN_ELONGATION;
    if std::env::var("SP_DEBUG").is_ok() {
        eprintln!(
            "form {:?} ratio {:.3} varied {} e {:.2} lobes {}",
            best.psf.form,
            variance(best.noise) / round,
            best.is_varied,
            e1.hypot(e2),
            best.psf.lobes.len()
        );
    }
    is_needed.then(|| {
        model.noise = best.noise;
        best.psf
    })
}

/// A PSF and the noise model of its residuals.
struct Measured {
    psf: EffectivePsf,
    noise: NoiseModel,
    /// Whether size or elongation differ from place to place.
    is_varied: bool,
}

impl Measured {
    fn of(
        form: FieldForm,
        maps: &FrameMaps<'_>,
        mut stars: Vec<PsfStar>,
        fitter: &mut StarFitter,
        buffers: &mut FitBuffers,
    ) -> Self {
        let frame = FieldFrame::of((maps.view.width, maps.view.height));
        let typical = typical_moments(&stars);
        let grid = LobeGrid::of(typical, false);
        let (moments, mut is_varied) = moments_over_field(frame, &stars);
        let mut psf = EffectivePsf {
            lobes: grid.gaussian(),
            form,
            typical,
            moments,
            spot_px: maps.spot_px,
            radius_px: radius_px(maps),
        };
        let mut of_halves = Default::default();
        for _ in 0..ROUNDS {
            for _ in 0..STEPS {
                fitter.step(&mut stars, &psf, true);
                (psf.moments, is_varied) = moments_over_field(frame, &stars);
            }
            of_halves = grid.solve(&mut psf, &stars, fitter);
            for _ in 0..STEPS {
                fitter.step(&mut stars, &psf, false);
            }
        }
        Self {
            noise: noise_of_psf(&psf, of_halves, &stars, buffers),
            psf,
            is_varied,
        }
    }
}

/// Half of the side of the windows, in pixels.
fn radius_px(maps: &FrameMaps<'_>) -> usize {
    /// In standard deviations of a round Gaussian.
    const RADIUS_SIGMAS: f64 = 3.5;
    let radius_px = (RADIUS_SIGMAS * maps.width_px()).ceil() as usize;
    radius_px.clamp(3, (MAX_WINDOW_PX - 1) / 2)
}

/// The median of each of the stars' moments.
fn typical_moments(stars: &[PsfStar]) -> SpotMoments {
    std::array::from_fn(|i| {
        let mut values: Vec<f64> = stars.iter().map(|star| star.moments[i]).collect();
        median(&mut values)
    })
}

/// The light in the brightest pixel of the median star, in ADU.
fn typical_light(stars: &[PsfStar], maps: &FrameMaps<'_>) -> f64 {
    let mut fluxes: Vec<f64> = stars.iter().map(|star| star.spot.flux).collect();
    median(&mut fluxes) * maps.matched_gain
}

/// The noise model of the stars if their spots were round Gaussians of the frame's size.
fn noise_of_round(maps: &FrameMaps<'_>, stars: &[PsfStar], buffers: &mut FitBuffers) -> NoiseModel {
    let windows = stars.iter().map(|star| (star.window.clone(), star.spot));
    let mut windows: Vec<_> = windows.collect();
    noise_of(&mut windows, maps.spot_px, buffers)
}

/// The noise model of the stars, each compared with the PSF from the other half of them.
fn noise_of_psf(
    psf: &EffectivePsf,
    of_halves: [Vec<FieldLobe>; 2],
    stars: &[PsfStar],
    buffers: &mut FitBuffers,
) -> NoiseModel {
    let of_halves = of_halves.map(|lobes| EffectivePsf {
        lobes,
        ..psf.clone()
    });
    let windows = stars.iter().enumerate().map(|(number, star)| {
        let mut window = star.window.clone();
        of_halves[number % 2].at(star.spot.x, star.spot.y, &mut window.psf);
        (window, star.spot)
    });
    let mut windows: Vec<_> = windows.collect();
    noise_of(&mut windows, psf.spot_px, buffers)
}
