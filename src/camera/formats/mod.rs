//! A lens in the files of other programs: OpenCV, ROS, RMS and indi-allsky.
//!
//! | format | written | read |
//! |---|---|---|
//! | OpenCV `FileStorage` (cv, cv::fisheye) | [`opencv_yaml`] | [`from_opencv_yaml`] |
//! | ROS `camera_info` | [`ros_camera_info`] | [`from_opencv_yaml`] |
//! | RMS platepar | [`platepar()`] | [`from_platepar`] |
//! | indi-allsky's lens and `VIRTUALSKY` settings | [`indi_allsky_json`] | |
//!
//! What a format can say exactly is converted exactly. Everything else is fitted over what the frame
//! sees, and the largest error is told. Fits of formats that are meant to be exact are refused if they are
//! off by more than [`TOLERANCE_PX`]; functions ending in `_within` take another limit.
//!
//! In all of these programs, as here, the centre of the top-left pixel is (0, 0).

mod error;
mod fit;
mod indi_allsky;
mod opencv;
mod platepar;
mod pointing;
mod ros;
mod sky;
mod yaml;

pub use error::{FormatError, TOLERANCE_PX};
pub use indi_allsky::{IndiAllskyLens, indi_allsky, indi_allsky_json};
pub use opencv::{from_opencv_yaml, from_opencv_yaml_within, opencv_yaml, opencv_yaml_within};
pub use platepar::{from_platepar, from_platepar_within, platepar};
pub use pointing::Pointing;
pub use ros::ros_camera_info;
