//! The bright stars that tell the PSF, fitted with a size and an elongation of their own.

use crate::base::size::Size;
use crate::base::statistics::median_of;
use crate::detect::candidates::Peak;
use crate::detect::fit::{
    FrameMaps, NoiseModel, NormalEquations, SpotEstimate, Window, WindowPixels, sum_of,
};
use crate::detect::psf::{
    DrawBuffers, EffectivePsf, FieldFrame, FieldMoments, GROUP_PX, GaussianComponent,
    LIGHT_BY_PLACE, LitPart, LocalPsf, NarrowProfiles, PixelGroup, ShareGroup, SpotMoments,
    covariance_by, stretch_by,
};
use crate::detect::star_model::isolated_peaks;
use multiversion::multiversion;

/// Most stars that are used.
const MAX_STARS: usize = 48;
/// Peaks below this signal-to-noise ratio tell little about the form of a spot.
const MIN_SNR: f32 = 15.0;
/// Error of the PSF while it is measured, as a part of the light, squared: the brightest stars must
/// not count for all.
pub(super) const MODEL_ERROR2: f64 = 0.02 * 0.02;

/// Steps of the stars' fits in each round.
pub(super) const STEPS: usize = 2;

/// Parameters of a star: x, y, flux, background; size and elongation.
const PARAMETERS: usize = 7;
/// Those without size and elongation.
const PLACE: usize = 4;

/// A bright star.
#[derive(Debug, Clone)]
pub(super) struct PsfStar {
    /// Its pixels, and the spot at its place.
    pub window: Window,
    /// Position and flux.
    pub spot: SpotEstimate,
    /// Background above the map, in ADU.
    pub background: f64,
    /// Size and elongation of its own.
    pub moments: SpotMoments,
    /// Their variances.
    pub variances: SpotMoments,
    /// Chi² over the degrees of freedom.
    pub chi2: f64,
}

/// What the pixels of a group hold of a spot: the share of the light, and its derivatives with
/// respect to x, y, and the moments.
type MomentShares = [PixelGroup; 6];

/// Fits the stars; holds the buffers.
#[derive(Debug, Default)]
pub(super) struct StarFitter {
    noise: NoiseModel,
    profiles: NarrowProfiles,
    /// Row by row, as the pixels of the window.
    fractions: Vec<MomentShares>,
    local: LocalPsf,
    /// The spot of all stars, where they have the same,
    common: LocalPsf,
    /// and the PSF whose it is.
    tabulated: Option<EffectivePsf>,
    /// The last spot drawn from its table.
    drawn: Vec<ShareGroup>,
    buffers: DrawBuffers,
}

impl StarFitter {
    pub fn new(noise: NoiseModel) -> Self {
        Self {
            noise,
            ..Self::default()
        }
    }

    /// Tabulates a PSF that is the same everywhere: stars are drawn with it, as long as their moments
    /// are held. Call it before each other PSF.
    pub fn tabulate(&mut self, psf: &EffectivePsf) {
        if self.tabulated.as_ref() == Some(psf) {
            return;
        }
        self.tabulated = Some(psf.clone());
        self.common.clear();
        if psf.is_uniform() {
            psf.at(0.0, 0.0, &mut self.common);
            self.common.tabulate();
        }
    }

    /// Moves all stars by a step of their fits to `psf`; sets their own moments where these are
    /// `free`.
    pub fn step(&mut self, stars: &mut [PsfStar], psf: &EffectivePsf, free: bool) {
        if !free {
            self.tabulate(psf);
        }
        for star in stars {
            if !free {
                self.step_one::<PLACE>(star, psf);
                continue;
            }
            let change = self.step_one::<PARAMETERS>(star, psf);
            let here = psf.moments.at(star.spot.x, star.spot.y);
            let is_finite = |change: &SpotMoments| change.iter().all(|c| c.is_finite());
            let change = change.filter(is_finite).unwrap_or_default();
            star.moments = std::array::from_fn(|i| here[i] + change[i].clamp(-0.5, 0.5));
        }
    }

