//! The light of a star, by each tone curve that a picture may have.
//!
//! A curve that bends more gives the brightest pixels more weight, so that its sums have less of the noise of the
//! others. So that this does not make it likelier, all have the noise of the sum of levels: what is missing is added.

use super::curve::ToneCurve;
use crate::base::statistics::{clip, even_part, mean_and_squares, median_of, normal_quantile};
use crate::detect::Detections;
use crate::frame::Frame;
use crate::photometry::{MAG_PER_RELATIVE, MeasuredMagnitude, instrumental_mag};
use crate::sky::stars::SkyStar;

/// The pixels of a star and of the sky around it.
pub(super) struct Spot {
    star: SkyStar,
    /// Levels of its pixels, and of those of the sky, in ADU.
    levels_adu: Vec<f64>,
    around_adu: Vec<f64>,
    /// The sky's mean level, in ADU, and the variance of a pixel.
    sky_adu: f64,
    variance_adu2: f64,
    /// Fluxes over light: what neighbors add, what the lens takes, and the exposure.
    flux_per_light: f64,
    /// Sum of its levels over the sky that is expected, in ADU.
    expected_adu: f64,
    /// The noise that is added, over its standard deviation.
    deviate: f64,
}

/// A star by a tone curve.
pub(super) struct LitSpot {
    /// The star with the magnitude of its light.
    pub star: SkyStar,
    /// Relative change of its flux in levels over that of its light, logarithm.
    pub ln_response: f64,
}

/// Within which distance of a star its light is summed, in pixels.
pub(super) fn reach_px(detections: &Detections) -> f64 {
    const SIGMAS: f64 = 2.0;
    const PIXEL: f64 = 0.5;
    let widest_px = detections.psf.map_or(0.0, |psf| psf.sigma_range_px[1]);
    let trail_px = detections.trails.map_or(0.0, |trails| trails.length_px);
    SIGMAS * detections.spot_sigma_px.max(widest_px) + PIXEL + 0.5 * trail_px
}

impl Spot {
    /// The pixels of `star`, of which this flux is expected. `None` at the border, and where they come near to white.
    pub fn measure(
        frame: &Frame,
        star: &SkyStar,
        (reach_px, white_adu): (f64, f64),
        (flux, flux_per_light): (f64, f64),
    ) -> Option<Self> {
        /// Part of white at which colors of a pixel may be cut off.
        const BRIGHTEST: f64 = 0.9;
        /// The sky around it, from and to, in pixels beyond its reach.
        const AROUND_PX: [f64; 2] = [1.0, 4.0];
        let centre = star.seen_at?;
        let side = (reach_px + AROUND_PX[1]).ceil() as usize;
        let range = |at: f64, end: usize| {
            let first = (at.round().max(0.0) as usize).checked_sub(side)?;
            let last = first + 2 * side;
            (last < end).then_some(first..=last)
        };
        let (columns, rows) = (
            range(centre.x, frame.width)?,
            range(centre.y, frame.height)?,
        );
        let (mut levels_adu, mut around_adu) = (Vec::new(), Vec::new());
        for y in rows {
            for x in columns.clone() {
                let level_adu = f64::from(frame.at(x, y));
                let distance_px = libm::hypot(x as f64 - centre.x, y as f64 - centre.y);
                if distance_px <= reach_px {
                    levels_adu.push(level_adu);
                } else if distance_px > reach_px + AROUND_PX[0]
                    && distance_px <= reach_px + AROUND_PX[1]
                    && !level_adu.is_nan()
                {
                    around_adu.push(level_adu);
                }
            }
        }
        let is_whole = levels_adu
            .iter()
            .all(|level| *level < BRIGHTEST * white_adu);
        // The levels of other stars. Levels of a picture are whole numbers.
        clip(&mut around_adu, 0.5);
        let (sky_adu, squares_adu2) = mean_and_squares(&around_adu);
        (is_whole && !around_adu.is_empty()).then_some(Self {
            star: *star,
            levels_adu,
            sky_adu,
            variance_adu2: squares_adu2 / around_adu.len() as f64,
            around_adu,
            flux_per_light,
            expected_adu: flux / flux_per_light,
            deviate: 0.0,
        })
    }

