//! Step 4: connected regions above the threshold, and their peaks.

mod candidate_pixels;
mod disjoint_sets;
mod labelling;
mod peak;
mod prominence;
pub(crate) mod raw_peaks;
mod region;
mod search;
mod search_config;
mod selection;
mod streaks;

pub(crate) use candidate_pixels::Candidates;
pub(crate) use peak::Peak;
pub(crate) use raw_peaks::{RawPeak, RawPeaks};
pub(crate) use region::Region;
pub(crate) use search::PeakSearch;
pub(crate) use search_config::SearchConfig;
