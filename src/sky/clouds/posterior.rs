//! What is believed of the cells of a sky: which are clear, and how thick clouds are.
//!
//! ([`CellLikelihoods`] each) → [`CloudPosterior`]
//!
//! A part of the sky has the extinction of clear air alone, and the other part more. How large that part is,
//! and how thick its clouds are on average, is told by all cells together.

use super::cases::{
    BROKEN_STEP_MAG, CASES, CLEAR_MAG, Cases, CloudCase, KINDS, STEP_MAG, STEPS, case, mean_mag,
};
use crate::base::statistics::Estimate;
use crate::sky::cloud_light::Hidden;
use crate::sky::grid::CELLS_OF_A_STAR;

/// Mean extinctions of clouds, in magnitudes, of which the likeliest counts: haze, usual clouds, thick ones.
const MEAN_CLOUDS_MAG: [f64; 3] = [0.3, 1.0, 3.0];
/// Cells that clouds cover, by half and by a quarter, for each that they cover: most clouds are larger than a cell.
const USUAL: [f64; KINDS] = [1.0, 0.3, 0.0];
/// The same where all clouds are smooth, and where they are broken.
const SMOOTH: [f64; KINDS] = [1.0, 0.0, 0.0];
const BROKEN: [f64; KINDS] = [1.0, 1.0, 2.0];
/// Variation of clear air, in magnitudes.
pub(super) const CLEAR_SIGMA_MAG: f64 = 0.05;
/// No cell is more certain of clouds, or of a clear sky, than by this factor.
const MAX_ODDS: f64 = 1000.0;

/// A cell of which stars tell.
#[derive(Debug, Clone)]
pub(super) struct CellLikelihoods {
    /// The cell.
    pub cell: usize,
    /// Solid angle of its sky.
    pub solid_angle_sr: f64,
    /// Likelihoods of the cases, over the largest.
    by_case: Cases,
}

impl CellLikelihoods {
    /// A cell by the logarithms of the likelihoods of the cases.
    pub(super) fn new(cell: usize, solid_angle_sr: f64, ln_likelihoods: &Cases) -> Self {
        let largest = ln_likelihoods
            .iter()
            .copied()
            .fold(f64::NEG_INFINITY, f64::max);
        Self {
            cell,
            solid_angle_sr,
            by_case: ln_likelihoods.map(|ln| libm::exp(ln - largest)),
        }
    }

    /// The likelihood of what its stars show behind an even cloud that takes a share of their light.
    pub(super) fn likelihood_of(&self, share: f64) -> f64 {
        const THICKEST: f64 = (STEPS - 1) as f64;
        let mag = -2.5 * libm::log10(1.0 - share);
        let case = (mag / STEP_MAG).min(THICKEST);
        let [below, above] = [case.floor(), case.ceil()].map(|at| self.by_case[at as usize]);
        below + case.fract() * (above - below)
    }

    /// Adds what else tells of it, by the share of a star's light that clouds take; `hidden_shares` are those of
    /// the cases.
    pub(super) fn add(&mut self, hidden_shares: &Cases, likelihood: impl Fn(f64) -> f64) {
        for (likelihood_of_case, share) in self.by_case.iter_mut().zip(hidden_shares) {
            *likelihood_of_case *= likelihood(*share);
        }
        let largest = self.by_case.iter().copied().fold(0.0, f64::max);
        if largest > 0.0 {
            for likelihood in &mut self.by_case {
                *likelihood /= largest;
            }
        }
    }
}

/// What is believed of a sky.
#[derive(Debug, Clone)]
pub(super) struct CloudPosterior {
    priors: CasePriors,
    /// Those where clouds are smooth, and where they are broken.
    limiting: [CasePriors; 2],
    /// Of each cell.
    evidence: Vec<Evidence>,
    /// Part of the sky that is not clear.
    pub clouded: f64,
    /// Error of that.
    sigma: f64,
}

impl CloudPosterior {
    /// With the mean extinction of clouds that is likeliest.
    pub(super) fn of(likelihoods: &[CellLikelihoods]) -> Self {
        let posteriors = MEAN_CLOUDS_MAG.map(|mean_mag| Self::with(likelihoods, mean_mag));
        let [first, rest @ ..] = posteriors;
        let likelier = |best: Self, other: Self| {
            if other.ln_likelihood() > best.ln_likelihood() {
                other
            } else {
                best
            }
        };
        rest.into_iter().fold(first, likelier)
    }

