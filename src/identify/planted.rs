//! A bug that tests ask for, to show what a bug does to the rest of a run. Releases have it not.

use super::field::StarField;
use std::env;

/// Names the size of the frames that meet the bug, as `640x480`.
const VARIABLE: &str = "STARPIPE_PLANTED_PANIC";

/// # Panics
/// If [`VARIABLE`] is the size of `field`.
pub fn panic_if_asked(field: &StarField) {
    let size = format!("{}x{}", field.width_px, field.height_px);
    let is_asked = env::var(VARIABLE).is_ok_and(|asked| asked == size);
    assert!(!is_asked, "planted by {VARIABLE}");
}
