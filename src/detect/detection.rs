//! The sources of a frame, as detection reports them.

use super::flux_limits::FluxLimits;
use super::sky_area::SkyArea;
use crate::base::coords::PixelPoint;
use std::cmp::Ordering;

/// One detected source, in the frame's own units.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Detection {
    /// The centroid.
    pub position: PixelPoint,
    /// Standard error of the centroid in x, in pixels: from noise and from the error of the spot
    /// model.
    pub sigma_x_px: f64,
    /// Standard error of the centroid in y, in pixels.
    pub sigma_y_px: f64,
    /// Flux above the background, in ADU: of the fitted spot, also where its core is saturated.
    pub flux_adu: f64,
    /// Brightest pixel above the background, in ADU.
    pub peak_adu: f64,
    /// Flux over its noise: that of the background and, where the frame's bright stars allow to
    /// measure it, the shot noise of the star. The error of the spot model is not included (it
    /// would limit this to about 30), unless the star is saturated; it is included in the standard
    /// errors of the centroid.
    pub snr: f64,
    /// What is unusual about it.
    pub flags: DetectionFlags,
}

impl Detection {
    /// Order of brightness, brightest first; equal ones by position.
    pub(crate) fn by_brightness(&self, other: &Self) -> Ordering {
        let (a, b) = (self.position, other.position);
        let by_position = || a.y.total_cmp(&b.y).then(a.x.total_cmp(&b.x));
        let by_flux = other.flux_adu.total_cmp(&self.flux_adu);
        by_flux.then_with(by_position)
    }
}

/// What is unusual about a detection.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct DetectionFlags {
    /// The core reaches the detector's full scale.
    pub saturated: bool,
    /// Sharper than any spot of this camera: a hot pixel or a cosmic ray.
    pub hot_pixel: bool,
    /// Elongated well beyond the spot: a satellite, an aircraft, a streak.
    pub trail: bool,
    /// Wider than a spot: a galaxy, a comet, a lamp, an edge of the landscape.
    pub extended: bool,
    /// Touches another detection, and was fitted together with it.
    pub blended: bool,
    /// Cut by the frame's border.
    pub border: bool,
}

impl DetectionFlags {
    /// Whether the source may be a star at the position given.
    pub fn is_star_like(&self) -> bool {
        self.may_be_wide_star() && !self.extended
    }

    /// Whether the source may be a star if the frame's spot is not that of its stars.
    pub(crate) fn may_be_wide_star(&self) -> bool {
        !(self.hot_pixel || self.trail)
    }

    /// Whether the flux is complete and without light of other stars.
    pub fn has_clean_flux(&self) -> bool {
        !(self.saturated || self.blended || self.border)
    }
}

/// All sources of a frame.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub struct Detections {
    /// Brightest first.
    pub sources: Vec<Detection>,
    /// Median background, in ADU.
    pub background_adu: f64,
    /// Median standard deviation of a pixel's background, in ADU.
    pub noise_adu: f64,
    /// Standard deviation of the Gaussian spot before pixel integration, in pixels.
    pub spot_sigma_px: f64,
    /// Median threshold for a peak of the filtered frame, in standard deviations that white noise of
    /// `noise_adu` has after the filter.
    pub threshold_sigma: f64,
    /// The spots where they are not round Gaussians of that size.
    pub psf: Option<MeasuredPsf>,
    /// The trails that the stars are, where they are long ones: `spot_sigma_px` is of their pieces.
    pub trails: Option<StarTrails>,
    /// Light beyond the fitted spots, which is in the fluxes; `None` where it is not significant.
    pub wings: Option<Wings>,
    /// Standard error that all fluxes have in common, relative to them: of the wings, and of what of them may
    /// be missed.
    pub(crate) flux_scale_sigma: f64,
    /// Why the rate of false detections asked for is held less well than in independent noise.
    pub noise_tail: Option<NoiseTail>,
    /// Whether fainter sources were left out, since there are more than
    /// [`DetectConfig::max_detections`](super::DetectConfig::max_detections).
    pub is_truncated: bool,
    /// Whether only the brightest were looked for, in single pixels
    /// ([`detect_brightest_into`](super::detect_brightest_into)).
    pub are_brightest: bool,
    /// How bright a star must be to be detected, by place.
    pub(crate) flux_limits: FluxLimits,
    /// The part of the frame that shows the sky; `None` where all of it does, or where it was not looked
    /// at.
    pub sky_area: Option<SkyArea>,
}

impl Detections {
    /// Whether something dark is in front of the sky at a place.
    pub(crate) fn is_dark(&self, place: &PixelPoint) -> bool {
        self.sky_area
            .as_ref()
            .is_some_and(|area| area.is_dark(place))
    }

    /// Whether the sky is seen at a place.
    pub(crate) fn shows_sky(&self, place: &PixelPoint) -> bool {
        self.sky_area.as_ref().is_none_or(|area| area.shows(place))
    }

    /// Removes what was found before; the lists keep their memory.
    pub(super) fn clear(&mut self) {
        let mut sources = std::mem::take(&mut self.sources);
        let mut flux_limits = std::mem::take(&mut self.flux_limits);
        sources.clear();
        flux_limits.clear();
        *self = Self {
            sources,
            flux_limits,
            ..Self::default()
        };
    }
}

/// The point spread function measured on the stars of a frame, where they are not round Gaussians of
/// one size.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct MeasuredPsf {
    /// Largest ratio of the axes of a star's spot.
    pub axis_ratio: f64,
    /// Smallest and largest standard deviation of the spots over the frame, in pixels: of round ones
    /// of the same area.
    pub sigma_range_px: [f64; 2],
    /// Whether the spots are lopsided along the line from the centre of the frame: coma.
    pub is_comatic: bool,
}

/// The trails that all stars of a frame are.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct StarTrails {
    /// Their angle to the image's x axis, in radians, in (−π/2, π/2]; positive where they rise to the
    /// right.
    pub angle_rad: f64,
    /// Their length, in pixels.
    pub length_px: f64,
    /// Standard error of where their middle is, the same for all stars, in pixels.
    pub middle_sigma_px: f64,
}

/// Light of the stars that the spots fitted to them do not have: beyond them, or less than theirs where `share`
/// is below 0.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Wings {
    /// That light over that of the fitted spots.
    pub share: f64,
    /// Its standard error.
    pub sigma: f64,
}

/// What makes large values of the filtered noise more frequent than in independent noise.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum NoiseTail {
    /// The noise of neighboring pixels is correlated, as compression and denoising leave it.
    Correlated,
    /// The noise is below the steps of the grey levels, and has more large values than that
    /// explains.
    Coarse,
    /// The black level cuts off the lower part of the noise.
    CutOff,
}
