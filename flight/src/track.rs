//! Where does the camera look now, if it is known where it looked before?
//!
//! Attitude and rate → where the stars are to be seen → a window around each → centroids → the attitude that most of them
//! agree with → attitude and rate.

use crate::agreement::{MAX_EXCESS, OUTLIER_SIGMAS};
use crate::centroid::{self, Window};
use crate::chance::log10_tail;
use crate::matching::{Match, Predicted, View};
use crate::motion::{Measured, Motion, MotionPrediction};
use crate::tracker::Tracker;
use crate::{Attitude, Error, Image, Sky, Status, Work, limiting_v_mag};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

/// Stars that an attitude needs.
const MIN_STARS: usize = 3;
/// Stars are sought within this many standard errors of the prediction, …
const RADIUS_SIGMAS: f64 = 4.0;
/// … and this, in pixels, …
const MIN_RADIUS_PX: f64 = 1.5;
/// … but within no more than this, …
const MAX_RADIUS_PX: f64 = 12.0;
/// … and not at all where the prediction is this uncertain.
const LOST_RADIUS_PX: f64 = 60.0;
/// An error of the prediction that an unknown acceleration may cause, in pixels.
const TYPICAL_ERROR_PX: f64 = 2.0;
/// Stars fainter than the limit by this are not sought.
const FAINTER_MAG: f64 = 0.3;
/// Other lights that count as stars: one in a square of this side, in pixels.
const LIGHTS_PX: f64 = 60.0;

/// What is known before an image.
struct Expected {
    prediction: MotionPrediction,
    rate_rad_s: Vector3<f64>,
    radius_px: f64,
}

