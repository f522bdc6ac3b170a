//! Step 6: positions, fluxes and flags of the sources.

mod centroid;
mod measurement;
mod plateau;
mod shape;

pub(crate) use measurement::{KnownSpots, MeasureWorker, Measurement};
