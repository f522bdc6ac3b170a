//! From peaks to detections: groups of touching spots, centroids by the chosen method, flags.

use super::plateau::Plateau;
use super::{centroid, shape};
use crate::base::coords::PixelPoint;
use crate::detect::candidates::{Peak, Region};
use crate::detect::config::CentroidMethod;
use crate::detect::detection::{Detection, DetectionFlags};
use crate::detect::fit::{
    Fit, FitConfig, FitWork, MAX_SPOTS, NoiseModel, Scene, Spot, Spots, window_radius,
};
use crate::detect::pixels::View;
use crate::detect::psf::PIXEL_VARIANCE_PX2;
use crate::detect::threads::for_each_worker;
use std::mem;

/// Spots closer than this many of their standard deviations touch, and are fitted together.
const TOUCHING_SIGMA: f64 = 4.6;
/// Spots closer than this many standard deviations beyond the window still shine into it.
const WINDOW_MARGIN_SIGMA: f64 = 3.0;

/// A source is tried as a pair where it is wider than a spot by this many standard errors,
const PAIR_EXCESS_SIGMA: f64 = 5.0;
/// by this part of the spot,
const PAIR_EXCESS: f64 = 0.12;
/// and brighter than this many standard errors.
const PAIR_SNR: f64 = 15.0;
/// A single spot fits badly where its chi² over the degrees of freedom is above this: it is tried as a pair, too.
const PAIR_MIN_CHI2: f64 = 2.0;
/// So is one whose area above the threshold is longer than broad by this factor: the fit's window ends
/// before a neighbour four spot sizes away.
const PAIR_ELONGATION: f64 = 1.35;
/// Both stars of a pair stand out by this many standard errors.
const PAIR_MIN_FLUX_SIGMA: f64 = 5.0;
/// Chi² over the degrees of freedom of a pair is below this.
const PAIR_MAX_CHI2: f64 = 3.0;

/// The buffers and results of one thread.
#[derive(Debug, Clone, Default)]
pub(crate) struct MeasureWorker {
    /// Buffers of the fits.
    fits: FitWork,
    /// What the thread has measured.
    found: Vec<Detection>,
}

