//! Position, flux and their errors of a source, from its fit, its saturated area or the filter.

use super::saturated_area::SaturatedArea;
use crate::base::coords::PixelPoint;
use crate::detect::candidates::{Peak, Region};
use crate::detect::detection::{Detection, DetectionFlags};
use crate::detect::fit::{FrameMaps, NoiseModel, SpotEstimate, SpotFit};
use crate::detect::pixels::View;

/// The detection of a source in coordinates of the view, without the flags of its shape.
pub(super) fn detection_of(
    maps: &FrameMaps<'_>,
    noise: &NoiseModel,
    fit: &SpotFit,
    peak: &Peak,
    region: &Region,
) -> Detection {
    let mut spot = best_estimate(maps, noise, fit, peak, region);
    let (width, height) = (maps.view.width, maps.view.height);
    clamp_to_frame(&mut spot, width, height);
    let background = f64::from(maps.background.background_at(peak.x as f32, peak.y as f32));
    // Where all pixels next to the peak are NaN, more distant ones made it.
    let brightest = [1, maps.window_radius(maps.spot_px)]
        .into_iter()
        .map(|reach| brightest_within(reach, peak, &maps.view))
        .find(|value| value.is_finite());
    let margin = 2.0 * maps.width_px();
    let border = spot.x < margin
        || spot.y < margin
        || spot.x > width as f64 - 1.0 - margin
        || spot.y > height as f64 - 1.0 - margin;
    Detection {
        position: PixelPoint::new(spot.x, spot.y),
        sigma_x_px: spot.sigma_x,
        sigma_y_px: spot.sigma_y,
        flux_adu: spot.flux,
        peak_adu: brightest.map_or(0.0, |value| value - background),
        snr: spot.flux / spot.noise_flux,
        flags: DetectionFlags {
            saturated: peak.saturated,
            border,
            ..DetectionFlags::default()
        },
    }
}

/// The fitted spot, with errors for correlated noise. Where the fit does not fix the position, that
/// of the saturated area or of the filtered peak.
fn best_estimate(
    maps: &FrameMaps<'_>,
    noise: &NoiseModel,
    fit: &SpotFit,
    peak: &Peak,
    region: &Region,
) -> SpotEstimate {
    let spot = fit.spots[0];
    let correlation = maps.correlation_at(spot.x, spot.y);
    if !spot.has_position(fit.spot_px) || (peak.saturated && !fit.converged) {
        return from_area(
            maps,
            noise,
            peak,
            correlation,
            from_filter(maps, peak, region),
        );
    }
    let [along_x, along_y] = maps.position_correlation_at(spot.x, spot.y);
    let mut fitted = SpotEstimate {
        sigma_x: spot.sigma_x * along_x,
        sigma_y: spot.sigma_y * along_y,
        noise_flux: spot.noise_flux * correlation,
        ..spot
    };
    let has_flux = spot.flux > 0.0 && fitted.noise_flux > 0.0 && fitted.noise_flux.is_finite();
    if !has_flux {
        let guess = from_filter(maps, peak, region);
        (fitted.flux, fitted.noise_flux) = (guess.flux, guess.noise_flux);
    }
    fitted
}

/// Position and flux from the filtered peak.
fn from_filter(maps: &FrameMaps<'_>, peak: &Peak, region: &Region) -> SpotEstimate {
    let guess = maps.initial_guess(peak);
    SpotEstimate {
        sigma_x: region.major_px.max(maps.width_px()),
        sigma_y: region.major_px.max(maps.width_px()),
        noise_flux: guess.flux / f64::from(peak.snr),
        ..guess
    }
}

/// Position of the saturated area, with its flux or that of `guess`, whichever is larger; `guess`
/// where nothing is saturated.
fn from_area(
    maps: &FrameMaps<'_>,
    noise: &NoiseModel,
    peak: &Peak,
    correlation: f64,
    guess: SpotEstimate,
) -> SpotEstimate {
    let area = if peak.saturated {
        SaturatedArea::at(maps, peak)
    } else {
        None
    };
    let Some(area) = area else {
        return guess;
    };
    let mut spot = SpotEstimate {
        x: area.x,
        y: area.y,
        sigma_x: area.sigma_x,
        sigma_y: area.sigma_y,
        ..guess
    };
    if area.flux > guess.flux {
        let pixel_noise = maps.noise_at(area.x, area.y);
        let variance = area.area_px * pixel_noise * pixel_noise + noise.shot_adu * area.flux;
        spot.flux = area.flux;
        spot.noise_flux = variance.sqrt() * correlation;
    }
    spot
}

/// Moves a spot beyond the border to the border, and adds the distance to its standard error.
pub(crate) fn clamp_to_frame(spot: &mut SpotEstimate, width: usize, height: usize) {
    let clamp = |at: &mut f64, sigma: &mut f64, side: usize| {
        let inside = at.clamp(-0.5, side as f64 - 0.5);
        if *at != inside {
            *sigma = libm::hypot(*sigma, *at - inside);
            *at = inside;
        }
    };
    clamp(&mut spot.x, &mut spot.sigma_x, width);
    clamp(&mut spot.y, &mut spot.sigma_y, height);
}

/// The highest value within `reach` columns and rows of a peak; negative infinity if all are NaN.
pub(super) fn brightest_within(reach: usize, peak: &Peak, view: &View<'_>) -> f64 {
    let columns = peak.x.saturating_sub(reach)..(peak.x + reach + 1).min(view.width);
    let rows = peak.y.saturating_sub(reach)..(peak.y + reach + 1).min(view.height);
    let pixels = rows.flat_map(|y| columns.clone().map(move |x| view.at(x, y)));
    pixels.fold(f64::NEG_INFINITY, |highest, p| highest.max(f64::from(p)))
}
