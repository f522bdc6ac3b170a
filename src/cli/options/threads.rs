//! Threads to work with.

use anyhow::Context;
use clap::Args;
use std::{env, thread};

/// Threads that may be started on any machine.
const MAX_USEFUL: usize = 8;

#[derive(Debug, Args)]
#[command(next_help_heading = "Resources")]
pub(crate) struct ThreadOptions {
    /// Number of threads, at most 8 or the number of processors, whichever is larger [default: one
    /// for each processor]
    #[arg(long, value_name = "NUMBER", value_parser = clap::value_parser!(u32).range(1..=1024))]
    threads: Option<u32>,
}

impl ThreadOptions {
    /// Starts the threads.
    pub(crate) fn pool(&self) -> anyhow::Result<rayon::ThreadPool> {
        let processors = thread::available_parallelism().map_or(1, usize::from);
        let stated = self.threads.map(|threads| threads as usize);
        let wanted = stated.or_else(of_environment).unwrap_or(processors);
        // More only get in each other's way.
        rayon::ThreadPoolBuilder::new()
            .num_threads(wanted.min(processors.max(MAX_USEFUL)))
            .build()
            .context("starting threads")
    }
}

/// The variable by which other programs on rayon are told.
fn of_environment() -> Option<usize> {
    let number = env::var("RAYON_NUM_THREADS").ok()?.parse().ok()?;
    (number > 0).then_some(number)
}
