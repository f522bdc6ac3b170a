//! The faintest star to be expected among those of a field.
//!
//! The faintest of many stars lies beyond the limit: among enough faint ones some are lifted by the noise. What is found is to be
//! held against this, and not against the limit.

use super::completeness::Detector;
use serde::Serialize;

/// The faintest star that will be found.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Faintest {
    /// Its expected V magnitude, if any star is found at all.
    pub mean_vmag: f64,
    /// The standard deviation of that over repetitions.
    pub sigma_mag: f64,
    /// How many stars will be found on average.
    pub stars_found: f64,
}

impl Faintest {
    /// Of the stars with these V magnitudes, each once; none where there is hardly a star to be found.
    pub fn among(v_mags: impl IntoIterator<Item = f64>, detector: &Detector) -> Option<Self> {
        let found = |v_mag| (v_mag, detector.probability(v_mag));
        Self::of(v_mags.into_iter().map(found))
    }

    /// Of stars with these V magnitudes and probabilities to be found, each once; none where there is hardly a star to be found.
    pub fn of(stars: impl IntoIterator<Item = (f64, f64)>) -> Option<Self> {
        let found = |(v_mag, probability)| (v_mag, probability, 1.0);
        Self::from_chances(stars.into_iter().map(found).collect(), |chance, _| chance)
    }

    /// In a field that holds a `part` of a sky with stars of these V magnitudes, anywhere.
    pub fn in_part_of_sky(
        v_mags: impl IntoIterator<Item = f64>,
        part: f64,
        detector: &Detector,
    ) -> Option<Self> {
        let found = |v_mag| (v_mag, detector.probability(v_mag), part);
        let any = |chance: f64, mean: f64| -(-chance * mean).exp_m1();
        Self::from_chances(v_mags.into_iter().map(found).collect(), any)
    }

    /// From magnitude, chance to be found and mean number of each star; `any` makes of the latter two the chance that at
    /// least one is found.
    fn from_chances(
        mut stars: Vec<(f64, f64, f64)>,
        any: impl Fn(f64, f64) -> f64,
    ) -> Option<Self> {
        /// Below this the rest of the stars does not matter.
        const NEGLIGIBLE: f64 = 1e-12;
        stars.sort_by(|a, b| b.0.total_cmp(&a.0));
        let stars_found = stars.iter().map(|(_, chance, mean)| chance * mean).sum();
        // The probability that nothing fainter is found.
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
    use crate::model::sensitivity::{Budget, Rule, Scenario};
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn detector() -> Detector {
        let scenario = Scenario::of(Preset::Experiment1);
        Detector::new(Rule::MatchedFilter, &scenario, &Budget::new(&scenario))
    }

    /// So many stars brighter than the limit, ten times as many for two magnitudes.
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
        // With 20 and 500 stars to the limit, 0.42 and 1.19 mag by simulation for a matched filter and a steeper law.
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
