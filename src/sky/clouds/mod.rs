//! Clouds: stars that are dimmed, and stars that are missing.
//!
//! For the extinction A beyond that of clear air, a star that was measured has the likelihood of its
//! magnitude, and one that is missing that of not being detected A magnitudes fainter. A part of the sky has
//! the extinction of clear air alone, and the other part more, over all of a cell or over half of it: which
//! parts is told by all cells together. Where clouds are brighter or darker than a clear sky, so does their
//! light (`cloud_light`).

mod cases;
mod posterior;
mod texture;

use super::brightness::SkyLevels;
use super::cloud_light::{CloudLight, Hidden, LitCell, for_each_fraction, terms};
use super::relative_limit::RelativeLimit;
use super::star_counts::{CellStar, CloudInputs};
use crate::base::statistics::Estimate;
pub use cases::CLEAR_MAG;
use cases::{CASES, CLOUD_VARIATION, Cases, CloudCase, STEP_MAG, STEPS, hidden_fractions};
use posterior::{CLEAR_SIGMA_MAG, CellLikelihoods, CloudPosterior};
use texture::Texture;

/// Share of stars whose brightness or presence tells nothing: variable stars, wrong names.
const UNTRUE: f64 = 0.02;
/// Weight of the stars that tell of a cell at least: without any, nothing is known of it.
const MIN_WEIGHT: f64 = 0.3;
/// Stars that should be detected with at least this probability count as expected.
const EXPECTED: f64 = 0.9;

/// Clouds in a cell.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct CellClouds {
    /// Stars in it that a clear sky would show.
    pub expected: usize,
    /// Those of them that were detected.
    pub detected: usize,
    /// Extinction beyond that of clear air.
    pub extinction_mag: Option<Estimate>,
    /// Probability that it is below [`CLEAR_MAG`].
    pub clear: Option<f64>,
    /// The same if clouds are smooth, and if they are broken.
    pub clear_band: Option<[f64; 2]>,
}

/// What the stars around a cell tell of it.
struct Around {
    /// Logarithms of the likelihoods of the cases.
    ln_likelihoods: Cases,
    /// Stars with equal weights that would tell as much.
    stars: f64,
}

/// Clouds in all cells.
pub(super) struct CloudMap {
    /// Each cell.
    pub cells: Vec<CellClouds>,
    /// Share of the sky that is behind clouds.
    pub fraction: Option<Estimate>,
}

