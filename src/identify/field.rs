//! The stars observed in one frame: the input of identification.

use crate::base::coords::PixelPoint;
use crate::detect::SkyArea;
use crate::ephemeris::places::StarPlaces;

/// Position of a source in the frame's list of sources: its detections, or the lines of a centroid
/// list.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SourceIndex(usize);

impl SourceIndex {
    /// The source at `position` in its list.
    pub const fn new(position: usize) -> Self {
        Self(position)
    }

    /// The position in the list of sources.
    pub const fn get(self) -> usize {
        self.0
    }
}

/// One observed star.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObservedStar {
    /// The source that it is.
    pub source: SourceIndex,
    /// Its centroid.
    pub position: PixelPoint,
    /// Standard error of the centroid on one axis, in pixels.
    pub sigma_px: f64,
    /// Brightness in magnitudes, see [`StarField::photometry`].
    pub mag: f64,
    /// Whether the detector was saturated. The star may then be brighter than `mag` by any amount.
    pub is_saturated: bool,
}

/// What the observed magnitudes mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Photometry {
    /// −2.5 log10(flux) with an unknown zero point.
    Instrumental,
    /// Johnson V.
    JohnsonV,
}

impl Photometry {
    /// Largest difference between an observed magnitude, converted to V by the zero point, and the
    /// catalogue's.
    pub const fn tolerance_mag(self) -> f64 {
        match self {
            // Color, saturation, and the tone curve of a JPEG.
            Self::Instrumental => 2.5,
            Self::JohnsonV => 1.5,
        }
    }
}

/// The stars observed in one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct StarField {
    /// Width of the frame, in pixels.
    pub width_px: f64,
    /// Height of the frame, in pixels.
    pub height_px: f64,
    /// What the magnitudes of `stars` mean.
    pub photometry: Photometry,
    /// Where the catalogue's stars appear.
    pub places: StarPlaces,
    /// Standard deviation of the PSF before pixel integration, in pixels. Without it no catalogue
    /// stars are treated as blended.
    pub spot_sigma_px: Option<f64>,
    /// The part of the frame that shows the sky; `None` where all of it does.
    pub sky_area: Option<SkyArea>,
    /// Brightest first.
    pub stars: Vec<ObservedStar>,
}

impl StarField {
    /// Whether the sky is seen at a place.
    pub(super) fn shows_sky(&self, place: &PixelPoint) -> bool {
        self.sky_area.as_ref().is_none_or(|area| area.shows(place))
    }

    /// The same frame with these stars, brightest first.
    pub(super) fn with_stars(&self, stars: Vec<ObservedStar>) -> Self {
        let sky_area = self.sky_area.clone();
        Self {
            stars,
            sky_area,
            ..*self
        }
    }

    /// The `count` brightest stars, or all if there are fewer.
    pub fn brightest(&self, count: usize) -> &[ObservedStar] {
        &self.stars[..count.min(self.stars.len())]
    }
}

/// The stars of the same frame, detected otherwise, in pixels of the whole frame.
pub trait OtherFields {
    /// A few of the brightest, as single pixels show them; `None` where there are none.
    fn few_brightest(&self) -> Option<&StarField>;

    /// So many of them that parts of the frame have enough; `None` where there are none.
    fn many_brightest(&self) -> Option<&StarField>;

    /// Number of lower resolutions.
    fn resolutions(&self) -> usize;

    /// The stars at one of them; `None` where there are none.
    fn at_resolution(&self, number: usize) -> Option<&StarField>;
}

#[cfg(test)]
impl StarField {
    /// Stars at these places in a frame of this width and height, each a magnitude fainter than the
    /// one before.
    pub(super) fn of_places([width_px, height_px]: [f64; 2], places: &[(f64, f64)]) -> Self {
        let star = |(index, &(x, y)): (usize, &(f64, f64))| ObservedStar {
            source: SourceIndex::new(index),
            position: PixelPoint::new(x, y),
            sigma_px: 0.1,
            mag: index as f64,
            is_saturated: false,
        };
        Self {
            width_px,
            height_px,
            photometry: Photometry::Instrumental,
            places: StarPlaces::default(),
            spot_sigma_px: None,
            sky_area: None,
            stars: places.iter().enumerate().map(star).collect(),
        }
    }
}
