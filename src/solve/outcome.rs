//! Whether a frame was identified, and if not, why.

use crate::base::remedy::Remedy;
use crate::identify::diagnosis::Diagnosis;
use crate::identify::{Identification, SearchFailure};

/// Whether the frame was identified.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// The stars are identified.
    Identified(Box<Identification>),
    /// They are not.
    NotIdentified(Reason),
}

impl Outcome {
    /// The identification, if there is one.
    pub fn identification(&self) -> Option<&Identification> {
        match self {
            Self::Identified(found) => Some(found),
            Self::NotIdentified(_) => None,
        }
    }
}

/// Why a frame was not identified: the cause that diagnosis names, else the failure of the search.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Reason {
    /// The search failed, and nothing else explains it.
    Search(SearchFailure),
    /// A cause was found.
    Diagnosis(Diagnosis),
}

impl Reason {
    /// The options that may help.
    pub fn remedies(&self) -> Vec<Remedy> {
        match self {
            Self::Search(SearchFailure::TooFewStars { .. }) => vec![Remedy::Sigma],
            Self::Search(SearchFailure::NoMatch { .. } | SearchFailure::NotConfirmed { .. }) => {
                vec![Remedy::Fov, Remedy::Near]
            }
            Self::Search(SearchFailure::Interrupted) => vec![Remedy::TimeLimit],
            Self::Diagnosis(Diagnosis::TooNarrow { .. }) => vec![Remedy::Catalog],
            Self::Diagnosis(Diagnosis::HintsExclude(excluded)) => {
                let scale = excluded
                    .allowed_fov_x_rad
                    .map(|_| [Remedy::Fov, Remedy::PixelScale]);
                let region = excluded
                    .distance_rad
                    .map(|_| [Remedy::Near, Remedy::Radius]);
                scale.into_iter().chain(region).flatten().collect()
            }
            Self::Diagnosis(_) => Vec::new(),
        }
    }

    /// Code for programs.
    pub const fn code(&self) -> &'static str {
        match self {
            Self::Search(failure) => failure.code(),
            Self::Diagnosis(cause) => cause.code(),
        }
    }
}
