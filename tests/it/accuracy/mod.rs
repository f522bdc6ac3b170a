//! Accuracy on simulated frames, compared with truth and theory: centroids with the Cramér-Rao
//! bound, errors with their stated values, detection with the ideal matched filter.
//!
//! The whole tables: `cargo test --release --test it accuracy:: -- --ignored --nocapture`.

mod attitude;
mod centroids;
mod detection;
mod exchange;
mod stars;
mod tally;