/// All that the measurement of a frame's peaks needs.
pub(crate) struct Measurement<'a> {
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
    /// Measures all peaks, which come strongest first.
    pub fn run(
        &self,
        peaks: &[Peak],
        workers: &mut [MeasureWorker],
        known: &mut KnownSpots,
        detections: &mut Vec<Detection>,
    ) {
        known.begin(peaks, self);
        let threads = workers.len();
        // What is alone can be measured in any order.
        let KnownSpots { spots, alone, .. } = &*known;
        for_each_worker(workers, &|worker, thread| {
            let of_thread = alone.iter().skip(thread).step_by(threads);
            let indices = of_thread.map(|&index| index as usize);
            self.measure_alone(peaks, indices, spots, worker);
        });
        for worker in workers.iter_mut() {
            detections.append(&mut worker.found);
        }
        let Some(MeasureWorker { fits, .. }) = workers.first_mut() else {
            return;
        };
        for i in 0..known.close.len() {
            let index = known.close[i] as usize;
            let place = known.place_of(index, peaks, TOUCHING_SIGMA * self.width_px());
            if let Some(spot) = self.measure(&place, None, fits, detections) {
                known.spots[index] = spot;
                known.is_known[index] = true;
            }
        }
    }

    /// Measures peaks that stand alone.
    fn measure_alone(
        &self,
        peaks: &[Peak],
        indices: impl Iterator<Item = usize> + Clone,
        spots: &[Spot],
        MeasureWorker { fits, found }: &mut MeasureWorker,
    ) {
        found.clear();
        let place_of = |index: usize| Place {
            peaks,
            index,
            near: &[],
            start: Spots::from_iter([spots[index]]),
            beyond: &[],
        };
        let spot_px = self.scene.spot_px;
        let saturated = indices.clone().filter(|&i| peaks[i].saturated);
        let others = indices.filter(|&i| !peaks[i].saturated);
        for index in saturated {
            self.measure(&place_of(index), None, fits, found);
        }
        let mut side_by_side = mem::take(&mut fits.side_by_side);
        let starts = others.map(|index| (index, spots[index], spot_px));
        let config = self.fit_config();
        side_by_side.fit(&self.scene, starts, &config, |index, fit, window| {
            fits.window.copy_from(window);
            self.measure(&place_of(index), fit, fits, found);
        });
        fits.side_by_side = side_by_side;
    }

    /// How far a spot can matter to another, in pixels.
    fn reach_px(&self) -> f64 {
        window_radius(self.scene.spot_px) as f64 * 1.5 + WINDOW_MARGIN_SIGMA * self.width_px()
    }

    /// Standard deviation of the spot with the pixel, in pixels.
    fn width_px(&self) -> f64 {
        (self.scene.spot_px.powi(2) + PIXEL_VARIANCE_PX2).sqrt()
    }

    /// Measures one peak, which may be fitted, its window in `work`; adds one detection, or two where it turns out to be a close
    /// pair. Its spot, if that is found.
    fn measure(
        &self,
        place: &Place<'_>,
        fitted: Option<Fit>,
        work: &mut FitWork,
        out: &mut Vec<Detection>,
    ) -> Option<Spot> {
        let Place { start, beyond, .. } = place;
        let peak = &place.peaks[place.index];
        let region = &self.regions[peak.region];
        let is_alone = start.len() == 1;
        let mut fit = match fitted {
            Some(fit) => fit,
            None => self.fit_spots(start, peak, beyond, work),
        };
        // A fit that does not know the place to within the spot's width has found nothing.
        fit.converged &= is_placed(&fit.spots[0], fit.spot_px);
        let is_single = fit.converged && is_alone;
        let pair = if is_single && self.may_be_pair(&fit, peak, region) {
            self.as_pair(&fit, beyond, work)
        } else {
            None
        };
        let is_star = pair.is_none() && is_single && !peak.saturated;
        if let Some(mut pair) = pair {
            // Of two spots, one may be that of another peak, which has its own turn.
            let is_others = |spot| place.has_other_at(spot, TOUCHING_SIGMA * self.width_px());
            if is_others(pair.spots[0]) {
                pair.spots.swap(0, 1);
            }
            let mut second = pair.clone();
            second.spots.swap(0, 1);
            let spot = second.spots[0];
            if !is_others(spot) {
                let mut companion =
                    self.detection_of(&second, &self.peak_under(spot, peak), region);
                companion.flags.blended = true;
                self.finish(&second, &mut companion, work, out);
            }
            fit = pair;
        }
        let mut detection = self.detection_of(&fit, peak, region);
        if is_star {
            shape::judge(self, peak, &fit, &mut detection, work);
        }
        detection.flags.blended = fit.spots.len() > 1;
        self.set_trail(peak, region, &mut detection);
        self.finish(&fit, &mut detection, work, out);
        fit.converged.then(|| fit.spots[0])
    }

    /// Fits the spots at a peak; a saturated one that is alone with a size of its own.
    fn fit_spots(&self, start: &Spots, peak: &Peak, beyond: &[Spot], work: &mut FitWork) -> Fit {
        let mut fit = if peak.saturated && start.len() == 1 {
            let size = (1.5 * self.scene.spot_px, self.noise);
            self.scene.fit_free(start[0], beyond, size, work)
        } else {
            self.fit_fixed(start, beyond, work)
        };
        let FitWork { fitter, window, .. } = work;
        if is_placed(&fit.spots[0], fit.spot_px) {
            fitter.set_flux_noise(window, &mut fit, &self.fit_config());
        }
        fit
    }

    /// Flags a trail, and places it in its middle, known along it to its length.
    fn set_trail(&self, peak: &Peak, region: &Region, detection: &mut Detection) {
        if shape::is_trail(region, peak, self.width_px(), self.threshold) {
            detection.flags.trail = true;
            detection.position = PixelPoint::new(region.x, region.y);
            detection.sigma_x_px = region.major_px;
            detection.sigma_y_px = region.major_px;
        }
    }

    /// The grey-weighted centroid where asked for, and the frame's coordinates.
    fn finish(
        &self,
        fit: &Fit,
        detection: &mut Detection,
        work: &mut FitWork,
        out: &mut Vec<Detection>,
    ) {
        let is_by_area = detection.flags.saturated && !fit.converged;
        let is_grey = self.method == CentroidMethod::GreyWeighted;
        if is_grey && !detection.flags.trail && !is_by_area {
            centroid::grey_weighted(&self.scene, &self.noise, fit, detection, work);
        }
        self.place(detection);
        out.push(*detection);
    }

    /// The peak that a spot would have made had the filter not melted it into `peak`.
    fn peak_under(&self, spot: Spot, peak: &Peak) -> Peak {
        let view = &self.scene.view;
        let pixel = |at: f64, side: usize| (at.round().max(0.0) as usize).min(side - 1);
        let under = Peak {
            x: pixel(spot.x, view.width),
            y: pixel(spot.y, view.height),
            offset_px: [0.0; 2],
            ..*peak
        };
        let saturated = brightest_within(1, &under, view) >= f64::from(self.scene.saturation_adu);
        Peak { saturated, ..under }
    }

    /// Whether a bright source is too wide for a star, fits badly, or stands out over a drawn-out area.
    fn may_be_pair(&self, fit: &Fit, peak: &Peak, region: &Region) -> bool {
        let is_wide = fit.size_excess_px > PAIR_EXCESS_SIGMA * fit.size_error_px
            && fit.size_excess_px > PAIR_EXCESS * self.scene.spot_px;
        let is_sharp = fit.size_excess_px < 0.0 && !peak.saturated;
        let is_bad = fit.chi2 > PAIR_MIN_CHI2 * fit.degrees.max(1.0) && !is_sharp;
        let is_drawn_out = region.peaks == 1 && region.major_px > PAIR_ELONGATION * region.minor_px;
        let is_bright = fit.spots[0].flux >= PAIR_SNR * fit.spots[0].sigma_flux;
        is_bright && (is_wide || is_bad || is_drawn_out)
    }

    /// A fit of two spots, where two explain the source well and one does not.
    ///
    /// The matched filter melts stars closer than some two spot sizes into one peak, and makes a
    /// shoulder of a fainter one up to four spot sizes away. The fit's window is left in `work` where
    /// there is no pair.
    fn as_pair(&self, fit: &Fit, beyond: &[Spot], work: &mut FitWork) -> Option<Fit> {
        let FitWork {
            window,
            kept_window,
            ..
        } = work;
        kept_window.copy_from(window);
        let drawn_out = self.ends_of(fit, work)?;
        let pair = self
            .fit_pair(fit, &drawn_out, beyond, work)
            .or_else(|| self.fit_pair(fit, &self.with_remainder(fit, beyond, work)?, beyond, work));
        if pair.is_none() {
            work.window.copy_from(&work.kept_window);
        }
        pair
    }

    /// Two spots at the ends of a drawn-out one.
    fn ends_of(&self, fit: &Fit, work: &mut FitWork) -> Option<[Spot; 2]> {
        let axis = work.fitter.residual_axis(&work.window, fit)?;
        let half_px = 1.2 * self.width_px();
        let spot = fit.spots[0];
        Some([-half_px, half_px].map(|step| Spot {
            x: spot.x + step * axis.0,
            y: spot.y + step * axis.1,
            flux: 0.5 * spot.flux,
            ..spot
        }))
    }

    /// The spot, and another where most light is left without it.
    fn with_remainder(&self, fit: &Fit, beyond: &[Spot], work: &mut FitWork) -> Option<[Spot; 2]> {
        /// Light of a spot over that in its 3x3 brightest pixels, about.
        const LIGHT_IN_ALL: f64 = 1.5;
        let radius = window_radius(self.scene.spot_px) + self.width_px().ceil() as usize;
        let FitWork { fitter, window, .. } = work;
        self.scene.cut(&fit.spots[..1], radius, window);
        self.scene.subtract(beyond, fitter, window);
        fitter.subtract(window, &fit.spots, fit.spot_px);
        let (mut most, mut place) = (0.0, None);
        for row in 1..window.height.saturating_sub(1) {
            for column in 1..window.width.saturating_sub(1) {
                let light: f64 = (row - 1..row + 2)
                    .flat_map(|r| (column - 1..column + 2).map(move |c| (c, r)))
                    .map(|(c, r)| window.at(c, r))
                    .sum();
                // NaN, where a pixel is left out, is not more.
                if light > most {
                    (most, place) = (light, Some((window.x0 + column, window.y0 + row)));
                }
            }
        }
        let (x, y) = place?;
        let remainder = Spot {
            x: x as f64,
            y: y as f64,
            flux: LIGHT_IN_ALL * most * window.noise_adu,
            ..Spot::default()
        };
        Some([fit.spots[0], remainder])
    }

    /// A fit of two spots from `start` that is much better than one spot, and good.
    fn fit_pair(
        &self,
        fit: &Fit,
        start: &[Spot; 2],
        beyond: &[Spot],
        work: &mut FitWork,
    ) -> Option<Fit> {
        let config = self.fit_config();
        let mut two = self.fit_fixed(start, beyond, work);
        let [a, b] = two.spots.first_chunk::<2>().copied()?;
        let is_real = |s: Spot| {
            s.flux > PAIR_MIN_FLUX_SIGMA * s.sigma_flux && is_placed(&s, self.scene.spot_px)
        };
        let separation_px = (a.x - b.x).hypot(a.y - b.y);
        // What is left must be like noise: a nebula is no pair.
        let is_good = two.chi2 < PAIR_MAX_CHI2 * two.degrees.max(1.0);
        let is_apart = separation_px > self.width_px();
        if !(two.converged && is_real(a) && is_real(b) && is_good && is_apart) {
            return None;
        }
        let one = work.fitter.fit(&work.window, &fit.spots[..1], &config);
        if one.chi2 - two.chi2 <= 0.5 * one.chi2 {
            return None;
        }
        work.fitter.set_flux_noise(&work.window, &mut two, &config);
        if b.flux > a.flux {
            two.spots.swap(0, 1);
        }
        Some(two)
    }

    fn fit_config(&self) -> FitConfig {
        FitConfig {
            spot_px: self.scene.spot_px,
            free_spot: false,
            noise: self.noise,
        }
    }

    /// Fits spots of the frame's size.
    fn fit_fixed(&self, start: &[Spot], beyond: &[Spot], work: &mut FitWork) -> Fit {
        let radius = window_radius(self.scene.spot_px);
        self.scene.cut(start, radius, &mut work.window);
        self.scene
            .subtract(beyond, &mut work.fitter, &mut work.window);
        work.fitter.fit(&work.window, start, &self.fit_config())
    }

    /// Position, errors, flux and the flags that need no judgement; coordinates still relative to the view.
    fn detection_of(&self, fit: &Fit, peak: &Peak, region: &Region) -> Detection {
        let scene = &self.scene;
        let mut spot = self.best_estimate(fit, peak, region);
        hold_inside(&mut spot, scene.view.width, scene.view.height);
        let level = f64::from(scene.background.at(peak.x as f32, peak.y as f32).0);
        // Where all pixels next to the peak are missing, others made it.
        let brightest = [1, window_radius(scene.spot_px)]
            .into_iter()
            .map(|reach| brightest_within(reach, peak, &scene.view))
            .find(|level| level.is_finite());
        let margin = 2.0 * self.width_px();
        let border = spot.x < margin
            || spot.y < margin
            || spot.x > scene.view.width as f64 - 1.0 - margin
            || spot.y > scene.view.height as f64 - 1.0 - margin;
        Detection {
            position: PixelPoint::new(spot.x, spot.y),
            sigma_x_px: spot.sigma_x,
            sigma_y_px: spot.sigma_y,
            flux_adu: spot.flux,
            peak_adu: brightest.map_or(0.0, |value| value - level),
            snr: spot.flux / spot.noise_flux,
            flags: DetectionFlags {
                saturated: peak.saturated,
                border,
                ..DetectionFlags::default()
            },
        }
    }

    /// What is known of a source, with the correlation of the noise in its errors: by the fit; where the
    /// pixels do not tell its place to within the spot's own width, by its saturated area or the filter.
    fn best_estimate(&self, fit: &Fit, peak: &Peak, region: &Region) -> Spot {
        let spot = fit.spots[0];
        let correlation = self.scene.correlation_at(spot.x, spot.y);
        let by_filter = || {
            let guess = self.scene.first_guess(peak);
            Spot {
                sigma_x: region.major_px.max(self.width_px()),
                sigma_y: region.major_px.max(self.width_px()),
                noise_flux: guess.flux / f64::from(peak.snr),
                ..guess
            }
        };
        let mut fitted = Spot {
            sigma_x: spot.sigma_x * correlation,
            sigma_y: spot.sigma_y * correlation,
            noise_flux: spot.noise_flux * correlation,
            ..spot
        };
        if !is_placed(&spot, fit.spot_px) || (peak.saturated && !fit.converged) {
            return self.by_area(peak, correlation, by_filter());
        }
        let has_flux = spot.flux > 0.0 && fitted.noise_flux > 0.0 && fitted.noise_flux.is_finite();
        if !has_flux {
            let guess = by_filter();
            (fitted.flux, fitted.noise_flux) = (guess.flux, guess.noise_flux);
        }
        fitted
    }

    /// The place of a saturated area, with its light or that of `guess`, whichever is more; `guess`
    /// where nothing is saturated.
    fn by_area(&self, peak: &Peak, correlation: f64, guess: Spot) -> Spot {
        let area = if peak.saturated {
            Plateau::about(&self.scene, peak)
        } else {
            None
        };
        let Some(area) = area else {
            return guess;
        };
        let mut spot = Spot {
            x: area.x,
            y: area.y,
            sigma_x: area.sigma_x,
            sigma_y: area.sigma_y,
            ..guess
        };
        if area.flux > guess.flux {
            let noise = self.scene.noise_at(area.x, area.y);
            let variance = area.area_px * noise * noise + self.noise.shot_adu * area.flux;
            spot.flux = area.flux;
            spot.noise_flux = variance.sqrt() * correlation;
        }
        spot
    }

    /// From the view's coordinates to the frame's.
    fn place(&self, detection: &mut Detection) {
        detection.position.x += self.scene.view.x0 as f64;
        detection.position.y += self.scene.view.y0 as f64;
    }
}

