//! A frame of the camera that the page states.

use crate::stated::Stated;
use crate::{catalogs, json, told};
use serde::Serialize;
use starpipe::ephemeris::places::StarPlaces;
use starpipe::lab::simulate::{Pointing, Setup, Simulator, Truth, camera_of};
use starpipe::predict::{Budget, Prediction, Scenario};
use starpipe::{Frame, Rotation, Star, UnitVector};
use wasm_bindgen::prelude::*;

/// What is drawn at most: more pixels would take longer, and not fit a screen.
const LARGEST_PX: [usize; 2] = [480, 360];
/// The same noise at each setting, so that nothing but the setting changes the picture.
const SEED: u64 = 1;
/// Grey levels that are black and white, from that of the sky, in units of its noise.
const BLACK_SIGMAS: f64 = -3.0;
const WHITE_SIGMAS: f64 = 12.0;

/// A part of the sky that many know.
struct Place {
    name: &'static str,
    ra_deg: f64,
    dec_deg: f64,
}

const ORION: Place = Place {
    name: "orion",
    ra_deg: 84.05,
    dec_deg: -1.2,
};
const PLEIADES: Place = Place {
    name: "pleiades",
    ra_deg: 56.7,
    dec_deg: 24.06,
};
const CYGNUS: Place = Place {
    name: "cygnus",
    ra_deg: 305.56,
    dec_deg: 40.26,
};

impl Place {
    /// The place with this name; without one, that which fits a field of this width.
    ///
    /// # Errors
    /// A name that is none.
    fn of(name: Option<&str>, width_rad: f64) -> Result<Self, JsError> {
        /// The belt of Orion is wider, the Pleiades are narrower.
        const NARROW_DEG: f64 = 2.5;
        let Some(name) = name else {
            let is_narrow = width_rad.to_degrees() < NARROW_DEG;
            return Ok(if is_narrow { PLEIADES } else { ORION });
        };
        let named = [ORION, PLEIADES, CYGNUS];
        let found = named.into_iter().find(|place| place.name == name);
        found.ok_or_else(|| JsError::new(&format!("'{name}' is no place in the sky")))
    }

    fn pointing(&self) -> Pointing {
        let middle = UnitVector::from_ra_dec(self.ra_deg.to_radians(), self.dec_deg.to_radians());
        Pointing {
            icrs_to_camera: Rotation::looking_at(&middle, 0.0),
            places: StarPlaces::default(),
        }
    }
}

/// What the page says of a frame.
#[derive(Debug, Serialize)]
struct About {
    place: &'static str,
    width_px: usize,
    height_px: usize,
    /// Of the whole detector.
    detector_px: [usize; 2],
    focal_length_px: f64,
    /// Whether sky and dark current alone saturate the pixels.
    is_full: bool,
    is_whole_catalog: bool,
    /// Stars that are fainter are not drawn.
    faintest_vmag: Option<f64>,
    star_count: usize,
    limit50_vmag: Option<f64>,
    /// Where the stars are that are brighter than the limit.
    brighter_px: Vec<[f64; 2]>,
}

/// A simulated frame as it is shown.
#[wasm_bindgen]
pub struct SimulatedFrame {
    rgba: Vec<u8>,
    about: String,
}

#[wasm_bindgen]
impl SimulatedFrame {
    /// Its pixels: red, green, blue and opacity, row by row.
    pub fn rgba(&self) -> Vec<u8> {
        self.rgba.clone()
    }

    /// What is to be said of it, as JSON.
    pub fn about(&self) -> String {
        self.about.clone()
    }
}

