//! Lower bounds of the errors of a star's position and flux.

use crate::base::statistics::{normal_cdf, normal_density};
use nalgebra::{Matrix3, Vector3};

/// Smallest standard errors of unbiased estimates of a star's position and flux, for a known
/// background.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CramerRao {
    /// Of x, in pixels.
    pub sigma_x_px: f64,
    /// Of y, in pixels.
    pub sigma_y_px: f64,
    /// Of the flux, in electrons.
    pub sigma_flux_e: f64,
}

impl CramerRao {
    /// The bound for a pixel-integrated Gaussian spot of `spot_sigma_px` at `offset_px` from the
    /// centre of a pixel, with `flux_e` electrons above a background whose variance per pixel is
    /// `background_variance_e2`.
    ///
    /// The shot noise of the star's own light is included. The information in the variance itself
    /// is ignored.
    ///
    /// # Reference
    /// Mortensen et al. 2010, Nature Methods 7, 377, with pixels of Gaussian noise.
    pub fn of_spot(
        spot_sigma_px: f64,
        offset_px: [f64; 2],
        flux_e: f64,
        background_variance_e2: f64,
    ) -> Self {
        /// Half width of the summed window, in standard deviations of the spot, plus two pixels.
        const REACH_SIGMAS: f64 = 6.0;
        let reach = (REACH_SIGMAS * spot_sigma_px).ceil() as i32 + 2;
        let profile = |middle: f64| -> Vec<[f64; 2]> {
            let at = |pixel: i32| fraction_and_slope(f64::from(pixel) - middle, spot_sigma_px);
            (-reach..=reach).map(at).collect()
        };
        let [columns, rows] = offset_px.map(profile);
        let mut information = Matrix3::zeros();
        for [share_y, slope_y] in rows {
            for &[share_x, slope_x] in &columns {
                let share = share_x * share_y;
                let variance_e2 = background_variance_e2 + flux_e * share;
                // A pixel without noise has no light either: it adds nothing.
                if variance_e2 > 0.0 {
                    let by_place = flux_e * Vector3::new(slope_x * share_y, share_x * slope_y, 0.0);
                    let gradient = by_place + Vector3::new(0.0, 0.0, share);
                    information += gradient * gradient.transpose() / variance_e2;
                }
            }
        }
        let covariance = information.try_inverse();
        let sigma = |i| covariance.map_or(f64::INFINITY, |c: Matrix3<f64>| c[(i, i)].sqrt());
        Self {
            sigma_x_px: sigma(0),
            sigma_y_px: sigma(1),
            sigma_flux_e: sigma(2),
        }
    }
}

/// The fraction of the light in a pixel at `offset_px` from the centre of the spot, and its
/// derivative with respect to the spot's position.
fn fraction_and_slope(offset_px: f64, sigma_px: f64) -> [f64; 2] {
    let [low, high] = [-0.5, 0.5].map(|half| (offset_px + half) / sigma_px);
    [
        normal_cdf(high) - normal_cdf(low),
        (normal_density(low) - normal_density(high)) / sigma_px,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Root mean square of σ over positions in a pixel.
    fn mean_sigma_px(spot_sigma_px: f64, flux_e: f64, variance_e2: f64) -> f64 {
        let places = (0..400).map(|i| [i % 20, i / 20].map(|n| (f64::from(n) + 0.5) / 20.0 - 0.5));
        let bound = |place| CramerRao::of_spot(spot_sigma_px, place, flux_e, variance_e2);
        let sum: f64 = places.map(|place| bound(place).sigma_x_px.powi(2)).sum();
        (sum / 400.0).sqrt()
    }

    #[test]
    fn the_limits_are_those_of_photons_alone_and_of_background_alone() {
        // s_e/√F, exact to 0.1 % for spots wider than the pixel; √(8π) s_e² n/F, to 0.2 %.
        let s_e2: f64 = 1.0 + 1.0 / 12.0;
        let photons = mean_sigma_px(1.0, 1e6, 0.0);
        assert!(
            (photons / (s_e2.sqrt() / 1e3) - 1.0).abs() < 2e-3,
            "{photons}"
        );
        let background = mean_sigma_px(1.0, 100.0, 1e6);
        let expected = (8.0 * std::f64::consts::PI).sqrt() * s_e2 * 1e3 / 100.0;
        assert!((background / expected - 1.0).abs() < 5e-3, "{background}");
    }

    #[test]
    fn the_bounds_are_those_computed_elsewhere() {
        // Background 100 e, read noise 5 e: (σ, F, bound), four digits from an independent
        // computation.
        for (sigma, flux_e, expected) in [
            (0.5, 240.0, 0.0943),
            (0.7, 1217.0, 0.0376),
            (1.0, 381.0, 0.1740),
            (1.5, 49193.0, 0.0080),
        ] {
            let found = mean_sigma_px(sigma, flux_e, 125.0);
            assert!(
                (found / expected - 1.0).abs() < 0.01,
                "{sigma} {flux_e}: {found}"
            );
        }
    }

    #[test]
    fn light_alone_is_known_to_its_root() {
        let bound = CramerRao::of_spot(1.0, [0.2, -0.4], 1e4, 0.0);
        assert!((bound.sigma_flux_e - 100.0).abs() < 0.01);
        assert_eq!(
            CramerRao::of_spot(1.0, [0.0; 2], 0.0, 0.0).sigma_x_px,
            f64::INFINITY
        );
    }
}
