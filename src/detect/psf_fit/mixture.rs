//! The weights of the mixture: non-negative least squares over the pixels of all stars.

use super::stars::{PsfStar, StarFitter};
use crate::detect::effective_psf::{
    EffectivePsf, FieldForm, FieldLobe, Lobe, LocalPsf, SpotMoments, covariance, inverse,
};
use crate::detect::psf::{GROUP_PX, NarrowProfiles, PixelGroup};
use multiversion::multiversion;
use nalgebra::{DMatrix, DVector};

/// Standard deviation of a lobe over that of the spot along its shorter axis.
const LOBE_SIZE: f64 = 0.55;
/// A lobe is not larger than this, in pixels: the pixels blur the edges of a spot no more.
const MAX_LOBE_PX: f64 = 0.65;
/// Where that would be too many lobes, they are larger, up to this over that of the spot.
const MAX_LOBE_SIZE: f64 = 0.85;
/// Distance of the lobes over their standard deviation: a sum of such lobes has no ripples.
const PITCH: f64 = 1.15;
/// Half axes of the ellipse of the lobes, in standard deviations of the spot.
const REACH_SIGMAS: f64 = 2.8;
/// Most lobes.
const MAX_LOBES: f64 = 120.0;
/// Lobes with a smaller share are left out.
const MIN_SHARE: f64 = 1.5e-3;

/// The lobes that a PSF may have.
#[derive(Debug, Clone)]
pub(super) struct LobeGrid {
    /// Moments of the spots that it is for.
    pub typical: SpotMoments,
    /// With shares of one.
    lobes: Vec<Lobe>,
    /// Distance of each from the centre in standard deviations of the spot without the lobes' own
    /// width.
    distances: Vec<f64>,
    /// Lobes of the same number have the same share: where the PSF is the same turned by 180
    /// degrees; where it is the same reflected at the x axis; and where it is both.
    turned: Vec<usize>,
    reflected: Vec<usize>,
    both: Vec<usize>,
}

impl LobeGrid {
    /// For spots of these moments.
    pub fn of(typical: SpotMoments) -> Self {
        let elongation = typical[1].hypot(typical[2]);
        let minor_px = (typical[0] - 0.5 * elongation).exp();
        let ratio = elongation.exp();
        let area_px2 = std::f64::consts::PI * REACH_SIGMAS.powi(2) * ratio * minor_px.powi(2);
        let wanted_px = (LOBE_SIZE * minor_px).min(MAX_LOBE_PX);
        let least_px = (area_px2 / MAX_LOBES).sqrt() / PITCH;
        let sigma_px = wanted_px.max(least_px).min(MAX_LOBE_SIZE * minor_px);
        let pitch_px = PITCH * sigma_px;
        let total = covariance(typical);
        let outline = inverse(total);
        let [[xx, xy], [_, yy]] = total;
        let own = sigma_px * sigma_px;
        // Of the lobes, without their own width.
        let density = inverse([[xx - own, xy], [xy, yy - own]]);
        let square = |[[xx, xy], [_, yy]]: [[f64; 2]; 2], [x, y]: [f64; 2]| {
            xx * x * x + 2.0 * xy * x * y + yy * y * y
        };
        let steps = (REACH_SIGMAS * minor_px * ratio / pitch_px).ceil() as i32;
        let places = (-steps..=steps).flat_map(|row| {
            (-steps..=steps).map(move |column| [column, row].map(|i| f64::from(i) * pitch_px))
        });
        let lobes: Vec<Lobe> = places
            .filter(|&place| square(outline, place) <= REACH_SIGMAS.powi(2))
            .map(|offset_px| Lobe {
                offset_px,
                sigma_px,
                share: 1.0,
            })
            .collect();
        let distance = |lobe: &Lobe| square(density, lobe.offset_px).sqrt();
        let distances: Vec<f64> = lobes.iter().map(distance).collect();
        let class_of = |image: fn([f64; 2]) -> [f64; 2]| -> Vec<usize> {
            let near = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]) < 0.1 * pitch_px;
            let class = |(number, lobe): (usize, &Lobe)| {
                let at = image(lobe.offset_px);
                let is_same = |other: &Lobe| near(other.offset_px, at);
                lobes
                    .iter()
                    .position(is_same)
                    .map_or(number, |other| other.min(number))
            };
            lobes.iter().enumerate().map(class).collect()
        };
        let turned = class_of(|[x, y]| [-x, -y]);
        let reflected = class_of(|[x, y]| [x, -y]);
        let both = class_of(|[x, y]| [-x.abs(), -y.abs()]);
        Self {
            typical,
            lobes,
            distances,
            turned,
            reflected,
            both,
        }
    }

    /// The class of each number of shares.
    fn classes(&self, form: FieldForm) -> Vec<usize> {
        let count = self.lobes.len();
        match form {
            FieldForm::Symmetric => self.turned.clone(),
            FieldForm::Fixed => (0..count).collect(),
            FieldForm::Radial => {
                let corner = self.reflected.iter().map(|class| class + count);
                self.both.iter().copied().chain(corner).collect()
            }
        }
    }

    /// The shares of a Gaussian, which are expected before the stars tell.
    fn expected_shares(&self) -> Vec<f64> {
        let share = |sigmas: &f64| (-0.5 * sigmas * sigmas).exp();
        let mut shares: Vec<f64> = self.distances.iter().map(share).collect();
        let sum: f64 = shares.iter().sum();
        shares.iter_mut().for_each(|share| *share /= sum);
        shares
    }

    /// The lobes of a Gaussian.
    pub fn gaussian(&self) -> Vec<FieldLobe> {
        let shares = self.expected_shares();
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

    /// The normal equations of each half of the stars, those of even and of odd numbers, for a PSF
    /// that changes over the field as `psf` does.
    pub fn sums(
        &self,
        psf: &EffectivePsf,
        stars: &[PsfStar],
        fitter: &mut StarFitter,
    ) -> [LobeSums; 2] {
        let mut of_halves = [0; 2].map(|_| LobeSums::new(self, psf.form));
        let mut images = LobeImages::default();
        let mut local = LocalPsf::default();
        let mut pixels = Vec::new();
        let every_lobe = self.lobes.iter().map(|&lobe| FieldLobe {
            lobe,
            corner_share: lobe.share,
        });
        let all = EffectivePsf {
            lobes: every_lobe.collect(),
            ..psf.clone()
        };
        for (number, star) in stars.iter().enumerate() {
            let (x_px, y_px) = (star.spot.x, star.spot.y);
            fitter.weigh(star, psf, &mut pixels);
            all.place_lobes(x_px, y_px, &mut local);
            images.draw(star, &local, &pixels);
            let outward = psf.moments.frame.distance(x_px, y_px);
            of_halves[number % 2].add(&images, outward);
        }
        of_halves
    }

    /// The lobes that fit best.
    pub fn solve(&self, sums: &LobeSums, form: FieldForm) -> Vec<FieldLobe> {
        let shares = sums.solve(&self.expected_shares(), &self.classes(form));
        let corner = shares.chunks(self.lobes.len()).last().unwrap_or_default();
        self.with_shares(&[&shares[..self.lobes.len()], corner])
    }
}

