//! Variance-weighted least-squares fit of pixel-integrated Gaussians and a local background.
//!
//! Parameters: x, y and flux of each spot, one background, and optionally one spot size. Gauss-Newton
//! with weights 1/v taken from the model of the step before: `v = n² + g·m + (ε·m)²`, where m is the
//! light of the spots, n the background noise, g the shot noise per ADU and ε the relative error of
//! the spot model. The background is the map's, give or take a standard error of its own.
//! For Gaussian and Poisson noise this is maximum likelihood to leading order, and reaches the
//! Cramér-Rao bound for signal-to-noise ratios above about 9.
//!
//! # Reference
//! Mighell 2005, doi 10.1111/j.1365-2966.2005.09208.x, for PSF fitting and its error budget.

use super::normal::{
    Factor, Normal, ONE_SPOT, Pixels, SpotLight, TWO_SPOTS, add_light, add_pixels, flux_variance,
};
use crate::detect::psf::{AxisProfile, LANES, Lanes, MAX_WINDOW_PX, PIXEL_VARIANCE_PX2};
use arrayvec::ArrayVec;

/// The most spots fitted together.
pub(crate) const MAX_SPOTS: usize = 6;
/// Their parameters, the background and the size.
pub(crate) const MAX_PARAMETERS: usize = 3 * MAX_SPOTS + 2;
pub(crate) const MAX_STEPS: usize = 15;
/// Steps shorter than this, in px, end the fit; convergence is quadratic, so little is left after one.
const CONVERGED_PX: f64 = 2e-3;
/// So do steps shorter than this part of the standard error: what is left after them is a fifth of it at most.
const CONVERGED_SIGMA: f64 = 0.1;
/// But no longer than this, in px: sharp spots are far from linear.
const MAX_CONVERGED_PX: f64 = 0.02;
/// The same where the size is free: the flux hangs on it, above all where the core is saturated.
const MAX_CONVERGED_FREE_PX: f64 = 0.005;
/// The first step ends the fit only if it leaves the flux within this part: the weights follow from it.
const SETTLED_FLUX: f64 = 0.02;
/// The longest step, in px: farther, the model is not linear.
const MAX_STEP_PX: f64 = 0.5;
/// The range of free spot sizes, in px.
pub(crate) const SPOT_RANGE_PX: (f64, f64) = (0.2, 12.0);

/// How the variance of a pixel grows with the light of the spots in it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct NoiseModel {
    /// Variance per ADU of light (the inverse gain), in ADU.
    pub shot_adu: f64,
    /// Squared relative error of the spot model.
    pub model_error2: f64,
}

/// The pixels that are fitted.
#[derive(Debug, Clone, Default)]
pub(crate) struct Window {
    /// Column of the first.
    pub x0: usize,
    /// Row of the first.
    pub y0: usize,
    /// Columns, at most [`MAX_WINDOW_PX`].
    pub width: usize,
    /// Rows, at most [`MAX_WINDOW_PX`].
    pub height: usize,
    /// The rows, each in whole groups: above the background map, in units of the noise; NaN is left out, and beyond the end.
    pub data: Vec<Lanes>,
    /// Standard deviation of the background noise, in ADU.
    pub noise_adu: f64,
    /// Standard error of the background map, in ADU.
    pub background_error: f64,
    /// The part of it that is noise, in ADU.
    pub background_noise: f64,
}

impl Window {
    /// Groups of pixels in a row.
    pub fn groups(&self) -> usize {
        self.width.div_ceil(LANES)
    }

    /// The pixel in a column and a row of the window, in units of the noise.
    pub fn at(&self, column: usize, row: usize) -> f64 {
        f64::from(self.data[row * self.groups() + column / LANES][column % LANES])
    }

    /// Column, row and value in ADU of all pixels.
    pub fn pixels_adu(&self) -> impl Iterator<Item = (f64, f64, f64)> {
        let pixels =
            (0..self.height).flat_map(|row| (0..self.width).map(move |column| (column, row)));
        pixels.map(|(column, row)| {
            let value = self.noise_adu * self.at(column, row);
            (column as f64, row as f64, value)
        })
    }

