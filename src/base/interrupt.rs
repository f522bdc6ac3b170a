//! Long work that its caller may end early.

use std::fmt;
use std::sync::Arc;
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

impl fmt::Debug for Interrupt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.0.is_some() {
            "Interrupt"
        } else {
            "Interrupt (never)"
        })
    }
}
