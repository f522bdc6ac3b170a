//! An edge of the sky in the window of a fit, as that of the circle of an all-sky lens.
//!
//! pixels around the window → direction in which they get darker or brighter → the place on it that parts
//! them best

use super::ring::{MAX_PIXELS, MAX_SIDE_PX, Ring};
use crate::base::least_squares::LinearFit;
use crate::base::statistics::median;
use arrayvec::ArrayVec;
use nalgebra::{Vector2, Vector3};

/// Most bins of one pixel along the longest way through a ring.
const BINS: usize = 2 * MAX_SIDE_PX;

/// A straight edge.
#[derive(Debug, Clone, Copy)]
pub(super) struct Edge {
    /// Unit vector across it, away from the middle of the window.
    away: [f64; 2],
    /// Its distance from there, in pixels.
    distance_px: f64,
}

impl Edge {
    /// The edge that a ring shows, if it does; with the noise of a pixel.
    pub fn in_ring(ring: &Ring, noise_adu: f64) -> Option<Self> {
        let limits = LevelRange::of(ring)?;
        let across = limits.steepest(ring)?;
        let along_px = RingProfile::of(ring, across, limits).edge(noise_adu)?;
        Some(Self {
            away: across.map(|part| part * along_px.signum()),
            distance_px: along_px.abs(),
        })
    }

    /// Whether a place, from the middle of the window, is on the far side, or so near the edge that a pixel
    /// there may show both.
    pub fn hides(&self, [x, y]: [f64; 2]) -> bool {
        /// Half the width of an edge, with the error of its direction.
        const BLUR_PX: f64 = 1.5;
        self.away[0] * x + self.away[1] * y > self.distance_px - BLUR_PX
    }
}

/// The values of most pixels, without the light of stars.
#[derive(Debug, Clone, Copy)]
struct LevelRange {
    low: f64,
    high: f64,
}

impl LevelRange {
    /// `None` for an empty ring.
    fn of(ring: &Ring) -> Option<Self> {
        /// Share of the pixels that may be of stars.
        const OF_STARS: f64 = 0.1;
        let mut keys = ArrayVec::<i32, MAX_PIXELS>::new();
        keys.extend(
            ring.values()
                .iter()
                .map(|value| key_of(value.to_bits() as i32)),
        );
        let last = keys.len().checked_sub(1)?;
        let [low, middle, high] =
            [OF_STARS, 0.5, 1.0 - OF_STARS].map(|share| (share * last as f64) as usize);
        // The lower values are then before the middle one, and the higher ones after it.
        let (below, &mut of_middle, above) = keys.select_nth_unstable(middle);
        let of_low = if low < middle {
            *below.select_nth_unstable(low).1
        } else {
            of_middle
        };
        let of_high = if high > middle {
            *above.select_nth_unstable(high - middle - 1).1
        } else {
            of_middle
        };
        let value_of = |key: i32| f64::from(f32::from_bits(key_of(key) as u32));
        let [low, middle, high] = [of_low, of_middle, of_high].map(value_of);
        let spread = (middle - low).max(high - middle);
        Some(Self {
            low: middle - spread,
            high: middle + spread,
        })
    }

    fn clip(&self, value: f32) -> f64 {
        f64::from(value).clamp(self.low, self.high)
    }

    /// The direction in which the pixels of a ring get brighter or darker.
    fn steepest(&self, ring: &Ring) -> Option<[f64; 2]> {
        let slopes = ring.clipped_slope([self.low, self.high])?;
        let slope = libm::hypot(slopes[0], slopes[1]);
        (slope > 0.0).then(|| slopes.map(|along| along / slope))
    }
}

/// An integer that is in the order of the number whose bits these are, and the bits of that integer: integers are
/// sorted in half of the time.
fn key_of(bits: i32) -> i32 {
    bits ^ ((bits >> 31) as u32 >> 1) as i32
}

/// The pixels of a ring along a direction, in bins of a pixel.
struct RingProfile {
    /// Of each that has pixels.
    bins: ArrayVec<Bin, BINS>,
}

/// The pixels in a bin.
#[derive(Debug, Clone, Copy, Default)]
struct Bin {
    /// Where it is, from the middle of the window, in pixels.
    place: f64,
    /// Their number.
    count: f64,
    /// Sum of their values, and of the squares.
    sum: f64,
    squares: f64,
}

/// A step in a profile.
struct EdgeStep {
    /// Its height, in ADU.
    height: f64,
    /// Squared distances of the means of the bins from the profile with it.
    misfit: f64,
}

impl RingProfile {
    fn of(ring: &Ring, across: [f64; 2], limits: LevelRange) -> Self {
        let middle = ring.reach_px().ceil() + 1.0;
        let mut bins = ArrayVec::<Bin, BINS>::new();
        bins.extend((0..(2.0 * middle) as usize).map(|index| Bin {
            place: index as f64 + 0.5 - middle,
            ..Bin::default()
        }));
        for ([x, y], value) in ring.pixels() {
            let along = across[0] * f64::from(x) + across[1] * f64::from(y);
            let value = limits.clip(value) - limits.low;
            if let Some(bin) = bins.get_mut((along + middle) as usize) {
                bin.count += 1.0;
                bin.sum += value;
                bin.squares += value * value;
            }
        }
        bins.retain(|bin| bin.count > 0.0);
        Self { bins }
    }

