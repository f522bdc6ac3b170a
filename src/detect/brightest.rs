//! The brightest stars of a frame, for its pointing.
//!
//! Bright stars stand out in single pixels, so the frame is not filtered, and a rough background will do. They are
//! fitted with round spots of one size; what only the faint ones need (the noise of the filtered frame, the form of
//! the spots, close pairs) is not measured.

use super::config::DetectConfig;
use super::detection::Detections;
use super::error::{self, DetectError};
use super::filter::Kernel;
use super::fit::FrameMaps;
use super::measure::spot_size_px;
use super::pixels::View;
use super::workspace::Workspace;
use crate::frame::{Frame, MIN_SIDE_PX};

/// Finds up to `count` of the brightest stars of `frame`, spread over it, into `found`; none where fewer than
/// eight stand out in single pixels. Pixels are looked at once, and for the background a sixteenth of them again.
///
/// Positions and errors are as of [`detect`](super::detect()), a little less exact; of `found` nothing else is set
/// but background, noise and spot.
///
/// # Errors
/// As [`detect`](super::detect()).
pub fn detect_brightest_into(
    frame: &Frame,
    config: &DetectConfig,
    count: usize,
    workspace: &mut Workspace,
    found: &mut Detections,
) -> Result<(), DetectError> {
    look_for_brightest(frame, config, workspace)?;
    measure_brightest_into(frame, config, count, workspace, found)
}

/// Looks at the pixels of `frame` once: the background, roughly, and what stands out of it.
///
/// # Errors
/// As [`detect`](super::detect()).
pub(crate) fn look_for_brightest(
    frame: &Frame,
    config: &DetectConfig,
    workspace: &mut Workspace,
) -> Result<(), DetectError> {
    error::check(frame, config)?;
    workspace.forget_visited_pixels();
    let Workspace {
        background,
        search,
        interrupt,
        ..
    } = workspace;
    let view = View::of_live_pixels(frame).until(interrupt);
    search.raw_peaks.peaks.clear();
    if view.width < MIN_SIDE_PX || view.height < MIN_SIDE_PX {
        return Ok(());
    }
    background.measure_sparsely(&view, frame.step_adu, config.cell_px)?;
    let saturation_adu = config.or_stated_saturation_adu(frame.saturation_adu);
    Ok(search
        .raw_peaks
        .find(&view, &background.mesh, saturation_adu)?)
}

