//! Tracks simulated sequences, and compares every attitude with the truth:
//! `cargo run --release --example track_sequence -- tripod|ship|satellite [FRAMES] [SEED] [STRESS]`
//!
//! A camera of 640 × 480 pixels and 20° takes ten frames a second. On the tripod it turns with the
//! Earth; the ship rolls by 5° in 10 s,
//! pitches by 2° in 8 s, and changes its heading; the satellite turns by 1° in a second about an
//! axis that turns, too. With STRESS (a number of frames), five frames without light follow every so
//! many frames, and half-way between the camera jumps elsewhere.

use nalgebra::Vector3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, UnitSphere};
use starpipe::base::coords::{Camera, Icrs, PixelPoint, Rotation, UnitVector};
use starpipe::camera::CameraModel;
use starpipe::camera::data_sheet::{DataSheet, Preset};
use starpipe::detect::{self, DetectConfig, Detections, detect_into};
use starpipe::ephemeris::places::StarPlaces;
use starpipe::frame::Frame;
use starpipe::identify::IndexedCatalog;
use starpipe::identify::fit::{MeasuredStar, fit_camera};
use starpipe::lab::simulate::{Pointing, Scene, Simulator};
use starpipe::predict::Scenario;
use starpipe::solve::Context;
use starpipe::track::{Mode, Track, Tracker};
use std::error::Error;
use std::time::Instant;

const INTERVAL_S: f64 = 0.1;
const ARCSEC_PER_RAD: f64 = 206_264.806;
/// Frames without light in a row.
const DARK_FRAMES: u64 = 5;
/// The full solution is computed, too, for every so many tracked frames.
const COMPARED_EVERY: u64 = 10;

type Attitude = Rotation<Icrs, Camera>;

/// The sequences.
#[derive(Clone, Copy, PartialEq)]
enum Carrier {
    Tripod,
    Ship,
    Satellite,
}

impl Carrier {
    fn exposure_s(self) -> f64 {
        match self {
            Self::Ship => 0.02,
            Self::Tripod | Self::Satellite => 0.05,
        }
    }

    /// Angular rate about the camera's axes, in degrees per second.
    fn rate_deg_s(self, time_s: f64) -> Vector3<f64> {
        let swing = |amplitude_deg: f64, period_s: f64, phase: f64| {
            let rate = std::f64::consts::TAU / period_s;
            amplitude_deg * rate * (rate * time_s + phase).cos()
        };
        match self {
            Self::Tripod => Vector3::new(0.002, 0.003, -0.002),
            Self::Ship => Vector3::new(
                swing(2.0, 8.0, 1.0),
                swing(5.0, 10.0, 0.0),
                0.3 + swing(1.0, 12.0, 2.0),
            ),
            Self::Satellite => {
                let (turn, tilt) = (time_s / 9.0, time_s / 31.0);
                Vector3::new(turn.cos() * tilt.cos(), turn.sin() * tilt.cos(), tilt.sin())
            }
        }
    }

    /// The attitude `INTERVAL_S` later.
    fn advanced(self, mut attitude: Attitude, time_s: f64) -> Attitude {
        const STEPS: u32 = 50;
        let step_s = INTERVAL_S / f64::from(STEPS);
        for step in 0..STEPS {
            let middle_s = time_s + (f64::from(step) + 0.5) * step_s;
            let turn = self.rate_deg_s(middle_s).map(f64::to_radians) * step_s;
            attitude = attitude.then_turn(-turn);
        }
        attitude
    }
}

/// The nanosat tracker with its pixels binned four by four.
fn camera() -> DataSheet {
    DataSheet {
        width_px: 640,
        height_px: 480,
        pitch_x_um: 8.8,
        pitch_y_um: 8.8,
        spot_sigma_px: 0.9,
        peak_share: None,
        ..Preset::NanosatTracker.data_sheet()
    }
}

/// The turn about the camera's axes from one attitude to another, for small ones.
fn turn_between(from: &Attitude, to: &Attitude) -> Vector3<f64> {
    let m = to.matrix() * from.matrix().transpose();
    0.5 * Vector3::new(
        m[(2, 1)] - m[(1, 2)],
        m[(0, 2)] - m[(2, 0)],
        m[(1, 0)] - m[(0, 1)],
    )
}

/// Counts and sums over the frames.
#[derive(Default)]
struct TrackTally {
    tracked: u64,
    acquired: u64,
    lost: u64,
    /// Changes from tracked or acquired to lost, from lost to an attitude, and tracked frames whose
    /// next one had to be solved in full.
    losses: u64,
    recoveries: u64,
    reacquired: u64,
    /// Attitudes off by more than a pixel, and by more than five standard errors on an axis.
    wrong: u64,
    beyond_5_sigma: u64,
    stars: u64,
    /// Squared errors over their variance on each axis.
    pulls: Vector3<f64>,
    nees: f64,
    rate_pulls: f64,
    rates: u64,
    /// Squared errors of tracked frames, and of the full solution of the same stars.
    compared: u64,
    squares: [Vector3<f64>; 2],
    times_us: Vec<f64>,
}

