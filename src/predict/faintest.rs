//! Expected magnitude of the faintest detected star of a field.
//!
//! The faintest of many stars lies beyond the limit, as noise lifts some of the fainter ones. An
//! observed faintest star is to be compared with this expectation, not with the limit.

use super::completeness::Detector;
use serde::Serialize;

/// The faintest star that will be detected.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Faintest {
    /// Expected V magnitude, given that any star is detected.
    pub mean_vmag: f64,
    /// Its standard deviation over repetitions.
    pub sigma_mag: f64,
    /// Expected number of detected stars.
    pub stars_found: f64,
}

impl Faintest {
    /// Among stars of these V magnitudes, each once; none if a detection is unlikely.
    pub fn among(v_mags: impl IntoIterator<Item = f64>, detector: &Detector) -> Option<Self> {
        let found = |v_mag| (v_mag, detector.probability(v_mag));
        Self::of(v_mags.into_iter().map(found))
    }

    /// Among stars given by V magnitude and detection probability, each once; none if a detection
    /// is unlikely.
    pub fn of(stars: impl IntoIterator<Item = (f64, f64)>) -> Option<Self> {
        let found = |(v_mag, probability)| (v_mag, probability, 1.0);
        Self::from_chances(stars.into_iter().map(found).collect(), |chance, _| chance)
    }

    /// In a field that covers a fraction `part` of a sky with stars of these V magnitudes.
    pub fn in_part_of_sky(
        v_mags: impl IntoIterator<Item = f64>,
        part: f64,
        detector: &Detector,
    ) -> Option<Self> {
        let found = |v_mag| (v_mag, detector.probability(v_mag), part);
        let any = |chance: f64, mean: f64| -libm::expm1(-chance * mean);
        Self::from_chances(v_mags.into_iter().map(found).collect(), any)
    }

    /// From magnitude, detection probability and mean number of each star; `any` combines the
    /// latter two into the probability of at least one detection.
    fn from_chances(
        mut stars: Vec<(f64, f64, f64)>,
        any: impl Fn(f64, f64) -> f64,
    ) -> Option<Self> {
        /// Remaining probability at which the sum stops.
        const NEGLIGIBLE: f64 = 1e-12;
        stars.sort_by(|a, b| b.0.total_cmp(&a.0));
        let stars_found = stars.iter().map(|(_, chance, mean)| chance * mean).sum();
        // Probability that nothing fainter is detected.
        let mut none_yet = 1.0;
        let (mut total, mut sum, mut squares) = (0.0, 0.0, 0.0);
        for (v_mag, chance, mean) in stars {
            let found = any(chance, mean);
            let weight = none_yet * found;
            total += weight;
            sum += weight * v_mag;
            squares += weight * v_mag * v_mag;
            none_yet *= 1.0 - found;
            if none_yet < NEGLIGIBLE {
                break;
            }
        }
        let mean_vmag = sum / total;
        (total > 0.5).then(|| Self {
            mean_vmag,
            sigma_mag: (squares / total - mean_vmag * mean_vmag).max(0.0).sqrt(),
            stars_found,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::data_sheet::Preset;
    use crate::predict::{Budget, Rule, Scenario};
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn detector() -> Detector {
        let scenario = Scenario::of(Preset::Experiment1);
        Detector::new(Rule::MatchedFilter, &scenario, &Budget::new(&scenario))
    }

    /// This number of stars brighter than the limit, ten times as many per two magnitudes.
    fn stars(count: usize, limit: f64) -> Vec<f64> {
        let deepest = (1.5 * 0.5 * 10f64.ln()).exp() * count as f64;
        let star = |i: usize| limit + 2.0 * ((i as f64 + 0.5) / count as f64).log10();
        (0..deepest as usize).map(star).collect()
    }

    #[test]
    fn the_expectation_is_what_draws_give() {
        let detector = detector();
        let stars = stars(40, detector.vmag_at(0.5));
        let expected = Faintest::among(stars.iter().copied(), &detector).unwrap();
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let draws: Vec<f64> = (0..4000)
            .map(|_| {
                let found = stars.iter().rev();
                let mut found =
                    found.filter(|v| random.random::<f64>() < detector.probability(**v));
                *found.next().unwrap()
            })
            .collect();
        let mean = draws.iter().sum::<f64>() / 4000.0;
        let variance = draws.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 3999.0;
        assert!((mean - expected.mean_vmag).abs() < 4.0 * expected.sigma_mag / 4000f64.sqrt());
        assert!((variance.sqrt() / expected.sigma_mag - 1.0).abs() < 0.06);
    }

    #[test]
    fn more_stars_reach_further_beyond_the_limit() {
        let detector = detector();
        let limit = detector.vmag_at(0.5);
        let beyond = |count| {
            let found = Faintest::among(stars(count, limit), &detector).unwrap();
            found.mean_vmag - limit
        };
        // With 20 and 500 stars to the limit, 0.42 and 1.19 mag by simulation for a matched filter
        // and a steeper law.
        let (few, many) = (beyond(20), beyond(500));
        assert!(
            (0.1..0.7).contains(&few) && many > few + 0.2,
            "{few} {many}"
        );
    }

    #[test]
    fn a_part_of_a_dense_sky_is_like_a_field() {
        let detector = detector();
        let limit = detector.vmag_at(0.5);
        let field = Faintest::among(stars(200, limit), &detector).unwrap();
        let sky = Faintest::in_part_of_sky(stars(20_000, limit), 0.01, &detector).unwrap();
        assert!((field.mean_vmag - sky.mean_vmag).abs() < 0.05);
        assert!((field.stars_found / sky.stars_found - 1.0).abs() < 0.05);
        assert!(Faintest::among([limit + 5.0], &detector).is_none());
    }
}
