//! What the fits need to know of the frame: its pixels, background, noise and saturation.

use super::background::Mesh;
use super::components::Peak;
use super::fit::{Fit, FitConfig, Fitter, NoiseModel, Spot, Spots, Window, window_radius};
use super::psf::MAX_WINDOW_PX;
use super::view::View;

/// Standard error of the background map over the noise of a pixel: what the map's cells leave.
const BACKGROUND_ERROR: f64 = 0.15;
/// The local background around a star may differ from the map by this part of the star's peak: its halo.
const HALO_ERROR: f64 = 0.01;

/// The frame and all maps of it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scene<'a> {
    /// The frame.
    pub view: View<'a>,
    /// Background and noise of a pixel, in ADU.
    pub background: &'a Mesh,
    /// Mean and noise of the filtered frame, once there is one.
    pub filtered: Option<&'a Mesh>,
    /// Level from which on a pixel is saturated, in ADU.
    pub saturation_adu: f32,
    /// Standard deviation of the spot, in pixels.
    pub spot_px: f64,
    /// Signal-to-noise ratio of a star whose flux equals the noise of a pixel: √ΣP².
    pub matched_gain: f64,
}

impl Scene<'_> {
    /// The noise of a pixel at a point, in ADU.
    pub fn noise_at(&self, x: f64, y: f64) -> f64 {
        f64::from(self.background.at(x as f32, y as f32).1)
    }

    /// How much larger the noise is for a spot than independent pixels would make it; 1 before the
    /// frame is filtered.
    pub fn correlation_at(&self, x: f64, y: f64) -> f64 {
        self.filtered
            .map_or(1.0, |mesh| f64::from(mesh.at(x as f32, y as f32).1))
    }

    /// A first guess of a spot at a peak of the filtered frame.
    pub fn first_guess(&self, peak: &Peak) -> Spot {
        let (x, y) = (peak.x as f64, peak.y as f64);
        let snr = f64::from(peak.snr) * self.correlation_at(x, y);
        Spot {
            x: x + f64::from(peak.offset_px[0]),
            y: y + f64::from(peak.offset_px[1]),
            flux: snr * self.noise_at(x, y) / self.matched_gain,
            ..Spot::default()
        }
    }

    /// Cuts out the pixels within `radius` of the points, less the background; saturated ones are left out.
    pub fn cut(&self, points: &[Spot], radius: usize, window: &mut Window) {
        let low = |v: f64| (v.round() - radius as f64).max(0.0) as usize;
        let high =
            |v: f64, side: usize| ((v.round() + radius as f64).max(0.0) as usize + 1).min(side);
        let x0 = points.iter().map(|p| low(p.x)).min().unwrap_or(0);
        let y0 = points.iter().map(|p| low(p.y)).min().unwrap_or(0);
        let x1 = points
            .iter()
            .map(|p| high(p.x, self.view.width))
            .max()
            .unwrap_or(0);
        let y1 = points
            .iter()
            .map(|p| high(p.y, self.view.height))
            .max()
            .unwrap_or(0);
        window.x0 = x0;
        window.y0 = y0;
        window.width = x1.saturating_sub(x0).min(MAX_WINDOW_PX);
        window.height = y1.saturating_sub(y0).min(MAX_WINDOW_PX);
        let (cx, cy) = (x0 + window.width / 2, y0 + window.height / 2);
        let noise = self.noise_at(cx as f64, cy as f64);
        window.noise_variance = noise * noise;
        let peak = points.iter().map(|p| p.flux).fold(0.0, f64::max) * self.matched_gain;
        window.background_noise = BACKGROUND_ERROR * noise;
        window.background_error = window.background_noise.hypot(HALO_ERROR * peak);
        self.fill(window);
    }

    /// Copies the window's pixels, less a plane through the background map.
    fn fill(&self, window: &mut Window) {
        let level = |x: usize, y: usize| f64::from(self.background.at(x as f32, y as f32).0);
        let (x0, y0) = (window.x0, window.y0);
        let corner = level(x0, y0);
        let across = (level(x0 + window.width, y0) - corner) / window.width.max(1) as f64;
        let down = (level(x0, y0 + window.height) - corner) / window.height.max(1) as f64;
        window.data.clear();
        for row in 0..window.height {
            let pixels = &self.view.row(y0 + row)[x0..x0 + window.width];
            let start = corner + row as f64 * down;
            window
                .data
                .extend(pixels.iter().enumerate().map(|(column, &p)| {
                    if p >= self.saturation_adu {
                        f64::NAN
                    } else {
                        f64::from(p) - (start + column as f64 * across)
                    }
                }));
        }
    }

    /// Takes the light of `spots` out of the window.
    pub fn subtract(&self, spots: &[Spot], fitter: &mut Fitter, window: &mut Window) {
        for &spot in spots {
            let fit = Fit {
                spots: Spots::from_iter([spot]),
                spot_px: self.spot_px,
                ..Fit::default()
            };
            fitter.subtract(window, &fit);
        }
    }

    /// Fits one spot of free size, which is `spot_px` at first, in a window that follows the size; the
    /// light of the spots `beyond` is taken out of it.
    pub fn fit_free(
        &self,
        start: Spot,
        beyond: &[Spot],
        (spot_px, noise): (f64, NoiseModel),
        work: &mut FitWork,
    ) -> Fit {
        let mut config = FitConfig {
            spot_px,
            free_spot: true,
            noise,
        };
        let mut radius = window_radius(spot_px);
        let mut fit = Fit::default();
        for _ in 0..3 {
            self.cut(&[start], radius, &mut work.window);
            self.subtract(beyond, &mut work.fitter, &mut work.window);
            fit = work.fitter.fit(&work.window, &[start], &config);
            let wanted = window_radius(fit.spot_px);
            if !fit.converged || wanted <= radius {
                break;
            }
            radius = wanted;
            config.spot_px = fit.spot_px;
        }
        fit
    }
}

/// Buffers of the fits.
#[derive(Debug, Clone, Default)]
pub(super) struct FitWork {
    /// The fit's own.
    pub fitter: Fitter,
    /// The pixels.
    pub window: Window,
    /// Those of a fit that is tried in another window.
    pub kept_window: Window,
    /// The spots that shine into the window and are not fitted.
    pub beyond: Vec<Spot>,
    /// Light and residual of the pixels of a window.
    pub residuals: Vec<(f64, f64)>,
}