/// Whether a spot's standard errors, which may be infinite or NaN, are within its own width.
fn is_placed(spot: &Spot, spot_px: f64) -> bool {
    let width_px = (spot_px.powi(2) + PIXEL_VARIANCE_PX2).sqrt();
    spot.sigma_x <= width_px && spot.sigma_y <= width_px
}

/// Moves a spot beyond the border to the border, and counts the way as an error: nothing is seen there.
fn hold_inside(spot: &mut Spot, width: usize, height: usize) {
    let hold = |at: &mut f64, sigma: &mut f64, side: usize| {
        let inside = at.clamp(-0.5, side as f64 - 0.5);
        if *at != inside {
            *sigma = sigma.hypot(*at - inside);
            *at = inside;
        }
    };
    hold(&mut spot.x, &mut spot.sigma_x, width);
    hold(&mut spot.y, &mut spot.sigma_y, height);
}

/// The highest value within so many columns and rows of a peak; negative infinity where there is none.
fn brightest_within(reach: usize, peak: &Peak, view: &View<'_>) -> f64 {
    let columns = peak.x.saturating_sub(reach)..(peak.x + reach + 1).min(view.width);
    let rows = peak.y.saturating_sub(reach)..(peak.y + reach + 1).min(view.height);
    rows.flat_map(|y| &view.row(y)[columns.clone()])
        .fold(f64::NEG_INFINITY, |highest, &p| highest.max(f64::from(p)))
}

