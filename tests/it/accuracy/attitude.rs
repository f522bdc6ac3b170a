//! Attitudes of simulated frames, and their stated errors.

use super::stars::{data_sheet, equivalent_area_px};
use super::tally::Spread;
use crate::common::cache_dir;
use nalgebra::Vector3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use starpipe::base::coords::{Rotation, UnitVector};
use starpipe::base::statistics::median;
use starpipe::catalog::Catalog;
use starpipe::ephemeris::places::StarPlaces;
use starpipe::identify::IndexedCatalog;
use starpipe::lab::simulate::{Pointing, Scene, Simulator, TrueStar, Truth};
use starpipe::predict::{Budget, Scenario, SkyBrightness};
use starpipe::solve::{Context, Workspace, solve_frame};
use std::f64::consts::{PI, TAU};

/// Approximate threshold of the detector in standard deviations.
const THRESHOLD: f64 = 5.2;

/// A camera with a field of this width in degrees, an aperture for stars of `limit_vmag`, and a
/// sky.
struct Kind {
    name: &'static str,
    side_px: usize,
    fov_deg: f64,
    spot_sigma_px: f64,
    limit_vmag: f64,
    sky_mag_arcsec2: f64,
    exposure_s: f64,
    /// Third and fifth order of the lens, in pixels in the corner.
    distortion_px: [f64; 2],
}

impl Kind {
    fn scenario(&self) -> Scenario {
        let mut sheet = data_sheet(self.side_px, self.spot_sigma_px);
        sheet.read_noise_e = 7.0;
        sheet.gain_e_per_adu = 2.0;
        sheet.bits = 12;
        sheet.full_well_e = 10_000.0;
        [
            sheet.imperfections.distortion_px,
            sheet.imperfections.distortion5_px,
        ] = self.distortion_px;
        let half_rad = self.fov_deg.to_radians() / 2.0;
        sheet.focal_length_mm = self.side_px as f64 / 2.0 / half_rad.tan() * sheet.pitch_x_um / 1e3;
        let mut scenario = Scenario::new(sheet);
        scenario.conditions.exposure_s = self.exposure_s;
        scenario.conditions.sky = SkyBrightness::MagArcsec2(self.sky_mag_arcsec2);
        let (mut low, mut high) = (0.1, 1e4);
        for _ in 0..60 {
            scenario.camera.aperture_mm = f64::sqrt(low * high);
            let budget = Budget::new(&scenario);
            let faintest_e = THRESHOLD
                * budget.background_noise_e
                * equivalent_area_px(self.spot_sigma_px).sqrt();
            if budget.vmag_of(faintest_e, self.exposure_s) > self.limit_vmag {
                high = scenario.camera.aperture_mm;
            } else {
                low = scenario.camera.aperture_mm;
            }
        }
        scenario
    }
}

/// Fainter centroids are excluded: their stars are detected where noise made them brighter.
const MIN_SNR: f64 = 10.0;

/// Whether no other star affects the centroid of this one.
fn is_isolated(star: &TrueStar, truth: &Truth) -> bool {
    const REACH_PX: f64 = 6.0;
    const MIN_SHARE: f64 = 0.005;
    let disturbs = |other: &TrueStar| {
        other.number != star.number
            && other.position.distance_to(&star.position) < REACH_PX
            && other.electrons > MIN_SHARE * star.electrons
    };
    !truth.stars.iter().chain(&truth.beyond).any(disturbs)
}

/// Result of one frame.
struct Trial {
    /// Error over stated error about x, y and the boresight.
    pulls: [f64; 3],
    nees: f64,
    matches: usize,
    distorted: bool,
    sigma_arcsec: [f64; 3],
    centroid_pulls: Vec<[f64; 3]>,
}

