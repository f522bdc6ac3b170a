//! Step 4: connected regions above the threshold, and their peaks.

mod components;
pub(crate) mod raw_peaks;

pub(crate) use components::{Candidates, Peak, Region, Search, SearchConfig};
pub(crate) use raw_peaks::{RawPeak, RawPeaks};
