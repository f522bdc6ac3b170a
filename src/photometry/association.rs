//! Finds which catalogue stars in a frame were detected.
//!
//! Each star, brightest first, claims the nearest star-like detection that lies within its match
//! radius and is not claimed yet.

use super::IdentifiedFrame;
use crate::base::neighbors::PointTree;
use crate::detect::Detection;
use crate::identify::{Identification, PredictedStar};
use crate::sky::catalog::StarIndex;
use std::f64::consts::{PI, SQRT_2};

/// Smallest match radius, in pixels.
const MATCH_RADIUS_PX: f64 = 1.5;
/// The match radius in standard errors of detection and camera model, where that is larger.
const MATCH_SIGMAS: f64 = 3.0;
/// Largest match radius, as a share of the distance at which stars are resolved.
const MATCH_SHARE: f64 = 0.5;
/// A neighbour fainter by more than this does not crowd a star.
const CROWDING_MAG: f32 = 1.0;

/// A catalogue star in the frame, with its detection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FrameStar {
    /// The star.
    pub star: StarIndex,
    /// V magnitude.
    pub v_mag: f64,
    /// Index of its detection; `None` if it was not detected.
    pub detection: Option<usize>,
    /// Whether it is single and well inside the frame.
    pub is_clear: bool,
}

/// Catalog stars and their detections.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Association {
    /// The stars, brightest first.
    pub stars: Vec<FrameStar>,
    /// Probability that an unrelated detection lies within the match radius of a given position.
    pub chance: f64,
}

/// The distance at which two stars are resolved for sure, in pixels.
fn resolved_px(spot_sigma_px: f64) -> f64 {
    (6.0 * spot_sigma_px).max(4.0)
}

/// Associates the stars `predicted`, brightest first, with the detections of `frame`.
pub(super) fn associate(frame: &IdentifiedFrame, predicted: &[PredictedStar]) -> Association {
    let sources = &frame.detections.sources;
    let resolved_px = resolved_px(frame.detections.spot_sigma_px);
    let match_radius_px = |source: usize| {
        let radius_px = match_radius_px(&sources[source], frame.identification);
        radius_px.min(MATCH_SHARE * resolved_px)
    };
    let is_star_like = |source: &Detection| source.flags.is_star_like() && source.flux_adu > 0.0;
    let star_like: Vec<usize> = (0..sources.len())
        .filter(|&i| is_star_like(&sources[i]))
        .collect();
    // The predicted stars, followed by the detections.
    let stars = predicted.iter().map(|star| star.pixel);
    let detections = star_like.iter().map(|&i| sources[i].position);
    let tree = PointTree::new(stars.chain(detections));
    let camera = &frame.identification.camera;
    let mut claimed = vec![false; sources.len()];
    let mut stars = Vec::with_capacity(predicted.len());
    for (index, star) in predicted.iter().enumerate() {
        let mut nearest: Option<(f64, usize)> = None;
        let mut is_single = true;
        tree.for_each_within(&star.pixel, resolved_px, |near| {
            if let Some(neighbor) = predicted.get(near.index) {
                let is_bright = neighbor.v_mag < star.v_mag + CROWDING_MAG;
                is_single &= near.index == index || !is_bright;
                return;
            }
            let source = star_like[near.index - predicted.len()];
            let candidate = (near.distance_px, source);
            if !claimed[source]
                && near.distance_px <= match_radius_px(source)
                && nearest.is_none_or(|best| candidate < best)
            {
                nearest = Some(candidate);
            }
        });
        let detection = nearest.map(|(_, source)| source);
        if let Some(source) = detection {
            claimed[source] = true;
        }
        if camera.contains(&star.pixel) {
            stars.push(FrameStar {
                star: star.star,
                v_mag: f64::from(star.v_mag),
                detection,
                is_clear: is_single && camera.nearly_contains(&star.pixel, -resolved_px),
            });
        }
    }
    let unclaimed = star_like.iter().filter(|&&i| !claimed[i]);
    let area_px: f64 = unclaimed.map(|&i| PI * match_radius_px(i).powi(2)).sum();
    Association {
        stars,
        chance: area_px / (camera.width_px * camera.height_px),
    }
}

/// The largest distance between `detection` and the predicted position of its star, in pixels.
fn match_radius_px(detection: &Detection, identification: &Identification) -> f64 {
    let sigma_px = detection.sigma_x_px.hypot(detection.sigma_y_px) / SQRT_2;
    let model_px = identification.rms_px / SQRT_2;
    // `max` keeps the smallest radius where the standard error is NaN.
    MATCH_RADIUS_PX.max(MATCH_SIGMAS * sigma_px.hypot(model_px))
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

    /// Associates `stars`, brightest first, with `sources`; the spots have a sigma of 1 px.
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
        let frame = IdentifiedFrame {
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
    fn each_star_claims_the_nearest_detection_within_the_match_radius() {
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
    fn the_brighter_of_two_stars_claims_first_and_crowds_the_other() {
        let sources = vec![detection(100.7, 100.0, PLAIN)];
        let stars = [star(100.0, 100.0, 5.0), star(101.0, 100.0, 7.0)];
        let found = associated(&stars, sources);
        assert_eq!(found.stars[0].detection, Some(0));
        assert_eq!(found.stars[1].detection, None);
        // A companion two magnitudes fainter does not crowd the brighter star.
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
    fn trails_are_not_claimed_and_unclaimed_detections_make_the_chance() {
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
        let expected = PI * MATCH_RADIUS_PX.powi(2) / SIDE_PX.powi(2);
        assert!((found.chance / expected - 1.0).abs() < 1e-9);
    }
}
