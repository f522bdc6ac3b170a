//! Which of the catalogue's stars in a frame were detected.
//!
//! Each star, brightest first, claims the nearest detection that may be a star, lies within reach, and is not claimed yet.

use super::MeasuredFrame;
use crate::base::neighbors::PointTree;
use crate::detect::Detection;
use crate::identify::{Identification, PredictedStar};
use crate::sky::catalog::StarIndex;
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
    /// The star.
    pub star: StarIndex,
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
    let is_star_like = |source: &Detection| source.flags.is_star_like() && source.flux_adu > 0.0;
    let star_like: Vec<usize> = (0..sources.len())
        .filter(|&i| is_star_like(&sources[i]))
        .collect();
    let detections = PointTree::new(star_like.iter().map(|&i| sources[i].position));
    let neighbors = PointTree::new(predicted.iter().map(|star| star.pixel));
    let camera = &frame.identification.camera;
    let mut claimed = vec![false; sources.len()];
    let mut stars = Vec::with_capacity(predicted.len());
    for (index, star) in predicted.iter().enumerate() {
        let nearest = detections
            .within(&star.pixel, REACH_SHARE * apart_px)
            .iter()
            .map(|near| (star_like[near.index], near.distance_px))
            .find(|&(i, away_px)| !claimed[i] && away_px <= reach_px(&sources[i]))
            .map(|(i, _)| i);
        if let Some(detection) = nearest {
            claimed[detection] = true;
        }
        if !camera.contains(&star.pixel) {
            continue;
        }
        let hiding = |i: usize| i != index && predicted[i].v_mag < star.v_mag + HIDING_MAG;
        let is_alone = !neighbors
            .within(&star.pixel, apart_px)
            .iter()
            .any(|near| hiding(near.index));
        stars.push(FrameStar {
            star: star.star,
            v_mag: f64::from(star.v_mag),
            detection: nearest,
            is_clear: is_alone && camera.nearly_contains(&star.pixel, -apart_px),
        });
    }
    let unclaimed = star_like.iter().filter(|&&i| !claimed[i]);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::coords::{PixelPoint, Rotation, UnitVector};
    use crate::camera::CameraModel;
    use crate::detect::{DetectionFlags, Detections};
    use nalgebra::Matrix3;

    const SIDE_PX: f64 = 400.0;

    fn detection(x: f64, y: f64, flags: DetectionFlags) -> Detection {
        Detection {
            position: PixelPoint::new(x, y),
            sigma_x_px: 0.1,
            sigma_y_px: 0.1,
            flux_adu: 100.0,
            peak_adu: 10.0,
            snr: 10.0,
            flags,
        }
    }

    fn star(x: f64, y: f64, v_mag: f32) -> PredictedStar {
        PredictedStar {
            pixel: PixelPoint::new(x, y),
            direction: UnitVector::from_ra_dec(0.0, 0.0),
            v_mag,
            star: StarIndex::new((v_mag * 10.0) as usize),
        }
    }

    /// Stars of growing magnitudes, and detections, in a frame with spots of 1 px.
    fn associated(stars: &[PredictedStar], sources: Vec<Detection>) -> Association {
        let centre = UnitVector::from_ra_dec(0.0, 0.0);
        let identification = Identification {
            camera: CameraModel::pinhole(SIDE_PX, SIDE_PX, 2000.0, false),
            icrs_to_camera: Rotation::looking_at(&centre, 0.0),
            attitude_covariance_rad2: Matrix3::zeros(),
            focal_length_sigma_px: 0.0,
            matches: Vec::new(),
            rms_px: 0.2,
            log10_false_alarm: -50.0,
        };
        let detections = Detections {
            sources,
            background_adu: 0.0,
            noise_adu: 1.0,
            spot_sigma_px: 1.0,
        };
        let frame = MeasuredFrame {
            detections: &detections,
            identification: &identification,
            years_since_j2000: 0.0,
            exposure_s: None,
        };
        associate(&frame, stars)
    }

    const PLAIN: DetectionFlags = DetectionFlags {
        saturated: false,
        hot_pixel: false,
        trail: false,
        extended: false,
        blended: false,
        border: false,
    };

    #[test]
    fn each_star_claims_the_nearest_detection_within_reach() {
        let sources = vec![
            detection(100.5, 100.0, PLAIN),
            detection(101.2, 100.0, PLAIN),
            detection(201.6, 100.0, PLAIN),
        ];
        let found = associated(&[star(100.0, 100.0, 5.0), star(200.0, 100.0, 6.0)], sources);
        assert_eq!(found.stars[0].detection, Some(0));
        assert_eq!(found.stars[1].detection, None);
        assert!(found.stars.iter().all(|star| star.is_clear));
    }

    #[test]
    fn the_brighter_of_two_stars_has_the_first_claim_and_hides_the_other() {
        let sources = vec![detection(100.7, 100.0, PLAIN)];
        let stars = [star(100.0, 100.0, 5.0), star(101.0, 100.0, 7.0)];
        let found = associated(&stars, sources);
        assert_eq!(found.stars[0].detection, Some(0));
        assert_eq!(found.stars[1].detection, None);
        // A companion of two magnitudes less does not hide the brighter one.
        assert!(found.stars[0].is_clear && !found.stars[1].is_clear);
    }

    #[test]
    fn stars_near_the_border_are_not_clear_and_those_beyond_it_are_left_out() {
        let stars = [
            star(2.0, 200.0, 5.0),
            star(-2.0, 100.0, 6.0),
            star(200.0, 397.0, 7.0),
        ];
        let found = associated(&stars, Vec::new());
        assert_eq!(found.stars.len(), 2);
        assert!(found.stars.iter().all(|star| !star.is_clear));
    }

    #[test]
    fn what_is_no_star_is_not_claimed_and_what_is_unclaimed_may_be_met_by_chance() {
        let trail = DetectionFlags {
            trail: true,
            ..PLAIN
        };
        let sources = vec![
            detection(100.0, 100.0, trail),
            detection(300.0, 300.0, PLAIN),
        ];
        let found = associated(&[star(100.0, 100.0, 5.0)], sources);
        assert_eq!(found.stars[0].detection, None);
        let expected = PI * REACH_PX.powi(2) / SIDE_PX.powi(2);
        assert!((found.chance / expected - 1.0).abs() < 1e-9);
    }
}
