//! The table as text.

use super::args::RobustnessArgs;
use super::rows::SweptRow;
use starpipe::lab::robustness::CaseResult;

/// The table with what its rows have in common.
pub(super) fn text(arguments: &RobustnessArgs, rows: &[SweptRow]) -> String {
    const HEADING: &str = "                              counted    right   none  wrong     right              95 %   wrong    median      99 %\n";
    let mut text = introduction(arguments) + HEADING;
    for SweptRow { row, .. } in rows {
        text += &line(row);
    }
    text
}

fn introduction(arguments: &RobustnessArgs) -> String {
    let protocol = &arguments.protocol;
    let scale = if protocol.scale_unknown {
        "unknown".to_owned()
    } else {
        format!("known to {} %", protocol.scale_error)
    };
    format!(
        "{} trials a row, seed {}; {} × {} px, {} stars on average; unless the row says otherwise centroid errors of {} px, \
         magnitude errors of {}, {} % of the stars missing, {} % false, field of view {scale}.\n\
         Rates are of the trials with {} true stars or more, with 95 % intervals; wrong answers and times are of all trials.\n\n",
        arguments.count,
        arguments.seed,
        protocol.width,
        protocol.height,
        protocol.stars,
        protocol.centroid_error,
        protocol.mag_error,
        protocol.missing,
        protocol.false_stars,
        arguments.least_true_stars,
    )
}

fn line(row: &CaseResult) -> String {
    let (rate, interval) = match row.counted {
        0 => ("–".to_owned(), "–".to_owned()),
        _ => (
            format!("{:.2} %", row.right_percent),
            format!(
                "{:.2} to {:.2} %",
                row.right_low_percent, row.right_high_percent
            ),
        ),
    };
    let wrong = format!("<{:.2} %", row.wrong_high_percent + 0.005);
    format!(
        "{:<28} {:>8} {:>8} {:>6} {:>6} {rate:>9} {interval:>17} {wrong:>7} {:>6.2} ms {:>6.1} ms\n",
        row.case,
        row.counted,
        row.right,
        row.no_answer,
        row.wrong_of_all,
        row.median_ms,
        row.p99_ms,
    )
}
