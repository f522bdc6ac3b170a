//! Threads to work with.

use anyhow::Context;
use clap::Args;

#[derive(Debug, Args)]
#[command(next_help_heading = "Resources")]
pub(crate) struct ThreadOptions {
    /// Threads to work with [default: one for each processor]
    #[arg(long, value_name = "NUMBER", value_parser = clap::value_parser!(u32).range(1..=1024))]
    threads: Option<u32>,
}

impl ThreadOptions {
    /// Starts the threads.
    pub(crate) fn pool(&self) -> anyhow::Result<rayon::ThreadPool> {
        rayon::ThreadPoolBuilder::new()
            // 0 means one for each processor.
            .num_threads(self.threads.unwrap_or(0) as usize)
            .build()
            .context("starting threads")
    }
}
