//! The triangle index on disk, so that it is made once for each catalogue.
//!
//! A header of 128 bytes (magic, format version, checksum of the catalogue, length and checksum of what
//! follows), then the index in rkyv's archive format. A file is written beside its place and renamed, and one that is
//! not exactly what was written is made anew.

use super::index::TriangleIndex;
use rkyv::rancor;
use rkyv::util::AlignedVec;
use std::fs::File;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use xxhash_rust::xxh3::xxh3_64;

const MAGIC: [u8; 16] = *b"starpipe index\r\n";
/// To be raised whenever the same catalogue makes another index, or its layout changes.
const FORMAT_VERSION: u64 = 1;
/// The archive wants its trees on cache lines; so long a header keeps them there.
const HEADER_BYTES: usize = 128;
/// No index is larger: guards against a damaged length.
const MAX_BYTES: u64 = 1 << 30;

/// Why an index could not be taken from the cache or put there.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CacheError {
    /// The file system refused.
    #[error("{action} the triangle index {path}: {source}")]
    Io {
        /// What was tried.
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The file is not what was written.
    #[error("the triangle index {path} is damaged: {what}")]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        what: String,
    },
}

/// Where the index of the catalogue with this checksum is kept.
pub fn index_path(directory: &Path, catalog_checksum: u64) -> PathBuf {
    directory.join(format!(
        "triangles-{catalog_checksum:016x}-v{FORMAT_VERSION}.bin"
    ))
}

fn header(catalog_checksum: u64, payload: &[u8]) -> [u8; HEADER_BYTES] {
    let mut header = [0; HEADER_BYTES];
    header[..16].copy_from_slice(&MAGIC);
    let fields = [
        FORMAT_VERSION,
        catalog_checksum,
        payload.len() as u64,
        xxh3_64(payload),
    ];
    for (slot, field) in header[16..].chunks_exact_mut(8).zip(fields) {
        slot.copy_from_slice(&field.to_le_bytes());
    }
    header
}

/// Reads the index at `path`; `Ok(None)` if there is no such file.
///
/// # Errors
/// [`CacheError::Io`] if it cannot be read, [`CacheError::Damaged`] if it is not what [`store`] wrote for this catalogue.
pub fn load(path: &Path, catalog_checksum: u64) -> Result<Option<TriangleIndex>, CacheError> {
    let io_error = |source| CacheError::Io {
        action: "reading",
        path: path.to_owned(),
        source,
    };
    let damaged = |what: String| CacheError::Damaged {
        path: path.to_owned(),
        what,
    };
    let file = match File::open(path) {
        Ok(file) => file,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(io_error(error)),
    };
    let length = file.metadata().map_err(io_error)?.len();
    if length > MAX_BYTES {
        return Err(damaged(format!("{length} bytes long")));
    }
    let mut bytes = AlignedVec::<HEADER_BYTES>::with_capacity(length as usize);
    bytes
        .extend_from_reader(&mut file.take(MAX_BYTES))
        .map_err(io_error)?;
    let Some((found, payload)) = bytes.split_at_checked(HEADER_BYTES) else {
        return Err(damaged(format!("only {} bytes long", bytes.len())));
    };
    if found != header(catalog_checksum, payload) {
        return Err(damaged("its checksum is wrong".into()));
    }
    rkyv::from_bytes::<TriangleIndex, rancor::Error>(payload)
        .map(Some)
        .map_err(|error| damaged(error.to_string()))
}

/// Writes the index to `path`, whole or not at all, making the directory if need be.
///
/// # Errors
/// [`CacheError::Io`] if it cannot be written.
pub fn store(path: &Path, catalog_checksum: u64, index: &TriangleIndex) -> Result<(), CacheError> {
    let io_error = |source| CacheError::Io {
        action: "writing",
        path: path.to_owned(),
        source,
    };
    let payload = rkyv::to_bytes::<rancor::Error>(index)
        .map_err(|error| io_error(io::Error::other(error)))?;
    let directory = path.parent().unwrap_or(Path::new("."));
    std::fs::create_dir_all(directory).map_err(io_error)?;
    let mut file = tempfile::NamedTempFile::new_in(directory).map_err(io_error)?;
    file.write_all(&header(catalog_checksum, &payload))
        .and_then(|()| file.write_all(&payload))
        .map_err(io_error)?;
    file.persist(path).map_err(|error| io_error(error.error))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalog::sky_grid::SkyGrid;
    use crate::catalog::{Star, StarId};
    use crate::coords::UnitVector;

    fn small_index() -> TriangleIndex {
        let stars: Vec<Star> = (0..60u32)
            .map(|i| {
                Star::new(
                    StarId::Skymap(i),
                    UnitVector::from_ra_dec(f64::from(i * i % 97) * 0.01, f64::from(i) * 0.004),
                    i as f32 * 0.1,
                )
            })
            .collect();
        TriangleIndex::build(&stars, &SkyGrid::new(&stars), &|_| ())
    }

    fn corners(index: &TriangleIndex) -> Vec<&[[u32; 3]]> {
        index.classes.iter().map(|c| c.corners.as_slice()).collect()
    }

    #[test]
    fn what_is_stored_is_loaded_and_nothing_else() {
        let directory = tempfile::tempdir().unwrap();
        let path = index_path(&directory.path().join("new"), 7);
        assert!(load(&path, 7).unwrap().is_none());
        let index = small_index();
        assert!(!index.is_empty());
        store(&path, 7, &index).unwrap();
        let loaded = load(&path, 7).unwrap().unwrap();
        assert_eq!(corners(&loaded), corners(&index));
        assert!(load(&path, 8).is_err(), "another catalogue's index");

        let good = std::fs::read(&path).unwrap();
        for position in [0, 20, 30, 45, 127, 128, good.len() / 2, good.len() - 1] {
            let mut bad = good.clone();
            bad[position] ^= 0x10;
            std::fs::write(&path, &bad).unwrap();
            assert!(load(&path, 7).is_err(), "byte {position} flipped");
        }
        for length in [0, 5, 128, good.len() - 1] {
            std::fs::write(&path, &good[..length]).unwrap();
            assert!(load(&path, 7).is_err(), "cut to {length} bytes");
        }
    }
}
