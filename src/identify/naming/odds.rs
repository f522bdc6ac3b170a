//! The odds of packed candidates, and their probabilities of chance.

use super::candidate::NameCandidate;
use super::completeness::odds_of;
use super::likelihood::{MagnitudeRelation, position_densities};
use super::packed::LANES;
use super::packed::{Lanes, Packed};
use crate::identify::field::StarField;
use multiversion::multiversion;

/// What the odds of the candidates depend on.
pub struct OddsInputs<'a> {
    /// The share by brightness of each predicted star, and its visibility. Here and below, there is
    /// one more for empty lanes.
    pub fractions: &'a [f64],
    pub visibility: &'a [f64],
    /// The share by brightness of the predicted stars as bright as each observed star, and the
    /// density of unrelated detections there.
    pub apparent_fractions: &'a [f64],
    pub unrelated: &'a [f64],
    pub magnitudes: &'a MagnitudeRelation,
}

/// Packs `candidates` into `packed`, given the field and the number of predicted stars.
pub fn pack(
    candidates: &[NameCandidate],
    field: &StarField,
    predicted: usize,
    packed: &mut Vec<Packed>,
) {
    packed.clear();
    let chunks = candidates.chunks(LANES);
    packed.extend(chunks.map(|chunk| packed_from(chunk, field, predicted)));
}

/// Packs a few candidates.
fn packed_from(candidates: &[NameCandidate], field: &StarField, predicted: usize) -> Packed {
    let mut packed = Packed {
        observed: [field.stars.len() as u32; LANES],
        predicted: [predicted as u32; LANES],
        mag: [0.0; LANES],
        v_mag: [0.0; LANES],
        saturated: [0.0; LANES],
        position_density: [0.0; LANES],
        rivals: [0.0; LANES],
        odds: [0.0; LANES],
        p_chance: [1.0; LANES],
    };
    let [mut distances_px, mut sigmas_px, mut gates_px] = [[1.0; LANES]; 3];
    let mut shares = [0.0; LANES];
    for (lane, candidate) in candidates.iter().enumerate().take(LANES) {
        let star = &field.stars[candidate.observed];
        packed.observed[lane] = candidate.observed as u32;
        packed.predicted[lane] = candidate.predicted as u32;
        packed.mag[lane] = star.mag;
        packed.v_mag[lane] = candidate.v_mag;
        packed.saturated[lane] = f64::from(u8::from(star.is_saturated));
        distances_px[lane] = candidate.distance_px;
        (sigmas_px[lane], gates_px[lane]) = (candidate.sigma_px, candidate.gate_px);
        shares[lane] = candidate.probability;
        packed.rivals[lane] = candidate.rivals;
    }
    let of_true = in_lanes(&distances_px, &sigmas_px, &gates_px, &packed.saturated);
    for lane in 0..LANES {
        packed.position_density[lane] = shares[lane] * of_true[lane];
    }
    packed
}

#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn in_lanes(distances_px: &Lanes, sigmas_px: &Lanes, gates_px: &Lanes, saturated: &Lanes) -> Lanes {
    position_densities(distances_px, sigmas_px, gates_px, saturated)
}

/// Sets the odds of the candidates.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
pub fn set_odds(candidates: &mut [Packed], known: &OddsInputs) {
    for packed in candidates {
        let [mut shares, mut apparent, mut visibility, mut unrelated] = [[0.0; LANES]; 4];
        for (lane, (observed, predicted)) in packed.places().enumerate() {
            shares[lane] = known.fractions[predicted];
            apparent[lane] = known.apparent_fractions[observed];
            visibility[lane] = known.visibility[predicted];
            unrelated[lane] = known.unrelated[observed];
        }
        let densities = known.magnitudes.densities(packed);
        for lane in 0..LANES {
            let [odds, odds_as] = odds_of(shares[lane], apparent[lane], visibility[lane]);
            let like = odds_as * densities.by_scatter[lane] + odds * densities.otherwise[lane];
            packed.odds[lane] = packed.position_density[lane] * like / unrelated[lane];
        }
    }
}

/// Sets the probabilities of chance, from the sums of odds of each observed and each predicted star.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
pub fn set_chances(candidates: &mut [Packed], of_observed: &[f64], of_predicted: &[f64]) {
    for packed in candidates {
        let mut all = [0.0; LANES];
        for (lane, (observed, predicted)) in packed.places().enumerate() {
            all[lane] = of_observed[observed] + of_predicted[predicted];
        }
        for (lane, all) in all.into_iter().enumerate() {
            let odds = packed.odds[lane];
            // The candidate's own odds are in both sums.
            let others = (all - 2.0 * odds).max(0.0) + packed.rivals[lane] * odds;
            packed.p_chance[lane] = (1.0 + others) / (1.0 + others + odds);
        }
    }
}
