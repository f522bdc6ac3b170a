//! Why a frame was not identified, by what its picture shows instead of stars.

use super::outcome::{Outcome, Reason};
use crate::detect;
use crate::identify::SearchFailure;
use crate::identify::diagnosis::{Unexplained, picture_bytes};

/// The outcome, with the cause that the picture shows where the search has none or a weaker one.
pub(super) fn explained(
    outcome: Outcome,
    picture: &Unexplained,
    detector: &detect::Workspace,
) -> Outcome {
    let Outcome::NotIdentified(reason) = &outcome else {
        return outcome;
    };
    let known = match reason {
        // What agrees so well is likely a sky.
        Reason::Search(SearchFailure::Interrupted | SearchFailure::NotConfirmed { .. }) => {
            return outcome;
        }
        Reason::Search(_) => None,
        Reason::Diagnosis(cause) => Some(cause),
    };
    let frame = picture.frame;
    if detector.is_interrupted() || !detector.has_room(frame, picture_bytes(frame.pixels.len())) {
        return outcome;
    }
    match picture.look(known) {
        Some(cause) => Outcome::NotIdentified(Reason::Diagnosis(cause)),
        None => outcome,
    }
}
