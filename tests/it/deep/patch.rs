//! A part of the sky as deep as Gaia, drawn at random.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use starpipe::base::coords::{Icrs, UnitVector};
use starpipe::base::units::RAD_PER_DEG;
use std::f64::consts::TAU;

/// A star that was drawn.
#[derive(Debug, Clone, Copy)]
pub struct DrawnStar {
    pub direction: UnitVector<Icrs>,
    pub v_mag: f64,
}

/// The stars around a place, brightest first.
pub struct Patch {
    pub centre: UnitVector<Icrs>,
    pub stars: Vec<DrawnStar>,
}

/// A random place in a circle.
pub fn near(
    centre: &UnitVector<Icrs>,
    radius_rad: f64,
    random: &mut ChaCha8Rng,
) -> UnitVector<Icrs> {
    let (east, north) = centre.east_north();
    let apart_rad = radius_rad * random.random::<f64>().sqrt();
    let (sin, cos) = (TAU * random.random::<f64>()).sin_cos();
    let across = (east * sin + north * cos) * apart_rad.tan();
    UnitVector::from_vector(centre.as_vector() + across)
}

impl Patch {
    /// `per_sq_deg` stars in each square degree of a circle; each magnitude has 2.2 times the stars of the one
    /// before, to V 17.
    pub fn draw(centre_deg: [f64; 2], radius_deg: f64, per_sq_deg: f64, seed: u64) -> Self {
        const FAINTEST_V_MAG: f64 = 17.0;
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let [ra_rad, dec_rad] = centre_deg.map(|deg| deg * RAD_PER_DEG);
        let centre = UnitVector::from_ra_dec(ra_rad, dec_rad);
        let count = (std::f64::consts::PI * radius_deg * radius_deg * per_sq_deg) as usize;
        let mut star = || {
            let fainter: f64 = random.random::<f64>().max(1e-9);
            DrawnStar {
                direction: near(&centre, radius_deg * RAD_PER_DEG, &mut random),
                v_mag: FAINTEST_V_MAG + fainter.ln() / 2.2_f64.ln(),
            }
        };
        let mut stars: Vec<DrawnStar> = (0..count).map(|_| star()).collect();
        stars.sort_by(|a, b| a.v_mag.total_cmp(&b.v_mag));
        Self { centre, stars }
    }
}