/// What is known of the spots of all peaks.
#[derive(Debug, Clone, Default)]
pub(crate) struct KnownSpots {
    near: Neighbours,
    /// Each spot as far as it is known: fitted for those stronger than the one at hand.
    spots: Vec<Spot>,
    /// Whether that is any good: the filter does not know the light of a saturated one.
    is_known: Vec<bool>,
    /// Peaks without others within reach, and those with.
    alone: Vec<u32>,
    close: Vec<u32>,
    /// The spots that shine into the window of the one at hand and are not fitted.
    beyond: Vec<Spot>,
}

impl KnownSpots {
    /// Sorts the peaks, of whose spots only the filter's guess is known.
    fn begin(&mut self, peaks: &[Peak], measurement: &Measurement<'_>) {
        self.near.sort(peaks, measurement.reach_px());
        self.spots.clear();
        let guesses = peaks.iter().map(|p| measurement.scene.first_guess(p));
        self.spots.extend(guesses);
        self.is_known.clear();
        self.is_known.extend(peaks.iter().map(|p| !p.saturated));
        self.alone.clear();
        self.close.clear();
        for index in 0..peaks.len() {
            self.near.find(peaks, index);
            if self.near.found.is_empty() {
                self.alone.push(index as u32);
            } else {
                self.close.push(index as u32);
            }
        }
    }

