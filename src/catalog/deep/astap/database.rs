//! A database of areas: one file for each.

use super::records::{AstapHeader, AstapStar, HEADER_BYTES, RecordReader};
use super::tiling::{Area, Tiling};
use crate::base::coords::UnitVector;
use crate::base::file_ranges::FileRanges;
use crate::base::interrupt::Interrupt;
use crate::base::units::{RAD_PER_DEG, WHOLE_SKY_SQ_DEG};
use crate::catalog::Band;
use crate::catalog::deep::error::Damage;
use crate::catalog::deep::region::Region;
use crate::catalog::star::rounded_mag;
use crate::catalog::{PlaceId, Star, StarFlags, StarId};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Records that are read at once.
const RECORDS_AT_ONCE: u64 = 1 << 15;
/// Of a file, whose stars are ordered by brightness, so many times the stars are looked at that are wanted of its
/// area: they are not spread evenly in it.
const LOOKED_AT: f64 = 6.0;

/// The file of each area.
type AreaFiles = BTreeMap<Area, PathBuf>;

/// A database of areas.
#[derive(Debug)]
pub struct AreaDatabase {
    /// Its name, as in `d50`.
    pub name: String,
    tiling: Tiling,
    files: AreaFiles,
    header: AstapHeader,
}

/// The name of a file: that of the database, and its area.
fn parsed(path: &Path) -> Option<(String, Tiling, Area)> {
    let extension = path.extension()?.to_str()?;
    let tiling = Tiling::of_extension(extension)?;
    let stem = path.file_stem()?.to_str()?.to_ascii_lowercase();
    let (name, digits) = stem.rsplit_once('_')?;
    let (ring, place) = digits.split_at_checked(2)?;
    let is_number = digits.len() == 4 && digits.bytes().all(|digit| digit.is_ascii_digit());
    let (ring, place): (u32, u32) = (ring.parse().ok()?, place.parse().ok()?);
    let exists = is_number
        && (1..=tiling.rings()).contains(&ring)
        && (1..=tiling.areas_of(ring)).contains(&place);
    exists.then(|| (name.to_owned(), tiling, Area { ring, place }))
}

impl AreaDatabase {
    /// The databases of which `files` are, by name. Files with other names are left out.
    pub fn find(files: &[PathBuf]) -> Result<Vec<Self>, (PathBuf, Damage)> {
        let mut found: BTreeMap<(String, Tiling), AreaFiles> = BTreeMap::new();
        for path in files {
            if let Some((name, tiling, area)) = parsed(path) {
                let files = found.entry((name, tiling)).or_default();
                files.insert(area, path.clone());
            }
        }
        let open = |((name, tiling), files): (_, AreaFiles)| {
            let first = files.values().next().cloned().unwrap_or_default();
            let header = open(&first).map_err(|error| (first, error))?.1;
            Ok(Self {
                name,
                tiling,
                files,
                header,
            })
        };
        found.into_iter().map(open).collect()
    }

    /// Its files.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        self.files.values().map(PathBuf::as_path)
    }

    /// The epoch of its positions, where it is stated.
    pub const fn epoch_year(&self) -> Option<f64> {
        self.header.epoch_year
    }

    /// The band of its magnitudes.
    pub fn band(&self) -> Band {
        if self.is_v() {
            Band::JohnsonV
        } else {
            Band::GaiaBp
        }
    }

    fn is_v(&self) -> bool {
        self.header.is_v || self.name.starts_with('v')
    }

    /// The share of the sky whose files there are.
    pub fn share_of_sky(&self) -> f64 {
        let areas = self.files.keys();
        let areas = areas.map(|area| self.tiling.area_sq_deg(area.ring));
        (areas.sum::<f64>() / WHOLE_SKY_SQ_DEG).min(1.0)
    }

    /// Number of records of all files, a few of which are no stars.
    pub fn records(&self) -> u64 {
        let bytes = self.files.values().map(|path| match path.metadata() {
            Ok(metadata) => metadata.len().saturating_sub(HEADER_BYTES as u64),
            Err(_) => 0,
        });
        bytes.sum::<u64>() / self.header.record_bytes as u64
    }

    /// Calls `visit` with every star that may lie in a region, as far as it may be one of the brightest that are
    /// wanted, and some around it.
    pub fn stars_in(
        &self,
        region: &Region,
        interrupt: &Interrupt,
        visit: &mut dyn FnMut(Star),
    ) -> Result<(), (PathBuf, Damage)> {
        for area in self.tiling.areas_near(&region.centre, region.radius_rad) {
            // Databases of a part of the sky have no files of the rest.
            if let Some(path) = self.files.get(&area) {
                let most = LOOKED_AT * region.per_sq_deg * self.tiling.area_sq_deg(area.ring);
                self.read(path, most, interrupt, visit)
                    .map_err(|error| (path.clone(), error))?;
            }
        }
        Ok(())
    }

    fn read(
        &self,
        path: &Path,
        most: f64,
        interrupt: &Interrupt,
        visit: &mut dyn FnMut(Star),
    ) -> Result<(), Damage> {
        let (file, header) = open(path)?;
        let width = header.record_bytes as u64;
        let mut reader = RecordReader::new(&header);
        let mut at = HEADER_BYTES as u64;
        let mut stars = 0.0;
        while at + width <= file.length() && stars < most {
            interrupt.check().map_err(|_| Damage::Interrupted)?;
            let left = (file.length() - at) / width;
            let end = at + width * left.min(RECORDS_AT_ONCE);
            let bytes = file.read(at..end)?;
            for record in bytes.chunks_exact(header.record_bytes) {
                if let Some(star) = reader.star(record) {
                    stars += 1.0;
                    visit(self.star(&star));
                }
            }
            at = end;
        }
        Ok(())
    }

    fn star(&self, star: &AstapStar) -> Star {
        /// Median BP − V of field stars.
        const BP_MINUS_V_MAG: f64 = 0.18;
        let direction =
            UnitVector::from_ra_dec(star.ra_deg * RAD_PER_DEG, star.dec_deg * RAD_PER_DEG);
        let v_mag = match self.is_v() {
            true => star.mag,
            false => rounded_mag(f64::from(star.mag) - BP_MINUS_V_MAG),
        };
        let id = StarId::Place(PlaceId::of(&direction));
        let plain = Star::new(id, direction, v_mag);
        Star {
            bv_mag: star.bv_mag,
            flags: plain.flags.union(StarFlags::DERIVED_MAGNITUDE),
            ..plain
        }
    }
}

/// A file, and its header.
fn open(path: &Path) -> Result<(FileRanges, AstapHeader), Damage> {
    let file = FileRanges::open(path)?;
    let header = AstapHeader::read(&file.head(HEADER_BYTES as u64)?)?;
    Ok((file, header))
}
