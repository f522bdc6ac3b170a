//! Panics of the decoder of Parquet, as errors.

use parquet::errors::{ParquetError, Result};
use std::cell::Cell;
use std::panic::{self, AssertUnwindSafe};
use std::sync::Once;

thread_local! {
    /// Whether a panic on this thread becomes an error, and tells nothing itself.
    static IS_GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// Calls `read`. The decoder panics on some damaged files (`parquet` 60.1): this makes errors of it.
/// What `read` uses must not be used again after an error.
pub fn guarded<T>(read: impl FnOnce() -> Result<T>) -> Result<T> {
    static QUIET: Once = Once::new();
    QUIET.call_once(|| {
        let tell = panic::take_hook();
        panic::set_hook(Box::new(move |what| {
            if !IS_GUARDED.get() {
                tell(what);
            }
        }));
    });
    let outer = IS_GUARDED.replace(true);
    let read = panic::catch_unwind(AssertUnwindSafe(read));
    IS_GUARDED.set(outer);
    read.unwrap_or_else(|_| Err(ParquetError::General("the file is damaged".to_owned())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_an_error_and_all_else_is_as_it_was() {
        assert_eq!(guarded(|| Ok(7)).unwrap(), 7);
        let refused = guarded(|| -> Result<()> { panic!("damaged") }).unwrap_err();
        assert!(refused.to_string().contains("damaged"), "{refused}");
        assert!(!IS_GUARDED.get());
    }
}