    /// Peak `index`, with the spots of those that touch it, and of the others that shine into its window.
    fn place_of<'a>(&'a mut self, index: usize, peaks: &'a [Peak], touching_px: f64) -> Place<'a> {
        self.near.find(peaks, index);
        let mut start = Spots::from_iter([self.spots[index]]);
        self.beyond.clear();
        for other in self.near.found.iter().map(|&found| found as usize) {
            let (a, b) = (&peaks[index], &peaks[other]);
            let (dx, dy) = (a.x as f64 - b.x as f64, a.y as f64 - b.y as f64);
            let is_touching = dx * dx + dy * dy < touching_px * touching_px;
            if is_touching && start.len() < MAX_SPOTS {
                start.push(self.spots[other]);
            } else if self.is_known[other] {
                self.beyond.push(self.spots[other]);
            }
        }
        Place {
            peaks,
            index,
            near: &self.near.found,
            start,
            beyond: &self.beyond,
        }
    }
}

/// A peak, and what is around it.
struct Place<'a> {
    peaks: &'a [Peak],
    index: usize,
    /// The peaks within reach.
    near: &'a [u32],
    /// Its own spot, and those that touch it.
    start: Spots,
    /// Those of the others that shine into its window.
    beyond: &'a [Spot],
}

impl Place<'_> {
    /// Whether another peak is within `reach_px` of a spot, and nearer to it than this one.
    fn has_other_at(&self, spot: Spot, reach_px: f64) -> bool {
        let distance = |peak: &Peak| (peak.x as f64 - spot.x).hypot(peak.y as f64 - spot.y);
        let nearest_px = distance(&self.peaks[self.index]).min(reach_px);
        let mut others = self.near.iter().map(|&other| &self.peaks[other as usize]);
        others.any(|other| distance(other) < nearest_px)
    }
}