    /// Becomes a copy of another, in the room that there is.
    pub fn copy_from(&mut self, other: &Self) {
        let mut data = std::mem::take(&mut self.data);
        data.clone_from(&other.data);
        *self = Self { data, ..*other };
    }
}

/// One spot: where, and how much light.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Spot {
    /// Column, in pixels.
    pub x: f64,
    /// Row, in pixels.
    pub y: f64,
    /// Light, in ADU.
    pub flux: f64,
    /// Standard error of x, in pixels.
    pub sigma_x: f64,
    /// Standard error of y, in pixels.
    pub sigma_y: f64,
    /// Standard error of the flux, in ADU.
    pub sigma_flux: f64,
    /// The part of it that is noise: without the errors of the spot model and of the halo, in ADU.
    pub noise_flux: f64,
}

/// Spots that are fitted together.
pub(crate) type Spots = ArrayVec<Spot, MAX_SPOTS>;

/// What is fitted, and how.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FitConfig {
    /// Standard deviation of the spot, in pixels; the start where it is free.
    pub spot_px: f64,
    /// Whether the size of the spot is fitted too.
    pub free_spot: bool,
    /// Variance of a pixel.
    pub noise: NoiseModel,
}

/// The result of a fit.
#[derive(Debug, Clone, Default)]
pub(crate) struct Fit {
    /// In the order given.
    pub spots: Spots,
    /// Background above the map, in ADU.
    pub background: f64,
    /// Standard deviation of the spot, in pixels.
    pub spot_px: f64,
    /// Its standard error where it was free, in pixels; else 0.
    pub sigma_spot_px: f64,
    /// How much larger the spot would be if its size were free (one linear step), in pixels.
    pub size_excess_px: f64,
    /// Standard error of that, in pixels.
    pub size_error_px: f64,
    /// Sum of squared deviations over the variance.
    pub chi2: f64,
    /// Pixels fitted less parameters.
    pub degrees: f64,
    /// Whether the steps became small, and the spots stayed within reach of their start.
    pub converged: bool,
}

/// Buffers of the fit.
#[derive(Debug, Clone, Default)]
pub(crate) struct Fitter {
    /// Of each spot, along x and y.
    profiles: Vec<[AxisProfile; 2]>,
    light: Vec<Lanes>,
}

impl Fitter {
    /// Fits the spots, given where they start, to the pixels of `window`.
    ///
    /// At most [`MAX_SPOTS`] spots are fitted. Without convergence the spots are given at their
    /// start, with the standard errors that they would have there.
    pub fn fit(&mut self, window: &Window, start: &[Spot], config: &FitConfig) -> Fit {
        let start = &start[..start.len().min(MAX_SPOTS)];
        match start.len() {
            1 => self.fit_up_to::<ONE_SPOT>(window, start, config),
            2 => self.fit_up_to::<TWO_SPOTS>(window, start, config),
            _ => self.fit_up_to::<MAX_PARAMETERS>(window, start, config),
        }
    }

    /// The fit with at most `N` parameters.
    fn fit_up_to<const N: usize>(
        &mut self,
        window: &Window,
        start: &[Spot],
        config: &FitConfig,
    ) -> Fit {
        let mut fit = Fit {
            spots: start.iter().copied().collect(),
            spot_px: config.spot_px,
            ..Fit::default()
        };
        for step in 0..MAX_STEPS {
            let mut normal: Normal<N> = self.linearise(window, &fit, config);
            match advance(&mut fit, start, &mut normal, step, config) {
                Progress::Goes => {}
                Progress::Settled => return fit,
                Progress::Lost => break,
            }
        }
        let all = 3 * start.len() + 2;
        let fitted = parameter_count(start.len(), config);
        fit.spots = start.iter().copied().collect();
        fit.background = 0.0;
        fit.spot_px = config.spot_px;
        let mut normal: Normal<N> = self.linearise(window, &fit, config);
        let known = if normal.pixels > 0 {
            normal.factorise(all)
        } else {
            0
        };
        finish(&mut fit, &normal, [fitted, known], &[0.0; N]);
        fit
    }

