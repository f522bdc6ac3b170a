//! Fits of single spots in batches, one star in each lane of a vector.
//!
//! Each fit takes the same steps as that of [`Fitter`](super::fitter::Fitter); only the sums over
//! the pixels run over many stars at once. Windows are small: their rows do not fill a vector, and
//! the sum across a vector takes as long as the pixels.

use super::frame_maps::FrameMaps;
use super::gauss_newton::{MAX_STEPS, StepOutcome, add_background_map, advance};
use super::light::spot_gradient;
use super::normal::NormalEquations;
use super::parameters::{FitConfig, ONE_SPOT, SpotEstimate, SpotFit};
use super::sums::{WindowPixels, flux_variance_of, variance_of};
use super::window::{Window, window_radius};
use crate::detect::psf::{Cumulative, ProfilePart};
use multiversion::multiversion;

/// Stars fitted at the same time.
const BATCH: usize = 16;
/// Most components of a spot that is fitted in a batch.
pub(crate) const MAX_BATCH_COMPONENTS: usize = 8;
/// A value for each of them.
type PerStar = [f32; BATCH];
/// A profile of each of them along an axis.
type Profile<'a> = &'a [ProfilePart<PerStar>];

/// Initial guess of a fit.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BatchStart {
    /// Number of the star, passed back with its fit.
    pub number: usize,
    /// Initial position and flux.
    pub spot: SpotEstimate,
    /// Initial standard deviation of the spot, in pixels.
    pub spot_px: f64,
}

/// A fit in progress.
#[derive(Debug, Clone, Copy)]
struct ActiveFit {
    start: BatchStart,
    /// Steps taken.
    steps: usize,
}

/// Fits many single spots; holds the buffers.
#[derive(Debug, Clone, Default)]
pub(crate) struct BatchFitter {
    lanes: [Option<ActiveFit>; BATCH],
    fits: [SpotFit; BATCH],
    windows: [Window; BATCH],
    /// Side of the windows, in pixels.
    side: usize,
    /// Row by row: the pixels above the background map, in units of the noise; NaN where left out.
    data: Vec<PerStar>,
    /// Components of the spot with most of them; 1 where all are single Gaussians.
    components: usize,
    /// Profiles of the first component of each spot along x and y, of the second, …
    axes: [Axes; MAX_BATCH_COMPONENTS],
}

/// Profiles of a component of each spot along x and y.
#[derive(Debug, Clone, Default)]
struct Axes {
    across: Vec<ProfilePart<PerStar>>,
    down: Vec<ProfilePart<PerStar>>,
    /// Shares of the light.
    weight: PerStar,
}

/// The model of a pixel, in units of the noise.
#[derive(Debug, Clone, Copy)]
struct BatchModel {
    flux: PerStar,
    background: PerStar,
    /// Coefficients of the variance of a pixel: of the light, and of its square.
    variance: [PerStar; 2],
}

/// Sums over the pixels of each star.
#[derive(Debug, Clone, Copy)]
struct BatchSums {
    /// Lower triangle.
    matrix: [[PerStar; ONE_SPOT]; ONE_SPOT],
    right: [PerStar; ONE_SPOT],
    chi2: PerStar,
    pixels: PerStar,
    /// Of w, w·s and w·s²: w is the weight from noise alone, s the fraction of the light.
    shapes: [PerStar; 3],
}

impl BatchFitter {
    /// Fits one spot from each initial guess; `config.spot_px` is the largest of their sizes.
    ///
    /// Calls `on_fit` with the star's number, the fit if it converged, and the window. A lane whose
    /// star is done takes the next one; fits do not depend on each other.
    pub fn fit(
        &mut self,
        maps: &FrameMaps<'_>,
        starts: impl Iterator<Item = BatchStart>,
        config: &FitConfig,
        on_fit: impl FnMut(usize, Option<SpotFit>, &Window),
    ) {
        let cut = |start: &BatchStart, window: &mut Window| {
            maps.cut_out(&[start.spot], window_radius(start.spot_px), window);
        };
        self.fit_cut(cut, starts, config, on_fit);
    }