    /// The part that is clouded is the one for which what the cells show is most probable.
    fn with(likelihoods: &[CellLikelihoods], mean_cloud_mag: f64) -> Self {
        const STEPS: usize = 200;
        /// Cells that are clear, and that are not, which the sky has beforehand.
        const BEFOREHAND: f64 = 0.5;
        let priors = CasePriors::new(mean_cloud_mag, &USUAL);
        let evidence: Vec<Evidence> = likelihoods
            .iter()
            .map(|likelihoods| priors.evidence(likelihoods, CLEAR_MAG))
            .collect();
        let all_sr: f64 = likelihoods
            .iter()
            .map(|likelihoods| likelihoods.solid_angle_sr)
            .sum();
        // The same stars tell of several cells.
        let cells = likelihoods.len() as f64 / CELLS_OF_A_STAR;
        let mean = |of: &dyn Fn(&Evidence) -> f64| {
            let parts = likelihoods.iter().zip(&evidence);
            let parts = parts
                .map(|(likelihoods, evidence)| likelihoods.solid_angle_sr / all_sr * of(evidence));
            parts.sum::<f64>()
        };
        let mut clouded = 0.5;
        for _ in 0..STEPS {
            let share = mean(&|of| clouded * of.cloud.all / of.mixed(clouded));
            let share = if likelihoods.is_empty() { 0.5 } else { share };
            clouded = (BEFOREHAND + cells * share) / (2.0 * BEFOREHAND + cells);
        }
        let information = mean(&|of| ((of.cloud.all - of.clear.all) / of.mixed(clouded)).powi(2));
        Self {
            priors,
            sigma: (cells * information).sqrt().recip().min(0.5),
            limiting: [SMOOTH, BROKEN].map(|covers| CasePriors::new(mean_cloud_mag, &covers)),
            evidence,
            clouded,
        }
    }

    fn ln_likelihood(&self) -> f64 {
        let of_cell = |evidence: &Evidence| libm::log(evidence.mixed(self.clouded));
        self.evidence.iter().map(of_cell).sum()
    }

    /// The share of a star's light that clouds take in a cell; `hidden_shares` are those of the cases.
    pub(super) fn hidden(&self, likelihoods: &CellLikelihoods, hidden_shares: &Cases) -> Hidden {
        self.priors.hidden(&likelihoods.by_case, hidden_shares)
    }

    /// The same of a cell of which nothing is told.
    pub(super) fn hidden_before(&self, hidden_shares: &Cases) -> Hidden {
        self.priors.hidden(&[1.0; CASES], hidden_shares)
    }

    /// The probability of each cell that it is clear, and its extinction.
    pub(super) fn cells(&self) -> impl Iterator<Item = (f64, Estimate)> {
        let posterior = |evidence: &Evidence| evidence.posterior(self.clouded);
        self.evidence.iter().map(posterior)
    }

    /// The probability of a cell that it is clear where clouds are smooth and thicker by `doubt_mag`, and where they
    /// are broken and thinner by that.
    pub(super) fn clear_band(&self, likelihoods: &CellLikelihoods, doubt_mag: f64) -> [f64; 2] {
        let clear = |priors: &CasePriors, clear_mag: f64| {
            let (clear, _) = priors
                .evidence(likelihoods, clear_mag)
                .posterior(self.clouded);
            clear
        };
        let [smooth, broken] = &self.limiting;
        [
            clear(smooth, CLEAR_MAG - doubt_mag),
            clear(broken, CLEAR_MAG + doubt_mag),
        ]
    }

    /// Share of the sky of which stars tell that is behind clouds, by the probabilities that cells are clear, with
    /// their bands.
    pub(super) fn fraction(
        &self,
        likelihoods: &[CellLikelihoods],
        clear: impl Fn(&CellLikelihoods) -> [f64; 3],
    ) -> Option<Estimate> {
        /// The ends of all bands together, over the standard error that they are.
        const BAND_SIGMAS: f64 = 2.0;
        let all_sr: f64 = likelihoods
            .iter()
            .map(|likelihoods| likelihoods.solid_angle_sr)
            .sum();
        let [mut clouded, mut band] = [0.0; 2];
        for likelihoods in likelihoods {
            let weight = likelihoods.solid_angle_sr / all_sr;
            let [low, clear, high] = clear(likelihoods);
            clouded += weight * (1.0 - clear);
            band += weight * (high - low);
        }
        (all_sr > 0.0).then(|| Estimate {
            value: clouded,
            sigma: libm::hypot(self.sigma, band / BAND_SIGMAS),
        })
    }
}

