//! Fits of single spots side by side, a lane of a vector for each.
//!
//! The fit is that of [`Fitter`](super::fitter::Fitter), step by step; only the sums over the pixels are those of many stars
//! at once. The windows of spots are small: their rows fill no vector, and sums across one take as long as the pixels do.

use super::fitter::{
    Fit, FitConfig, MAX_STEPS, Progress, Spot, Window, add_background_map, advance, pixels_of,
    window_radius,
};
use super::normal::{Normal, ONE_SPOT, flux_variance_of, spot_gradient, variance_of};
use super::scene::Scene;
use crate::detect::psf::{Cumulative, ProfilePart};
use multiversion::multiversion;

/// Spots treated together.
const STARS: usize = 16;
/// A value for each of them.
type Stars = [f32; STARS];

/// Where a fit starts: the number of the star, its spot and its size in pixels.
pub(crate) type Start = (usize, Spot, f64);

/// A star that is being fitted.
#[derive(Debug, Clone, Copy)]
struct Lane {
    start: Start,
    /// Steps taken.
    steps: usize,
}

/// Buffers for the stars that are fitted at the same time.
#[derive(Debug, Clone, Default)]
pub(crate) struct SideBySide {
    lanes: [Option<Lane>; STARS],
    fits: [Fit; STARS],
    windows: [Window; STARS],
    /// Pixels on a side of the windows.
    side: usize,
    /// Row by row, above the background map, in units of the noise; NaN is left out.
    data: Vec<Stars>,
    /// The spots' light along x and y.
    axes: [Vec<ProfilePart<Stars>>; 2],
}

/// What differs from star to star in a pixel, in units of the noise.
#[derive(Debug, Clone, Copy)]
struct Model {
    flux: Stars,
    background: Stars,
    /// Variance of a pixel per light, and per squared light.
    variance: [Stars; 2],
}

/// Sums over the pixels of each star.
#[derive(Debug, Clone, Copy)]
struct Sums {
    /// Lower triangle.
    matrix: [[Stars; ONE_SPOT]; ONE_SPOT],
    right: [Stars; ONE_SPOT],
    chi2: Stars,
    pixels: Stars,
    /// Of weights by noise alone, and of these times the light, as part of all, and its square.
    shapes: [Stars; 3],
}

impl SideBySide {
    /// Fits one spot at each start, none of which is larger than that in `config`; `each` is told the star's number, the fit
    /// if it succeeds, and its window.
    ///
    /// A lane whose star is done takes the next; what it finds does not depend on the others.
    pub fn fit(
        &mut self,
        scene: &Scene<'_>,
        mut starts: impl Iterator<Item = Start>,
        config: &FitConfig,
        mut each: impl FnMut(usize, Option<Fit>, &Window),
    ) {
        self.side = 2 * window_radius(config.spot_px) + 1;
        self.data.clear();
        self.data.resize(self.side * self.side, [f32::NAN; STARS]);
        for lane in 0..STARS {
            self.begin(lane, starts.next(), scene);
        }
        while self.lanes.iter().any(Option::is_some) {
            self.fill_axes();
            let sums = sums_over(&self.data, &self.axes, &self.model(config));
            for lane in 0..STARS {
                let Some(Lane { start, steps }) = self.lanes[lane] else {
                    continue;
                };
                let (number, spot, spot_px) = start;
                let mut normal = self.normal_of(lane, &sums, config);
                let fit = &mut self.fits[lane];
                let config = FitConfig { spot_px, ..*config };
                let progress = advance(fit, &[spot], &mut normal, steps, &config);
                if progress == Progress::Goes && steps + 1 < MAX_STEPS {
                    self.lanes[lane] = Some(Lane {
                        start,
                        steps: steps + 1,
                    });
                    continue;
                }
                let window = &self.windows[lane];
                fit.spots[0].noise_flux = flux_noise(lane, &sums, window);
                let found = (progress == Progress::Settled).then(|| fit.clone());
                each(number, found, window);
                self.begin(lane, starts.next(), scene);
            }
        }
    }

