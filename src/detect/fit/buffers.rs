//! Buffers of the fits of one thread, and the fit of a spot of free size.

use super::batch::BatchFitter;
use super::fitter::Fitter;
use super::frame_maps::FrameMaps;
use super::parameters::{FitConfig, NoiseModel, SpotEstimate, SpotFit};
use super::window::Window;

/// Buffers of the fits of one thread.
#[derive(Debug, Clone, Default)]
pub(crate) struct FitBuffers {
    /// For a single fit.
    pub fitter: Fitter,
    /// The pixels of the last fit.
    pub window: Window,
    /// The pixels of a fit that is kept while another is tried.
    pub kept_window: Window,
    /// For many fits of single spots; it is large, and taken out while it is used.
    pub batch: Option<Box<BatchFitter>>,
}

impl FitBuffers {
    /// Fits spots of the frame's size, after subtracting those `beyond` the window.
    pub fn fit_fixed_size(
        &mut self,
        maps: &FrameMaps<'_>,
        start: &[SpotEstimate],
        beyond: &[SpotEstimate],
        noise: NoiseModel,
    ) -> SpotFit {
        let config = FitConfig {
            spot_px: maps.spot_px,
            free_size: false,
            noise,
        };
        self.cut_out(maps, start, beyond);
        self.fitter.fit(&self.window, start, &config)
    }

    /// Cuts out the window of spots of the frame's size, and subtracts those `beyond` it.
    pub fn cut_out(
        &mut self,
        maps: &FrameMaps<'_>,
        spots: &[SpotEstimate],
        beyond: &[SpotEstimate],
    ) {
        let Self { fitter, window, .. } = self;
        maps.cut_out(spots, maps.window_radius(maps.spot_px), window);
        fitter.subtract(window, beyond, maps.spot_px);
    }

    /// Fits one spot of free size, initially `spot_px`, in a window that grows with the size, after
    /// subtracting those `beyond` the window.
    pub fn fit_free_size(
        &mut self,
        maps: &FrameMaps<'_>,
        start: SpotEstimate,
        beyond: &[SpotEstimate],
        spot_px: f64,
        noise: NoiseModel,
    ) -> SpotFit {
        const MAX_WINDOWS: usize = 3;
        let mut config = FitConfig {
            spot_px,
            free_size: true,
            noise,
        };
        let Self { fitter, window, .. } = self;
        let mut radius = maps.window_radius(spot_px);
        let mut fit = SpotFit::default();
        for _ in 0..MAX_WINDOWS {
            maps.cut_out(&[start], radius, window);
            fitter.subtract(window, beyond, maps.spot_px);
            fit = fitter.fit(window, &[start], &config);
            let wanted = maps.window_radius(fit.spot_px);
            if !fit.converged || wanted <= radius {
                break;
            }
            radius = wanted;
            config.spot_px = fit.spot_px;
        }
        fit
    }
}
