//! The wings of the stars: light beyond the spots that are fitted to them.
//!
//! Bright isolated stars, their light within eight standard deviations of the spot, over that of
//! the fit → [`Wings`]
//!
//! A fit reaches to where a Gaussian ends. Turbulence, diffraction and scattered light put some
//! percent of a star's light farther out, which no fit of its core can tell. The correction is the
//! same for all stars of a frame, as in aperture photometry (Howell 1989, PASP 101, 616).

use super::background::Mesh;
use super::detection::{Detection, Wings};
use super::pixels::View;
use crate::base::statistics::SIGMA_PER_MAD;

/// Radius of the aperture, in standard deviations of the spot, …
const APERTURE_SIGMAS: f64 = 8.0;
/// … and the distance of other sources from its edge.
const MARGIN_SIGMAS: f64 = 3.0;
/// Signal-to-noise ratio of stars that count, and the largest number of them.
const MIN_SNR: f64 = 10.0;
const MAX_STARS: usize = 60;
const MIN_STARS: usize = 3;
/// Smallest share of the light that is corrected: below, the spot is as good as its model.
const MIN_SHARE: f64 = 0.02;
/// Its significance, as a normal deviate.
const SIGNIFICANT_SIGMAS: f64 = 5.0;
/// Stars farther than this many standard errors from the median do not count.
const CLIP_SIGMAS: f64 = 3.0;

/// The share of a star's light that its fit lacks, and its standard error.
#[derive(Debug, Clone, Copy, Default)]
struct StarWings {
    share: f64,
    sigma: f64,
}

/// Measures the wings on the brightest of `sources`, which are sorted, brightest first; `None` where
/// they are not significant. `spot_width_px` is the standard deviation of the widest spots, pixel
/// included.
pub(crate) fn measure_wings(
    view: &View<'_>,
    background: &Mesh,
    sources: &[Detection],
    spot_width_px: f64,
) -> Option<Wings> {
    let radius_px = APERTURE_SIGMAS * spot_width_px;
    let apart_px = radius_px + MARGIN_SIGMAS * spot_width_px;
    let mut stars = [StarWings::default(); MAX_STARS];
    let measured = sources
        .iter()
        .filter(|source| is_clean(source))
        .filter(|source| is_alone(source, sources, apart_px))
        .filter_map(|source| star_wings(view, background, source, radius_px));
    let mut count = 0;
    for (place, star) in stars.iter_mut().zip(measured) {
        *place = star;
        count += 1;
    }
    let wings = mean(&mut stars[..count])?;
    let is_large = wings.share > MIN_SHARE.max(SIGNIFICANT_SIGMAS * wings.sigma);
    is_large.then_some(wings)
}

/// Whether it is bright and whole.
fn is_clean(source: &Detection) -> bool {
    let flags = &source.flags;
    flags.has_clean_flux() && flags.is_star_like() && source.snr >= MIN_SNR
}

fn is_alone(source: &Detection, sources: &[Detection], apart_px: f64) -> bool {
    let at = source.position;
    let near = |other: &&Detection| {
        let (dx, dy) = (other.position.x - at.x, other.position.y - at.y);
        dx * dx + dy * dy < apart_px * apart_px
    };
    // The source itself is one of them.
    sources.iter().filter(near).nth(1).is_none()
}

/// Light within `radius_px` of a star over that of its fit; `None` at the frame's border and over
/// masked pixels.
fn star_wings(
    view: &View<'_>,
    background: &Mesh,
    source: &Detection,
    radius_px: f64,
) -> Option<StarWings> {
    let at = source.position;
    let (level, noise) = background.at(at.x as f32, at.y as f32);
    let first = |center: f64| (center - radius_px).ceil();
    let last = |center: f64| (center + radius_px).floor();
    let is_inside = first(at.x) >= 0.0
        && first(at.y) >= 0.0
        && last(at.x) < view.width as f64
        && last(at.y) < view.height as f64;
    if !is_inside {
        return None;
    }
    let (mut light, mut pixels) = (0.0, 0_u32);
    for y in first(at.y) as usize..=last(at.y) as usize {
        for x in first(at.x) as usize..=last(at.x) as usize {
            let (dx, dy) = (x as f64 - at.x, y as f64 - at.y);
            if dx * dx + dy * dy <= radius_px * radius_px {
                light += f64::from(view.at(x, y) - level);
                pixels += 1;
            }
        }
    }
    let share = light / source.flux_adu - 1.0;
    let sigma = f64::from(noise) * f64::from(pixels).sqrt() / source.flux_adu;
    (share.is_finite() && sigma > 0.0).then_some(StarWings { share, sigma })
}

/// The weighted mean of `stars` without outliers. Its standard error is that of the pixels' noise,
/// or, if that is larger, that of the scatter.
fn mean(stars: &mut [StarWings]) -> Option<Wings> {
    if stars.len() < MIN_STARS {
        return None;
    }
    stars.sort_unstable_by(|a, b| a.share.total_cmp(&b.share));
    let median = stars[stars.len() / 2].share;
    let deviation = |star: &StarWings| (star.share - median).abs() / star.sigma;
    stars.sort_unstable_by(|a, b| deviation(a).total_cmp(&deviation(b)));
    let scatter = (SIGMA_PER_MAD * deviation(&stars[stars.len() / 2])).max(1.0);
    let (mut weights, mut sum) = (0.0, 0.0);
    for star in stars.iter() {
        if deviation(star) <= CLIP_SIGMAS * scatter {
            weights += star.sigma.powi(-2);
            sum += star.share * star.sigma.powi(-2);
        }
    }
    Some(Wings {
        share: sum / weights,
        sigma: scatter / weights.sqrt(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outliers_do_not_move_the_mean_and_scatter_widens_its_error() {
        let star = |share: f64| StarWings { share, sigma: 0.01 };
        let alike = [0.049, 0.05, 0.05, 0.051, 0.05, 0.9].map(star);
        let found = mean(&mut alike.clone()).unwrap();
        assert!((found.share - 0.05).abs() < 1e-9, "{found:?}");
        assert!((found.sigma - 0.01 / 5f64.sqrt()).abs() < 1e-9);
        let spread = [0.0, 0.03, 0.05, 0.08, 0.11].map(star);
        assert!(mean(&mut spread.clone()).unwrap().sigma > 0.015);
        assert!(mean(&mut alike[..2].to_vec()).is_none());
    }
}
