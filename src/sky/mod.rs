//! The sky over an identified frame: how bright it is at each place, how much light the air and clouds
//! take, and how faint stars go there.
//!
//! (`IdentifiedFrame`, `SkyPicture`) → [`SkyMap`]
//!
//! 1. The frame is divided into cells (`grid`): rings of altitude where the horizon is known, else
//!    rectangles of the frame.
//! 2. The stars that are not dimmed give the clear sky (`clear_sky`): the zero point outside the
//!    atmosphere, and the extinction per airmass.
//! 3. In each cell, the stars that are dimmed or missing give the extinction beyond it, and the
//!    probability that it is hardly any (`clouds`); so does the light of clouds, where it goes with missing
//!    stars (`cloud_light`).
//! 4. The background above the bias, over the solid angle of a pixel, is the sky's brightness
//!    (`brightness`). Where a frame has colors, two filters tell that of the sky (`color`).
//! 5. The threshold and the extinction of a cell tell how faint its stars should go, and the stars around it
//!    how faint they go (`limits`).
//!
//! Caveats: a frame's band is not V. The zero point is that of stars; the sky has another color, and its
//! brightness the error that this makes. Without a flat, a lens that points to the zenith loses light
//! towards the edge as the air does, and the errors of both say so.

mod brightness;
mod clear_sky;
mod cloud_light;
mod clouds;
mod color;
mod curve_evidence;
mod dark_level;
mod depth;
mod grid;
mod lens_circle;
mod limits;
mod neighbor;
mod picture;
mod relative_limit;
mod star_counts;
mod stars;
mod tone_curve;

pub(crate) use brightness::MOON_REACH_DEG;
pub use brightness::{NoBrightness, SkyLight, ZenithSky};
pub use clear_sky::ClearSky;
pub use clouds::CLEAR_MAG;
pub use curve_evidence::CurveEvidence;
pub use dark_level::{DarkLevel, DarkSource};
pub use grid::Place;
pub(crate) use grid::{horizon_places, is_wide};
pub use limits::StatedLimit;
pub(crate) use picture::SkyPicture;
pub use tone_curve::{CurveKind, ToneFit};

use crate::base::statistics::Estimate;
use crate::identify::IndexedCatalog;
use crate::photometry::IdentifiedFrame;
use crate::photometry::association::associate;
use brightness::SkyLevels;
use grid::SkyCellGrid;
use star_counts::CloudInputs;
use tone_curve::{Curved, CurvedFrame};

/// The sky over a frame.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SkyMap {
    /// The parts of the sky, from the horizon up, or row by row.
    pub cells: Vec<SkyCell>,
    /// The air without clouds.
    pub clear_sky: ClearSky,
    /// The level of a pixel without light, where it is known.
    pub dark: Option<DarkLevel>,
    /// The tone curve, where gray levels may have one.
    pub tone_curve: Option<ToneFit>,
    /// What stars tell of it.
    pub curve_evidence: Option<CurveEvidence>,
    /// Why no brightness was measured.
    pub no_brightness: Option<NoBrightness>,
    /// The brightness at the zenith, where it is in the frame.
    pub zenith: Option<ZenithSky>,
    /// Share of the sky in the frame that is behind clouds.
    pub cloud_share: Option<Estimate>,
}

/// A part of the sky.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct SkyCell {
    /// Where it is.
    pub place: Place,
    /// Solid angle of its sky in the frame, in steradians.
    pub solid_angle_sr: f64,
    /// Its brightness.
    pub light: Option<SkyLight>,
    /// Stars that a clear sky would show.
    pub expected: usize,
    /// Those of them that were detected.
    pub detected: usize,
    /// Extinction beyond that of clear air, in magnitudes.
    pub extinction_mag: Option<Estimate>,
    /// Probability that this is below [`CLEAR_MAG`].
    pub clear: Option<f64>,
    /// The same if clouds are smooth, and if they are broken: the clouds' texture decides in between.
    pub clear_band: Option<[f64; 2]>,
    /// Flux at which half of the stars are detected, in ADU, without what the lens is known to take.
    pub threshold_adu: f64,
    /// V magnitude at which half of the stars should be detected, without clouds.
    pub expected_limit_vmag: Option<f64>,
    /// V magnitude at which half of the stars around it are detected.
    pub limit_vmag: Option<Estimate>,
}

