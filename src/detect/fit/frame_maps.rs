//! The frame with its background, noise and spot, and the windows that fits cut out of it.

use super::background_plane::BackgroundPlane;
use super::parameters::SpotEstimate;
use super::window::{Window, window_radius};
use crate::detect::background::Mesh;
use crate::detect::candidates::Peak;
use crate::detect::contrast::Contrast;
use crate::detect::pixels::View;
use crate::detect::psf::{
    FieldTables, GROUP_PX, MAX_WINDOW_PX, PIXEL_VARIANCE_PX2, PixelGroup, each, each_of, plus,
};
use multiversion::multiversion;

/// The frame with its maps of background and noise, and its spot.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FrameMaps<'a> {
    /// The frame.
    pub view: View<'a>,
    /// Background and noise of a pixel, in ADU.
    pub background: &'a Mesh,
    /// Mean and noise of the filtered frame; `None` before it is filtered.
    pub filtered: Option<&'a Mesh>,
    /// Level at and above which a pixel is saturated, in ADU.
    pub saturation_adu: f32,
    /// Standard deviation of the spot, in pixels.
    pub spot_px: f64,
    /// √ΣP²: the signal-to-noise ratio of a star whose flux equals the noise of a pixel.
    pub matched_gain: f64,
    /// The spot where it is not a round Gaussian of that size.
    pub psf: Option<&'a FieldTables<'a>>,
}

impl FrameMaps<'_> {
    /// Standard deviation of the spot, pixel included, in pixels.
    pub fn width_px(&self) -> f64 {
        (self.spot_px.powi(2) + PIXEL_VARIANCE_PX2).sqrt()
    }

    /// Half of the side of the window of a spot of this size, in pixels.
    pub fn window_radius(&self, spot_px: f64) -> usize {
        self.psf
            .map_or_else(|| window_radius(spot_px), |psf| psf.window_radius(spot_px))
    }

    /// The noise of a pixel at a point, in ADU.
    pub fn noise_at(&self, x: f64, y: f64) -> f64 {
        f64::from(self.background.at(x as f32, y as f32).1)
    }

    /// Noise of a spot's flux over that of independent pixels: above 1 where the noise is
    /// correlated; 1 before the frame is filtered.
    pub fn correlation_at(&self, x: f64, y: f64) -> f64 {
        self.filtered
            .map_or(1.0, |mesh| f64::from(mesh.at(x as f32, y as f32).1))
    }

    /// Errors of a spot's position over those in independent noise, along x and along y; 1 before the frame is
    /// filtered.
    pub fn position_correlation_at(&self, x: f64, y: f64) -> [f64; 2] {
        let slopes = |mesh: &Mesh| mesh.slope_sigma_at(x as f32, y as f32).map(f64::from);
        self.filtered.map_or([1.0; 2], slopes)
    }

    /// The brightest pixel at a peak, and the light beside it.
    pub fn contrast_at(&self, peak: &Peak) -> Contrast {
        Contrast::near(&self.view, self.background, peak.x, peak.y)
    }

    /// The initial guess of a spot at a peak of the filtered frame.
    pub fn initial_guess(&self, peak: &Peak) -> SpotEstimate {
        let (x, y) = (peak.x as f64, peak.y as f64);
        let snr = f64::from(peak.snr) * self.correlation_at(x, y);
        SpotEstimate {
            x: x + f64::from(peak.offset_px[0]),
            y: y + f64::from(peak.offset_px[1]),
            flux: snr * self.noise_at(x, y) / self.matched_gain,
            ..SpotEstimate::default()
        }
    }

    /// Cuts out the pixels within `radius` of the points, less the background; saturated pixels are
    /// left out.
    pub fn cut_out(&self, points: &[SpotEstimate], radius: usize, window: &mut Window) {
        /// Standard error of the background map over the noise of a pixel.
        const MAP_ERROR: f64 = 0.15;
        /// Largest scatter of the background that the light of faint stars explains, in noises of a pixel.
        const USUAL_SCATTER: f64 = 2.0;
        /// Error of the local background over the peak of the star: its halo is not in the map.
        const HALO_ERROR: f64 = 0.01;
        let (columns, rows) = (
            points
                .iter()
                .map(|p| span_around(p.x, radius, self.view.width)),
            points
                .iter()
                .map(|p| span_around(p.y, radius, self.view.height)),
        );
        (window.x0, window.width) = union_of(columns);
        (window.y0, window.height) = union_of(rows);
        let cx = window.x0 + window.width / 2;
        let cy = window.y0 + window.height / 2;
        match self.psf {
            Some(psf) => psf.at(cx as f64, cy as f64, &mut window.psf),
            None => window.psf.clear(),
        }
        let plane = BackgroundPlane::in_window(&self.view, self.background, window);
        // What is at an edge, leaves and the like, is noise, too.
        let noise = self.noise_at(cx as f64, cy as f64);
        let unexplained = (plane.scatter_adu.powi(2) - (USUAL_SCATTER * noise).powi(2)).max(0.0);
        let noise = (noise.powi(2) + unexplained).sqrt();
        window.noise_adu = noise;
        let peak = points.iter().map(|p| p.flux).fold(0.0, f64::max) * self.matched_gain;
        window.background_noise = MAP_ERROR * noise;
        let halo_error = HALO_ERROR * peak;
        window.background_error = (window.background_noise.powi(2) + halo_error.powi(2)).sqrt();
        copy_above(&self.view, plane, self.saturation_adu, window);
        if let Some(rest) = plane.rest() {
            window.subtract_adu(rest);
        }
    }
}

