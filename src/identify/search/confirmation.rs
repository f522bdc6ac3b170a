//! Whether other observed stars confirm a hypothesis: the brightest ones are compared one by one
//! with the catalogue stars of about their brightness at their place, until the likelihood ratio is
//! decisive.
//!
//! # Reference
//! Wald 1945, Ann. Math. Stat. 16, 117: the sequential probability ratio test.

use super::queries::ObservedStars;
use crate::base::coords::{Icrs, UnitVector};
use crate::catalog::sky_grid::chord_of;
use nalgebra::{Matrix3, Vector3};
use std::ops::RangeInclusive;

/// Number of stars that are asked, the brightest.
const CONFIRMING_STARS: usize = 26;
/// Likelihood ratio below which the other stars refute a hypothesis (e to the −3.5), ...
const DROP_BELOW: f64 = 0.030_197_383_422_318_5;
/// ... above which they confirm it (e to the 7), ...
const TAKE_ABOVE: f64 = 1_096.633_158_428_458_6;
/// ... and above which they confirm it when all stars were tested (e).
const TAKE_AT_END: f64 = std::f64::consts::E;

/// First estimate of camera and attitude.
#[derive(Debug, Clone, Copy)]
pub struct Pose {
    /// The rotation.
    pub sky_to_camera: Matrix3<f64>,
    /// Focal length, in pixels.
    pub focal_px: f64,
    /// Whether the x axis is reversed.
    pub mirrored: bool,
}

impl Pose {
    /// Direction on the sky of the pixel at this offset from the frame's centre.
    fn direction_of(&self, [u, v]: &[f64; 2]) -> UnitVector<Icrs> {
        let u = if self.mirrored { -u } else { *u };
        let camera = Vector3::new(u, *v, self.focal_px).normalize();
        UnitVector::from_unit(self.sky_to_camera.tr_mul(&camera))
    }
}

/// The stars that confirm or refute.
pub struct ConfirmingStars<'a> {
    /// Its stars, by their offsets from the frame's centre.
    pub stars: &'a ObservedStars<'a>,
    /// The stars that made the hypothesis.
    pub triangle: [usize; 3],
    /// Probability that another star confirms a true hypothesis.
    pub true_confirmation: f64,
}

/// A hypothesis that waits for its test, or has its answer.
#[derive(Debug, Clone, Copy)]
pub struct PendingHypothesis {
    /// Camera and attitude.
    pub pose: Pose,
    /// Johnson V minus observed magnitude.
    pub zero_point_mag: f64,
    /// Radius within which a star confirms, and its chord.
    radius_rad: f64,
    chord: f64,
    ratio: f64,
    answer: Option<bool>,
}

impl PendingHypothesis {
    /// A hypothesis before its test; stars within `confirming_px` confirm it.
    pub fn new(pose: Pose, zero_point_mag: f64, confirming_px: f64) -> Self {
        let radius_rad = confirming_px / pose.focal_px;
        Self {
            radius_rad,
            chord: chord_of(radius_rad),
            pose,
            zero_point_mag,
            ratio: 1.0,
            answer: None,
        }
    }

    /// Whether it is confirmed.
    pub fn is_confirmed(&self) -> bool {
        self.answer.unwrap_or(self.ratio > TAKE_AT_END)
    }

    fn add(&mut self, factor: f64) {
        self.ratio *= factor;
        if !(DROP_BELOW..TAKE_ABOVE).contains(&self.ratio) {
            self.answer = Some(self.ratio > 1.0);
        }
    }
}

impl ConfirmingStars<'_> {
    /// Magnitudes of a catalogue star that confirms, if it is at the place of this one.
    fn magnitudes(&self, star: usize, zero_point_mag: f64) -> [f64; 2] {
        let tolerance_mag = self.stars.field.photometry.tolerance_mag();
        let v_mag = self.stars.field.stars[star].mag + zero_point_mag;
        [v_mag - tolerance_mag, v_mag + tolerance_mag]
    }

    /// The likelihood ratio of one star's answer.
    fn factor(&self, is_confirming: bool, radius_rad: f64, [bright, faint]: [f64; 2]) -> f64 {
        let chance = self.stars.sky.chance_within(radius_rad, bright, faint);
        let chance = chance.min(self.true_confirmation);
        if is_confirming {
            self.true_confirmation / chance
        } else {
            (1.0 - self.true_confirmation) / (1.0 - chance)
        }
    }

    /// The other stars, brightest first.
    fn others(&self) -> impl Iterator<Item = (usize, [f64; 2])> {
        let stars = 0..CONFIRMING_STARS.min(self.stars.field.stars.len());
        let others = stars.filter(|index| !self.triangle.contains(index));
        others.map(|index| (index, self.stars.offset(index)))
    }

    /// Tests one hypothesis.
    pub fn test(&self, hypothesis: &mut PendingHypothesis) {
        for (index, offset) in self.others() {
            let direction = hypothesis.pose.direction_of(&offset);
            let magnitudes = self.magnitudes(index, hypothesis.zero_point_mag);
            let wanted = in_single_precision(magnitudes);
            let is_confirming =
                self.stars
                    .sky
                    .grid
                    .is_any_within(&direction, hypothesis.chord, wanted);
            hypothesis.add(self.factor(is_confirming, hypothesis.radius_rad, magnitudes));
            if hypothesis.answer.is_some() {
                break;
            }
        }
    }
}

fn in_single_precision([bright, faint]: [f64; 2]) -> RangeInclusive<f32> {
    bright as f32..=faint as f32
}
