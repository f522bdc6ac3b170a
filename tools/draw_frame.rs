//! Draws a frame of the sky from the built-in catalogue: photo-electrons, integrated Gaussian
//! spots, sky, shot and read noise. The same arguments draw the same frame. For fixtures; studies
//! use `starpipe simulate`.
//!
//! `cargo run --example draw_frame -- OUT.png|OUT.tif RA DEC UP FOV WIDTH HEIGHT SEED`
//! (angles in degrees)
//!
//! A `.png` has 8 bits of 8 electrons each, a `.tif` 16 bits of 1 electron.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal, Poisson};
use starpipe::base::coords::{PixelPoint, Rotation, UnitVector};
use starpipe::base::units::RAD_PER_DEG;
use starpipe::camera::{CameraModel, focal_length_px};
use starpipe::catalog::Catalog;
use std::error::Error;
use std::fs::File;
use std::path::Path;
use tiff::encoder::colortype::Gray16;
use tiff::encoder::{Compression, DeflateLevel, Predictor, TiffEncoder};

/// Standard deviation of a spot before the pixels integrate it.
const SPOT_SIGMA_PX: f64 = 1.0;
/// Half the side of the square in which a spot is drawn, in pixels.
const SPOT_REACH_PX: i64 = 8;
/// Electrons from a star of magnitude 0.
const ZERO_MAG_E: f64 = 250e3;
const SKY_E: f64 = 100.0;
const READ_NOISE_E: f64 = 5.0;
/// Grey level without light, so that noise is not clipped at 0.
const OFFSET_ADU: f64 = 10.0;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [out, numbers @ ..] = arguments.as_slice() else {
        return Err("usage: draw_frame OUT.png|OUT.tif RA DEC UP FOV WIDTH HEIGHT SEED".into());
    };
    let numbers: Vec<f64> = numbers
        .iter()
        .map(|n| n.parse())
        .collect::<Result<_, _>>()?;
    let &[ra_deg, dec_deg, up_deg, fov_deg, width, height, seed] = numbers.as_slice() else {
        return Err("expected 7 numbers: RA DEC UP FOV WIDTH HEIGHT SEED".into());
    };
    let focal_px = focal_length_px(width, fov_deg * RAD_PER_DEG);
    let camera = CameraModel::pinhole(width, height, focal_px, false);
    let centre = UnitVector::from_ra_dec(ra_deg * RAD_PER_DEG, dec_deg * RAD_PER_DEG);
    let attitude = Rotation::looking_at(&centre, up_deg * RAD_PER_DEG);
    let is_png = Path::new(out).extension().is_some_and(|e| e == "png");
    let (e_per_adu, most_adu) = if is_png {
        (8.0, 255.0)
    } else {
        (1.0, 65_535.0)
    };

    let mut electrons = vec![SKY_E; (width * height) as usize];
    for star in Catalog::built_in().stars() {
        let pixel = camera.pixel_of(&attitude.apply(&star.direction));
        if let Some(pixel) = pixel.filter(|pixel| camera.contains(pixel)) {
            let star_e = ZERO_MAG_E * 10_f64.powf(-0.4 * f64::from(star.v_mag));
            add_spot(&mut electrons, width as i64, &pixel, star_e);
        }
    }
    let mut random = ChaCha8Rng::seed_from_u64(seed as u64);
    let mut level = |&expected_e: &f64| -> Result<u16, Box<dyn Error>> {
        let adu = OFFSET_ADU + caught_e(expected_e, &mut random)? / e_per_adu;
        Ok(adu.round().clamp(0.0, most_adu) as u16)
    };
    let pixels: Vec<u16> = electrons.iter().map(&mut level).collect::<Result<_, _>>()?;
    let (width, height) = (width as u32, height as u32);
    if is_png {
        let bytes: Vec<u8> = pixels.iter().map(|&adu| adu as u8).collect();
        image::save_buffer(out, &bytes, width, height, image::ColorType::L8)?;
    } else {
        TiffEncoder::new(File::create(out)?)?
            .with_compression(Compression::Deflate(DeflateLevel::Best))
            .with_predictor(Predictor::Horizontal)
            .write_image::<Gray16>(width, height, &pixels)?;
    }
    Ok(())
}

/// Adds a star's light, integrated over each pixel.
fn add_spot(electrons: &mut [f64], width: i64, at: &PixelPoint, star_e: f64) {
    let height = electrons.len() as i64 / width;
    let (column, row) = (at.x.round() as i64, at.y.round() as i64);
    let reach = -SPOT_REACH_PX..=SPOT_REACH_PX;
    for y in reach
        .clone()
        .map(|dy| row + dy)
        .filter(|y| (0..height).contains(y))
    {
        let row_e = star_e * share(y as f64 - at.y);
        for x in reach
            .clone()
            .map(|dx| column + dx)
            .filter(|x| (0..width).contains(x))
        {
            electrons[(y * width + x) as usize] += row_e * share(x as f64 - at.x);
        }
    }
}

/// Share of a spot's light on a pixel (on one axis) whose centre is `offset_px` from the spot's.
fn share(offset_px: f64) -> f64 {
    const STEPS: i32 = 16;
    let density = |step: i32| {
        let t = (offset_px + (f64::from(step) + 0.5) / f64::from(STEPS) - 0.5) / SPOT_SIGMA_PX;
        (-t * t / 2.0).exp() / (SPOT_SIGMA_PX * std::f64::consts::TAU.sqrt())
    };
    (0..STEPS).map(density).sum::<f64>() / f64::from(STEPS)
}

/// Electrons read out for an expected number.
fn caught_e(expected_e: f64, random: &mut ChaCha8Rng) -> Result<f64, Box<dyn Error>> {
    Ok(Poisson::new(expected_e)?.sample(random) + Normal::new(0.0, READ_NOISE_E)?.sample(random))
}
