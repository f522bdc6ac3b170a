//! The sky that was drawn, as its cells and a meter see it.

use super::conditions::TrialConditions;
use crate::base::coords::{Camera, PixelPoint, UnitVector};
use crate::base::statistics::normal_cdf;
use crate::base::units::{DEG_PER_RAD, RAD_PER_DEG};
use crate::detect::PIXEL_VARIANCE_PX2;
use crate::ephemeris::observer::Site;
use crate::identify::Identification;
use crate::lab::robustness::Answer;
use crate::lab::simulate::{Pointing, Simulator, TrueSky};
use crate::photometry::filter_response;
use crate::sky::{CLEAR_MAG, MOON_REACH_DEG, Place};
use std::f64::consts::TAU;

/// Samples of a cell along its altitudes and azimuths.
const SAMPLES: usize = 6;
/// What a meter sees: full width at half maximum, and how far from the zenith, in degrees.
const METER_DEG: f64 = 20.0;
const METER_REACH_DEG: f64 = 30.0;

/// The sky that was drawn.
pub(super) struct TrueNightSky<'a> {
    sky: TrueSky<'a>,
    simulator: &'a Simulator<'a>,
    pointing: &'a Pointing,
    /// Where the Moon is, if it is above the horizon.
    moon: Option<UnitVector<Camera>>,
    /// Standard deviation of a spot, in pixels.
    spot_sigma_px: f64,
    /// Electrons of a gray level.
    gain_e_per_adu: f64,
    /// Whether the loss of the lens is known where thresholds are stated.
    lens_is_known: bool,
}

/// The magnitude at which half of the stars are detected, where they have these limits, each as likely.
fn half_detected(limits: &[f64]) -> f64 {
    /// Width of the fall at one limit.
    const WIDTH_MAG: f64 = 0.3;
    const ROUNDS: usize = 30;
    let [mut bright, mut faint] = [f64::INFINITY, f64::NEG_INFINITY];
    for limit in limits {
        (bright, faint) = (bright.min(*limit), faint.max(*limit));
    }
    for _ in 0..ROUNDS {
        let middle = 0.5 * (bright + faint);
        let of = |limit: &f64| normal_cdf((limit - middle) / WIDTH_MAG);
        if limits.iter().map(of).sum::<f64>() > 0.5 * limits.len() as f64 {
            bright = middle;
        } else {
            faint = middle;
        }
    }
    0.5 * (bright + faint)
}

/// A cell of the sky that was drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TrueCell {
    /// V magnitudes per square arcsecond.
    pub mag_arcsec2: f64,
    /// Mean extinction by clouds, in magnitudes.
    pub clouds_mag: f64,
    /// Share of it that is behind clouds.
    pub cloud_share: f64,
    /// V magnitude at which half of its stars are detected.
    pub limit_vmag: f64,
}

impl<'a> TrueNightSky<'a> {
    /// The sky of a frame.
    pub(super) fn new(
        simulator: &'a Simulator<'a>,
        pointing: &'a Pointing,
        conditions: &TrialConditions,
        site: Site,
        spot_sigma_px: f64,
    ) -> Self {
        Self {
            spot_sigma_px,
            sky: simulator.true_sky(pointing, conditions.seed),
            simulator,
            pointing,
            moon: conditions.moon_direction(site),
            gain_e_per_adu: conditions.gain_e_per_adu,
            lens_is_known: conditions.bias_known,
        }
    }

    /// Whether the attitude is right.
    pub(super) fn answer(&self, found: Option<&Identification>) -> Answer {
        let camera = self.simulator.camera();
        found.map_or(Answer::None, |found| {
            Answer::of(found, camera, &self.pointing.icrs_to_camera)
        })
    }

    /// Where a place of the site's sky is in the frame.
    fn pixel_of(&self, altitude_deg: f64, azimuth_deg: f64) -> Option<PixelPoint> {
        let Pointing {
            icrs_to_camera,
            places,
        } = self.pointing;
        let direction = places.in_horizon(azimuth_deg * RAD_PER_DEG, altitude_deg * RAD_PER_DEG)?;
        let camera = self.simulator.camera();
        camera.pixel_of(&icrs_to_camera.apply(&direction))
    }

