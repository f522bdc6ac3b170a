//! What does a night show? One camera on its mount, frame by frame.
//!
//! solved frames of a night, in the order of their dates → [`NightRow`] for each → [`NightSummary`]
//!
//! 1. Frames spread over the night are solved with nothing known. They tell the lens, how the camera stands
//!    in the sky of its site, and the air without clouds ([`NightStart`]).
//!    Frames of different exposure tell the level of a pixel without light, where nothing else does
//!    ([`dark_level()`]).
//! 2. Each frame is solved from where the camera is held. Its sky is measured, also where its stars are not
//!    identified: by the attitude that the mount and the date give ([`NightRow`]).
//! 3. The fixed pointing follows the frames. A jump is a pointing that differs from it in several frames that
//!    agree with each other ([`PointingHistory`]).
//! 4. What stays in its place as the stars move on is a hot pixel ([`hot_pixels()`]).
//! 5. A frame without stars that is of the day, a dark, or shows trails is passed over ([`NoSky`]).
//! 6. The series tell when something changes ([`Moment`]).
//!
//! Caveats: a camera that follows the stars has no pointing in the horizon to hold; its frames are solved
//! one by one.

mod almanac;
mod cells;
mod change_detection;
mod dark_level;
mod figure;
mod hot_pixels;
mod moments;
mod no_sky;
mod pointing;
mod row;
mod skyglow;
mod start;
mod summary;

pub use almanac::{Almanac, is_by_day};
pub use cells::{Hundredths, NightCells};
pub use dark_level::{FrameLevel, dark_level};
pub use figure::svg;
pub use hot_pixels::{NightHotPixel, OutlierPixels, hot_pixels};
pub use moments::{Moment, MomentKind};
pub use no_sky::NoSky;
pub use pointing::{PointingHistory, PointingJump};
pub use row::NightRow;
pub use skyglow::{SkyglowStation, skyglow};
pub use start::{NightStart, Probe, probe_order};
pub use summary::{NightSummary, PassedOverFiles, summarize};
