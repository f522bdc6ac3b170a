//! Errors of the decoder.

use crate::base::panics::caught;
use crate::catalog::deep::error::Damage;
use parquet::errors::{ParquetError, Result as ParquetResult};

/// Calls `read`. The decoder panics on some damaged files (`parquet` 60.1): this makes errors of it. What `read`
/// uses must not be used again after an error.
pub(super) fn guarded<T>(read: impl FnOnce() -> ParquetResult<T>) -> Result<T, Damage> {
    match caught(read) {
        Ok(Ok(value)) => Ok(value),
        Ok(Err(ParquetError::EOF(_))) => Err(Damage::Truncated),
        Ok(Err(ParquetError::NYI(what))) => Err(Damage::Unsupported(what)),
        Ok(Err(error)) => Err(Damage::Invalid(error.to_string())),
        Err(_) => Err(Damage::Invalid("its content cannot be decoded".to_owned())),
    }
}
