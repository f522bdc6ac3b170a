//! Draws the spots of stars.

use super::aberrations::{Aberrations, Ray};
use super::image::ElectronImage;
use super::radial_profile::{PROFILE_SIGMAS, RadialProfile};
use crate::base::coords::PixelPoint;
use crate::base::statistics::{normal_cdf, normal_density};
use crate::camera::data_sheet::{DataSheet, SpotForm, SpotImage};
use std::f64::consts::PI;
use std::ops::Range;
use std::sync::Arc;

/// Radius of a Gaussian spot, in standard deviations: less than 10⁻¹⁴ of its light lies beyond.
const REACH_SIGMAS: f64 = 8.0;
/// Radius of a uniform disc whose standard deviation along an axis is 1.
const DISC_RADIUS: f64 = 2.0;

/// Draws spots of the camera's form.
#[derive(Debug, Clone)]
pub(super) struct SpotRenderer {
    form: SpotForm,
    aberrations: Aberrations,
    /// Of forms that are a function of the distance, but no Gaussian or disc.
    profile: Option<RadialProfile>,
    /// Of a spot from a file, and the distance of its samples in pixels.
    picture: Option<(Arc<SpotImage>, f64)>,
    /// Buffers: the rays of one star, and the fractions of a ray's light in columns and rows.
    rays: Vec<Ray>,
    columns: Vec<f64>,
    rows: Vec<f64>,
}

impl SpotRenderer {
    pub(super) fn new(sheet: &DataSheet) -> Self {
        let form = sheet.imperfections.spot_form;
        let aberrations = Aberrations::from_sheet(sheet);
        Self {
            form,
            profile: RadialProfile::tabulate(&sheet.imperfections, aberrations.ray_sigma_px()),
            picture: picture(sheet),
            aberrations,
            rays: Vec::new(),
            columns: Vec::new(),
            rows: Vec::new(),
        }
    }

    /// Standard deviation of a Gaussian that is as sharp, in pixels.
    pub(super) fn sigma_px(&self) -> f64 {
        self.aberrations.ray_sigma_px()
    }

    /// Radius of a spot, in pixels.
    pub(super) fn reach_px(&self) -> f64 {
        self.ray_reach_px() + self.aberrations.reach_px()
    }

    /// Radius of the spot of one ray, in pixels.
    fn ray_reach_px(&self) -> f64 {
        if let Some((picture, step_px)) = &self.picture {
            return picture.reach() * step_px;
        }
        let sigmas = match self.form {
            SpotForm::Gaussian | SpotForm::SampledGaussian | SpotForm::File => REACH_SIGMAS,
            SpotForm::Disc => DISC_RADIUS,
            SpotForm::Moffat | SpotForm::Airy => PROFILE_SIGMAS,
        };
        sigmas * self.sigma_px()
    }

    /// Adds a star of `electrons` at `position` to the expected electrons.
    pub(super) fn add(&mut self, image: &mut ElectronImage, position: &PixelPoint, electrons: f64) {
        let mut rays = std::mem::take(&mut self.rays);
        self.aberrations.trace(position, &mut rays);
        for Ray {
            offset_px,
            fraction: share,
        } in &rays
        {
            let place = PixelPoint::new(position.x + offset_px[0], position.y + offset_px[1]);
            self.add_ray(image, &place, share * electrons);
        }
        self.rays = rays;
    }

    fn add_ray(&mut self, image: &mut ElectronImage, position: &PixelPoint, electrons: f64) {
        let reach_px = self.ray_reach_px();
        let columns = pixels_within(position.x, reach_px, image.width());
        let rows = pixels_within(position.y, reach_px, image.height());
        if columns.is_empty() || rows.is_empty() {
            return;
        }
        if let Some(profile) = &self.profile {
            let share = |x, y| profile.fraction(x, y);
            return add_pixels(image, position, electrons, columns, rows, share);
        }
        if let Some((picture, step_px)) = &self.picture {
            let share = |x, y| picture.share(x, y, *step_px);
            return add_pixels(image, position, electrons, columns, rows, share);
        }
        if self.form == SpotForm::Disc {
            let share = |x, y| disc_fraction(x, y, reach_px);
            return add_pixels(image, position, electrons, columns, rows, share);
        }
        let sigma_px = self.sigma_px();
        for (pixels, at, into) in [
            (columns.clone(), position.x, &mut self.columns),
            (rows.clone(), position.y, &mut self.rows),
        ] {
            gaussian_profile(self.form, sigma_px, pixels, at, into);
        }
        for (y, share) in rows.zip(&self.rows) {
            let row_e = electrons * share;
            let pixels = &mut image.row_mut(y)[columns.clone()];
            for (pixel, share) in pixels.iter_mut().zip(&self.columns) {
                *pixel += row_e * share;
            }
        }
    }
}