    /// Gives spots that are sorted the noise that is added: it has no trend along them.
    pub fn deviate(spots: &mut [Self]) {
        for (at, spot) in spots.iter_mut().enumerate() {
            spot.deviate = normal_quantile(even_part(at));
        }
    }

    /// Gives spots the light that is beyond their reach: what all lack of the fluxes that were fitted to them, in
    /// the median.
    pub fn add_light_beyond(spots: &mut [Self]) {
        let Some(caught) = median_of(spots.iter().filter_map(Self::caught)) else {
            return;
        };
        for spot in spots {
            spot.flux_per_light /= caught;
        }
    }

    /// The sum of its levels over the sky, over the flux that was fitted to it.
    fn caught(&self) -> Option<f64> {
        let fitted_adu =
            libm::pow(10.0, -0.4 * self.star.measured?.instrumental_mag) / self.flux_per_light;
        let over_adu = self.levels_adu.iter().map(|level| level - self.sky_adu);
        let caught = over_adu.sum::<f64>() / fitted_adu;
        (caught > 0.0 && caught.is_finite()).then_some(caught)
    }

    /// The error of its magnitude that is expected, by the noise of the sky around it.
    pub fn sigma_mag(&self) -> f64 {
        MAG_PER_RELATIVE * self.noise_adu() / self.expected_adu
    }

    /// The noise of the sum of its levels.
    fn noise_adu(&self) -> f64 {
        let count = self.levels_adu.len() as f64;
        let of_sum = count * (1.0 + count / self.around_adu.len() as f64);
        (self.variance_adu2 * of_sum).sqrt()
    }

    /// The level that is expected of its brightest pixel.
    pub fn peak_adu(&self, spot_sigma_px: f64) -> f64 {
        let share = |at: f64| {
            let off_px = at - at.round();
            let part = |end: f64| libm::erf((end - off_px) / (spot_sigma_px * 2.0_f64.sqrt()));
            0.5 * (part(0.5) - part(-0.5))
        };
        let [x, y] = self.star.seen_at.map_or([0.0; 2], |at| [at.x, at.y]);
        self.sky_adu + self.expected_adu * share(x) * share(y)
    }

    /// V magnitude of the star.
    pub fn v_mag(&self) -> f64 {
        self.star.v_mag
    }

    /// The star by a tone curve; `None` if it has no light.
    pub fn by(&self, curve: &ToneCurve) -> Option<LitSpot> {
        let count = self.levels_adu.len() as f64;
        let around: Vec<f64> = self.around_adu.iter().map(|at| curve.light(*at)).collect();
        let (sky, squares) = mean_and_squares(&around);
        let variance = squares / around.len() as f64;
        let (mut light, mut flux_adu, mut response_adu) = (0.0, 0.0, 0.0);
        let mut noise2 = variance * count.powi(2) / around.len() as f64;
        for level_adu in &self.levels_adu {
            let over = curve.light(*level_adu) - sky;
            // Noise makes pixels darker than the sky.
            let light_per_adu = curve.light_per_adu(level_adu.max(self.sky_adu));
            light += over;
            flux_adu += level_adu - self.sky_adu;
            response_adu += over / light_per_adu;
            noise2 += self.variance_adu2 * light_per_adu.powi(2);
        }
        let response = response_adu / flux_adu;
        let is_seen = light > 0.0 && flux_adu > 0.0 && response > 0.0 && response.is_finite();
        let relative = noise2.sqrt() / light;
        let relative_by_levels = (self.noise_adu() / (flux_adu * response)).max(relative);
        let added = self.deviate * (relative_by_levels.powi(2) - relative.powi(2)).sqrt();
        is_seen.then(|| LitSpot {
            star: SkyStar {
                measured: Some(MeasuredMagnitude {
                    instrumental_mag: instrumental_mag(light * self.flux_per_light)
                        + MAG_PER_RELATIVE * added,
                    sigma_mag: MAG_PER_RELATIVE * relative_by_levels,
                }),
                ..self.star
            },
            ln_response: libm::log(response),
        })
    }
}
