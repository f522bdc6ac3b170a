//! The frames of a calibration.

use super::formats::Pointing;
use crate::base::coords::{Camera, Icrs, Rotation};
use crate::base::epoch::ObservationDate;
use crate::camera::CameraModel;
use crate::identify::fit::JointFrame;
use crate::pipeline::{Outcome, Reason, Solution};
use crate::sky::observer::Observation;
use crate::sky::places::StarPlaces;

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
    /// It has another size, or is mirrored differently.
    #[error("its {found} are not those of the others, {expected}")]
    OtherSize {
        /// What it has.
        found: String,
        /// What most frames have.
        expected: String,
    },
    /// It has another focal length.
    #[error("its focal length, {found_px:.2} px, is not that of the others, {expected_px:.2} px")]
    OtherFocalLength {
        /// What it has.
        found_px: f64,
        /// The median of all.
        expected_px: f64,
    },
    /// The lens of the others misses its stars.
    #[error(
        "the lens of the others misses its stars by {found_px:.2} px, and theirs by {expected_px:.2} px"
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
            Self::OtherSize { .. } => "other_size",
            Self::OtherFocalLength { .. } => "other_focal_length",
            Self::Misfit { .. } => "misfit",
        }
    }
}

impl LensFrame {
    /// The stars of a solved frame, which has this name.
    ///
    /// # Errors
    /// [`Unfit::NotIdentified`].
    pub fn new(name: &str, solution: &Solution) -> Result<Self, Unfit> {
        let found = match &solution.outcome {
            Outcome::Identified(found) => found,
            Outcome::NotIdentified(reason) => {
                let code = Reason::code(reason);
                return Err(Unfit::NotIdentified { code });
            }
        };
        Ok(Self {
            name: name.to_owned(),
            camera: found.camera,
            places: found.places,
            date: solution.date.map(|known| known.date),
            observation: solution.observation,
            joint: JointFrame {
                stars: solution.measured_stars(found).collect(),
                icrs_to_camera: found.icrs_to_camera,
            },
        })
    }

    /// Number of its stars.
    pub fn stars(&self) -> usize {
        self.joint.stars.len()
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