    /// Where a step parts the pixels better than a slope does; `None` where it does not, or is so near the
    /// middle that a star there cannot be told from it.
    fn edge(&self, noise_adu: f64) -> Option<f64> {
        const MIN_DISTANCE_PX: f64 = 2.0;
        /// The gain in χ² that a step needs.
        const MIN_GAIN: f64 = 25.0;
        /// The height that it needs, in noises of a pixel: lower ones move no stars.
        const MIN_NOISES: f64 = 3.0;
        /// The same in standard deviations of pixels next to each other: the rest is faint stars.
        const MIN_SIGMAS: f64 = 2.0;
        let sums = ProfileSums::of(&self.bins);
        let of_slope = sums.without_step()?;
        let variance = self.variance();
        // No step has a misfit below 0.
        if of_slope <= MIN_GAIN * variance {
            return None;
        }
        let (place, step) = self.best_step(&sums, MIN_DISTANCE_PX)?;
        let is_clear = of_slope - step.misfit > MIN_GAIN * variance;
        let least_height = (MIN_NOISES * noise_adu).max(MIN_SIGMAS * variance.sqrt());
        let is_high = step.height.abs() > least_height;
        (is_clear && is_high).then_some(place)
    }

    /// The step, at least this far from the middle, that leaves least, and its place.
    fn best_step(&self, sums: &ProfileSums, least_px: f64) -> Option<(f64, EdgeStep)> {
        let mut beyond = sums.terms;
        let mut best: Option<(f64, EdgeStep)> = None;
        for bin in &self.bins {
            let place = bin.place - 0.5;
            let is_far = place.abs() >= least_px;
            if let Some(step) = is_far.then(|| sums.with_step(beyond)).flatten()
                && best
                    .as_ref()
                    .is_none_or(|(_, best)| step.misfit < best.misfit)
            {
                best = Some((place, step));
            }
            for (sum, of_bin) in beyond.iter_mut().zip(bin.terms()) {
                *sum -= of_bin;
            }
        }
        best
    }

    /// That of the pixels of a bin: the median, as an edge runs through some.
    fn variance(&self) -> f64 {
        let of_bins = self.bins.iter().filter(|bin| bin.count > 1.0);
        let of_bins =
            of_bins.map(|bin| (bin.squares - bin.sum * bin.sum / bin.count) / (bin.count - 1.0));
        median(&mut of_bins.collect::<ArrayVec<f64, BINS>>())
    }
}

impl Bin {
    /// Its number of pixels, the same times its place, the sum of the values, the same times its place.
    fn terms(&self) -> [f64; 4] {
        let Self {
            place, count, sum, ..
        } = *self;
        [count, place * count, sum, place * sum]
    }
}

/// Sums over the bins of a profile.
struct ProfileSums {
    /// Of [`Bin::terms`].
    terms: [f64; 4],
    /// Of the pixels times their squared places.
    moment: f64,
    /// Of the squared means, each times its pixels.
    squares: f64,
}

impl ProfileSums {
    fn of(bins: &[Bin]) -> Self {
        let mut sums = Self {
            terms: [0.0; 4],
            moment: 0.0,
            squares: 0.0,
        };
        for bin in bins {
            for (sum, of_bin) in sums.terms.iter_mut().zip(bin.terms()) {
                *sum += of_bin;
            }
            sums.moment += bin.place * bin.place * bin.count;
            sums.squares += bin.sum * bin.sum / bin.count;
        }
        sums
    }

    /// Squared distances of the means of the bins from a line.
    fn without_step(&self) -> Option<f64> {
        let [count, first, sum, product] = self.terms;
        let fit = LinearFit {
            matrix: [[count, first], [first, self.moment]].into(),
            vector: Vector2::new(sum, product),
        };
        Some(self.squares - fit.vector.dot(&fit.solve()?))
    }

    /// A step above a line, with the sums over the bins `beyond` it. `None` where there is nothing on one side
    /// of it.
    fn with_step(&self, beyond: [f64; 4]) -> Option<EdgeStep> {
        let [count, first, sum, product] = self.terms;
        let [of_step, first_of_step, sum_of_step, _] = beyond;
        let fit = LinearFit {
            matrix: [
                [count, first, of_step],
                [first, self.moment, first_of_step],
                [of_step, first_of_step, of_step],
            ]
            .into(),
            vector: Vector3::new(sum, product, sum_of_step),
        };
        let terms = fit.solve()?;
        Some(EdgeStep {
            height: terms[2],
            misfit: self.squares - fit.vector.dot(&terms),
        })
    }
}