/// Probabilities of the cases beforehand, in the clear part of the sky and in the other.
#[derive(Debug, Clone)]
struct CasePriors {
    clear: Cases,
    cloud: Cases,
}

impl CasePriors {
    /// Those of clouds with this mean extinction, and covers of cells.
    fn new(mean_cloud_mag: f64, covers: &[f64; KINDS]) -> Self {
        let of_clear = |case: usize| match case {
            0..STEPS => libm::exp(-0.5 * (mean_mag(case) / CLEAR_SIGMA_MAG).powi(2)),
            _ => 0.0,
        };
        let of_cloud = |number: usize| {
            let CloudCase { kind, mag, .. } = case(number);
            let step_mag = [STEP_MAG, BROKEN_STEP_MAG, BROKEN_STEP_MAG][kind];
            covers[kind] * step_mag * libm::exp(-mag / mean_cloud_mag)
        };
        let normalized = |prior: &dyn Fn(usize) -> f64| {
            let total: f64 = (0..CASES).map(prior).sum();
            std::array::from_fn(|case| prior(case) / total)
        };
        Self {
            clear: normalized(&of_clear),
            cloud: normalized(&of_cloud),
        }
    }

    /// What is told of a cell, where less than `clear_mag` counts as clear.
    fn evidence(&self, likelihoods: &CellLikelihoods, clear_mag: f64) -> Evidence {
        let sums = |prior: &Cases| {
            let mut sums = CaseSums::default();
            for (case, (likelihood, prior)) in likelihoods.by_case.iter().zip(prior).enumerate() {
                let weight = prior * likelihood;
                sums.all += weight;
                sums.first += weight * mean_mag(case);
                sums.second += weight * mean_mag(case).powi(2);
                sums.below_clear += weight * f64::from(mean_mag(case) < clear_mag);
            }
            sums
        };
        let mut evidence = Evidence {
            clear: sums(&self.clear),
            cloud: sums(&self.cloud),
        };
        evidence.clear = evidence.clear.at_least(evidence.cloud.all / MAX_ODDS);
        evidence.cloud = evidence.cloud.at_least(evidence.clear.all / MAX_ODDS);
        evidence
    }

    fn hidden(&self, by_case: &Cases, hidden_shares: &Cases) -> Hidden {
        let mut hidden = Hidden::NONE;
        for (case, likelihood) in by_case.iter().enumerate() {
            let [clear, cloud] = [&self.clear, &self.cloud].map(|prior| prior[case] * likelihood);
            hidden.add(hidden_shares[case], clear, cloud);
        }
        hidden
    }
}

/// What is told of a cell: sums over the cases, if it is part of the clear sky, and if it is not.
#[derive(Debug, Clone, Copy)]
struct Evidence {
    clear: CaseSums,
    cloud: CaseSums,
}

/// Sums of likelihoods over the cases.
#[derive(Debug, Clone, Copy, Default)]
struct CaseSums {
    all: f64,
    first: f64,
    second: f64,
    below_clear: f64,
}

impl Evidence {
    /// The likelihood where a part `clouded` of the sky is not clear.
    fn mixed(&self, clouded: f64) -> f64 {
        (1.0 - clouded) * self.clear.all + clouded * self.cloud.all
    }

    /// The probability that the sky is clear, and the extinction, where a part `clouded` of the sky is not
    /// clear.
    fn posterior(&self, clouded: f64) -> (f64, Estimate) {
        let mean = |of: fn(&CaseSums) -> f64| {
            (1.0 - clouded) * of(&self.clear) + clouded * of(&self.cloud)
        };
        let all = self.mixed(clouded);
        let first = mean(|sums| sums.first) / all;
        let second = mean(|sums| sums.second) / all;
        let extinction_mag = Estimate {
            value: first,
            sigma: (second - first * first).max(0.0).sqrt(),
        };
        (mean(|sums| sums.below_clear) / all, extinction_mag)
    }
}

