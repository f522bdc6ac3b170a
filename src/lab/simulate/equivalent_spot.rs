//! The Gaussian spot with which a star is as detectable as with the spots of a camera.

use super::image::ElectronImage;
use super::spot::SpotRenderer;
use crate::base::coords::PixelPoint;
use crate::base::statistics::normal_cdf;
use crate::camera::data_sheet::{DataSheet, SpotForm};

/// Places along each side of the frame at which spots are drawn.
const PLACES: usize = 5;
/// Standard deviations of Gaussians that are tried, in pixels, and the ratio of one to the next.
const SIGMAS_PX: [f64; 2] = [0.2, 25.0];
const SIGMA_RATIO: f64 = 1.01;

/// Sets the standard deviation of the spot, and the share of its brightest pixel where the sheet
/// states none, to those of the Gaussian that is as detectable with a matched filter; the form
/// becomes a Gaussian.
///
/// The filter is, as in [`detect`](crate::detect::detect), for one round Gaussian: the one that
/// stars all over the frame answer most to. What counts is the mean of the magnitudes.
pub(super) fn make_gaussian(sheet: &mut DataSheet) {
    let made = &sheet.imperfections;
    let is_round = made.spot_axis_ratio == 1.0
        && [made.coma_px, made.astigmatism_px, made.field_curvature_px] == [0.0; 3];
    let is_gaussian = matches!(
        made.spot_form,
        SpotForm::Gaussian | SpotForm::SampledGaussian
    );
    if is_round && is_gaussian {
        return;
    }
    let mut image = ElectronImage::new(sheet.width_px, sheet.height_px, 0.0);
    let mut renderer = SpotRenderer::new(sheet);
    let at = |side: usize, place: usize| side * (2 * place + 1) / (2 * PLACES);
    let centre = |x, y| (at(sheet.width_px, x), at(sheet.height_px, y));
    let centres = (0..PLACES).flat_map(|y| (0..PLACES).map(move |x| centre(x, y)));
    let centres: Vec<(usize, usize)> = centres.collect();
    for &(x, y) in &centres {
        renderer.add(&mut image, &PixelPoint::new(x as f64, y as f64), 1.0);
    }
    let steps = (libm::log(SIGMAS_PX[1] / SIGMAS_PX[0]) / libm::log(SIGMA_RATIO)) as i32;
    let sigmas = || (0..steps).map(|step| SIGMAS_PX[0] * SIGMA_RATIO.powi(step));
    let mean_ln_response = |sigma_px: f64| {
        let profile = profile(sigma_px);
        let ln_responses = centres
            .iter()
            .map(|&(x, y)| libm::log(response(&image, x, y, &profile)));
        ln_responses.sum::<f64>() / centres.len() as f64
    };
    let best = sigmas()
        .map(mean_ln_response)
        .fold(f64::NEG_INFINITY, f64::max);
    // The response of a Gaussian to its own filter falls with its width.
    let gain = |sigma_px: &f64| profile(*sigma_px).iter().map(|p| p * p).sum::<f64>();
    sheet.spot_sigma_px = sigmas()
        .find(|sigma| libm::log(gain(sigma)) < best)
        .unwrap_or(SIGMAS_PX[1]);
    sheet.imperfections.spot_form = SpotForm::Gaussian;
}

/// Light in the pixels along an axis, from the middle of the profile on either side.
fn profile(sigma_px: f64) -> Vec<f64> {
    /// In standard deviations.
    const REACH_SIGMAS: f64 = 3.0;
    let reach = (REACH_SIGMAS * sigma_px + 0.5).ceil() as i32;
    let edge = |at: f64| normal_cdf(at / sigma_px);
    let share = |pixel: i32| edge(f64::from(pixel) + 0.5) - edge(f64::from(pixel) - 0.5);
    (-reach..=reach).map(share).collect()
}

/// The response at a place to the filter with this profile, for noise of one in each pixel.
fn response(image: &ElectronImage, x: usize, y: usize, profile: &[f64]) -> f64 {
    let reach = profile.len() / 2;
    let norm: f64 = profile.iter().map(|p| p * p).sum();
    let row = |(row, of_row): (usize, &f64)| {
        let from_top = (y + row)
            .checked_sub(reach)
            .filter(|y| *y < image.height())?;
        let pixels = &image.pixels()[from_top * image.width()..][..image.width()];
        let pixel = |(column, share): (usize, &f64)| {
            let from_left = (x + column).checked_sub(reach)?;
            Some(of_row * share * pixels.get(from_left)?)
        };
        Some(profile.iter().enumerate().filter_map(pixel).sum::<f64>())
    };
    profile.iter().enumerate().filter_map(row).sum::<f64>() / norm
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::data_sheet::Preset;

    fn equivalent_px(change: fn(&mut DataSheet)) -> f64 {
        let mut sheet = Preset::Experiment1.data_sheet();
        sheet.spot_sigma_px = 1.5;
        change(&mut sheet);
        make_gaussian(&mut sheet);
        sheet.spot_sigma_px
    }

    #[test]
    fn an_elongated_spot_counts_as_a_wider_one_and_aberrations_widen() {
        assert_eq!(equivalent_px(|_| ()), 1.5);
        // By hand, without pixels: an ellipse with axes in a ratio q, in the filter of a round spot
        // of the same area, has the response 2 √q / (1 + q) of a round one.
        let elongated_px = equivalent_px(|sheet| sheet.imperfections.spot_axis_ratio = 3.0);
        let expected_px = 1.5 * 4.0 / (2.0 * 3f64.sqrt());
        assert!(
            (elongated_px / expected_px - 1.0).abs() < 0.03,
            "{elongated_px}"
        );
        let comatic_px = equivalent_px(|sheet| sheet.imperfections.coma_px = 8.0);
        assert!(comatic_px > 1.52, "{comatic_px}");
    }
}
