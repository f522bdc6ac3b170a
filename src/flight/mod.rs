//! What does a flight computer read? The stars and their triangles in one block of bytes, and what that costs.
//!
//! [`Catalog`](crate::Catalog) → [`export()`] → the bytes that `starpipe-flight` reads in place → [`Trials`]: how often
//! frames are then identified.

mod export;
mod trials;

pub use export::export;
pub use starpipe_flight::Catalog as ExportedCatalog;
pub use starpipe_flight::build::BuildError;
pub use trials::Trials;
