//! Finds which catalogue stars in a frame were detected: those that a detection has the name of.

use super::IdentifiedFrame;
use crate::base::neighbors::PointGrid;
use crate::catalog::StarIndex;
use crate::detect::PIXEL_VARIANCE_PX2;
use crate::identify::{PredictedStar, StarMatch};

/// A neighbor fainter by more than this does not crowd a star.
const CROWDING_MAG: f32 = 1.0;

/// A catalogue star in the frame, with its detection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FrameStar {
    /// The star.
    pub star: StarIndex,
    /// V magnitude.
    pub v_mag: f64,
    /// Index of its detection; `None` if it was not detected.
    pub detection: Option<usize>,
    /// Whether it is single, well inside the frame, and not hidden.
    pub is_clear: bool,
    /// Light of undetected neighbors in its flux, over its own; of a clear star less that in the background
    /// around, so that it may be below 0.
    pub neighbors_light: f64,
}

impl FrameStar {
    /// By how much its undetected neighbors make it brighter, in magnitudes.
    pub(crate) fn brighter_mag(&self) -> f64 {
        2.5 * libm::log10(1.0 + self.neighbors_light)
    }
}

/// Catalog stars and their detections.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Association {
    /// The stars, brightest first.
    pub stars: Vec<FrameStar>,
    /// Probability that a star has a detection by chance: that of a name that is chance.
    pub chance: f64,
}

/// The distance at which two stars are resolved for sure, in pixels.
pub(crate) fn resolved_px(spot_sigma_px: f64) -> f64 {
    (6.0 * spot_sigma_px).max(4.0)
}

/// The other stars around a star.
struct Crowding {
    /// Whether none of them is bright enough to crowd it.
    is_single: bool,
    /// Light, in the star's flux and over its own, of those without a detection of their own, above what is in the
    /// background.
    undetected_light: f64,
}

/// Part of the light of a neighbor at this distance that is in the flux of a star: the
/// autocorrelation of a Gaussian spot.
pub(crate) fn filter_response(distance_sigmas: f64) -> f64 {
    libm::exp(-0.25 * distance_sigmas.powi(2))
}

/// Light of a star of this magnitude, over that of magnitude 0.
fn light_of(mag: f32) -> f64 {
    libm::pow(10.0, -0.4 * f64::from(mag))
}

/// The light of stars that are too faint to be detected. The background contains its mean.
struct FaintLight {
    places: PointGrid,
    /// Of each of them.
    light: Vec<f64>,
    /// Within this distance the mean is taken.
    reach_px: f64,
    /// Part of the light of the stars within reach that is in a flux, on average.
    response: f64,
}

impl FaintLight {
    /// Of the stars `predicted`, brightest first, where `detections` has none of them.
    fn new(
        predicted: &[PredictedStar],
        detections: &[Option<usize>],
        width_px: f64,
        resolved_px: f64,
    ) -> Self {
        /// Stars that are not detected are too faint for it if they are fainter than this share of the detected
        /// ones. Brighter ones are behind clouds, or have no name.
        const BRIGHTER: f64 = 0.75;
        /// How far the mean is taken, over the distance at which two stars are resolved.
        const REACH: f64 = 8.0;
        let is_detected = |&star: &usize| detections[star].is_some();
        let detected: Vec<usize> = (0..predicted.len()).filter(is_detected).collect();
        let last = detected.get((BRIGHTER * detected.len() as f64) as usize);
        let fainter = last.map_or(0..0, |&last| last..predicted.len());
        let faint: Vec<&PredictedStar> = fainter
            .filter(|star| !is_detected(star))
            .map(|star| &predicted[star])
            .collect();
        let reach_px = REACH * resolved_px;
        let mut places = PointGrid::default();
        places.fill(faint.len(), faint.iter().map(|star| star.pixel));
        Self {
            places,
            light: faint.iter().map(|star| light_of(star.v_mag)).collect(),
            reach_px,
            // The integral of the filter's response, over the area within reach.
            response: (2.0 * width_px / reach_px).powi(2),
        }
    }

