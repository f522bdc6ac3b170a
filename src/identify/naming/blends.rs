//! Blends: stars that the camera does not resolve, and where the centroid of their light lies.
//!
//! matched stars, camera, attitude → direction of the blended light of each
//!
//! A spot fitted to the light of several stars converges where the frame, filtered with that spot,
//! has a maximum. Spots of variance s² then have the variance 2s², so the position is a mode of `Σ
//! F exp(−d² / 4s²)`. Mean shift finds the mode next to the star.
//!
//! Caveats: the noise is assumed to be that of the background; with photon noise a bright blend is
//! measured nearer to its photocentre. Fluxes are those of V magnitudes, whatever the color. Stars
//! that the catalogue lacks do not count.
//!
//! # Reference
//! Comaniciu & Meer 2002, IEEE Trans. Pattern Anal. Mach. Intell. 24, 603, doi 10.1109/34.1000236,
//! for the mean shift.

use crate::base::coords::{Icrs, PixelPoint, UnitVector};
use crate::catalog::StarIndex;
use crate::catalog::sky_grid::{GridStar, chord_of};
use crate::identify::hypothesis::{Hypothesis, Problem};
use crate::identify::naming::{NameCandidate, position_density};

/// Stars fainter than another by more move its centroid by less than a hundredth of the spot.
const FAINTER_MAG: f32 = 4.5;
/// So do stars farther away, in standard deviations of the spot, unless they are brighter.
const REACH_SIGMAS: f64 = 4.5;
/// The probability that a star is measured by its own light where one spot would take up that of
/// its neighbors as well: the detector separates some stars that this model does not.
const SEPARATED_FRACTION: f64 = 0.05;
/// The detector does not separate a star whose own light is closer than this to the light of its
/// blend, in standard deviations of the spot.
const SEPARABLE_SIGMAS: f64 = 1.5;
/// The probability that such a star is measured by its own light all the same: its neighbors in the
/// catalogue are not there, or much fainter. It is small, so that a bright star cannot pull the
/// attitude to where its own light agrees.
const MISTAKEN_FRACTION: f64 = 0.001;
/// A star farther from the detection than this, in standard deviations of the spot, is outside the
/// spot's half width at half maximum: its neighbors may be what was seen.
const HALF_WIDTH_SIGMAS: f64 = 1.177;
/// So it is only where it is outside by more than the error of its position, which a fit that is not
/// yet good makes large.
const OUTSIDE_SIGMAS: f64 = 3.0;
/// Stars whose light differs by less than this factor give about as much: catalogues list the
/// components of some doubles with the magnitude of both.
const AS_MUCH: f64 = 1.05;
/// Maximum of the light of other stars over a star's own.
const MAX_RIVALS: f64 = 1e12;
/// The variance that a pixel's own width adds to a spot, in px².
const PIXEL_VARIANCE_PX2: f64 = 1.0 / 12.0;
/// Standard deviation of the logarithm of the ratio of two stars' light, over that of their V magnitudes:
/// 0.3 mag, by the colors of the stars and the band of the camera.
const LN_RATIO_SIGMA: f64 = 0.28;
/// Lights closer than this, in standard deviations of the spot, are the same.
const SAME_LIGHT_SIGMAS: f64 = 0.25;
/// The mean shift ends at steps below this, in pixels, …
const CONVERGED_PX: f64 = 1e-4;
/// … or after this many steps.
const MAX_STEPS: usize = 50;

/// Neighbors are looked up within this many times the reach, as it changes with the focal length.
const REACH_MARGIN: f64 = 1.1;

/// Finds blends. Its buffers are reused.
#[derive(Debug, Default)]
pub struct Blends {
    /// The stars near each predicted star, where they were looked up.
    near: Vec<Option<Near>>,
    neighbors: Vec<GridStar>,
    /// Catalogue stars of other detections, sorted.
    taken: Vec<StarIndex>,
    /// Of the candidates of one observed star.
    seen: Vec<Seen>,
    lights: Vec<(PixelPoint, f64)>,
}

/// The stars near another one.
#[derive(Debug, Clone, Copy)]
struct Near {
    /// Their first position in the list of neighbors, and that after the last.
    from: u32,
    to: u32,
    /// Chord within which they were looked up.
    chord: f64,
}

