//! What does a list of centroids hold? For those who have centroids already.
//!
//! table in CSV, or in FITS as astrometry.net has it → [`CentroidList`] → its usable centroids, brightest first, the [`LeftOut`] rows, and the
//! frame that they are in.

mod columns;
mod frame;
mod left_out;
mod list;
mod table;
mod text;
mod xylist;

pub(crate) use frame::ListFrame;
pub use left_out::{LeftOut, RowProblem};
pub use list::{CentroidList, ListedCentroid};
pub use table::{CentroidListError, CentroidListOptions};
#[doc(hidden)]
pub use xylist::XylistOptions;
