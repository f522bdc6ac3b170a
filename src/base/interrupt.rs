//! Long work that its caller may end early.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;
use web_time::Instant;

/// Tells long work whether to end. It is asked every few milliseconds, from any thread.
///
/// # Example
/// ```
/// use starpipe::Interrupt;
/// use std::sync::Arc;
/// use std::sync::atomic::{AtomicBool, Ordering};
///
/// // A flag that another thread, or a signal, sets.
/// let cancel = Arc::new(AtomicBool::new(false));
/// let seen = Arc::clone(&cancel);
/// let interrupt = Interrupt::when(move || seen.load(Ordering::Relaxed));
/// assert!(interrupt.check().is_ok());
/// cancel.store(true, Ordering::Relaxed);
/// assert!(interrupt.check().is_err());
/// ```
#[derive(Clone, Default)]
pub struct Interrupt(Option<Arc<dyn Fn() -> bool + Send + Sync>>);

/// The work was ended early.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("interrupted")]
pub struct Interrupted;

impl Interrupt {
    /// Ends the work as soon as `is_due` returns true. It must not return false again.
    pub fn when(is_due: impl Fn() -> bool + Send + Sync + 'static) -> Self {
        Self(Some(Arc::new(is_due)))
    }

    /// Ends the work at `deadline`, too.
    #[must_use]
    pub fn or_at(&self, deadline: Instant) -> Self {
        let this = self.clone();
        Self::when(move || this.is_due() || Instant::now() >= deadline)
    }

    /// Ends the work at `deadline`, too, and later by what `paused` has.
    pub(crate) fn or_after(&self, deadline: Instant, paused: &Paused) -> Self {
        let (this, paused) = (self.clone(), paused.clone());
        Self::when(move || this.is_due() || Instant::now() >= deadline + paused.total())
    }

    /// Whether to end now.
    pub fn is_due(&self) -> bool {
        self.0.as_ref().is_some_and(|is_due| is_due())
    }

    /// Ends the work with `?`.
    ///
    /// # Errors
    /// [`Interrupted`] if it is to end now.
    pub fn check(&self) -> Result<(), Interrupted> {
        if self.is_due() {
            Err(Interrupted)
        } else {
            Ok(())
        }
    }
}

/// Time that does not count for a deadline: what is done once for all frames.
#[derive(Debug, Clone, Default)]
pub(crate) struct Paused(Arc<AtomicU64>);

impl Paused {
    /// Does work that does not count.
    pub(crate) fn during<T>(&self, work: impl FnOnce() -> T) -> T {
        let begun = Instant::now();
        let done = work();
        let spent_ms = u64::try_from(begun.elapsed().as_millis()).unwrap_or(u64::MAX);
        self.0.fetch_add(spent_ms, Ordering::Relaxed);
        done
    }

    fn total(&self) -> Duration {
        Duration::from_millis(self.0.load(Ordering::Relaxed))
    }
}

impl fmt::Debug for Interrupt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.0.is_some() {
            "Interrupt"
        } else {
            "Interrupt (never)"
        })
    }
}