fn picture(sheet: &DataSheet) -> Option<(Arc<SpotImage>, f64)> {
    let picture = sheet.spot_image.clone()?;
    let made = &sheet.imperfections;
    (made.spot_form == SpotForm::File).then_some((picture, made.spot_step_px))
}

/// Adds light of which `share` is the fraction in a pixel at a distance along x and y.
fn add_pixels(
    image: &mut ElectronImage,
    position: &PixelPoint,
    electrons: f64,
    columns: Range<usize>,
    rows: Range<usize>,
    share: impl Fn(f64, f64) -> f64,
) {
    for y in rows {
        let y_px = y as f64 - position.y;
        let pixels = &mut image.row_mut(y)[columns.clone()];
        for (x, pixel) in columns.clone().zip(pixels) {
            *pixel += electrons * share(x as f64 - position.x, y_px);
        }
    }
}

/// The pixels of an axis of `side` pixels whose centres are within `reach_px` plus half a pixel of
/// `at`.
fn pixels_within(at: f64, reach_px: f64, side: usize) -> Range<usize> {
    let bound = |pixel: f64| pixel.clamp(0.0, side as f64) as usize;
    let first = bound((at - reach_px).round());
    first..bound((at + reach_px).round() + 1.0).max(first)
}

/// Fractions of the light of a Gaussian at `at` in `pixels`, along one axis.
fn gaussian_profile(
    form: SpotForm,
    sigma_px: f64,
    pixels: Range<usize>,
    at: f64,
    into: &mut Vec<f64>,
) {
    into.clear();
    if form == SpotForm::SampledGaussian {
        let density = |x: usize| normal_density((x as f64 - at) / sigma_px) / sigma_px;
        return into.extend(pixels.map(density));
    }
    let before = |x: usize| normal_cdf((x as f64 - 0.5 - at) / sigma_px);
    let mut low = before(pixels.start);
    into.extend(pixels.map(|x| {
        let high = before(x + 1);
        // The difference of the upper tails is exact where both values are near 1.
        let share = if low < 0.5 {
            high - low
        } else {
            let beyond = |x: usize| normal_cdf(-(x as f64 - 0.5 - at) / sigma_px);
            beyond(x) - beyond(x + 1)
        };
        low = high;
        share
    }));
}

/// Fraction of a uniform disc in a pixel whose centre is at (x, y) from the disc's.
fn disc_fraction(x_px: f64, y_px: f64, radius_px: f64) -> f64 {
    let [left, right] = [-0.5, 0.5].map(|half| (x_px + half) / radius_px);
    let [top, bottom] = [-0.5, 0.5].map(|half| (y_px + half) / radius_px);
    let area = disc_before(right, bottom) - disc_before(left, bottom) - disc_before(right, top)
        + disc_before(left, top);
    (area / PI).max(0.0)
}

