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
            Self::Search(SearchFailure::TooFewStars { .. })
            | Self::Diagnosis(Diagnosis::FewStars { .. }) => vec![Remedy::Sigma],
            Self::Search(SearchFailure::NoMatch { .. } | SearchFailure::NotConfirmed { .. }) => {
                vec![Remedy::Fov, Remedy::Near]
            }
            Self::Search(SearchFailure::Interrupted) => vec![Remedy::TimeLimit],
            Self::Diagnosis(Diagnosis::TooNarrow { .. }) => vec![Remedy::Catalog],
            Self::Diagnosis(Diagnosis::HintsExclude(_)) => {
                vec![Remedy::Fov, Remedy::PixelScale]
            }
            Self::Diagnosis(_) => Vec::new(),
        }
    }

    /// log10 of the false-alarm probability of the best arrangement, where none was good enough.
    pub fn best_log10_false_alarm(&self) -> Option<f64> {
        let best = match *self {
            Self::Search(SearchFailure::NoMatch {
                best_log10_false_alarm,
            }) => best_log10_false_alarm,
            Self::Search(SearchFailure::NotConfirmed { log10_false_alarm }) => {
                Some(log10_false_alarm)
            }
            _ => None,
        };
        best.filter(|best| best.is_finite())
    }

    /// Code for programs.
    pub const fn code(&self) -> &'static str {
        match self {
            Self::Search(failure) => failure.code(),
            Self::Diagnosis(cause) => cause.code(),
        }
    }
}
