//! The weights of the mixture: non-negative least squares over the pixels of all stars.

use super::stars::{PsfStar, StarFitter};
use crate::detect::effective_psf::{
    EffectivePsf, FieldForm, FieldLobe, Lobe, LocalPsf, SpotMoments, covariance, inverse,
};
use crate::detect::psf::AxisProfile;
use nalgebra::{DMatrix, DVector};

/// Standard deviation of a lobe over that of the spot along its shorter axis.
const LOBE_SIZE: f64 = 0.5;
/// The same at most.
const MAX_LOBE_SIZE: f64 = 0.85;
/// Distance of the lobes over their standard deviation: a sum of such lobes has no ripples.
const PITCH: f64 = 1.15;
/// Half axes of the ellipse of the lobes, in standard deviations of the spot.
const REACH_SIGMAS: f64 = 2.8;
/// Most lobes: with more, they are larger.
const MAX_LOBES: f64 = 100.0;
/// Lobes with a smaller share are left out.
const MIN_SHARE: f64 = 1e-4;
/// Standard deviations of the lobes that wings have, over that of the spot.
const WINGS: [f64; 2] = [2.0, 4.0];

/// The lobes that a PSF may have.
#[derive(Debug, Clone)]
pub(super) struct LobeGrid {
    /// With the shares of a Gaussian.
    lobes: Vec<Lobe>,
}

impl LobeGrid {
    /// For spots of these moments, with wings or without.
    pub fn of(typical: SpotMoments, has_wings: bool) -> Self {
        let elongation = typical[1].hypot(typical[2]);
        let minor_px = (typical[0] - 0.5 * elongation).exp();
        let ratio = elongation.exp();
        let area = std::f64::consts::PI * REACH_SIGMAS.powi(2) * ratio;
        let count = area / (LOBE_SIZE * PITCH).powi(2);
        let lobe_size = LOBE_SIZE * (count / MAX_LOBES).max(1.0).sqrt();
        let sigma_px = lobe_size.min(MAX_LOBE_SIZE) * minor_px;
        let pitch_px = PITCH * sigma_px;
        let total = covariance(typical);
        let outline = inverse(total);
        let [[xx, xy], [_, yy]] = total;
        let own = sigma_px * sigma_px;
        let density = inverse([[xx - own, xy], [xy, yy - own]]);
        let square = |[[xx, xy], [_, yy]]: [[f64; 2]; 2], [x, y]: [f64; 2]| {
            xx * x * x + 2.0 * xy * x * y + yy * y * y
        };
        let steps = (REACH_SIGMAS * minor_px * ratio / pitch_px).ceil() as i32;
        let places = (-steps..=steps).flat_map(|row| {
            (-steps..=steps).map(move |column| [column, row].map(|i| f64::from(i) * pitch_px))
        });
        let mut lobes: Vec<Lobe> = places
            .filter(|&place| square(outline, place) <= REACH_SIGMAS.powi(2))
            .map(|offset_px| Lobe {
                offset_px,
                sigma_px,
                share: (-0.5 * square(density, offset_px)).exp(),
            })
            .collect();
        let sum: f64 = lobes.iter().map(|lobe| lobe.share).sum();
        lobes.iter_mut().for_each(|lobe| lobe.share /= sum);
        if has_wings {
            lobes.extend(WINGS.map(|factor| Lobe {
                offset_px: [0.0; 2],
                sigma_px: factor * typical[0].exp(),
                share: 0.0,
            }));
        }
        Self { lobes }
    }

    /// The lobes of a Gaussian.
    pub fn gaussian(&self) -> Vec<FieldLobe> {
        let shares: Vec<f64> = self.lobes.iter().map(|lobe| lobe.share).collect();
        self.with_shares(&[&shares, &shares])
    }

    /// The lobes that have light, with shares at the centre and in the corners.
    fn with_shares(&self, [centre, corner]: &[&[f64]; 2]) -> Vec<FieldLobe> {
        let [in_centre, in_corner] = [centre, corner].map(|shares| shares.iter().sum::<f64>());
        let lobe = |((lobe, centre), corner): ((&Lobe, &f64), &f64)| FieldLobe {
            lobe: Lobe {
                share: centre / in_centre,
                ..*lobe
            },
            corner_share: corner / in_corner,
        };
        let lobes = self.lobes.iter().zip(*centre).zip(*corner).map(lobe);
        let has_light = |l: &FieldLobe| l.lobe.share.max(l.corner_share) > MIN_SHARE;
        lobes.filter(has_light).collect()
    }

