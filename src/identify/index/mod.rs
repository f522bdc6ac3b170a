//! A catalogue prepared for identification: its stars by position, and the triangles they form.
//!
//! stars → cells of the sky → `listing` of their triangles → `table` of each size class, sorted
//! by shape (`triangle`) → `triangle_index`, kept in a file (`cache`) → [`IndexedCatalog`].

mod cache;
mod cache_directory;
mod indexed_catalog;
mod listing;
mod packed_vectors;
mod table;
mod triangle;
mod triangle_index;

pub use cache::CacheError;
pub use cache_directory::cache_directory;
pub use indexed_catalog::IndexedCatalog;
pub(crate) use indexed_catalog::SearchedPart;
pub use packed_vectors::PackedVectors;
pub use table::{Triangle, TriangleRange, WantedShape};
pub use triangle::TriangleShape;
