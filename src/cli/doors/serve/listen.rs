//! Connections: accepted until a signal comes, limited in number and in time.

use super::routes;
use super::server::Server;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::server::graceful::GracefulShutdown;
use hyper_util::service::TowerToHyperService;
use std::io;
use std::net::TcpListener;
use std::sync::Arc;
use std::time::Duration;
use tokio::net::{TcpListener as TokioListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// Connections at once; others wait to be accepted.
const MAX_CONNECTIONS: usize = 512;
/// A connection is closed after this time, however slowly its client reads.
const LIFE: Duration = Duration::from_secs(1800);
/// Bytes of the head of a request.
const MAX_HEAD_BYTES: usize = 64 * 1024;
/// After an error of the system, such as too many open files.
const PAUSE: Duration = Duration::from_millis(100);

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
            let connection = http.serve_connection(TokioIo::new(stream), service);
            let connection = graceful.watch(connection);
            tokio::spawn(async move {
                // What goes wrong on a connection concerns its client alone.
                let _ = tokio::time::timeout(LIFE, connection).await;
                drop(place);
            });
        }
        drop(listener);
        tracing::info!("ending: running frames are finished");
        server.queue.close();
        let most_s = server.options.time_limit_s.unwrap_or(f64::MAX);
        let most = Duration::try_from_secs_f64(most_s)
            .unwrap_or(LIFE)
            .min(LIFE)
            + server.limits.send_time;
        tokio::select! {
            () = graceful.shutdown() => {}
            () = tokio::time::sleep(most) => {}
            () = signals.next() => server.abort(),
        }
        // Workers may still run jobs that nobody waits for.
        while server.metrics.running() > 0 {
            tokio::select! {
                () = tokio::time::sleep(PAUSE) => {}
                () = signals.next() => server.abort(),
            }
        }
        Ok(())
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
