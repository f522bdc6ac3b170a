//! The level of a pixel without light, by the frames of a night.

use super::read::of_each;
use super::run::NightRun;
use starpipe::frame::Frame;
use starpipe::night::{FrameLevel, NightStart, dark_level, is_by_day};
use starpipe::sky::DarkLevel;

/// The level by frames of different exposure, where nothing else tells it.
pub(super) fn learn(run: &NightRun, names: &[String], start: &NightStart) -> Option<DarkLevel> {
    if !start.lacks_dark_level {
        return None;
    }
    // By day, light is not as exposures are.
    let level = |_: &_, frame: Frame<'static>| {
        let is_dark = !is_by_day(frame.metadata.date.as_ref(), start.site);
        is_dark.then(|| FrameLevel::measure(&frame))?
    };
    let levels = of_each(names, run.pool, run.plan.memory, level);
    let levels: Vec<FrameLevel> = levels.into_iter().flatten().collect();
    dark_level(&levels)
}