    /// A step of the first `N` parameters of one star; returns the change of its moments, `None`
    /// where there is no solution.
    fn step_one<const N: usize>(
        &mut self,
        star: &mut PsfStar,
        psf: &EffectivePsf,
    ) -> Option<SpotMoments> {
        /// Longest step, in pixels.
        const MAX_STEP_PX: f64 = 0.5;
        self.draw::<N>(star, psf);
        let mut normal = self.linearise::<N>(star);
        star.chi2 = normal.chi2 / (normal.pixels as f64 - PARAMETERS as f64).max(1.0);
        if normal.factorise(N) < N {
            star.variances = [f64::INFINITY; 3];
            return None;
        }
        let change = normal.solve(N);
        star.spot.x += change[0].clamp(-MAX_STEP_PX, MAX_STEP_PX);
        star.spot.y += change[1].clamp(-MAX_STEP_PX, MAX_STEP_PX);
        star.spot.flux += change[2];
        star.background += change[3];
        if N < PARAMETERS {
            return Some([0.0; 3]);
        }
        let variances = normal.variances(N);
        star.variances = std::array::from_fn(|i| variances[PLACE + i]);
        Some(std::array::from_fn(|i| change[PLACE + i]))
    }

    /// Moves stars by some steps of their fits to `psf`, with their moments held.
    pub fn place(&mut self, stars: &mut [PsfStar], psf: &EffectivePsf) {
        for _ in 0..STEPS {
            self.step(stars, psf, false);
        }
    }

    /// Chi² of a star a linear step of its fit to `psf` on.
    pub fn chi2(&mut self, star: &PsfStar, psf: &EffectivePsf) -> f64 {
        self.draw::<PLACE>(star, psf);
        let mut normal = self.linearise::<PLACE>(star);
        if normal.factorise(PLACE) < PLACE {
            return normal.chi2;
        }
        let change = normal.solve(PLACE);
        normal.chi2
            - change
                .iter()
                .zip(normal.right)
                .map(|(c, r)| c * r)
                .sum::<f64>()
    }

    /// Computes the shares of the pixels of a star with this PSF; with fewer than all parameters,
    /// not their derivatives with respect to the moments.
    fn draw<const N: usize>(&mut self, star: &PsfStar, psf: &EffectivePsf) {
        if N < PARAMETERS && !self.common.table.is_empty() {
            self.draw_common(star);
            return;
        }
        let Self {
            profiles,
            fractions: shares,
            local,
            ..
        } = self;
        let PsfStar { window, spot, .. } = star;
        psf.at(spot.x, spot.y, local);
        shares.clear();
        shares.resize(window.groups() * window.height, [[0.0; GROUP_PX]; 6]);
        let place = [spot.x - window.x0 as f64, spot.y - window.y0 as f64];
        if N < PARAMETERS {
            draw_still_components(&local.components, place, window.size(), profiles, shares);
        } else {
            let here = psf.moments.at(spot.x, spot.y);
            draw_components(
                &local.components,
                here,
                place,
                window.size(),
                profiles,
                shares,
            );
        }
    }

    /// [`Self::draw`] from the table of all stars.
    fn draw_common(&mut self, PsfStar { window, spot, .. }: &PsfStar) {
        let place = [spot.x - window.x0 as f64, spot.y - window.y0 as f64];
        let sizes = [self.common.spot_px, 1.0];
        let empty = [0.0; GROUP_PX];
        self.drawn.clear();
        self.drawn.resize(window.data.len(), [empty; 4]);
        let (buffers, drawn) = (&mut self.buffers, &mut self.drawn);
        self.common
            .table
            .draw::<LIGHT_BY_PLACE>(place, window.size(), sizes, buffers, drawn);
        self.fractions.clear();
        let placed =
            |[light, by_x, by_y, _]: &ShareGroup| [*light, *by_x, *by_y, empty, empty, empty];
        self.fractions.extend(self.drawn.iter().map(placed));
    }

    /// The normal equations of the first `N` parameters of a star whose shares were drawn, in ADU.
    fn linearise<const N: usize>(&self, star: &PsfStar) -> NormalEquations<N> {
        let PsfStar { window, spot, .. } = star;
        let pixels = WindowPixels::new(window, star.background, &self.noise);
        let mut normal = NormalEquations::empty();
        let flux = (spot.flux * pixels.per_noise) as f32;
        add_pixels(&mut normal, flux, &self.fractions, &pixels);
        let weight = window.background_error.powi(-2);
        normal.matrix[3][3] += weight;
        normal.right[3] -= weight * star.background;
        normal
    }

