//! How often is a name wrong where more than stars is in the picture? And is a picture of something
//! else ever taken for the sky?
//!
//! [`Setup`], catalogue, [`ClutterKind`], seed → for each frame [`ClutteredFrame`] → the pipeline →
//! [`ClutterFrameResult`] → [`KindResult`]
//!
//! 1. A sky is simulated at a random attitude, or a picture of no sky is drawn.
//! 2. Clutter is drawn before the sky or into it, and the frame recorded as cameras do. Stars behind
//!    opaque clutter are not there.
//! 3. The frame is processed with nothing known beforehand.
//! 4. Detections and names are compared with the truth. A detection is false where no star bright
//!    enough has light. A name is wrong where that very star is not within two pixels, two standard
//!    deviations of the spot, or three stated standard errors.
//!
//! Random numbers depend on the seed, the kind and the frame's number only: results are the same on
//! any number of threads.
//!
//! Caveats: drawn foliage, roofs and lamps have the sharp edges, the crowding and the brightness of
//! real ones, but not their variety. The stars are those of the catalogue that is searched.

mod canvas;
mod chance;
mod evaluation;
mod frames;
mod kind;
mod no_sky;
mod recording;
mod scenery;
mod table;

pub use evaluation::ClutterFrameResult;
pub use frames::{ClutteredFrame, FrameMaker, FrameTruth};
pub use kind::ClutterKind;
pub use table::KindResult;

use crate::detect::DetectConfig;
use crate::identify::IndexedCatalog;
use crate::lab::simulate::Setup;
use crate::lab::{StudyError, trials};
use crate::solve::{Context, Workspace, solve_frame};

/// What all kinds of frames of a study have in common.
#[derive(Debug, Clone, PartialEq)]
pub struct ClutterProtocol {
    /// Camera, sky, exposure and scene.
    pub setup: Setup,
    /// Frames of each kind.
    pub frames: u64,
    /// Seed of the random numbers.
    pub seed: u64,
}

/// Runs the frames of one kind on the threads of the current pool; `done` is called after each.
///
/// # Errors
/// [`StudyError`] where a frame cannot be made or processed.
pub fn run(
    kind: ClutterKind,
    protocol: &ClutterProtocol,
    indexed: &IndexedCatalog,
    done: &(dyn Fn() + Sync),
) -> Result<KindResult, StudyError> {
    let maker = FrameMaker::new(kind, &protocol.setup, indexed)?;
    let asked_per_mpx = protocol.setup.scenario.conditions.false_alarms_per_mpx;
    let context = Context {
        detect: DetectConfig {
            false_alarms_per_mpx: asked_per_mpx,
            ..DetectConfig::default()
        },
        ..Context::new(indexed)
    };
    let result = |number: u64, workspace: &mut Workspace| {
        let made = maker.frame(protocol.seed, number)?;
        let solution = solve_frame(&made.frame, &context, workspace)?;
        Ok(evaluation::evaluate(&maker, made.sky.as_ref(), &solution))
    };
    let results: Result<Vec<ClutterFrameResult>, StudyError> =
        trials::run(protocol.frames, done, result);
    Ok(KindResult::new(kind, &results?, &protocol.setup.scenario))
}