    /// Standard errors of the fluxes from noise alone: the Cramér-Rao bound for a perfect spot model.
    ///
    /// To be called with the window of the fit, right after it.
    pub fn set_flux_noise(&mut self, window: &Window, fit: &mut Fit, config: &FitConfig) {
        if !fit.converged {
            return;
        }
        let noise_only = FitConfig {
            noise: NoiseModel {
                model_error2: 0.0,
                ..config.noise
            },
            ..*config
        };
        if let [spot] = fit.spots.as_slice() {
            // The profiles are those of the last step, a fraction of the standard error away.
            let light = self.light_of(0, spot, window);
            let pixels = pixels_of(window, fit, &noise_only);
            let error2 = window.background_noise * window.background_noise;
            fit.spots[0].noise_flux = flux_variance(&light, &pixels, error2).sqrt();
            return;
        }
        if fit.spots.len() == 2 {
            self.set_flux_noise_up_to::<TWO_SPOTS>(window, fit, &noise_only);
        } else {
            self.set_flux_noise_up_to::<MAX_PARAMETERS>(window, fit, &noise_only);
        }
    }

    /// The same for several spots with at most `N` parameters.
    fn set_flux_noise_up_to<const N: usize>(
        &mut self,
        window: &Window,
        fit: &mut Fit,
        noise_only: &FitConfig,
    ) {
        let mut normal: Normal<N> = self.linearise(window, fit, noise_only);
        let b = 3 * fit.spots.len();
        normal.matrix[b][b] += window.background_noise.powi(-2) - window.background_error.powi(-2);
        // The size is held: that it is imperfectly known is no noise.
        if normal.factorise(b + 1) == b + 1 {
            let variances = normal.variances(b + 1);
            for (i, spot) in fit.spots.iter_mut().enumerate() {
                spot.noise_flux = variances[3 * i + 2].sqrt();
            }
        }
    }

    /// The spots' profiles along both sides of the window.
    fn fill_profiles(&mut self, window: &Window, spots: &[Spot], spot_px: f64) {
        if self.profiles.len() < spots.len() {
            self.profiles.resize_with(spots.len(), Default::default);
        }
        for (spot, [across, down]) in spots.iter().zip(&mut self.profiles) {
            across.fill(spot.x - window.x0 as f64, spot_px, window.width);
            down.fill(spot.y - window.y0 as f64, spot_px, window.height);
        }
    }

