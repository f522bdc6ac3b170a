//! The error over the radius at one noise: a smooth curve, its minimum, and the radii that meet an
//! error.

use super::ErrorPoint;
use crate::base::least_squares::LinearFit;
use nalgebra::Vector3;
use serde::Serialize;

/// Number of steps in the search for the minimum.
const STEPS: usize = 600;

/// The error over the radius, smoothed.
///
/// The logarithm of the error is a parabola in the logarithm of the radius, fitted to the points
/// around (local regression), weighted with the number of detected stars.
///
/// # Reference
/// Cleveland 1979, J. Am. Stat. Assoc. 74, 829.
#[derive(Debug, Clone)]
pub struct ErrorCurve {
    points: Vec<CurvePoint>,
}

#[derive(Debug, Clone, Copy)]
struct CurvePoint {
    spot_px: f64,
    log_spot: f64,
    log_rms: f64,
    weight: f64,
}

impl CurvePoint {
    /// Squared distances of two normal axes are exponential. The logarithm of the mean of n of them
    /// is on average 1/(2n) too low, that of its root half as much; its variance is about 1/n.
    fn new(spot_px: f64, point: &ErrorPoint) -> Self {
        let found = point.found as f64;
        Self {
            spot_px,
            log_spot: libm::log(spot_px),
            log_rms: libm::log(point.rms_px) + 0.25 / found,
            weight: found,
        }
    }
}

/// The radius of smallest error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Optimum {
    /// The radius, in pixels.
    pub spot_px: f64,
    /// Its error, in pixels.
    pub rms_px: f64,
    /// Range of radii with an error at most 5 % larger, in pixels.
    pub nearly_px: [f64; 2],
    /// Whether it is the first or last radius of the grid, so that the true optimum lies beyond.
    pub is_at_edge: bool,
}

