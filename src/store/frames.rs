//! The frames of an archive, with what is looked at most.

use super::directory::Archive;
use super::error::ArchiveError;
use super::read::{count, for_each_row, number, open, text};
use parquet::record::Row;
use serde::Serialize;

/// A frame, with the most used columns of its row in the table of frames.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
#[expect(missing_docs, reason = "columns of the table of frames")]
pub struct FrameSummary {
    pub frame: String,
    pub status: String,
    pub reason_code: String,
    pub night: String,
    pub t_min: Option<f64>,
    pub exposure_s: Option<f64>,
    pub camera: String,
    pub ra_deg: Option<f64>,
    pub dec_deg: Option<f64>,
    pub detected: Option<u64>,
    pub matched: Option<u64>,
    pub rms_px: Option<f64>,
    pub zero_point_vmag: Option<f64>,
    pub limit50_vmag: Option<f64>,
    pub limit50_sigma_mag: Option<f64>,
    pub predicted_limit50_vmag: Option<f64>,
    pub limit_difference_mag: Option<f64>,
    pub sky_mag_arcsec2: Option<f64>,
    pub notes: String,
    pub reason: String,
}

const COLUMNS: [&str; 20] = [
    "frame",
    "status",
    "reason_code",
    "reason",
    "night",
    "t_min",
    "exposure_s",
    "camera",
    "ra_deg",
    "dec_deg",
    "detected",
    "matched",
    "rms_px",
    "zero_point_vmag",
    "limit50_vmag",
    "limit50_sigma_mag",
    "predicted_limit50_vmag",
    "limit_difference_mag",
    "sky_mag_arcsec2",
    "notes",
];

impl FrameSummary {
    /// Whether its stars are identified.
    pub fn is_identified(&self) -> bool {
        self.status == "identified"
    }

    fn from_row(row: &Row) -> Self {
        let text = |column| text(row, column).to_owned();
        let number = |column| number(row, column);
        Self {
            frame: text("frame"),
            status: text("status"),
            reason_code: text("reason_code"),
            reason: text("reason"),
            night: text("night"),
            t_min: number("t_min"),
            exposure_s: number("exposure_s"),
            camera: text("camera"),
            ra_deg: number("ra_deg"),
            dec_deg: number("dec_deg"),
            detected: count(row, "detected"),
            matched: count(row, "matched"),
            rms_px: number("rms_px"),
            zero_point_vmag: number("zero_point_vmag"),
            limit50_vmag: number("limit50_vmag"),
            limit50_sigma_mag: number("limit50_sigma_mag"),
            predicted_limit50_vmag: number("predicted_limit50_vmag"),
            limit_difference_mag: number("limit_difference_mag"),
            sky_mag_arcsec2: number("sky_mag_arcsec2"),
            notes: text("notes"),
        }
    }
}

/// The frames of the parts that are whole, in the order of their names.
///
/// # Errors
/// [`ArchiveError::File`], [`ArchiveError::Table`].
pub fn frames(archive: &Archive) -> Result<Vec<FrameSummary>, ArchiveError> {
    let mut frames = Vec::new();
    for part in archive.parts_with_frames() {
        let path = archive.frames_of(&part);
        let read = for_each_row(open(&path)?, &COLUMNS, |row| {
            frames.push(FrameSummary::from_row(row));
        });
        read.map_err(ArchiveError::table("reading", &path))?;
    }
    Ok(frames)
}