impl TrackTally {
    fn add(&mut self, track: &Track, truth: &Attitude, rate: Vector3<f64>, before: Mode) {
        match track.mode {
            Mode::Tracked => self.tracked += 1,
            Mode::Acquired => self.acquired += 1,
            Mode::Lost => self.lost += 1,
        }
        let is_lost = track.mode == Mode::Lost;
        self.losses += u64::from(is_lost && before != Mode::Lost);
        self.recoveries += u64::from(!is_lost && before == Mode::Lost);
        self.reacquired += u64::from(track.mode == Mode::Acquired && before == Mode::Tracked);
        let Some(attitude) = &track.attitude else {
            return;
        };
        let error = turn_between(truth, &attitude.icrs_to_camera);
        let sigma = attitude.covariance_rad2.diagonal().map(f64::sqrt);
        let focal_px = track
            .camera
            .map_or(1.0, |(camera, _)| camera.focal_length_px());
        let off = attitude.icrs_to_camera.angle_to(truth);
        self.wrong += u64::from(off * focal_px > 1.0 && error.component_div(&sigma).amax() > 5.0);
        self.beyond_5_sigma += u64::from(error.component_div(&sigma).amax() > 5.0);
        if track.mode == Mode::Tracked {
            self.stars += track.stars_used as u64;
            self.pulls += error.component_div(&sigma).map(|pull| pull * pull);
            let inverse = attitude.covariance_rad2.try_inverse().unwrap_or_default();
            self.nees += (error.transpose() * inverse * error)[0];
            if let Some(found) = &track.rate {
                let off = (found.rad - rate).component_div(&found.sigma_rad);
                self.rate_pulls += off.norm_squared() / 3.0;
                self.rates += 1;
            }
        }
    }

    fn print(mut self, frames: u64) {
        println!(
            "{frames} frames: {} tracked, {} acquired, {} lost; {} losses, {} recoveries, {} solved in full after a tracked one",
            self.tracked, self.acquired, self.lost, self.losses, self.recoveries, self.reacquired
        );
        println!(
            "wrong {}, beyond five standard errors {}",
            self.wrong, self.beyond_5_sigma
        );
        let count = self.tracked.max(1) as f64;
        println!(
            "tracked: {:.1} stars, NEES {:.3} of 3, mean squared pulls {:.3} {:.3} {:.3}, of the rate {:.3}",
            self.stars as f64 / count,
            self.nees / count,
            self.pulls.x / count,
            self.pulls.y / count,
            self.pulls.z / count,
            self.rate_pulls / self.rates.max(1) as f64
        );
        let rms = self
            .squares
            .map(|sum| (sum / self.compared.max(1) as f64).map(f64::sqrt) * ARCSEC_PER_RAD);
        println!(
            "{} frames compared: rms error {:.3} {:.3} {:.2}″, full solution of the same stars {:.3} {:.3} {:.2}″, ratio {:.3} {:.3} {:.3}",
            self.compared,
            rms[0].x,
            rms[0].y,
            rms[0].z,
            rms[1].x,
            rms[1].y,
            rms[1].z,
            rms[0].x / rms[1].x,
            rms[0].y / rms[1].y,
            rms[0].z / rms[1].z
        );
        self.times_us.sort_by(f64::total_cmp);
        if let Some(last) = self.times_us.len().checked_sub(1) {
            let at = |share: f64| self.times_us[(share * last as f64) as usize];
            println!(
                "time of a tracked frame: median {:.1} µs, 90 % {:.1}, 99 % {:.1}, worst {:.1}",
                at(0.5),
                at(0.9),
                at(0.99),
                at(1.0)
            );
        }
    }
}

/// The full solution of the stars that were tracked: their detections, and a fit with a free focal
/// length.
struct FullSolution {
    workspace: detect::Workspace,
    found: Detections,
}

impl FullSolution {
    fn attitude(
        &mut self,
        frame: &Frame,
        tracker: &Tracker,
        (camera, start): (&CameraModel, &Attitude),
    ) -> Option<Attitude> {
        let config = DetectConfig::default();
        detect_into(frame, &config, &mut self.workspace, &mut self.found).ok()?;
        let plain = camera.with_distortion(None);
        let mut stars = Vec::new();
        for star in tracker.used_stars() {
            let sources = self.found.sources.iter();
            let nearest = sources.min_by(|a, b| {
                let apart = |p: &PixelPoint| p.distance_to(&star.position);
                apart(&a.position).total_cmp(&apart(&b.position))
            })?;
            if nearest.position.distance_to(&star.position) < 1.0 {
                let sigma_px = nearest.sigma_x_px.hypot(nearest.sigma_y_px) / 2f64.sqrt();
                stars.push(MeasuredStar {
                    pixel: plain.pixel_of(&camera.direction_of(&nearest.position)?)?,
                    icrs: star.direction,
                    sigma_px,
                });
            }
        }
        let fit = fit_camera(&stars, &plain, start, None, &mut Vec::new())?;
        Some(fit.icrs_to_camera)
    }
}

