//! Frames of the sky drawn independently of the library: the bright stars of the catalogue's CSV,
//! the gnomonic projection by its textbook formula (Calabretta & Greisen 2002, A&A 395, 1077, eq.
//! 54), Gaussian spots.

use image::{ImageBuffer, Luma};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use std::path::Path;

pub type Picture = ImageBuffer<Luma<u16>, Vec<u16>>;

const LEVEL_ADU: f64 = 1000.0;
const NOISE_ADU: f64 = 8.0;
/// Flux of a star of magnitude 0.
const ZERO_MAG_ADU: f64 = 2e6;
const SPOT_SIGMA_PX: f64 = 1.2;
const FULL_SCALE_ADU: f64 = 65_535.0;

/// A star on the sky, in degrees.
#[derive(Debug, Clone, Copy)]
pub struct SkyStar {
    pub ra_deg: f64,
    pub dec_deg: f64,
    pub v_mag: f64,
}

/// The stars to V 6.5, at J2000.
pub fn bright_stars() -> Vec<SkyStar> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/catalogs/sky2000-bright.csv");
    let mut reader = csv::Reader::from_path(path).unwrap();
    let headings = reader.headers().unwrap().clone();
    let column = |name: &str| headings.iter().position(|heading| heading == name).unwrap();
    let columns = ["RAh", "RAm", "RAs", "DEd", "DEm", "DEs"].map(column);
    let (sign, observed, derived) = (column("DE-"), column("Vmag"), column("Vder"));
    let star = |row: csv::StringRecord| {
        let [h, m, s, d, dm, ds] = columns.map(|c| row[c].trim().parse::<f64>().unwrap());
        let dec_deg = d + dm / 60.0 + ds / 3600.0;
        let v_mag = row[observed].trim().parse().ok();
        SkyStar {
            ra_deg: (h + m / 60.0 + s / 3600.0) * 15.0,
            dec_deg: if &row[sign] == "-" { -dec_deg } else { dec_deg },
            v_mag: v_mag.unwrap_or_else(|| row[derived].trim().parse().unwrap()),
        }
    };
    reader.records().map(|row| star(row.unwrap())).collect()
}

/// Pointing and field of a camera.
#[derive(Debug, Clone, Copy)]
pub struct View {
    pub ra_deg: f64,
    pub dec_deg: f64,
    /// Position angle of image-up, from north through east.
    pub up_pa_deg: f64,
    /// Horizontal field of view.
    pub fov_deg: f64,
    pub width: u32,
    pub height: u32,
    pub mirrored: bool,
}

impl View {
    fn focal_px(&self) -> f64 {
        f64::from(self.width) / 2.0 / (self.fov_deg.to_radians() / 2.0).tan()
    }

    fn centre(&self) -> (f64, f64) {
        (
            (f64::from(self.width) - 1.0) / 2.0,
            (f64::from(self.height) - 1.0) / 2.0,
        )
    }

    /// The pixel of a direction in degrees, (0, 0) at the centre of the first one; `None` behind
    /// the camera.
    pub fn pixel(&self, ra_deg: f64, dec_deg: f64) -> Option<(f64, f64)> {
        let (sin_d, cos_d) = dec_deg.to_radians().sin_cos();
        let (sin_0, cos_0) = self.dec_deg.to_radians().sin_cos();
        let (sin_a, cos_a) = (ra_deg - self.ra_deg).to_radians().sin_cos();
        let depth = sin_0 * sin_d + cos_0 * cos_d * cos_a;
        if depth <= 0.0 {
            return None;
        }
        let east = cos_d * sin_a / depth;
        let north = (cos_0 * sin_d - sin_0 * cos_d * cos_a) / depth;
        let (sin_p, cos_p) = self.up_pa_deg.to_radians().sin_cos();
        // East is to the left of north, as the sky is seen from inside.
        let right = -east * cos_p + north * sin_p;
        let up = east * sin_p + north * cos_p;
        let (cx, cy) = self.centre();
        let x = cx + self.focal_px() * right;
        let y = cy - self.focal_px() * up;
        Some((if self.mirrored { 2.0 * cx - x } else { x }, y))
    }

    /// The direction in degrees of a pixel: the inverse, by vectors.
    pub fn direction(&self, x: f64, y: f64) -> (f64, f64) {
        let (cx, cy) = self.centre();
        let right = if self.mirrored { cx - x } else { x - cx };
        let camera = [right, y - cy, self.focal_px()];
        let axes = self.axes();
        let v: [f64; 3] = std::array::from_fn(|i| (0..3).map(|k| camera[k] * axes[k][i]).sum());
        let ra_deg = v[1].atan2(v[0]).to_degrees().rem_euclid(360.0);
        (ra_deg, v[2].atan2(v[0].hypot(v[1])).to_degrees())
    }