fn trial(
    context: &Context,
    scenario: &Scenario,
    workspace: &mut Workspace,
    seed: u64,
) -> Option<Trial> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let boresight = UnitVector::from_ra_dec(
        random.random_range(0.0..TAU),
        random.random_range(-1.0..1.0f64).asin(),
    );
    let pointing = Pointing {
        icrs_to_camera: Rotation::looking_at(&boresight, random.random_range(-PI..PI)),
        places: StarPlaces::default(),
    };
    let stars = context.indexed.catalog().stars();
    let simulator = Simulator::new(scenario, &Scene::default(), stars).unwrap();
    let (frame, truth) = simulator.frame(&pointing, random.random()).unwrap();
    let solution = solve_frame(&frame, context, workspace).unwrap();
    let found = solution.outcome.identification()?;
    let error = found.icrs_to_camera.matrix() * pointing.icrs_to_camera.matrix().transpose();
    let turn = Vector3::new(error[(2, 1)], error[(0, 2)], error[(1, 0)]);
    let sigma_rad = found.attitude_sigma_rad();
    let gain = scenario.camera.gain_e_per_adu;
    let of_star = |m: &starpipe::identify::StarMatch| {
        let source = solution.source(m.source);
        let measured = source.measured?;
        let star = truth
            .stars
            .iter()
            .find(|star| star.catalog == Some(m.star))?;
        let flux = source.flux?;
        let is_measured = measured.snr >= MIN_SNR && !measured.flags.saturated;
        if !is_measured || !is_isolated(star, &truth) {
            return None;
        }
        Some([
            (source.position.x - star.position.x) / measured.sigma_px[0],
            (source.position.y - star.position.y) / measured.sigma_px[1],
            (flux - star.electrons / gain) / (flux / measured.snr),
        ])
    };
    Some(Trial {
        pulls: std::array::from_fn(|axis| turn[axis] / sigma_rad[axis]),
        nees: turn.dot(&(found.attitude_covariance_rad2.try_inverse().unwrap() * turn)),
        matches: found.matches.len(),
        distorted: found.camera.distortion().is_some(),
        sigma_arcsec: sigma_rad.map(|s| s.to_degrees() * 3600.0),
        centroid_pulls: found.matches.iter().filter_map(of_star).collect(),
    })
}

fn kinds() -> Vec<Kind> {
    let common = Kind {
        name: "12 deg, 0.8 px, V 7",
        side_px: 1024,
        fov_deg: 12.0,
        spot_sigma_px: 0.8,
        limit_vmag: 7.0,
        sky_mag_arcsec2: 21.0,
        exposure_s: 0.1,
        distortion_px: [0.0; 2],
    };
    vec![
        Kind { ..common },
        Kind {
            name: "12 deg, 0.5 px",
            spot_sigma_px: 0.5,
            ..common
        },
        Kind {
            name: "12 deg, 1.5 px",
            spot_sigma_px: 1.5,
            ..common
        },
        Kind {
            name: "20 deg, V 6",
            fov_deg: 20.0,
            limit_vmag: 6.0,
            ..common
        },
        Kind {
            name: "8 deg, V 8, 1 s",
            fov_deg: 8.0,
            limit_vmag: 8.0,
            exposure_s: 1.0,
            ..common
        },
        Kind {
            name: "12 deg, sky 17, 1 s",
            sky_mag_arcsec2: 17.0,
            exposure_s: 1.0,
            ..common
        },
        Kind {
            name: "8 deg, r³ 1 px",
            fov_deg: 8.0,
            limit_vmag: 8.0,
            exposure_s: 1.0,
            distortion_px: [1.0, 0.0],
            ..common
        },
        Kind {
            name: "12 deg, r³ 3, r⁵ -1 px",
            distortion_px: [3.0, -1.0],
            ..common
        },
    ]
}

fn with_context<T>(run: impl FnOnce(&Context) -> T) -> T {
    let indexed = IndexedCatalog::open(Catalog::built_in(), Some(&cache_dir()), &|_| {});
    run(&Context::new(&indexed))
}

/// Statistics of many frames.
#[derive(Default)]
struct Summary {
    nees: Spread,
    pulls: [Spread; 3],
    centroids: [Spread; 3],
    matches: Spread,
    distorted: usize,
    sigma_arcsec: [Vec<f64>; 3],
}

