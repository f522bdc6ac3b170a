//! What is measured, against the truth of simulated frames and against theory: centroids and the Cramer-Rao bound, errors and what is
//! stated of them, detection and the ideal matched filter.
//!
//! The whole tables: `cargo test --release --test accuracy -- --ignored --nocapture`.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should stop")]

mod attitude;
mod centroids;
mod detection;
mod exchange;
mod stars;
mod tally;