    /// Square root of the weight, and the value above the background times that root, of each pixel
    /// of a star with this PSF, in units of the noise. Those of pixels that are left out are 0.
    pub fn weigh(
        &mut self,
        star: &PsfStar,
        psf: &EffectivePsf,
        roots: &mut Vec<PixelGroup>,
        values: &mut Vec<PixelGroup>,
    ) {
        self.draw::<PLACE>(star, psf);
        let pixels = WindowPixels::new(&star.window, star.background, &self.noise);
        let flux = (star.spot.flux * pixels.per_noise) as f32;
        roots.clear();
        values.clear();
        for (data, shares) in pixels.data.iter().zip(&self.fractions) {
            let root = |lane: usize| {
                let root = 1.0 / pixels.variance(flux * shares[0][lane]).sqrt();
                if data[lane].is_nan() { 0.0 } else { root }
            };
            let of_group: PixelGroup = std::array::from_fn(root);
            let value = |lane: usize| {
                let above = data[lane] - pixels.background;
                if above.is_nan() {
                    0.0
                } else {
                    of_group[lane] * above
                }
            };
            values.push(std::array::from_fn(value));
            roots.push(of_group);
        }
    }
}

/// Adds the pixels of a star to the normal equations of its first `N` parameters; `flux` is in units
/// of the noise.
#[allow(
    clippy::needless_range_loop,
    reason = "rows and columns of matrices read best as indices"
)]
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn add_pixels<const N: usize>(
    normal: &mut NormalEquations<N>,
    flux: f32,
    shares: &[MomentShares],
    pixels: &WindowPixels<'_>,
) {
    let mut matrix = [[[0.0f32; GROUP_PX]; N]; N];
    let mut right = [[0.0f32; GROUP_PX]; N];
    let [mut chi2, mut valid] = [[0.0f32; GROUP_PX]; 2];
    for group in 0..pixels.groups {
        for (row, data) in pixels.column_of_groups(group).enumerate() {
            let shares = shares[row * pixels.groups + group];
            for lane in 0..GROUP_PX {
                let part = shares[0][lane];
                let by = |number: usize| flux * shares[number][lane];
                let all = [by(1), by(2), part, 1.0, by(3), by(4), by(5)];
                let light = flux * part;
                let is_valid = !data[lane].is_nan();
                let weight = 1.0 / pixels.variance(light);
                let weight = if is_valid { weight } else { 0.0 };
                let residual = data[lane] - light - pixels.background;
                let residual = if is_valid { residual } else { 0.0 };
                valid[lane] += if is_valid { 1.0 } else { 0.0 };
                chi2[lane] += residual * residual * weight;
                for i in 0..N {
                    let weighted = all[i] * weight;
                    right[i][lane] += weighted * residual;
                    for j in 0..i + 1 {
                        matrix[i][j][lane] += weighted * all[j];
                    }
                }
            }
        }
    }
    for i in 0..N {
        let unit = pixels.unit(i, 1);
        normal.right[i] += sum_of(right[i]) * unit;
        for j in 0..i + 1 {
            normal.matrix[i][j] += sum_of(matrix[i][j]) * unit * pixels.unit(j, 1);
        }
    }
    normal.chi2 += sum_of(chi2);
    normal.pixels += sum_of(valid) as usize;
}

/// What larger moments change in a component.
struct ComponentChanges {
    /// Inverse of its standard deviation, in px⁻¹.
    per_sigma: f32,
    /// How far each of the moments moves it along x and y, in pixels.
    moves: [[f32; 2]; 3],
    /// Change of its covariance xx, yy, xy by each of the moments, in px².
    widening: [[f32; 3]; 3],
}

