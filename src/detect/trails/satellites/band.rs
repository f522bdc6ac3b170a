//! The pixels along a line: a ridge of light is fitted to them, and its ends are found.

use super::cells::CellMap;
use super::input::TrailSearch;
use crate::base::coords::PixelPoint;
use nalgebra::{SMatrix, SVector};
use std::f64::consts::TAU;

/// Fits of the ridge, with the width held in the first ones: the line is off by up to a cell.
const FITS: usize = 8;
const FITS_OF_FIXED_WIDTH: usize = 3;
/// Least standard deviation across, in pixels: of light in one row of them.
const MIN_SIGMA_PX: f64 = 0.3;
/// Columns of the fit: level, height, place, direction, width.
const TERMS: usize = 5;

/// A line of light with a Gaussian profile.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ridge {
    /// Where its height falls below one half.
    pub ends_px: [PixelPoint; 2],
    /// Standard deviation across.
    pub width_sigma_px: f64,
    /// Standard error of its place.
    pub across_sigma_px: f64,
    /// Height above the background.
    pub height_adu: f64,
    /// Light of a pixel of its length.
    pub flux_per_px_adu: f64,
    /// That over its standard error.
    pub snr: f64,
    /// Lowest mean height of a third of it, over that of all of it.
    pub evenness: f64,
    /// Height above the brighter side, over that above the mean of both.
    pub contrast: f64,
}

/// The pixels near a straight line.
pub(super) struct TrailBand<'a> {
    search: &'a TrailSearch<'a>,
    cells: &'a CellMap,
    /// A point of the line, and its direction.
    at: [f64; 2],
    along: [f64; 2],
    /// From where to where it is bright, from that point, in pixels.
    stretch_px: [f64; 2],
    sigma_px: f64,
    broadest_px: f64,
}

/// What a fit tells beside the line and its width.
#[derive(Clone, Copy)]
struct RidgeFit {
    height_adu: f64,
    height_sigma_adu: f64,
    across_sigma_px: f64,
}

/// The light along the line, for each pixel of its length.
struct LineProfile {
    /// Where it begins, from the line's point.
    start_px: f64,
    /// Sums of light and of weights: their ratio is the height.
    light: Vec<f64>,
    weight: Vec<f64>,
    /// Sum and number of the pixels on each side.
    sides: [Vec<[f64; 2]>; 2],
}

impl<'a> TrailBand<'a> {
    /// Along a line of cells.
    pub fn new(
        search: &'a TrailSearch<'a>,
        cells: &'a CellMap,
        [begin, end]: [PixelPoint; 2],
    ) -> Self {
        let length_px = begin.distance_to(&end);
        let sigma_px = search.spot_px.max(cells.side_px as f64);
        Self {
            search,
            cells,
            at: [(begin.x + end.x) / 2.0, (begin.y + end.y) / 2.0],
            along: [(end.x - begin.x) / length_px, (end.y - begin.y) / length_px],
            stretch_px: [-length_px / 2.0, length_px / 2.0],
            sigma_px,
            broadest_px: 4.0 * sigma_px,
        }
    }

    /// The ridge along the line, with its ends; `None` if there is none.
    pub fn ridge(mut self) -> Option<Ridge> {
        for step in 0..FITS {
            self.fit(step >= FITS_OF_FIXED_WIDTH)?;
            // Broad ones take long, and are no trails.
            if self.sigma_px > self.broadest_px {
                return None;
            }
            let stretch_px = self.profile().stretch(self.stretch_px)?;
            self.set_stretch(stretch_px);
        }
        let fit = self.fit(true)?;
        let profile = self.profile();
        let height = profile.height(self.stretch_px)?;
        let third_px = (self.stretch_px[1] - self.stretch_px[0]) / 3.0;
        let of_third = |third: usize| {
            let begin_px = self.stretch_px[0] + third as f64 * third_px;
            profile.height([begin_px, begin_px + third_px])
        };
        let lowest = (0..3).filter_map(of_third).fold(f64::INFINITY, f64::min);
        let [left, right] = profile.sides_of(self.stretch_px)?;
        Some(Ridge {
            ends_px: self.stretch_px.map(|t| self.point(t)),
            width_sigma_px: self.sigma_px,
            across_sigma_px: fit.across_sigma_px,
            height_adu: fit.height_adu,
            flux_per_px_adu: fit.height_adu * self.sigma_px * TAU.sqrt(),
            snr: fit.height_adu / fit.height_sigma_adu,
            evenness: lowest / height,
            contrast: 1.0 - 0.5 * (left - right).abs() / fit.height_adu,
        })
    }

    fn point(&self, t: f64) -> PixelPoint {
        PixelPoint::new(
            self.at[0] + t * self.along[0],
            self.at[1] + t * self.along[1],
        )
    }

    /// Moves the line's point to the middle of the stretch.
    fn set_stretch(&mut self, [begin_px, end_px]: [f64; 2]) {
        let middle = self.point((begin_px + end_px) / 2.0);
        self.at = [middle.x, middle.y];
        let half_px = (end_px - begin_px) / 2.0;
        self.stretch_px = [-half_px, half_px];
    }

