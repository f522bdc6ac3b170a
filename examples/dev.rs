#![allow(missing_docs, clippy::all)]
use starpipe::catalog::*;
use starpipe::coords::*;
use starpipe::identify::*;
use std::time::Instant;

fn main() {
    let c = Catalog::built_in();
    let s = c.stars();
    let t = Instant::now();
    let (sky, _) = Sky::open(c, std::path::Path::new("/tmp/w/cache"), &|_| ());
    eprintln!("build {:?} {}", t.elapsed(), sky.triangles.len());
    // files: x,y,sigma,mag lines with first line "w h [V] [scale]"
    for f in std::env::args().skip(1) {
        let txt = std::fs::read_to_string(&f).unwrap();
        let mut l = txt.lines();
        let h: Vec<&str> = l.next().unwrap().split_whitespace().collect();
        let stars = l
            .map(|l| {
                let v: Vec<f64> = l.split_whitespace().map(|x| x.parse().unwrap()).collect();
                ObservedStar {
                    position: PixelPoint::new(v[0], v[1]),
                    sigma_px: v[2],
                    mag: v[3],
                }
            })
            .collect::<Vec<_>>();
        let field = StarField {
            width_px: h[0].parse().unwrap(),
            height_px: h[1].parse().unwrap(),
            years_since_j2000: 0.0,
            photometry: if h[2] == "V" {
                Photometry::JohnsonV
            } else {
                Photometry::Instrumental
            },
            stars,
        };
        let mut hints = Hints::default();
        if let Some(x) = h.get(3) {
            let a: f64 = x.parse().unwrap();
            let e: f64 = h.get(4).map_or(1.1, |v| v.parse().unwrap());
            hints.pixel_scale_rad = Some((a / e / 206264.8, a * e / 206264.8));
        }
        let mut o = None;
        let mut best = 1e9;
        for _ in 0..3 {
            let t = Instant::now();
            o = Some(identify(&field, &hints, &sky));
            best = f64::min(best, t.elapsed().as_secs_f64() * 1e3);
        }
        match o.unwrap() {
            Outcome::Identified(i) => {
                let (b, up) = i.icrs_to_camera.boresight_and_up();
                let (ra, de) = b.to_ra_dec();
                println!(
                    "{} {:.2}ms n={} matched={} ra {:.4} dec {:.4} up {:.2} fov {:.3} {:.3} mir {} rms {:.3}px {:.2}\" fa {:.1} dist {:?} sig {:?}",
                    f.rsplit('/').next().unwrap(),
                    best,
                    field.stars.len(),
                    i.matches.len(),
                    ra.to_degrees(),
                    de.to_degrees(),
                    up.to_degrees(),
                    i.camera.fov_x_rad().to_degrees(),
                    i.camera.fov_y_rad().to_degrees(),
                    i.camera.mirrored,
                    i.rms_px,
                    i.rms_px / i.camera.focal_length_px * 206265.,
                    i.log10_false_alarm,
                    i.camera
                        .distortion
                        .as_ref()
                        .map(|d| (d.model(), d.largest_px())),
                    i.attitude_sigma_rad.map(|s| s * 206265.)
                );
                if std::env::var("SHOW").is_ok() {
                    for m in i.matches.iter().take(8) {
                        let (a, d) = s[m.catalog].direction.to_ra_dec();
                        let p = &field.stars[m.observed].position;
                        println!(
                            "  {:.1} {:.1} ra {:.3} dec {:.3} V {}",
                            p.x,
                            p.y,
                            a.to_degrees(),
                            d.to_degrees(),
                            s[m.catalog].v_mag
                        );
                    }
                }
                if h[2] == "V" {
                    println!(
                        "{:?}",
                        i.matches
                            .iter()
                            .map(|m| s[m.catalog].id.0)
                            .collect::<Vec<_>>()
                    );
                }
            }
            Outcome::NotIdentified(r) => {
                println!("{} {:.2}ms n={} {:?}", f, best, field.stars.len(), r)
            }
        }
    }
}
