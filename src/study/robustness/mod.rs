//! How often identification is right, wrong, or without an answer: the Monte-Carlo protocol of the field.
//!
//! [`Protocol`] → for each trial a list of centroids drawn from the catalogue → the same identification as that
//! of `starpipe identify` → [`Verdict`] → [`Tally`]
//!
//! 1. The attitude is uniform over all rotations; the frame is a pinhole camera's.
//! 2. The frame's stars are those of the catalogue whose observed magnitude lies above a limit, the same over the whole
//!    sky, so that rich and poor fields occur as often as they do on the sky.
//! 3. Positions and magnitudes get Gaussian errors, some stars are left out whatever their
//!    brightness, and false ones are strewn over the frame with magnitudes like those of the true ones.
//! 4. The hint of the scale is off by up to the error that it states, or there is none.
//! 5. A trial is right, wrong or without an answer. Its random numbers depend on the seed and its own number
//!    only: the same on any number of threads, and the same attitudes in every row of a table.
//!
//! Caveats: the stars come from the catalogue that is then searched, so what the catalogue lacks is stood for by the false
//! stars; double stars are not merged.
//!
//! # Reference
//! Rijlaarsdam, Yous, Byrne, Oddenino, Furano, Moloney 2020, Sensors 20, 2579 (what to report and to state beside it).

mod interval;
mod observation;
mod table;
mod tally;

pub use interval::{CONFIDENCE, Interval};
pub use observation::{Observation, random_rotation};
pub use table::{Case, Parameter, Row, STANDARD_FOV_DEG, VARIED_FOV_DEG, standard_cases};
pub use tally::{Answer, Tally, Verdict};

use crate::base::units::RAD_PER_DEG;
use crate::identify::{IndexedCatalog, Photometry, Priors, Scale, ScalePrior, identify};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Serialize;
use std::time::Instant;

/// What is drawn, and what the identification is told of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Protocol {
    /// Horizontal field of view, in degrees.
    pub fov_deg: f64,
    /// Columns of the frame.
    pub width_px: usize,
    /// Rows of the frame.
    pub height_px: usize,
    /// Catalogue stars above the limit on a frame, on average over the sky.
    pub mean_stars: f64,
    /// Standard deviation of a centroid on each axis, in pixels.
    pub centroid_sigma_px: f64,
    /// Standard deviation of a magnitude.
    pub mag_sigma: f64,
    /// The part of the stars that is missing, in [0, 1].
    pub missing: f64,
    /// False stars, as a part of the true stars before some are taken away.
    pub false_stars: f64,
    /// By which part the stated scale may be off, in (0, 1); `None`: nothing is stated.
    pub scale_error: Option<f64>,
    /// Which frames are mirrored.
    pub mirrored: Mirrored,
    /// What the magnitudes mean.
    pub photometry: Photometry,
}

/// Which frames are mirrored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Mirrored {
    /// None.
    Never,
    /// Each with probability one half.
    Half,
    /// All.
    Always,
}

impl Default for Protocol {
    /// A field of 10° with middling errors, known to a tenth.
    fn default() -> Self {
        Self {
            fov_deg: 10.0,
            width_px: 1024,
            height_px: 1024,
            mean_stars: 30.0,
            centroid_sigma_px: 0.3,
            mag_sigma: 0.2,
            missing: 0.15,
            false_stars: 0.15,
            scale_error: Some(0.1),
            mirrored: Mirrored::Half,
            photometry: Photometry::Instrumental,
        }
    }
}

impl Protocol {
    /// What the identification is told: the scale, off by a random part of its stated error.
    fn priors(&self, rng: &mut ChaCha8Rng) -> Priors {
        let scale = self.scale_error.map(|tolerance| {
            let error = 1.0 + tolerance * rng.random_range(-1.0..1.0);
            let fov_rad = self.fov_deg * RAD_PER_DEG / error;
            ScalePrior::by_user(Scale::FieldOfView(fov_rad), tolerance)
        });
        Priors {
            scale,
            ..Priors::default()
        }
    }
}

/// Runs `trials` trials of `protocol` on the threads of the current pool; `done` is called after each.
pub fn run(
    indexed: &IndexedCatalog,
    protocol: &Protocol,
    trials: u64,
    seed: u64,
    done: &(dyn Fn() + Sync),
) -> Tally {
    let verdicts: Vec<Verdict> = (0..trials)
        .into_par_iter()
        .map(|trial| {
            let verdict = run_one(indexed, protocol, seed, trial);
            done();
            verdict
        })
        .collect();
    Tally::new(verdicts)
}

/// Runs the trial number `trial` alone.
pub fn run_one(indexed: &IndexedCatalog, protocol: &Protocol, seed: u64, trial: u64) -> Verdict {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(trial);
    let observation = Observation::draw(protocol, indexed, &mut rng);
    let priors = protocol.priors(&mut rng);
    let start = Instant::now();
    let field = observation.list.star_field(0.0);
    let found = identify(&field, &priors, indexed);
    let time_ms = start.elapsed().as_secs_f64() * 1e3;
    Verdict::new(&observation, found.as_ref().ok(), time_ms)
}
