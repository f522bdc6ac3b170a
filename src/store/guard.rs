//! Panics of the decoder of Parquet, as errors.

use crate::base::panics::caught;
use parquet::errors::{ParquetError, Result};

/// Calls `read`. The decoder panics on some damaged files (`parquet` 60.1): this makes errors of it.
/// What `read` uses must not be used again after an error.
pub fn guarded<T>(read: impl FnOnce() -> Result<T>) -> Result<T> {
    let damaged = |_| Err(ParquetError::General("the file is damaged".to_owned()));
    caught(read).unwrap_or_else(damaged)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_tells_of_a_damaged_file() {
        assert_eq!(guarded(|| Ok(7)).unwrap(), 7);
        let refused = guarded(|| -> Result<()> { panic!("slice out of range") }).unwrap_err();
        assert!(refused.to_string().contains("damaged"), "{refused}");
    }
}