/// The pixels of one star and the light of each lobe in them, over their noise.
#[derive(Debug, Default)]
struct LobeImages {
    /// Lobe by lobe, each in whole groups.
    light: Vec<PixelGroup>,
    /// Rows of each lobe that have light.
    rows: Vec<[usize; 2]>,
    /// Groups in a row.
    width: usize,
    values: Vec<PixelGroup>,
    /// Square roots of the weights.
    roots: Vec<PixelGroup>,
    profiles: NarrowProfiles,
}

impl LobeImages {
    /// Draws lobes with shares of one, for pixels with weights and values.
    fn draw(&mut self, star: &PsfStar, local: &LocalPsf, pixels: &[[f64; 2]]) {
        let PsfStar { window, spot, .. } = star;
        let width = window.groups();
        let empty = [0.0; GROUP_PX];
        for part in [&mut self.values, &mut self.roots] {
            part.clear();
            part.resize(width * window.height, empty);
        }
        for (number, [weight, value]) in pixels.iter().enumerate() {
            let (row, column) = (number / window.width, number % window.width);
            let (group, lane) = (row * width + column / GROUP_PX, column % GROUP_PX);
            let root = weight.sqrt();
            self.roots[group][lane] = root as f32;
            self.values[group][lane] = (root * value) as f32;
        }
        self.width = width;
        self.rows.clear();
        self.light.clear();
        self.light
            .resize(local.lobes.len() * self.values.len(), empty);
        let images = self.light.chunks_exact_mut(self.values.len());
        for (lobe, image) in local.lobes.iter().zip(images) {
            let place = [
                spot.x + lobe.offset_px[0] - window.x0 as f64,
                spot.y + lobe.offset_px[1] - window.y0 as f64,
            ];
            let size = [window.width, window.height];
            let part = self.profiles.fill(place, lobe.sigma_px, size);
            self.rows.push(part.rows);
            for row in part.rows[0]..part.rows[1] {
                let of_row = spot.flux as f32 * self.profiles.down(row, &part).value;
                for group in part.groups[0]..part.groups[1] {
                    let columns = self.profiles.across(group, &part).value;
                    let at = row * width + group;
                    let roots = &self.roots[at];
                    image[at] = std::array::from_fn(|lane| of_row * columns[lane] * roots[lane]);
                }
            }
        }
    }