    /// The light of the spot whose profiles are number `index`.
    fn light_of(&self, index: usize, spot: &Spot, window: &Window) -> SpotLight<'_> {
        SpotLight {
            flux: (spot.flux / window.noise_adu) as f32,
            axes: &self.profiles[index],
        }
    }

    /// Value above the fitted background, and fitted light, of each pixel with a value, in units of the noise.
    pub fn compare(
        &mut self,
        window: &Window,
        fit: &Fit,
    ) -> impl Iterator<Item = (f64, f64)> + Clone {
        let mut light = std::mem::take(&mut self.light);
        light.clear();
        light.resize(window.data.len(), [0.0; LANES]);
        self.fill_profiles(window, &fit.spots, fit.spot_px);
        for (i, spot) in fit.spots.iter().enumerate() {
            let of_spot = self.light_of(i, spot, window);
            add_light(&of_spot, 1.0, window.groups(), &mut light);
        }
        self.light = light;
        let background = fit.background / window.noise_adu;
        let pixels = window.data.as_flattened().iter();
        let both = pixels.zip(self.light.as_flattened());
        both.filter(|(data, _)| !data.is_nan())
            .map(move |(&data, &light)| (f64::from(data) - background, f64::from(light)))
    }

    /// The direction in which the light about the first spot is drawn out: a unit vector, or `None`.
    pub fn residual_axis(&mut self, window: &Window, fit: &Fit) -> Option<(f64, f64)> {
        let spot = fit.spots[0];
        let (x, y) = (spot.x - window.x0 as f64, spot.y - window.y0 as f64);
        let (mut xx, mut yy, mut xy) = (0.0, 0.0, 0.0);
        for (column, row, value) in window.pixels_adu() {
            let above = value - fit.background - window.noise_adu;
            if above > 0.0 {
                let (dx, dy) = (column - x, row - y);
                xx += above * dx * dx;
                yy += above * dy * dy;
                xy += above * dx * dy;
            }
        }
        let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
        angle.is_finite().then(|| (angle.cos(), angle.sin()))
    }

    /// The normal equations of one spot at `fit`, factorised, and what they are of; `None` where they have no solution.
    pub fn factorised<'a>(
        &'a mut self,
        window: &'a Window,
        fit: &Fit,
        config: &FitConfig,
    ) -> Option<(Factor<ONE_SPOT>, SpotLight<'a>, Pixels<'a>)> {
        let [spot] = fit.spots.as_slice() else {
            return None;
        };
        let mut normal: Normal<ONE_SPOT> = self.linearise(window, fit, config);
        let is_solvable = normal.factorise(ONE_SPOT) == ONE_SPOT;
        is_solvable.then(|| {
            let pixels = pixels_of(window, fit, config);
            (
                normal.factor(&pixels),
                self.light_of(0, spot, window),
                pixels,
            )
        })
    }

    /// Takes the light of spots of this size out of the window.
    pub fn subtract(&mut self, window: &mut Window, spots: &[Spot], spot_px: f64) {
        let groups = window.groups();
        for spot in spots {
            self.fill_profiles(window, &[*spot], spot_px);
            let light = self.light_of(0, spot, window);
            add_light(&light, -1.0, groups, &mut window.data);
        }
    }

    /// The normal equations at `fit`, with the size as the last parameter even where it is not fitted.
    fn linearise<const N: usize>(
        &mut self,
        window: &Window,
        fit: &Fit,
        config: &FitConfig,
    ) -> Normal<N> {
        let mut normal = Normal::empty();
        self.fill_profiles(window, &fit.spots, fit.spot_px);
        let spots = fit.spots.iter().enumerate();
        let lights: ArrayVec<_, MAX_SPOTS> = spots
            .map(|(i, spot)| self.light_of(i, spot, window))
            .collect();
        add_pixels(&mut normal, &lights, &pixels_of(window, fit, config));
        add_background_map(&mut normal, window, fit);
        normal
    }
}

/// Adds what the map knows of the background.
pub(crate) fn add_background_map<const N: usize>(
    normal: &mut Normal<N>,
    window: &Window,
    fit: &Fit,
) {
    let b = 3 * fit.spots.len();
    let weight = 1.0 / (window.background_error * window.background_error);
    normal.matrix[b][b] += weight;
    normal.right[b] -= weight * fit.background;
    normal.chi2 += weight * fit.background * fit.background;
}

/// The pixels of a window, and what the fit adds to the light in them.
pub(crate) fn pixels_of<'a>(window: &'a Window, fit: &Fit, config: &FitConfig) -> Pixels<'a> {
    let per_noise = 1.0 / window.noise_adu;
    Pixels {
        data: &window.data,
        groups: window.groups(),
        per_noise,
        background: (fit.background * per_noise) as f32,
        variance: [
            (config.noise.shot_adu * per_noise) as f32,
            config.noise.model_error2 as f32,
        ],
    }
}

/// Three for each spot, the background, and the size where it is free.
fn parameter_count(spots: usize, config: &FitConfig) -> usize {
    3 * spots + 1 + usize::from(config.free_spot)
}

/// What became of a fit with a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Progress {
    /// There is more to do.
    Goes,
    /// The step was small: the fit has its result.
    Settled,
    /// The equations have no solution, or lead away from the start.
    Lost,
}

