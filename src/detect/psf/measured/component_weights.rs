//! The weights of the mixture: non-negative least squares over the pixels of all stars.

use super::stars::{PsfStar, StarFitter};
use crate::base::size::Size;
use crate::detect::fit::{BLOCK, Block, products_in_lanes, sum_of};
use crate::detect::psf::{
    EffectivePsf, FieldComponent, FieldForm, GROUP_PX, GaussianComponent, LitPart, LocalPsf,
    NarrowProfiles, PixelGroup, SpotMoments, covariance, each_of, inverse, plus,
};
use multiversion::multiversion;
use nalgebra::DMatrix;
use std::ops::Range;

/// Standard deviation of a component over that of the spot along its shorter axis.
const COMPONENT_SIZE: f64 = 0.55;
/// A component is not larger than this, in pixels: the pixels blur the edges of a spot no more.
const MAX_COMPONENT_PX: f64 = 0.65;
/// Where that would be too many components, they are larger, up to this over that of the spot.
const MAX_COMPONENT_SIZE: f64 = 0.85;
/// Distance of the components over their standard deviation: a sum of such components has no ripples.
const PITCH: f64 = 1.15;
/// Half axes of the ellipse of the components, in standard deviations of the spot.
const REACH_SIGMAS: f64 = 2.8;
/// Most components.
const MAX_COMPONENTS: f64 = 120.0;
/// Components with a smaller share are left out.
const MIN_WEIGHT: f64 = 1.5e-3;

/// The components that a PSF may have.
#[derive(Debug, Clone)]
pub(super) struct ComponentGrid {
    /// Moments of the spots that it is for.
    pub typical: SpotMoments,
    /// With shares of one.
    components: Vec<GaussianComponent>,
    /// Distance of each from the centre in standard deviations of the spot without the components' own
    /// width.
    distances: Vec<f64>,
    /// Components of the same number have the same share: where the PSF is the same turned by 180
    /// degrees; where it is the same reflected at the x axis; and where it is both.
    turned: Vec<usize>,
    reflected: Vec<usize>,
    both: Vec<usize>,
}

impl ComponentGrid {
    /// For spots of these moments.
    pub fn of(typical: SpotMoments) -> Self {
        let elongation = libm::hypot(typical[1], typical[2]);
        let minor_px = libm::exp(typical[0] - 0.5 * elongation);
        let ratio = libm::exp(elongation);
        let area_px2 = std::f64::consts::PI * REACH_SIGMAS.powi(2) * ratio * minor_px.powi(2);
        let wanted_px = (COMPONENT_SIZE * minor_px).min(MAX_COMPONENT_PX);
        let least_px = (area_px2 / MAX_COMPONENTS).sqrt() / PITCH;
        let sigma_px = wanted_px.max(least_px).min(MAX_COMPONENT_SIZE * minor_px);
        let pitch_px = PITCH * sigma_px;
        let total = covariance(typical);
        let outline = inverse(total);
        let [[xx, xy], [_, yy]] = total;
        let own = sigma_px * sigma_px;
        // Of the components, without their own width.
        let density = inverse([[xx - own, xy], [xy, yy - own]]);
        let square = |[[xx, xy], [_, yy]]: [[f64; 2]; 2], [x, y]: [f64; 2]| {
            xx * x * x + 2.0 * xy * x * y + yy * y * y
        };
        let steps = (REACH_SIGMAS * minor_px * ratio / pitch_px).ceil() as i32;
        let places = (-steps..=steps).flat_map(|row| {
            (-steps..=steps).map(move |column| [column, row].map(|i| f64::from(i) * pitch_px))
        });
        let components: Vec<GaussianComponent> = places
            .filter(|&place| square(outline, place) <= REACH_SIGMAS.powi(2))
            .map(|offset_px| GaussianComponent {
                offset_px,
                sigma_px,
                share: 1.0,
            })
            .collect();
        let distance = |component: &GaussianComponent| square(density, component.offset_px).sqrt();
        let distances: Vec<f64> = components.iter().map(distance).collect();
        let class_of = |image: fn([f64; 2]) -> [f64; 2]| -> Vec<usize> {
            let near =
                |a: [f64; 2], b: [f64; 2]| libm::hypot(a[0] - b[0], a[1] - b[1]) < 0.1 * pitch_px;
            let class = |(number, component): (usize, &GaussianComponent)| {
                let at = image(component.offset_px);
                let is_same = |other: &GaussianComponent| near(other.offset_px, at);
                components
                    .iter()
                    .position(is_same)
                    .map_or(number, |other| other.min(number))
            };
            components.iter().enumerate().map(class).collect()
        };
        let turned = class_of(|[x, y]| [-x, -y]);
        let reflected = class_of(|[x, y]| [x, -y]);
        let both = class_of(|[x, y]| [-x.abs(), -y.abs()]);
        Self {
            typical,
            components,
            distances,
            turned,
            reflected,
            both,
        }
    }

