//! Fits spots to the pixels of a window.

use super::gauss_newton::{MAX_STEPS, StepOutcome, add_background_map, advance, finish, is_rough};
use super::light::{GaussianLight, add_light};
use super::mixture_light::{MixtureImage, MixtureLight};
use super::normal::{CholeskyFactor, NormalEquations};
use super::parameters::{
    FitConfig, MAX_PARAMETERS, MAX_SPOTS, NoiseModel, ONE_SPOT, SpotEstimate, SpotFit, SpotGroup,
    TWO_SPOTS,
};
use super::sums::{SumBuffers, WindowPixels, add_pixels, flux_variance};
use super::window::Window;
use crate::detect::psf::{AxisProfile, GROUP_PX, LIGHT, LIGHT_BY_ALL, LIGHT_BY_PLACE, PixelGroup};
use arrayvec::ArrayVec;

/// The light of a spot of either kind.
#[derive(Debug, Clone, Copy)]
pub(crate) enum AnyLight<'a> {
    /// A round Gaussian.
    Gaussian(GaussianLight<'a>),
    /// An effective PSF.
    Mixture(MixtureLight<'a>),
}

impl AnyLight<'_> {
    /// Adds `sign` times the light to pixels.
    fn add_to(&self, pixels: &mut [PixelGroup], sign: f32, groups: usize) {
        match self {
            Self::Gaussian(light) => add_light(light, sign, groups, pixels),
            Self::Mixture(light) => add_light(light, sign, groups, pixels),
        }
    }
}

/// Fits spots; holds the buffers.
#[derive(Debug, Clone, Default)]
pub(crate) struct Fitter {
    /// Of each spot, where it is a Gaussian: its profiles along x and y.
    profiles: Vec<[AxisProfile; 2]>,
    /// Of each spot, where it is not: its pixels.
    images: Vec<MixtureImage>,
    light: Vec<PixelGroup>,
    sums: SumBuffers,
}

impl Fitter {
    /// Fits at most [`MAX_SPOTS`] spots to the pixels of `window`, beginning at `start`.
    ///
    /// Without convergence the result is `start`, with the standard errors for these parameters.
    pub fn fit(&mut self, window: &Window, start: &[SpotEstimate], config: &FitConfig) -> SpotFit {
        let start = &start[..start.len().min(MAX_SPOTS)];
        match start.len() {
            1 => self.fit_up_to::<ONE_SPOT>(window, start, config, f64::INFINITY),
            2 => self.fit_up_to::<TWO_SPOTS>(window, start, config, f64::INFINITY),
            _ => self.fit_up_to::<MAX_PARAMETERS>(window, start, config, f64::INFINITY),
        }
    }

    /// [`Self::fit`] of two spots that is given up where it does not lead to a chi² below `most_chi2`.
    pub fn fit_pair_below(
        &mut self,
        window: &Window,
        start: &[SpotEstimate; 2],
        config: &FitConfig,
        most_chi2: f64,
    ) -> SpotFit {
        self.fit_up_to::<TWO_SPOTS>(window, start, config, most_chi2)
    }

    /// [`Self::fit`] with at most `N` parameters, and [`Self::fit_pair_below`].
    fn fit_up_to<const N: usize>(
        &mut self,
        window: &Window,
        start: &[SpotEstimate],
        config: &FitConfig,
        most_chi2: f64,
    ) -> SpotFit {
        /// Steps before the chi² that the linear equations predict tells where a fit leads to,
        const PATIENCE: usize = 3;
        /// within this factor.
        const MISSED: f64 = 1.5;
        let mut fit = SpotFit {
            spots: start.iter().copied().collect(),
            spot_px: config.spot_px,
            ..SpotFit::default()
        };
        for step in 0..MAX_STEPS {
            let mut normal: NormalEquations<N> = if is_rough(step, start.len(), config) {
                self.linearise_place(window, &fit, config)
            } else {
                self.linearise(window, &fit, config)
            };
            match advance(&mut fit, start, &mut normal, step, config) {
                StepOutcome::Continue if step + 1 < PATIENCE => {}
                StepOutcome::Continue if fit.chi2 > MISSED * most_chi2 => return fit,
                StepOutcome::Continue => {}
                StepOutcome::Converged => return fit,
                StepOutcome::Failed => break,
            }
        }
        self.unfitted_up_to::<N>(window, start, config)
    }

