//! From peaks to detections: groups of touching spots, centroids by the chosen method, flags.

use super::centroid;
use super::components::{Peak, Region};
use super::fit::{Fit, FitConfig, MAX_SPOTS, NoiseModel, Spot, window_radius};
use super::psf::PIXEL_VARIANCE_PX2;
use super::scene::{FitWork, Scene};
use super::shape;
use super::{CentroidMethod, Detection, DetectionFlags};
use crate::coords::PixelPoint;

/// Spots closer than this many of their standard deviations touch, and are fitted together.
const TOUCHING_SIGMA: f64 = 3.5;
/// Spots closer than this many standard deviations beyond the window still shine into it.
const WINDOW_MARGIN_SIGMA: f64 = 3.0;

/// All that the measurement of a frame's peaks needs.
pub(super) struct Measurement<'a> {
    /// The frame and its maps.
    pub scene: Scene<'a>,
    /// How the noise grows with light.
    pub noise: NoiseModel,
    /// How positions are measured.
    pub method: CentroidMethod,
    /// The regions that the peaks lie in.
    pub regions: &'a [Region],
    /// Threshold of the search, in units of the local noise.
    pub threshold: f64,
}

impl Measurement<'_> {
    /// Measures all peaks, which come strongest first; the detections come in the same order.
    pub fn run(&self, peaks: &[Peak], work: &mut FitWork) -> Vec<Detection> {
        let near = Neighbours::new(peaks, self.reach_px());
        // Each spot as far as it is known: fitted for those stronger than the one at hand.
        let mut spots: Vec<Spot> = peaks.iter().map(|p| self.scene.first_guess(p)).collect();
        (0..peaks.len())
            .map(|index| {
                let around: Vec<usize> = near.of(peaks, index);
                self.measure(index, peaks, &around, &mut spots, work)
            })
            .collect()
    }

    /// How far a spot can matter to another, in pixels.
    fn reach_px(&self) -> f64 {
        window_radius(self.scene.spot_px) as f64 * 1.5 + WINDOW_MARGIN_SIGMA * self.width_px()
    }

    /// Standard deviation of the spot with the pixel, in pixels.
    fn width_px(&self) -> f64 {
        (self.scene.spot_px.powi(2) + PIXEL_VARIANCE_PX2).sqrt()
    }

    fn measure(
        &self,
        index: usize,
        peaks: &[Peak],
        around: &[usize],
        spots: &mut [Spot],
        work: &mut FitWork,
    ) -> Detection {
        let peak = &peaks[index];
        let region = &self.regions[peak.region];
        let touching_px = TOUCHING_SIGMA * self.width_px();
        let distance = |other: usize| {
            let (a, b) = (&peaks[index], &peaks[other]);
            (a.x as f64 - b.x as f64).hypot(a.y as f64 - b.y as f64)
        };
        let touching: Vec<usize> = around
            .iter()
            .copied()
            .filter(|&other| distance(other) < touching_px)
            .take(MAX_SPOTS - 1)
            .collect();
        let beyond: Vec<Spot> = around
            .iter()
            .filter(|other| !touching.contains(other) && !peaks[**other].saturated)
            .map(|&other| spots[other])
            .collect();
        let mut start = vec![spots[index]];
        start.extend(touching.iter().map(|&other| spots[other]));
        let fit = if peak.saturated && touching.is_empty() {
            self.scene
                .fit_free(start[0], 1.5 * self.scene.spot_px, self.noise, work)
        } else {
            self.fit_fixed(&start, &beyond, work)
        };
        let mut detection = self.detection_of(&fit, peak, region);
        detection.flags.blended = !touching.is_empty();
        if fit.converged {
            spots[index] = fit.spots[0];
            if !peak.saturated && touching.is_empty() {
                shape::judge(self, peak, &fit, &mut detection, work);
            }
        }
        if shape::is_trail(region, peak, self.width_px(), self.threshold) {
            detection.flags.trail = true;
        }
        if let CentroidMethod::GreyWeighted = self.method {
            centroid::grey_weighted(&self.scene, &self.noise, &fit, &mut detection, work);
        }
        self.place(&mut detection);
        detection
    }

    /// Fits spots of the frame's size.
    fn fit_fixed(&self, start: &[Spot], beyond: &[Spot], work: &mut FitWork) -> Fit {
        let radius = window_radius(self.scene.spot_px);
        self.scene.cut(start, radius, &mut work.window);
        self.scene
            .subtract(beyond, &mut work.fitter, &mut work.window);
        let config = FitConfig {
            spot_px: self.scene.spot_px,
            free_spot: false,
            noise: self.noise,
        };
        work.fitter.fit(&work.window, start, &config)
    }

    /// Position, errors, flux and the flags that need no judgement; coordinates still relative to the view.
    fn detection_of(&self, fit: &Fit, peak: &Peak, region: &Region) -> Detection {
        let spot = fit.spots[0];
        let scene = &self.scene;
        let correlation = scene.correlation_at(spot.x, spot.y);
        let level = f64::from(scene.background.at(peak.x as f32, peak.y as f32).0);
        let brightest = (peak.y.saturating_sub(1)..(peak.y + 2).min(scene.view.height))
            .flat_map(|y| {
                (peak.x.saturating_sub(1)..(peak.x + 2).min(scene.view.width)).map(move |x| (x, y))
            })
            .map(|(x, y)| f64::from(scene.view.at(x, y)))
            .fold(f64::NEG_INFINITY, f64::max);
        let mut flux_adu = spot.flux;
        let mut sigma_flux = spot.sigma_flux * correlation;
        if !(flux_adu > 0.0 && sigma_flux.is_finite()) {
            // No fit: what the filter saw.
            flux_adu = scene.first_guess(peak).flux;
            sigma_flux = flux_adu / f64::from(peak.snr);
        }
        let finite = |sigma: f64| {
            let fallback = (region.area_px as f64).sqrt().max(1.0);
            if sigma.is_finite() {
                sigma * correlation
            } else {
                fallback
            }
        };
        let margin = 2.0 * self.width_px();
        let border = spot.x < margin
            || spot.y < margin
            || spot.x > scene.view.width as f64 - 1.0 - margin
            || spot.y > scene.view.height as f64 - 1.0 - margin;
        Detection {
            position: PixelPoint::new(spot.x, spot.y),
            sigma_x_px: finite(spot.sigma_x),
            sigma_y_px: finite(spot.sigma_y),
            flux_adu,
            peak_adu: brightest - level,
            snr: flux_adu / sigma_flux,
            flags: DetectionFlags {
                saturated: peak.saturated,
                border,
                ..DetectionFlags::default()
            },
        }
    }

    /// From the view's coordinates to the frame's.
    fn place(&self, detection: &mut Detection) {
        detection.position.x += self.scene.view.x0 as f64;
        detection.position.y += self.scene.view.y0 as f64;
    }
}

