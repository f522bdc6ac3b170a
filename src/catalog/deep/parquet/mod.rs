//! Catalogues as tables in the form of Parquet: one file, or a HATS directory with a file for each cell of the sky.
//!
//! A file or directory, a region → its stars. The columns are found by their names, as in tables of text. Of a file
//! only the columns in use are read, without the groups of rows that lie elsewhere by their least and greatest
//! coordinates; of a HATS directory only the files whose cells the region may reach.
//!
//! # Reference
//! Parquet: <https://parquet.apache.org/docs/file-format/>. HATS: Malanchev et al. 2025, IVOA Note HATS 1.0.

mod cells;
mod file;
mod guard;
mod hats;
mod layout;
mod partitions;
mod properties;
mod reach;
mod rows;
mod table;
mod tables;

#[cfg(test)]
mod tests;

pub use file::ParquetFile;
pub use hats::Hats;
pub use tables::Tables;
