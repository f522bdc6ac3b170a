//! Step 2: the matched filter.

mod matched_filter;

pub(crate) use matched_filter::{Band, Kernel, MAX_TAPS, normalise};