    /// Puts a star into a lane, or leaves it empty.
    fn begin(&mut self, lane: usize, start: Option<Start>, scene: &Scene<'_>) {
        self.lanes[lane] = start.map(|start| Lane { start, steps: 0 });
        let Some((_, spot, spot_px)) = start else {
            return;
        };
        let fit = &mut self.fits[lane];
        *fit = Fit {
            spot_px,
            ..Fit::default()
        };
        fit.spots.push(spot);
        let window = &mut self.windows[lane];
        scene.cut(&[spot], window_radius(spot_px), window);
        let groups = window.groups().max(1);
        // What the window has less than others is left out.
        for (y, to) in self.data.chunks_mut(self.side).enumerate() {
            let row = window
                .data
                .get(y * groups..(y + 1) * groups)
                .unwrap_or_default();
            let row = row.as_flattened();
            for (x, to) in to.iter_mut().enumerate() {
                to[lane] = row.get(x).copied().unwrap_or(f32::NAN);
            }
        }
    }

    /// The spots' profiles along both sides of their windows.
    fn fill_axes(&mut self) {
        let mut centers_px = [[0.0f64; STARS]; 2];
        let mut cumulative = [Cumulative::of_spot(1.0); STARS];
        for (lane, (fit, window)) in self.fits.iter().zip(&self.windows).enumerate() {
            let Some(spot) = fit.spots.first() else {
                continue;
            };
            centers_px[0][lane] = spot.x - window.x0 as f64;
            centers_px[1][lane] = spot.y - window.y0 as f64;
            cumulative[lane] = Cumulative::of_spot(fit.spot_px);
        }
        for (axis, center_px) in self.axes.iter_mut().zip(&centers_px) {
            axis.resize(self.side, ProfilePart::default());
            fill(axis, center_px, &cumulative);
        }
    }

    fn model(&self, config: &FitConfig) -> Model {
        let mut model = Model {
            flux: [0.0; STARS],
            background: [0.0; STARS],
            variance: [[0.0; STARS]; 2],
        };
        for (lane, (fit, window)) in self.fits.iter().zip(&self.windows).enumerate() {
            let Some(spot) = fit.spots.first() else {
                continue;
            };
            let pixels = pixels_of(window, fit, config);
            model.flux[lane] = (spot.flux * pixels.per_noise) as f32;
            model.background[lane] = pixels.background;
            for (of_model, of_pixels) in model.variance.iter_mut().zip(pixels.variance) {
                of_model[lane] = of_pixels;
            }
        }
        model
    }

    /// The equations of one star.
    fn normal_of(&self, lane: usize, sums: &Sums, config: &FitConfig) -> Normal<ONE_SPOT> {
        let (fit, window) = (&self.fits[lane], &self.windows[lane]);
        let pixels = pixels_of(window, fit, config);
        let units: [f64; ONE_SPOT] = std::array::from_fn(|i| pixels.unit(i, 1));
        let mut normal = Normal::empty();
        for i in 0..ONE_SPOT {
            normal.right[i] = f64::from(sums.right[i][lane]) * units[i];
            for j in 0..i + 1 {
                let sum = f64::from(sums.matrix[i][j][lane]);
                normal.matrix[i][j] = sum * units[i] * units[j];
            }
        }
        normal.chi2 = f64::from(sums.chi2[lane]);
        normal.pixels = sums.pixels[lane] as usize;
        add_background_map(&mut normal, window, fit);
        normal
    }
}

/// The standard error of the flux before the last step from noise alone, in ADU, see
/// [`Fitter::set_flux_noise`](super::fitter::Fitter::set_flux_noise).
fn flux_noise(lane: usize, sums: &Sums, window: &Window) -> f64 {
    let sums = sums.shapes.map(|sum| f64::from(sum[lane]));
    let error2 = window.background_noise * window.background_noise;
    flux_variance_of(sums, 1.0 / window.noise_adu, error2).sqrt()
}