/// The peaks near a peak, by a grid.
#[derive(Debug, Clone, Default)]
struct Neighbours {
    reach_px: f64,
    cell_px: f64,
    columns: usize,
    rows: usize,
    /// Where in `members` each cell starts, and the end.
    starts: Vec<u32>,
    members: Vec<u32>,
    /// The peaks within reach of the one last looked at, strongest first, itself left out.
    found: Vec<u32>,
}

impl Neighbours {
    /// More cells along a side than this are of no use, but of peaks far apart there could be many.
    const MAX_CELLS: f64 = 512.0;

    /// Sorts the peaks into cells.
    fn sort(&mut self, peaks: &[Peak], reach_px: f64) {
        let largest = |side: fn(&Peak) -> usize| peaks.iter().map(side).max().unwrap_or(0) as f64;
        let (right, bottom) = (largest(|p| p.x), largest(|p| p.y));
        self.reach_px = reach_px.max(1.0);
        self.cell_px = self.reach_px.max(right.max(bottom) / Self::MAX_CELLS);
        self.columns = (right / self.cell_px) as usize + 1;
        self.rows = (bottom / self.cell_px) as usize + 1;
        self.starts.clear();
        self.starts.resize(self.columns * self.rows + 1, 0);
        self.members.resize(peaks.len(), 0);
        let cell_of = |grid: &Self, peak: &Peak| {
            let (column, row) = grid.cell(peak);
            row * grid.columns + column
        };
        for peak in peaks {
            let cell = cell_of(self, peak);
            self.starts[cell] += 1;
        }
        // From counts to ends, which become starts as the cells are filled from behind.
        let mut end = 0;
        for start in &mut self.starts {
            end += *start;
            *start = end;
        }
        for (index, peak) in peaks.iter().enumerate().rev() {
            let cell = cell_of(self, peak);
            self.starts[cell] -= 1;
            self.members[self.starts[cell] as usize] = index as u32;
        }
    }

    fn cell(&self, peak: &Peak) -> (usize, usize) {
        (
            (peak.x as f64 / self.cell_px) as usize,
            (peak.y as f64 / self.cell_px) as usize,
        )
    }

    /// Finds the peaks within reach of peak `index`.
    fn find(&mut self, peaks: &[Peak], index: usize) {
        let (cx, cy) = self.cell(&peaks[index]);
        self.found.clear();
        for row in cy.saturating_sub(1)..(cy + 2).min(self.rows) {
            let first = row * self.columns + cx.saturating_sub(1);
            let end = row * self.columns + (cx + 2).min(self.columns);
            let members = self.starts[first] as usize..self.starts[end] as usize;
            for &other in &self.members[members] {
                let (a, b) = (&peaks[other as usize], &peaks[index]);
                let (dx, dy) = (a.x as f64 - b.x as f64, a.y as f64 - b.y as f64);
                let is_near = dx * dx + dy * dy <= self.reach_px * self.reach_px;
                if is_near && other as usize != index {
                    self.found.push(other);
                }
            }
        }
        self.found.sort_unstable();
    }
}
