//! The file that keeps a triangle index, so that it is built once for each catalog.
//!
//! All numbers are little-endian. In order, without gaps:
//!
//! | Bytes | Content |
//! |---|---|
//! | 16 | magic |
//! | 8, 8 | format version, checksum of the catalogue, `u64` each |
//! | 8, 8 | bytes and XXH3-64 of the table that follows, `u64` each |
//! | … | the table, an entry for each size class (below) |
//! | … | the triangles, by class and chunk: corners, 21 bits of a `u64`
//! each; ratios, two `u16`; size, `u8`; magnitudes, three `u8` |
//!
//! An entry of the table:
//!
//! | Bytes | Content |
//! |---|---|
//! | 8, 8 | smallest and largest longest side as chords, `f64` each |
//! | 8 × chunks | XXH3-64 of the triangles of each chunk, `u64` each |
//! | 4 × (cells + 1) | number of triangles before each cell, and in all, `u32` each |
//!
//! A file is written under a temporary name and renamed. Its table is read and checked at once, a
//! chunk when it is first needed. A file with a damaged chunk is deleted.

use super::table::{CELLS, CHUNKS, SizeClass, TRIANGLE_BYTES, Triangle};
use crate::base::files;
use std::fs::File;
use std::io::{self, Cursor, Read, Seek, SeekFrom, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use xxhash_rust::xxh3::{Xxh3, xxh3_64};

const MAGIC: [u8; 16] = *b"starpipe index\r\n";
/// To be raised whenever the same catalog gets another index, or the layout changes.
const FORMAT_VERSION: u64 = 4;
const HEADER_BYTES: usize = 48;
/// Size of an entry of the table.
const CLASS_BYTES: usize = 16 + 8 * CHUNKS + 4 * (CELLS + 1);
/// Upper limit that guards against a damaged length.
const MAX_CLASSES: usize = 64;

/// Why an index could not be read from the cache or written to it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CacheError {
    /// The file could not be read or written.
    #[error("{action} the triangle index {path}: {source}")]
    Io {
        /// What was attempted.
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// The content of the file is not what was written.
    #[error("the triangle index {path} is damaged: {what}")]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        what: String,
    },
}

/// The file in `directory` for the index of the catalog with this checksum.
pub fn index_path(directory: &Path, catalog_checksum: u64) -> PathBuf {
    directory.join(index_name(catalog_checksum))
}

/// The name of that file.
pub fn index_name(catalog_checksum: u64) -> String {
    format!("triangles-{catalog_checksum:016x}-v{FORMAT_VERSION}.bin")
}

/// An open file, from which chunks are read.
#[derive(Debug)]
pub struct IndexFile {
    path: PathBuf,
    content: Mutex<Content>,
    classes: Vec<StoredClass>,
}

/// Where the bytes of an index are.
#[derive(Debug)]
enum Content {
    File(File),
    Memory(Cursor<Vec<u8>>),
}

impl Read for Content {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        match self {
            Self::File(file) => file.read(bytes),
            Self::Memory(memory) => memory.read(bytes),
        }
    }
}

impl Seek for Content {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        match self {
            Self::File(file) => file.seek(to),
            Self::Memory(memory) => memory.seek(to),
        }
    }
}

/// The triangles of a class in the file.
#[derive(Debug)]
struct StoredClass {
    /// Position of the first triangle, in bytes.
    start: u64,
    /// Checksum of each chunk.
    checksums: Vec<u64>,
}

impl IndexFile {
    /// Reads a chunk of a class: its triangles `range`, of a catalogue of so many `stars`.
    ///
    /// # Errors
    /// [`CacheError::Io`] if it cannot be read, [`CacheError::Damaged`] if it is not what [`store`]
    /// wrote. In both cases the file is deleted.
    pub fn chunk(
        &self,
        class: usize,
        chunk: usize,
        range: Range<u32>,
        stars: usize,
    ) -> Result<Box<[Triangle]>, CacheError> {
        let stored = &self.classes[class];
        let start = stored.start + u64::from(range.start) * TRIANGLE_BYTES as u64;
        let mut checksum = Xxh3::new();
        let triangles = self
            .read_at(start, range.len(), &mut checksum)
            .map_err(|source| self.delete_after(io_error("reading", &self.path)(source)))?;
        if checksum.digest() != stored.checksums[chunk] {
            let what = format!("the checksum of chunk {chunk} of class {class} is wrong");
            return Err(self.delete_after(damaged(&self.path)(what)));
        }
        let corners = triangles.iter().flat_map(Triangle::corners);
        if corners.max().is_some_and(|corner| corner as usize >= stars) {
            let what = format!(
                "chunk {chunk} of class {class} refers to stars that are not in the catalog"
            );
            return Err(self.delete_after(damaged(&self.path)(what)));
        }
        Ok(triangles)
    }

