//! What does a frame show? The stages in order.
//!
//! [`Frame`](crate::frame::Frame) and [`Context`] → [`Solution`].
//!
//! 1. The frame is read, and calibrated where the context has a calibration.
//! 2. Its priors are resolved: the context's, then the camera's, the header's and the file name's.
//! 3. Where only attitude and optics are wanted, the brightest stars are asked first (`pointing`).
//! 4. Stars are detected, in a raw color frame after its mosaic is smoothed to grey, and identified; where they are not, the cause is sought.
//! 5. The Moon and the planets are found where the date is known.
//! 6. Photometry: zero point and limiting magnitude.
//! 7. Where the context has a camera, the frame is compared with it.
//! 8. Notes collect what is odd.

mod bodies;
mod body_in_frame;
mod bright_stars;
mod context;
mod deep;
mod error;
mod explanation;
mod fixed_camera;
mod identification;
mod limits;
mod named_options;
mod note;
mod options;
mod other_stars;
mod outcome;
mod place_time;
mod pointing;
mod pointing_buffers;
mod prepared;
mod raw_color;
#[cfg(test)]
pub(crate) mod sample;
mod solution;
mod solve_list;
mod solved;
mod source;
mod stages;
mod star_field;
mod stopwatch;

pub use body_in_frame::BodyInFrame;
pub use bright_stars::MissingStar;
pub use context::DEFAULT_TIME_LIMIT_S;
pub use context::{Context, Workspace};
pub use deep::{DeepProgress, DeepSky, IndexingWork, OnProgress};
pub use error::Error;
pub use error::remedies_of;
pub use fixed_camera::FixedCamera;
pub use named_options::SolveOptionError;
pub use note::{Note, OtherDirection, OtherScale};
pub use options::SolveOptions;
pub use outcome::{Outcome, Reason};
pub use place_time::{Change, Contradiction, PlaceTime, Proposal};
pub use pointing::find_pointing_in;
pub use raw_color::RawColor;
pub use solution::{Background, Solution};
pub use solve_list::solve_centroids;
pub use source::{Measured, Source};
pub use stages::{solve_file, solve_frame};
pub use stages::{solve_guarded, solve_read};
pub use star_field::star_field;
pub use stopwatch::Stage;
pub use stopwatch::Timing;