    /// The class of each number of shares.
    fn classes(&self, form: FieldForm) -> Vec<usize> {
        let count = self.components.len();
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
    fn expected_weights(&self) -> Vec<f64> {
        let share = |sigmas: &f64| libm::exp(-0.5 * sigmas * sigmas);
        let mut shares: Vec<f64> = self.distances.iter().map(share).collect();
        let sum: f64 = shares.iter().sum();
        shares.iter_mut().for_each(|share| *share /= sum);
        shares
    }

    /// The components of a Gaussian.
    pub fn gaussian(&self) -> Vec<FieldComponent> {
        let shares = self.expected_weights();
        self.with_weights(&[&shares, &shares])
    }

    /// The components that have light, with shares at the centre and in the corners.
    fn with_weights(&self, [centre, corner]: &[&[f64]; 2]) -> Vec<FieldComponent> {
        let [in_centre, in_corner] = [centre, corner].map(|shares| shares.iter().sum::<f64>());
        let component =
            |((component, centre), corner): ((&GaussianComponent, &f64), &f64)| FieldComponent {
                component: GaussianComponent {
                    share: centre / in_centre,
                    ..*component
                },
                corner_share: corner / in_corner,
            };
        let components = self
            .components
            .iter()
            .zip(*centre)
            .zip(*corner)
            .map(component);
        let has_light = |l: &FieldComponent| l.component.share.max(l.corner_share) > MIN_WEIGHT;
        components.filter(has_light).collect()
    }

    /// The normal equations of each half of the stars, those of even and of odd numbers, for a PSF
    /// that changes over the field as `psf` does.
    ///
    /// `classes`: components of the same number always have the same share.
    fn sums<'s>(
        &self,
        psf: &EffectivePsf,
        stars: impl IntoIterator<Item = &'s PsfStar>,
        classes: &[usize],
        fitter: &mut StarFitter,
    ) -> [ComponentEquations; 2] {
        let classes = ImageClasses::new(classes);
        let mut of_halves = [(); 2].map(|()| LaneSums::new(psf.form, &classes));
        let mut images = ComponentImages::default();
        let mut local = LocalPsf::default();
        let every_component = self.components.iter().map(|&component| FieldComponent {
            component,
            corner_share: component.share,
        });
        let all = EffectivePsf {
            components: every_component.collect(),
            ..psf.clone()
        };
        fitter.tabulate(psf);
        for (number, star) in stars.into_iter().enumerate() {
            let (x_px, y_px) = (star.spot.x, star.spot.y);
            fitter.weigh(star, psf, &mut images.roots, &mut images.values);
            all.place_components(x_px, y_px, &mut local);
            images.draw(star, &local, &classes);
            let outward = psf.moments.frame.distance(x_px, y_px);
            of_halves[number % 2].add(&images, outward);
        }
        of_halves.map(|sums| ComponentEquations::of(sums, classes.clone()))
    }