fn summary(context: &Context, kind: &Kind, frames: u64) -> Summary {
    let scenario = kind.scenario();
    let run = |workspace: &mut Workspace, seed| trial(context, &scenario, workspace, seed);
    let trials: Vec<_> = (0..frames)
        .into_par_iter()
        .map_init(Workspace::new, run)
        .collect();
    let mut summary = Summary::default();
    for trial in trials.into_iter().flatten() {
        summary.nees.add(trial.nees);
        summary.matches.add(trial.matches as f64);
        summary.distorted += usize::from(trial.distorted);
        for axis in 0..3 {
            summary.pulls[axis].add(trial.pulls[axis]);
            summary.sigma_arcsec[axis].push(trial.sigma_arcsec[axis]);
            trial
                .centroid_pulls
                .iter()
                .for_each(|pulls| summary.centroids[axis].add(pulls[axis]));
        }
    }
    summary
}

#[test]
#[ignore = "a quarter of an hour of frames; prints the table"]
fn table_of_attitudes() {
    with_context(|context| print_table(context, 5000));
}

#[test]
#[ignore = "minutes of frames; prints the table"]
fn table_of_attitudes_from_the_brightest_stars() {
    with_context(|context| {
        let mut context = context.clone();
        context.attitude_only = true;
        print_table(&context, 1000);
    });
}

fn print_table(context: &Context, frames: u64) {
    println!(
        "frames  identified  stars  distorted  NEES ±  pulls x, y, roll ±  median sigma arcsec  pulls of centroids x, y and of flux"
    );
    for kind in kinds() {
        let mut s = summary(context, &kind, frames);
        let [x, y, roll] = s.pulls.map(|pull| pull.sigma());
        let [sx, sy, sr] = s.sigma_arcsec.each_mut().map(|all| median(all));
        let [cx, cy, cf] = s.centroids.map(|pull| pull.sigma());
        println!(
            "{:<20} {frames} {} {:.0} {}  {:.3} ± {:.3}  {x:.3} {y:.3} {roll:.3} ± {:.3}  {sx:.2} {sy:.2} {sr:.2}  {cx:.3} {cy:.3} {cf:.3}",
            kind.name,
            s.nees.count,
            s.matches.mean(),
            s.distorted,
            s.nees.mean(),
            s.nees.mean_error(),
            s.pulls[0].sigma_error()
        );
    }
}

#[test]
fn attitude_errors_match_their_stated_errors() {
    with_context(|context| assert_errors_are_as_stated(context, &kinds()[0]));
}

#[test]
fn so_do_those_from_the_brightest_stars_alone_also_with_a_lens_that_distorts() {
    with_context(|context| {
        let mut context = context.clone();
        context.attitude_only = true;
        for kind in [0, kinds().len() - 2] {
            assert_errors_are_as_stated(&context, &kinds()[kind]);
        }
    });
}

fn assert_errors_are_as_stated(context: &Context, kind: &Kind) {
    const FRAMES: u64 = 120;
    const NEES: f64 = 3.0;
    const NEES_TOLERANCE: f64 = 0.1;
    const PULL_TOLERANCE: f64 = 0.05;
    /// Seeds are fixed, so the result is reproducible.
    const SIGMAS: f64 = 3.0;
    let s = summary(context, kind, FRAMES);
    assert_eq!(s.nees.count, FRAMES as f64);
    // NEES is distributed as χ² with three degrees of freedom, whose variance is six.
    let tolerance = NEES_TOLERANCE + SIGMAS * (6.0 / FRAMES as f64).sqrt();
    assert!(
        (s.nees.mean() - NEES).abs() < tolerance,
        "{}",
        s.nees.mean()
    );
    for pull in s.pulls.iter().chain(&s.centroids) {
        let tolerance = PULL_TOLERANCE + SIGMAS * pull.sigma_error();
        assert!((pull.sigma() - 1.0).abs() < tolerance, "{pull:?}");
    }
}
