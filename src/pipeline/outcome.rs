//! Whether a frame was identified, and if not, why.

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
pub enum Reason {
    /// The search failed, and nothing else explains it.
    Search(SearchFailure),
    /// A cause was found.
    Diagnosis(Diagnosis),
}

impl Reason {
    /// Code for programs.
    pub const fn code(&self) -> &'static str {
        match self {
            Self::Search(failure) => failure.code(),
            Self::Diagnosis(cause) => cause.code(),
        }
    }
}