    /// [`Self::sums`] for solutions of the form of `psf` alone.
    pub fn sums_of_form<'s>(
        &self,
        psf: &EffectivePsf,
        stars: impl IntoIterator<Item = &'s PsfStar>,
        fitter: &mut StarFitter,
    ) -> [ComponentEquations; 2] {
        let all = self.classes(psf.form);
        // In the corners fewer shares are the same than in the centre.
        let classes = match psf.form {
            FieldForm::Symmetric | FieldForm::Fixed => &all,
            FieldForm::Radial => &self.reflected,
        };
        self.sums(psf, stars, classes, fitter)
    }

    /// [`Self::sums`] for solutions of [`FieldForm::Symmetric`] and [`FieldForm::Fixed`].
    pub fn sums_of_fixed(
        &self,
        psf: &EffectivePsf,
        stars: &[PsfStar],
        fitter: &mut StarFitter,
    ) -> [ComponentEquations; 2] {
        self.sums(psf, stars, &self.classes(FieldForm::Fixed), fitter)
    }

    /// The shares that fit best: of the centre, and where the PSF changes of the corners. The search
    /// begins with `near` ones where there are any.
    pub fn weights(
        &self,
        sums: &ComponentEquations,
        form: FieldForm,
        near: Option<&[f64]>,
    ) -> Vec<f64> {
        let expected = self.expected_weights();
        sums.solve(&expected, near, &self.classes(form))
    }

    /// The components that have light, with these [`Self::weights`].
    pub fn components_of(&self, shares: &[f64]) -> Vec<FieldComponent> {
        let corner = shares
            .chunks(self.components.len())
            .last()
            .unwrap_or_default();
        self.with_weights(&[&shares[..self.components.len()], corner])
    }

    /// The components that fit best.
    pub fn solve(&self, sums: &ComponentEquations, form: FieldForm) -> Vec<FieldComponent> {
        self.components_of(&self.weights(sums, form, None))
    }
}

/// The images of components that have the same share, which are summed.
#[derive(Debug, Clone)]
struct ImageClasses {
    /// The image that each component is a part of.
    of_components: Vec<usize>,
    /// The first component of each image.
    first_components: Vec<usize>,
}

impl ImageClasses {
    /// An image for each class of components.
    fn new(classes: &[usize]) -> Self {
        let (of_components, _) = ranks(classes);
        let mut first_components = Vec::new();
        for (component, image) in of_components.iter().enumerate() {
            if *image == first_components.len() {
                first_components.push(component);
            }
        }
        Self {
            of_components,
            first_components,
        }
    }

    /// Number of images, empty ones included that fill the last block.
    fn padded_count(&self) -> usize {
        self.first_components.len().next_multiple_of(BLOCK)
    }
}

/// The rank of each class among all, and the number of classes.
fn ranks(classes: &[usize]) -> (Vec<usize>, usize) {
    let mut names = classes.to_vec();
    names.sort_unstable();
    names.dedup();
    let rank = |class: &usize| names.binary_search(class).unwrap_or_default();
    (classes.iter().map(rank).collect(), names.len())
}

/// The pixels of one star and the light of each image in them, over their noise.
#[derive(Debug, Default)]
struct ComponentImages {
    /// Block by block, each row by row; empty images fill the last block.
    light: Vec<Block>,
    /// Rows of each block that have light, and groups in these: the first, and the one after the last.
    lit: Vec<[[usize; 2]; 2]>,
    /// Groups in a row.
    width: usize,
    /// The pixels above the background, times the square roots of their weights.
    values: Vec<PixelGroup>,
    /// Square roots of the weights.
    roots: Vec<PixelGroup>,
    profiles: NarrowProfiles,
}