/// Takes the step number `step` from the equations at `fit`; where it is the last, with the standard errors.
pub(crate) fn advance<const N: usize>(
    fit: &mut Fit,
    start: &[Spot],
    normal: &mut Normal<N>,
    step: usize,
    config: &FitConfig,
) -> Progress {
    let fitted = parameter_count(start.len(), config);
    // The first step is hardly ever the last: what the size would be is not asked yet.
    let is_rough = step == 0 && start.len() == 1 && !config.free_spot;
    let all = if is_rough {
        fitted
    } else {
        3 * start.len() + 2
    };
    let information = (0..start.len()).flat_map(|i| [3 * i, 3 * i + 1]);
    let information = information.map(|i| normal.matrix[i][i]).fold(0.0, f64::max);
    let known = normal.factorise(all);
    if known < fitted {
        return Progress::Lost;
    }
    let change = normal.solve(fitted);
    let flux_kept =
        (0..start.len()).all(|i| change[3 * i + 2].abs() <= SETTLED_FLUX * fit.spots[i].flux.abs());
    let length = apply(fit, &change, config);
    let reach2 = (1.0 + config.spot_px).powi(2);
    let strayed = fit.spots.iter().zip(start).any(|(now, then)| {
        let distance2 = (now.x - then.x).powi(2) + (now.y - then.y).powi(2);
        !(distance2 <= reach2 && now.flux.is_finite())
    });
    if strayed {
        return Progress::Lost;
    }
    let longest = if config.free_spot {
        MAX_CONVERGED_FREE_PX
    } else {
        MAX_CONVERGED_PX
    };
    let enough = (CONVERGED_SIGMA / information.sqrt()).clamp(CONVERGED_PX, longest);
    if length < enough && (step > 0 || flux_kept) && !is_rough {
        fit.converged = true;
        finish(fit, normal, [fitted, known], &change);
        return Progress::Settled;
    }
    Progress::Goes
}

/// Adds a step, shortened where it is too long; returns the length of the longest move in px.
fn apply(fit: &mut Fit, change: &[f64], config: &FitConfig) -> f64 {
    let spots = fit.spots.len();
    let squares = (0..spots).map(|i| change[3 * i].powi(2) + change[3 * i + 1].powi(2));
    let mut length = squares.fold(0.0, f64::max).sqrt();
    let factor = (MAX_STEP_PX / length).min(1.0);
    for (i, spot) in fit.spots.iter_mut().enumerate() {
        spot.x += factor * change[3 * i];
        spot.y += factor * change[3 * i + 1];
        spot.flux += factor * change[3 * i + 2];
    }
    fit.background += factor * change[3 * spots];
    if config.free_spot {
        let size = (fit.spot_px + factor * change[3 * spots + 1])
            .clamp(0.6 * fit.spot_px, 1.6 * fit.spot_px)
            .clamp(SPOT_RANGE_PX.0, SPOT_RANGE_PX.1);
        length = length.max((size - fit.spot_px).abs());
        fit.spot_px = size;
    }
    length
}

/// Standard errors, chi² and the size's excess from the last linearised step.
///
/// Of `fitted` parameters, and the size if it was not one, the first `known` are determined.
fn finish<const N: usize>(
    fit: &mut Fit,
    normal: &Normal<N>,
    [fitted, known]: [usize; 2],
    change: &[f64; N],
) {
    let spots = fit.spots.len();
    let all = 3 * spots + 2;
    fit.degrees = normal.pixels as f64 + 2.0 - all as f64;
    // The step took chi² down by its product with the gradient.
    let gain: f64 = (0..fitted).map(|i| change[i] * normal.right[i]).sum();
    fit.chi2 = normal.chi2 - gain;
    let variances = if known >= fitted {
        normal.variances(fitted)
    } else {
        [f64::INFINITY; N]
    };
    for (i, spot) in fit.spots.iter_mut().enumerate() {
        spot.sigma_x = variances[3 * i].sqrt();
        spot.sigma_y = variances[3 * i + 1].sqrt();
        spot.sigma_flux = variances[3 * i + 2].sqrt();
        spot.noise_flux = spot.sigma_flux;
    }
    fit.sigma_spot_px = variances[all - 1].sqrt();
    // The size comes last: the leading block of the factor is that of a fit without it.
    if known == all {
        fit.size_excess_px = normal.solve_last(all);
        fit.size_error_px = normal.inverse[all - 1].sqrt();
    }
}

