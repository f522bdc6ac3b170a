//! Attitudes of frames of the sky, and what is stated of their errors.

use crate::stars::{equivalent_area_px, sensor};
use crate::tally::Spread;
use nalgebra::Vector3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use starpipe::catalog::Catalog;
use starpipe::coords::{Rotation, UnitVector};
use starpipe::detect::Workspace;
use starpipe::identify::{Outcome, Sky};
use starpipe::pipeline::{Pipeline, SolveConfig};
use starpipe::sensitivity::{Budget, Scenario, SkyBrightness};
use starpipe::simulate::{Pointing, frame_of_sky, square_pixel_camera};
use std::f64::consts::{PI, TAU};

/// The threshold of the detector in standard deviations, about.
const THRESHOLD: f64 = 5.2;

/// A camera with a field of so many degrees, an aperture that shows stars of `limit_vmag`, under a sky.
struct Kind {
    name: &'static str,
    side_px: usize,
    fov_deg: f64,
    spot_sigma_px: f64,
    limit_vmag: f64,
    sky_mag_arcsec2: f64,
    exposure_s: f64,
}

impl Kind {
    fn scenario(&self) -> Scenario {
        let mut sensor = sensor(self.side_px, self.spot_sigma_px);
        sensor.read_noise_e = 7.0;
        sensor.gain_e_per_adu = 2.0;
        sensor.bits = 12;
        sensor.full_well_e = 10_000.0;
        let half_rad = self.fov_deg.to_radians() / 2.0;
        sensor.focal_length_mm =
            self.side_px as f64 / 2.0 / half_rad.tan() * sensor.pitch_x_um / 1e3;
        let mut scenario = Scenario::new(sensor);
        scenario.conditions.exposure_s = self.exposure_s;
        scenario.conditions.sky = SkyBrightness::MagArcsec2(self.sky_mag_arcsec2);
        let (mut low, mut high) = (0.1, 1e4);
        for _ in 0..60 {
            scenario.sensor.aperture_mm = f64::sqrt(low * high);
            let budget = Budget::new(&scenario);
            let faintest_e = THRESHOLD
                * budget.background_noise_e
                * equivalent_area_px(self.spot_sigma_px).sqrt();
            if budget.vmag_of(faintest_e, self.exposure_s) > self.limit_vmag {
                high = scenario.sensor.aperture_mm;
            } else {
                low = scenario.sensor.aperture_mm;
            }
        }
        scenario
    }
}

/// What came of one frame.
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
    pipeline: &Pipeline<'static>,
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
        camera: square_pixel_camera(&scenario.sensor),
        icrs_to_camera: Rotation::looking_at(&boresight, random.random_range(-PI..PI)),
        years_since_j2000: 0.0,
    };
    let (frame, truth) = frame_of_sky(
        scenario,
        &pointing,
        drawn(pipeline.catalog()),
        random.random(),
    )
    .unwrap();
    let solution = pipeline
        .solve_frame(
            &frame,
            &SolveConfig {
                detect: starpipe::detect::DetectConfig {
                    spot_sigma_px: std::env::var("SPOT")
                        .ok()
                        .map(|_| scenario.sensor.spot_sigma_px),
                    ..Default::default()
                },
                ..SolveConfig::default()
            },
            workspace,
        )
        .unwrap();
    let Outcome::Identified(found) = &solution.outcome else {
        return None;
    };
    let error = found.icrs_to_camera.matrix() * pointing.icrs_to_camera.matrix().transpose();
    let turn = Vector3::new(error[(2, 1)], error[(0, 2)], error[(1, 0)]);
    let sigma_rad = found.attitude_sigma_rad();
    let gain = scenario.sensor.gain_e_per_adu;
    let of_star = |m: &starpipe::identify::StarMatch| {
        let source = &solution.sources[m.observed];
        let measured = source.measured?;
        let star = truth.stars.iter().find(|star| star.catalog == m.catalog)?;
        let flux = source.flux?;
        if std::env::var("ISO").is_ok()
            && truth.stars.iter().chain(&truth.beyond).any(|other| {
                other.catalog != star.catalog
                    && other.position.distance_to(&star.position) < 6.0
                    && other.electrons > 0.005 * star.electrons
            })
        {
            return None;
        }
        let hi: f64 = std::env::var("HI").map_or(1e9, |v| v.parse().unwrap());
        let lo: f64 = std::env::var("LO").map_or(10.0, |v| v.parse().unwrap());
        if measured.snr > hi || measured.snr < lo {
            return None;
        }
        if measured.snr < 10.0 || measured.flags.saturated {
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
        distorted: found.camera.distortion.is_some(),
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
    ]
}

