//! Frames of isolated stars of known flux.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use starpipe::base::coords::PixelPoint;
use starpipe::base::statistics::normal_cdf;
use starpipe::camera::data_sheet::{DataSheet, Imperfections, Response};
use starpipe::detect::{Detection, Detections};
use starpipe::frame::Frame;
use starpipe::lab::simulate::star_field;
use starpipe::predict::{Budget, Extinction, Scenario, SkyBrightness};

/// Distance between stars: they cover a small part of a background cell.
const SPACING_PX: f64 = 64.0;
/// A detection within this distance of a star is that star.
const MATCH_PX: f64 = 2.0;

/// A camera with a gain of one electron per level and a spot of standard deviation `spot_sigma_px`.
pub fn data_sheet(side_px: usize, spot_sigma_px: f64) -> DataSheet {
    DataSheet {
        name: "test".to_owned(),
        width_px: side_px,
        height_px: side_px,
        pitch_x_um: 5.5,
        pitch_y_um: 5.5,
        focal_length_mm: 30.0,
        aperture_mm: 20.0,
        lens_transmission: Response::Constant(0.8),
        quantum_efficiency: Response::Constant(0.5),
        band_from_nm: 400.0,
        band_to_nm: 700.0,
        read_noise_e: 5.0,
        dark_current_e_s: 0.0,
        full_well_e: 60_000.0,
        gain_e_per_adu: 1.0,
        bits: 16,
        bias_adu: 100.0,
        spot_sigma_px,
        peak_share: None,
        spot_image: None,
        imperfections: Imperfections::default(),
    }
}

/// Frames with this many electrons of sky per pixel.
#[derive(Debug, Clone)]
pub struct Field {
    pub scenario: Scenario,
    budget: Budget,
}

/// A true star.
#[derive(Debug, Clone, Copy)]
pub struct Star {
    pub place: PixelPoint,
    pub flux_e: f64,
    /// Index into the requested signal-to-noise ratios.
    pub class: usize,
}

impl Field {
    pub fn new(sheet: DataSheet, background_e: f64) -> Self {
        let mut scenario = Scenario::new(sheet);
        scenario.conditions.extinction = Extinction::MagPerAirmass(0.0);
        let sky_e = |mag: f64| {
            let mut scenario = scenario.clone();
            scenario.conditions.sky = SkyBrightness::MagArcsec2(mag);
            Budget::new(&scenario).background_e
        };
        let mag = 20.0 - 2.5 * (background_e / sky_e(20.0)).log10();
        scenario.conditions.sky = SkyBrightness::MagArcsec2(mag);
        let budget = Budget::new(&scenario);
        Self { scenario, budget }
    }

    /// The noise of a pixel without a star, in electrons.
    pub fn pixel_noise_e(&self) -> f64 {
        self.budget.background_noise_e
    }

    /// Electrons of the sky in a pixel.
    pub fn background_e(&self) -> f64 {
        self.budget.background_e
    }

    /// Electrons of a star with this matched-filter signal-to-noise ratio, averaged over its
    /// positions in a pixel.
    pub fn flux_e(&self, snr: f64) -> f64 {
        snr * self.pixel_noise_e() * equivalent_area_px(self.scenario.camera.spot_sigma_px).sqrt()
    }

    /// Positions in the cells of a grid, anywhere within a pixel, in random order.
    pub fn places(&self, random: &mut ChaCha8Rng) -> Vec<PixelPoint> {
        let sheet = &self.scenario.camera;
        let cells = |side: usize| (side as f64 / SPACING_PX).floor() as usize;
        let (columns, rows) = (cells(sheet.width_px), cells(sheet.height_px));
        let mut middle =
            |cell: usize| (cell as f64 + 0.5) * SPACING_PX + random.random_range(-0.5..0.5);
        let mut places: Vec<_> = (0..columns * rows)
            .map(|cell| PixelPoint::new(middle(cell % columns), middle(cell / columns)))
            .collect();
        for i in 0..places.len() {
            let other = random.random_range(i..places.len());
            places.swap(i, other);
        }
        places
    }

    /// Stars with signal-to-noise ratios drawn from each of `ranges` in turn, and their frame.
    pub fn frame(&self, ranges: &[(f64, f64)], seed: u64) -> (Vec<Star>, Frame<'static>) {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let places = self.places(&mut random);
        let star = |(i, place)| {
            let class = i % ranges.len();
            let (from, to) = ranges[class];
            let flux_e = self.flux_e(from + (to - from) * random.random::<f64>());
            Star {
                place,
                flux_e,
                class,
            }
        };
        let stars: Vec<_> = places.into_iter().enumerate().map(star).collect();
        let frame = self.draw(&stars, seed);
        (stars, frame)
    }

    pub fn draw(&self, stars: &[Star], seed: u64) -> Frame<'static> {
        let exposure_s = self.scenario.conditions.exposure_s;
        let v_mag = |star: &Star| self.budget.vmag_of(star.flux_e, exposure_s);
        let drawn: Vec<_> = stars.iter().map(|star| (star.place, v_mag(star))).collect();
        star_field(&self.scenario, &drawn, seed).unwrap()
    }
}

/// 1/ΣP², averaged over the positions of a star in a pixel, in pixels.
pub fn equivalent_area_px(spot_sigma_px: f64) -> f64 {
    const PLACES: usize = 32;
    let share = |offset: f64| {
        normal_cdf((offset + 0.5) / spot_sigma_px) - normal_cdf((offset - 0.5) / spot_sigma_px)
    };
    let squares = |place: usize| -> f64 {
        let middle = (place as f64 + 0.5) / PLACES as f64 - 0.5;
        (-20..=20)
            .map(|pixel| share(f64::from(pixel) - middle).powi(2))
            .sum()
    };
    let mean = (0..PLACES).map(squares).sum::<f64>() / PLACES as f64;
    1.0 / (mean * mean)
}

/// The detection of the star at this position, if there is one.
pub fn found_at<'a>(detections: &'a Detections, place: &PixelPoint) -> Option<&'a Detection> {
    let distance = |d: &&Detection| d.position.distance_to(place);
    let nearest = detections
        .sources
        .iter()
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
    (distance(&nearest) < MATCH_PX).then_some(nearest)
}