    /// The groups of two images, in the rows in which both lobes have light.
    fn common(&self, i: usize, j: usize) -> [&[PixelGroup]; 2] {
        let ([a, b], [c, d]) = (self.rows[i], self.rows[j]);
        let first = a.max(c);
        let last = b.min(d).max(first);
        let count = self.values.len();
        let rows = first * self.width..last * self.width;
        [i, j].map(|lobe| &self.light[lobe * count..][rows.clone()])
    }
}

/// Normal equations of the shares: of the centre, and where the PSF changes of the corners.
#[derive(Debug, Clone)]
pub(super) struct LobeSums {
    form: FieldForm,
    matrix: DMatrix<f64>,
    right: DVector<f64>,
}

impl LobeSums {
    fn new(grid: &LobeGrid, form: FieldForm) -> Self {
        let sets = match form {
            FieldForm::Symmetric | FieldForm::Fixed => 1,
            FieldForm::Radial => 2,
        };
        let count = sets * grid.lobes.len();
        Self {
            form,
            matrix: DMatrix::zeros(count, count),
            right: DVector::zeros(count),
        }
    }

    /// The sums over both halves.
    pub fn plus(&self, other: &Self) -> Self {
        Self {
            form: self.form,
            matrix: &self.matrix + &other.matrix,
            right: &self.right + &other.right,
        }
    }

    /// Adds the pixels of a star.
    fn add(&mut self, images: &LobeImages, outward: f64) {
        let parts: &[f64] = match self.form {
            FieldForm::Symmetric | FieldForm::Fixed => &[1.0],
            FieldForm::Radial => &[1.0 - outward, outward],
        };
        let pixels = images.values.len();
        let count = images.rows.len();
        for (i, lobe) in images.light.chunks_exact(pixels).enumerate() {
            let right = dot(lobe, &images.values);
            for (set, part) in parts.iter().enumerate() {
                self.right[set * count + i] += part * right;
            }
            for j in 0..=i {
                let [lobe, other] = images.common(i, j);
                let product = dot(lobe, other);
                for (a, of_row) in parts.iter().enumerate() {
                    for (b, of_column) in parts.iter().enumerate() {
                        let part = of_row * of_column * product;
                        self.matrix[(a * count + i, b * count + j)] += part;
                        if i != j {
                            self.matrix[(a * count + j, b * count + i)] += part;
                        }
                    }
                }
            }
        }
    }

    /// The non-negative shares, by coordinate descent from those of `expected`, which count as
    /// known to within a part of themselves. Shares of the same class are equal.
    fn solve(&self, expected: &[f64], classes: &[usize]) -> Vec<f64> {
        const SWEEPS: usize = 200;
        /// Descent ends when no share changes by more.
        const MIN_CHANGE: f64 = 1e-5;
        /// Uncertainty of what is expected: of the share, and of the largest share.
        const UNCERTAIN: [f64; 2] = [1.0, 0.5];
        let largest = expected.iter().copied().fold(0.0, f64::max);
        let expected = |number: usize| expected[number % expected.len()];
        let mut names = classes.to_vec();
        names.sort_unstable();
        names.dedup();
        // Each share is that of its class.
        let class = |number: usize| names.binary_search(&classes[number]).unwrap_or_default();
        let count = names.len();
        let mut matrix = DMatrix::<f64>::zeros(count, count);
        let mut right = DVector::<f64>::zeros(count);
        let mut shares = vec![0.0; count];
        for number in 0..classes.len() {
            let at = class(number);
            let share = expected(number);
            let weight = (UNCERTAIN[0] * share + UNCERTAIN[1] * largest).powi(-2);
            shares[at] = share;
            matrix[(at, at)] += weight;
            right[at] += self.right[number] + weight * share;
            for other in 0..classes.len() {
                matrix[(at, class(other))] += self.matrix[(number, other)];
            }
        }
        for _ in 0..SWEEPS {
            let mut moved = 0.0f64;
            for k in 0..count {
                let column = matrix.column(k);
                let product: f64 = column.iter().zip(&shares).map(|(a, s)| a * s).sum();
                let share = (shares[k] + (right[k] - product) / column[k]).max(0.0);
                moved = moved.max((share - shares[k]).abs());
                shares[k] = share;
            }
            if moved < MIN_CHANGE {
                break;
            }
        }
        (0..classes.len())
            .map(|number| shares[class(number)])
            .collect()
    }
}

/// The sum of the products of pixels.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn dot(a: &[PixelGroup], b: &[PixelGroup]) -> f64 {
    let mut sum = [0.0f32; GROUP_PX];
    for (a, b) in a.iter().zip(b) {
        for lane in 0..GROUP_PX {
            sum[lane] += a[lane] * b[lane];
        }
    }
    sum.iter().copied().map(f64::from).sum()
}