    /// Sets the lobes of `psf` from all stars. Returns those for the stars of even numbers, from
    /// the odd ones, and the other way round.
    pub fn solve(
        &self,
        psf: &mut EffectivePsf,
        stars: &[PsfStar],
        fitter: &mut StarFitter,
    ) -> [Vec<FieldLobe>; 2] {
        let mut even = Sums::new(self, psf.form);
        let mut odd = even.clone();
        let mut local = LocalPsf::default();
        let mut pixels = Vec::new();
        let every_lobe = self.lobes.iter().map(|&lobe| FieldLobe {
            lobe: Lobe { share: 1.0, ..lobe },
            corner_share: 1.0,
        });
        let all = EffectivePsf {
            lobes: every_lobe.collect(),
            ..psf.clone()
        };
        for (number, star) in stars.iter().enumerate() {
            let (x_px, y_px) = (star.spot.x, star.spot.y);
            fitter.weigh(star, psf, &mut pixels);
            all.place_lobes(x_px, y_px, &mut local);
            let outward = psf.moments.frame.distance(x_px, y_px);
            let half = if number % 2 == 0 { &mut even } else { &mut odd };
            half.add(star, &local, outward, &pixels);
        }
        let lobes = |sums: &Sums| {
            let shares = sums.solve(&self.lobes);
            let corner = shares.chunks(self.lobes.len()).last().unwrap_or_default();
            self.with_shares(&[&shares[..self.lobes.len()], corner])
        };
        psf.lobes = lobes(&even.plus(&odd));
        [lobes(&odd), lobes(&even)]
    }
}

/// Normal equations of the shares: of the centre, and where the PSF changes of the corners.
#[derive(Debug, Clone)]
struct Sums {
    form: FieldForm,
    matrix: DMatrix<f64>,
    right: DVector<f64>,
    /// Buffers: the light of each lobe in the pixels of a star, and the profiles of a lobe.
    light: Vec<f64>,
    axes: [AxisProfile; 2],
}

impl Sums {
    fn new(grid: &LobeGrid, form: FieldForm) -> Self {
        let sets = match form {
            FieldForm::Fixed => 1,
            FieldForm::Radial => 2,
        };
        let count = sets * grid.lobes.len();
        Self {
            form,
            matrix: DMatrix::zeros(count, count),
            right: DVector::zeros(count),
            light: Vec::new(),
            axes: Default::default(),
        }
    }

    fn plus(&self, other: &Self) -> Self {
        Self {
            matrix: &self.matrix + &other.matrix,
            right: &self.right + &other.right,
            ..self.clone()
        }
    }

    /// Adds the pixels of a star, with weights and values. The lobes have shares of one.
    fn add(&mut self, star: &PsfStar, local: &LocalPsf, outward: f64, pixels: &[[f64; 2]]) {
        let PsfStar { window, spot, .. } = star;
        let [across, down] = &mut self.axes;
        // Rows are weighted by the square root, so that the matrix is a product.
        let roots: Vec<f64> = pixels.iter().map(|[weight, _]| weight.sqrt()).collect();
        self.light.clear();
        for Lobe {
            offset_px: [dx, dy],
            sigma_px,
            ..
        } in &local.lobes
        {
            across.fill(spot.x + dx - window.x0 as f64, *sigma_px, window.width);
            down.fill(spot.y + dy - window.y0 as f64, *sigma_px, window.height);
            let columns = &across.values()[..window.width];
            let rows = &down.values()[..window.height];
            for (row, roots) in rows.iter().zip(roots.chunks_exact(window.width)) {
                let of_row = spot.flux * f64::from(*row);
                let pixels = columns.iter().zip(roots);
                self.light
                    .extend(pixels.map(|(column, root)| of_row * f64::from(*column) * root));
            }
        }
        let values = pixels
            .iter()
            .zip(&roots)
            .map(|([_, value], root)| value * root);
        let values = DVector::from_iterator(pixels.len(), values);
        let count = local.lobes.len();
        let light = DMatrix::from_column_slice(pixels.len(), count, &self.light);
        let product = light.tr_mul(&light);
        let right = light.tr_mul(&values);
        let parts: &[f64] = match self.form {
            FieldForm::Fixed => &[1.0],
            FieldForm::Radial => &[1.0 - outward, outward],
        };
        for (i, of_row) in parts.iter().enumerate() {
            let mut rows = self.right.rows_mut(i * count, count);
            rows.axpy(*of_row, &right, 1.0);
            for (j, of_column) in parts.iter().enumerate() {
                let mut block = self.matrix.view_mut((i * count, j * count), (count, count));
                block.zip_apply(&product, |sum, part| *sum += of_row * of_column * part);
            }
        }
    }

    /// The non-negative shares, by coordinate descent from those of `expected`, which count as
    /// known to within a part of themselves.
    fn solve(&self, expected: &[Lobe]) -> Vec<f64> {
        const SWEEPS: usize = 200;
        /// Descent ends when no share changes by more.
        const MIN_CHANGE: f64 = 1e-5;
        /// Uncertainty of what is expected: of the share, and of the largest share.
        const UNCERTAIN: [f64; 2] = [0.5, 0.3];
        let largest = expected.iter().map(|lobe| lobe.share).fold(0.0, f64::max);
        let expected = expected.iter().map(|lobe| lobe.share).cycle();
        let expected: Vec<f64> = expected.take(self.right.len()).collect();
        let weight = |share: &f64| (UNCERTAIN[0] * share + UNCERTAIN[1] * largest).powi(-2);
        let weights: Vec<f64> = expected.iter().map(weight).collect();
        let mut shares = expected.clone();
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
