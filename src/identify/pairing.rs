//! Pairs observed stars with predicted ones by place and brightness.

use crate::base::coords::{Icrs, UnitVector};
use crate::base::neighbors::PointGrid;
use crate::catalog::StarIndex;
use crate::identify::field::ObservedStar;
use crate::identify::predict::PredictedStar;
use std::cmp::Reverse;

/// The candidates of a star are in the order of strips along x: one for each predicted star, but at
/// most so many.
const STRIPS: usize = 512;

/// An observed star and the catalogue star that it may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// Position in [`StarField::stars`](super::field::StarField::stars).
    pub observed: usize,
    /// The catalogue star.
    pub star: StarIndex,
    /// V magnitude of the catalogue.
    pub v_mag: f32,
    /// Direction of its light, at the date of the frame.
    pub direction: UnitVector<Icrs>,
    /// Standard error of the place of its light on each axis, in pixels: 0 for a single star.
    pub light_sigma_px: f64,
    /// Distance between the observed and the predicted position, in pixels.
    pub residual_px: f64,
    /// Probability that the pair is chance; 1 as long as it was not computed.
    pub p_chance: f64,
}

impl Pair {
    /// Standard error of the distance of `star`, the observed one, from the place of its light, on each axis,
    /// in pixels.
    pub fn sigma_px(&self, star: &ObservedStar) -> f64 {
        libm::hypot(star.sigma_px, self.light_sigma_px)
    }
}

/// Pairs observed and predicted stars. Its buffers are reused.
#[derive(Debug, Default)]
pub struct Pairing {
    /// The predicted stars.
    places: PointGrid,
    candidates: Vec<NearPair>,
    of_observed: Vec<Claim>,
    of_predicted: Vec<u32>,
}

/// Two stars that may be a pair.
#[derive(Debug, Clone, Copy)]
pub struct NearPair {
    /// Distance in position and brightness, dimensionless.
    distance: f64,
    /// Their distance, in pixels.
    pub distance_px: f64,
    /// Position in the list of observed stars.
    pub observed: usize,
    /// Position in the list of predicted stars.
    pub predicted: usize,
}

/// The candidates of one observed star.
#[derive(Debug, Clone, Copy, Default)]
struct Claim {
    candidates: u32,
    predicted: Option<usize>,
}

impl Pairing {
    /// Fills `pairs` with the stars that lie within `radius_px` of each other and have a
    /// `mag_difference`, each star once, closest pairs in position and brightness first. The result
    /// is in the order of the observed stars.
    pub fn pair_up(
        &mut self,
        observed: &[ObservedStar],
        predicted: &[PredictedStar],
        radius_px: f64,
        mag_difference: impl Fn(&ObservedStar, &PredictedStar) -> Option<f64>,
        pairs: &mut Vec<Pair>,
    ) {
        self.candidates(observed, predicted, |_, _| radius_px, mag_difference);
        self.settle();
        pairs.clear();
        let claims = observed.iter().zip(&self.of_observed).enumerate();
        pairs.extend(claims.filter_map(|(index, (star, claim))| {
            let found = &predicted[claim.predicted?];
            Some(Pair {
                observed: index,
                star: found.star,
                v_mag: found.v_mag,
                direction: found.direction,
                light_sigma_px: 0.0,
                residual_px: found.pixel.distance_to(&star.position),
                p_chance: 1.0,
            })
        }));
    }

    /// All pairs within the `radius_px` of an observed star (given its position in the list) that
    /// have a `mag_difference`, in the order of the observed stars; those of each from left to right,
    /// strip by strip, and within a strip the faintest first.
    pub fn candidates(
        &mut self,
        observed: &[ObservedStar],
        predicted: &[PredictedStar],
        radius_px: impl Fn(usize, &ObservedStar) -> f64,
        mag_difference: impl Fn(&ObservedStar, &PredictedStar) -> Option<f64>,
    ) -> &[NearPair] {
        let places = predicted.iter().map(|star| star.pixel);
        self.places.fill(predicted.len(), places);
        let strips = self.places.strips(predicted.len().clamp(1, STRIPS));
        self.candidates.clear();
        self.of_observed.clear();
        self.of_observed.resize(observed.len(), Claim::default());
        self.of_predicted.clear();
        self.of_predicted.resize(predicted.len(), 0);
        for (o, star) in observed.iter().enumerate() {
            let radius_px = radius_px(o, star);
            let first = self.candidates.len();
            self.places
                .for_each_within(&star.position, radius_px, |near| {
                    let Some(difference) = mag_difference(star, &predicted[near.index]) else {
                        return;
                    };
                    let apart = near.distance_px / radius_px;
                    self.candidates.push(NearPair {
                        distance: apart * apart + difference * difference,
                        distance_px: near.distance_px,
                        observed: o,
                        predicted: near.index,
                    });
                    self.of_observed[o].candidates += 1;
                    self.of_predicted[near.index] += 1;
                });
            let order = |pair: &NearPair| {
                let strip = strips.part_at(predicted[pair.predicted].pixel.x);
                (strip, Reverse(pair.predicted))
            };
            self.candidates[first..].sort_unstable_by_key(order);
        }
        &self.candidates
    }