/// What is to be done.
struct SequencePlan {
    carrier: Carrier,
    frames: u64,
    seed: u64,
    stress: Option<u64>,
}

impl SequencePlan {
    fn of_arguments() -> Result<Self, Box<dyn Error>> {
        let arguments: Vec<String> = std::env::args().skip(1).collect();
        let number = |at: usize| {
            arguments
                .get(at)
                .map(|text| text.parse::<u64>())
                .transpose()
        };
        Ok(Self {
            carrier: match arguments.first().map(String::as_str) {
                Some("tripod") => Carrier::Tripod,
                Some("ship") => Carrier::Ship,
                Some("satellite") => Carrier::Satellite,
                _ => {
                    return Err(
                        "usage: track_sequence tripod|ship|satellite [FRAMES] [SEED] [STRESS]"
                            .into(),
                    );
                }
            },
            frames: number(1)?.unwrap_or(10_000),
            seed: number(2)?.unwrap_or(1),
            stress: number(3)?,
        })
    }

    fn is_dark(&self, frame: u64) -> bool {
        self.stress
            .is_some_and(|every| frame >= every && frame % every < DARK_FRAMES)
    }

    fn is_jump(&self, frame: u64) -> bool {
        self.stress.is_some_and(|every| frame % every == every / 2)
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let plan = SequencePlan::of_arguments()?;
    let indexed = IndexedCatalog::built_in();
    let mut scenario = Scenario::new(camera());
    scenario.conditions.exposure_s = plan.carrier.exposure_s();
    let mut context = Context::new(&indexed);
    context.priors.exposure_s = Some(scenario.conditions.exposure_s);
    let mut tracker = Tracker::new(context);
    let mut full = FullSolution {
        workspace: detect::Workspace::new(),
        found: Detections::default(),
    };
    let mut rng = ChaCha8Rng::seed_from_u64(plan.seed);
    let mut elsewhere = || {
        let [x, y, z]: [f64; 3] = UnitSphere.sample(&mut rng);
        Rotation::looking_at(&UnitVector::from_vector(Vector3::new(x, y, z)), 0.5)
    };
    let mut truth = elsewhere();
    let (mut tally, mut before) = (TrackTally::default(), Mode::Acquired);
    for number in 0..plan.frames {
        let time_s = INTERVAL_S * number as f64;
        if number > 0 {
            truth = plan.carrier.advanced(truth, time_s - INTERVAL_S);
        }
        if plan.is_jump(number) {
            truth = elsewhere();
        }
        let rate_deg_s = plan.carrier.rate_deg_s(time_s);
        let mut scene = Scene::default();
        scene.rate_x_deg_s = rate_deg_s.x;
        scene.rate_y_deg_s = rate_deg_s.y;
        scene.rate_z_deg_s = rate_deg_s.z;
        scene.faintest_vmag = Some(9.0);
        let simulator = Simulator::new(&scenario, &scene, indexed.stars())?;
        let pointing = Pointing {
            icrs_to_camera: truth,
            places: StarPlaces::default(),
        };
        let seed = plan.seed * 1_000_000 + number;
        let frame = if plan.is_dark(number) {
            simulator.dark(seed)?
        } else {
            simulator.frame(&pointing, seed)?.0
        };
        let start = Instant::now();
        let track = tracker.process_frame(&frame, Some(time_s))?;
        let time_us = start.elapsed().as_secs_f64() * 1e6;
        tally.add(&track, &truth, rate_deg_s.map(f64::to_radians), before);
        before = track.mode;
        if track.mode == Mode::Tracked {
            tally.times_us.push(time_us);
            if number % COMPARED_EVERY == 0
                && let Some((attitude, (camera, _))) = track.attitude.zip(track.camera)
            {
                let at = (&camera, &attitude.icrs_to_camera);
                if let Some(other) = full.attitude(&frame, &tracker, at) {
                    tally.compared += 1;
                    for (sum, found) in tally
                        .squares
                        .iter_mut()
                        .zip([attitude.icrs_to_camera, other])
                    {
                        *sum += turn_between(&truth, &found).map(|off| off * off);
                    }
                }
            }
        } else if let Some(loss) = &track.loss
            && tally.acquired + tally.lost < 40
        {
            eprintln!("frame {number}: {:?}, {loss:?}", track.mode);
        }
    }
    tally.print(plan.frames);
    Ok(())
}