    /// [`Self::fit`] in windows that `cut` fills for each initial guess. Spots may have up to
    /// [`MAX_BATCH_COMPONENTS`] components; their size is then held.
    pub fn fit_cut(
        &mut self,
        mut cut: impl FnMut(&BatchStart, &mut Window),
        mut starts: impl Iterator<Item = BatchStart>,
        config: &FitConfig,
        mut on_fit: impl FnMut(usize, Option<SpotFit>, &Window),
    ) {
        self.side = 2 * window_radius(config.spot_px) + 1;
        self.data.clear();
        self.data.resize(self.side * self.side, [f32::NAN; BATCH]);
        for lane in 0..BATCH {
            self.begin(lane, starts.next(), &mut cut);
        }
        while self.lanes.iter().any(Option::is_some) {
            self.fill_axes();
            let (data, model) = (&self.data, self.model(config));
            let sums = match self.components {
                1 => sums_over::<1>(data, &self.axes, &model),
                2 => sums_over::<2>(data, &self.axes, &model),
                3 | 4 => sums_over::<4>(data, &self.axes, &model),
                _ => sums_over::<MAX_BATCH_COMPONENTS>(data, &self.axes, &model),
            };
            for lane in 0..BATCH {
                let Some(ActiveFit { start, steps }) = self.lanes[lane] else {
                    continue;
                };
                let mut normal = self.normal_of(lane, &sums, config);
                let fit = &mut self.fits[lane];
                let config = FitConfig {
                    spot_px: start.spot_px,
                    ..*config
                };
                let outcome = advance(fit, &[start.spot], &mut normal, steps, &config);
                if outcome == StepOutcome::Continue && steps + 1 < MAX_STEPS {
                    self.lanes[lane] = Some(ActiveFit {
                        start,
                        steps: steps + 1,
                    });
                    continue;
                }
                let window = &self.windows[lane];
                fit.spots[0].noise_flux = flux_noise(lane, &sums, window);
                let converged = (outcome == StepOutcome::Converged).then(|| fit.clone());
                on_fit(start.number, converged, window);
                self.begin(lane, starts.next(), &mut cut);
            }
        }
    }

    /// Starts the fit of a star in a lane, or leaves the lane empty.
    fn begin(
        &mut self,
        lane: usize,
        start: Option<BatchStart>,
        cut: &mut impl FnMut(&BatchStart, &mut Window),
    ) {
        self.lanes[lane] = start.map(|start| ActiveFit { start, steps: 0 });
        let Some(start) = start else {
            return;
        };
        let fit = &mut self.fits[lane];
        *fit = SpotFit {
            spot_px: start.spot_px,
            ..SpotFit::default()
        };
        fit.spots.push(start.spot);
        let window = &mut self.windows[lane];
        cut(&start, window);
        let groups = window.groups().max(1);
        // NaN beyond the window, where it is smaller than the others.
        for (y, to) in self.data.chunks_mut(self.side).enumerate() {
            let row = window
                .data
                .get(y * groups..(y + 1) * groups)
                .unwrap_or_default();
            let row = row.as_flattened();
            let (inside, beyond) = to.split_at_mut(row.len().min(to.len()));
            for (to, &from) in inside.iter_mut().zip(row) {
                to[lane] = from;
            }
            for to in beyond {
                to[lane] = f32::NAN;
            }
        }
    }

    /// Computes the spots' profiles along both sides of their windows.
    fn fill_axes(&mut self) {
        let active = self.windows.iter().zip(&self.lanes);
        let active = active.filter(|(_, lane)| lane.is_some());
        let counts = active.map(|(window, _)| window.psf.components.len());
        self.components = counts.max().unwrap_or(0).clamp(1, MAX_BATCH_COMPONENTS);
        for (number, axes) in self.axes.iter_mut().enumerate() {
            // As many as are summed over.
            if number >= self.components.next_power_of_two() {
                break;
            }
            let mut centers_px = [[0.0f64; BATCH]; 2];
            let mut cumulative = [Cumulative::of_spot(1.0); BATCH];
            axes.weight = [0.0; BATCH];
            for (lane, (fit, window)) in self.fits.iter().zip(&self.windows).enumerate() {
                let Some(spot) = fit.spots.first() else {
                    continue;
                };
                let component = window.psf.components.get(number);
                let is_single = window.psf.is_gaussian() && number == 0;
                let [dx, dy] = component.map_or([0.0; 2], |component| component.offset_px);
                let share = component.map_or(0.0, |component| component.share);
                axes.weight[lane] = if is_single { 1.0 } else { share as f32 };
                centers_px[0][lane] = spot.x - window.x0 as f64 + dx;
                centers_px[1][lane] = spot.y - window.y0 as f64 + dy;
                let sigma_px = component.map_or(fit.spot_px, |component| component.sigma_px);
                cumulative[lane] = Cumulative::of_spot(sigma_px);
            }
            let Axes { across, down, .. } = axes;
            for (axis, center_px) in [across, down].into_iter().zip(&centers_px) {
                axis.resize(self.side, ProfilePart::default());
                fill(axis, center_px, &cumulative);
            }
        }
    }