/// Measures up to `count` of the stars that [`look_for_brightest`] saw in the same frame last.
///
/// # Errors
/// As [`detect`](super::detect()).
pub(crate) fn measure_brightest_into(
    frame: &Frame,
    config: &DetectConfig,
    count: usize,
    workspace: &mut Workspace,
    found: &mut Detections,
) -> Result<(), DetectError> {
    found.clear();
    found.are_brightest = true;
    let Workspace {
        background,
        search,
        brightest,
        interrupt,
        ..
    } = workspace;
    let raw_peaks = &mut search.raw_peaks;
    let mut maps = FrameMaps {
        view: View::of_live_pixels(frame).until(interrupt),
        background: &background.mesh,
        filtered: None,
        saturation_adu: config.or_stated_saturation_adu(frame.saturation_adu),
        spot_px: 1.0,
        matched_gain: 1.0,
        psf: None,
    };
    let Some(spot_px) = spot_size_px(raw_peaks, &maps) else {
        return Ok(());
    };
    maps.spot_px = config.spot_sigma_px.unwrap_or(spot_px);
    maps.matched_gain = Kernel::for_spot(maps.spot_px).matched_gain();
    let is_enough = brightest.select(&raw_peaks.peaks, &maps, count);
    if !is_enough && raw_peaks.find_rest(&maps.view, maps.background, maps.saturation_adu)? {
        brightest.select(&raw_peaks.peaks, &maps, count);
    }
    brightest.measure(&mut maps, config.spot_sigma_px, &mut found.sources);
    found.background_adu = background.median_adu;
    found.noise_adu = background.median_sigma_adu;
    found.spot_sigma_px = maps.spot_px;
    super::keep_brightest(found, config, false);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect::{DetectConfig, Detection};
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    const SIDE: usize = 640;
    const NOISE_ADU: f64 = 8.0;

    /// Noise with these stars: place, and peak in units of the noise. `along` is the covariance of their spots.
    fn frame(stars: &[([f64; 2], f64)], along: f64) -> Frame<'static> {
        const VARIANCE_PX2: f64 = 1.4;
        let mut random = ChaCha8Rng::seed_from_u64(9);
        let mut pixels: Vec<f64> = (0..SIDE * SIDE)
            .map(|_| 100.0 + NOISE_ADU * random.sample::<f64, _>(StandardNormal))
            .collect();
        let determinant = VARIANCE_PX2 * VARIANCE_PX2 - along * along;
        for &([x, y], peak) in stars {
            for row in y as usize - 8..y as usize + 9 {
                for column in x as usize - 8..x as usize + 9 {
                    let (dx, dy) = (column as f64 - x, row as f64 - y);
                    let form = VARIANCE_PX2 * (dx * dx + dy * dy) - 2.0 * along * dx * dy;
                    let light = NOISE_ADU * peak * libm::exp(-0.5 * form / determinant);
                    pixels[row * SIDE + column] += light;
                }
            }
        }
        let pixels = pixels.into_iter().map(|adu| adu as f32).collect();
        Frame::new(SIDE, SIDE, pixels).unwrap()
    }

    /// Places on a grid, each somewhere in its pixel, with peaks from `least` times the noise up.
    fn places(count: usize, least: f64) -> Vec<([f64; 2], f64)> {
        let mut random = ChaCha8Rng::seed_from_u64(2);
        let mut place = |i: usize| {
            let [x, y] =
                [i % 10, i / 10].map(|at| 40.0 + 60.0 * at as f64 + random.random::<f64>());
            ([x, y], least * 1.03f64.powi((7 * i % 90) as i32))
        };
        (0..count).map(&mut place).collect()
    }

    fn found(frame: &Frame, count: usize) -> Detections {
        let mut found = Detections::default();
        let (config, mut workspace) = (DetectConfig::default(), Workspace::new());
        detect_brightest_into(frame, &config, count, &mut workspace, &mut found).unwrap();
        found
    }

    /// Offsets from the true places in standard errors, of both axes.
    fn pulls(found: &Detections, stars: &[([f64; 2], f64)]) -> Vec<f64> {
        let of_source = |source: &Detection| {
            let [x, y] = [source.position.x, source.position.y];
            let distance = |star: &&([f64; 2], f64)| libm::hypot(star.0[0] - x, star.0[1] - y);
            let nearest = stars
                .iter()
                .min_by(|a, b| distance(a).total_cmp(&distance(b)));
            let [sx, sy] = nearest.unwrap().0;
            [(x - sx) / source.sigma_x_px, (y - sy) / source.sigma_y_px]
        };
        found.sources.iter().flat_map(of_source).collect()
    }

    #[test]
    fn bright_stars_are_where_they_are_within_their_errors() {
        let stars = places(90, 12.0);
        let found = found(&frame(&stars, 0.0), 100);
        assert_eq!(found.sources.len(), 90);
        let pulls = pulls(&found, &stars);
        let mean_square = pulls.iter().map(|pull| pull * pull).sum::<f64>() / pulls.len() as f64;
        assert!((0.5..1.5).contains(&mean_square), "{mean_square}");
        assert!((found.noise_adu / NOISE_ADU - 1.0).abs() < 0.05);
    }

    #[test]
    fn elongated_stars_are_where_the_middle_of_their_light_is() {
        let stars = places(90, 12.0);
        let found = found(&frame(&stars, 1.1), 100);
        assert!(found.sources.len() > 80, "{}", found.sources.len());
        let off = pulls(&found, &stars)
            .into_iter()
            .map(f64::abs)
            .fold(0.0, f64::max);
        assert!(off < 5.0, "{off}");
    }

    #[test]
    fn the_brightest_of_many_are_taken_and_hot_pixels_are_not() {
        let stars = places(90, 12.0);
        let mut frame = frame(&stars, 0.0);
        let hot = 333 * SIDE + 334;
        frame.pixels.as_f32_mut()[hot] += (500.0 * NOISE_ADU) as f32;
        let found = found(&frame, 20);
        assert_eq!(found.sources.len(), 20);
        let faintest = 12.0 * 1.03f64.powi(60);
        let flux = |peak: f64| peak * NOISE_ADU * 2.0 * std::f64::consts::PI * 1.4;
        for source in &found.sources {
            assert!(source.flux_adu > flux(faintest), "{source:?}");
            assert!(libm::hypot(source.position.x - 334.0, source.position.y - 333.0) > 5.0);
        }
    }

    #[test]
    fn few_stars_are_none_and_one_place_has_not_all() {
        assert!(found(&frame(&places(7, 30.0), 0.0), 100).sources.is_empty());
        // Lamps in a corner.
        let lamps = (0..36).map(|i| {
            (
                [20.0 + 14.0 * (i % 6) as f64, 20.0 + 14.0 * (i / 6) as f64],
                900.0,
            )
        });
        let stars: Vec<_> = lamps.chain(places(90, 12.0).into_iter().skip(30)).collect();
        let found = found(&frame(&stars, 0.0), 100);
        let in_corner = found
            .sources
            .iter()
            .filter(|s| s.position.x < 106.0 && s.position.y < 106.0);
        assert!(in_corner.count() <= 12);
        assert!(found.sources.len() > 60);
    }
}
