//! The color of the sky's light: its ratio behind two filters of a color camera, as stars show it.

use super::dark_level::{DarkLevel, DarkSource};
use super::picture::SkyPicture;
use super::stars::SkyStar;
use crate::base::statistics::Estimate;
use crate::detect::BackgroundMap;
use crate::frame::Frame;
use crate::photometry::zero_point::{self, StandardStar};
use crate::photometry::{IdentifiedFrame, PictureColors, instrumental_mag};
use std::borrow::Cow;

/// Side of the cells in which the background behind a filter is measured, in its pixels.
const MESH_PX: usize = 32;

/// How the light behind two filters tells its color.
#[derive(Debug, Clone, Copy)]
pub(super) struct SkyColorIndex(zero_point::ColorIndex);

impl SkyColorIndex {
    /// By the colors of stars at the ground.
    fn of(colors: &PictureColors, stars: &[SkyStar], spot_sigma_px: f64) -> Option<Self> {
        /// Stars with a larger error, in magnitudes, tell little.
        const LARGEST_SIGMA_MAG: f64 = 0.25;
        /// Reddening by the air in B−V, per airmass (Patat et al. 2011, A&A 527, A91).
        const REDDENING_MAG: f64 = 0.1;
        let standard = |star: &SkyStar| {
            let sigma_mag = star.measured?.sigma_mag;
            if sigma_mag > LARGEST_SIGMA_MAG {
                return None;
            }
            let fluxes_adu = colors.fluxes_adu(&star.pixel, spot_sigma_px)?;
            Some(StandardStar {
                v_mag: star.v_mag,
                bv_mag: Some(star.bv_mag? + REDDENING_MAG * star.airmass.unwrap_or(0.0)),
                instrumental_mag: star.v_mag - ratio_mag(fluxes_adu)?,
                sigma_mag,
                off_centre_sq: star.off_axis_sq,
            })
        };
        let stars: Vec<StandardStar> = stars.iter().filter_map(standard).collect();
        zero_point::ColorIndex::fit(&stars).map(Self)
    }

    /// B−V of a sky with this light behind the filters.
    pub(super) fn of_sky(&self, filters_adu: [f64; 2]) -> Option<Estimate> {
        /// The sky has lines where stars have none; two filters see less of them than B and V.
        const LINES_MAG: f64 = 0.1;
        let found = self.0.bv_mag(ratio_mag(filters_adu)?)?;
        Some(Estimate {
            value: found.value,
            sigma: libm::hypot(found.sigma, LINES_MAG),
        })
    }
}

/// The ratio of two fluxes, in magnitudes.
fn ratio_mag([first, second]: [f64; 2]) -> Option<f64> {
    (first > 0.0 && second > 0.0).then(|| instrumental_mag(first / second))
}

/// The sky behind two filters, row by row.
pub(super) struct SkyColors {
    /// How its light tells its color.
    pub index: SkyColorIndex,
    /// Pixels of the frame for one of theirs, on each axis.
    pixels_of_one: usize,
    filters: [FilteredSky; 2],
}

/// The sky behind a filter.
struct FilteredSky {
    dark_adu: f64,
    background: BackgroundMap,
    /// A row of the background.
    row: Vec<f32>,
}

impl SkyColors {
    /// Those of a color picture whose level without light is known.
    pub(super) fn measure(
        frame: &IdentifiedFrame,
        picture: &SkyPicture,
        dark: Option<&DarkLevel>,
        stars: &[SkyStar],
    ) -> Option<Self> {
        let dark = dark?;
        let colors = (picture.colors)()?;
        let index = SkyColorIndex::of(&colors, stars, frame.detections.spot_sigma_px)?;
        let frames = colors.frames()?;
        // A program that balances white may multiply this level, too.
        let is_of_each = dark.source == DarkSource::Unlit && colors.pixels_of_one() == 1;
        let behind = |filtered: Cow<Frame>| {
            let own = || DarkLevel::of_unlit_pixels(&filtered, frame.detections);
            let own = is_of_each.then(own).flatten();
            FilteredSky {
                dark_adu: own.as_ref().unwrap_or(dark).adu.value,
                background: BackgroundMap::measure(&filtered, MESH_PX),
                row: vec![0.0; filtered.width],
            }
        };
        Some(Self {
            index,
            pixels_of_one: colors.pixels_of_one(),
            filters: frames.map(behind),
        })
    }

    /// Goes to a row of the frame.
    pub(super) fn set_row(&mut self, y: usize) {
        for sky in &mut self.filters {
            sky.background.row(y / self.pixels_of_one, &mut sky.row);
        }
    }

    /// The light behind the filters in a column of this row, in ADU.
    pub(super) fn at(&self, x: usize) -> [f64; 2] {
        self.filters.each_ref().map(|sky| {
            let at = (x / self.pixels_of_one).min(sky.row.len() - 1);
            f64::from(sky.row[at]) - sky.dark_adu
        })
    }
}