/// The area of the unit disc where X ≤ x and Y ≤ y.
fn disc_before(x: f64, y: f64) -> f64 {
    let (x, y) = (x.clamp(-1.0, 1.0), y.clamp(-1.0, 1.0));
    // The integral of √(1 − X²).
    let half_disc = |x: f64| 0.5 * (x * (1.0 - x * x).max(0.0).sqrt() + libm::asin(x));
    // Where the line Y = y leaves the disc.
    let chord = (1.0 - y * y).max(0.0).sqrt();
    let crossed = if x > -chord {
        let end = x.min(chord);
        y * (end + chord) + half_disc(end) - half_disc(-chord)
    } else {
        0.0
    };
    if y < 0.0 {
        return crossed;
    }
    let whole = |from: f64, to: f64| 2.0 * (half_disc(to) - half_disc(from));
    let left = whole(-1.0, x.min(-chord));
    let right = if x > chord { whole(chord, x) } else { 0.0 };
    left + crossed + right
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::data_sheet::Preset;

    const SIDE: usize = 64;

    /// The pixels of a spot on an empty frame.
    fn drawn(form: SpotForm, sigma_px: f64, at: (f64, f64)) -> Vec<f64> {
        let mut image = ElectronImage::new(SIDE, SIDE, 0.0);
        let position = PixelPoint::new(at.0, at.1);
        let mut sheet = Preset::Experiment1.data_sheet();
        sheet.spot_sigma_px = sigma_px;
        sheet.imperfections.spot_form = form;
        SpotRenderer::new(&sheet).add(&mut image, &position, 1.0);
        image.into_pixels()
    }

    /// Mean and variance along x and y of light that adds up to 1.
    fn moments(pixels: &[f64]) -> [(f64, f64); 2] {
        let coordinate = |axis: usize, i: usize| [i % SIDE, i / SIDE][axis] as f64;
        [0, 1].map(|axis| {
            let sum = |f: &dyn Fn(f64) -> f64| -> f64 {
                let terms = pixels.iter().enumerate();
                terms.map(|(i, light)| light * f(coordinate(axis, i))).sum()
            };
            let mean = sum(&|x| x);
            (mean, sum(&|x| (x - mean).powi(2)))
        })
    }

    #[test]
    fn a_gaussian_from_a_file_is_drawn_as_a_gaussian() {
        const STEP_PX: f64 = 0.05;
        let density = |i: i32, j: i32| {
            let distance = f64::from(i).hypot(f64::from(j)) * STEP_PX;
            normal_density(distance / 1.2)
        };
        let row = |j: i32| {
            let samples: Vec<String> = (-120..=120).map(|i| density(i, j).to_string()).collect();
            samples.join(",") + "\n"
        };
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("psf.csv");
        std::fs::write(&path, (-120..=120).map(row).collect::<String>()).unwrap();
        let mut sheet = Preset::Experiment1.data_sheet();
        sheet.spot_image = Some(Arc::new(SpotImage::read(&path).unwrap()));
        sheet.imperfections.spot_step_px = STEP_PX;
        sheet.imperfections.spot_form = SpotForm::File;
        let mut image = ElectronImage::new(SIDE, SIDE, 0.0);
        SpotRenderer::new(&sheet).add(&mut image, &PixelPoint::new(31.3, 30.8), 1.0);
        let expected = drawn(SpotForm::Gaussian, 1.2, (31.3, 30.8));
        for (found, expected) in image.into_pixels().iter().zip(&expected) {
            assert!((found - expected).abs() < 3e-5, "{found} {expected}");
        }
    }

    #[test]
    fn no_light_is_lost_and_its_middle_and_width_are_those_asked_for() {
        for (form, sigma) in [
            (SpotForm::Gaussian, 0.7),
            (SpotForm::Gaussian, 1.16),
            (SpotForm::Gaussian, 1.5),
            (SpotForm::Disc, 0.9),
            (SpotForm::Disc, 3.2),
        ] {
            let pixels = drawn(form, sigma, (31.3, 30.8));
            assert!((pixels.iter().sum::<f64>() - 1.0).abs() < 1e-12, "{form:?}");
            let [(x, var_x), (y, var_y)] = moments(&pixels);
            // Effect of sampling by pixels on narrow spots, most on those with sharp edges.
            let tolerance_px = if form == SpotForm::Disc { 0.02 } else { 1e-3 };
            assert!((x - 31.3).abs() < tolerance_px, "{form:?} {x}");
            assert!((y - 30.8).abs() < tolerance_px, "{form:?} {y}");
            // A pixel adds 1/12.
            let expected = sigma * sigma + 1.0 / 12.0;
            for variance in [var_x, var_y] {
                assert!(
                    (variance / expected - 1.0).abs() < 0.02,
                    "{form:?} {variance}"
                );
            }
        }
    }

    #[test]
    fn a_pixel_of_the_integrated_spot_is_its_integral_to_the_twelfth_digit() {
        // Simpson's rule in both directions over each pixel, independent of the error function.
        let (sigma, at) = (0.83, (20.37, 19.71));
        let pixels = drawn(SpotForm::Gaussian, sigma, at);
        const STEPS: i32 = 2000;
        let simpson = |middle: f64, pixel: f64| {
            let value = |step: i32| {
                let x = pixel - 0.5 + f64::from(step) / f64::from(STEPS);
                let weight = match step {
                    0 | STEPS => 1.0,
                    odd if odd % 2 == 1 => 4.0,
                    _ => 2.0,
                };
                weight * (-0.5 * ((x - middle) / sigma).powi(2)).exp()
            };
            let sum: f64 = (0..=STEPS).map(value).sum();
            sum / (3.0 * f64::from(STEPS)) / (sigma * (2.0 * PI).sqrt())
        };
        for y in 14..27 {
            for x in 14..27 {
                let expected = simpson(at.0, x as f64) * simpson(at.1, y as f64);
                let found = pixels[y * SIDE + x];
                assert!(
                    (found - expected).abs() < 1e-12,
                    "{x} {y}: {found} {expected}"
                );
            }
        }
    }

    #[test]
    fn pixels_are_those_reckoned_to_twenty_digits() {
        use SpotForm::{Disc, Gaussian, SampledGaussian};
        // Computed with mpmath 1.3 to 40 digits: Gauss-Legendre quadrature of the density over the
        // pixel, or of the disc's chords between the points where its edge crosses the pixel's
        // sides.
        #[rustfmt::skip]
        #[expect(clippy::excessive_precision, reason = "as they were reckoned")]
        let expected = [
            (Gaussian, 0.3, (20.0, 20.0), (20, 20), 0.81797426199018009441),
            (Gaussian, 0.3, (20.4, 19.7), (21, 19), 0.093238461835950870812),
            (Gaussian, 0.7, (20.25, 20.5), (20, 21), 0.21066766941046535962),
            (Gaussian, 0.7, (19.9, 20.1), (23, 17), 1.0353863102747089507e-8),
            (Gaussian, 1.16, (20.123, 19.877), (20, 20), 0.11009089206531478308),
            (Gaussian, 1.5, (20.5, 20.5), (24, 16), 0.000064352133200481938877),
            (Gaussian, 3.2, (20.01, 20.99), (26, 19), 0.0022386401125279849683),
            (Gaussian, 5.0, (20.3, 20.7), (12, 26), 0.00091807434988918578866),
            (SampledGaussian, 0.3, (20.0, 20.0), (20, 20), 1.7683882565766149728),
            (SampledGaussian, 0.3, (20.4, 19.7), (21, 19), 0.015730501510788826778),
            (SampledGaussian, 0.7, (20.25, 20.5), (20, 21), 0.23612245543819085562),
            (SampledGaussian, 0.7, (19.9, 20.1), (23, 17), 9.8658456046008851930e-10),
            (SampledGaussian, 1.16, (20.123, 19.877), (20, 20), 0.11695566025642592339),
            (SampledGaussian, 1.5, (20.5, 20.5), (24, 16), 0.000051649527794653768694),
            (SampledGaussian, 3.2, (20.01, 20.99), (26, 19), 0.0022216592515863197181),
            (SampledGaussian, 5.0, (20.3, 20.7), (12, 26), 0.00091521377025879859677),
            (Disc, 0.3, (20.0, 20.0), (20, 20), 0.84079003836418743852),
            (Disc, 0.3, (20.4, 19.7), (21, 19), 0.11077458090866429701),
            (Disc, 0.7, (20.25, 20.5), (20, 21), 0.16240300315499526119),
            (Disc, 0.7, (19.9, 20.1), (23, 17), 0.0),
            (Disc, 1.16, (20.123, 19.877), (20, 20), 0.059139024632838643618),
            (Disc, 1.5, (20.5, 20.5), (24, 16), 0.0),
            (Disc, 3.2, (20.01, 20.99), (26, 19), 0.0045474121921354675421),
            (Disc, 5.0, (20.3, 20.7), (12, 26), 0.0021426487366337305602),
        ];
        for (form, sigma_px, at, (x, y), share) in expected {
            let found = drawn(form, sigma_px, at)[y * SIDE + x];
            assert!(
                (found - share).abs() < 1e-12,
                "{form:?} {sigma_px} {at:?} {x} {y}: {found} {share}"
            );
        }
    }

    #[test]
    fn the_sampled_spot_is_the_density_in_the_middle_of_each_pixel() {
        let pixels = drawn(SpotForm::SampledGaussian, 0.5, (20.25, 20.0));
        let expected = |x: f64, y: f64| (-2.0 * (x * x + y * y)).exp() * 2.0 / PI;
        for (x, y) in [(20, 20), (21, 20), (19, 22)] {
            let density = expected(x as f64 - 20.25, y as f64 - 20.0);
            assert!((pixels[y * SIDE + x] - density).abs() < 1e-14);
        }
        // Its total light depends on the position within the pixel.
        let centred = drawn(SpotForm::SampledGaussian, 0.3, (20.0, 20.0));
        assert!(centred.iter().sum::<f64>() > 1.5);
    }

    #[test]
    fn a_disc_is_even_inside_and_nothing_outside() {
        let pixels = drawn(SpotForm::Disc, 4.0, (30.2, 31.7));
        let inside = 1.0 / (PI * 64.0);
        assert!((pixels[31 * SIDE + 33] - inside).abs() < 1e-14);
        assert_eq!(pixels[31 * SIDE + 40], 0.0);
        // Smaller than a pixel: all in one.
        let small = drawn(SpotForm::Disc, 0.1, (10.1, 9.9));
        assert!((small[10 * SIDE + 10] - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_ninth_of_the_light_is_on_the_middle_pixel_at_sigma_1_16() {
        let share = drawn(SpotForm::Gaussian, 1.16, (30.0, 30.0))[30 * SIDE + 30];
        assert!((share * 9.0 - 1.0).abs() < 0.01, "{share}");
    }

    #[test]
    fn light_beyond_the_edge_is_left_out() {
        let sum = |at| drawn(SpotForm::Gaussian, 1.0, at).iter().sum::<f64>();
        assert!((sum((-0.5, 20.0)) - 0.5).abs() < 1e-12);
        assert_eq!(sum((-40.0, 20.0)), 0.0);
        assert_eq!(sum((20.0, 1e9)), 0.0);
    }
}