/// The light of a candidate.
#[derive(Debug, Clone, Copy)]
struct Seen {
    star: StarIndex,
    /// Position of the star, and its V magnitude.
    own: PixelPoint,
    own_v_mag: f32,
    blend: Option<Blend>,
}

/// Blended light.
#[derive(Debug, Clone, Copy)]
struct Blend {
    pixel: PixelPoint,
    /// Standard error of that place on each axis, in pixels.
    sigma_px: f64,
    /// V magnitude of all of it that a spot at its place takes up.
    v_mag: f64,
    /// Light that a spot at the detection takes up of the other stars, over that of the star itself.
    others: f64,
}

/// A hypothesis and its PSF.
struct BlendView<'a> {
    problem: Problem<'a>,
    hypothesis: &'a Hypothesis,
    /// Variance of the spot, pixel width included.
    variance_px2: f64,
    /// Chord within which stars are blended.
    chord: f64,
}

impl Blends {
    /// Starts with `stars` predicted stars.
    pub fn start(&mut self, stars: usize) {
        self.neighbors.clear();
        self.near.clear();
        self.near.resize(stars, None);
    }

    /// Gives each candidate position and magnitude of the light that its star is part of, where
    /// that agrees better with the observed star than the star's own light; none if the PSF is
    /// unknown. A star in a blend to which another one gives more light has its own light only.
    ///
    /// The other stars of a blend are rivals of a name whose star lies outside the detected spot.
    ///
    /// The stars `taken` are those of other detections: each was measured separately, and so is not
    /// part of a blend.
    pub fn redirect(
        &mut self,
        problem: Problem,
        hypothesis: &Hypothesis,
        taken: impl Iterator<Item = StarIndex>,
        candidates: &mut [NameCandidate],
    ) {
        let Some(spot_sigma_px) = problem.field.spot_sigma_px else {
            return;
        };
        let variance_px2 = spot_sigma_px.powi(2) + PIXEL_VARIANCE_PX2;
        let reach_px = REACH_SIGMAS * variance_px2.sqrt();
        let view = BlendView {
            problem,
            hypothesis,
            variance_px2,
            chord: chord_of(reach_px / hypothesis.camera.focal_length_px()),
        };
        self.taken.clear();
        self.taken.extend(taken);
        self.taken.sort_unstable();
        let separable_px = SEPARABLE_SIGMAS * view.variance_px2.sqrt();
        let half_width_px = HALF_WIDTH_SIGMAS * view.variance_px2.sqrt();
        let mut seen = std::mem::take(&mut self.seen);
        for of_observed in candidates.chunk_by_mut(|a, b| a.observed == b.observed) {
            let star = &problem.field.stars[of_observed[0].observed];
            seen.clear();
            seen.extend(of_observed.iter().map(|candidate| Seen {
                star: candidate.star,
                own: candidate.light,
                own_v_mag: candidate.own_v_mag,
                blend: self.blend_of(&view, candidate, &star.position),
            }));
            for (index, candidate) in of_observed.iter_mut().enumerate() {
                let is_absorbed = is_absorbed(&seen, index, view.variance_px2);
                let Some(blend) = seen[index].blend else {
                    candidate.probability = if is_absorbed { 0.0 } else { 1.0 };
                    continue;
                };
                // A saturated spot is measured too badly to say where in it a star is.
                let outside_px = half_width_px.max(OUTSIDE_SIGMAS * candidate.sigma_px);
                if candidate.distance_px > outside_px && !star.is_saturated {
                    candidate.rivals = blend.others;
                }
                let distance_px = blend.pixel.distance_to(&star.position);
                let density =
                    |distance_px| position_density(candidate, distance_px, star.is_saturated);
                let is_separable = candidate.light.distance_to(&blend.pixel) > separable_px;
                let share = match (is_separable, is_absorbed) {
                    (true, _) => SEPARATED_FRACTION,
                    (false, true) => 0.0,
                    (false, false) => MISTAKEN_FRACTION,
                };
                if is_absorbed || share * density(candidate.distance_px) > density(distance_px) {
                    candidate.probability = share;
                } else {
                    candidate.distance_px = distance_px;
                    candidate.light = blend.pixel;
                    candidate.light_sigma_px = blend.sigma_px;
                    candidate.sigma_px = libm::hypot(candidate.sigma_px, blend.sigma_px);
                    candidate.direction = view
                        .direction_of(&blend.pixel)
                        .unwrap_or(candidate.direction);
                    candidate.v_mag = blend.v_mag;
                }
            }
        }
        self.seen = seen;
    }

