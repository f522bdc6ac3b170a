//! The weights of the mixture: non-negative least squares over the pixels of all stars.

use super::stars::{PsfStar, StarFitter};
use crate::detect::effective_psf::{
    EffectivePsf, Lobe, LocalPsf, SpotMoments, covariance, inverse,
};
use crate::detect::psf::AxisProfile;
use nalgebra::{DMatrix, DVector};

/// Standard deviation of a lobe over that of the spot along its shorter axis.
const LOBE_SIZE: f64 = 0.5;
/// Distance of the lobes over their standard deviation: a sum of such lobes has no ripples.
const PITCH: f64 = 1.15;
/// Half axes of the ellipse of the lobes, in standard deviations of the spot.
const REACH_SIGMAS: f64 = 2.8;
/// Most lobes: with more, they are larger.
const MAX_LOBES: f64 = 100.0;
/// Lobes with a smaller share are left out.
const MIN_SHARE: f64 = 1e-4;

/// The lobes that a PSF may have.
#[derive(Debug, Clone)]
pub(super) struct LobeGrid {
    offsets_px: Vec<[f64; 2]>,
    /// Shares of a Gaussian.
    gaussian: Vec<f64>,
    pub lobe_px: f64,
}

impl LobeGrid {
    /// For spots of these moments.
    pub fn of(typical: SpotMoments) -> Self {
        let elongation = typical[1].hypot(typical[2]);
        let minor_px = (typical[0] - 0.5 * elongation).exp();
        let ratio = elongation.exp();
        let count =
            std::f64::consts::PI * REACH_SIGMAS.powi(2) * ratio / (LOBE_SIZE * PITCH).powi(2);
        let lobe_px = LOBE_SIZE * minor_px * (count / MAX_LOBES).max(1.0).sqrt();
        let lobe_px = lobe_px.min(0.85 * minor_px);
        let pitch_px = PITCH * lobe_px;
        let total = covariance(typical);
        let wide = inverse(total);
        let mut narrow = total;
        narrow[0][0] -= lobe_px * lobe_px;
        narrow[1][1] -= lobe_px * lobe_px;
        let narrow = inverse(narrow);
        let square = |m: [[f64; 2]; 2], [x, y]: [f64; 2]| {
            m[0][0] * x * x + 2.0 * m[0][1] * x * y + m[1][1] * y * y
        };
        let steps = (REACH_SIGMAS * minor_px * ratio / pitch_px).ceil() as i32;
        let places = (-steps..=steps).flat_map(|row| {
            (-steps..=steps).map(move |column| [column, row].map(|i| f64::from(i) * pitch_px))
        });
        let offsets_px: Vec<[f64; 2]> = places
            .filter(|&place| square(wide, place) <= REACH_SIGMAS.powi(2))
            .collect();
        let density = offsets_px
            .iter()
            .map(|&place| (-0.5 * square(narrow, place)).exp());
        let mut gaussian: Vec<f64> = density.collect();
        normalise(&mut gaussian);
        Self {
            offsets_px,
            gaussian,
            lobe_px,
        }
    }

    /// All lobes.
    fn all(&self) -> Vec<Lobe> {
        let lobe = |&offset_px: &[f64; 2]| Lobe {
            offset_px,
            share: 1.0,
        };
        self.offsets_px.iter().map(lobe).collect()
    }

    /// The lobes of a Gaussian.
    pub fn gaussian_lobes(&self) -> Vec<Lobe> {
        self.lobes(&self.gaussian)
    }

    /// The lobes with these shares that have light, about their centre of light.
    fn lobes(&self, shares: &[f64]) -> Vec<Lobe> {
        let mut kept: Vec<Lobe> = self
            .offsets_px
            .iter()
            .zip(shares)
            .filter(|(_, share)| **share > MIN_SHARE)
            .map(|(&offset_px, &share)| Lobe { offset_px, share })
            .collect();
        let sum: f64 = kept.iter().map(|lobe| lobe.share).sum();
        let centre = [0, 1].map(|axis| {
            let moments = kept.iter().map(|lobe| lobe.share * lobe.offset_px[axis]);
            moments.sum::<f64>() / sum
        });
        for lobe in &mut kept {
            lobe.share /= sum;
            for (offset, centre) in lobe.offset_px.iter_mut().zip(centre) {
                *offset -= centre;
            }
        }
        kept
    }

