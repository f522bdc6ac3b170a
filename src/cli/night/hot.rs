//! Hot pixels of a night.

use super::read::of_each;
use super::run::NightRun;
use crate::cli::output::rows::csv_table;
use starpipe::night::{
    NightHotPixel, NightStart, OutlierPixels, hot_pixels, is_by_day, probe_order,
};

/// Frames that are looked at.
const FRAMES: usize = 12;

/// The hot pixels that frames all over the night show; `None` where too few can be read.
pub(super) fn learn(
    run: &NightRun,
    names: &[String],
    start: &NightStart,
) -> Option<Vec<NightHotPixel>> {
    let order = probe_order(names.len());
    let chosen: Vec<&String> = order.iter().take(FRAMES).map(|at| &names[*at]).collect();
    let outliers = of_each(&chosen, run.pool, run.plan.memory, |_, frame| {
        let date = frame.metadata.date;
        if is_by_day(date.as_ref(), start.site) {
            return None;
        }
        let mjd = date.and_then(|date| date.modified_julian_date());
        Some(OutlierPixels::of(&frame.into_stored(), mjd))
    });
    let found: Vec<OutlierPixels> = outliers.into_iter().flatten().collect();
    hot_pixels(&found, start.fixed_camera.as_ref(), start.site)
}

/// The list, as `--hot-pixels` reads it.
pub(super) fn table(pixels: &[NightHotPixel]) -> anyhow::Result<String> {
    if pixels.is_empty() {
        return Ok("x,y,share,excess_adu\n".to_owned());
    }
    csv_table(pixels.iter())
}
