//! The study of a real sensor: a star of given magnitude, in electrons, measured by this crate.
//!
//! Each trial is a star in a [simulated](crate::lab::simulate) frame: shot noise of star and sky,
//! dark current, read noise, saturation, quantisation. The frame goes through [`detect`], which is
//! given the size of the spot, as it is known for a camera, and measures background and noise
//! itself.

use super::ErrorPoint;
use crate::base::coords::PixelPoint;
use crate::base::interrupt::{Interrupt, Interrupted};
use crate::detect::{CentroidMethod, DetectConfig, Detection, Workspace, detect};
use crate::frame::{Frame, FrameError};
use crate::lab::simulate::star_field;
use crate::predict::{Budget, CramerRao, Detector, Rule, Scenario};
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

/// Centroiding method.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Centroiding {
    /// [`CentroidMethod::GaussianFit`].
    GaussianFit,
    /// [`CentroidMethod::GreyWeighted`].
    GreyWeighted,
    /// That of the paper: the intensity-weighted mean over a fixed window around the star's pixel,
    /// with known background and without a threshold.
    FixedWindow,
}

/// A star, camera and sky, and how to measure.
#[derive(Debug, Clone, PartialEq)]
pub struct EnergyStudy {
    /// Camera and conditions; spot and read noise are varied.
    pub scenario: Scenario,
    /// V magnitude of the star.
    pub v_mag: f64,
    /// Centroiding method.
    pub centroiding: Centroiding,
    /// Half width of the fixed window, without its central pixel, in pixels.
    pub half_window_px: usize,
    /// Number of stars at each point of the grid.
    pub trials: usize,
}

/// Why an error could not be measured.
#[derive(Debug, thiserror::Error)]
pub enum MeasureError {
    /// There is no memory for a frame.
    #[error(transparent)]
    Simulate(#[from] FrameError),
    /// The work was ended early.
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
}

/// Other consequences of the spot's size.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SpotLimits {
    /// Cramér-Rao bound of the RMS distance, averaged over positions in a pixel, in pixels;
    /// saturation is ignored.
    pub bound_px: f64,
    /// V magnitude of 50 % completeness.
    pub limit_vmag: Option<f64>,
    /// Charge of the star's brightest pixel, with the star at its centre, over the full well.
    pub peak_part: f64,
}

impl EnergyStudy {
    /// A star of V magnitude `v_mag`: 400 trials, Gaussian fits, windows of 15 pixels.
    pub fn new(scenario: Scenario, v_mag: f64) -> Self {
        Self {
            scenario,
            v_mag,
            centroiding: Centroiding::GaussianFit,
            half_window_px: 7,
            trials: 400,
        }
    }

    /// The scenario with this spot in pixels and read noise in electrons.
    pub fn scenario_of(&self, spot_px: f64, noise_e: f64) -> Scenario {
        let mut scenario = self.scenario.clone();
        let sheet = &mut scenario.camera;
        sheet.spot_sigma_px = spot_px;
        // A stated peak share belongs to another spot.
        sheet.peak_share = None;
        sheet.read_noise_e = noise_e;
        scenario
    }

    /// Measures the error at a radius in pixels and a read noise in electrons.
    ///
    /// # Errors
    /// [`MeasureError`].
    pub fn measure(
        &self,
        spot_px: f64,
        noise_e: f64,
        random: &mut ChaCha8Rng,
        interrupt: &Interrupt,
    ) -> Result<ErrorPoint, MeasureError> {
        /// Largest number of stars along a side of a frame.
        const MAX_ABREAST: usize = 32;
        let mut scenario = self.scenario_of(spot_px, noise_e);
        let mut workspace = Workspace::new();
        let mut squares = Vec::with_capacity(self.trials);
        let mut left = self.trials;
        while left > 0 {
            interrupt.check()?;
            let abreast = ((left as f64).sqrt().ceil() as usize).min(MAX_ABREAST);
            let cells = StarCells::new(spot_px, abreast, left.min(abreast * abreast), random);
            (scenario.camera.width_px, scenario.camera.height_px) = (cells.side_px, cells.side_px);
            let stars: Vec<_> = cells.places.iter().map(|p| (*p, self.v_mag)).collect();
            let frame = star_field(&scenario, &stars, random.random())?;
            match self.method() {
                Some(method) => {
                    let found = self.detected(&frame, &scenario, method, &mut workspace);
                    squares.extend(cells.squares(&found));
                }
                None => squares.extend(self.squares_in_windows(&frame, &scenario, &cells)),
            }
            left -= stars.len();
        }
        Ok(ErrorPoint::of_squares(self.trials, &squares))
    }

