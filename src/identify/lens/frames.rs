//! The frames of a calibration.

use crate::base::coords::{Camera, Icrs, Rotation};
use crate::base::epoch::ObservationDate;
use crate::camera::CameraModel;
use crate::camera::formats::Pointing;
use crate::catalog::StarIndex;
use crate::ephemeris::observer::Observation;
use crate::ephemeris::places::StarPlaces;
use crate::identify::fit::{JointFrame, MeasuredStar};
use crate::identify::identification::Identification;
use std::cmp::Ordering;

/// A frame with its stars.
#[derive(Debug, Clone)]
pub struct LensFrame {
    /// Its name.
    pub name: String,
    /// The camera as this frame alone has it.
    pub(super) camera: CameraModel,
    pub(super) places: StarPlaces,
    pub(super) date: Option<ObservationDate>,
    pub(super) observation: Option<Observation>,
    pub(super) joint: JointFrame,
    /// The catalogue star that each of its stars is.
    names: Vec<StarIndex>,
    /// Indices of its stars, in the order of these.
    by_name: Vec<usize>,
}

/// A frame that is left out.
#[derive(Debug, Clone, PartialEq)]
pub struct LeftOutFrame {
    /// Its name.
    pub name: String,
    /// Why.
    pub why: Unfit,
}

/// Why a frame is left out.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Unfit {
    /// Its stars are not identified.
    #[error("its stars are not identified ({code})")]
    NotIdentified {
        /// Code of the reason.
        code: &'static str,
    },
    /// Its stars are off by the same noise as those of another frame: it is no further observation.
    #[error(
        "its stars have the same centroid noise as those of {of}: it is a copy of the same exposure"
    )]
    Copy {
        /// The name of the other.
        of: String,
    },
    /// It has another size, or is mirrored differently.
    #[error("its size, {found}, differs from that of the other frames, {expected}")]
    OtherSize {
        /// What it has.
        found: String,
        /// What most frames have.
        expected: String,
    },
    /// It has another focal length.
    #[error(
        "its focal length, {found_px:.2} px, differs from that of the other frames, {expected_px:.2} px"
    )]
    OtherFocalLength {
        /// What it has.
        found_px: f64,
        /// The median of all.
        expected_px: f64,
    },
    /// The lens of the others misses its stars.
    #[error(
        "the lens measured in the other frames does not fit: its residuals are {found_px:.2} px, those of \
         the other frames {expected_px:.2} px"
    )]
    Misfit {
        /// Median distance of its stars, in pixels.
        found_px: f64,
        /// The median of all frames.
        expected_px: f64,
    },
}

impl Unfit {
    /// Code for programs.
    pub const fn code(&self) -> &'static str {
        match self {
            Self::NotIdentified { .. } => "not_identified",
            Self::Copy { .. } => "copy",
            Self::OtherSize { .. } => "other_size",
            Self::OtherFocalLength { .. } => "other_focal_length",
            Self::Misfit { .. } => "misfit",
        }
    }
}

impl LensFrame {
    /// The stars of an identified frame, which has this name.
    pub(crate) fn new(
        name: &str,
        found: &Identification,
        named: impl Iterator<Item = (StarIndex, MeasuredStar)>,
    ) -> Self {
        let (names, stars): (Vec<_>, Vec<_>) = named.unzip();
        let mut by_name: Vec<usize> = (0..names.len()).collect();
        by_name.sort_by_key(|star| names[*star]);
        Self {
            name: name.to_owned(),
            names,
            by_name,
            camera: found.camera,
            places: found.places,
            date: None,
            observation: None,
            joint: JointFrame {
                stars,
                icrs_to_camera: found.icrs_to_camera,
            },
        }
    }

    /// The same, taken then and there.
    pub(crate) fn taken(
        mut self,
        date: Option<ObservationDate>,
        observation: Option<Observation>,
    ) -> Self {
        (self.date, self.observation) = (date, observation);
        self
    }

    /// Number of its stars.
    pub fn stars(&self) -> usize {
        self.joint.stars.len()
    }

    /// The catalogue star that each of its stars is.
    pub(super) fn names(&self) -> &[StarIndex] {
        &self.names
    }

    /// Pairs of indices of the stars that this frame and another one have in common.
    pub(super) fn shared_stars(&self, other: &Self) -> Vec<[usize; 2]> {
        let mut shared = Vec::new();
        let (mut own, mut others) = (self.by_name.iter(), other.by_name.iter());
        let (mut a, mut b) = (own.next(), others.next());
        while let (Some(&star), Some(&of_other)) = (a, b) {
            match self.names[star].cmp(&other.names[of_other]) {
                Ordering::Less => a = own.next(),
                Ordering::Greater => b = others.next(),
                Ordering::Equal => {
                    shared.push([star, of_other]);
                    (a, b) = (own.next(), others.next());
                }
            }
        }
        shared
    }

    /// The same with another attitude.
    pub(super) fn with_attitude(mut self, icrs_to_camera: Rotation<Icrs, Camera>) -> Self {
        self.joint.icrs_to_camera = icrs_to_camera;
        self
    }

    /// Its attitude relative to the directions of the catalogue, if site, date and time are known.
    pub(super) fn pointing(&self) -> Option<Pointing> {
        Some(Pointing {
            icrs_to_camera: self.places.astrometric_attitude(&self.joint.icrs_to_camera),
            site: self.observation?.site,
            date: self.date?,
        })
    }

    /// Columns and rows, and whether it is mirrored.
    pub(super) fn kind(&self) -> (u64, u64, bool) {
        let camera = &self.camera;
        (
            camera.width_px as u64,
            camera.height_px as u64,
            camera.mirrored,
        )
    }
}
