//! Long work that Ctrl-C ends: Python's handlers of signals run while it lasts, and what they raise
//! ends it.

use crate::errors::{detached, exception};
use pyo3::prelude::*;
use rayon::ThreadPoolBuilder;
use starpipe::{Interrupt, Interrupted};
use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::sync::{Arc, Mutex, OnceLock};
use std::time::{Duration, Instant};

/// Between two looks for signals.
const PERIOD: Duration = Duration::from_millis(30);

/// Threads that may be started on any machine, as in the program.
const MAX_USEFUL: NonZeroUsize = NonZeroUsize::new(8).unwrap();

/// The number of threads that are started where so many are wanted: more than 8 and than there are
/// processors only get in each other's way.
pub fn useful(wanted: NonZeroUsize) -> NonZeroUsize {
    let processors = std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
    wanted.min(processors.max(MAX_USEFUL))
}

/// Works on the calling thread, which looks for signals when the work asks whether to end.
pub fn on_this_thread<R: Send>(
    py: Python<'_>,
    work: impl FnOnce(&Interrupt) -> PyResult<R> + Send,
) -> PyResult<R> {
    let raised = Arc::new(OnceLock::new());
    let last = Mutex::new(Instant::now());
    let interrupt = Interrupt::when({
        let raised = Arc::clone(&raised);
        move || {
            let Ok(mut last) = last.try_lock() else {
                return false;
            };
            if raised.get().is_none() && last.elapsed() >= PERIOD {
                *last = Instant::now();
                if let Some(Err(error)) = Python::try_attach(|py| py.check_signals()) {
                    let _first = raised.set(error);
                }
            }
            raised.get().is_some()
        }
    });
    let done = detached(py, || work(&interrupt));
    match raised.get() {
        Some(error) => Err(error.clone_ref(py)),
        None => done,
    }
}

/// Works in a pool of threads, while the calling thread looks for signals. No thread outlives the
/// call: a fork after it cannot hang.
pub fn on_threads<R: Send>(
    py: Python<'_>,
    threads: NonZeroUsize,
    work: impl FnOnce(&Interrupt) -> PyResult<R> + Send,
) -> PyResult<R> {
    let is_due = Arc::new(AtomicBool::new(false));
    let interrupt = Interrupt::when({
        let is_due = Arc::clone(&is_due);
        move || is_due.load(Ordering::Relaxed)
    });
    detached(py, || {
        let pool = ThreadPoolBuilder::new().num_threads(useful(threads).get());
        let pool = pool.build().map_err(exception)?;
        pool.in_place_scope(|scope| {
            let (sender, receiver) = sync_channel(1);
            scope.spawn(move |_| {
                let _waited_for = sender.send(work(&interrupt));
            });
            loop {
                match receiver.recv_timeout(PERIOD) {
                    Ok(done) => return done,
                    // The work panicked: the scope passes it on.
                    Err(RecvTimeoutError::Disconnected) => return Err(exception(Interrupted)),
                    Err(RecvTimeoutError::Timeout) => {}
                }
                if let Some(Err(error)) = Python::try_attach(|py| py.check_signals()) {
                    is_due.store(true, Ordering::Relaxed);
                    return Err(error);
                }
            }
        })
    })
}
