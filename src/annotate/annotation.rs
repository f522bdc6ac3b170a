//! Something in a frame that has a name.

use crate::base::coords::PixelPoint;
use crate::catalog::StarIndex;
use crate::identify::SourceIndex;

/// Something in the frame that has a name.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Annotation {
    pub kind: AnnotationKind,
    /// Its name, in full.
    pub name: String,
    /// Its name beside it in a picture.
    pub label: String,
    /// Where it is in the frame.
    pub position: PixelPoint,
    /// Its light is within so many pixels of there.
    pub uncertainty_px: f64,
    /// Its V magnitude, where it has one.
    pub v_mag: Option<f64>,
    /// Half of its longer side, in pixels; 0 for what has no size.
    pub radius_px: f64,
}

/// What an annotation names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum AnnotationKind {
    Star {
        star: StarIndex,
        /// The detection of its light, where there is one.
        source: Option<SourceIndex>,
        /// Why that is not its measurement; `None` where it is.
        unmeasured: Option<Unmeasured>,
    },
    Constellation,
    DeepSky {
        /// As in `M 42`; also its name, where it has no other.
        designation: &'static str,
    },
    Body {
        /// The detection that it is.
        source: Option<SourceIndex>,
    },
    Radiant,
}

impl AnnotationKind {
    /// Its name in JSON.
    pub const fn code(self) -> &'static str {
        match self {
            Self::Star { .. } => "star",
            Self::Constellation => "constellation",
            Self::DeepSky { .. } => "deep_sky",
            Self::Body { .. } => "body",
            Self::Radiant => "radiant",
        }
    }
}

/// Why the light of a star in a frame is not its measurement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Unmeasured {
    /// Its spot is saturated.
    Saturated,
    /// Its light is that of several stars.
    Blended,
    /// Its spot is wider than a star's: a trail, a glow, or a disc.
    Extended,
    /// It is at the border of the frame.
    Border,
    /// Its place and brightness do not make its name as sure as other names are.
    Uncertain,
}

impl Unmeasured {
    /// Its name in JSON.
    pub const fn code(self) -> &'static str {
        match self {
            Self::Saturated => "saturated",
            Self::Blended => "blended",
            Self::Extended => "extended",
            Self::Border => "border",
            Self::Uncertain => "uncertain",
        }
    }
}