/// Measures the sky over `frame`; `None` where too few stars tell the zero point. If it is known from another
/// frame of the camera, `usual` is the clear sky of that.
pub(crate) fn measure(
    frame: &IdentifiedFrame,
    picture: &SkyPicture,
    catalog: &IndexedCatalog,
    stated: Option<&StatedLimit>,
    usual: Option<&ClearSky>,
) -> Option<SkyMap> {
    let view = frame.identification.view();
    let predicted = view.stars_to(catalog, crate::photometry::depth_v_mag(frame, catalog));
    let association = associate(frame, &predicted);
    let stars = stars::select(frame, &association, &predicted, catalog);
    let clear_sky = match usual {
        Some(usual) => *usual,
        None => ClearSky::measure(&stars, picture.is_flat)?,
    };
    let grid = SkyCellGrid::over(frame);
    let dark = dark_level(frame, picture);
    let is_proportional = is_proportional(picture, &clear_sky, usual.is_some());
    let color = dark
        .filter(|_| is_proportional)
        .and_then(|dark| color::SkyColors::measure(frame, picture, Some(&dark), &stars));
    let levels = SkyLevels::of(frame, picture, dark.as_ref(), &grid, &clear_sky, color);
    let measured = CurvedFrame {
        frame,
        picture,
        stars: &stars,
        clear_sky: &clear_sky,
        levels: &levels,
    };
    let curved = match (is_proportional, dark) {
        (true, Some(dark)) => Some(Curved::of_levels(&levels, &clear_sky, dark)),
        (true, None) => measured.with_unknown_dark_level(),
        // Nothing tells the curve where the clear sky is that of another frame.
        (false, _) if usual.is_some() => None,
        (false, _) => measured.with_unknown_curve(),
    };
    let no_brightness = || NoBrightness::diagnose(dark.as_ref(), &clear_sky);
    let no_brightness = curved.is_none().then(no_brightness);
    let depths = depth::depths(&levels, &clear_sky);
    let sky = CloudInputs {
        grid: &grid,
        stars: &stars,
        clear_sky: &clear_sky,
        depths: &depths,
        frame,
        moon: picture.moon,
        levels: &levels,
        chance: association.chance,
        is_usual: usual.is_some(),
    };
    let cell_stars = sky.star_counts();
    let clouds::CloudMap {
        cells: clouds,
        fraction: share,
    } = sky.clouds(&cell_stars, &levels);
    let limits = limits::limits(&sky, &cell_stars, &clouds, stated);
    let light = |cell: usize| curved.as_ref().and_then(|curved| curved.cells[cell]);
    let cells = grid.places.iter().enumerate().map(|(cell, place)| SkyCell {
        place: *place,
        solid_angle_sr: levels.cells[cell].solid_angle_sr,
        light: light(cell),
        expected: clouds[cell].expected,
        detected: clouds[cell].detected,
        extinction_mag: clouds[cell].extinction_mag,
        clear: clouds[cell].clear,
        clear_band: clouds[cell].clear_band,
        threshold_adu: levels.cells[cell].limit_adu,
        expected_limit_vmag: limits[cell].expected_vmag,
        limit_vmag: limits[cell].measured_vmag,
    });
    let cells: Vec<SkyCell> = cells.filter(|cell| cell.solid_angle_sr > 0.0).collect();
    Some(SkyMap {
        cloud_share: share,
        zenith: curved.as_ref().and_then(|curved| curved.zenith),
        dark: curved.as_ref().map(|curved| curved.dark),
        tone_curve: curved.as_ref().and_then(|curved| curved.tone),
        curve_evidence: curved.and_then(|curved| curved.evidence),
        no_brightness,
        clear_sky,
        cells,
    })
}

/// The level of a pixel without light: stated, of pixels that no light reaches, or of other frames of the camera.
fn dark_level(frame: &IdentifiedFrame, picture: &SkyPicture) -> Option<DarkLevel> {
    // A flat divides unlit pixels by what is no light.
    let unlit = || match picture.is_flat {
        true => None,
        false => DarkLevel::of_unlit_pixels(picture.frame, frame.detections),
    };
    picture.dark.or_else(unlit).or(picture.usual_dark)
}

/// Whether gray levels are taken to be proportional to light: stars show no tone curve, and the file has more than
/// the eight bits of most that have one, or a level without light is stated for it.
fn is_proportional(picture: &SkyPicture, clear_sky: &ClearSky, is_usual: bool) -> bool {
    let is_raw = picture.dark.is_some() || !picture.has_eight_bits();
    !clear_sky.has_tone_curve() && (is_raw || is_usual)
}
