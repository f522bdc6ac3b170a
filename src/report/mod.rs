//! What is reported of a frame? Plain values with units in their names, as JSON, table or text.
//!
//! [`Solution`](crate::solve::Solution) → [`FrameReport`] → JSON line, CSV rows or text
//!
//! [`Track`](crate::track::Track) → [`TrackReport`] → JSON line or text
//!
//! [`overlay`] draws the frame with its stars, [`figure`] draws charts and maps, [`page`] shows the frame in a
//! browser; [`wcs`] writes its coordinates as a FITS header.
//!
//! Conventions: [`crate::conventions`]. Numbers are rounded to their significant digits. A number
//! that is not finite is `null` in JSON and an empty field in CSV. Fields may be added to the JSON;
//! none is renamed or dropped without a new [`SCHEMA`].

mod annotations;
mod bodies;
mod build;
mod digits;
pub mod figure;
mod frame_report;
mod lens;
#[cfg(feature = "overlay")]
pub mod overlay;
#[cfg(feature = "page")]
pub mod page;
mod prediction;
mod reason;
pub mod regions;
mod sky;
pub mod sky_figure;
mod sky_text;
mod star_row;
mod stars;
pub mod tables;
#[cfg(test)]
mod tests;
mod text;
mod track;
mod trails;
pub mod wcs;

pub use frame_report::{
    AnnotationReport, ApparentReport, AttitudeReport, AttitudeSigma, BackgroundReport, BodyReport,
    CalibrationReport, CompletenessReport, ConstellationReport, DateReport, DistortionReport,
    MagnitudeReport, MatchReport, NoteReport, ObservationReport, OpticsReport, PhotometryReport,
    PredictionReport, SiteReport, StarReport, Status, TimingReport, TrailReport,
};
pub use frame_report::{FrameReport, SCHEMA};
pub use lens::LensReport;
pub use sky::{SkyCellReport, SkyReport, ZenithReport};
pub use star_row::StarRow;
pub use stars::detections;
pub use text::{STARS_SHOWN, TextOptions};
pub use track::TrackReport;
pub use track::{AxesReport, NotTrackedReport, TrackOpticsReport, TrackTimingReport};