/// Adds components that have these moments to the pixels of a window, with a spot at this place.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn draw_components(
    components: &[GaussianComponent],
    moments: SpotMoments,
    [x_px, y_px]: [f64; 2],
    size: Size,
    profiles: &mut NarrowProfiles,
    into: &mut [MomentShares],
) {
    let stretches = stretch_by(moments);
    // A single component widens itself; those of a mixture move, and widen with the size only.
    let widening_of = |sigma_px: f64| {
        let wider = 2.0 * sigma_px * sigma_px;
        [[wider, wider, 0.0], [0.0; 3], [0.0; 3]]
    };
    let of_single = (components.len() == 1).then(|| covariance_by(moments));
    let width = size.width.div_ceil(GROUP_PX);
    for component in components {
        let [dx, dy] = component.offset_px;
        let part = profiles.fill([x_px + dx, y_px + dy], component.sigma_px, size);
        let widening = of_single.unwrap_or_else(|| widening_of(component.sigma_px));
        let changes = ComponentChanges {
            per_sigma: (1.0 / component.sigma_px) as f32,
            moves: stretches.map(|rows| rows.map(|[a, b]| (a * dx + b * dy) as f32)),
            widening: widening.map(|of_moment| of_moment.map(|change| change as f32)),
        };
        add_component_with_moments(
            component.share as f32,
            &changes,
            profiles,
            part,
            into,
            width,
        );
    }
}

/// The same without the derivatives with respect to the moments.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn draw_still_components(
    components: &[GaussianComponent],
    [x_px, y_px]: [f64; 2],
    size: Size,
    profiles: &mut NarrowProfiles,
    into: &mut [MomentShares],
) {
    let width = size.width.div_ceil(GROUP_PX);
    for component in components {
        let [dx, dy] = component.offset_px;
        let part = profiles.fill([x_px + dx, y_px + dy], component.sigma_px, size);
        add_still_component(component.share as f32, profiles, part, into, width);
    }
}

/// Adds a component to the rows of `width` groups.
#[allow(
    clippy::needless_range_loop,
    reason = "lanes of several arrays read best as indices"
)]
#[inline(always)]
fn add_component_with_moments(
    share: f32,
    changes: &ComponentChanges,
    profiles: &NarrowProfiles,
    part: LitPart,
    into: &mut [MomentShares],
    width: usize,
) {
    for row in part.rows[0]..part.rows[1] {
        let down = profiles.down(row, &part);
        let [value, slope, growth] =
            [down.value, down.by_center, down.by_sigma].map(|part| share * part);
        for group in part.groups[0]..part.groups[1] {
            let across = profiles.across(group, &part);
            // Copied so that the compiler need not assume aliasing.
            let mut sums = into[row * width + group];
            for lane in 0..GROUP_PX {
                let here = across.value[lane];
                let by_x = across.by_center[lane] * value;
                let by_y = here * slope;
                // The derivative with respect to σ is σ times the second one with respect to the
                // place.
                let xx = 0.5 * across.by_sigma[lane] * value * changes.per_sigma;
                let yy = 0.5 * here * growth * changes.per_sigma;
                let xy = across.by_center[lane] * slope;
                sums[0][lane] += here * value;
                sums[1][lane] += by_x;
                sums[2][lane] += by_y;
                for moment in 0..3 {
                    let [u, v] = changes.moves[moment];
                    let [cxx, cyy, cxy] = changes.widening[moment];
                    sums[3 + moment][lane] += by_x * u + by_y * v + xx * cxx + yy * cyy + xy * cxy;
                }
            }
            into[row * width + group] = sums;
        }
    }
}

/// Adds a component and its derivatives with respect to x and y to the rows of `width` groups.
#[inline(always)]
fn add_still_component(
    share: f32,
    profiles: &NarrowProfiles,
    part: LitPart,
    into: &mut [MomentShares],
    width: usize,
) {
    for row in part.rows[0]..part.rows[1] {
        let down = profiles.down(row, &part);
        let [value, slope] = [down.value, down.by_center].map(|part| share * part);
        for group in part.groups[0]..part.groups[1] {
            let across = profiles.across(group, &part);
            let into = &mut into[row * width + group];
            let [mut shares, mut by_x, mut by_y, ..] = *into;
            for lane in 0..GROUP_PX {
                shares[lane] += across.value[lane] * value;
                by_x[lane] += across.by_center[lane] * value;
                by_y[lane] += across.value[lane] * slope;
            }
            (into[0], into[1], into[2]) = (shares, by_x, by_y);
        }
    }
}

