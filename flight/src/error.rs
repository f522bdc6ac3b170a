//! What may be wrong, and how a search ended.

use core::fmt;

/// Why a call was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Error {
    /// A value of the configuration is out of range.
    Config,
    /// The lens shows two directions in one place within the frame.
    Lens,
    /// The catalogue is not one, is cut short, or is of another version.
    Catalog,
    /// The catalogue's content is not that of its hash.
    CatalogHash,
    /// The block of memory is too small.
    Memory,
    /// The image has another size than the camera, or fewer pixels than its size says.
    Image,
    /// Time does not go on.
    Time,
}

impl Error {
    /// The error in words.
    pub fn text(self) -> &'static str {
        match self {
            Self::Config => "a value of the configuration is out of range",
            Self::Lens => "the lens shows two directions in one place within the frame",
            Self::Catalog => "this is no catalog of this version, or it is cut short",
            Self::CatalogHash => "the catalog is damaged: its hash is another",
            Self::Memory => "the block of memory is too small",
            Self::Image => "the image is not of the camera's size",
            Self::Time => "the time is not later than that of the image before",
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.text())
    }
}

impl core::error::Error for Error {}

/// How a search ended. It is a number, so that it may come from a program in another language.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(transparent)]
pub struct Status(pub i32);

impl Status {
    /// The attitude is known.
    pub const FOUND: Self = Self(0);
    /// There are fewer stars than are needed.
    pub const TOO_FEW_STARS: Self = Self(1);
    /// No attitude is sure enough.
    pub const NOT_IDENTIFIED: Self = Self(2);
    /// The budget ended before the search.
    pub const BUDGET_SPENT: Self = Self(3);
    /// Nothing is known of the attitude of the images before.
    pub const NO_ATTITUDE_BEFORE: Self = Self(4);

    /// The status in words.
    pub fn text(self) -> &'static str {
        match self {
            Self::FOUND => "the attitude is known",
            Self::TOO_FEW_STARS => "there are too few stars",
            Self::NOT_IDENTIFIED => "no attitude is sure enough",
            Self::BUDGET_SPENT => "the budget ended before the search",
            Self::NO_ATTITUDE_BEFORE => "no attitude is known of the images before",
            _ => "this is no status",
        }
    }
}