impl ErrorCurve {
    /// The curve through the sound points; none if there are too few.
    pub fn through<'a>(points: impl Iterator<Item = (f64, &'a ErrorPoint)>) -> Option<Self> {
        let sound = points.filter(|(_, point)| point.is_sound());
        let points: Vec<_> = sound
            .map(|(px, point)| CurvePoint::new(px, point))
            .collect();
        (points.len() >= 2).then_some(Self { points })
    }

    /// First and last radius, in pixels.
    pub fn range_px(&self) -> [f64; 2] {
        let of = |point: Option<&CurvePoint>| point.map_or(f64::NAN, |point| point.spot_px);
        [of(self.points.first()), of(self.points.last())]
    }

    /// The error at a radius within the range, both in pixels.
    pub fn at(&self, spot_px: f64) -> f64 {
        /// With fewer points in total no parabola is fitted, as it would pass through all of them.
        const MIN_FOR_PARABOLA: usize = 4;
        let at = libm::log(spot_px);
        let log_rms = match self.points.len() {
            0..MIN_FOR_PARABOLA => self.joined_at(at),
            _ => self.fitted_at(at),
        };
        libm::exp(log_rms)
    }

    /// Linear interpolation between the adjacent points, in logarithms.
    fn joined_at(&self, at: f64) -> f64 {
        let last = self.points.len() - 2;
        let before = self.points[1..=last].partition_point(|point| point.log_spot <= at);
        let [from, to] = [self.points[before], self.points[before + 1]];
        let part = (at - from.log_spot) / (to.log_spot - from.log_spot);
        from.log_rms + part * (to.log_rms - from.log_rms)
    }

    /// Local parabola, in logarithms.
    fn fitted_at(&self, at: f64) -> f64 {
        let reach = self.reach_at(at);
        let mut fit = LinearFit::new();
        for point in &self.points {
            let distance = (point.log_spot - at) / reach;
            if distance.abs() < 1.0 {
                let weight = point.weight * (1.0 - distance.abs().powi(3)).powi(3);
                let row = Vector3::new(1.0, distance, distance * distance);
                fit.add(&row, weight, weight * point.log_rms);
            }
        }
        // At least four distinct radii count: the matrix can be inverted.
        fit.solve()
            .map_or_else(|| self.joined_at(at), |solved| solved[0])
    }

    /// Half width of the local regression, as a logarithm of the ratio of radii.
    fn reach_at(&self, at: f64) -> f64 {
        /// Smallest half width of the local regression, as a logarithm of the ratio of radii.
        const REACH: f64 = 0.3;
        /// Smallest number of points in a local fit: two more than a parabola needs.
        const MIN: usize = 5;
        let distances = self.points.iter().map(|point| (point.log_spot - at).abs());
        let mut distances: Vec<f64> = distances.collect();
        let last = distances.len().min(MIN) - 1;
        let (_, far, _) = distances.select_nth_unstable_by(last, f64::total_cmp);
        // The farthest point itself has no weight.
        (*far * 1.2).max(REACH)
    }

    /// Logarithmically spaced radii over the range, in pixels.
    fn radii_px(&self) -> impl Iterator<Item = f64> + use<> {
        let [first, last] = self.range_px();
        (0..=STEPS).map(move |i| match i {
            0 => first,
            STEPS => last,
            _ => first * libm::pow(last / first, i as f64 / STEPS as f64),
        })
    }

    /// The minimum.
    pub fn optimum(&self) -> Optimum {
        /// Errors up to this factor above the minimum count as nearly optimal.
        const NEARLY: f64 = 1.05;
        let errors: Vec<(f64, f64)> = self.radii_px().map(|r| (r, self.at(r))).collect();
        let lowest = (0..errors.len()).min_by(|&a, &b| errors[a].1.total_cmp(&errors[b].1));
        let lowest = lowest.unwrap_or(0);
        let (spot_px, rms_px) = errors[lowest];
        let is_near = |point: &&(f64, f64)| point.1 <= NEARLY * rms_px;
        let below = errors[..=lowest].iter().rev().take_while(is_near).last();
        let above = errors[lowest..].iter().take_while(is_near).last();
        let radius = |point: Option<&(f64, f64)>| point.map_or(spot_px, |point| point.0);
        Optimum {
            spot_px,
            rms_px,
            nearly_px: [radius(below), radius(above)],
            is_at_edge: lowest == 0 || lowest == STEPS,
        }
    }

    /// Smallest radius whose error is at most `rms_px`, in pixels; none if no radius meets it.
    pub fn smallest_within(&self, rms_px: f64) -> Option<f64> {
        self.first_within(rms_px, self.radii_px())
    }

    /// Largest radius whose error is at most `rms_px`, in pixels; none if no radius meets it.
    pub fn largest_within(&self, rms_px: f64) -> Option<f64> {
        let radii: Vec<f64> = self.radii_px().collect();
        self.first_within(rms_px, radii.into_iter().rev())
    }

    /// The first of the radii that meets an error, refined between neighbors.
    fn first_within(&self, rms_px: f64, radii_px: impl Iterator<Item = f64>) -> Option<f64> {
        let mut before = None;
        for radius in radii_px {
            if self.at(radius) <= rms_px {
                return Some(before.map_or(radius, |before| self.crossing(before, radius, rms_px)));
            }
            before = Some(radius);
        }
        None
    }

    /// Bisection between a radius with a larger error and one that meets it.
    fn crossing(&self, mut above: f64, mut within: f64, rms_px: f64) -> f64 {
        const HALVINGS: usize = 30;
        for _ in 0..HALVINGS {
            let middle = 0.5 * (above + within);
            if self.at(middle) <= rms_px {
                within = middle;
            } else {
                above = middle;
            }
        }
        within
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::defocus::PeakStudy;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    /// An error with its minimum 0.02 at a radius of 0.8.
    fn valley(spot_px: f64) -> f64 {
        0.02 * (2.0 * (spot_px / 0.8).ln().powi(2)).exp()
    }

    fn points(of: fn(f64) -> f64, count: usize) -> Vec<(f64, ErrorPoint)> {
        let point = |i: usize| {
            let spot_px = 0.3 + 2.0 * i as f64 / (count - 1) as f64;
            let rms_px = of(spot_px);
            let point = ErrorPoint {
                trials: 100_000,
                found: 100_000,
                rms_px,
                rms_sigma_px: 0.05 * rms_px,
            };
            (spot_px, point)
        };
        (0..count).map(point).collect()
    }

    fn curve(of: fn(f64) -> f64, count: usize) -> ErrorCurve {
        let points = points(of, count);
        ErrorCurve::through(points.iter().map(|(s, p)| (*s, p))).unwrap()
    }

    #[test]
    fn the_valley_is_found_where_it_is() {
        let curve = curve(valley, 41);
        let best = curve.optimum();
        assert!(
            (best.spot_px - 0.8).abs() < 0.01 && !best.is_at_edge,
            "{best:?}"
        );
        assert!((best.rms_px - 0.02).abs() < 1e-5);
        // exp(2 ln² r) = 1.05 at ln r = ±0.156.
        for (found, sign) in best.nearly_px.iter().zip([-1.0, 1.0]) {
            let expected = 0.8 * (0.15619f64 * sign).exp();
            assert!((found - expected).abs() < 0.01, "{best:?}");
        }
        let smallest = curve.smallest_within(0.03).unwrap();
        assert!((valley(smallest) / 0.03 - 1.0).abs() < 0.01 && smallest < 0.8);
        assert_eq!(curve.smallest_within(0.019), None);
        assert_eq!(curve.smallest_within(1.0), Some(curve.range_px()[0]));
    }

    #[test]
    fn few_trials_make_the_curve_no_lower() {
        let study = PeakStudy::default();
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let radii: Vec<f64> = (0..300).map(|i| 0.5 + 0.005 * f64::from(i)).collect();
        let points: Vec<_> = radii
            .iter()
            .map(|&px| study.measure(px, 1e-3, &mut random))
            .collect();
        let curve = ErrorCurve::through(radii.iter().copied().zip(&points)).unwrap();
        let log_ratio = |&px: &f64| (curve.at(px) / study.expected(px, 1e-3).rms_px).ln();
        let mean = radii.iter().map(log_ratio).sum::<f64>() / radii.len() as f64;
        // The standard error of the root from 6000 stars is 0.65 %.
        assert!(mean.abs() < 0.02, "{mean}");
    }

    #[test]
    fn a_falling_error_is_best_at_the_edge() {
        let best = curve(|spot_px| 0.1 / spot_px, 20).optimum();
        assert!(best.is_at_edge && best.spot_px == 2.3, "{best:?}");
    }

    #[test]
    fn two_or_three_points_are_joined_by_straight_lines_and_one_is_no_curve() {
        for count in [2, 3] {
            let few = points(|spot_px| 0.1 * spot_px.sqrt(), count);
            let curve = ErrorCurve::through(few.iter().map(|(s, p)| (*s, p))).unwrap();
            for spot_px in [0.3, 0.5, 1.1, 2.3] {
                let expected = 0.1 * f64::sqrt(spot_px);
                assert!(
                    (curve.at(spot_px) / expected - 1.0).abs() < 1e-5,
                    "{count} {spot_px}"
                );
            }
            let best = curve.optimum();
            assert!(best.spot_px == 0.3 && best.is_at_edge, "{best:?}");
        }
        let pair = points(|spot_px| 0.1 * spot_px, 2);
        assert!(ErrorCurve::through(pair[..1].iter().map(|(s, p)| (*s, p))).is_none());
    }

    #[test]
    fn points_where_too_few_are_found_do_not_count() {
        let mut all = points(valley, 41);
        all[0].1.found = 2000;
        let curve = ErrorCurve::through(all.iter().map(|(s, p)| (*s, p))).unwrap();
        assert!((curve.range_px()[0] - 0.35).abs() < 1e-9);
    }
}