    /// The initial guess of a spot that cannot be fitted, with the standard errors for these
    /// parameters.
    pub fn unfitted(
        &mut self,
        window: &Window,
        start: SpotEstimate,
        config: &FitConfig,
    ) -> SpotFit {
        self.unfitted_up_to::<ONE_SPOT>(window, &[start], config)
    }

    /// [`Self::unfitted`] of several spots with at most `N` parameters.
    fn unfitted_up_to<const N: usize>(
        &mut self,
        window: &Window,
        start: &[SpotEstimate],
        config: &FitConfig,
    ) -> SpotFit {
        let mut fit = SpotFit {
            spots: start.iter().copied().collect(),
            spot_px: config.spot_px,
            ..SpotFit::default()
        };
        let mut normal: NormalEquations<N> = self.linearise(window, &fit, config);
        let known = if normal.pixels > 0 {
            normal.factorise(3 * start.len() + 2)
        } else {
            0
        };
        let fitted = config.parameter_count(start.len());
        fit.chi2 = normal.chi2;
        finish(&mut fit, &normal, fitted, known);
        fit
    }

    /// Chi² of a single spot a linear step from `spot`, and the number of pixels.
    pub fn chi2_near(
        &mut self,
        window: &Window,
        spot: SpotEstimate,
        config: &FitConfig,
    ) -> (f64, usize) {
        let fit = SpotFit {
            spots: SpotGroup::from_iter([spot]),
            spot_px: config.spot_px,
            ..SpotFit::default()
        };
        let mut normal: NormalEquations<ONE_SPOT> = self.linearise(window, &fit, config);
        let fitted = config.parameter_count(1);
        let mut chi2 = normal.chi2;
        if normal.factorise(fitted) == fitted {
            let change = normal.solve(fitted);
            let gain = change.iter().zip(normal.right).map(|(c, r)| c * r);
            chi2 -= gain.take(fitted).sum::<f64>();
        }
        (chi2, normal.pixels)
    }

