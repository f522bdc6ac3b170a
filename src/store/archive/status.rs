//! How far an archive is.

use super::frame_row::UNREAD;
use super::frames::FrameSummary;
use super::parts::{Archive, PartState};
use crate::store::error::StoreError;
use serde::Serialize;

/// How far an archive is.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct ArchiveStatus {
    /// Parts in all.
    pub parts: usize,
    /// Parts that are written and whole.
    pub parts_done: usize,
    /// Numbers of the parts that are missing, from 0.
    pub missing_parts: Vec<usize>,
    /// Numbers of the parts that were changed since they were written, from 0.
    pub damaged_parts: Vec<usize>,
    /// Files in all.
    pub files: usize,
    /// Files in the parts that are whole.
    pub files_done: usize,
    /// Frames in those parts; a file may have several.
    pub frames: usize,
    /// Identified frames.
    pub identified: usize,
    /// Frames that are not identified.
    pub not_identified: usize,
    /// Frames that could not be read or searched.
    pub unread: Vec<UnreadFrame>,
}

/// A frame that could not be read or searched.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct UnreadFrame {
    /// Its name.
    pub frame: String,
    /// Why.
    pub reason: String,
}

impl ArchiveStatus {
    /// Whether all parts are written and whole.
    pub fn is_complete(&self) -> bool {
        self.parts_done == self.parts
    }
}

/// How far `archive` is.
///
/// # Errors
/// [`StoreError::File`], [`StoreError::Table`] for a part that is not what was written.
pub fn status(archive: &Archive) -> Result<ArchiveStatus, StoreError> {
    let plan = archive.plan();
    let mut status = ArchiveStatus {
        parts: plan.parts().len(),
        files: plan.names().len(),
        ..ArchiveStatus::default()
    };
    for part in plan.parts() {
        let lost = match archive.state(&part) {
            PartState::Missing => Some(&mut status.missing_parts),
            PartState::Damaged => Some(&mut status.damaged_parts),
            PartState::Whole => None,
        };
        if let Some(lost) = lost {
            lost.push(part.number);
            continue;
        }
        status.parts_done += 1;
        status.files_done += part.names.len();
        FrameSummary::for_each_in(&archive.frames_of(&part), |frame| {
            status.frames += 1;
            match frame.status.as_str() {
                "identified" => status.identified += 1,
                UNREAD => status.unread.push(UnreadFrame {
                    frame: frame.frame,
                    reason: frame.reason,
                }),
                _ => status.not_identified += 1,
            }
        })?;
    }
    Ok(status)
}
