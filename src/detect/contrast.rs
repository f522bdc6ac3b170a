//! Light that is sharper than the optics: hot pixels, cosmic rays, defective columns.
//!
//! A camera spreads the light of each star over the pixels beside it. In a row or a column, the two
//! pixels beside one of light L have at least `2 P₁/P₀ · L` together, where P₀ and P₁ are the shares
//! of a spot centred on a pixel: elsewhere in the pixel a spot gives them more. As light adds up, the
//! bound holds for all that came through the lens, and not only for single stars: blends, trails,
//! comets, the Moon. What is darker beside a bright pixel did not come through it.
//!
//! # Reference
//! van Dokkum 2001, PASP 113, 1420, doi 10.1086/323894, tells cosmic rays by their edges, too.

use super::background::Mesh;
use super::pixels::View;
use super::psf::centered_profile;
use std::sync::LazyLock;

/// Sharper spots than this are of single pixels: no lens draws them, in pixels.
pub(crate) const HOT_PIXEL_PX: f64 = 0.28;

/// A bright pixel and the light beside it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Contrast {
    /// Light in the pixel above the background, in ADU.
    top: f64,
    /// Light in the two pixels beside it, along x and along y, in ADU: NaN where one is missing.
    beside: [f64; 2],
    /// Noise of a pixel, in ADU.
    noise: f64,
}

impl Contrast {
    /// That of the pixel in column `x` and row `y`.
    pub fn measure(view: &View<'_>, background: &Mesh, x: usize, y: usize) -> Self {
        let (level, noise) = background.at(x as f32, y as f32);
        let above = |x: Option<usize>, y: Option<usize>| match (x, y) {
            (Some(x), Some(y)) if x < view.width && y < view.height => {
                f64::from(view.at(x, y) - level)
            }
            _ => f64::NAN,
        };
        let across = above(x.checked_sub(1), Some(y)) + above(Some(x + 1), Some(y));
        let down = above(Some(x), y.checked_sub(1)) + above(Some(x), Some(y + 1));
        Self {
            top: above(Some(x), Some(y)),
            beside: [across, down],
            noise: f64::from(noise),
        }
    }

    /// That of the brightest pixel next to or at (x, y).
    pub fn near(view: &View<'_>, background: &Mesh, x: usize, y: usize) -> Self {
        let columns = x.saturating_sub(1)..(x + 2).min(view.width);
        let rows = y.saturating_sub(1)..(y + 2).min(view.height);
        let mut brightest = (f32::NEG_INFINITY, x, y);
        for row in rows {
            for column in columns.clone() {
                let value = view.at(column, row);
                // False where it is NaN.
                if value >= brightest.0 {
                    brightest = (value, column, row);
                }
            }
        }
        let (_, x, y) = brightest;
        Self::measure(view, background, x, y)
    }

    /// In how many of both directions the light beside the pixel is less than the `least` that spots
    /// leave there ([`least_beside`]), beyond `sigmas` standard deviations of noise, which `shot_adu` per
    /// ADU of light adds to.
    pub fn sharp_directions(&self, least: f64, sigmas: f64, shot_adu: f64) -> usize {
        let of_light = shot_adu * self.top.max(0.0) * least * (1.0 + least);
        let variance = (2.0 + least * least) * self.noise * self.noise + of_light;
        let limit = least * self.top - sigmas * variance.sqrt();
        self.beside.iter().filter(|&&light| light < limit).count()
    }

    /// Whether the pixel is hot, or part of a cosmic ray, as far as a frame says of whose spots
    /// nothing is known.
    pub fn is_sharper_than_any_spot(&self) -> bool {
        static LEAST: LazyLock<f64> = LazyLock::new(|| least_beside(HOT_PIXEL_PX));
        self.sharp_directions(*LEAST, 0.0, 0.0) > 0
    }
}

/// The least light in the two pixels beside one, over that in it, of spots of this size and wider.
pub(crate) fn least_beside(spot_px: f64) -> f64 {
    let profile = centered_profile(spot_px, 1);
    2.0 * profile[1] / profile[0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect::psf::AxisProfile;
    use proptest::prelude::*;

    /// The contrast of the brightest pixel of a noiseless scene of `size` by `size` pixels.
    fn contrast_of(scene: &[f64], size: usize) -> Contrast {
        let at = |x: usize, y: usize| scene[y * size + x];
        let inner = (1..size - 1).flat_map(|y| (1..size - 1).map(move |x| (x, y)));
        let brightest = inner.max_by(|a, b| at(a.0, a.1).total_cmp(&at(b.0, b.1)));
        let (x, y) = brightest.unwrap();
        Contrast {
            top: at(x, y),
            beside: [at(x - 1, y) + at(x + 1, y), at(x, y - 1) + at(x, y + 1)],
            noise: 0.0,
        }
    }

    fn draw(stars: &[(f64, f64, f64)], spot_px: f64, size: usize) -> Vec<f64> {
        let mut scene = vec![0.0; size * size];
        for &(x, y, flux) in stars {
            let (mut across, mut down) = (AxisProfile::default(), AxisProfile::default());
            across.fill(x, spot_px, size);
            down.fill(y, spot_px, size);
            for (i, pixel) in scene.iter_mut().enumerate() {
                let share = across.values()[i % size] * down.values()[i / size];
                *pixel += flux * f64::from(share);
            }
        }
        scene
    }

    proptest! {
        #[test]
        fn nothing_that_came_through_the_lens_is_sharper(
            stars in prop::collection::vec((3.0..9.0, 3.0..9.0, 1.0..100.0), 1..12),
            spot_px in 0.3..2.0,
        ) {
            let contrast = contrast_of(&draw(&stars, spot_px, 13), 13);
            prop_assert_eq!(contrast.sharp_directions(least_beside(0.98 * spot_px), 0.0, 0.0), 0);
        }
    }

    #[test]
    fn a_hot_pixel_is_sharp_both_ways_and_a_cosmic_ray_one_way() {
        let mut scene = vec![0.0; 13 * 13];
        scene[6 * 13 + 6] = 100.0;
        let hot = contrast_of(&scene, 13);
        assert_eq!(hot.sharp_directions(least_beside(0.5), 0.0, 0.0), 2);
        assert!(hot.is_sharper_than_any_spot());
        for x in 4..9 {
            scene[6 * 13 + x] = 80.0 + x as f64;
        }
        let ray = contrast_of(&scene, 13);
        assert_eq!(ray.sharp_directions(least_beside(0.5), 0.0, 0.0), 1);
    }

    #[test]
    fn noise_makes_no_faint_star_sharp() {
        let contrast = Contrast {
            top: 10.0,
            beside: [0.0, 8.0],
            noise: 2.0,
        };
        assert_eq!(contrast.sharp_directions(least_beside(0.6), 0.0, 0.0), 1);
        assert_eq!(contrast.sharp_directions(least_beside(0.6), 4.0, 0.0), 0);
    }
}
