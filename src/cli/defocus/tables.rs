//! The tables of a study as CSV.

use crate::cli::output::rows::csv_table;
use starpipe::lab::spot_radius::{DefocusReport, GridRow, StarStudy};

/// A row for each point of the grid.
pub(super) fn grid_table(studies: &[StarStudy]) -> anyhow::Result<String> {
    csv_table(studies.iter().flat_map(GridRow::rows))
}

/// A row for each radius.
pub(super) fn curve_table(report: &DefocusReport) -> anyhow::Result<String> {
    csv_table(report.stars.iter().flat_map(|star| &star.curve))
}