    /// V magnitude of a star that leaves the flux `threshold_adu` of the detection.
    fn limit_vmag(&self, pixel: &PixelPoint, threshold_adu: f64) -> f64 {
        let electrons = threshold_adu * self.gain_e_per_adu;
        let lens = if self.lens_is_known {
            self.sky.lens(pixel)
        } else {
            1.0
        };
        let transmission = self.sky.transmission(pixel) / lens;
        // A star is off the center of its pixel, and less of it is in the filter.
        let spot_px2 = self.spot_sigma_px.powi(2) + PIXEL_VARIANCE_PX2;
        let filtered = filter_response((2.0 * PIXEL_VARIANCE_PX2 / spot_px2).sqrt());
        let electrons = electrons / transmission / filtered;
        self.simulator.light().vmag_of(electrons)
    }

    /// The sky of a cell with the detection threshold `threshold_adu`; `None` where the frame shows none of it, or
    /// the cell is of the frame.
    pub(super) fn cell(&self, place: &Place, threshold_adu: f64) -> Option<TrueCell> {
        let Place::Horizon {
            altitude_deg,
            azimuth_deg,
        } = place
        else {
            return None;
        };
        let at = |[from, to]: [f64; 2], step: usize| {
            from + (to - from) * (step as f64 + 0.5) / SAMPLES as f64
        };
        let [
            mut electrons_per_sr,
            mut clouds_mag,
            mut clouded,
            mut weights,
        ] = [0.0; 4];
        let mut limits = Vec::new();
        for step in 0..SAMPLES * SAMPLES {
            let altitude_deg = at(*altitude_deg, step / SAMPLES);
            let pixel = self.pixel_of(altitude_deg, at(*azimuth_deg, step % SAMPLES));
            let sky = pixel.and_then(|pixel| {
                Some((
                    self.sky.electrons_per_sr(&pixel)?,
                    self.sky.clouds_mag(&pixel),
                    self.limit_vmag(&pixel, threshold_adu),
                ))
            });
            let Some((light, dimmed_mag, limit_vmag)) = sky else {
                continue;
            };
            limits.push(limit_vmag);
            let weight = libm::cos(altitude_deg * RAD_PER_DEG);
            electrons_per_sr += weight * light;
            clouds_mag += weight * dimmed_mag;
            clouded += weight * f64::from(dimmed_mag > CLEAR_MAG);
            weights += weight;
        }
        (weights > 0.0).then(|| TrueCell {
            mag_arcsec2: self.sky.mag_arcsec2(electrons_per_sr / weights),
            clouds_mag: clouds_mag / weights,
            cloud_share: clouded / weights,
            limit_vmag: half_detected(&limits),
        })
    }

    fn is_by_moon(&self, pixel: &PixelPoint) -> bool {
        let by = |moon: &UnitVector<Camera>| {
            let direction = self.simulator.camera().direction_of(pixel);
            direction
                .is_some_and(|direction| moon.angle_to(&direction) * DEG_PER_RAD < MOON_REACH_DEG)
        };
        self.moon.as_ref().is_some_and(by)
    }

    /// V magnitudes per square arcsecond of the zenith, as a meter sees it, without what is by the Moon.
    pub(super) fn zenith_mag_arcsec2(&self) -> f64 {
        const RING_DEG: f64 = 1.0;
        const AROUND: usize = 36;
        let weight =
            |off_deg: f64| libm::exp(-4.0 * std::f64::consts::LN_2 * (off_deg / METER_DEG).powi(2));
        let (mut electrons, mut solid_angle_sr) = (0.0, 0.0);
        for ring in 0..(METER_REACH_DEG / RING_DEG) as usize {
            let off_deg = (ring as f64 + 0.5) * RING_DEG;
            let piece_sr =
                TAU / AROUND as f64 * libm::sin(off_deg * RAD_PER_DEG) * RING_DEG * RAD_PER_DEG;
            for step in 0..AROUND {
                let azimuth_deg = step as f64 * 360.0 / AROUND as f64;
                let pixel = self.pixel_of(90.0 - off_deg, azimuth_deg);
                let pixel = pixel.filter(|pixel| !self.is_by_moon(pixel));
                if let Some(light) = pixel.and_then(|pixel| self.sky.electrons_per_sr(&pixel)) {
                    electrons += weight(off_deg) * piece_sr * light;
                    solid_angle_sr += weight(off_deg) * piece_sr;
                }
            }
        }
        self.sky.mag_arcsec2(electrons / solid_angle_sr)
    }
}
