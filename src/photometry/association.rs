//! Which of the catalogue's stars in a frame were detected.
//!
//! Each star, brightest first, claims the nearest detection that may be a star, lies within reach, and is not claimed yet.

use super::MeasuredFrame;
use crate::coords::PixelPoint;
use crate::detect::Detection;
use crate::identify::{Identification, PredictedStar};
use std::f64::consts::{PI, SQRT_2};

/// A star and its detection are no further apart than this, ...
const REACH_PX: f64 = 1.5;
/// ... or so many standard errors of the detection's place and the camera model together, ...
const REACH_SIGMAS: f64 = 3.0;
/// ... but never more than this part of the distance within which stars are not told apart.
const REACH_SHARE: f64 = 0.5;
/// Stars closer than so many standard deviations of the spot, and than so many pixels, are not told apart for sure.
const APART_SPOTS: f64 = 6.0;
const APART_PX: f64 = 4.0;
/// A neighbour fainter by more than this does not hide a star.
const HIDING_MAG: f32 = 1.0;

/// One catalogue star in the frame, and what became of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FrameStar {
    /// Index into the catalogue's stars.
    pub catalog: usize,
    /// V magnitude.
    pub v_mag: f64,
    /// Index of its detection.
    pub detection: Option<usize>,
    /// Whether it stands alone, and well inside the frame.
    pub is_clear: bool,
}

/// What was associated.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Association {
    /// The stars, brightest first.
    pub stars: Vec<FrameStar>,
    /// The probability that a detection that is none of the stars lies within reach of a given place.
    pub chance: f64,
}

/// Detections or stars by place.
struct ByX<'a, P: Fn(usize) -> PixelPoint> {
    order: Vec<usize>,
    place: &'a P,
}

impl<'a, P: Fn(usize) -> PixelPoint> ByX<'a, P> {
    fn new(mut order: Vec<usize>, place: &'a P) -> Self {
        order.sort_unstable_by(|&a, &b| place(a).x.total_cmp(&place(b).x).then(a.cmp(&b)));
        Self { order, place }
    }

    /// Those within `radius_px` of `centre`, with their distances.
    fn within(&self, centre: PixelPoint, radius_px: f64) -> impl Iterator<Item = (usize, f64)> {
        let x = |&i: &usize| (self.place)(i).x;
        let first = self.order.partition_point(|i| x(i) < centre.x - radius_px);
        let near_in_x = self.order[first..]
            .iter()
            .take_while(move |i| x(i) <= centre.x + radius_px);
        near_in_x
            .map(move |&i| (i, (self.place)(i).distance_to(&centre)))
            .filter(move |(_, distance_px)| *distance_px <= radius_px)
    }
}

/// The radius within which two stars are not told apart for sure, in pixels.
fn apart_px(spot_sigma_px: f64) -> f64 {
    (APART_SPOTS * spot_sigma_px).max(APART_PX)
}

/// Associates the stars `predicted`, brightest first, with the detections of `frame`.
pub(super) fn associate(frame: &MeasuredFrame, predicted: &[PredictedStar]) -> Association {
    let sources = &frame.detections.sources;
    let apart_px = apart_px(frame.detections.spot_sigma_px);
    let reach_px = |detection: &Detection| {
        reach_px(detection, frame.identification).min(REACH_SHARE * apart_px)
    };
    let place = |i: usize| sources[i].position;
    let star_like: Vec<usize> = (0..sources.len())
        .filter(|&i| sources[i].flags.is_star_like() && sources[i].flux_adu > 0.0)
        .collect();
    let detections = ByX::new(star_like, &place);
    let camera = &frame.identification.camera;
    let pixel = |i: usize| predicted[i].pixel;
    let neighbours = ByX::new((0..predicted.len()).collect(), &pixel);
    let mut claimed = vec![false; sources.len()];
    let mut stars = Vec::with_capacity(predicted.len());
    for (index, star) in predicted.iter().enumerate() {
        let free = detections
            .within(star.pixel, REACH_SHARE * apart_px)
            .filter(|&(i, away_px)| !claimed[i] && away_px <= reach_px(&sources[i]));
        let nearest = free.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| i);
        if let Some(detection) = nearest {
            claimed[detection] = true;
        }
        if !camera.contains(&star.pixel) {
            continue;
        }
        let hiding = |i: usize| i != index && predicted[i].v_mag < star.v_mag + HIDING_MAG;
        let is_alone = !neighbours
            .within(star.pixel, apart_px)
            .any(|(i, _)| hiding(i));
        stars.push(FrameStar {
            catalog: star.catalog,
            v_mag: f64::from(star.v_mag),
            detection: nearest,
            is_clear: is_alone && camera.nearly_contains(&star.pixel, -apart_px),
        });
    }
    let unclaimed = detections.order.iter().filter(|&&i| !claimed[i]);
    let reach_area_px: f64 = unclaimed.map(|&i| PI * reach_px(&sources[i]).powi(2)).sum();
    Association {
        stars,
        chance: reach_area_px / (camera.width_px * camera.height_px),
    }
}

/// How far `detection` may be from where its star is predicted, in pixels.
fn reach_px(detection: &Detection, identification: &Identification) -> f64 {
    let sigma_px = detection.sigma_x_px.hypot(detection.sigma_y_px) / SQRT_2;
    let model_px = identification.rms_px / SQRT_2;
    // A standard error that is no number leaves the least reach.
    REACH_PX.max(REACH_SIGMAS * sigma_px.hypot(model_px))
}
