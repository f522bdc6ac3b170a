//! The effective PSF of a frame from its bright stars, where a round Gaussian does not describe
//! them.
//!
//! 1. Bright, isolated stars are fitted with a size and an elongation of their own (`stars`).
//! 2. These are fitted by polynomials over the field (`field`).
//! 3. The light of all stars, stretched to one size and elongation, gives the weights of a mixture
//!    of Gaussians (`component_weights`).
//! 4. Each half of the stars is compared with the PSF of the other half. The PSF is used where its
//!    residuals are well below those of a round Gaussian; they give the noise model.

mod component_weights;
mod field;
mod stars;

use crate::base::statistics::median_of;
use crate::detect::candidates::Peak;
use crate::detect::fit::{FitBuffers, FrameMaps, NoiseModel, SpotEstimate, Window};
use crate::detect::psf::{
    EffectivePsf, FieldForm, FieldFrame, LocalPsf, MAX_WINDOW_PX, SpotMoments,
};
use crate::detect::star_model::{StarModel, noise_of};
use component_weights::{ComponentEquations, ComponentGrid};
use field::moments_over_field;
use stars::{PsfStar, STEPS, StarFitter};

/// Fewer stars than this do not tell the PSF.
const MIN_STARS: usize = 5;
/// Fewer do not tell how its form changes over the field.
const MIN_STARS_OF_FIELD: usize = 12;
/// A form is better than a simpler one where it lowers chi² by this.
const BETTER_CHI2: f64 = 20.0;
/// Spots are no round Gaussians from this elongation on, or where they change over the field,
const MIN_ELONGATION: f64 = 0.15;
/// or where the PSF lowers the variance by light to this part.
const MAX_VARIANCE_RATIO: f64 = 0.8;
/// Sources whose residuals have a larger chi² for each pixel are not alike: no stars.
const MAX_CHI2: f64 = 3.0;

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
    let mut stars = stars::bright_stars(maps, peaks, radius_px, &mut fitter);
    if stars.len() < MIN_STARS {
        return None;
    }
    let windows = stars.iter().map(|star| (star.window.clone(), star.spot));
    let mut round: Vec<(Window, SpotEstimate)> = windows.collect();
    let grid = ComponentGrid::of(typical_moments(&stars));
    let settled = SymmetricPsf::of(&grid, maps, &mut stars, &mut fitter);
    let best = best_of(&grid, &settled, &stars, &mut fitter);
    if are_unlike(best.total_chi2(), &stars) {
        return None;
    }
    // If the spots were round Gaussians of the frame's size.
    let round = noise_of(&mut round, maps.spot_px, buffers);
    let noise = noise_of_psf(&best, &stars, buffers);
    let light = typical_light(&stars, maps);
    let variance = |noise: NoiseModel| light * (noise.shot_adu + noise.model_error2 * light);
    let ratio = variance(noise) / variance(round);
    let [_, e1, e2] = grid.typical;
    let is_other_form = settled.is_varied || libm::hypot(e1, e2) > MIN_ELONGATION;
    let is_needed = ratio < MAX_VARIANCE_RATIO || (is_other_form && ratio < 1.0);
    is_needed.then(|| {
        model.noise = noise;
        best.psf
    })
}

/// Whether stars whose residuals have this chi² are not alike. Their windows are whole.
fn are_unlike(chi2: f64, stars: &[PsfStar]) -> bool {
    let area = |star: &PsfStar| star.window.width * star.window.height;
    let pixels: usize = stars.iter().map(area).sum();
    chi2 >= MAX_CHI2 * pixels as f64
}

/// A point-symmetric PSF with its moments over the field.
struct SymmetricPsf {
    psf: EffectivePsf,
    sums: [ComponentEquations; 2],
    /// Whether size or elongation differ from place to place.
    is_varied: bool,
}

impl SymmetricPsf {
    /// Moves the stars to where they are with it.
    fn of(
        grid: &ComponentGrid,
        maps: &FrameMaps<'_>,
        stars: &mut [PsfStar],
        fitter: &mut StarFitter,
    ) -> Self {
        let frame = FieldFrame::new(maps.view.size());
        let (moments, mut is_varied) = moments_over_field(frame, stars);
        let mut psf = EffectivePsf {
            components: grid.gaussian(),
            form: FieldForm::Symmetric,
            typical: grid.typical,
            moments,
            spot_px: maps.spot_px,
            radius_px: radius_px(maps),
        };
        let mut round = |psf: &mut EffectivePsf, is_last: bool| {
            for _ in 0..STEPS {
                fitter.step(stars, psf, true);
                (psf.moments, is_varied) = moments_over_field(frame, stars);
            }
            let [even, odd] = if is_last {
                grid.sums_of_fixed(psf, stars, fitter)
            } else {
                grid.sums_of_form(psf, &*stars, fitter)
            };
            psf.components = grid.solve(&even.plus(&odd), psf.form);
            fitter.place(stars, psf);
            [even, odd]
        };
        round(&mut psf, false);
        let sums = round(&mut psf, true);
        Self {
            psf,
            sums,
            is_varied,
        }
    }
}

/// A PSF, and those of each half of the stars.
struct PsfCandidate {
    psf: EffectivePsf,
    /// For the stars of even numbers, from the odd ones, and the other way round.
    of_halves: [EffectivePsf; 2],
    /// Of each star with the PSF of the other half.
    chi2: Vec<f64>,
}