    /// Its mean around `star`, over the star's own light.
    fn over_light_of(&self, star: &PredictedStar) -> f64 {
        /// Beside more of it no star is measured.
        const MAX: f64 = 0.5;
        let mut light = 0.0;
        self.places
            .for_each_within(&star.pixel, self.reach_px, |near| {
                light += self.light[near.index];
            });
        (light * self.response / light_of(star.v_mag)).min(MAX)
    }
}

/// Associates the stars `predicted`, brightest first, with the detections of `frame`.
pub(crate) fn associate(frame: &IdentifiedFrame, predicted: &[PredictedStar]) -> Association {
    let matches = &frame.identification.matches;
    let detections = detections_of(predicted, matches);
    let mut places = PointGrid::default();
    places.fill(predicted.len(), predicted.iter().map(|star| star.pixel));
    let spot_sigma_px = frame.detections.spot_sigma_px;
    let resolved_px = resolved_px(spot_sigma_px);
    let width_px = (spot_sigma_px.powi(2) + PIXEL_VARIANCE_PX2).sqrt();
    let faint_light = FaintLight::new(predicted, &detections, width_px, resolved_px);
    let surroundings = |index: usize, star: &PredictedStar| {
        let mut around = Crowding {
            is_single: true,
            undetected_light: 0.0,
        };
        places.for_each_within(&star.pixel, resolved_px, |near| {
            if near.index == index {
                return;
            }
            let neighbor = &predicted[near.index];
            let fainter_mag = neighbor.v_mag - star.v_mag;
            around.is_single &= fainter_mag >= CROWDING_MAG;
            if detections[near.index].is_none() {
                let response = filter_response(near.distance_px / width_px);
                around.undetected_light += light_of(fainter_mag) * response;
            }
        });
        around
    };
    let camera = &frame.identification.camera;
    let inside = predicted
        .iter()
        .enumerate()
        .filter(|(_, star)| camera.contains(&star.pixel));
    let stars = inside.map(|(index, star)| {
        let around = surroundings(index, star);
        let is_clear = camera.nearly_contains(&star.pixel, -resolved_px)
            && around.is_single
            && frame.detections.shows_sky(&star.pixel);
        // Of others it is not asked, and there are many.
        let faint_light = if is_clear {
            faint_light.over_light_of(star)
        } else {
            0.0
        };
        FrameStar {
            star: star.star,
            v_mag: f64::from(star.v_mag),
            detection: detections[index],
            is_clear,
            neighbors_light: around.undetected_light - faint_light,
        }
    });
    let by_chance: f64 = matches.iter().map(|found| found.p_chance).sum();
    Association {
        stars: stars.collect(),
        chance: by_chance / predicted.len().max(1) as f64,
    }
}