    /// Reads so many triangles from a position, block by block: a block stays in the cache until it
    /// is decoded.
    fn read_at(
        &self,
        start: u64,
        count: usize,
        checksum: &mut Xxh3,
    ) -> io::Result<Box<[Triangle]>> {
        const BLOCK: usize = 4096;
        let mut file = self.content();
        file.seek(SeekFrom::Start(start))?;
        let mut triangles = Vec::with_capacity(count);
        let mut block = vec![0; BLOCK.min(count) * TRIANGLE_BYTES];
        while triangles.len() < count {
            let bytes = &mut block[..BLOCK.min(count - triangles.len()) * TRIANGLE_BYTES];
            file.read_exact(bytes)?;
            checksum.update(bytes);
            let bytes = bytes.as_chunks().0.iter();
            triangles.extend(bytes.map(|bytes| Triangle::from_bytes(*bytes)));
        }
        Ok(triangles.into())
    }

    fn content(&self) -> MutexGuard<'_, Content> {
        self.content.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Deletes the file, so that the next process writes it again; returns `error`.
    fn delete_after(&self, error: CacheError) -> CacheError {
        if let Content::File(_) = *self.content() {
            // A file that cannot be deleted is reported again by the next process.
            let _ = std::fs::remove_file(&self.path);
        }
        error
    }
}

fn io_error(action: &'static str, path: &Path) -> impl Fn(io::Error) -> CacheError {
    move |source| CacheError::Io {
        action,
        path: path.to_owned(),
        source,
    }
}

fn damaged(path: &Path) -> impl Fn(String) -> CacheError {
    move |what| CacheError::Damaged {
        path: path.to_owned(),
        what,
    }
}

fn header(catalog_checksum: u64, table: &[u8]) -> [u8; HEADER_BYTES] {
    let mut header = [0; HEADER_BYTES];
    header[..16].copy_from_slice(&MAGIC);
    let fields = [
        FORMAT_VERSION,
        catalog_checksum,
        table.len() as u64,
        xxh3_64(table),
    ];
    for (slot, field) in header[16..].chunks_exact_mut(8).zip(fields) {
        slot.copy_from_slice(&field.to_le_bytes());
    }
    header
}

/// Opens the index at `path`; `Ok(None)` if there is no such file. The classes have no chunks yet.
///
/// # Errors
/// [`CacheError::Io`] if it cannot be read, [`CacheError::Damaged`] if it is not what [`store`]
/// wrote for this catalog.
pub fn load(
    path: &Path,
    catalog_checksum: u64,
) -> Result<Option<(Vec<SizeClass>, IndexFile)>, CacheError> {
    match files::open(path) {
        Ok(file) => open(path, Content::File(file), catalog_checksum).map(Some),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(io_error("reading", path)(error)),
    }
}

/// Opens the index in `bytes`, as [`load`] does that in a file.
///
/// # Errors
/// [`CacheError::Damaged`].
pub fn from_bytes(
    bytes: Vec<u8>,
    catalog_checksum: u64,
) -> Result<(Vec<SizeClass>, IndexFile), CacheError> {
    let content = Content::Memory(Cursor::new(bytes));
    open(Path::new("in memory"), content, catalog_checksum)
}

fn open(
    path: &Path,
    mut file: Content,
    catalog_checksum: u64,
) -> Result<(Vec<SizeClass>, IndexFile), CacheError> {
    let (io_error, damaged) = (io_error("reading", path), damaged(path));
    let length = file.seek(SeekFrom::End(0)).map_err(&io_error)?;
    file.rewind().map_err(&io_error)?;
    let mut found = [0; HEADER_BYTES];
    let mut table = Vec::new();
    if length >= HEADER_BYTES as u64 {
        file.read_exact(&mut found).map_err(&io_error)?;
        let stated = u64::from_le_bytes([32, 33, 34, 35, 36, 37, 38, 39].map(|i| found[i]));
        let most = (MAX_CLASSES * CLASS_BYTES) as u64;
        let room = stated.min(most);
        (&mut file)
            .take(room)
            .read_to_end(&mut table)
            .map_err(&io_error)?;
    }
    if found != header(catalog_checksum, &table) {
        return Err(damaged("the checksum of its table is wrong".into()));
    }
    let (classes, stored) = classes_of(&table);
    if !classes.iter().all(SizeClass::is_ordered) {
        return Err(damaged("the cells of its table overlap".into()));
    }
    let triangles: u64 = classes.iter().map(|class| class.len() as u64).sum();
    let expected = (HEADER_BYTES + table.len()) as u64 + triangles * TRIANGLE_BYTES as u64;
    if length != expected {
        return Err(damaged(format!("{length} bytes long, expected {expected}")));
    }
    let file = IndexFile {
        path: path.to_owned(),
        content: Mutex::new(file),
        classes: stored,
    };
    Ok((classes, file))
}