impl PsfCandidate {
    fn of(
        grid: &ComponentGrid,
        psf: &EffectivePsf,
        [even, odd]: &[ComponentEquations; 2],
        stars: &[PsfStar],
        fitter: &mut StarFitter,
    ) -> Self {
        let with = |shares: &[f64]| EffectivePsf {
            components: grid.components_of(shares),
            ..psf.clone()
        };
        let shares = grid.weights(&even.plus(odd), psf.form, None);
        // The halves are not far from the whole.
        let of_half =
            |sums: &ComponentEquations| with(&grid.weights(sums, psf.form, Some(&shares)));
        let of_halves = [of_half(odd), of_half(even)];
        let mut chi2 = vec![0.0; stars.len()];
        for (half, psf) in of_halves.iter().enumerate() {
            fitter.tabulate(psf);
            let of_half = stars.iter().zip(&mut chi2).skip(half).step_by(2);
            of_half.for_each(|(star, chi2)| *chi2 = fitter.chi2(star, psf));
        }
        Self {
            chi2,
            psf: with(&shares),
            of_halves,
        }
    }

    /// This, or another one where that is clearly better.
    fn or_better(self, other: Self) -> Self {
        if other.total_chi2() < self.total_chi2() - BETTER_CHI2 {
            other
        } else {
            self
        }
    }

    /// Chi² of all stars.
    fn total_chi2(&self) -> f64 {
        self.chi2.iter().sum()
    }
}

/// The best form of the PSF, the simplest of those that are as good.
fn best_of(
    grid: &ComponentGrid,
    settled: &SymmetricPsf,
    stars: &[PsfStar],
    fitter: &mut StarFitter,
) -> PsfCandidate {
    let SymmetricPsf { psf, sums, .. } = settled;
    let of_form = |form: FieldForm| EffectivePsf {
        form,
        ..psf.clone()
    };
    let mut best = PsfCandidate::of(grid, psf, sums, stars, fitter);
    let fixed = of_form(FieldForm::Fixed);
    best = best.or_better(PsfCandidate::of(grid, &fixed, sums, stars, fitter));
    match of_radial(grid, of_form(FieldForm::Radial), stars, &best, fitter) {
        Some(radial) => best.or_better(radial),
        None => best,
    }
}

/// The PSF of [`FieldForm::Radial`]; `None` where too few stars tell, or a few of them that it is
/// fitted to have no smaller chi² than with the `best` one, which is not fitted to them, or are not
/// alike with either.
fn of_radial(
    grid: &ComponentGrid,
    mut psf: EffectivePsf,
    stars: &[PsfStar],
    best: &PsfCandidate,
    fitter: &mut StarFitter,
) -> Option<PsfCandidate> {
    /// One of so many stars is tried first.
    const TRIED: usize = 3;
    if stars.len() < MIN_STARS_OF_FIELD {
        return None;
    }
    let start = psf.clone();
    let tried = || stars.iter().step_by(TRIED);
    let [even, odd] = grid.sums_of_form(&start, tried(), fitter);
    let of_tried = even.plus(&odd);
    psf.components = grid.solve(&of_tried, psf.form);
    // The stars move to the centres of light of such spots.
    let mut moved: Vec<PsfStar> = tried().cloned().collect();
    fitter.place(&mut moved, &psf);
    let chi2: f64 = moved.iter().map(|star| fitter.chi2(star, &psf)).sum();
    let of_best: f64 = best.chi2.iter().step_by(TRIED).sum();
    let is_hopeless = are_unlike(best.total_chi2(), stars) && are_unlike(chi2, &moved);
    if chi2 >= of_best || is_hopeless {
        return None;
    }
    let others = stars.iter().enumerate().filter(|(i, _)| i % TRIED != 0);
    let [even, odd] = grid.sums_of_form(&start, others.map(|(_, star)| star), fitter);
    psf.components = grid.solve(&of_tried.plus(&even).plus(&odd), psf.form);
    let mut stars = stars.to_vec();
    fitter.place(&mut stars, &psf);
    let sums = grid.sums_of_form(&psf, &stars, fitter);
    Some(PsfCandidate::of(grid, &psf, &sums, &stars, fitter))
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
    let of_moment = |i: usize| median_of(stars.iter().map(|star| star.moments[i]));
    std::array::from_fn(|i| of_moment(i).unwrap_or(0.0))
}

/// The light in the brightest pixel of the median star, in ADU.
fn typical_light(stars: &[PsfStar], maps: &FrameMaps<'_>) -> f64 {
    let flux = median_of(stars.iter().map(|star| star.spot.flux));
    flux.unwrap_or(0.0) * maps.matched_gain
}

/// The noise model of the stars, each compared with the PSF from the other half of them.
fn noise_of_psf(best: &PsfCandidate, stars: &[PsfStar], buffers: &mut FitBuffers) -> NoiseModel {
    let spot_at = |half: usize, x_px: f64, y_px: f64| {
        let mut spot = LocalPsf::default();
        best.of_halves[half].at(x_px, y_px, &mut spot);
        spot.tabulate();
        spot
    };
    let everywhere = best
        .psf
        .is_uniform()
        .then(|| [0, 1].map(|half| spot_at(half, 0.0, 0.0)));
    let windows = stars.iter().enumerate().map(|(number, star)| {
        let half = number % 2;
        let mut window = star.window.clone();
        window.psf = match &everywhere {
            Some(spots) => spots[half].clone(),
            None => spot_at(half, star.spot.x, star.spot.y),
        };
        (window, star.spot)
    });
    let mut windows: Vec<_> = windows.collect();
    noise_of(&mut windows, best.psf.spot_px, buffers)
}
