//! `serve`: an HTTP server with the protocol of nova.astrometry.net, and one of its own.
//!
//! Requests are answered on one thread (`listen`, `routes`): what they bring is limited while it is read (`body`).
//! Frames wait in the `queue`, or in the folder of jobs (`store`), and are solved by threads of their own
//! (`worker`).

mod args;
mod body;
mod fetch;
mod http;
mod keys;
mod listen;
mod metrics;
mod nova;
mod pages;
mod queue;
mod refusal;
mod routes;
mod solve;
mod store;
mod worker;

pub(crate) use args::ServeArgs;

use crate::cli::exit::{CommandError, CommandOutput};
use anyhow::Context as _;
use keys::Keys;
use listen::Listening;
use metrics::Metrics;
use pages::Page;
use queue::Queue;
use starpipe::Interrupt;
use starpipe::solve::SolveOptions;
use std::io;
use std::net::TcpListener;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;
use store::Store;
use tokio::sync::Semaphore;
use tracing_subscriber::filter::LevelFilter;
use worker::{Solver, Work};

/// Bodies of this many largest uploads may be in memory.
const BODIES: usize = 4;

/// What all requests and all workers share.
struct Server {
    /// What every frame is solved with.
    options: SolveOptions,
    max_upload: usize,
    /// How long the head of a request may take, and its body beside its length.
    send_time: Duration,
    allows_url: bool,
    keys: Keys,
    page: Page,
    store: Store,
    queue: Queue<Work>,
    metrics: Metrics,
    /// Memory for bodies, in kB.
    memory_kb: Arc<Semaphore>,
    /// Whether running jobs are to end early.
    is_aborted: Arc<AtomicBool>,
}

impl Server {
    fn new(arguments: &ServeArgs, jobs: usize) -> Result<Self, CommandError> {
        let max_upload = arguments.max_upload.saturating_mul(1_000_000);
        let (store, waiting) = Store::open(&arguments.folder()?, arguments.folder_limit)?;
        let server = Self {
            options: arguments.options()?,
            max_upload,
            send_time: Duration::from_secs(arguments.send_time),
            allows_url: arguments.allow_url,
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
            memory_kb: Arc::new(Semaphore::new(BODIES * max_upload / 1000)),
            is_aborted: Arc::default(),
        };
        for number in waiting {
            tracing::info!(job = number, "waiting since before the start");
            server.queue.push_again(Work::Job(number));
        }
        Ok(server)
    }

    /// Ends running jobs as soon as they notice.
    fn abort(&self) {
        self.is_aborted.store(true, Ordering::Relaxed);
    }

    fn interrupt(&self) -> Interrupt {
        let is_aborted = Arc::clone(&self.is_aborted);
        Interrupt::when(move || is_aborted.load(Ordering::Relaxed))
    }
}

/// `starpipe serve`
pub(crate) fn serve(arguments: &ServeArgs) -> Result<CommandOutput, CommandError> {
    tracing_subscriber::fmt()
        .with_writer(io::stderr)
        .with_ansi(false)
        .with_target(false)
        .with_max_level(LevelFilter::INFO)
        .init();
    let bound = || {
        let listener = TcpListener::bind(arguments.listen)?;
        listener.set_nonblocking(true)?;
        io::Result::Ok(listener)
    };
    let listener = bound().with_context(|| format!("listening on {}", arguments.listen))?;
    arguments.catalog.with_deep(true, |pool, indexed, deep| {
        let jobs = arguments.jobs.unwrap_or(pool.current_num_threads());
        let server = Arc::new(Server::new(arguments, jobs)?);
        let solver = Solver {
            server: &server,
            indexed,
            deep,
            memory: arguments.memory.limit(),
        };
        thread::scope(|scope| {
            for _ in 0..jobs {
                scope.spawn(|| solver.run());
            }
            // However this ends, the workers end, too.
            let _closing = server.queue.closing();
            Listening::new(listener, Arc::clone(&server)).run()
        })
        .context("serving")?;
        tracing::info!("ended");
        Ok(CommandOutput::success(String::new()))
    })
}
