//! What is allocated, counted thread by thread. Apart from the other tests, since the counting
//! allocator serves the whole process.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should stop")]

mod detect;
mod identify;
mod pointing;
mod reading;
#[expect(dead_code, reason = "other tests use the rest of it")]
#[path = "../it/common/sequence.rs"]
mod sequence;
mod track;
