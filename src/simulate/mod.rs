//! Frames with truth: what a camera would make of known stars.
//!
//! [`Scenario`], [`Pointing`], catalogue stars, seed → [`Frame`], [`Truth`]
//!
//! 1. Each star's place on the detector, at the date, and its expected electrons by the scenario's [`Budget`].
//! 2. Its spot: a Gaussian, smeared along the rows by the motion during the exposure, integrated over each pixel.
//! 3. Sky and dark current, the same in every pixel.
//! 4. What is read out: Poisson charge that a full pixel clips, the noise of reading, gain, bias, whole grey levels of
//!    so many bits.
//!
//! The random numbers depend on the seed alone: the same frame on any number of threads.
//!
//! Caveats: those of [`crate::sensor`]: one spot for the whole field, no vignetting, all pixels alike. Pixels are square
//! ([`square_pixel_camera`]). A sky, a star and a dark current do not vary during the exposure; a full pixel does not spill
//! over into its neighbours.

mod readout;
mod spot;

use crate::camera::CameraModel;
use crate::catalog::Star;
use crate::coords::{Camera, Icrs, PixelPoint, Rotation, UnitVector};
use crate::frame::{self, Frame, FrameError};
use crate::sensitivity::{Budget, Scenario};
use crate::sensor::Sensor;
use readout::Readout;
use spot::Spot;

/// Where a camera points, and when.
#[derive(Debug, Clone, PartialEq)]
pub struct Pointing {
    /// Which direction each pixel looks in; its size is the sensor's.
    pub camera: CameraModel,
    /// The attitude.
    pub icrs_to_camera: Rotation<Icrs, Camera>,
    /// When, in Julian years since J2000.0: the stars move.
    pub years_since_j2000: f64,
}

/// What is truly on a frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Truth {
    /// The stars whose place is on the frame, in the order of the catalogue.
    pub stars: Vec<TrueStar>,
    /// Those just beyond its border that send light into it, in the same order.
    pub beyond: Vec<TrueStar>,
}

/// A star that is on a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrueStar {
    /// Its index among the catalogue's stars.
    pub catalog: usize,
    /// Where it stands; in the middle of its way where it moves.
    pub position: PixelPoint,
    /// Johnson V magnitude.
    pub v_mag: f64,
    /// Electrons to be expected of it, on all its pixels.
    pub electrons: f64,
}

/// A pinhole camera with the sensor's pixels, made square: of the same area.
///
/// A camera model has one scale for both axes. Where a pitch differs from the other by percents, the true image could not be
/// identified as one of square pixels; what is simulated can.
pub fn square_pixel_camera(sensor: &Sensor) -> CameraModel {
    let pitch_um = (sensor.pitch_x_um * sensor.pitch_y_um).sqrt();
    let focal_length_px = sensor.focal_length_mm * 1e3 / pitch_um;
    let (width_px, height_px) = (sensor.width_px as f64, sensor.height_px as f64);
    CameraModel::pinhole(width_px, height_px, focal_length_px, false)
}

/// A frame of the catalogue's `stars`, seen from a `pointing`, and the stars that are on it.
///
/// All stars are drawn, however faint: the catalogue should go deeper than the camera.
///
/// # Errors
/// [`FrameError::TooSmall`], [`FrameError::TooLarge`] for a detector that no frame can be of.
pub fn frame_of_sky(
    scenario: &Scenario,
    pointing: &Pointing,
    stars: &[Star],
    seed: u64,
) -> Result<(Frame, Truth), FrameError> {
    let spot = Spot::of(scenario);
    let seen = stars_near(scenario, pointing, stars, spot.reach_px());
    let sources: Vec<_> = seen
        .iter()
        .map(|star| (star.position, star.electrons))
        .collect();
    let frame = expose(scenario, &sources, seed)?;
    let on_frame = |star: &TrueStar| pointing.camera.contains(&star.position);
    let (stars, beyond) = seen.into_iter().partition(on_frame);
    Ok((frame, Truth { stars, beyond }))
}

/// A frame of stars at these places, of these V magnitudes.
///
/// # Errors
/// As [`frame_of_sky`].
pub fn star_field(
    scenario: &Scenario,
    stars: &[(PixelPoint, f64)],
    seed: u64,
) -> Result<Frame, FrameError> {
    let budget = Budget::new(scenario);
    let exposure_s = scenario.conditions.exposure_s;
    let source =
        |&(position, v_mag): &(PixelPoint, f64)| (position, budget.electrons_of(v_mag, exposure_s));
    let sources: Vec<_> = stars.iter().map(source).collect();
    expose(scenario, &sources, seed)
}