    /// A step of Gauss and Newton: line, and width where it is free, fit the pixels of the stretch better.
    fn fit(&mut self, is_width_free: bool) -> Option<RidgeFit> {
        let sigma_px = self.sigma_px;
        let half_px = (self.stretch_px[1] - self.stretch_px[0]) / 2.0;
        let mut normal = SMatrix::<f64, TERMS, TERMS>::zeros();
        let mut right = SVector::<f64, TERMS>::zeros();
        let (mut squares, mut count) = (0.0, 0.0);
        self.for_pixels(
            self.stretch_px,
            5.0 * sigma_px + 2.0,
            |t, v, light, weight| {
                let u = v / sigma_px;
                let height = libm::exp(-0.5 * u * u);
                let terms = SVector::<f64, TERMS>::from([
                    1.0,
                    height,
                    height * u,
                    height * u * t / half_px,
                    height * u * u,
                ]);
                normal += weight * terms * terms.transpose();
                right += weight * light * terms;
                squares += weight * light * light;
                count += 1.0;
            },
        );
        if !is_width_free {
            for term in 0..TERMS {
                normal[(4, term)] = 0.0;
                normal[(term, 4)] = 0.0;
            }
            normal[(4, 4)] = 1.0;
            right[4] = 0.0;
        }
        let covariance = normal.try_inverse()?;
        let found = covariance * right;
        let height_adu = found[1];
        let height_sigma_adu = covariance[(1, 1)].sqrt();
        // Less is no line that could be followed.
        let is_seen = height_adu > 2.0 * height_sigma_adu;
        if !is_seen {
            return None;
        }
        // In standard deviations across.
        let [place, turn, wider] =
            [2, 3, 4].map(|term| (found[term] / height_adu).clamp(-1.0, 1.0));
        self.turn(place * sigma_px, turn * sigma_px / half_px);
        self.sigma_px = (sigma_px * libm::exp(wider.clamp(-0.4, 0.4))).max(MIN_SIGMA_PX);
        // Errors are those of the scatter, where it is larger than the noise.
        let scatter = ((squares - found.dot(&right)) / (count - TERMS as f64))
            .max(1.0)
            .sqrt();
        Some(RidgeFit {
            height_adu,
            height_sigma_adu: scatter * height_sigma_adu,
            across_sigma_px: scatter * covariance[(2, 2)].sqrt() * sigma_px / height_adu,
        })
    }

    /// Moves the line across by `place_px`, and turns it by `slope`.
    fn turn(&mut self, place_px: f64, slope: f64) {
        let [x, y] = self.along;
        self.at = [self.at[0] - place_px * y, self.at[1] + place_px * x];
        let length = libm::hypot(slope, 1.0);
        self.along = [(x - slope * y) / length, (y + slope * x) / length];
    }

    /// The light along the line through the whole frame.
    fn profile(&self) -> LineProfile {
        let reach_px = 4.0 * self.sigma_px;
        let side_px = 6.0 * self.sigma_px.max(1.0);
        let view = self.search.view;
        let diagonal_px = libm::hypot(view.width as f64, view.height as f64);
        let inside = |t: f64| {
            let point = self.point(t);
            let (x, y) = (point.x, point.y);
            x > -1.0 && y > -1.0 && x < view.width as f64 && y < view.height as f64
        };
        let to_border = |sign: f64| {
            let steps = (0..diagonal_px as usize).map(|step| sign * step as f64);
            steps.take_while(|t| inside(*t)).last().unwrap_or(0.0)
        };
        let (start_px, end_px) = (to_border(-1.0), to_border(1.0));
        let bins = (end_px - start_px) as usize + 1;
        let mut profile = LineProfile {
            start_px: start_px - 0.5,
            light: vec![0.0; bins],
            weight: vec![0.0; bins],
            sides: [vec![[0.0; 2]; bins], vec![[0.0; 2]; bins]],
        };
        let mut heights = vec![0.0; bins];
        let range_px = [start_px - 0.5, end_px + 0.5];
        self.for_pixels(range_px, reach_px + side_px, |t, v, light, weight| {
            let bin = ((t - range_px[0]) as usize).min(bins - 1);
            if v.abs() > reach_px {
                let side = &mut profile.sides[usize::from(v > 0.0)][bin];
                *side = [side[0] + light, side[1] + 1.0];
                return;
            }
            let u = v / self.sigma_px;
            let height = libm::exp(-0.5 * u * u);
            profile.light[bin] += weight * height * light;
            profile.weight[bin] += weight * height * height;
            heights[bin] += weight * height;
        });
        profile.level(&heights);
        profile
    }

