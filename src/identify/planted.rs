//! A panic that tests ask for, to show what a bug does to the rest of a run. Release builds do not have it.

use crate::identify::field::StarField;
use std::env;

/// Names the size of the frames that meet the bug, as `640x480`.
const VARIABLE: &str = "STARPIPE_PLANTED_PANIC";

/// # Panics
/// If [`VARIABLE`] is the size of `field`.
pub fn panic_if_asked(field: &StarField) {
    if let Ok(asked) = env::var(VARIABLE) {
        let size = format!("{}x{}", field.width_px, field.height_px);
        assert!(asked != size, "planted by {VARIABLE}");
    }
}
