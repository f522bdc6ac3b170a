//! Which lens does a camera have? It is measured in several of its frames at once.
//!
//! solved frames → [`LensFrame`] for each ([`Solution::lens_frame`](crate::Solution::lens_frame)) → [`calibrate()`] → [`LensCalibration`] with the
//! [`KnownLens`](crate::camera::KnownLens) that `camera.toml` holds
//!
//! 1. Frames of another size or focal length are left out, and copies of others: they are one observation.
//! 2. The attitude of each frame and one lens are fitted together, with errors that explain the
//!    residuals; stars that are off pull no harder than others.
//!    What frames of one direction have in common counts once, however many they are.
//! 3. The ideal lens and the terms of its distortion are those that predict best the stars that a fit
//!    leaves out: a fifth of them at a time.
//! 4. Frames whose stars this lens misses are left out, and all of it is repeated.
//! 5. The errors are those within which the directions of the frames agree.
//! 6. What the frames say beyond the lens: where it is known, whether its scale drifts, and how a camera
//!    that does not move stands on its mount.

mod calibrate;
mod contradictions;
mod copies;
mod coverage;
mod cross_validation;
mod direction_scatter;
mod frames;
mod mount;
mod repeats;
mod scale_drift;

pub use calibrate::MEASURED_BY;
pub use calibrate::{CalibrateError, LensCalibration, UsedFrame, calibrate};
pub use coverage::{Coverage, CoverageCell};
pub use frames::{LeftOutFrame, LensFrame, Unfit};
pub use mount::Mount;
pub use scale_drift::{FrameScale, ScaleDrift};