impl Tracker<'_> {
    /// Begins to track with an attitude, such as [`Tracker::lost`] gives; `time_s` is that of the middle of its exposure.
    pub fn start(&mut self, attitude: &Attitude, time_s: f64) {
        if attitude.status != Status::FOUND {
            self.motion = None;
            return;
        }
        self.scale = attitude.scale;
        let measured = measured(attitude);
        self.motion = match self.motion {
            Some(mut motion) => motion
                .predict(time_s, self.typical_rad())
                .map(|prediction| {
                    motion.update(&prediction, &measured, self.typical_rad());
                    motion
                }),
            None => None,
        }
        .or_else(|| Some(Motion::start(&measured, time_s)));
    }

    /// Finds the attitude of an image from those before it; `time_s` is that of the middle of its exposure.
    ///
    /// # Errors
    /// [`Error::Image`] where the image has another size than the camera, and [`Error::Time`] where the time is not later
    /// than that of the last attitude.
    pub fn track(&mut self, image: &Image, time_s: f64, sky: &Sky) -> Result<Attitude, Error> {
        image.check_camera(&self.config.camera)?;
        self.work = Work::default();
        let Some(mut motion) = self.motion else {
            return Ok(Attitude::failed(Status::NO_ATTITUDE_BEFORE));
        };
        let prediction = motion
            .predict(time_s, self.typical_rad())
            .ok_or(Error::Time)?;
        let Some(expected) = self.expected(&motion, prediction) else {
            self.motion = None;
            return Ok(Attitude::failed(Status::NO_ATTITUDE_BEFORE));
        };
        // What is not seen in one image may be seen in the next: the motion goes on meanwhile.
        let (matches, sought) = self.measure(image, &expected, sky);
        if matches < MIN_STARS {
            return Ok(Attitude::failed(Status::TOO_FEW_STARS));
        }
        let Some(found) = self.agreeing(matches, sought, &expected) else {
            return Ok(Attitude::failed(Status::NOT_IDENTIFIED));
        };
        motion.update(&expected.prediction, &measured(&found), self.typical_rad());
        self.motion = Some(motion);
        self.scale = found.scale;
        Ok(with_rate(found, &motion))
    }

    fn typical_rad(&self) -> f64 {
        TYPICAL_ERROR_PX / self.lens.camera.focal_length_px
    }

    /// What is known before an image; `None` where that is too little.
    fn expected(&self, motion: &Motion, prediction: MotionPrediction) -> Option<Expected> {
        let covariance = prediction.attitude_covariance_rad2();
        let variance = [0, 1, 2].map(|axis| covariance[(axis, axis)]);
        let focal_px = self.lens.camera.focal_length_px;
        let sigma_px = focal_px
            * libm::sqrt(
                variance[0].max(variance[1])
                    + variance[2] * self.lens.radius_rad * self.lens.radius_rad,
            );
        let radius_px = MIN_RADIUS_PX + RADIUS_SIGMAS * sigma_px;
        // Without a rate nothing is certain, and all that may be is tried.
        let is_known = motion.rate().is_none() || radius_px < LOST_RADIUS_PX;
        is_known.then(|| Expected {
            prediction,
            rate_rad_s: motion.rate().map_or(Vector3::zeros(), |[rate, _]| rate),
            radius_px: radius_px.min(MAX_RADIUS_PX),
        })
    }

    /// Measures the stars that are to be seen; how many were found, and how many sought.
    fn measure(&mut self, image: &Image, expected: &Expected, sky: &Sky) -> (usize, usize) {
        let icrs_to_camera = expected.prediction.icrs_to_camera;
        let view = View {
            lens: &self.lens,
            catalog: &self.catalog,
            sky,
            icrs_to_camera,
            scale: self.scale,
        };
        let predicted = view.predict(self.buffers.predicted, &mut self.work);
        let faintest = limiting_v_mag(&self.config) + FAINTER_MAG;
        let most = self.config.max_stars as usize;
        let (mut sought, mut found) = (0, 0);
        for number in 0..predicted {
            let star = self.buffers.predicted[number];
            if sought == most || f64::from(star.v_mag) > faintest {
                break;
            }
            let place = self.place_of(&star, expected, &icrs_to_camera);
            if !self.is_alone(number, predicted, expected.radius_px) {
                continue;
            }
            sought += 1;
            if let Some(measured) = self.measure_star(image, place, &star, expected) {
                self.buffers.matches[found] = measured;
                found += 1;
            }
        }
        (found, sought)
    }

    /// Where the star is seen when its row is read.
    fn place_of(
        &self,
        star: &Predicted,
        expected: &Expected,
        icrs_to_camera: &Matrix3<f64>,
    ) -> [f64; 2] {
        let seen = icrs_to_camera * Vector3::from(star.apparent);
        let late_s = self.late_s(star.pixel[1]);
        let then = (seen - expected.rate_rad_s.cross(&seen) * late_s).normalize();
        let scaled = Vector3::new(then.x * self.scale, then.y * self.scale, then.z);
        self.lens
            .pixel_of(&scaled, MAX_RADIUS_PX)
            .unwrap_or(star.pixel)
    }

    /// How much later than the middle row a row is read, in seconds.
    fn late_s(&self, y_px: f64) -> f64 {
        (y_px - 0.5 * (f64::from(self.config.camera.height_px) - 1.0))
            * self.config.sensor.row_time_s
    }

    /// Whether no other star that is nearly as bright is near.
    fn is_alone(&self, number: usize, predicted: usize, radius_px: f64) -> bool {
        /// Fainter stars hardly move a centroid.
        const FAINTER_MAG: f32 = 3.0;
        let near_px = radius_px + 3.0 * self.config.spot_sigma_px;
        let star = &self.buffers.predicted[number];
        let others = self.buffers.predicted[..predicted].iter().enumerate();
        !others
            .filter(|(other, _)| *other != number)
            .any(|(_, other)| {
                other.v_mag < star.v_mag + FAINTER_MAG
                    && libm::hypot(
                        other.pixel[0] - star.pixel[0],
                        other.pixel[1] - star.pixel[1],
                    ) < near_px
            })
    }

    fn measure_star(
        &mut self,
        image: &Image,
        place: [f64; 2],
        star: &Predicted,
        expected: &Expected,
    ) -> Option<Match> {
        self.work.windows += 1;
        let peak = centroid::peak(image, place, expected.radius_px)?;
        let window = Window::around(image, &self.config, peak)?;
        let spot = centroid::measure(&window, &self.config, &mut self.work.iterations)?;
        let off_px = libm::hypot(spot.x_px - place[0], spot.y_px - place[1]);
        if f64::from(spot.snr) < self.config.detection_sigma || off_px > expected.radius_px {
            return None;
        }
        // As it is seen when the middle row is read.
        let then = self.lens.direction_of([spot.x_px, spot.y_px]);
        let middle = (then + expected.rate_rad_s.cross(&then) * self.late_s(spot.y_px)).normalize();
        let floor = self.config.position_floor_px;
        Some(Match {
            observed: middle.into(),
            apparent: star.apparent,
            variance_px2: spot.sigma_px * spot.sigma_px + floor * floor,
        })
    }

    /// The attitude that most of the stars agree with, if chance does not do as well.
    fn agreeing(&mut self, matches: usize, sought: usize, expected: &Expected) -> Option<Attitude> {
        let (fit, stars) =
            self.fit_agreeing(matches, &expected.prediction.icrs_to_camera, MIN_STARS)?;
        let agreeing = &self.buffers.matches[..stars];
        let square_px2 = agreeing.iter().map(|pair| pair.variance_px2).sum::<f64>() / stars as f64;
        let reach_px2 = OUTLIER_SIGMAS
            * OUTLIER_SIGMAS
            * square_px2
            * fit.reduced_chi_square.clamp(1.0, MAX_EXCESS);
        let p = core::f64::consts::PI * reach_px2 / (LIGHTS_PX * LIGHTS_PX);
        // Two stars make an attitude; the others agree with it by chance where a light is near.
        let log10_chance = log10_tail(
            sought.saturating_sub(2),
            stars.saturating_sub(2),
            p.min(1.0),
        );
        let is_sure = log10_chance < self.config.max_log10_false_alarm;
        is_sure.then(|| Attitude::found(&fit, stars, log10_chance))
    }
}

fn measured(attitude: &Attitude) -> Measured {
    let [w, x, y, z] = attitude.quaternion;
    let quaternion = UnitQuaternion::new_normalize(nalgebra::Quaternion::new(w, x, y, z));
    let rotation: Rotation3<f64> = quaternion.to_rotation_matrix();
    Measured {
        icrs_to_camera: *rotation.matrix(),
        covariance_rad2: Matrix3::from_fn(|row, column| attitude.covariance_rad2[row][column]),
    }
}

fn with_rate(attitude: Attitude, motion: &Motion) -> Attitude {
    match motion.rate() {
        Some([rate, sigma]) => Attitude {
            rate_rad_s: rate.into(),
            rate_sigma_rad_s: sigma.into(),
            ..attitude
        },
        None => attitude,
    }
}
