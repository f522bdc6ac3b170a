//! What all requests and all workers share.

use super::args::ServeArgs;
use super::body::Limits;
use super::hosts::Hosts;
use super::keys::Keys;
use super::metrics::Metrics;
use super::page::Page;
use super::queue::Queue;
use super::refusal::Refusal;
use super::store::Store;
use super::work::Work;
use crate::cli::exit::CommandError;
use starpipe::Interrupt;
use starpipe::solve::SolveOptions;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// What all requests and all workers share.
pub(super) struct Server {
    /// What every frame is solved with.
    pub(super) options: SolveOptions,
    pub(super) limits: Limits,
    pub(super) allows_url: bool,
    pub(super) hosts: Hosts,
    pub(super) keys: Keys,
    pub(super) page: Page,
    pub(super) store: Store,
    pub(super) queue: Queue<Work>,
    pub(super) metrics: Metrics,
    /// Whether running jobs are to end early.
    is_aborted: Arc<AtomicBool>,
}

impl Server {
    pub(super) fn new(arguments: &ServeArgs, jobs: usize) -> Result<Self, CommandError> {
        let (store, waiting) = Store::open(&arguments.folder()?, arguments.folder_limit)?;
        let server = Self {
            options: arguments.options()?,
            limits: Limits::new(
                arguments.max_upload,
                Duration::from_secs(arguments.send_time),
            ),
            allows_url: arguments.allow_url,
            hosts: Hosts::new(arguments.listen, arguments.host.clone()),
            keys: arguments
                .keys
                .as_deref()
                .map_or(Ok(Keys::Any), Keys::read)?,
            page: arguments
                .page
                .as_deref()
                .map_or(Ok(Page::default()), Page::read)?,
            store,
            queue: Queue::new(arguments.queue),
            metrics: Metrics::new(jobs),
            is_aborted: Arc::default(),
        };
        for number in waiting {
            tracing::info!(job = number, "waiting since before the start");
            server.queue.push_again(Work::Job(number));
        }
        Ok(server)
    }

    /// Why a file of a job cannot be read: it may have been removed since the client asked.
    pub(super) fn unreadable(&self, number: u64, error: &anyhow::Error) -> Refusal {
        match self.store.state(number) {
            None => Refusal::unknown("such job"),
            Some(_) => Refusal::internal(error),
        }
    }

    /// Ends running jobs as soon as they notice.
    pub(super) fn abort(&self) {
        self.is_aborted.store(true, Ordering::Relaxed);
    }

    pub(super) fn interrupt(&self) -> Interrupt {
        let is_aborted = Arc::clone(&self.is_aborted);
        Interrupt::when(move || is_aborted.load(Ordering::Relaxed))
    }
}