/// The classes in a table, and their triangles in the file.
fn classes_of(table: &[u8]) -> (Vec<SizeClass>, Vec<StoredClass>) {
    let mut start = (HEADER_BYTES + table.len()) as u64;
    let class = |bytes: &[u8]| {
        let (words, starts) = bytes.split_at(16 + 8 * CHUNKS);
        let words = words.as_chunks().0;
        let limits = [words[0], words[1]].map(f64::from_le_bytes);
        let starts = starts.as_chunks().0.iter();
        let starts = starts.map(|start| u32::from_le_bytes(*start)).collect();
        let class = SizeClass::not_loaded(limits, starts);
        let checksums = words[2..].iter().map(|sum| u64::from_le_bytes(*sum));
        let stored = StoredClass {
            start,
            checksums: checksums.collect(),
        };
        start += class.len() as u64 * TRIANGLE_BYTES as u64;
        (class, stored)
    };
    table.chunks_exact(CLASS_BYTES).map(class).unzip()
}

/// Writes the index to `path`, whole or not at all; creates the directory if needed. All chunks of
/// `classes` must be in memory.
///
/// # Errors
/// [`CacheError::Io`] if it cannot be written.
pub fn store(path: &Path, catalog_checksum: u64, classes: &[SizeClass]) -> Result<(), CacheError> {
    let io_error = io_error("writing", path);
    let directory = path.parent().unwrap_or(Path::new("."));
    files::make_directory(directory).map_err(&io_error)?;
    let file = files::beside(path).map_err(&io_error)?;
    let mut out = io::BufWriter::new(file.as_file());
    write(&mut out, catalog_checksum, classes)
        .and_then(|()| out.flush())
        .map_err(&io_error)?;
    drop(out);
    file.persist(path).map_err(|error| io_error(error.error))?;
    Ok(())
}

/// The bytes that [`store`] writes.
pub fn to_bytes(catalog_checksum: u64, classes: &[SizeClass]) -> Vec<u8> {
    let triangles: usize = classes.iter().map(SizeClass::len).sum();
    let table = classes.len() * CLASS_BYTES;
    let mut out = Vec::with_capacity(HEADER_BYTES + table + triangles * TRIANGLE_BYTES);
    write(&mut out, catalog_checksum, classes).expect("memory takes what is written");
    out
}

fn write(out: &mut impl Write, catalog_checksum: u64, classes: &[SizeClass]) -> io::Result<()> {
    let chunks_of = |class: &SizeClass| {
        let chunks = class.chunks.iter().map(|chunk| {
            let triangles = chunk.get().into_iter().flatten();
            triangles.flat_map(|triangle| triangle.to_bytes()).collect()
        });
        chunks.collect::<Vec<Vec<u8>>>()
    };
    let mut table = Vec::with_capacity(classes.len() * CLASS_BYTES);
    for class in classes {
        let chunks = chunks_of(class);
        table.extend(class.low.to_le_bytes());
        table.extend(class.high.to_le_bytes());
        table.extend(chunks.iter().flat_map(|chunk| xxh3_64(chunk).to_le_bytes()));
        table.extend(
            class
                .cell_starts
                .iter()
                .flat_map(|start| start.to_le_bytes()),
        );
    }
    out.write_all(&header(catalog_checksum, &table))?;
    out.write_all(&table)?;
    // Made twice, so that they are not all in memory twice.
    let mut chunks = classes.iter().flat_map(chunks_of);
    chunks.try_for_each(|chunk| out.write_all(&chunk))
}

#[cfg(test)]
mod tests {
    use super::*;

    const STARS: usize = 102;