    /// The models of all stars at their current parameters.
    fn model(&self, config: &FitConfig) -> BatchModel {
        let mut model = BatchModel {
            flux: [0.0; BATCH],
            background: [0.0; BATCH],
            variance: [[0.0; BATCH]; 2],
        };
        for (lane, (fit, window)) in self.fits.iter().zip(&self.windows).enumerate() {
            let Some(spot) = fit.spots.first() else {
                continue;
            };
            let pixels = WindowPixels::new(window, fit.background, &config.noise);
            model.flux[lane] = (spot.flux * pixels.per_noise) as f32;
            model.background[lane] = pixels.background;
            for (of_model, of_pixels) in model.variance.iter_mut().zip(pixels.variance) {
                of_model[lane] = of_pixels;
            }
        }
        model
    }

    /// The normal equations of one star, from its lane of sums in single precision: those of
    /// `base::least_squares` add row after row, and this is done for every star of a frame.
    fn normal_of(
        &self,
        lane: usize,
        sums: &BatchSums,
        config: &FitConfig,
    ) -> NormalEquations<ONE_SPOT> {
        let (fit, window) = (&self.fits[lane], &self.windows[lane]);
        let pixels = WindowPixels::new(window, fit.background, &config.noise);
        let units: [f64; ONE_SPOT] = std::array::from_fn(|i| pixels.unit(i, 1));
        let mut normal = NormalEquations::empty();
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

/// The standard error of the flux from noise alone, before the last step, in ADU. See
/// [`Fitter::set_flux_noise`](super::fitter::Fitter::set_flux_noise).
fn flux_noise(lane: usize, sums: &BatchSums, window: &Window) -> f64 {
    let sums = sums.shapes.map(|sum| f64::from(sum[lane]));
    let error2 = window.background_noise * window.background_noise;
    flux_variance_of(sums, 1.0 / window.noise_adu, error2).sqrt()
}

/// Computes the profiles along an axis, for spots at `center_px`, where 0 is the centre of the
/// first pixel.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn fill(
    pixels: &mut [ProfilePart<PerStar>],
    center_px: &[f64; BATCH],
    cumulative: &[Cumulative; BATCH],
) {
    let edges_at = |edge: usize| {
        let mut edges = [[0.0f64; BATCH]; 3];
        for lane in 0..BATCH {
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
            for lane in 0..BATCH {
                part[lane] = (after[lane] - before[lane]) as f32;
            }
        }
        before = after;
    }
}

/// Sums over the pixels of all stars.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn sums_over<const COMPONENTS: usize>(
    data: &[PerStar],
    components: &[Axes; MAX_BATCH_COMPONENTS],
    model: &BatchModel,
) -> BatchSums {
    let mut matrix = [[[0.0f32; BATCH]; ONE_SPOT]; ONE_SPOT];
    let mut right = [[0.0f32; BATCH]; ONE_SPOT];
    let [mut chi2, mut pixels] = [[0.0f32; BATCH]; 2];
    let mut shapes = [[0.0f32; BATCH]; 3];
    let side = components[0].across.len();
    let shares: [PerStar; COMPONENTS] = std::array::from_fn(|i| components[i].weight);
    let across: [Profile; COMPONENTS] = std::array::from_fn(|i| &components[i].across[..side]);
    let down: [Profile; COMPONENTS] = std::array::from_fn(|i| &components[i].down[..side]);
    let model = *model;
    for (y, row) in data.chunks_exact(side.max(1)).enumerate().take(side) {
        // Copied so that the compiler need not assume aliasing.
        let downs: [ProfilePart<PerStar>; COMPONENTS] = std::array::from_fn(|i| down[i][y]);
        for (x, data) in row.iter().enumerate() {
            let data = *data;
            let acrosses: [ProfilePart<PerStar>; COMPONENTS] =
                std::array::from_fn(|i| across[i][x]);
            let mut gradient = [[1.0f32; BATCH]; ONE_SPOT];
            let [mut weight, mut residual] = [[0.0f32; BATCH]; 2];
            for lane in 0..BATCH {
                let flux = model.flux[lane];
                let mut parts = [0.0f32; 4];
                for ((across, down), share) in acrosses.iter().zip(&downs).zip(&shares) {
                    let of_component = spot_gradient(flux, &across.lane(lane), &down.lane(lane));
                    if COMPONENTS == 1 {
                        parts = of_component;
                    } else {
                        for (part, of_component) in parts.iter_mut().zip(of_component) {
                            *part += share[lane] * of_component;
                        }
                    }
                }
                let [shape, by_x, by_y, by_size] = parts;
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
                for lane in 0..BATCH {
                    weighted[lane] *= gradient[i][lane];
                    right[i][lane] += weighted[lane] * residual[lane];
                }
                for j in 0..i + 1 {
                    for lane in 0..BATCH {
                        matrix[i][j][lane] += weighted[lane] * gradient[j][lane];
                    }
                }
            }
        }
    }
    BatchSums {
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
    use crate::detect::fit::fitter::Fitter;
    use crate::detect::fit::parameters::NoiseModel;
    use crate::detect::pixels::View;

    const SPOT_PX: f64 = 0.8;
    const SIDE_PX: usize = 256;

    /// Stars in rows, brighter further down.
    fn stars() -> Vec<SpotEstimate> {
        let place = |i: usize| 12.0 + 16.0 * i as f64 + 0.37 * (i % 3) as f64;
        let star = |i: usize| SpotEstimate {
            x: place(i % 15),
            y: place(i / 15),
            flux: 400.0 + 60.0 * i as f64,
            ..SpotEstimate::default()
        };
        (0..15 * 15).map(star).collect()
    }

    fn frame_of(stars: &[SpotEstimate]) -> Vec<f32> {
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

    fn initial_guess((number, star): (usize, &SpotEstimate)) -> BatchStart {
        let (x, y) = (star.x.round(), star.y.round());
        BatchStart {
            number,
            spot: SpotEstimate { x, y, ..*star },
            spot_px: SPOT_PX,
        }
    }

    fn assert_agree(star: usize, batch: &SpotFit, single: &SpotFit) {
        let (a, b) = (batch.spots[0], single.spots[0]);
        let off = (a.x - b.x).abs().max((a.y - b.y).abs());
        assert!(off < 1e-3 * b.sigma_x, "star {star}: {off} px");
        // The batch takes the noise of the flux before the last step.
        let off = (a.noise_flux / b.noise_flux - 1.0).abs();
        assert!(off < 0.02, "star {star}: {a:?}, not {b:?}");
        for (a, b) in [
            (a.flux, b.flux),
            (a.sigma_x, b.sigma_x),
            (a.sigma_flux, b.sigma_flux),
            (batch.spot_px, single.spot_px),
            (batch.size_error_px, single.size_error_px),
            (batch.chi2, single.chi2),
        ] {
            assert!((a - b).abs() <= 2e-3 * b.abs(), "star {star}: {a}, not {b}");
        }
    }

    #[test]
    fn batch_fits_agree_with_single_fits() {
        let truth = stars();
        let pixels = frame_of(&truth);
        let view = View::new(&pixels, SIDE_PX, SIDE_PX);
        let mut mesh = Mesh::default();
        mesh.measure(&view, &MeshConfig::of_pixels(64, 1e-6));
        let maps = FrameMaps {
            view,
            background: &mesh,
            filtered: None,
            saturation_adu: f32::INFINITY,
            spot_px: SPOT_PX,
            matched_gain: 0.3,
            psf: None,
        };
        for free_size in [false, true] {
            let config = FitConfig {
                spot_px: SPOT_PX,
                free_size,
                noise: NoiseModel {
                    shot_adu: 0.5,
                    model_error2: 1e-4,
                },
            };
            let starts = truth.iter().enumerate().map(initial_guess);
            let mut fits = vec![None; truth.len()];
            BatchFitter::default().fit(&maps, starts.clone(), &config, |i, fit, _| fits[i] = fit);
            let mut fitter = Fitter::default();
            let mut window = Window::default();
            for BatchStart { number, spot, .. } in starts {
                maps.cut_out(&[spot], window_radius(SPOT_PX), &mut window);
                let mut single = fitter.fit(&window, &[spot], &config);
                fitter.set_flux_noise(&window, &mut single, &config);
                assert_eq!(single.converged, fits[number].is_some(), "star {number}");
                if let Some(fit) = &fits[number] {
                    assert_agree(number, fit, &single);
                }
            }
            let converged = fits.iter().flatten().count();
            assert!(converged > 200, "{converged} of {}", fits.len());
        }
    }
}
