//! What a page shows of the frames of runs: rows of a table, and small pictures of those that failed.

use serde::Serialize;
use starpipe::lab::robustness::Answer;
use starpipe::lab::validation::{FrameRecord, RunTables, Validator};
use starpipe::report::page::Thumbnail;

/// Rows of a table on a page; frames.csv has all of them.
pub(super) const MOST_ROWS: usize = 5000;

/// The most used columns of a frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct RunFrameRow {
    /// The run, where there are several.
    run: Option<String>,
    pub(super) frame: u64,
    pub(super) status: Answer,
    pub(super) reason: Option<String>,
    stars_above_limit: u64,
    detected: u64,
    named: u64,
    misnamed: u64,
    false_detections: u64,
    error_x_arcsec: Option<f64>,
    error_y_arcsec: Option<f64>,
    error_roll_arcsec: Option<f64>,
    nees: Option<f64>,
    rms_px: Option<f64>,
    predicted_limit_vmag: f64,
    measured_limit_vmag: Option<f64>,
    faintest_vmag: Option<f64>,
    ra_deg: f64,
    dec_deg: f64,
    notes: Option<String>,
}

impl From<FrameRecord> for RunFrameRow {
    fn from(record: FrameRecord) -> Self {
        Self {
            run: None,
            frame: record.frame,
            status: record.status,
            reason: record.reason,
            stars_above_limit: record.stars_above_limit,
            detected: record.detected,
            named: record.named,
            misnamed: record.misnamed,
            false_detections: record.false_detections,
            error_x_arcsec: record.error_x_arcsec,
            error_y_arcsec: record.error_y_arcsec,
            error_roll_arcsec: record.error_roll_arcsec,
            nees: record.nees,
            rms_px: record.rms_px,
            predicted_limit_vmag: record.predicted_limit_vmag,
            measured_limit_vmag: record.measured_limit_vmag,
            faintest_vmag: record.faintest_vmag,
            ra_deg: record.ra_deg,
            dec_deg: record.dec_deg,
            notes: record.notes,
        }
    }
}

impl RunFrameRow {
    fn failed(&self) -> bool {
        self.status != Answer::Right
    }

    /// What went wrong.
    fn failure(&self) -> String {
        match (&self.reason, self.status) {
            (_, Answer::Wrong) => "identified incorrectly".to_owned(),
            (Some(reason), _) => format!("not identified: {}", reason.replace('_', " ")),
            (None, _) => "not identified".to_owned(),
        }
    }
}

/// What a page shows of the frames of one run.
#[derive(Default)]
pub(super) struct RunFrames {
    /// Wrong ones first, then those without an answer, then the others; at most [`MOST_ROWS`].
    pub(super) rows: Vec<RunFrameRow>,
    /// Pictures of those that failed.
    pub(super) pictures: Vec<Thumbnail>,
}

impl RunFrames {
    /// The frames of a run, and at most so many pictures, of frames that are simulated again.
    pub(super) fn of(
        tables: &RunTables,
        validator: &Validator,
        most_pictures: usize,
    ) -> anyhow::Result<Self> {
        let (mut rows, mut right) = (Vec::new(), Vec::new());
        for record in tables.frames()? {
            let row = RunFrameRow::from(record?);
            let list = if row.failed() { &mut rows } else { &mut right };
            if list.len() < MOST_ROWS {
                list.push(row);
            }
        }
        rows.sort_by_key(|row| row.status != Answer::Wrong);
        let mut pictures = Vec::new();
        for row in rows.iter().take(most_pictures) {
            let frame = validator.frame(row.frame)?;
            let name = format!("frame {}", row.frame);
            pictures.push(Thumbnail::new(name, row.failure(), &frame)?);
        }
        rows.extend(right);
        rows.truncate(MOST_ROWS);
        Ok(Self { rows, pictures })
    }
}

/// The frames of several runs that failed.
#[derive(Default)]
pub(super) struct FailedFrames {
    pub(super) rows: Vec<RunFrameRow>,
    pub(super) pictures: Vec<Thumbnail>,
}

impl FailedFrames {
    /// Adds those of a run.
    pub(super) fn add(&mut self, run: &str, frames: RunFrames) {
        let failed = frames.rows.into_iter().filter(RunFrameRow::failed);
        let named = failed.map(|row| RunFrameRow {
            run: Some(run.to_owned()),
            ..row
        });
        self.rows.extend(named);
        self.rows.truncate(MOST_ROWS);
        let pictures = frames.pictures.into_iter().map(|mut picture| {
            picture.name = format!("{run}, {}", picture.name);
            picture
        });
        self.pictures.extend(pictures);
        self.pictures.truncate(Thumbnail::MAX);
    }
}
