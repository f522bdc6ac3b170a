//! Step 4: connected regions above the threshold, and their peaks.

mod candidate_pixels;
mod disjoint_sets;
mod filtered_frame;
mod labelling;
mod memory;
mod peak;
mod prominence;
mod raw_peaks;
mod region;
mod search;
mod search_config;
mod selection;
mod streaks;

pub(crate) use filtered_frame::{CandidateLimits, FilteredFrame};
pub(crate) use memory::CandidateMemory;
pub(crate) use peak::Peak;
pub(crate) use raw_peaks::{RawPeak, RawPeakFinder};
pub(crate) use region::Region;
pub(crate) use search::{FoundPeaks, PeakSearch};
pub(crate) use search_config::SearchConfig;
