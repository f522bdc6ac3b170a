//! What does a list of centroids hold? For those who have centroids already.
//!
//! table in CSV → [`CentroidList`] → its usable centroids, brightest first, the [`LeftOut`] rows, and the
//! frame that they are in.

mod columns;
mod frame;
mod left_out;
mod list;
mod table;
mod text;

pub(crate) use frame::ListFrame;
pub use left_out::{LeftOut, RowProblem};
pub use list::{CentroidList, ListedCentroid};
pub use table::{CentroidListError, CentroidListOptions};