    /// The camera's axes (right, down, out) as vectors on the sky, the image not mirrored.
    pub fn axes(&self) -> [[f64; 3]; 3] {
        let (sin_a, cos_a) = self.ra_deg.to_radians().sin_cos();
        let (sin_d, cos_d) = self.dec_deg.to_radians().sin_cos();
        let (sin_p, cos_p) = self.up_pa_deg.to_radians().sin_cos();
        let east = [-sin_a, cos_a, 0.0];
        let north = [-sin_d * cos_a, -sin_d * sin_a, cos_d];
        let mix = |e: f64, n: f64| std::array::from_fn(|i| e * east[i] + n * north[i]);
        [
            mix(-cos_p, sin_p),
            mix(-sin_p, -cos_p),
            [cos_d * cos_a, cos_d * sin_a, sin_d],
        ]
    }

    /// The stars on the frame, with their pixels.
    pub fn stars(&self, sky: &[SkyStar]) -> Vec<(SkyStar, f64, f64)> {
        let inside = |x: f64, y: f64| {
            (-0.5..f64::from(self.width) - 0.5).contains(&x)
                && (-0.5..f64::from(self.height) - 0.5).contains(&y)
        };
        sky.iter()
            .filter_map(|star| {
                let (x, y) = self.pixel(star.ra_deg, star.dec_deg)?;
                inside(x, y).then_some((*star, x, y))
            })
            .collect()
    }

    /// The frame as a camera would take it.
    pub fn picture(&self, sky: &[SkyStar]) -> Picture {
        let mut canvas = Canvas::new(self.width, self.height);
        for (star, x, y) in self.stars(sky) {
            canvas.spot(x, y, flux_adu(star.v_mag));
        }
        canvas.develop(1)
    }
}

pub fn flux_adu(v_mag: f64) -> f64 {
    ZERO_MAG_ADU * 10_f64.powf(-0.4 * v_mag)
}

/// Expected light before readout.
pub struct Canvas {
    width: u32,
    height: u32,
    light: Vec<f64>,
}

impl Canvas {
    pub fn new(width: u32, height: u32) -> Self {
        Self {
            width,
            height,
            light: vec![LEVEL_ADU; (width * height) as usize],
        }
    }

    /// Adds a Gaussian spot, integrated over 5 × 5 points a pixel.
    pub fn spot(&mut self, x: f64, y: f64, flux: f64) {
        let around = |at: f64, side: u32| {
            let (low, high) = (at.round() as i64 - 8, at.round() as i64 + 9);
            low.max(0)..high.min(i64::from(side))
        };
        let share = |offset: f64| {
            let density = |step: i32| {
                let t = (offset + f64::from(step) / 5.0) / SPOT_SIGMA_PX;
                (-t * t / 2.0).exp() / (SPOT_SIGMA_PX * std::f64::consts::TAU.sqrt())
            };
            (-2..=2).map(density).sum::<f64>() / 5.0
        };
        for row in around(y, self.height) {
            for column in around(x, self.width) {
                let place = row as usize * self.width as usize + column as usize;
                self.light[place] += flux * share(column as f64 - x) * share(row as f64 - y);
            }
        }
    }

    /// Adds a trail from a place to another.
    pub fn trail(&mut self, from: (f64, f64), to: (f64, f64), flux: f64) {
        let length = (to.0 - from.0).hypot(to.1 - from.1);
        let steps = (length * 2.0).ceil().max(1.0) as i32;
        for step in 0..=steps {
            let t = f64::from(step) / f64::from(steps);
            let at = (from.0 + t * (to.0 - from.0), from.1 + t * (to.1 - from.1));
            self.spot(at.0, at.1, flux / f64::from(steps + 1));
        }
    }

    /// The frame with noise.
    pub fn develop(&self, seed: u64) -> Picture {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let normal = Normal::new(0.0, NOISE_ADU).unwrap();
        let levels = self.light.iter().map(|light| {
            let level = light + normal.sample(&mut random);
            level.round().clamp(0.0, FULL_SCALE_ADU) as u16
        });
        Picture::from_raw(self.width, self.height, levels.collect()).unwrap()
    }
}

/// Saves a picture and returns its path.
pub fn save(picture: &Picture, directory: &Path, name: &str) -> std::path::PathBuf {
    let path = directory.join(name);
    picture.save(&path).unwrap();
    path
}