    /// Calls `act` with the place along the line and across it, the light above the background and its weight
    /// (reciprocal variance) for each free pixel within `reach_px` of a part of the line.
    fn for_pixels(
        &self,
        [begin_px, end_px]: [f64; 2],
        reach_px: f64,
        mut act: impl FnMut(f64, f64, f64, f64),
    ) {
        let view = self.search.view;
        let [tx, ty] = self.along;
        let is_flat = tx.abs() >= ty.abs();
        // Along the axis that is nearer to the line, and across.
        let (main, cross) = if is_flat { (0, 1) } else { (1, 0) };
        let sides = [view.width, view.height];
        let slope = self.along[cross] / self.along[main];
        let half_px = reach_px / self.along[main].abs();
        let of_ends = [begin_px, end_px].map(|t| self.at[main] + t * self.along[main]);
        let first = of_ends[0].min(of_ends[1]) - reach_px;
        let last = of_ends[0].max(of_ends[1]) + reach_px;
        let clipped = |from: f64, to: f64, side: usize| {
            let from = from.ceil().clamp(0.0, side as f64) as usize;
            let to = (to.floor() + 1.0).clamp(0.0, side as f64) as usize;
            from..to.max(from)
        };
        for i in clipped(first, last, sides[main]) {
            let middle = self.at[cross] + (i as f64 - self.at[main]) * slope;
            for j in clipped(middle - half_px, middle + half_px, sides[cross]) {
                let (x, y) = if is_flat { (i, j) } else { (j, i) };
                let (dx, dy) = (x as f64 - self.at[0], y as f64 - self.at[1]);
                let (t, v) = (dx * tx + dy * ty, dy * tx - dx * ty);
                if t < begin_px || t > end_px || v.abs() > reach_px || !self.cells.is_free_at(x, y)
                {
                    continue;
                }
                let (background, sigma) = self.search.mesh.at(x as f32, y as f32);
                let light = f64::from(view.at(x, y) - background);
                let weight = f64::from(sigma).powi(-2);
                if light.is_finite() && weight.is_finite() {
                    act(t, v, light, weight);
                }
            }
        }
    }
}

impl LineProfile {
    /// Subtracts the level beside the line, which is that of a longer part: `heights` are the sums of the
    /// ridge's weights.
    fn level(&mut self, heights: &[f64]) {
        /// To each side, in pixels.
        const LEVEL_PX: usize = 50;
        let bins = self.light.len();
        let mut sums = vec![[0.0; 2]; bins + 1];
        for bin in 0..bins {
            let [left, right] = [self.sides[0][bin], self.sides[1][bin]];
            sums[bin + 1] = [0, 1].map(|part| sums[bin][part] + left[part] + right[part]);
        }
        for (bin, height) in heights.iter().enumerate() {
            let (from, to) = (bin.saturating_sub(LEVEL_PX), (bin + LEVEL_PX + 1).min(bins));
            let [light, count] = [0, 1].map(|part| sums[to][part] - sums[from][part]);
            if count > 0.0 {
                self.light[bin] -= height * light / count;
            }
        }
    }

    fn bins_of(&self, stretch_px: [f64; 2]) -> std::ops::Range<usize> {
        let bins = self.light.len();
        let [from, to] =
            stretch_px.map(|t| (t - self.start_px).round().clamp(0.0, bins as f64) as usize);
        from..to.max(from)
    }

    /// Mean height of a stretch.
    fn height(&self, stretch_px: [f64; 2]) -> Option<f64> {
        let bins = self.bins_of(stretch_px);
        let light: f64 = self.light[bins.clone()].iter().sum();
        let weight: f64 = self.weight[bins].iter().sum();
        (weight > 0.0).then(|| light / weight)
    }

    /// Mean light of the pixels on each side.
    fn sides_of(&self, stretch_px: [f64; 2]) -> Option<[f64; 2]> {
        let bins = self.bins_of(stretch_px);
        let [left, right] = self.sides.each_ref().map(|side| {
            let sum = |part: usize| -> f64 { side[bins.clone()].iter().map(|s| s[part]).sum() };
            sum(0) / sum(1)
        });
        (left + right).is_finite().then_some([left, right])
    }

    /// The most probable stretch of a ridge that has the height of `known_px` there and no light beyond: the
    /// stretch with the largest sum of light above one half of that height.
    fn stretch(&self, known_px: [f64; 2]) -> Option<[f64; 2]> {
        /// Light of a star on the line, in heights, counts up to this.
        const MAX_HEIGHT: f64 = 3.0;
        let height = self.height(known_px).filter(|height| *height > 0.0)?;
        let (mut best, mut best_sum) = (0..0, 0.0);
        let (mut begin, mut sum) = (0, 0.0);
        for (bin, (light, weight)) in self.light.iter().zip(&self.weight).enumerate() {
            if sum <= 0.0 {
                (begin, sum) = (bin, 0.0);
            }
            sum += light.min(MAX_HEIGHT * height * weight) - 0.5 * height * weight;
            if sum > best_sum {
                (best, best_sum) = (begin..bin + 1, sum);
            }
        }
        let known = self.bins_of(known_px);
        let is_same = best.start < known.end && known.start < best.end;
        is_same.then(|| [best.start, best.end].map(|bin| self.start_px + bin as f64))
    }
}
