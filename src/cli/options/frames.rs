//! Frames to read.

use clap::Args;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::str::FromStr;

#[derive(Debug, Args)]
pub(crate) struct FrameOptions {
    /// Frames to read; a directory stands for the frames in it, - for standard input
    #[arg(value_name = "FRAME", required = true)]
    pub(crate) frames: Vec<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct PageOption {
    /// Which image of a file with several, from 1: a page of a TIFF, an image or plane of a FITS
    /// file [default: the first]
    #[arg(long, value_name = "NUMBER")]
    pub(crate) page: Option<NonZeroUsize>,
}

/// Which image of a file, or all of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PageChoice {
    Number(NonZeroUsize),
    All,
}

impl FromStr for PageChoice {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        if text == "all" {
            return Ok(Self::All);
        }
        let number = text.parse().map(Self::Number);
        number.map_err(|_| "expected a number from 1, or all")
    }
}

impl From<PageChoice> for String {
    fn from(choice: PageChoice) -> Self {
        match choice {
            PageChoice::Number(number) => number.to_string(),
            PageChoice::All => "all".to_owned(),
        }
    }
}