/// Fills the pixels of an axis, for spots at `center_px` (0 is the centre of the first).
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn fill(
    pixels: &mut [ProfilePart<Stars>],
    center_px: &[f64; STARS],
    cumulative: &[Cumulative; STARS],
) {
    let edges_at = |edge: usize| {
        let mut edges = [[0.0f64; STARS]; 3];
        for lane in 0..STARS {
            let at = cumulative[lane].at(edge as f64 - 0.5 - center_px[lane]);
            for (edges, at) in edges.iter_mut().zip(at) {
                edges[lane] = at;
            }
        }
        edges
    };
    let mut before = edges_at(0);
    for (i, pixel) in pixels.iter_mut().enumerate() {
        let after = edges_at(i + 1);
        let parts = [&mut pixel.value, &mut pixel.by_center, &mut pixel.by_sigma];
        for (part, (after, before)) in parts.into_iter().zip(after.iter().zip(&before)) {
            for lane in 0..STARS {
                part[lane] = (after[lane] - before[lane]) as f32;
            }
        }
        before = after;
    }
}

/// The sums of the normal equations.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn sums_over(data: &[Stars], axes: &[Vec<ProfilePart<Stars>>; 2], model: &Model) -> Sums {
    let mut matrix = [[[0.0f32; STARS]; ONE_SPOT]; ONE_SPOT];
    let mut right = [[0.0f32; STARS]; ONE_SPOT];
    let [mut chi2, mut pixels] = [[0.0f32; STARS]; 2];
    let mut shapes = [[0.0f32; STARS]; 3];
    let [across, down] = axes;
    let model = *model;
    for (down, row) in down.iter().zip(data.chunks_exact(across.len().max(1))) {
        let down = *down;
        for (across, data) in across.iter().zip(row) {
            // Copies, of which it is plain that nothing else is written to.
            let (across, data) = (*across, *data);
            let mut gradient = [[1.0f32; STARS]; ONE_SPOT];
            let [mut weight, mut residual] = [[0.0f32; STARS]; 2];
            for lane in 0..STARS {
                let flux = model.flux[lane];
                let (a, d) = (across.lane(lane), down.lane(lane));
                let [shape, by_x, by_y, by_size] = spot_gradient(flux, &a, &d);
                gradient[0][lane] = by_x;
                gradient[1][lane] = by_y;
                gradient[2][lane] = shape;
                gradient[4][lane] = by_size;
                let light = flux * shape;
                let of_model = [model.variance[0][lane], model.variance[1][lane]];
                let is_valid = !data[lane].is_nan();
                let inverse = 1.0 / variance_of(light, of_model);
                let above = data[lane] - light - model.background[lane];
                weight[lane] = if is_valid { inverse } else { 0.0 };
                residual[lane] = if is_valid { above } else { 0.0 };
                pixels[lane] += if is_valid { 1.0 } else { 0.0 };
                chi2[lane] += residual[lane] * residual[lane] * weight[lane];
                let by_noise = 1.0 / variance_of(light, [of_model[0], 0.0]);
                let by_noise = if is_valid { by_noise } else { 0.0 };
                shapes[0][lane] += by_noise;
                shapes[1][lane] += by_noise * shape;
                shapes[2][lane] += by_noise * shape * shape;
            }
            for i in 0..ONE_SPOT {
                let mut weighted = weight;
                for lane in 0..STARS {
                    weighted[lane] *= gradient[i][lane];
                    right[i][lane] += weighted[lane] * residual[lane];
                }
                for j in 0..i + 1 {
                    for lane in 0..STARS {
                        matrix[i][j][lane] += weighted[lane] * gradient[j][lane];
                    }
                }
            }
        }
    }
    Sums {
        matrix,
        right,
        chi2,
        pixels,
        shapes,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect::background::{Mesh, MeshConfig};
    use crate::detect::fit::fitter::{Fitter, NoiseModel};
    use crate::detect::pixels::View;

    const SPOT_PX: f64 = 0.8;
    const SIDE_PX: usize = 256;

    /// Stars in rows, the brighter the further down, on a sky of noise.
    fn stars() -> Vec<Spot> {
        let place = |i: usize| 12.0 + 16.0 * i as f64 + 0.37 * (i % 3) as f64;
        let star = |i: usize| Spot {
            x: place(i % 15),
            y: place(i / 15),
            flux: 400.0 + 60.0 * i as f64,
            ..Spot::default()
        };
        (0..15 * 15).map(star).collect()
    }

    fn frame_of(stars: &[Spot]) -> Vec<f32> {
        let noise = |i: usize| ((i * 7919) % 101) as f32 * 0.2;
        let mut pixels: Vec<f32> = (0..SIDE_PX * SIDE_PX).map(noise).collect();
        let cumulative = Cumulative::of_spot(SPOT_PX);
        let part = |at: usize, center: f64| {
            let edge = at as f64 - 0.5 - center;
            cumulative.at(edge + 1.0)[0] - cumulative.at(edge)[0]
        };
        for star in stars {
            let (x, y) = (star.x as usize, star.y as usize);
            for (row, column) in (y - 6..y + 7).flat_map(|r| (x - 6..x + 7).map(move |c| (r, c))) {
                let light = star.flux * part(column, star.x) * part(row, star.y);
                pixels[row * SIDE_PX + column] += light as f32;
            }
        }
        pixels
    }

    #[test]
    fn each_star_has_the_fit_that_it_has_by_itself() {
        let truth = stars();
        let pixels = frame_of(&truth);
        let view = View::new(&pixels, SIDE_PX, SIDE_PX);
        let mut mesh = Mesh::default();
        mesh.measure(&view, &MeshConfig::of_pixels(64, 1e-6));
        let scene = Scene {
            view,
            background: &mesh,
            filtered: None,
            saturation_adu: f32::INFINITY,
            spot_px: SPOT_PX,
            matched_gain: 0.3,
        };
        for free_spot in [false, true] {
            let config = FitConfig {
                spot_px: SPOT_PX,
                free_spot,
                noise: NoiseModel {
                    shot_adu: 0.5,
                    model_error2: 1e-4,
                },
            };
            let start = |(i, star): (usize, &Spot)| {
                let (x, y) = (star.x.round(), star.y.round());
                (i, Spot { x, y, ..*star }, SPOT_PX)
            };
            let starts = truth.iter().enumerate().map(start);
            let mut found = vec![None; truth.len()];
            SideBySide::default().fit(&scene, starts.clone(), &config, |i, fit, _| found[i] = fit);
            let mut fitter = Fitter::default();
            let mut window = Window::default();
            for (i, spot, spot_px) in starts {
                scene.cut(&[spot], window_radius(spot_px), &mut window);
                let mut alone = fitter.fit(&window, &[spot], &config);
                fitter.set_flux_noise(&window, &mut alone, &config);
                assert_eq!(alone.converged, found[i].is_some(), "star {i}");
                let Some(fit) = &found[i] else { continue };
                let (a, b) = (fit.spots[0], alone.spots[0]);
                let off = (a.x - b.x).abs().max((a.y - b.y).abs());
                assert!(off < 1e-3 * b.sigma_x, "star {i}: {off} px");
                for (a, b) in [
                    (a.flux, b.flux),
                    (a.sigma_x, b.sigma_x),
                    (a.sigma_flux, b.sigma_flux),
                    (fit.spot_px, alone.spot_px),
                    (fit.size_error_px, alone.size_error_px),
                    (fit.chi2, alone.chi2),
                ] {
                    assert!((a - b).abs() <= 2e-3 * b.abs(), "star {i}: {a}, not {b}");
                }
                // Here it is that of the flux before the last step.
                let off = (a.noise_flux / b.noise_flux - 1.0).abs();
                assert!(
                    off < 0.02,
                    "star {i}: {} against {}",
                    a.noise_flux,
                    b.noise_flux
                );
            }
            let settled = found.iter().flatten().count();
            assert!(settled > 200, "{settled} of {}", found.len());
        }
    }
}
