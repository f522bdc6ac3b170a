//! A directory with a file for each cell of the sky.

use super::file::ParquetFile;
use super::partitions::{Partition, partitions_in};
use super::properties::Properties;
use super::reach::MOTION_DEG;
use super::table::OpenTable;
use crate::base::files;
use crate::base::interrupt::Interrupt;
use crate::base::units::RAD_PER_DEG;
use crate::catalog::deep::error::Damage;
use crate::catalog::deep::healpix::radius_of_cells_rad;
use crate::catalog::deep::region::Region;
use crate::catalog::{Band, Star};
use std::path::{Component, Path, PathBuf};
use std::sync::OnceLock;

/// A catalogue in a HATS directory.
#[derive(Debug)]
pub struct Hats {
    /// Its name, for people.
    pub name: String,
    /// Where it says what it is.
    described_in: Option<PathBuf>,
    partitions: Vec<Partition>,
    /// One of its files, which tells the columns of all.
    first: ParquetFile,
    stated_rows: Option<u64>,
    counted_rows: OnceLock<u64>,
}

/// A file, and what is wrong with it.
type Failed = (PathBuf, Damage);

impl Hats {
    /// The catalogue of a directory, of a collection its main one; `None` where the directory is of another kind, or
    /// its rows are no stars.
    pub fn open(directory: &Path) -> Result<Option<Self>, Failed> {
        let Some(collection) = Properties::of_collection(directory)? else {
            return Self::open_catalog(directory);
        };
        let main = collection.text(&["hats_primary_table_url"]);
        let main = main.map(|main| Path::new(main.trim_end_matches('/')));
        let is_within = |path: &&Path| {
            let mut parts = path.components();
            parts.all(|part| matches!(part, Component::Normal(_) | Component::CurDir))
        };
        let main = main.filter(is_within).map(|main| directory.join(main));
        match main.filter(|main| main.is_dir()) {
            Some(main) => Self::open_catalog(&main),
            None => {
                let missing = "hats_primary_table_url does not name a directory beside this file";
                Err((collection.path, Damage::Invalid(missing.to_owned())))
            }
        }
    }

    fn open_catalog(directory: &Path) -> Result<Option<Self>, Failed> {
        let properties = Properties::of_catalog(directory)?;
        if properties.as_ref().is_some_and(|found| !found.has_stars()) {
            return Ok(None);
        }
        let inner = directory.join("dataset");
        let inner = if inner.is_dir() { &inner } else { directory };
        let partitions = partitions_in(inner).map_err(|error| (inner.to_owned(), error.into()))?;
        let Some(first) = partitions.iter().flat_map(|cell| &cell.files).next() else {
            return match properties {
                Some(properties) => {
                    let missing = "there are no files like Norder=0/Dir=0/Npix=0.parquet beside it";
                    Err((properties.path, Damage::Invalid(missing.to_owned())))
                }
                None => Ok(None),
            };
        };
        let first = ParquetFile::open(first).map_err(|error| (first.clone(), error))?;
        let text = |names: &[&str]| properties.as_ref().and_then(|found| found.text(names));
        let of_directory = || Some(directory.file_name()?.to_string_lossy().into_owned());
        let name = text(&["obs_collection", "catalog_name"]).map(str::to_owned);
        let rows = text(&["hats_nrows", "total_rows"]).and_then(|rows| rows.parse().ok());
        let is_whole = listed(directory).is_none_or(|listed| listed <= partitions.len());
        Ok(Some(Self {
            name: name.or_else(of_directory).unwrap_or_default(),
            stated_rows: rows.filter(|_| is_whole),
            counted_rows: OnceLock::new(),
            described_in: properties.map(|found| found.path),
            partitions,
            first,
        }))
    }

    /// Its files.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        let files = self.partitions.iter().flat_map(|cell| &cell.files);
        files.chain(&self.described_in).map(PathBuf::as_path)
    }

    /// Its magnitudes, for people.
    pub const fn band(&self) -> Band {
        self.first.band
    }

    /// The epoch of positions without proper motion, where it is known.
    pub const fn epoch_year(&self) -> Option<f64> {
        self.first.epoch_year
    }

    /// The share of the sky whose files there are.
    pub fn share_of_sky(&self) -> f64 {
        let shares = self.partitions.iter().map(Partition::share_of_sky);
        shares.sum::<f64>().min(1.0)
    }

    /// Number of its rows: as it says, unless some of its files are not there; then they are counted.
    pub fn rows(&self) -> u64 {
        let count = || {
            let files = self.partitions.iter().flat_map(|cell| &cell.files);
            // What cannot be read is told when its stars are.
            let rows = files.map(|file| OpenTable::open(file).map_or(0, |table| table.rows()));
            rows.sum()
        };
        self.stated_rows
            .unwrap_or_else(|| *self.counted_rows.get_or_init(count))
    }

    /// Calls `add` with every star that may lie in a region, and some around it.
    pub fn stars_in(
        &self,
        region: &Region,
        interrupt: &Interrupt,
        add: &mut dyn FnMut(Star),
    ) -> Result<(), Failed> {
        let reach_rad = region.radius_rad + MOTION_DEG * RAD_PER_DEG;
        let near = self.partitions.iter().filter(|partition| {
            let apart_rad = partition
                .cell
                .centre(partition.order)
                .angle_to(&region.centre);
            apart_rad <= reach_rad + radius_of_cells_rad(partition.order)
        });
        for path in near.flat_map(|partition| &partition.files) {
            let table = OpenTable::open(path);
            let read = table.and_then(|table| table.stars_in(region, interrupt, add));
            read.map_err(|error| (path.clone(), error))?;
        }
        Ok(())
    }
}

/// The number of partitions in the list of a directory, where it has one.
fn listed(directory: &Path) -> Option<usize> {
    const BYTES_MAX: u64 = 1 << 26;
    let list = directory.join("partition_info.csv");
    let text = list.is_file().then(|| files::read_text(&list, BYTES_MAX))?;
    let rows = text
        .ok()?
        .lines()
        .filter(|line| !line.trim().is_empty())
        .count();
    // Without the headings.
    Some(rows.saturating_sub(1))
}