impl ComponentImages {
    /// Draws components with shares of one, for pixels with weights and values.
    fn draw(&mut self, star: &PsfStar, local: &LocalPsf, classes: &ImageClasses) {
        let PsfStar { window, spot, .. } = star;
        let pixels = self.values.len();
        let count = classes.padded_count();
        self.width = window.groups();
        self.lit.clear();
        self.lit.resize(count / BLOCK, [[usize::MAX, 0]; 2]);
        self.light.clear();
        let empty = [[0.0; GROUP_PX]; BLOCK];
        self.light.resize(count / BLOCK * pixels, empty);
        let flux = (spot.flux / window.noise_adu) as f32;
        let place = [spot.x - window.x0 as f64, spot.y - window.y0 as f64];
        draw_weighted_components(
            self,
            flux,
            &local.components,
            &classes.of_components,
            place,
            window.size(),
        );
    }

    /// The groups in which both of two blocks have light, the first of them in a row and the one after
    /// the last, and the rows; `None` where there are none.
    fn lit_by_both(&self, blocks: [usize; 2]) -> Option<[[usize; 2]; 2]> {
        let [a, b] = blocks.map(|block| self.lit[block]);
        let both = [0, 1].map(|axis| [a[axis][0].max(b[axis][0]), a[axis][1].min(b[axis][1])]);
        both.iter().all(|[first, end]| first < end).then_some(both)
    }

    /// Where the groups of this part of a window are.
    fn span(&self, [[first_row, end_row], [first, end]]: [[usize; 2]; 2]) -> Range<usize> {
        first_row * self.width + first..(end_row - 1) * self.width + end
    }

    /// The light of the images of a block.
    fn block(&self, block: usize) -> &[Block] {
        &self.light[block * self.values.len()..][..self.values.len()]
    }
}

/// Adds components to the images that they are a part of, with a spot at this place in a window of this size.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn draw_weighted_components(
    images: &mut ComponentImages,
    flux: f32,
    components: &[GaussianComponent],
    of_components: &[usize],
    [x_px, y_px]: [f64; 2],
    size: Size,
) {
    let ComponentImages {
        light,
        lit,
        width,
        roots,
        profiles,
        ..
    } = images;
    let pixels = roots.len();
    for (component, &image) in components.iter().zip(of_components) {
        let [dx, dy] = component.offset_px;
        let part = profiles.fill([x_px + dx, y_px + dy], component.sigma_px, size);
        let of_component = [part.rows, part.groups];
        for ([first, end], [of_first, of_end]) in lit[image / BLOCK].iter_mut().zip(of_component) {
            (*first, *end) = ((*first).min(of_first), (*end).max(of_end));
        }
        let block = &mut light[image / BLOCK * pixels..][..pixels];
        add_weighted_component(flux, profiles, part, block, roots, image % BLOCK, *width);
    }
}

/// Adds a component to the image of this number of a block, in rows of `width` groups, times the square
/// roots of the weights.
#[inline(always)]
fn add_weighted_component(
    flux: f32,
    profiles: &NarrowProfiles,
    part: LitPart,
    block: &mut [Block],
    roots: &[PixelGroup],
    image: usize,
    width: usize,
) {
    for row in part.rows[0]..part.rows[1] {
        let of_row = flux * profiles.down(row, &part).value;
        for group in part.groups[0]..part.groups[1] {
            let columns = profiles.across(group, &part).value;
            let at = row * width + group;
            let light = each_of(&columns, &roots[at], |column, root| of_row * column * root);
            let into = &mut block[at][image];
            *into = plus(into, &light);
        }
    }
}

/// Sums of the products of two blocks, lane by lane: to add the lanes of each star would take longer
/// than the products.
type BlockProducts = [[PixelGroup; BLOCK]; BLOCK];

/// [`ComponentEquations`] lane by lane, while stars are added.
#[derive(Debug)]
struct LaneSums {
    /// For each of the parts that two shares have: of blocks i ≤ j, those with j = 0, with 1, …
    products: Vec<Vec<BlockProducts>>,
    /// For each set of shares, block by block.
    right: Vec<Vec<Block>>,
}

