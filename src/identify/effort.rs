//! How much a search does.

use serde::{Deserialize, Serialize};

/// How much is tried where the first triangles of bright stars do not identify a field. Frames that
/// are identified at once take no longer with more.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Effort {
    /// A quarter of the usual work, and few choices of stars.
    Fast,
    /// The usual work.
    #[default]
    Normal,
    /// Eight times the usual work, and more choices of stars.
    Thorough,
}

impl Effort {
    /// The work for which `usual` is usual.
    pub(super) const fn work(self, usual: u64) -> u64 {
        match self {
            Self::Fast => usual / 4,
            Self::Normal => usual,
            Self::Thorough => usual * 8,
        }
    }

    /// Number of tiers of brightness that are searched.
    pub(super) const fn tiers(self) -> usize {
        match self {
            Self::Fast => 2,
            Self::Normal => 7,
            Self::Thorough => 12,
        }
    }
}