/// The detection that has the name of each star of `predicted`, brightest first, if there is one.
fn detections_of(predicted: &[PredictedStar], matches: &[StarMatch]) -> Vec<Option<usize>> {
    let named = matches.iter().map(|found| (found.star, found.source.get()));
    let mut named: Vec<(StarIndex, usize)> = named.collect();
    named.sort_unstable();
    // Stars are numbered by brightness, so both are in the same order.
    let mut named = named.into_iter().peekable();
    let detection = |star: &PredictedStar| {
        while named
            .next_if(|(brighter, _)| *brighter < star.star)
            .is_some()
        {}
        let next = named.peek().filter(|(next, _)| *next == star.star);
        next.map(|(_, detection)| *detection)
    };
    predicted.iter().map(detection).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::coords::{PixelPoint, Rotation, UnitVector};
    use crate::camera::CameraModel;
    use crate::detect::Detections;
    use crate::ephemeris::places::StarPlaces;
    use crate::identify::{Identification, SourceIndex};
    use nalgebra::Matrix3;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    const SIDE_PX: f64 = 400.0;

    fn star(x: f64, y: f64, v_mag: f32) -> PredictedStar {
        PredictedStar {
            pixel: PixelPoint::new(x, y),
            direction: UnitVector::from_ra_dec(0.0, 0.0),
            v_mag,
            star: StarIndex::new((v_mag * 10.0) as usize),
        }
    }

    /// Associates `stars`, brightest first; the detections in their order are `named`, each by
    /// chance with a probability of 0.001. The spots have a sigma of 1 px.
    fn associated(stars: &[PredictedStar], named: &[StarIndex]) -> Association {
        let centre = UnitVector::from_ra_dec(0.0, 0.0);
        let matches = named.iter().enumerate().map(|(source, &star)| StarMatch {
            source: SourceIndex::new(source),
            star,
            light: centre,
            residual_px: 0.1,
            p_chance: 0.001,
        });
        let identification = Identification {
            places: StarPlaces::default(),
            lens_is_known: false,
            camera: CameraModel::pinhole(SIDE_PX, SIDE_PX, 2000.0, false),
            icrs_to_camera: Rotation::looking_at(&centre, 0.0),
            attitude_covariance_rad2: Matrix3::zeros(),
            focal_length_sigma_px: 0.0,
            centre_sigma_px: [0.0; 2],
            excess_sigma_px: 0.0,
            matches: matches.collect(),
            rms_px: 0.2,
            log10_false_alarm: -50.0,
        };
        let detections = Detections {
            spot_sigma_px: 1.0,
            ..Detections::default()
        };
        let frame = IdentifiedFrame {
            detections: &detections,
            identification: &identification,
            exposure_s: None,
            vignetting: 0.0,
        };
        associate(&frame, stars)
    }

    #[test]
    fn a_star_is_detected_where_a_detection_has_its_name() {
        let stars = [star(100.0, 100.0, 5.0), star(200.0, 100.0, 6.0)];
        let found = associated(&stars, &[stars[1].star]);
        assert_eq!(found.stars[0].detection, None);
        assert_eq!(found.stars[1].detection, Some(0));
        assert!(found.stars.iter().all(|star| star.is_clear));
        assert!((found.chance - 0.0005).abs() < 1e-12);
    }

    #[test]
    fn a_brighter_star_crowds_a_fainter_one() {
        let stars = [star(100.0, 100.0, 5.0), star(101.0, 100.0, 7.0)];
        let found = associated(&stars, &[]);
        // A companion two magnitudes fainter does not crowd the brighter star, but adds its light.
        assert!(found.stars[0].is_clear && !found.stars[1].is_clear);
        let light = 10f64.powf(-0.8) * (-0.25 / (1.0 + PIXEL_VARIANCE_PX2)).exp();
        assert!((found.stars[0].neighbors_light - light).abs() < 1e-6);
    }

    #[test]
    fn the_background_has_the_mean_light_of_faint_stars() {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        let mut place = || random.random_range(8.0..SIDE_PX - 8.0);
        let mut stars: Vec<PredictedStar> = (0..400).map(|_| star(place(), place(), 5.0)).collect();
        let named: Vec<StarIndex> = stars.iter().map(|star| star.star).take(1).collect();
        stars.extend((0..8000).map(|_| star(place(), place(), 8.0)));
        let found = associated(&stars, &named);
        let light = |star: &FrameStar| star.neighbors_light;
        let bright = found.stars.iter();
        let bright = bright.filter(|star| star.v_mag < 6.0 && star.is_clear);
        let bright: Vec<f64> = bright.map(light).collect();
        // A spot takes up 4π s² = 13.6 pixels, in which 0.7 of the faint stars have 0.043 of a bright one's light.
        let mean = bright.iter().sum::<f64>() / bright.len() as f64;
        assert!(mean.abs() < 0.006, "{mean}");
        assert!(bright.iter().any(|light| *light < -0.035));
    }

    #[test]
    fn stars_near_the_border_are_not_clear_and_those_beyond_it_are_left_out() {
        let stars = [
            star(2.0, 200.0, 5.0),
            star(-2.0, 100.0, 6.0),
            star(200.0, 397.0, 7.0),
        ];
        let found = associated(&stars, &[]);
        assert_eq!(found.stars.len(), 2);
        assert!(found.stars.iter().all(|star| !star.is_clear));
    }
}
