//! The memory that the pixels above the threshold may take.

use crate::detect::DetectError;
use crate::frame::{Frame, MemoryLimit};

/// The memory for what stands out in a frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CandidateMemory {
    bytes: u64,
}

impl CandidateMemory {
    /// A candidate and its part of a span, in vectors that grow by doubling.
    const PER_CANDIDATE_BYTES: u64 = 20;
    /// A pixel above the threshold: that and its top, and its part of runs, peaks and saddles.
    const PER_BRIGHT_PIXEL_BYTES: u64 = 30;

    /// What `memory` leaves beside the frame; decoding took enough for every 32nd pixel
    /// to stand out.
    pub fn beside(frame: &Frame, memory: MemoryLimit) -> Self {
        let left = memory.bytes().saturating_sub(frame.pixels.bytes());
        let both = Self::PER_CANDIDATE_BYTES + Self::PER_BRIGHT_PIXEL_BYTES;
        Self {
            bytes: left.max(frame.pixels.len() as u64 / 32 * both),
        }
    }

    /// How many candidates it holds.
    pub fn most_candidates(self) -> usize {
        whole(self.bytes / Self::PER_CANDIDATE_BYTES)
    }

    /// How many pixels above the threshold it holds beside so many candidates.
    pub fn most_bright_pixels(self, candidates: usize) -> usize {
        let left = self
            .bytes
            .saturating_sub(candidates as u64 * Self::PER_CANDIDATE_BYTES);
        whole(left / Self::PER_BRIGHT_PIXEL_BYTES)
    }
}

/// Refuses more than `most` pixels.
pub(super) fn check_count(found: usize, most: usize) -> Result<(), DetectError> {
    if found > most {
        return Err(DetectError::TooCrowded { most });
    }
    Ok(())
}

fn whole(count: u64) -> usize {
    usize::try_from(count).unwrap_or(usize::MAX)
}
