//! The files of a HATS directory, by the cells of the sky that they hold.

use crate::catalog::deep::healpix::HealpixCell;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::{fs, io};

/// The finest cells that there are.
const ORDER_MAX: u32 = 29;

/// The files of one cell of the sky.
#[derive(Debug)]
pub(super) struct Partition {
    pub(super) order: u32,
    pub(super) cell: HealpixCell,
    pub(super) files: Vec<PathBuf>,
}

impl Partition {
    /// The share of the sky that its cell covers.
    pub(super) fn share_of_sky(&self) -> f64 {
        1.0 / (12.0 * libm::exp2(2.0 * f64::from(self.order)))
    }
}

/// The partitions in a directory: `Norder=K/Dir=D/Npix=N.parquet`, where the ending may be another, or `Npix=N` a
/// directory of files; and the older `NorderK/NpixN/catalog.parquet`.
pub(super) fn partitions_in(directory: &Path) -> io::Result<Vec<Partition>> {
    let mut found: BTreeMap<(u32, u64), Vec<PathBuf>> = BTreeMap::new();
    for (order, path) in numbered(directory, "Norder")? {
        let Some(order) = u32::try_from(order)
            .ok()
            .filter(|order| *order <= ORDER_MAX)
        else {
            continue;
        };
        if !path.is_dir() {
            continue;
        }
        let mut cells = numbered(&path, "Npix")?;
        for (_, folder) in numbered(&path, "Dir")? {
            if folder.is_dir() {
                cells.extend(numbered(&folder, "Npix")?);
            }
        }
        for (number, path) in cells {
            if number < 12 << (2 * order) {
                found
                    .entry((order, number))
                    .or_default()
                    .extend(files_of(path)?);
            }
        }
    }
    let partition = |((order, number), files)| Partition {
        order,
        cell: HealpixCell::from_nested(number, order),
        files,
    };
    Ok(found.into_iter().map(partition).collect())
}

/// The entries of a directory with a name, a number, and perhaps an ending: `Npix=12.parquet`.
fn numbered(directory: &Path, name: &str) -> io::Result<Vec<(u64, PathBuf)>> {
    let mut found = Vec::new();
    for entry in fs::read_dir(directory)? {
        let path = entry?.path();
        let text = path.file_name().and_then(|text| text.to_str());
        if let Some(number) = text.and_then(|text| number_after(text, name)) {
            found.push((number, path));
        }
    }
    found.sort();
    Ok(found)
}

fn number_after(text: &str, name: &str) -> Option<u64> {
    let rest = text.strip_prefix(name)?;
    let rest = rest.strip_prefix('=').unwrap_or(rest);
    let end = rest.find(|c: char| !c.is_ascii_digit());
    let (digits, ending) = rest.split_at(end.unwrap_or(rest.len()));
    let is_whole = ending.is_empty() || ending.starts_with(['.', '_']);
    digits.parse().ok().filter(|_| is_whole)
}

/// A file, or the files of a directory; no hidden ones, which are checksums and the like.
fn files_of(path: PathBuf) -> io::Result<Vec<PathBuf>> {
    if !path.is_dir() {
        return Ok(vec![path]);
    }
    let entries = fs::read_dir(path)?.map(|entry| Ok(entry?.path()));
    let mut files = entries.collect::<io::Result<Vec<PathBuf>>>()?;
    files.retain(|file| {
        let name = file.file_name();
        let is_hidden =
            name.is_some_and(|name| matches!(name.as_encoded_bytes().first(), Some(b'.' | b'_')));
        file.is_file() && !is_hidden
    });
    files.sort();
    Ok(files)
}
