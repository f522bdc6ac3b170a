//! An edge of the sky in the window of a fit, as that of the circle of an all-sky lens.
//!
//! pixels around the window → direction in which they get darker or brighter → the place on it that parts
//! them best

use crate::base::least_squares::LinearFit;
use crate::base::statistics::median;
use crate::detect::psf::MAX_WINDOW_PX;
use arrayvec::ArrayVec;
use nalgebra::{SVector, Vector2, Vector3};

/// Breadth of the ring of pixels around a window that tells its background, in pixels.
pub(super) const RING_PX: usize = 5;
/// Side of the largest ring, in pixels.
const MAX_SIDE_PX: usize = MAX_WINDOW_PX + 2 * RING_PX;
/// Bins of one pixel along the longest way through it.
const BINS: usize = 2 * MAX_SIDE_PX;

/// The pixels of a ring.
pub(super) type Ring = ArrayVec<RingPixel, { MAX_SIDE_PX * MAX_SIDE_PX }>;

/// A pixel of a ring.
#[derive(Debug, Clone, Copy)]
pub(super) struct RingPixel {
    /// Column and row, from the middle of the window.
    pub from_middle: [f32; 2],
    /// Its value, in ADU.
    pub value: f32,
}

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
    pub fn in_ring(ring: &[RingPixel], noise_adu: f64) -> Option<Self> {
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
    fn of(ring: &[RingPixel]) -> Option<Self> {
        /// Share of the pixels that may be of stars.
        const OF_STARS: f64 = 0.1;
        let mut values: ArrayVec<f32, { MAX_SIDE_PX * MAX_SIDE_PX }> =
            ring.iter().map(|pixel| pixel.value).collect();
        let last = values.len().checked_sub(1)?;
        let mut at_share = |share: f64| {
            let (_, value, _) =
                values.select_nth_unstable_by((share * last as f64) as usize, f32::total_cmp);
            f64::from(*value)
        };
        let [low, middle, high] = [OF_STARS, 0.5, 1.0 - OF_STARS].map(&mut at_share);
        let spread = (middle - low).max(high - middle);
        Some(Self {
            low: middle - spread,
            high: middle + spread,
        })
    }

    fn clip(&self, pixel: &RingPixel) -> f64 {
        f64::from(pixel.value).clamp(self.low, self.high)
    }

    /// The direction in which the pixels of a ring get brighter or darker.
    fn steepest(&self, ring: &[RingPixel]) -> Option<[f64; 2]> {
        let mut fit = LinearFit::new();
        for pixel in ring {
            let [x, y] = pixel.from_middle.map(f64::from);
            fit.add(&Vector3::new(1.0, x, y), 1.0, self.clip(pixel));
        }
        let plane = fit.solve()?;
        let slope = libm::hypot(plane[1], plane[2]);
        (slope > 0.0).then(|| [plane[1] / slope, plane[2] / slope])
    }
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
    fn of(ring: &[RingPixel], across: [f64; 2], limits: LevelRange) -> Self {
        let middle = 0.5 * BINS as f64;
        let mut bins = [Bin::default(); BINS];
        for pixel in ring {
            let [x, y] = pixel.from_middle.map(f64::from);
            let along = across[0] * x + across[1] * y;
            let value = limits.clip(pixel) - limits.low;
            if let Some(bin) = bins.get_mut((along + middle) as usize) {
                bin.count += 1.0;
                bin.sum += value;
                bin.squares += value * value;
            }
        }
        let placed = bins.into_iter().enumerate().map(|(index, bin)| Bin {
            place: index as f64 + 0.5 - middle,
            ..bin
        });
        Self {
            bins: placed.filter(|bin| bin.count > 0.0).collect(),
        }
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
        let of_slope = self.without_step()?;
        let places = self.bins.iter().map(|bin| bin.place - 0.5);
        let places = places.filter(|place| place.abs() >= MIN_DISTANCE_PX);
        let steps = places.filter_map(|place| Some((place, self.with_step(place)?)));
        let (place, step) = steps.min_by(|a, b| a.1.misfit.total_cmp(&b.1.misfit))?;
        let variance = self.variance();
        let is_clear = of_slope - step.misfit > MIN_GAIN * variance;
        let least_height = (MIN_NOISES * noise_adu).max(MIN_SIGMAS * variance.sqrt());
        let is_high = step.height.abs() > least_height;
        (is_clear && is_high).then_some(place)
    }

    /// That of the pixels of a bin: the median, as an edge runs through some.
    fn variance(&self) -> f64 {
        let of_bins = self.bins.iter().filter(|bin| bin.count > 1.0);
        let of_bins =
            of_bins.map(|bin| (bin.squares - bin.sum * bin.sum / bin.count) / (bin.count - 1.0));
        median(&mut of_bins.collect::<ArrayVec<f64, BINS>>())
    }

    /// Squared distances of the means of the bins from a line.
    fn without_step(&self) -> Option<f64> {
        let fitted = self.fitted(|place| Vector2::new(1.0, place));
        fitted.map(|(_, misfit)| misfit)
    }

    /// A step at a place, above a line. `None` where there is nothing on one side of it.
    fn with_step(&self, at: f64) -> Option<EdgeStep> {
        let fitted = self.fitted(|place| Vector3::new(1.0, place, f64::from(u8::from(place > at))));
        fitted.map(|(terms, misfit)| EdgeStep {
            height: terms[2],
            misfit,
        })
    }

    /// The coefficients of terms, and squared distances of the means of the bins from their sum.
    fn fitted<const N: usize>(
        &self,
        terms: impl Fn(f64) -> SVector<f64, N>,
    ) -> Option<(SVector<f64, N>, f64)> {
        let (mut fit, mut squares) = (LinearFit::new(), 0.0);
        for bin in &self.bins {
            fit.add(&terms(bin.place), bin.count, bin.sum);
            squares += bin.sum * bin.sum / bin.count;
        }
        let found = fit.solve()?;
        Some((found, squares - fit.vector.dot(&found)))
    }
}