    /// Sets the standard errors of the fluxes from noise alone: the Cramér-Rao bound for a perfect
    /// spot model.
    ///
    /// Call it right after [`Self::fit`], with the same window.
    pub fn set_flux_noise(&mut self, window: &Window, fit: &mut SpotFit, config: &FitConfig) {
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
            // The light is that before the last step, a fraction of the standard error away.
            let pixels = WindowPixels::new(window, fit.background, &noise_only.noise);
            let error2 = window.background_noise * window.background_noise;
            let variance = match self.light_of(0, spot, window) {
                AnyLight::Gaussian(light) => flux_variance(&light, &pixels, error2),
                AnyLight::Mixture(light) => flux_variance(&light, &pixels, error2),
            };
            fit.spots[0].noise_flux = variance.sqrt();
            return;
        }
        if fit.spots.len() == 2 {
            self.set_flux_noise_up_to::<TWO_SPOTS>(window, fit, &noise_only);
        } else {
            self.set_flux_noise_up_to::<MAX_PARAMETERS>(window, fit, &noise_only);
        }
    }

    /// [`Self::set_flux_noise`] for several spots with at most `N` parameters.
    fn set_flux_noise_up_to<const N: usize>(
        &mut self,
        window: &Window,
        fit: &mut SpotFit,
        noise_only: &FitConfig,
    ) {
        let mut normal: NormalEquations<N> = self.linearise(window, fit, noise_only);
        let b = 3 * fit.spots.len();
        normal.matrix[b][b] += window.background_noise.powi(-2) - window.background_error.powi(-2);
        // The size is held: its error is not noise.
        if normal.factorise(b + 1) == b + 1 {
            let variances = normal.variances(b + 1);
            for (i, spot) in fit.spots.iter_mut().enumerate() {
                spot.noise_flux = variances[3 * i + 2].sqrt();
            }
        }
    }

    /// Computes the light of the spots of one size in the window; of that of an effective PSF only the
    /// first `PARTS` of its shares.
    fn draw<const PARTS: usize>(&mut self, window: &Window, spots: &[SpotEstimate], spot_px: f64) {
        let Self {
            profiles, images, ..
        } = self;
        if window.psf.is_gaussian() {
            if profiles.len() < spots.len() {
                profiles.resize_with(spots.len(), Default::default);
            }
            for (spot, [across, down]) in spots.iter().zip(profiles) {
                across.fill(spot.x - window.x0 as f64, spot_px, window.width);
                down.fill(spot.y - window.y0 as f64, spot_px, window.height);
            }
        } else {
            if images.len() < spots.len() {
                images.resize_with(spots.len(), Default::default);
            }
            for (spot, image) in spots.iter().zip(images) {
                image.draw::<PARTS>(window, [spot.x, spot.y], spot_px);
            }
        }
    }

    /// The light of the spot that was drawn at this index.
    fn light_of(&self, index: usize, spot: &SpotEstimate, window: &Window) -> AnyLight<'_> {
        if window.psf.is_gaussian() {
            AnyLight::Gaussian(self.gaussian_light(index, spot, window))
        } else {
            AnyLight::Mixture(self.mixture_light(index, spot, window))
        }
    }

    fn gaussian_light(
        &self,
        index: usize,
        spot: &SpotEstimate,
        window: &Window,
    ) -> GaussianLight<'_> {
        GaussianLight {
            flux: (spot.flux / window.noise_adu) as f32,
            axes: &self.profiles[index],
        }
    }

    fn mixture_light(
        &self,
        index: usize,
        spot: &SpotEstimate,
        window: &Window,
    ) -> MixtureLight<'_> {
        let flux = (spot.flux / window.noise_adu) as f32;
        self.images[index].light(flux, window.groups())
    }

    /// Value above the fitted background, and fitted light, of each pixel that is not left out, in
    /// units of the noise.
    pub fn compare(
        &mut self,
        window: &Window,
        fit: &SpotFit,
    ) -> impl Iterator<Item = (f64, f64)> + Clone {
        let mut light = std::mem::take(&mut self.light);
        light.clear();
        light.resize(window.data.len(), [0.0; GROUP_PX]);
        self.draw::<LIGHT>(window, &fit.spots, fit.spot_px);
        for (i, spot) in fit.spots.iter().enumerate() {
            let of_spot = self.light_of(i, spot, window);
            of_spot.add_to(&mut light, 1.0, window.groups());
        }
        self.light = light;
        let background = fit.background / window.noise_adu;
        let pixels = window.data.as_flattened().iter();
        let both = pixels.zip(self.light.as_flattened());
        both.filter(|(data, _)| !data.is_nan())
            .map(move |(&data, &light)| (f64::from(data) - background, f64::from(light)))
    }

    /// Unit vector along the major axis of the light around the first spot; `None` without light.
    pub fn major_axis(&self, window: &Window, fit: &SpotFit) -> Option<(f64, f64)> {
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
        let angle = 0.5 * libm::atan2(2.0 * xy, xx - yy);
        angle
            .is_finite()
            .then(|| (libm::cos(angle), libm::sin(angle)))
    }

    /// Factors of the normal equations of one spot at `fit`, its light and the pixels; `None` where
    /// the equations have no solution.
    pub fn factorised<'a>(
        &'a mut self,
        window: &'a Window,
        fit: &SpotFit,
        config: &FitConfig,
    ) -> Option<(CholeskyFactor<ONE_SPOT>, AnyLight<'a>, WindowPixels<'a>)> {
        let [spot] = fit.spots.as_slice() else {
            return None;
        };
        let mut normal: NormalEquations<ONE_SPOT> = self.linearise(window, fit, config);
        if normal.factorise(ONE_SPOT) < ONE_SPOT {
            return None;
        }
        let pixels = WindowPixels::new(window, fit.background, &config.noise);
        let units = std::array::from_fn(|i| pixels.unit(i, 1));
        Some((normal.factor(units), self.light_of(0, spot, window), pixels))
    }

    /// Subtracts spots of this size from the window.
    pub fn subtract(&mut self, window: &mut Window, spots: &[SpotEstimate], spot_px: f64) {
        let groups = window.groups();
        for spot in spots {
            self.draw::<LIGHT>(window, &[*spot], spot_px);
            let light = self.light_of(0, spot, window);
            light.add_to(&mut window.data, -1.0, groups);
        }
    }

    /// The normal equations at `fit`; the last parameter is the size, whether or not it is fitted.
    fn linearise<const N: usize>(
        &mut self,
        window: &Window,
        fit: &SpotFit,
        config: &FitConfig,
    ) -> NormalEquations<N> {
        // The size of several spots is neither fitted nor tested.
        if fit.spots.len() != 1 {
            return self.linearise_place(window, fit, config);
        }
        self.draw::<LIGHT_BY_ALL>(window, &fit.spots, fit.spot_px);
        self.equations_of_drawn(window, fit, config)
    }

    /// The same without the derivatives by the size.
    fn linearise_place<const N: usize>(
        &mut self,
        window: &Window,
        fit: &SpotFit,
        config: &FitConfig,
    ) -> NormalEquations<N> {
        self.draw::<LIGHT_BY_PLACE>(window, &fit.spots, fit.spot_px);
        self.equations_of_drawn(window, fit, config)
    }

    /// The normal equations of spots that were drawn.
    fn equations_of_drawn<const N: usize>(
        &mut self,
        window: &Window,
        fit: &SpotFit,
        config: &FitConfig,
    ) -> NormalEquations<N> {
        let mut normal = NormalEquations::empty();
        let pixels = WindowPixels::new(window, fit.background, &config.noise);
        let spots = fit.spots.iter().enumerate();
        let mut sums = std::mem::take(&mut self.sums);
        if window.psf.is_gaussian() {
            let lights: ArrayVec<_, MAX_SPOTS> = spots
                .map(|(i, spot)| self.gaussian_light(i, spot, window))
                .collect();
            add_pixels(&mut normal, &lights, &pixels, &mut sums);
        } else {
            let lights: ArrayVec<_, MAX_SPOTS> = spots
                .map(|(i, spot)| self.mixture_light(i, spot, window))
                .collect();
            add_pixels(&mut normal, &lights, &pixels, &mut sums);
        }
        self.sums = sums;
        add_background_map(&mut normal, window, fit);
        normal
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn window_with(spots: &[SpotEstimate], sigma: f64, side: usize) -> Window {
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
        let negative = spots.iter().map(|spot| SpotEstimate {
            flux: -spot.flux,
            ..*spot
        });
        let negative: SpotGroup = negative.collect();
        Fitter::default().subtract(&mut window, &negative, sigma);
        window
    }

    fn spot(x: f64, y: f64, flux: f64) -> SpotEstimate {
        SpotEstimate {
            x,
            y,
            flux,
            ..SpotEstimate::default()
        }
    }

    const CONFIG: FitConfig = FitConfig {
        spot_px: 0.9,
        free_size: false,
        noise: NoiseModel {
            shot_adu: 1.0,
            model_error2: 0.0,
        },
    };

    #[test]
    fn a_noise_free_spot_is_fitted_exactly() {
        let truth = spot(5.3, 4.8, 4000.0);
        let window = window_with(&[truth], 0.9, 11);
        let fit = Fitter::default().fit(&window, &[spot(5.0, 5.0, 3000.0)], &CONFIG);
        assert!(fit.converged);
        assert!((fit.spots[0].x - 5.3).abs() < 1e-5 && (fit.spots[0].y - 4.8).abs() < 1e-5);
        assert!((fit.spots[0].flux / 4000.0 - 1.0).abs() < 1e-4);
    }

    #[test]
    fn a_free_size_is_fitted() {
        let window = window_with(&[spot(5.3, 4.8, 4000.0)], 1.4, 13);
        let config = FitConfig {
            free_size: true,
            ..CONFIG
        };
        let fit = Fitter::default().fit(&window, &[spot(5.0, 5.0, 3000.0)], &config);
        assert!(fit.converged && (fit.spot_px - 1.4).abs() < 1e-3, "{fit:?}");
    }

    #[test]
    fn touching_spots_are_separated() {
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
        window.data.fill([f32::NAN; GROUP_PX]);
        let fit = Fitter::default().fit(&window, &[spot(4.0, 4.0, 1.0)], &CONFIG);
        assert!(!fit.converged && fit.spots[0].sigma_x.is_infinite());
    }
}
