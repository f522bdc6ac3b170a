//! Progress bars on standard error; nothing is shown if that is not a terminal.

use indicatif::{ProgressBar, ProgressStyle};

/// A bar over frames with the remaining time.
pub(crate) fn frames_bar(frames: u64) -> ProgressBar {
    bar(frames, "frames {wide_bar} {pos}/{len} {eta}")
}

/// A bar over frames with the speed and the remaining time, for long runs.
pub(crate) fn frames_bar_with_speed(frames: u64) -> ProgressBar {
    bar(frames, "frames {wide_bar} {pos}/{len} {per_sec} {eta}")
}

/// A bar with a template of indicatif.
pub(crate) fn bar(length: u64, template: &str) -> ProgressBar {
    let style =
        ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(length).with_style(style)
}