impl CloudInputs<'_> {
    /// Clouds in each cell.
    pub(super) fn clouds(&self, cell_stars: &[CellStar], levels: &SkyLevels) -> CloudMap {
        let limit = if self.is_usual {
            Some(RelativeLimit::usual())
        } else {
            RelativeLimit::of_clear_sky(cell_stars, self.clear_sky, self.chance)
        };
        let logs: Vec<Cases> = cell_stars
            .iter()
            .map(|cell_star| self.ln_likelihoods(cell_star, limit.as_ref()))
            .collect();
        let mut cells = vec![CellClouds::default(); self.grid.places.len()];
        let mut likelihoods = Vec::new();
        let mut stars_of = vec![0.0; cells.len()];
        for (cell, (clouds, level)) in cells.iter_mut().zip(&levels.cells).enumerate() {
            let solid_angle_sr = level.solid_angle_sr;
            let stars = cell_stars.iter().zip(&logs);
            let around = self.around(cell, stars, limit.as_ref(), clouds);
            if let Some(around) = around.filter(|_| solid_angle_sr > 0.0) {
                stars_of[cell] = around.stars;
                likelihoods.push(CellLikelihoods::new(
                    cell,
                    solid_angle_sr,
                    &around.ln_likelihoods,
                ));
            }
        }
        let mut posterior = CloudPosterior::of(&likelihoods);
        let shares = hidden_fractions();
        let lit = likelihoods.iter().filter_map(|likelihoods| {
            self.lit(likelihoods, levels, posterior.hidden(likelihoods, &shares))
        });
        let before = posterior.hidden_before(&shares);
        if let Some(light) = CloudLight::measure(lit.collect(), &before, posterior.clouded) {
            for likelihoods in &mut likelihoods {
                let cell = likelihoods.cell;
                likelihoods.add(&shares, |share| light.likelihood(cell, share));
            }
            posterior = CloudPosterior::of(&likelihoods);
        }
        for (likelihoods, (clear, extinction_mag)) in likelihoods.iter().zip(posterior.cells()) {
            cells[likelihoods.cell].clear = Some(clear);
            cells[likelihoods.cell].extinction_mag = Some(extinction_mag);
        }
        let texture = Texture::measure(self, cell_stars);
        let doubts_mag: Vec<f64> = likelihoods
            .iter()
            .map(|likelihoods| {
                self.doubt_mag(
                    likelihoods.cell,
                    &cells,
                    stars_of[likelihoods.cell],
                    levels,
                    &texture,
                )
            })
            .collect();
        for (likelihoods, doubt_mag) in likelihoods.iter().zip(doubts_mag) {
            let clouds = &mut cells[likelihoods.cell];
            if let Some(extinction_mag) = &mut clouds.extinction_mag {
                extinction_mag.sigma = libm::hypot(extinction_mag.sigma, doubt_mag);
            }
            let [low, high] =
                posterior.clear_band(likelihoods, libm::hypot(doubt_mag, CLEAR_SIGMA_MAG));
            clouds.clear_band = clouds.clear.map(|clear| [low.min(clear), high.max(clear)]);
        }
        let bands = |likelihoods: &CellLikelihoods| {
            let CellClouds {
                clear, clear_band, ..
            } = cells[likelihoods.cell];
            let [low, high] = clear_band.unwrap_or([0.0, 1.0]);
            [low, clear.unwrap_or(0.5), high]
        };
        CloudMap {
            fraction: posterior.fraction(&likelihoods, bands),
            cells,
        }
    }

    /// What the likelihoods of a cell leave out of the error of its extinction, in magnitudes: the error of clear air,
    /// the steps, and that the stars around it, so many, show its clouds at their places only.
    fn doubt_mag(
        &self,
        cell: usize,
        cells: &[CellClouds],
        stars: f64,
        levels: &SkyLevels,
        texture: &Texture,
    ) -> f64 {
        /// How far around a cell its clouds are alike, in reaches of a cell.
        const AROUND: f64 = 1.4;
        let value = |near: usize| Some(cells[near].extinction_mag?.value);
        let near = self.grid.cells_near(cell, AROUND).filter_map(value);
        let (sum, count) = near.fold((0.0, 0.0), |(sum, count), mag| {
            (sum + mag * mag, count + 1.0)
        });
        let variance_mag2 = texture.variance_mag2(sum / f64::max(count, 1.0));
        let level = &levels.cells[cell];
        let clear_mag = self.clear_sky.sigma_mag(level.airmass, level.off_axis_sq());
        (variance_mag2 / stars.max(1.0) + clear_mag.powi(2) + STEP_MAG.powi(2) / 12.0).sqrt()
    }

    /// What the stars around a cell tell of it, if they do; the stars in it are counted in `clouds`.
    fn around<'w>(
        &self,
        cell: usize,
        stars: impl Iterator<Item = (&'w CellStar<'w>, &'w Cases)>,
        limit: Option<&RelativeLimit>,
        clouds: &mut CellClouds,
    ) -> Option<Around> {
        let mut total = [0.0; CASES];
        let [mut weights, mut squares] = [0.0; 2];
        for (cell_star, logs) in stars {
            let Some(weight) = self.grid.weight(cell, &cell_star.star.direction) else {
                continue;
            };
            for (total, log) in total.iter_mut().zip(logs) {
                *total += weight * log;
            }
            let is_expected =
                limit.is_some_and(|limit| limit.probability(cell_star.relative_mag) > EXPECTED);
            if is_expected || cell_star.star.measured.is_some() {
                weights += weight;
                squares += weight * weight;
            }
            if cell_star.cell == cell && is_expected {
                clouds.expected += 1;
                clouds.detected += usize::from(cell_star.star.is_detected);
            }
        }
        let is_measured = weights > MIN_WEIGHT && self.depths[cell].is_some();
        is_measured.then(|| Around {
            ln_likelihoods: total,
            stars: weights * weights / squares,
        })
    }

    /// A cell with its light.
    fn lit(
        &self,
        likelihoods: &CellLikelihoods,
        levels: &SkyLevels,
        hidden: Hidden,
    ) -> Option<LitCell> {
        let place = self.grid.pixel_of(likelihoods.cell)?;
        let direction = self.grid.direction_of(&place)?;
        let (camera, zenith) = (
            self.grid.camera(),
            self.frame.identification.places.zenith(),
        );
        Some(LitCell {
            cell: likelihoods.cell,
            hidden,
            by_stars: for_each_fraction(|share| likelihoods.likelihood_of(share)),
            light: levels.radiance_adu_sr(likelihoods.cell)?,
            terms: terms(camera, &place, &direction, zenith, self.moon.as_ref()),
        })
    }

    /// The logarithm of the likelihood of a star in each case.
    fn ln_likelihoods(&self, cell_star: &CellStar, limit: Option<&RelativeLimit>) -> Cases {
        let full = self.likelihoods(cell_star, limit);
        std::array::from_fn(|case| {
            let CloudCase { cover, mag, .. } = cases::case(case);
            let behind = full[(mag / STEP_MAG).round() as usize];
            // The star is behind the clouds, or beside them.
            let likelihood = cover * behind + (1.0 - cover) * full[0];
            libm::log(likelihood.max(f64::MIN_POSITIVE))
        })
    }

    /// The likelihood of a star for each extinction.
    fn likelihoods(&self, cell_star: &CellStar, limit: Option<&RelativeLimit>) -> [f64; STEPS] {
        let star = cell_star.star;
        let dimmed_by = self.clear_sky.dimmed_by(star);
        std::array::from_fn(|step| {
            let extinction_mag = step as f64 * STEP_MAG;
            let seen = limit.map_or(1.0, |limit| {
                limit.probability(cell_star.relative_mag + extinction_mag)
            });
            let seen = UNTRUE + (1.0 - 2.0 * UNTRUE) * seen;
            match (dimmed_by, star.is_detected) {
                (Some(dimmed_by), _) => {
                    let sigma_mag = libm::hypot(dimmed_by.sigma, CLOUD_VARIATION * extinction_mag);
                    let off = (dimmed_by.value - extinction_mag) / sigma_mag;
                    let agrees = libm::exp(-0.5 * off * off) / sigma_mag;
                    (1.0 - UNTRUE) * agrees + UNTRUE
                }
                (None, true) => seen,
                (None, false) => 1.0 - seen,
            }
        })
    }
}