/// The stars on the frame, and those so near to it that their light reaches it.
fn stars_near(
    scenario: &Scenario,
    pointing: &Pointing,
    stars: &[Star],
    reach_px: f64,
) -> Vec<TrueStar> {
    let budget = Budget::new(scenario);
    let camera = &pointing.camera;
    let boresight = pointing
        .icrs_to_camera
        .inverse()
        .apply(&UnitVector::BORESIGHT);
    // Room for the light that reaches in from outside, and for a star's own motion.
    let margin_rad = 2.0 * reach_px / camera.focal_length_px + PROPER_MOTION_ROOM_RAD;
    let least_cosine = (camera.radius_rad() + margin_rad).cos();
    let near = |star: &Star| star.direction.dot(&boresight) > least_cosine;
    let seen = |(catalog, star): (usize, &Star)| {
        let direction = star.direction_at(pointing.years_since_j2000);
        let position = camera.pixel_of(&pointing.icrs_to_camera.apply(&direction))?;
        let v_mag = f64::from(star.v_mag);
        camera
            .nearly_contains(&position, reach_px)
            .then(|| TrueStar {
                catalog,
                position,
                v_mag,
                electrons: budget.electrons_of(v_mag, scenario.conditions.exposure_s),
            })
    };
    let candidates = stars.iter().enumerate().filter(|(_, star)| near(star));
    candidates.filter_map(seen).collect()
}

/// How far a star may move between J2000.0 and any date that is asked for: Barnard's Star in 200 years.
const PROPER_MOTION_ROOM_RAD: f64 = 0.01;

/// A frame of `sources`, their places and expected electrons.
fn expose(
    scenario: &Scenario,
    sources: &[(PixelPoint, f64)],
    seed: u64,
) -> Result<Frame, FrameError> {
    let sensor = &scenario.sensor;
    let (width, height) = (sensor.width_px, sensor.height_px);
    frame::check_size(width, height)?;
    let budget = Budget::new(scenario);
    let mut expected_e = vec![budget.background_e + budget.dark_e; width * height];
    let mut spot = Spot::of(scenario);
    for (position, electrons) in sources {
        spot.add(&mut expected_e, width, position, *electrons);
    }
    let readout = Readout::of(sensor);
    let pixels = readout.grey_levels(&expected_e, seed);
    let frame = Frame::new(width, height, pixels)?;
    Ok(frame.with_levels(1.0, Some(readout.saturation_adu() as f32)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalog::StarId;
    use crate::sensor::Preset;
    use crate::units::RAD_PER_DEG;

    #[test]
    fn square_pixels_have_the_area_of_those_that_are_not() {
        let sensor = Preset::Experiment1.sensor();
        let scale_rad = 1.0 / square_pixel_camera(&sensor).focal_length_px;
        assert!((scale_rad * scale_rad / sensor.pixel_solid_angle_sr() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_star_is_true_where_its_place_is_on_the_frame_and_drawn_where_its_light_is() {
        let mut scenario = Scenario::of(Preset::Experiment1);
        scenario.sensor.read_noise_e = 0.0;
        let camera = square_pixel_camera(&scenario.sensor);
        let boresight = UnitVector::from_ra_dec(1.0, 0.3);
        let pointing = Pointing {
            icrs_to_camera: Rotation::looking_at(&boresight, 40.0 * RAD_PER_DEG),
            years_since_j2000: 0.0,
            camera,
        };
        let star_at = |x: f64, y: f64| {
            let direction = pointing.camera.direction_of(&PixelPoint::new(x, y));
            let on_sky = pointing.icrs_to_camera.inverse().apply(&direction);
            Star::new(StarId::Number(1), on_sky, 2.0)
        };
        let stars = [star_at(-1.5, 300.0), star_at(100.25, 200.75)];
        let (frame, truth) = frame_of_sky(&scenario, &pointing, &stars, 7).unwrap();
        assert_eq!((truth.stars.len(), truth.beyond.len()), (1, 1));
        let found = &truth.stars[0];
        assert_eq!((found.catalog, found.v_mag), (1, 2.0));
        assert!(found.position.distance_to(&PixelPoint::new(100.25, 200.75)) < 1e-6);
        assert!(frame.pixels[300 * frame.width] > 2.0 * frame.pixels[100 * frame.width]);
    }

    #[test]
    fn a_detector_without_end_is_refused() {
        let mut scenario = Scenario::of(Preset::Experiment1);
        (scenario.sensor.width_px, scenario.sensor.height_px) = (100_000, 100_000);
        let refused = star_field(&scenario, &[], 1);
        assert!(matches!(refused, Err(FrameError::TooLarge { .. })));
    }
}