impl LaneSums {
    fn new(form: FieldForm, classes: &ImageClasses) -> Self {
        let sets = match form {
            FieldForm::Symmetric | FieldForm::Fixed => 1,
            FieldForm::Radial => 2,
        };
        let blocks = classes.padded_count() / BLOCK;
        let empty = [[0.0; GROUP_PX]; BLOCK];
        Self {
            products: vec![vec![[empty; BLOCK]; blocks * (blocks + 1) / 2]; 2 * sets - 1],
            right: vec![vec![empty; blocks]; sets],
        }
    }

    /// Adds the pixels of a star.
    fn add(&mut self, images: &ComponentImages, outward: f64) {
        let (inward, outward) = ((1.0 - outward) as f32, outward as f32);
        match self.right.len() {
            1 => add_products(images, &[1.0], &mut self.products),
            _ => {
                let parts = [inward * inward, inward * outward, outward * outward];
                add_products(images, &parts, &mut self.products);
            }
        }
        let parts: &[f32] = match self.right.len() {
            1 => &[1.0],
            _ => &[inward, outward],
        };
        add_values(images, parts, &mut self.right);
    }
}

/// Adds these parts of the products of all images to each of the sums.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn add_products(images: &ComponentImages, parts: &[f32], sums: &mut [Vec<BlockProducts>]) {
    let mut pair = 0;
    for column in 0..images.lit.len() {
        for row in 0..=column {
            if let Some(lit) = images.lit_by_both([row, column]) {
                let span = images.span(lit);
                let blocks = [
                    &images.block(row)[span.clone()],
                    &images.block(column)[span],
                ];
                let [first, end] = lit[1];
                let products = products_in_lanes(blocks, end - first, images.width);
                for (sums, part) in sums.iter_mut().zip(parts) {
                    let of_rows = sums[pair].as_flattened_mut().iter_mut();
                    for (sum, product) in of_rows.zip(products.as_flattened()) {
                        for (sum, product) in sum.iter_mut().zip(product) {
                            *sum += part * product;
                        }
                    }
                }
            }
            pair += 1;
        }
    }
}

/// Adds these parts of the products of all images and the values to each of the sums.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn add_values(images: &ComponentImages, parts: &[f32], sums: &mut [Vec<Block>]) {
    for block in 0..images.lit.len() {
        let mut products = [[0.0f32; GROUP_PX]; BLOCK];
        for (light, values) in images.block(block).iter().zip(&images.values) {
            for (product, light) in products.iter_mut().zip(light) {
                for lane in 0..GROUP_PX {
                    product[lane] += light[lane] * values[lane];
                }
            }
        }
        for (sums, part) in sums.iter_mut().zip(parts) {
            for (sum, product) in sums[block].iter_mut().zip(&products) {
                for (sum, product) in sum.iter_mut().zip(product) {
                    *sum += part * product;
                }
            }
        }
    }
}

/// Normal equations of the shares: of the centre, and where the PSF changes of the corners.
#[derive(Debug, Clone)]
pub(super) struct ComponentEquations {
    images: ImageClasses,
    /// Sums of the products of images in row i and column j; where the PSF changes, weighted
    /// with the product of the parts that two shares have: both of the centre, one, none.
    products: Vec<DMatrix<f64>>,
    /// Products of the images and the values, for each set of shares.
    right: Vec<Vec<f64>>,
}

impl ComponentEquations {
    /// Adds the lanes.
    fn of(sums: LaneSums, images: ImageClasses) -> Self {
        let count = images.padded_count();
        let matrix = |products: Vec<BlockProducts>| {
            let mut matrix = DMatrix::zeros(count, count);
            let mut products = products.into_iter();
            for column in 0..count / BLOCK {
                for (row, products) in products.by_ref().take(column + 1).enumerate() {
                    for (i, products) in products.iter().enumerate() {
                        for (j, product) in products.iter().enumerate() {
                            matrix[(row * BLOCK + i, column * BLOCK + j)] = sum_of(*product);
                        }
                    }
                }
            }
            matrix.fill_lower_triangle_with_upper_triangle();
            matrix
        };
        let values = |blocks: Vec<Block>| blocks.into_iter().flatten().map(sum_of).collect();
        Self {
            images,
            products: sums.products.into_iter().map(matrix).collect(),
            right: sums.right.into_iter().map(values).collect(),
        }
    }