    /// The blended light of a candidate for the detection at `detected`; `None` if it is single.
    fn blend_of(
        &mut self,
        view: &BlendView,
        candidate: &NameCandidate,
        detected: &PixelPoint,
    ) -> Option<Blend> {
        let index = candidate.star;
        let near = self.near(view, candidate.predicted, index);
        if near.from == near.to {
            return None;
        }
        let star = view.problem.sky.catalog().star(index);
        let (centre, chord_sq) = (star.direction.as_vector(), view.chord * view.chord);
        let Self {
            taken,
            lights,
            neighbors,
            ..
        } = self;
        lights.clear();
        for near in &neighbors[near.from as usize..near.to as usize] {
            if near.is_within(centre, chord_sq) && taken.binary_search(&near.index).is_err() {
                lights.extend(view.light_of(near.index, star.v_mag));
            }
        }
        if lights.is_empty() {
            return None;
        }
        let own = view.light_of(index, star.v_mag)?;
        let ratio_of =
            |other: &PixelPoint| weight_ratio(detected, [other, &own.0], view.variance_px2);
        let others = lights.iter();
        let others = others.map(|other| other.1 * ratio_of(&other.0));
        let others: f64 = others.sum();
        lights.push(own);
        let pixel = mode_next_to(own.0, lights, view.variance_px2);
        let sum: f64 = lights
            .iter()
            .map(|(place, light)| light * weight_at(&pixel, place, view.variance_px2))
            .sum();
        // How far the place moves with the light of the others, to first order.
        let by_ln_ratio_px =
            pixel.distance_to(&own.0) * weight_at(&pixel, &own.0, view.variance_px2) / sum;
        Some(Blend {
            pixel,
            sigma_px: LN_RATIO_SIGMA * by_ln_ratio_px,
            v_mag: f64::from(star.v_mag) - 2.5 * libm::log10(sum),
            others: others.min(MAX_RIVALS),
        })
    }

    /// The stars near a predicted star that may be blended with it.
    fn near(&mut self, view: &BlendView, predicted: usize, index: StarIndex) -> Near {
        let known = self.near[predicted].filter(|near| near.chord >= view.chord);
        known.unwrap_or_else(|| {
            let sky = view.problem.sky;
            let star = sky.catalog().star(index);
            let chord = REACH_MARGIN * view.chord;
            let from = self.neighbors.len() as u32;
            let keep = |near: &GridStar| {
                if near.index != index {
                    self.neighbors.push(*near);
                }
            };
            let faintest_v_mag = star.v_mag + FAINTER_MAG;
            sky.grid
                .for_each_within_chord(&star.direction, chord, faintest_v_mag, keep);
            let to = self.neighbors.len() as u32;
            *self.near[predicted].insert(Near { from, to, chord })
        })
    }
}

impl BlendView<'_> {
    /// A star's position in the frame, and its flux in units of that of a star of `unit_v_mag`.
    fn light_of(&self, index: StarIndex, unit_v_mag: f32) -> Option<(PixelPoint, f64)> {
        let star = self.problem.sky.catalog().star(index);
        let direction = self.problem.field.places.of(star);
        let in_camera = self.hypothesis.icrs_to_camera.apply(&direction);
        let pixel = self.hypothesis.camera.pixel_of(&in_camera)?;
        Some((
            pixel,
            libm::pow(10f64, 0.4 * f64::from(unit_v_mag - star.v_mag)),
        ))
    }

    fn direction_of(&self, pixel: &PixelPoint) -> Option<UnitVector<Icrs>> {
        let to_icrs = self.hypothesis.icrs_to_camera.inverse();
        Some(to_icrs.apply(&self.hypothesis.camera.direction_of(pixel)?))
    }
}

/// Whether the light of a star, alone or in its blend, is where another one has its light and gives
/// more of it. Of those that give about as much, the first in the catalogue counts.
fn is_absorbed(seen: &[Seen], index: usize, variance_px2: f64) -> bool {
    let star = &seen[index];
    let light = star.blend.map_or(star.own, |blend| blend.pixel);
    let same_px = SAME_LIGHT_SIGMAS * variance_px2.sqrt();
    let is_at = |place: &PixelPoint| place.distance_to(&light) < same_px;
    let is_there = |other: &Seen| is_at(&other.own) || other.blend.is_some_and(|b| is_at(&b.pixel));
    let gives_more = |other: &Seen| {
        let flux = libm::pow(10f64, 0.4 * f64::from(star.own_v_mag - other.own_v_mag));
        let ratio = flux * weight_ratio(&light, [&other.own, &star.own], variance_px2);
        if (1.0 / AS_MUCH..AS_MUCH).contains(&ratio) {
            other.star < star.star
        } else {
            ratio > 1.0
        }
    };
    let mut others = seen.iter().filter(|other| other.star != star.star);
    others.any(|other| is_there(other) && gives_more(other))
}

