//! Connections: accepted until a signal comes, limited in number and in time.

use super::body::MAX_WAIT;
use super::routes;
use super::server::Server;
use super::stream::Stream;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::server::graceful::GracefulShutdown;
use hyper_util::service::TowerToHyperService;
use std::io;
use std::net::TcpListener;
use std::pin::pin;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::net::{TcpListener as TokioListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// Connections at once; others wait to be accepted.
const MAX_CONNECTIONS: usize = 512;
/// Bytes of the head of a request.
const MAX_HEAD_BYTES: usize = 64 * 1024;
/// After an error of the system, such as too many open files.
const PAUSE: Duration = Duration::from_millis(100);
/// At the end, for the answers of what was aborted.
const LAST: Duration = Duration::from_secs(1);
/// Reads and writes of files at once.
const MAX_FILES: usize = 64;

/// A server that listens.
pub(super) struct Listening {
    listener: TcpListener,
    server: Arc<Server>,
}

impl Listening {
    pub(super) fn new(listener: TcpListener, server: Arc<Server>) -> Self {
        Self { listener, server }
    }

    /// Answers requests until a signal comes, and those that run then.
    pub(super) fn run(self) -> io::Result<()> {
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .max_blocking_threads(MAX_FILES)
            .build()?;
        let done = runtime.block_on(self.answer());
        // Fetches and reads that hang end with the process.
        runtime.shutdown_background();
        done
    }

    async fn answer(self) -> io::Result<()> {
        let Self { listener, server } = self;
        let listener = TokioListener::from_std(listener)?;
        let mut signals = Signals::new()?;
        let router = routes::router(Arc::clone(&server));
        let graceful = GracefulShutdown::new();
        let places = Arc::new(Semaphore::new(MAX_CONNECTIONS));
        let life = server.limits.life();
        let mut http = http1::Builder::new();
        http.timer(TokioTimer::new())
            .header_read_timeout(server.limits.send_time)
            .max_buf_size(MAX_HEAD_BYTES);
        tracing::info!("listening on http://{}", listener.local_addr()?);
        loop {
            let (stream, place) = tokio::select! {
                accepted = accept(&listener, &places) => accepted,
                () = signals.next() => break,
            };
            let service = TowerToHyperService::new(router.clone());
            let stream = TokioIo::new(Stream::new(stream, server.limits.send_time));
            let connection = http.serve_connection(stream, service);
            let connection = graceful.watch(connection);
            tokio::spawn(async move {
                // What goes wrong on a connection concerns its client alone.
                let _ = tokio::time::timeout(life, connection).await;
                drop(place);
            });
        }
        drop(listener);
        tracing::info!("ending: running frames are finished");
        server.queue.close();
        end(&server, graceful, signals).await;
        Ok(())
    }
}

/// Waits until all requests are answered, and no worker runs: it may run a job that nobody waits for.
async fn end(server: &Server, graceful: GracefulShutdown, mut signals: Signals) {
    let most_s = server.options.time_limit_s.unwrap_or(f64::MAX);
    let most = Duration::try_from_secs_f64(most_s).unwrap_or(MAX_WAIT);
    let mut end = Instant::now() + most.min(MAX_WAIT) + server.limits.send_time;
    let mut answered = pin!(graceful.shutdown());
    let mut is_answered = false;
    loop {
        if server.queue.running() > 0 {
            end = end.max(Instant::now() + LAST);
        } else if is_answered || Instant::now() >= end {
            return;
        }
        tokio::select! {
            () = &mut answered, if !is_answered => is_answered = true,
            () = tokio::time::sleep(PAUSE) => {}
            () = signals.next() => {
                server.abort();
                end = Instant::now() + LAST;
            }
        }
    }
}

/// Waits for a connection for which there is a place.
async fn accept(
    listener: &TokioListener,
    places: &Arc<Semaphore>,
) -> (TcpStream, Option<OwnedSemaphorePermit>) {
    let place = Arc::clone(places).acquire_owned().await.ok();
    loop {
        match listener.accept().await {
            Ok((stream, _)) => return (stream, place),
            Err(error) => {
                tracing::warn!("accepting a connection: {error}");
                tokio::time::sleep(PAUSE).await;
            }
        }
    }
}

/// The signals that end the server.
struct Signals {
    #[cfg(unix)]
    terminate: tokio::signal::unix::Signal,
    #[cfg(unix)]
    interrupt: tokio::signal::unix::Signal,
}

#[cfg(unix)]
impl Signals {
    fn new() -> io::Result<Self> {
        use tokio::signal::unix::{SignalKind, signal};
        Ok(Self {
            terminate: signal(SignalKind::terminate())?,
            interrupt: signal(SignalKind::interrupt())?,
        })
    }

    async fn next(&mut self) {
        tokio::select! {
            _ = self.terminate.recv() => {}
            _ = self.interrupt.recv() => {}
        }
    }
}

#[cfg(not(unix))]
impl Signals {
    fn new() -> io::Result<Self> {
        Ok(Self {})
    }

    async fn next(&mut self) {
        let _ = tokio::signal::ctrl_c().await;
    }
}