/// The half side of a window for a spot, in pixels: three standard deviations.
pub(crate) fn window_radius(spot_px: f64) -> usize {
    let width_px = (spot_px * spot_px + PIXEL_VARIANCE_PX2).sqrt();
    ((3.0 * width_px).ceil() as usize).clamp(2, (MAX_WINDOW_PX - 1) / 2)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn window_with(spots: &[Spot], sigma: f64, side: usize) -> Window {
        let in_row = |i: usize| if i < side { 0.0 } else { f32::NAN };
        let mut window = Window {
            width: side,
            height: side,
            data: vec![std::array::from_fn(in_row); side],
            noise_adu: 5.0,
            background_error: 1.0,
            background_noise: 1.0,
            ..Window::default()
        };
        let negative = spots.iter().map(|spot| Spot {
            flux: -spot.flux,
            ..*spot
        });
        let negative: Spots = negative.collect();
        Fitter::default().subtract(&mut window, &negative, sigma);
        window
    }

    fn spot(x: f64, y: f64, flux: f64) -> Spot {
        Spot {
            x,
            y,
            flux,
            ..Spot::default()
        }
    }

    const CONFIG: FitConfig = FitConfig {
        spot_px: 0.9,
        free_spot: false,
        noise: NoiseModel {
            shot_adu: 1.0,
            model_error2: 0.0,
        },
    };

    #[test]
    fn a_noise_free_spot_is_found_exactly() {
        let truth = spot(5.3, 4.8, 4000.0);
        let window = window_with(&[truth], 0.9, 11);
        let fit = Fitter::default().fit(&window, &[spot(5.0, 5.0, 3000.0)], &CONFIG);
        assert!(fit.converged);
        assert!((fit.spots[0].x - 5.3).abs() < 1e-5 && (fit.spots[0].y - 4.8).abs() < 1e-5);
        assert!((fit.spots[0].flux / 4000.0 - 1.0).abs() < 1e-4);
    }

    #[test]
    fn a_free_size_is_found_too() {
        let window = window_with(&[spot(5.3, 4.8, 4000.0)], 1.4, 13);
        let config = FitConfig {
            free_spot: true,
            ..CONFIG
        };
        let fit = Fitter::default().fit(&window, &[spot(5.0, 5.0, 3000.0)], &config);
        assert!(fit.converged && (fit.spot_px - 1.4).abs() < 1e-3, "{fit:?}");
    }

    #[test]
    fn touching_spots_are_told_apart() {
        let truth = [spot(4.6, 6.0, 3000.0), spot(7.1, 6.4, 2000.0)];
        let window = window_with(&truth, 0.9, 13);
        let start = [spot(5.0, 6.0, 2500.0), spot(7.0, 6.0, 2500.0)];
        let fit = Fitter::default().fit(&window, &start, &CONFIG);
        for (found, true_spot) in fit.spots.iter().zip(truth) {
            assert!((found.x - true_spot.x).abs() < 1e-3 && (found.y - true_spot.y).abs() < 1e-3);
        }
    }

    #[test]
    fn without_data_there_is_no_result_and_no_panic() {
        let mut window = window_with(&[], 0.9, 9);
        window.data.fill([f32::NAN; LANES]);
        let fit = Fitter::default().fit(&window, &[spot(4.0, 4.0, 1.0)], &CONFIG);
        assert!(!fit.converged && fit.spots[0].sigma_x.is_infinite());
    }
}