impl CaseSums {
    /// The same with a sum that is not below `least`.
    fn at_least(self, least: f64) -> Self {
        if self.all >= least {
            return self;
        }
        let factor = least / self.all.max(f64::MIN_POSITIVE);
        Self {
            all: least,
            first: self.first * factor,
            second: self.second * factor,
            below_clear: self.below_clear * factor,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cell in which extinctions about `cloud_mag` are as likely as `odds` to those about zero.
    fn evidence(cell: usize, cloud_mag: f64, odds: f64) -> CellLikelihoods {
        let logs = std::array::from_fn(|case| {
            let about = |mag: f64| libm::exp(-0.5 * ((mean_mag(case) - mag) / 0.1).powi(2));
            libm::log(about(0.0) + odds * about(cloud_mag) + 1e-9)
        });
        CellLikelihoods::new(cell, 0.01, &logs)
    }

    fn fraction_of(posterior: &CloudPosterior, all: &[CellLikelihoods]) -> Option<Estimate> {
        let clear: Vec<f64> = posterior.cells().map(|(clear, _)| clear).collect();
        let bands = all
            .iter()
            .map(|likelihoods| posterior.clear_band(likelihoods, 0.05));
        let bands: Vec<[f64; 2]> = bands.collect();
        posterior.fraction(all, |likelihoods| {
            let at = all
                .iter()
                .position(|other| other.cell == likelihoods.cell)
                .unwrap();
            [bands[at][0], clear[at], bands[at][1]]
        })
    }

    #[test]
    fn broken_clouds_may_leave_a_cell_clear_that_smooth_ones_do_not() {
        let cells: Vec<CellLikelihoods> = (0..100)
            .map(|cell| evidence(cell, 0.3, if cell < 50 { 1e-3 } else { 1e4 }))
            .collect();
        let posterior = CloudPosterior::of(&cells);
        for (likelihoods, (clear, _)) in cells.iter().zip(posterior.cells()) {
            let [low, high] = posterior.clear_band(likelihoods, 0.05);
            assert!(low <= clear && clear <= high, "{low} {clear} {high}");
        }
        let [low, high] = posterior.clear_band(&cells[99], 0.05);
        assert!(high - low > 0.1, "{low} {high}");
    }

    #[test]
    fn all_cells_together_tell_how_much_is_clear() {
        let cells = |clear: usize, cloudy: usize| -> Vec<CellLikelihoods> {
            let odds = |cell: usize| if cell < clear { 1e-3 } else { 1e4 };
            (0..clear + cloudy)
                .map(|cell| evidence(cell, 1.0, odds(cell)))
                .collect()
        };
        let mostly_clear = cells(90, 10);
        let posterior = CloudPosterior::of(&mostly_clear);
        let share = fraction_of(&posterior, &mostly_clear).unwrap();
        assert!((share.value - 0.1).abs() < 0.03, "{share:?}");
        assert!((0.02..0.1).contains(&share.sigma), "{share:?}");
        // The same cell is more likely clear where most of the sky is.
        let doubtful = posterior
            .priors
            .evidence(&evidence(0, 1.0, 10.0), CLEAR_MAG);
        let (clear, _) = doubtful.posterior(posterior.clouded);
        let (less, _) = doubtful.posterior(CloudPosterior::of(&cells(10, 90)).clouded);
        assert!(clear > less + 0.3, "{clear} {less}");
        assert_eq!(fraction_of(&CloudPosterior::of(&[]), &[]), None);
    }

    #[test]
    fn thin_clouds_are_likelier_where_all_clouds_are_thin() {
        let cells = |cloud_mag: f64| -> Vec<CellLikelihoods> {
            let odds = |cell: usize| if cell.is_multiple_of(3) { 20.0 } else { 0.05 };
            (0..300)
                .map(|cell| evidence(cell, cloud_mag, odds(cell)))
                .collect()
        };
        let thin = cells(0.4);
        let share = fraction_of(&CloudPosterior::of(&thin), &thin).unwrap();
        assert!((share.value - 0.33).abs() < 0.1, "{share:?}");
        let usual = CloudPosterior::with(&thin, 1.0);
        assert!(fraction_of(&usual, &thin).unwrap().value < share.value);
    }
}