/// The middle of a frame that the camera takes of the place with this name; without a name, of that
/// which fits its field. Until the catalog was given, it has the stars to V = 6.5.
///
/// # Errors
/// As [`limit`](crate::limit), and a place that is none.
#[wasm_bindgen]
pub fn simulate(stated: &str, place: Option<String>) -> Result<SimulatedFrame, JsError> {
    let stated: Stated = serde_json::from_str(stated).map_err(told)?;
    let mut setup = Setup::new(stated.scenario()?);
    let prediction = Prediction::new(&setup.scenario).map_err(told)?;
    let sheet = &mut setup.scenario.camera;
    let detector_px = [sheet.width_px, sheet.height_px];
    // Nothing depends on the distance from the middle: the lenses of the built-in cameras are perfect.
    sheet.width_px = sheet.width_px.min(LARGEST_PX[0]);
    sheet.height_px = sheet.height_px.min(LARGEST_PX[1]);
    let width_rad = sheet.width_px as f64 * sheet.pixel_scale_rad();
    let place = Place::of(place.as_deref(), width_rad)?;
    let catalog = catalogs::whole();
    let stars = catalog.as_ref().unwrap_or(&catalogs::bright()).stars();
    setup.scene.faintest_vmag = faintest_vmag(&setup.scenario, &place.pointing(), stars);
    setup.check().map_err(told)?;
    let simulator = Simulator::new(&setup.scenario, &setup.scene, stars).map_err(told)?;
    let (frame, truth) = simulator.frame(&place.pointing(), SEED).map_err(told)?;
    let (sky_adu, noise_adu) = sky_of(&setup.scenario, &prediction.budget);
    let limit50_vmag = prediction.detector.limit50_vmag;
    let about = About {
        place: place.name,
        width_px: frame.width,
        height_px: frame.height,
        detector_px,
        focal_length_px: simulator.camera().focal_length_px(),
        is_full: sky_adu >= setup.scenario.camera.saturation_adu(),
        is_whole_catalog: catalog.is_ok(),
        faintest_vmag: setup.scene.faintest_vmag,
        star_count: truth.stars.len(),
        limit50_vmag,
        brighter_px: brighter(&truth, limit50_vmag),
    };
    Ok(SimulatedFrame {
        rgba: shown(&frame, sky_adu, noise_adu),
        about: json(&about)?,
    })
}

/// How faint stars may be for the frame to be drawn in about a second; none where all may be drawn.
fn faintest_vmag(scenario: &Scenario, pointing: &Pointing, stars: &[Star]) -> Option<f64> {
    /// Pixels of spots in about a second.
    const MOST_PX: f64 = 1.5e8;
    /// Width of a spot in standard deviations, and what a row or column of it costs, in pixels.
    const WIDTH_SIGMAS: f64 = 12.0;
    const SIDE_PX: f64 = 50.0;
    /// Spots that a trail is made of, for each standard deviation of its length.
    const SPOTS_PER_SIGMA: f64 = 4.0;
    let (sheet, motion_px) = (&scenario.camera, scenario.conditions.motion_px);
    let side_px = WIDTH_SIGMAS * sheet.spot_sigma_px;
    let spots = 1.0 + SPOTS_PER_SIGMA * motion_px / sheet.spot_sigma_px;
    let most = MOST_PX / (spots * side_px * (side_px + SIDE_PX));
    let camera = camera_of(sheet);
    let is_seen = |star: &&Star| {
        let direction = pointing.icrs_to_camera.apply(&star.direction);
        let pixel = camera.pixel_of(&direction);
        pixel.is_some_and(|pixel| camera.contains(&pixel))
    };
    let seen = stars.iter().filter(is_seen);
    let mut v_mags: Vec<f64> = seen.map(|star| f64::from(star.v_mag)).collect();
    v_mags.sort_by(f64::total_cmp);
    v_mags.get(most as usize).copied()
}

/// Level and noise of a pixel without a star, in ADU.
fn sky_of(scenario: &Scenario, budget: &Budget) -> (f64, f64) {
    let sheet = &scenario.camera;
    let level_adu = sheet.bias_adu + (budget.background_e + budget.dark_e) / sheet.gain_e_per_adu;
    let noise_adu = budget.background_noise_e / sheet.gain_e_per_adu;
    (level_adu.min(sheet.saturation_adu()), noise_adu)
}

/// Positions of the stars that are brighter than this, to a tenth of a pixel.
fn brighter(truth: &Truth, limit_vmag: Option<f64>) -> Vec<[f64; 2]> {
    let is_bright = |v_mag| limit_vmag.is_some_and(|limit| v_mag < limit);
    let stars = truth.stars.iter().filter(|star| is_bright(star.v_mag));
    let rounded = |value: f64| (value * 10.0).round() / 10.0;
    stars
        .map(|star| [rounded(star.position.x), rounded(star.position.y)])
        .collect()
}

/// The frame in grey: linear, with the sky dark and bright stars white.
fn shown(frame: &Frame, sky_adu: f64, noise_adu: f64) -> Vec<u8> {
    let black_adu = sky_adu + BLACK_SIGMAS * noise_adu;
    let scale = 255.0 / ((WHITE_SIGMAS - BLACK_SIGMAS) * noise_adu);
    let grey = |level: f32| ((f64::from(level) - black_adu) * scale).round() as u8;
    let rgba = |level| {
        let grey = grey(level);
        [grey, grey, grey, u8::MAX]
    };
    frame.pixels.values().flat_map(rgba).collect()
}