    fn method(&self) -> Option<CentroidMethod> {
        match self.centroiding {
            Centroiding::GaussianFit => Some(CentroidMethod::GaussianFit),
            Centroiding::GreyWeighted => Some(CentroidMethod::GreyWeighted),
            Centroiding::FixedWindow => None,
        }
    }

    /// Star-like detections in the frame.
    fn detected(
        &self,
        frame: &Frame,
        scenario: &Scenario,
        centroid: CentroidMethod,
        workspace: &mut Workspace,
    ) -> Vec<Detection> {
        let config = DetectConfig {
            false_alarms_per_mpx: scenario.conditions.false_alarms_per_mpx,
            spot_sigma_px: Some(scenario.camera.spot_sigma_px),
            centroid,
            ..DetectConfig::default()
        };
        // The frame is large enough, the options are valid, and nothing interrupts: `detect` does
        // not fail.
        let found = detect(frame, &config, workspace).map_or_else(|_| Vec::new(), |d| d.sources);
        let star_like = found
            .into_iter()
            .filter(|source| source.flags.is_star_like());
        star_like.collect()
    }

    /// Squared errors of the paper's centroid.
    fn squares_in_windows<'a>(
        &'a self,
        frame: &'a Frame,
        scenario: &Scenario,
        cells: &'a StarCells,
    ) -> impl Iterator<Item = f64> + 'a {
        let (sheet, budget) = (&scenario.camera, Budget::new(scenario));
        let dark_and_sky_e = budget.background_e + budget.dark_e;
        let level_adu = sheet.bias_adu + dark_and_sky_e / sheet.gain_e_per_adu;
        let half = self.half_window_px as i64;
        cells.places.iter().filter_map(move |place| {
            let (column, row) = (place.x.round() as i64, place.y.round() as i64);
            let (mut sum, mut sum_x, mut sum_y) = (0.0, 0.0, 0.0);
            for y in -half..=half {
                for x in -half..=half {
                    let at = (row + y) * frame.width as i64 + column + x;
                    let grey = f64::from(frame.pixels.value(at as usize)) - level_adu;
                    sum += grey;
                    sum_x += x as f64 * grey;
                    sum_y += y as f64 * grey;
                }
            }
            let off_x = sum_x / sum + column as f64 - place.x;
            let off_y = sum_y / sum + row as f64 - place.y;
            (sum > 0.0).then_some(off_x * off_x + off_y * off_y)
        })
    }

    /// Bound, limit and peak charge for such a spot at this read noise.
    pub fn reach(&self, spot_px: f64, noise_e: f64) -> SpotLimits {
        let scenario = self.scenario_of(spot_px, noise_e);
        let budget = Budget::new(&scenario);
        let detector = Detector::new(Rule::MatchedFilter, &scenario, &budget);
        let limit_vmag = detector.vmag_at(0.5);
        let star_e = budget.electrons_of(self.v_mag, scenario.conditions.exposure_s);
        let peak_e = star_e * budget.peak_share + budget.background_e + budget.dark_e;
        SpotLimits {
            bound_px: bound_px(spot_px, star_e, budget.background_noise_e.powi(2)),
            limit_vmag: limit_vmag.is_finite().then_some(limit_vmag),
            peak_part: peak_e / scenario.camera.full_well_e,
        }
    }
}

/// Cramér-Rao bound of the RMS distance, averaged over positions in a pixel.
fn bound_px(spot_px: f64, star_e: f64, variance_e2: f64) -> f64 {
    /// Positions along half a pixel; the other half is its mirror image.
    const PLACES: usize = 6;
    let place = |i: usize| 0.5 * (i as f64 + 0.5) / PLACES as f64;
    let mut sum = 0.0;
    for i in 0..PLACES * PLACES {
        let at = [place(i % PLACES), place(i / PLACES)];
        let bound = CramerRao::of_spot(spot_px, at, star_e, variance_e2);
        sum += bound.sigma_x_px.powi(2) + bound.sigma_y_px.powi(2);
    }
    (sum / (PLACES * PLACES) as f64).sqrt()
}

/// Stars in the cells of a square frame, each at a random position within the central pixel of its
/// cell.
struct StarCells {
    side_px: usize,
    cell_px: usize,
    abreast: usize,
    places: Vec<PixelPoint>,
    reach_px: f64,
}

