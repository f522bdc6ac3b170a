//! Where does the camera point now, when it is known where it pointed a moment ago?
//!
//! ([`Frame`](crate::frame::Frame), time) → [`Tracker`] → [`Track`]
//!
//! 1. `motion`: the attitude and the angular rate of the frames before give the attitude of this
//!    one, with its error.
//! 2. `guides`: the brightest catalogue stars of the field that stand alone.
//! 3. [`windows`](crate::detect::windows): their centroids, within the predicted error of their
//!    predicted places. Nothing else of the frame is read.
//! 4. `pose`: the attitude that fits the centroids, with its covariance. It is that of this frame
//!    alone: the frames before it do not smooth it.
//! 5. `agreement`: the probability that chance gives as good an agreement decides, with the bound
//!    of identification, [`LOG10_FALSE_ALARM_LIMIT`](crate::identify::LOG10_FALSE_ALARM_LIMIT).
//!    Where it is missed, the frame is solved in full at once, as
//!    [`solve_frame`](crate::solve::solve_frame) does.
//! 6. `lens`: focal length and distortion are refined slowly, from frame to frame.
//!
//! The first two frames are solved in full: one attitude has no rate.
//!
//! Caveats: the rate is taken as constant from frame to frame, up to an acceleration that is
//! estimated. The distortion keeps the model that the first full solution chose.

mod agreement;
mod guides;
mod lens;
mod motion;
mod outcome;
mod pose;
mod tracker;

pub use outcome::{AngularRate, Attitude, Loss, Mode, Track, TrackedStar};
pub use tracker::DEFAULT_STARS;
pub use tracker::Tracker;