    /// Sets the lobes of `psf` from all stars. Returns those from the stars of odd numbers, for
    /// those of even ones, and the other way round.
    pub fn solve(
        &self,
        psf: &mut EffectivePsf,
        stars: &[PsfStar],
        fitter: &mut StarFitter,
    ) -> [Vec<Lobe>; 2] {
        let mut of_halves = [Sums::new(self), Sums::new(self)];
        let mut local = LocalPsf::default();
        let mut pixels = Vec::new();
        let all = EffectivePsf {
            lobes: self.all(),
            ..psf.clone()
        };
        for (number, star) in stars.iter().enumerate() {
            fitter.weigh(star, psf, &mut pixels);
            all.at(star.spot.x, star.spot.y, &mut local);
            of_halves[number % 2].add(star, &local, &pixels);
        }
        let [even, odd] = &of_halves;
        let both = even.plus(odd);
        psf.lobes = self.lobes(&both.solve(&self.gaussian));
        [odd, even].map(|half| self.lobes(&half.solve(&self.gaussian)))
    }
}

/// Makes shares add up to one.
fn normalise(shares: &mut [f64]) {
    let sum: f64 = shares.iter().sum();
    shares.iter_mut().for_each(|share| *share /= sum);
}

/// Normal equations of the shares.
struct Sums {
    matrix: DMatrix<f64>,
    right: DVector<f64>,
    /// Buffers: the light of the lobes in the pixels of a star, and a row and column of a lobe.
    light: Vec<f64>,
    axes: [AxisProfile; 2],
}

impl Sums {
    fn new(grid: &LobeGrid) -> Self {
        let lobes = grid.offsets_px.len();
        Self {
            matrix: DMatrix::zeros(lobes, lobes),
            right: DVector::zeros(lobes),
            light: Vec::new(),
            axes: Default::default(),
        }
    }

    fn plus(&self, other: &Self) -> Self {
        Self {
            matrix: &self.matrix + &other.matrix,
            right: &self.right + &other.right,
            light: Vec::new(),
            axes: Default::default(),
        }
    }

    /// Adds the pixels of a star, with weights and values.
    fn add(&mut self, star: &PsfStar, local: &LocalPsf, pixels: &[[f64; 2]]) {
        let PsfStar { window, spot, .. } = star;
        let [across, down] = &mut self.axes;
        let count = pixels.len();
        self.light.clear();
        self.light.reserve(count * local.lobes.len());
        for lobe in &local.lobes {
            let [dx, dy] = lobe.offset_px;
            across.fill(spot.x + dx - window.x0 as f64, local.lobe_px, window.width);
            down.fill(spot.y + dy - window.y0 as f64, local.lobe_px, window.height);
            for row in 0..window.height {
                let of_row = spot.flux * f64::from(down.values()[row]);
                let columns = across.values()[..window.width].iter();
                self.light
                    .extend(columns.map(|value| of_row * f64::from(*value)));
            }
        }
        // Weighted by the square root, so that the matrix is a product.
        let roots: Vec<f64> = pixels.iter().map(|[weight, _]| weight.sqrt()).collect();
        for light in self.light.chunks_exact_mut(count) {
            for (light, root) in light.iter_mut().zip(&roots) {
                *light *= root;
            }
        }
        let values = pixels
            .iter()
            .zip(&roots)
            .map(|([_, value], root)| value * root);
        let values = DVector::from_iterator(count, values);
        let light = DMatrix::from_column_slice(count, local.lobes.len(), &self.light);
        self.matrix.gemm_tr(1.0, &light, &light, 1.0);
        self.right.gemv_tr(1.0, &light, &values, 1.0);
    }

    /// The non-negative shares, by coordinate descent from those expected, which count as known to
    /// within a part of themselves.
    fn solve(&self, expected: &[f64]) -> Vec<f64> {
        const SWEEPS: usize = 300;
        /// Descent ends when no share changes by more.
        const MIN_CHANGE: f64 = 1e-6;
        /// Uncertainty of what is expected: of the share, and of the largest share.
        const UNCERTAIN: [f64; 2] = [0.5, 0.3];
        let largest = expected.iter().copied().fold(0.0, f64::max);
        let mut shares = expected.to_vec();
        let weights: Vec<f64> = expected
            .iter()
            .map(|share| (UNCERTAIN[0] * share + UNCERTAIN[1] * largest).powi(-2))
            .collect();
        for _ in 0..SWEEPS {
            let mut moved = 0.0f64;
            for k in 0..shares.len() {
                let column = self.matrix.column(k);
                let product: f64 = column.iter().zip(&shares).map(|(a, s)| a * s).sum();
                let slope = self.right[k] - product - weights[k] * (shares[k] - expected[k]);
                let share = (shares[k] + slope / (column[k] + weights[k])).max(0.0);
                moved = moved.max((share - shares[k]).abs());
                shares[k] = share;
            }
            if moved < MIN_CHANGE {
                break;
            }
        }
        shares
    }
}
