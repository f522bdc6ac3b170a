//! Deep catalogues of other programs: what is read of them, and fields that are identified with them.

pub mod areas;
mod damage;
mod fields;
mod index_file;
pub mod patch;
mod reading;
#[cfg(target_os = "linux")]
mod sparse;
mod sweep;
mod tables;