fn with_pipeline<T>(run: impl FnOnce(&Pipeline<'static>) -> T) -> T {
    let cache = std::env::var_os("STARPIPE_CACHE_DIR").map_or_else(
        || std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("cache"),
        Into::into,
    );
    let (sky, _) = Sky::open(Catalog::built_in(), &cache, &|_| {});
    run(&Pipeline::new(sky))
}

#[test]
#[ignore = "minutes of frames; prints the table"]
fn table_of_attitudes() {
    let frames: u64 = std::env::var("FRAMES").map_or(5000, |f| f.parse().unwrap());
    let only = std::env::var("KIND").ok();
    with_pipeline(|pipeline| {
        for kind in kinds() {
            if only
                .as_ref()
                .is_some_and(|only| !kind.name.contains(only.as_str()))
            {
                continue;
            }
            let scenario = kind.scenario();
            let trials: Vec<Option<Trial>> = (0..frames)
                .into_par_iter()
                .map_init(Workspace::new, |workspace, seed| {
                    trial(pipeline, &scenario, workspace, seed)
                })
                .collect();
            let found: Vec<_> = trials.iter().flatten().collect();
            let (mut nees, mut pulls, mut centroid) = (
                Spread::default(),
                [Spread::default(); 3],
                [Spread::default(); 3],
            );
            let mut far = 0;
            let mut plain = Spread::default();
            for t in &found {
                if t.nees > 30.0 {
                    far += 1;
                }
                nees.add(t.nees);
                if !t.distorted {
                    plain.add(t.nees);
                }
                (0..3).for_each(|i| pulls[i].add(t.pulls[i]));
                for p in &t.centroid_pulls {
                    (0..3).for_each(|i| {
                        if p[i].abs() < 8.0 {
                            centroid[i].add(p[i])
                        }
                    });
                }
            }
            let matches =
                found.iter().map(|t| t.matches).sum::<usize>() as f64 / found.len() as f64;
            let distorted = found.iter().filter(|t| t.distorted).count();
            let sig = |i: usize| {
                let mut v: Vec<f64> = found.iter().map(|t| t.sigma_arcsec[i]).collect();
                starpipe::statistics::median(&mut v)
            };
            println!(
                "{:<22} D {:.1} mm frames {} identified {} stars {:.0} distorted {}  NEES {:.3} ± {:.3} (undistorted {:.3}; {} > 30)  pulls {:.3} {:.3} {:.3} ± {:.3}  sigma {:.2} {:.2} {:.2}  centroid pulls {:.3} {:.3} {:.3} (n {})",
                kind.name,
                scenario.sensor.aperture_mm,
                frames,
                found.len(),
                matches,
                distorted,
                nees.mean(),
                nees.mean_error(),
                plain.mean(),
                far,
                pulls[0].sigma(),
                pulls[1].sigma(),
                pulls[2].sigma(),
                pulls[0].sigma_error(),
                sig(0),
                sig(1),
                sig(2),
                centroid[0].sigma(),
                centroid[1].sigma(),
                centroid[2].sigma(),
                centroid[0].count
            );
        }
    });
}

fn drawn(catalog: &'static Catalog) -> &'static [starpipe::catalog::Star] {
    static CELL: std::sync::OnceLock<Vec<starpipe::catalog::Star>> = std::sync::OnceLock::new();
    if std::env::var("NOCLOSE").is_err() {
        return catalog.stars();
    }
    CELL.get_or_init(|| {
        let reach: f64 = std::env::var("NOCLOSE")
            .unwrap()
            .parse::<f64>()
            .unwrap()
            .to_radians();
        let size = 2.0 / 400.0;
        let cell = |v: &Vector3<f64>| [v.x, v.y, v.z].map(|c| (c / size).floor() as i32);
        let mut grid: std::collections::HashMap<[i32; 3], Vec<usize>> = Default::default();
        let mut out = catalog.stars().to_vec();
        for (i, star) in catalog.stars().iter().enumerate() {
            let v = star.direction.as_vector();
            let c = cell(v);
            let mut close = false;
            for dx in -1..=1 {
                for dy in -1..=1 {
                    for dz in -1..=1 {
                        for &j in grid
                            .get(&[c[0] + dx, c[1] + dy, c[2] + dz])
                            .into_iter()
                            .flatten()
                        {
                            if catalog.stars()[j].direction.angle_to(&star.direction) < reach {
                                close = true;
                            }
                        }
                    }
                }
            }
            grid.entry(c).or_default().push(i);
            if close {
                out[i].v_mag = 25.0;
            }
        }
        eprintln!("dropped {}", out.iter().filter(|s| s.v_mag > 24.0).count());
        out
    })
}
