//! The stars of a frame as a table.

use super::frame_report::{FrameReport, StarReport};
use crate::base::format::table_name;
use crate::frame::RowOrder;
use std::io;

/// The columns, in order. `flags` are separated by blanks; `flux_e` and `peak_e` are filled where a
/// camera is stated. `x` and `y` count from the top of the picture, whichever `row_order` the file has.
pub const TABLE_COLUMNS: [&str; 20] = [
    "frame",
    "x",
    "y",
    "sigma_x",
    "sigma_y",
    "flux",
    "peak",
    "snr",
    "id",
    "name",
    "vmag",
    "ra_deg",
    "dec_deg",
    "residual_px",
    "residual_blend_px",
    "p_chance",
    "flags",
    "flux_e",
    "peak_e",
    "row_order",
];

/// Writes the row of column names.
///
/// # Errors
/// Errors of the writer.
pub fn write_table_header<W: io::Write>(writer: &mut csv::Writer<W>) -> csv::Result<()> {
    writer.write_record(TABLE_COLUMNS)
}

impl FrameReport {
    /// Writes one row per detection, brightest first, without the row of column names
    /// ([`write_table_header`]).
    ///
    /// # Errors
    /// Errors of the writer.
    pub fn write_table_rows<W: io::Write>(&self, writer: &mut csv::Writer<W>) -> csv::Result<()> {
        for star in &self.stars {
            writer.write_record(self.row(star))?;
        }
        Ok(())
    }

    /// The order of the rows in the file; empty for a list of centroids.
    pub(crate) fn row_order_word(&self) -> &'static str {
        self.row_order.map_or("", RowOrder::word)
    }

    fn row(&self, star: &StarReport) -> [String; TABLE_COLUMNS.len()] {
        let number = |value: Option<f64>| value.map(|v| v.to_string()).unwrap_or_default();
        let word = |value: &Option<String>| value.as_deref().map(table_name).unwrap_or_default();
        [
            table_name(&self.frame),
            star.x.to_string(),
            star.y.to_string(),
            number(star.sigma_x),
            number(star.sigma_y),
            number(star.flux),
            number(star.peak),
            number(star.snr),
            word(&star.id),
            word(&star.name),
            number(star.vmag),
            number(star.ra_deg),
            number(star.dec_deg),
            number(star.residual_px),
            number(star.residual_blend_px),
            star.p_chance.map(|p| format!("{p:e}")).unwrap_or_default(),
            star.flags.join(" "),
            number(star.flux_e),
            number(star.peak_e),
            self.row_order_word().to_owned(),
        ]
    }
}
