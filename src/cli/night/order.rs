//! The frames of a night in the order of their dates.

use super::read::of_each;
use starpipe::base::epoch::ObservationDate;
use starpipe::frame::MemoryLimit;
use std::path::Path;

/// Sorts `names` by their dates: those in the names, if all have one with its time, else those of the
/// headers. Frames without a date are last, in the order that they were given in.
pub(super) fn by_date(
    names: Vec<String>,
    pool: &rayon::ThreadPool,
    memory: MemoryLimit,
) -> Vec<String> {
    let in_name = |name: &String| seconds(ObservationDate::in_file_name(Path::new(name)).as_ref());
    let in_names: Vec<Option<f64>> = names.iter().map(in_name).collect();
    let dates = if in_names.iter().all(Option::is_some) {
        in_names
    } else {
        in_headers(&names, pool, memory)
    };
    let mut dated: Vec<(f64, String)> = dates
        .into_iter()
        .map(|date| date.unwrap_or(f64::INFINITY))
        .zip(names)
        .collect();
    dated.sort_by(|a, b| a.0.total_cmp(&b.0));
    dated.into_iter().map(|(_, name)| name).collect()
}

fn seconds(date: Option<&ObservationDate>) -> Option<f64> {
    Some(date?.seconds_since_j2000()?.0)
}

/// The dates in the files, or in the names where these have none.
fn in_headers(names: &[String], pool: &rayon::ThreadPool, memory: MemoryLimit) -> Vec<Option<f64>> {
    of_each(names, pool, memory, |path, frame| {
        let header = &frame.metadata;
        let date = header.local_date.or(header.date);
        seconds(
            date.or_else(|| ObservationDate::in_file_name(path))
                .as_ref(),
        )
    })
}
