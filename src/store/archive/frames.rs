//! The frames of an archive, with what is looked at most.

use super::parts::{Archive, PartState};
use super::read::{cell, for_each_row, open};
use crate::store::error::StoreError;
use parquet::errors::ParquetError;
use parquet::file::reader::ChunkReader;
use serde::Serialize;
use std::path::Path;

/// A row of columns that are read from tables.
macro_rules! read_row {
    ($(#[$attribute:meta])* $row:ident { $($field:ident: $type:ty,)* }) => {
        $(#[$attribute])*
        pub struct $row {
            $(pub $field: $type,)*
        }

        impl $row {
            /// Calls `each` with every row of a table.
            pub(super) fn for_each(
                table: impl ChunkReader + 'static,
                mut each: impl FnMut(Self),
            ) -> Result<(), ParquetError> {
                for_each_row(table, Some(&[$(stringify!($field)),*]), |row| {
                    each(Self {
                        $($field: cell(row, stringify!($field)),)*
                    });
                })
            }
        }
    };
}

read_row! {
    /// A frame, with the most used columns of its row in the table of frames.
    #[derive(Debug, Clone, PartialEq, Default, Serialize)]
    #[expect(missing_docs, reason = "columns of the table of frames")]
    FrameSummary {
        frame: String,
        status: String,
        reason_code: String,
        night: String,
        t_min: Option<f64>,
        exposure_s: Option<f64>,
        camera: String,
        ra_deg: Option<f64>,
        dec_deg: Option<f64>,
        detected: Option<u64>,
        matched: Option<u64>,
        rms_px: Option<f64>,
        zero_point_vmag: Option<f64>,
        limit50_vmag: Option<f64>,
        limit50_sigma_mag: Option<f64>,
        predicted_limit50_vmag: Option<f64>,
        limit_difference_mag: Option<f64>,
        sky_mag_arcsec2: Option<f64>,
        notes: String,
        reason: String,
    }
}

impl FrameSummary {
    /// Whether its stars are identified.
    pub fn is_identified(&self) -> bool {
        self.status == "identified"
    }

    /// Calls `each` with every frame in the file of a part.
    pub(super) fn for_each_in(path: &Path, each: impl FnMut(Self)) -> Result<(), StoreError> {
        let read = Self::for_each(open(path)?, each);
        read.map_err(StoreError::table("reading", path))
    }
}

/// The frames of the parts that are whole, in the order of their names.
///
/// # Errors
/// [`StoreError::File`], [`StoreError::Table`].
pub fn frames(archive: &Archive) -> Result<Vec<FrameSummary>, StoreError> {
    let mut frames = Vec::new();
    for path in archive.tables_of_frames(PartState::Whole) {
        FrameSummary::for_each_in(&path, |frame| frames.push(frame))?;
    }
    Ok(frames)
}
