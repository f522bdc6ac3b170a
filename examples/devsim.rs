#![allow(missing_docs, clippy::all)]
use rand::prelude::*;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use starpipe::camera::*;
use starpipe::catalog::*;
use starpipe::coords::*;
use starpipe::identify::*;
use std::time::Instant;
fn main() {
    let s = Catalog::built_in().stars();
    let (sky, _) = Sky::open(
        Catalog::built_in(),
        std::path::Path::new("/tmp/w/cache"),
        &|_| (),
    );
    let n: usize = std::env::args().nth(1).map_or(200, |v| v.parse().unwrap());
    let get = |k: &str, d: f64| std::env::var(k).ok().map_or(d, |v| v.parse().unwrap());
    let (spos, smag, miss, nfalse, k1, nst) = (
        get("POS", 0.2),
        get("MAG", 0.3),
        get("MISS", 0.1),
        get("FALSE", 3.0),
        get("K1", 0.0),
        get("NST", 25.0),
    );
    println!("triangles {}", sky.triangles.len());
    for fov in [1.5, 2.0, 3.0, 5.0, 8.0, 12.0, 20.0, 30.0, 45.0, 60.0f64] {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let (mut ok, mut bad, mut none) = (0, 0, 0);
        let mut ts = vec![];
        let mut tn = vec![];
        let mut cnt = 0;
        let mut few = 0;
        for _ in 0..n {
            let (w, h) = (1024.0, 768.0);
            let z: f64 = rng.random_range(-1.0..1.0);
            let c = UnitVector::from_ra_dec(rng.random_range(0.0..6.283), z.asin());
            let att = Rotation::looking_at(&c, rng.random_range(-3.1..3.1));
            let mir = rng.random_bool(0.5);
            let mut cam = CameraModel::pinhole(w, h, focal_length_px(w, fov.to_radians()), mir);
            if k1 != 0.0 {
                cam.distortion = Some(Distortion::new(
                    DistortionModel::Radial,
                    640.0,
                    vec![k1 * 640.0],
                ));
            }
            let area = fov * fov * 0.75;
            let lim = sky.magnitude_of_density(nst / area).min(9.5) + 0.0 * smag;
            let mut v = vec![];
            sky.grid
                .for_each_within(&c, cam.radius_rad() * 1.05, lim as f32 + 1.5, |g| {
                    if let Some(p) = cam.pixel_of(&att.apply(&s[g.catalog as usize].direction)) {
                        let m = g.v_mag as f64 + smag * rng.sample::<f64, _>(StandardNormal);
                        if cam.contains(&p) && m < lim && !rng.random_bool(miss) {
                            v.push(ObservedStar {
                                position: PixelPoint::new(
                                    p.x + spos * rng.sample::<f64, _>(StandardNormal),
                                    p.y + spos * rng.sample::<f64, _>(StandardNormal),
                                ),
                                sigma_px: spos,
                                mag: m - 20.0,
                            });
                        }
                    }
                });
            for _ in 0..nfalse as usize {
                v.push(ObservedStar {
                    position: PixelPoint::new(rng.random_range(0.0..w), rng.random_range(0.0..h)),
                    sigma_px: spos,
                    mag: lim - 20.0 - rng.random_range(0.0..3.0),
                });
            }
            v.sort_by(|a, b| a.mag.total_cmp(&b.mag));
            cnt += v.len();
            if v.len() < 7 + nfalse as usize {
                few += 1;
            }
            let field = StarField {
                width_px: w,
                height_px: h,
                photometry: Photometry::Instrumental,
                years_since_j2000: 0.0,
                stars: v,
            };
            let t = Instant::now();
            let o = identify(&field, &Hints::default(), &sky);
            let dt = t.elapsed().as_secs_f64() * 1e3;
            match o {
                Outcome::Identified(i) => {
                    ts.push(dt);
                    let b = i.icrs_to_camera.boresight_and_up().0;
                    if b.angle_to(&c).to_degrees() < 0.02 * fov
                        && (i.camera.fov_x_rad().to_degrees() / fov - 1.0).abs()
                            < 0.02 + k1.abs() * 2.
                    {
                        ok += 1
                    } else {
                        bad += 1;
                        println!(
                            "WRONG fa {} fov {} err {}",
                            i.log10_false_alarm,
                            i.camera.fov_x_rad().to_degrees(),
                            b.angle_to(&c).to_degrees()
                        );
                    }
                }
                _ => {
                    tn.push(dt);
                    none += 1
                }
            }
        }
        ts.sort_by(f64::total_cmp);
        tn.sort_by(f64::total_cmp);
        let q = |t: &Vec<f64>, f: f64| {
            if t.is_empty() {
                0.
            } else {
                t[((t.len() - 1) as f64 * f) as usize]
            }
        };
        println!(
            "fov {fov:5} stars {:.1} (<7: {few}) ok {ok} wrong {bad} none {none}  ms median {:.2} 90% {:.2} 99% {:.2} ; none median {:.0} max {:.0}",
            cnt as f64 / n as f64,
            q(&ts, 0.5),
            q(&ts, 0.9),
            q(&ts, 0.99),
            q(&tn, 0.5),
            q(&tn, 1.0)
        );
    }
}
