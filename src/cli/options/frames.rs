//! Frames to read.

use clap::Args;
use starpipe::frame::MemoryLimit;
use std::fs;
use std::num::NonZeroUsize;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct FrameOptions {
    /// Frames to read; a directory means all frames in it, - standard input
    #[arg(value_name = "FRAME", required = true)]
    pub(crate) frames: Vec<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct PageOption {
    /// Number of the image in a file with several, from 1: a page of a TIFF, an image or plane of a FITS
    /// file [default: the largest]
    #[arg(long, value_name = "NUMBER")]
    pub(crate) page: Option<NonZeroUsize>,
}

/// How much memory a frame may take.
#[derive(Debug, Args)]
#[command(next_help_heading = "Limits")]
pub(crate) struct MemoryOption {
    /// Memory limit for reading and solving a frame, in MB; files that need more are refused
    /// [default: 1500, or half of the machine's memory]
    #[arg(long, value_name = "MB", value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    max_memory: Option<u64>,
}

impl MemoryOption {
    /// The limit.
    pub(crate) fn limit(&self) -> MemoryLimit {
        const BYTES_PER_MB: u64 = 1_000_000;
        if let Some(stated) = self.max_memory {
            return MemoryLimit::of_bytes(stated * BYTES_PER_MB);
        }
        let default = MemoryLimit::DEFAULT.bytes();
        let half = machine_memory_bytes().map_or(default, |bytes| bytes / 2);
        MemoryLimit::of_bytes(default.min(half))
    }
}

/// The machine's memory, where the system tells it (Linux).
fn machine_memory_bytes() -> Option<u64> {
    let text = fs::read_to_string("/proc/meminfo").ok()?;
    let total = text
        .lines()
        .find_map(|line| line.strip_prefix("MemTotal:"))?;
    let kib: u64 = total.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kib.checked_mul(1024)
}
