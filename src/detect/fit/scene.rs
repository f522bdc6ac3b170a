//! What the fits need to know of the frame: its pixels, background, noise and saturation.

use super::fitter::{Fit, FitConfig, Fitter, NoiseModel, Spot, Window, window_radius};
use super::side_by_side::SideBySide;
use crate::detect::background::Mesh;
use crate::detect::candidates::Peak;
use crate::detect::pixels::View;
use crate::detect::psf::{LANES, MAX_WINDOW_PX};
use multiversion::multiversion;

/// Standard error of the background map over the noise of a pixel: what the map's cells leave.
const BACKGROUND_ERROR: f64 = 0.15;
/// The local background around a star may differ from the map by this part of the star's peak: its halo.
const HALO_ERROR: f64 = 0.01;

/// The frame and all maps of it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scene<'a> {
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
        window.noise_adu = noise;
        let peak = points.iter().map(|p| p.flux).fold(0.0, f64::max) * self.matched_gain;
        window.background_noise = BACKGROUND_ERROR * noise;
        let halo_error = HALO_ERROR * peak;
        window.background_error = (window.background_noise.powi(2) + halo_error.powi(2)).sqrt();
        self.fill(window);
    }

    /// Copies the window's pixels, less a plane through the background map.
    fn fill(&self, window: &mut Window) {
        let level = |x: usize, y: usize| self.background.at(x as f32, y as f32).0;
        let (x0, y0) = (window.x0, window.y0);
        let corner = level(x0, y0);
        let plane = Plane {
            corner,
            across: (level(x0 + window.width, y0) - corner) / window.width.max(1) as f32,
            down: (level(x0, y0 + window.height) - corner) / window.height.max(1) as f32,
        };
        copy_above(&self.view, plane, self.saturation_adu, window);
    }

    /// Takes the light of `spots` out of the window.
    pub fn subtract(&self, spots: &[Spot], fitter: &mut Fitter, window: &mut Window) {
        fitter.subtract(window, spots, self.spot_px);
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

/// The background in a window.
#[derive(Debug, Clone, Copy)]
struct Plane {
    /// Its level in the first pixel, in ADU.
    corner: f32,
    /// How it rises from column to column.
    across: f32,
    /// How it rises from row to row.
    down: f32,
}

/// Copies the pixels of a window, those that are saturated left out, in units of the noise above the background.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn copy_above(view: &View, plane: Plane, saturation_adu: f32, window: &mut Window) {
    let groups = window.groups();
    window.data.resize(groups * window.height, [0.0; LANES]);
    let per_noise = (1.0 / window.noise_adu) as f32;
    for group in 0..groups {
        let first = group * LANES;
        let columns = (window.width - first).min(LANES);
        for row in 0..window.height {
            let pixels = &view.row(window.y0 + row)[window.x0 + first..];
            let pixels = pixels.first_chunk().copied().unwrap_or_else(|| {
                let mut part = [f32::NAN; LANES];
                part[..columns].copy_from_slice(&pixels[..columns]);
                part
            });
            let start = plane.corner + row as f32 * plane.down + first as f32 * plane.across;
            let above = &mut window.data[row * groups + group];
            for lane in 0..LANES {
                let is_used = lane < columns && pixels[lane] < saturation_adu;
                let level = start + lane as i32 as f32 * plane.across;
                above[lane] = if is_used {
                    (pixels[lane] - level) * per_noise
                } else {
                    f32::NAN
                };
            }
        }
    }
}

/// Buffers of the fits.
#[derive(Debug, Clone, Default)]
pub(crate) struct FitWork {
    /// The fit's own.
    pub fitter: Fitter,
    /// The pixels.
    pub window: Window,
    /// Those of a fit that is tried in another window.
    pub kept_window: Window,
    /// For many stars at once.
    pub side_by_side: SideBySide,
}