impl StarCells {
    fn new(spot_px: f64, abreast: usize, stars: usize, random: &mut ChaCha8Rng) -> Self {
        /// Largest distance between a star and its detection: this many pixels plus standard
        /// deviations of the spot.
        const MATCH_PX: f64 = 2.0;
        const MATCH_SIGMAS: f64 = 1.0;
        /// Distance between stars, in standard deviations of the spot, and its minimum in pixels.
        /// At this distance they cover a small part of the background and do not overlap.
        const SPACING_SIGMAS: f64 = 20.0;
        const MIN_SPACING_PX: f64 = 40.0;
        let cell_px = (SPACING_SIGMAS * spot_px).max(MIN_SPACING_PX).ceil() as usize;
        let middle = (cell_px / 2) as f64;
        let mut at = |cell: usize| (cell * cell_px) as f64 + middle + random.random::<f64>() - 0.5;
        let places = (0..stars)
            .map(|star| PixelPoint::new(at(star % abreast), at(star / abreast)))
            .collect();
        Self {
            side_px: abreast * cell_px,
            cell_px,
            abreast,
            places,
            reach_px: MATCH_PX + MATCH_SIGMAS * spot_px,
        }
    }

    /// Squared distances between the detected stars and the nearest detection of each.
    fn squares(&self, found: &[Detection]) -> impl Iterator<Item = f64> + use<> {
        let mut nearest = vec![f64::INFINITY; self.abreast * self.abreast];
        for source in found {
            let cell = |at: f64| (at.max(0.0) as usize / self.cell_px).min(self.abreast - 1);
            let number = cell(source.position.y) * self.abreast + cell(source.position.x);
            if let Some(place) = self.places.get(number) {
                let square = source.position.distance_to(place).powi(2);
                nearest[number] = nearest[number].min(square);
            }
        }
        let reach2 = self.reach_px * self.reach_px;
        nearest.into_iter().filter(move |square| *square <= reach2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::data_sheet::Preset;
    use rand::SeedableRng;

    fn study(v_mag: f64, centroiding: Centroiding) -> EnergyStudy {
        EnergyStudy {
            scenario: Scenario::of(Preset::NanosatTracker),
            v_mag,
            centroiding,
            half_window_px: 7,
            trials: 300,
        }
    }

    fn rms_px(study: &EnergyStudy, spot_px: f64) -> f64 {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let noise_e = study.scenario.camera.read_noise_e;
        let point = study
            .measure(spot_px, noise_e, &mut random, &Interrupt::default())
            .unwrap();
        assert!(point.found > 290, "{point:?}");
        point.rms_px
    }

    #[test]
    fn the_fit_is_at_the_bound_and_the_others_are_not() {
        let fit = study(4.0, Centroiding::GaussianFit);
        let bound = fit.reach(1.0, fit.scenario.camera.read_noise_e).bound_px;
        // The standard error of the ratio from 300 stars is 3 %.
        let ratio = rms_px(&fit, 1.0) / bound;
        assert!((0.88..1.12).contains(&ratio), "{ratio}");
        let grey = rms_px(&study(4.0, Centroiding::GreyWeighted), 1.0) / bound;
        let window = rms_px(&study(4.0, Centroiding::FixedWindow), 1.0) / bound;
        assert!(grey < 1.4 && window > grey, "{grey} {window}");
    }

    #[test]
    fn a_wider_spot_reaches_less_far_and_fills_its_pixels_less() {
        let study = study(4.0, Centroiding::GaussianFit);
        let [narrow, wide] = [0.5, 2.0].map(|spot_px| study.reach(spot_px, 10.0));
        let (near, far) = (wide.limit_vmag.unwrap(), narrow.limit_vmag.unwrap());
        assert!(far - near > 0.8, "{near} {far}");
        assert!(narrow.peak_part > 5.0 * wide.peak_part);
        assert!(wide.bound_px > narrow.bound_px);
    }

    #[test]
    fn a_star_beyond_the_limit_is_not_found() {
        let study = study(12.0, Centroiding::GaussianFit);
        let point = study
            .measure(
                1.0,
                10.0,
                &mut ChaCha8Rng::seed_from_u64(1),
                &Interrupt::default(),
            )
            .unwrap();
        assert!(!point.is_sound() && point.trials == 300, "{point:?}");
    }
}
