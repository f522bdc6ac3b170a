//! The summary as text for people.

use super::summary::{CellGroup, ClearTenth, GroupRow, SkySummary};
use std::fmt::Write as _;

const GROUPS_HEADING: &str = "Measured minus true: mean ± standard deviation in magnitudes, and RMS of error over stated error (1 expected).

               frames  right  wrong  measured                 zenith                  cells   extinction, RMS            limit    clouds, RMS    area
";
const CELLS_HEADING: &str = "
cells                               brightness                 clouds                  limit
";
const CLEAR_HEADING: &str = "
Stated probability of a clear sky, and fraction of cells with less than 0.2 mag of cloud extinction
                cells     mean           band    share
";

impl SkySummary {
    /// The summary as text of several lines.
    pub fn to_text(&self) -> String {
        let mut text = GROUPS_HEADING.to_owned();
        for row in &self.groups {
            text += &line(row);
        }
        text += CELLS_HEADING;
        for row in &self.cells {
            text += &cell_line(row);
        }
        text += CLEAR_HEADING;
        for tenth in &self.clear {
            let ClearTenth {
                clear_from,
                clear_to,
                cells,
                mean_clear,
                mean_clear_low,
                mean_clear_high,
                share_clear,
            } = tenth;
            let _ = writeln!(
                text,
                "  {clear_from:.1} to {clear_to:.1} {cells:>8} {mean_clear:>8.3}  {mean_clear_low:.3} to {mean_clear_high:.3} {share_clear:>8.3}"
            );
        }
        text
    }
}

fn dash() -> String {
    "–".to_owned()
}

fn spread(mean: Option<f64>, sd: Option<f64>, pull: Option<f64>) -> String {
    let (Some(mean), Some(sd), Some(pull)) = (mean, sd, pull) else {
        return dash();
    };
    format!("{mean:+.3} ± {sd:.3}, {pull:.2}")
}

fn cell_line(row: &CellGroup) -> String {
    format!(
        "{:<14} {:>8} {:>22} {:>22} {:>22}\n",
        row.group,
        row.cells,
        spread(
            row.brightness_mean_mag,
            row.brightness_sd_mag,
            row.brightness_pull
        ),
        spread(row.clouds_mean_mag, row.clouds_sd_mag, row.clouds_pull),
        spread(row.limit_mean_mag, row.limit_sd_mag, row.limit_pull),
    )
}

fn line(row: &GroupRow) -> String {
    let rms = |rms: Option<f64>, pull: Option<f64>| match (rms, pull) {
        (Some(rms), Some(pull)) => format!("{rms:.3}, {pull:.2}"),
        _ => dash(),
    };
    let limit = match (row.limit_mean_mag, row.limit_sd_mag) {
        (Some(mean), Some(sd)) => format!("{mean:+.3} ± {sd:.3}"),
        _ => dash(),
    };
    format!(
        "{:<14} {:>6} {:>6} {:>6} {:>9} {:>22} {:>22} {:>17} {:>16} {:>14} {:>7}\n",
        row.group,
        row.frames,
        row.right,
        row.wrong,
        row.measured,
        spread(row.zenith_mean_mag, row.zenith_sd_mag, row.zenith_pull),
        spread(row.cell_mean_mag, row.cell_sd_mag, row.cell_pull),
        rms(row.extinction_rms_mag, row.extinction_pull),
        limit,
        rms(row.cloud_share_rms, row.cloud_share_pull),
        row.clouds_area
            .map_or_else(dash, |area| format!("{area:.4}")),
    )
}