/// First and end of the pixels within `radius` of a point along an axis of `side` pixels.
fn span_around(center: f64, radius: usize, side: usize) -> [usize; 2] {
    let first = (center.round() - radius as f64).max(0.0) as usize;
    let last = (center.round() + radius as f64).max(0.0) as usize;
    [first, (last + 1).min(side)]
}

/// First pixel and length of the union of spans, at most [`MAX_WINDOW_PX`] long.
fn union_of(spans: impl Iterator<Item = [usize; 2]>) -> (usize, usize) {
    let union = spans.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]);
    let [first, end] = union.unwrap_or_default();
    (first, end.saturating_sub(first).min(MAX_WINDOW_PX))
}

/// Copies the pixels of a window above the background, in units of the noise; NaN where saturated.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn copy_above(view: &View, plane: BackgroundPlane, saturation_adu: f32, window: &mut Window) {
    let groups = window.groups();
    window.data.resize(groups * window.height, [0.0; GROUP_PX]);
    let per_noise = (1.0 / window.noise_adu) as f32;
    let lanes: PixelGroup = std::array::from_fn(|lane| lane as f32);
    let slopes = each(&lanes, |lane| lane * plane.across);
    for group in 0..groups {
        let first = group * GROUP_PX;
        let columns = (window.width - first).min(GROUP_PX);
        // No pixel is used beyond the end of the row.
        let limits = each(&lanes, |lane| {
            if lane < columns as f32 {
                saturation_adu
            } else {
                f32::NEG_INFINITY
            }
        });
        for row in 0..window.height {
            let in_row = view.row(window.y0 + row);
            let mut pixels = [0.0; GROUP_PX];
            in_row
                .span(window.x0 + first..view.width)
                .copy_group(&mut pixels);
            let start = plane.corner + row as f32 * plane.down + first as f32 * plane.across;
            let above = each_of(&pixels, &slopes, |pixel, slope| {
                (pixel - (start + slope)) * per_noise
            });
            let used = each_of(
                &pixels,
                &limits,
                |pixel, limit| {
                    if pixel < limit { 0.0 } else { f32::NAN }
                },
            );
            window.data[row * groups + group] = plus(&above, &used);
        }
    }
}