    fn classes() -> Vec<SizeClass> {
        let triangle = |i: u32| {
            let share = f64::from(i) / 100.0;
            Triangle::new(
                [i, i + 1, i + 2],
                [0.5 + share / 2.0, share],
                share,
                [i as f32 / 10.0; 3],
            )
        };
        let triangles: Vec<Triangle> = (0..100).map(triangle).collect();
        vec![
            SizeClass::new([0.1, 0.2], &triangles[..40]),
            SizeClass::new([0.2, 0.3], &triangles[40..]),
        ]
    }

    /// All triangles of an index on disk, and how many of its chunks are damaged.
    fn read_all((classes, file): (Vec<SizeClass>, IndexFile)) -> (Vec<Triangle>, usize) {
        let (mut triangles, mut damaged) = (Vec::new(), 0);
        for (number, class) in classes.iter().enumerate() {
            for chunk in 0..CHUNKS {
                match file.chunk(number, chunk, class.range(chunk), STARS) {
                    Ok(read) => triangles.extend(read),
                    Err(_) => damaged += 1,
                }
            }
        }
        (triangles, damaged)
    }

    /// The index of [`classes`] with one word of its table changed, and its checksum right.
    fn changed(path: &Path, at: usize, word: u32) {
        store(path, 7, &classes()).unwrap();
        let mut bytes = std::fs::read(path).unwrap();
        bytes[HEADER_BYTES + at..][..4].copy_from_slice(&word.to_le_bytes());
        let table = HEADER_BYTES..HEADER_BYTES + 2 * CLASS_BYTES;
        let header = header(7, &bytes[table]);
        bytes[..HEADER_BYTES].copy_from_slice(&header);
        std::fs::write(path, &bytes).unwrap();
    }

    #[test]
    fn cells_that_overlap_are_damage_whatever_the_checksum() {
        let directory = tempfile::tempdir().unwrap();
        let path = index_path(directory.path(), 7);
        let first_cell = 16 + 8 * CHUNKS;
        for (cell, start) in [(0, 1), (CELLS / 2, 41), (CELLS / 2, u32::MAX)] {
            changed(&path, first_cell + 4 * cell, start);
            let error = load(&path, 7).unwrap_err().to_string();
            assert!(error.contains("overlap"), "{error}");
        }
    }

    #[test]
    fn triangles_of_stars_that_are_not_there_are_damage() {
        let directory = tempfile::tempdir().unwrap();
        let path = index_path(directory.path(), 7);
        store(&path, 7, &classes()).unwrap();
        let (classes, file) = load(&path, 7).unwrap().unwrap();
        let read = |stars| {
            let mut chunks = 0..CHUNKS;
            chunks.all(|chunk| file.chunk(1, chunk, classes[1].range(chunk), stars).is_ok())
        };
        assert!(read(STARS));
        assert!(!read(STARS - 1));
    }

    #[test]
    fn an_index_is_read_as_it_was_written_and_damage_is_found() {
        let directory = tempfile::tempdir().unwrap();
        let path = index_path(&directory.path().join("new"), 7);
        assert!(load(&path, 7).unwrap().is_none());
        let classes = classes();
        store(&path, 7, &classes).unwrap();
        let chunks = classes.iter().flat_map(|class| &class.chunks);
        let expected: Vec<Triangle> = chunks.flat_map(|c| c.get().unwrap().to_vec()).collect();
        assert_eq!(expected.len(), 100);
        let loaded = load(&path, 7).unwrap().unwrap();
        assert_eq!(read_all(loaded), (expected, 0));
        assert!(load(&path, 8).is_err(), "the index of another catalog");

        let good = std::fs::read(&path).unwrap();
        let table_end = good.len() - 100 * TRIANGLE_BYTES;
        for position in [0, 20, 30, 45, 47, 48, 60, table_end / 2, table_end - 1] {
            let mut bad = good.clone();
            bad[position] ^= 0x10;
            std::fs::write(&path, &bad).unwrap();
            assert!(load(&path, 7).is_err(), "byte {position} flipped");
        }
        for length in [0, 5, 48, table_end, good.len() - 1] {
            std::fs::write(&path, &good[..length]).unwrap();
            assert!(load(&path, 7).is_err(), "cut to {length} bytes");
        }
        // Damage to a chunk is found when the chunk is read; the file is then removed.
        for position in [table_end, (table_end + good.len()) / 2, good.len() - 1] {
            let mut bad = good.clone();
            bad[position] ^= 0x10;
            std::fs::write(&path, &bad).unwrap();
            let (_, damaged) = read_all(load(&path, 7).unwrap().unwrap());
            assert_eq!(damaged, 1, "byte {position}");
            assert!(!path.exists());
        }
    }
}