/// The peaks near a peak, by a grid.
struct Neighbours {
    cell_px: f64,
    grid: std::collections::HashMap<(i64, i64), Vec<usize>>,
}

impl Neighbours {
    fn new(peaks: &[Peak], reach_px: f64) -> Self {
        let mut grid: std::collections::HashMap<(i64, i64), Vec<usize>> = Default::default();
        let cell_px = reach_px.max(1.0);
        for (index, peak) in peaks.iter().enumerate() {
            grid.entry(Self::cell(peak, cell_px))
                .or_default()
                .push(index);
        }
        Self { cell_px, grid }
    }

    fn cell(peak: &Peak, cell_px: f64) -> (i64, i64) {
        (
            (peak.x as f64 / cell_px) as i64,
            (peak.y as f64 / cell_px) as i64,
        )
    }

    /// Indices of the peaks within reach of peak `index`, strongest first, itself left out.
    fn of(&self, peaks: &[Peak], index: usize) -> Vec<usize> {
        let (cx, cy) = Self::cell(&peaks[index], self.cell_px);
        let mut found: Vec<usize> = (cy - 1..=cy + 1)
            .flat_map(|y| (cx - 1..=cx + 1).map(move |x| (x, y)))
            .filter_map(|cell| self.grid.get(&cell))
            .flatten()
            .copied()
            .filter(|&other| other != index)
            .filter(|&other| {
                let dx = peaks[other].x as f64 - peaks[index].x as f64;
                let dy = peaks[other].y as f64 - peaks[index].y as f64;
                dx * dx + dy * dy <= self.cell_px * self.cell_px
            })
            .collect();
        found.sort_unstable();
        found
    }
}