    /// The sums over both.
    pub fn plus(&self, other: &Self) -> Self {
        let mut sums = self.clone();
        for (sum, other) in sums.products.iter_mut().zip(&other.products) {
            *sum += other;
        }
        let right = sums.right.iter_mut().flatten();
        for (sum, other) in right.zip(other.right.iter().flatten()) {
            *sum += other;
        }
        sums
    }

    /// The non-negative shares of the components, by coordinate descent from `near` ones, or from those of
    /// `expected`, which count as known to within a part of themselves. Shares of the same class are
    /// equal.
    fn solve(&self, expected: &[f64], near: Option<&[f64]>, classes: &[usize]) -> Vec<f64> {
        /// Uncertainty of what is expected: of the share, and of the largest share.
        const UNCERTAIN: [f64; 2] = [1.0, 0.5];
        let components = expected.len();
        let largest = expected.iter().copied().fold(0.0, f64::max);
        let (class_of, count) = ranks(classes);
        let mut matrix = DMatrix::<f64>::zeros(count, count);
        let mut right = vec![0.0; count];
        let mut shares = vec![0.0; count];
        for (number, &class) in class_of.iter().enumerate() {
            let share = expected[number % components];
            let weight = (UNCERTAIN[0] * share + UNCERTAIN[1] * largest).powi(-2);
            shares[class] = near.map_or(share, |near| near[number]);
            matrix[(class, class)] += weight;
            right[class] += weight * share;
        }
        // Of the images with the shares of each set.
        let class_of_image = |set: usize| -> Vec<usize> {
            let images = self.images.first_components.iter();
            images
                .map(|component| class_of[set * components + component])
                .collect()
        };
        let classes: Vec<Vec<usize>> = (0..self.right.len()).map(class_of_image).collect();
        for (set, of_set) in classes.iter().enumerate() {
            for (i, &at) in of_set.iter().enumerate() {
                right[at] += self.right[set][i];
                let column = &mut matrix.as_mut_slice()[at * count..(at + 1) * count];
                for (other, of_other) in classes.iter().enumerate() {
                    let products = self.products[set + other].column(i);
                    for (&class, product) in of_other.iter().zip(products.iter()) {
                        column[class] += product;
                    }
                }
            }
        }
        descend(matrix.as_slice(), &mut right, &mut shares);
        class_of.iter().map(|&class| shares[class]).collect()
    }
}

/// Coordinate descent to the non-negative solution, from the one given; `right` becomes the residual
/// of the equations. `matrix` is column by column.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn descend(matrix: &[f64], right: &mut [f64], solution: &mut [f64]) {
    const SWEEPS: usize = 200;
    /// Descent ends when no value changes by more.
    const MIN_CHANGE: f64 = 1e-5;
    let count = solution.len().max(1);
    for (column, value) in matrix.chunks_exact(count).zip(&*solution) {
        for (right, factor) in right.iter_mut().zip(column) {
            *right -= factor * value;
        }
    }
    for _ in 0..SWEEPS {
        let mut moved = 0.0f64;
        for (number, column) in matrix.chunks_exact(count).enumerate() {
            let before = solution[number];
            let after = (before + right[number] / column[number]).max(0.0);
            let change = after - before;
            if change != 0.0 {
                solution[number] = after;
                moved = moved.max(change.abs());
                for (right, factor) in right.iter_mut().zip(column) {
                    *right -= factor * change;
                }
            }
        }
        if moved < MIN_CHANGE {
            break;
        }
    }
}
