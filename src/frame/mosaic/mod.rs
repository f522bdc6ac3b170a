//! Raw frames of color cameras: each pixel lies under one of the filters of a 2 × 2 mosaic.
//!
//! raw [`Frame`] → [`Mosaic`], if it is one → a grey frame of the same size ([`Mosaic::grey`]).
//!
//! 1. `evidence`: a mosaic shows as four interleaved backgrounds. The header alone is not believed:
//!    drivers of grey cameras write a pattern, too.
//! 2. `smoothing`: the binomial kernel [1 2 1] ⊗ [1 2 1] / 16 gives every filter a quarter of the
//!    weight in every pixel, and lies symmetric around it. The background becomes even, light is
//!    kept, and the places of stars stay where they are, whatever their colors.
//!
//! Differs from superpixels, the means of 2 × 2 pixels: there the centre of the light moves with
//! the color of a star, by up to 0.1 px towards the filter that lets more of it pass, and spots of
//! ordinary cameras become too sharp to be measured.
//!
//! # Reference
//! Alleysson, Süsstrunk & Hérault 2005, IEEE Trans. Image Process. 14, 439,
//! doi 10.1109/TIP.2004.841200: luminance is the part of low frequencies of a mosaic, color
//! that near the highest.

mod evidence;
mod smoothing;

use super::bayer_pattern::{BayerPattern, Diagonal};
use super::image::Frame;
use serde::Serialize;

/// The mosaic of filters over the pixels of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct Mosaic {
    /// The filters, where the header says which.
    pub pattern: Option<BayerPattern>,
    /// The diagonal of the upper left 2 × 2 pixels under the two filters that are alike.
    green: Diagonal,
}

impl Mosaic {
    /// Standard deviation of a pixel of the grey frame over that of the raw pixels: √Σk² of the
    /// kernel.
    pub const NOISE_RATIO: f64 = 0.375;
    /// Variance that the kernel adds to a spot on each axis, in px².
    pub const ADDED_VARIANCE_PX2: f64 = 0.5;

    /// The mosaic of a raw frame; `None` for a grey frame. Color that is known to be converted
    /// to luminance is no mosaic.
    pub fn of(frame: &Frame) -> Option<Self> {
        let stated = frame.metadata.bayer_pattern;
        let green = evidence::green_diagonal(frame, stated)?;
        // Programs differ in the row that the pattern begins with; the pixels know.
        let pattern = stated.map(|pattern| {
            if pattern.green() == green {
                pattern
            } else {
                pattern.upside_down()
            }
        });
        Some(Self { pattern, green })
    }

    /// Number of filters that differ.
    pub(crate) const FILTERS: usize = 3;

    /// The filter over the pixel in column `x`, row `y`: 0 for the one that two in four pixels have, green; 1
    /// for that in even rows beside it, 2 for that in odd rows.
    pub(crate) fn filter(&self, x: usize, y: usize) -> usize {
        if Diagonal::at(x, y) == self.green {
            0
        } else {
            1 + y % 2
        }
    }

    /// The pixels under a filter that one in four pixels has, as a frame; `None` if none of them has a value.
    pub(crate) fn pixels_under(&self, filter: usize, raw: &Frame) -> Option<Frame<'static>> {
        let y0 = filter - 1;
        let x0 = usize::from(self.filter(0, y0) != filter);
        let (columns, rows) = ((x0..raw.width).step_by(2), (y0..raw.height).step_by(2));
        let size = (columns.len(), rows.len());
        let pixels = rows.flat_map(|y| columns.clone().map(move |x| raw.at(x, y)));
        let frame = Frame::new(size.0, size.1, pixels.collect()).ok()?;
        Some(frame.with_levels(raw.step_adu, raw.saturation_adu))
    }

    /// Standard deviation of a spot in the raw frame, by that in the grey one.
    pub(crate) fn raw_spot_px(grey_spot_px: f64) -> f64 {
        (grey_spot_px.powi(2) - Self::ADDED_VARIANCE_PX2)
            .max(0.0)
            .sqrt()
    }

    /// The grey frame: every pixel has the mean of the filters around it. A pixel is saturated if
    /// one of those around it is, by `saturation_adu`.
    #[must_use]
    pub fn grey(&self, raw: &Frame, saturation_adu: f32) -> Frame<'static> {
        smoothing::smoothed(raw, saturation_adu)
    }
}