/// The bright stars of a frame, alone and whole within `radius_px`, with moments of their own.
pub(super) fn bright_stars(
    maps: &FrameMaps<'_>,
    peaks: &[Peak],
    radius_px: usize,
    fitter: &mut StarFitter,
) -> Vec<PsfStar> {
    let bright = &peaks[..peaks.partition_point(|peak| peak.snr >= MIN_SNR)];
    let isolated = isolated_peaks(maps, bright.iter(), peaks);
    let mut stars: Vec<PsfStar> = isolated
        .filter_map(|(peak, _)| first_fit(maps, peak, radius_px, fitter))
        .take(MAX_STARS)
        .collect();
    keep_alike(&mut stars);
    stars
}

/// Fits a star with a size of its own; `None` where that does not converge, or pixels are left out.
fn first_fit(
    maps: &FrameMaps<'_>,
    peak: &Peak,
    radius_px: usize,
    fitter: &mut StarFitter,
) -> Option<PsfStar> {
    const STEPS: usize = 6;
    /// Steps shorter than this are the last, in pixels and in ln σ: the fits go on with other spots.
    const SETTLED: f64 = 2e-3;
    /// Largest elongation of a star, as in [`SpotMoments`]: axes in a ratio of 4.5.
    const MAX_ELONGATION: f64 = 1.5;
    /// A fit has converged when its last step is shorter, in pixels and in ln σ.
    const MAX_LAST_STEP: f64 = 0.05;
    let spot = maps.initial_guess(peak);
    let mut window = Window::default();
    maps.cut_out(&[spot], radius_px, &mut window);
    let side = 2 * radius_px + 1;
    let is_whole = window.width == side && window.height == side;
    if !is_whole || window.pixels_adu().any(|(.., value)| value.is_nan()) {
        return None;
    }
    let ln_spot = libm::log(maps.spot_px);
    let mut star = PsfStar {
        window,
        spot,
        background: 0.0,
        moments: [ln_spot, 0.0, 0.0],
        variances: [f64::INFINITY; 3],
        chi2: 0.0,
    };
    let frame = FieldFrame::new(maps.view.size());
    let mut moved = f64::INFINITY;
    for _ in 0..STEPS {
        let before = star.spot;
        let size = [star.moments[0], 0.0, 0.0];
        let psf =
            EffectivePsf::gaussian(FieldMoments::constant(frame, size), maps.spot_px, radius_px);
        let [by_size, e1, e2] = fitter.step_one::<PARAMETERS>(&mut star, &psf)?;
        let by_size = by_size.clamp(-0.3, 0.3);
        let [e1, e2] = [e1, e2].map(|e| e.clamp(-MAX_ELONGATION, MAX_ELONGATION));
        star.moments = [star.moments[0] + by_size, e1, e2];
        let distance = libm::hypot(star.spot.x - before.x, star.spot.y - before.y);
        moved = distance.max(by_size.abs());
        if moved < SETTLED {
            break;
        }
    }
    let is_near = libm::hypot(star.spot.x - spot.x, star.spot.y - spot.y) < 1.0 + maps.spot_px;
    let is_finite = star.moments.iter().all(|moment| moment.is_finite());
    let is_star = moved < MAX_LAST_STEP && is_near && is_finite && star.spot.flux > 0.0;
    is_star.then_some(star)
}

/// Drops sources that are not stars: of another size than most, or with far larger residuals.
fn keep_alike(stars: &mut Vec<PsfStar>) {
    /// Largest factor of the size to that of the median star.
    const SIZE_FACTOR: f64 = 2.0;
    /// Largest chi² over that of the median star.
    const CHI2_FACTOR: f64 = 8.0;
    let size = median_of(stars.iter().map(|star| star.moments[0])).unwrap_or(0.0);
    let chi2 = median_of(stars.iter().map(|star| star.chi2)).unwrap_or(0.0);
    stars.retain(|star| {
        let is_alike = (star.moments[0] - size).abs() < libm::log(SIZE_FACTOR);
        is_alike && star.chi2 < CHI2_FACTOR * chi2.max(1.0)
    });
}