    /// Pairs the stars that have one candidate only, then the others, closest first.
    fn settle(&mut self) {
        let Self {
            candidates,
            of_observed,
            of_predicted,
            ..
        } = self;
        candidates.retain(|pair| {
            let is_only =
                of_observed[pair.observed].candidates == 1 && of_predicted[pair.predicted] == 1;
            if is_only {
                of_observed[pair.observed].predicted = Some(pair.predicted);
            }
            !is_only
        });
        candidates.sort_unstable_by(|a, b| {
            let order = a.distance.total_cmp(&b.distance);
            order.then((a.observed, a.predicted).cmp(&(b.observed, b.predicted)))
        });
        for pair in candidates {
            let (claim, claimed) = (
                &mut of_observed[pair.observed].predicted,
                &mut of_predicted[pair.predicted],
            );
            if claim.is_none() && *claimed > 0 {
                *claim = Some(pair.predicted);
                *claimed = 0;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::coords::PixelPoint;
    use crate::base::neighbors::PointTree;
    use crate::identify::SourceIndex;
    use proptest::prelude::*;

    fn observed_at((x, y): (f64, f64)) -> ObservedStar {
        ObservedStar {
            source: SourceIndex::new(0),
            position: PixelPoint::new(x, y),
            sigma_px: 0.1,
            mag: 0.0,
            is_saturated: false,
        }
    }

    fn predicted_at((x, y): (f64, f64)) -> PredictedStar {
        PredictedStar {
            pixel: PixelPoint::new(x, y),
            direction: UnitVector::from_ra_dec(0.0, 0.0),
            v_mag: 0.0,
            star: StarIndex::new(x.max(0.0) as usize),
        }
    }

    #[test]
    fn each_star_is_paired_once_with_its_closest() {
        let observed = [(10.0, 10.0), (13.0, 10.0), (50.0, 50.0)].map(observed_at);
        let predicted = [(12.5, 10.0), (10.0, 11.0), (90.0, 50.0)].map(predicted_at);
        let mut pairs = Vec::new();
        Pairing::default().pair_up(&observed, &predicted, 4.0, |_, _| Some(0.0), &mut pairs);
        let found: Vec<(usize, usize)> = pairs.iter().map(|p| (p.observed, p.star.get())).collect();
        assert_eq!(found, [(0, 10), (1, 12)]);
    }

    proptest! {
        #[test]
        fn close_pairs_are_those_that_a_k_d_tree_finds(
            observed in prop::collection::vec((0.0..900.0f64, 0.0..700.0f64), 0..60),
            predicted in prop::collection::vec((-50.0..950.0f64, -50.0..750.0f64), 0..200),
            radius_px in 0.5..80.0f64,
        ) {
            let observed: Vec<_> = observed.into_iter().map(observed_at).collect();
            let predicted: Vec<_> = predicted.into_iter().map(predicted_at).collect();
            let mut pairing = Pairing::default();
            pairing.candidates(&observed, &predicted, |_, _| radius_px, |_, _| Some(0.0));
            let mut found: Vec<_> =
                pairing.candidates.iter().map(|c| (c.observed, c.predicted)).collect();
            found.sort_unstable();
            let tree = PointTree::new(predicted.iter().map(|star| star.pixel));
            let mut expected = Vec::new();
            for (o, star) in observed.iter().enumerate() {
                let near = tree.within(&star.position, radius_px);
                expected.extend(near.iter().map(|near| (o, near.index)));
            }
            expected.sort_unstable();
            prop_assert_eq!(found, expected);
        }
    }
}