/// What a spot at `at` takes up of the light of a star at the first place, over that of an equal
/// one at the second.
fn weight_ratio(at: &PixelPoint, [first, second]: [&PixelPoint; 2], variance_px2: f64) -> f64 {
    let nearer_px2 = at.distance_to(second).powi(2) - at.distance_to(first).powi(2);
    libm::exp(nearer_px2 / (4.0 * variance_px2))
}

/// What a spot at `at` takes up of the light of a star at `place`.
fn weight_at(at: &PixelPoint, place: &PixelPoint, variance_px2: f64) -> f64 {
    libm::exp(-at.distance_to(place).powi(2) / (4.0 * variance_px2))
}

/// The mode of `Σ F exp(−d² / 4s²)` uphill from `start`.
fn mode_next_to(start: PixelPoint, lights: &[(PixelPoint, f64)], variance_px2: f64) -> PixelPoint {
    let mut at = start;
    for _ in 0..MAX_STEPS {
        let [mut sum, mut x, mut y] = [0.0; 3];
        for (place, light) in lights {
            let weight = light * weight_at(&at, place, variance_px2);
            sum += weight;
            x += weight * place.x;
            y += weight * place.y;
        }
        let next = PixelPoint::new(x / sum, y / sum);
        let step_px = next.distance_to(&at);
        at = next;
        if step_px < CONVERGED_PX {
            break;
        }
    }
    at
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(star: usize, x: f64, own_v_mag: f32, light_x: f64) -> Seen {
        Seen {
            star: StarIndex::new(star),
            own: PixelPoint::new(x, 0.0),
            own_v_mag,
            blend: Some(Blend {
                pixel: PixelPoint::new(light_x, 0.0),
                sigma_px: 0.0,
                v_mag: 5.0,
                others: 0.0,
            }),
        }
    }

    fn absorbed(pair: [Seen; 2]) -> [bool; 2] {
        [0, 1].map(|index| is_absorbed(&pair, index, 1.0))
    }

    #[test]
    fn one_of_a_pair_that_makes_one_light_has_it() {
        // The brighter one, at whose place it is.
        let close = [seen(7, 0.0, 6.0, 0.3), seen(9, 1.0, 7.0, 0.3)];
        assert_eq!(absorbed(close), [false, true]);
        // Not the brighter one, where a third star draws the light to the other.
        let drawn = [seen(7, 0.0, 6.0, 2.8), seen(9, 3.0, 6.1, 2.9)];
        assert_eq!(absorbed(drawn), [true, false]);
        // Listed twice: the first, wherever the mean shift ended.
        let twice = [seen(9, 0.0, 6.0, 0.019), seen(7, 0.04, 6.0, 0.021)];
        assert_eq!(absorbed(twice), [true, false]);
        // Two lights.
        let apart = [seen(7, 0.0, 6.0, 0.1), seen(9, 4.0, 6.0, 3.9)];
        assert_eq!(absorbed(apart), [false, false]);
    }

    #[test]
    fn a_close_pair_is_seen_at_its_photocentre_and_a_wide_one_at_its_stars() {
        let pair = |apart_px: f64| {
            let lights = [
                (PixelPoint::new(10.0, 5.0), 3.0),
                (PixelPoint::new(10.0 + apart_px, 5.0), 1.0),
            ];
            let mode = mode_next_to(lights[0].0, &lights, 1.0);
            assert_eq!(mode.y, 5.0);
            mode.x - 10.0
        };
        assert!((pair(0.2) - 0.05).abs() < 1e-3, "{}", pair(0.2));
        assert!(pair(8.0) < 1e-5, "{}", pair(8.0));
        // In between, the slope of one hill against the other: at 2 s it is 2 F₂/F₁ e⁻¹ to first
        // order.
        assert!((0.2..0.5).contains(&pair(2.0)), "{}", pair(2.0));
    }
}
