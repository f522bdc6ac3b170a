//! The light behind each filter of a color camera.

use crate::base::coords::PixelPoint;
use crate::base::statistics::normal_cdf;
use crate::frame::{Frame, Mosaic};
use std::borrow::Cow;

/// The colors of a picture.
#[derive(Debug)]
pub(crate) enum PictureColors<'a> {
    /// A raw frame, whose pixels lie under a mosaic.
    Raw(ColorFrame<'a>),
    /// Red and blue of a picture that has all colors in each pixel.
    RedAndBlue(Box<[Frame<'static>; 2]>),
}

impl PictureColors<'_> {
    /// The flux of a star behind two filters, in the order of [`Self::frames`]: as [`ColorFrame::fluxes_adu`].
    pub(crate) fn fluxes_adu(&self, star: &PixelPoint, grey_sigma_px: f64) -> Option<[f64; 2]> {
        match self {
            Self::Raw(color) => {
                let [_, first, second] = color.fluxes_adu(star, grey_sigma_px)?;
                Some([first, second])
            }
            Self::RedAndBlue(frames) => {
                let [red, blue] = &**frames;
                let flux = |frame| {
                    let [flux] = fluxes_adu(frame, star, grey_sigma_px, |_, _| 0)?;
                    Some(flux)
                };
                Some([flux(red)?, flux(blue)?])
            }
        }
    }

    /// The pixels behind the two filters; `None` if one of them has none with a value.
    pub(crate) fn frames(&self) -> Option<[Cow<'_, Frame<'static>>; 2]> {
        match self {
            Self::Raw(ColorFrame { mosaic, raw }) => {
                let under = |filter| mosaic.pixels_under(filter, raw).map(Cow::Owned);
                Some([under(1)?, under(2)?])
            }
            Self::RedAndBlue(frames) => Some(frames.each_ref().map(Cow::Borrowed)),
        }
    }

    /// Pixels of the picture for one of these, on each axis.
    pub(crate) const fn pixels_of_one(&self) -> usize {
        match self {
            Self::Raw(_) => 2,
            Self::RedAndBlue(_) => 1,
        }
    }
}

/// A raw frame of a color camera.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ColorFrame<'a> {
    /// The filters over its pixels.
    pub mosaic: Mosaic,
    /// The frame before the mosaic is smoothed.
    pub raw: &'a Frame<'a>,
}

impl ColorFrame<'_> {
    /// The flux of a star behind each filter, as if it were over all pixels: of a Gaussian spot with this standard
    /// deviation in the grey frame, on an even background. `None` at the border.
    pub fn fluxes_adu(
        &self,
        star: &PixelPoint,
        grey_sigma_px: f64,
    ) -> Option<[f64; Mosaic::FILTERS]> {
        let sigma_px = Mosaic::raw_spot_px(grey_sigma_px);
        fluxes_adu(self.raw, star, sigma_px, |x, y| self.mosaic.filter(x, y))
    }
}

/// The flux of a Gaussian spot, as if it were over all pixels, by those of each kind: `kind` tells it of the pixel
/// in a column and a row.
fn fluxes_adu<const KINDS: usize>(
    frame: &Frame,
    star: &PixelPoint,
    sigma_px: f64,
    kind: impl Fn(usize, usize) -> usize,
) -> Option<[f64; KINDS]> {
    /// The part of the frame that is looked at, in standard deviations from the star.
    const REACH: f64 = 6.0;
    let reach = (REACH * (sigma_px + 0.5)).ceil() as usize;
    let range = |at: f64, side: usize| {
        let first = (at.round().max(0.0) as usize).checked_sub(reach)?;
        let end = first + 2 * reach + 1;
        (end <= side).then_some(first..end)
    };
    let (columns, rows) = (range(star.x, frame.width)?, range(star.y, frame.height)?);
    let share = |at: usize, center: f64| {
        let cdf = |edge: f64| normal_cdf((at as f64 + edge - center) / sigma_px);
        cdf(0.5) - cdf(-0.5)
    };
    let across: Vec<f64> = columns.clone().map(|x| share(x, star.x)).collect();
    let mut sums = [FilterSums::default(); KINDS];
    for y in rows {
        let down = share(y, star.y);
        for (x, across) in columns.clone().zip(&across) {
            sums[kind(x, y)].add(across * down, f64::from(frame.at(x, y)));
        }
    }
    let fluxes_adu = sums.map(|sums| sums.slope());
    let is_known = fluxes_adu.iter().all(|flux| flux.is_finite());
    is_known.then_some(fluxes_adu)
}

/// Sums over the pixels behind a filter, for the line of their levels over the share of a spot in each.
#[derive(Debug, Clone, Copy, Default)]
struct FilterSums {
    count: f64,
    share: f64,
    share_sq: f64,
    level: f64,
    both: f64,
}

impl FilterSums {
    fn add(&mut self, share: f64, level: f64) {
        self.count += 1.0;
        self.share += share;
        self.share_sq += share * share;
        self.level += level;
        self.both += share * level;
    }

    fn slope(&self) -> f64 {
        let covariance = self.both - self.share * self.level / self.count;
        covariance / (self.share_sq - self.share * self.share / self.count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_star_has_its_flux_behind_each_filter_wherever_it_lies() {
        // A mosaic with more light behind green filters.
        let (side, sigma_px) = (128, 0.8);
        let filters = |x: usize, y: usize| match (x % 2, y % 2) {
            (0, 0) => (300.0, 60.0),
            (1, 1) => (500.0, 80.0),
            _ => (1000.0, 120.0),
        };
        let noise = |i: usize| ((i * 7919 + i / 128 * 104_729) % 1009) as f64 / 1009.0 - 0.5;
        for (x, y) in [(60.0, 61.0), (60.5, 60.2), (61.3, 59.9)] {
            let share = |at: usize, center: f64| {
                let cdf = |edge: f64| normal_cdf((at as f64 + edge - center) / sigma_px);
                cdf(0.5) - cdf(-0.5)
            };
            let pixel = |i: usize| {
                let (flux, level) = filters(i % side, i / side);
                let star = flux * share(i % side, x) * share(i / side, y);
                (level + (0.1 * level) * noise(i) + star) as f32
            };
            let raw = Frame::new(side, side, (0..side * side).map(pixel).collect()).unwrap();
            let color = ColorFrame {
                mosaic: Mosaic::of(&raw).unwrap(),
                raw: &raw,
            };
            let grey_sigma_px = (sigma_px * sigma_px + Mosaic::ADDED_VARIANCE_PX2).sqrt();
            let found = color
                .fluxes_adu(&PixelPoint::new(x, y), grey_sigma_px)
                .unwrap();
            for (found, expected) in found.iter().zip([1000.0, 300.0, 500.0]) {
                assert!((found / expected - 1.0).abs() < 0.1, "{found} {expected}");
            }
            assert_eq!(color.fluxes_adu(&PixelPoint::new(1.0, 60.0), 1.0), None);
        }
    }
}
