//! The star catalogue: what is known of each star, and which stars are near a direction.
//!
//! A catalogue of any kind (below) → [`Catalog`].
//!
//! Conventions: positions are ICRS at epoch J2000.0; proper motions are in milliarcseconds a year,
//! that in right ascension along the circle (times cos(declination)); magnitudes are Johnson V.
//! Stars are ordered brightest first, ties by identifier, so the stars down to a magnitude are a prefix.
//!
//! 1. [`Catalog::built_in`] decodes SKY2000 from inside the program: nothing to install.
//! 2. [`Catalog::read`] takes any file or directory, whose kind is found from its content, not its name.
//! 3. [`read`] and [`import()`] tell besides what became of each record.
//! 4. [`Catalog::write_compact`] and [`sky2000::write_bright_csv`] write what others then read.
//!
//! # Kinds
//! All may be packed with gzip.
//!
//! - The compact form: what is read fastest.
//! - SKY2000, version 4 or 5, in fixed-width records of 520 bytes.
//! - Tycho-2 as the CDS distributes it, `tyc2.dat` (whole or in parts) and the supplements: one file, or a directory, of
//!   which all parts and supplement 1 are read together. Supplement 2, of stars that are probably none, is
//!   read only if it is asked for by name.
//! - A table with SKY2000's column labels, as [`sky2000::write_bright_csv`] or VizieR write it.
//! - Any other table with a line of headings, columns in any order, separated by commas, semicolons, bars or tabs: an identifier
//!   (`id`, `hip`, `tyc`, `source_id`, `name`, …), a position (`ra` and `dec`, `raj2000` and `dej2000`, …; degrees, hours where the
//!   heading or a line of units says so, or text like `05:34:48.0`, `05 34 48.0`, `05h34m48.0s`), a magnitude (Johnson V
//!   before VT before any other) and, where there are such, proper motion (`pmra`, `pmdec`) and epoch
//!   (`ref_epoch`, `epoch`, or what VizieR's comments say). [`SourceFile::kind`] tells which column was taken for what.
//! - A directory with one file of any other kind.
//!
//! A record that is whole but has no position or no magnitude is no star; one that cannot be read, or repeats an identifier, is
//! unreadable. Both are counted, and a file of which more than 1 % is unreadable is refused.
//!
//! Caveats: SKY2000 is complete to V ≈ 8.5 for all purposes, to 9 for most, and half complete at
//! V = 10. Its Skymap number is an opaque key, which in one star of a hundred disagrees with the position.
//! A star's V may be that of a pair ([`StarFlags::BLENDED_MAGNITUDE`]). Magnitudes of other systems
//! than Johnson's are near V, not V ([`StarFlags::DERIVED_MAGNITUDE`]).
//!
//! # Reference
//! Myers, Sande, Miller, Warren, Tracewell 2001, SKY2000 Catalog, Version 4 (CDS V/109); 2006,
//! Version 5 (CDS V/145); NASA Goddard Space Flight Center, Flight Dynamics Division.

mod columns;
mod compact;
mod error;
mod id;
mod import;
mod position;
mod record;
mod rows;
pub mod sky2000;
pub mod sky_grid;
mod source;
mod star;
mod table;
mod tycho2;

pub use error::{CatalogError, CompactFault, FaultPlace, RecordFault};
pub use id::{HipparcosId, StarId, TychoId};
pub use import::{ImportSummary, Reading, SourceFile};
pub use star::{Star, StarFlags, StarIndex};

use crate::base::files;
use std::io::{self, Write};
use std::path::Path;
use std::sync::OnceLock;

/// The epoch of the positions in SKY2000, as a Julian year.
const EPOCH_J2000_YEAR: f64 = 2000.0;
/// The faintest (and, negative, the brightest) magnitude that the compact form holds.
const MAG_LIMIT: f32 = 32.0;
/// The fastest proper motion that the compact form holds, in mas a year.
const PM_LIMIT_MAS_PER_YR: f32 = 32_767.0;
/// The longest name that the compact form holds, in bytes.
const NAME_BYTES_MAX: usize = 255;

/// Stars, brightest first, and what they are called.
///
/// ```
/// use starpipe::sky::catalog::Catalog;
///
/// let catalog = Catalog::built_in();
/// let to_naked_eye = &catalog.stars()[..catalog.brighter_than(6.0)];
/// assert_eq!(to_naked_eye.len(), 5008);
/// assert_eq!(catalog.designation(0), "06450045");
/// assert_eq!(catalog.name_of(0), Some("9 alp CMa"));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Catalog {
    contents: Contents,
    checksum: u64,
}

/// What the compact form holds.
#[derive(Debug, Clone, PartialEq)]
struct Contents {
    title: String,
    epoch_year: f64,
    /// By (V, number).
    stars: Vec<Star>,
    /// By the index of the star.
    names: Vec<Name>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
struct Name {
    star_index: u32,
    text: Box<str>,
}

impl Catalog {
    /// SKY2000 version 5 revision 4, from inside the program; decoded at the first call.
    pub fn built_in() -> &'static Self {
        static BUILT_IN: OnceLock<Catalog> = OnceLock::new();
        BUILT_IN.get_or_init(|| {
            Self::from_compact(include_bytes!("../../../catalogs/sky2000.bin"))
                .expect("tests/catalog.rs checks that the catalogue in the program is whole")
        })
    }

    /// The catalogue in the file or directory `path`, whose [kind](self#kinds) is found from its content.
    ///
    /// # Errors
    /// [`CatalogError`] if it cannot be read, is of another kind, or is damaged. Up to 1 % of
    /// records may be unreadable; to learn of them, use [`read`].
    pub fn read(path: &Path) -> Result<Self, CatalogError> {
        read(path).map(|reading| reading.catalog)
    }

    /// The catalogue of `stars`, in any order, with `names` for some of them.
    ///
    /// # Errors
    /// [`CatalogError::OutOfRange`], [`CatalogError::DuplicateStar`] or [`CatalogError::BadName`] for
    /// what the compact form cannot hold: |V| or |B−V| above 32 mag, a proper motion above 32.767″ a
    /// year, one number for two stars, a name of no star, of more than 255 bytes, or a second one.
    pub fn new(
        title: impl Into<String>,
        mut stars: Vec<Star>,
        names: Vec<(StarId, String)>,
    ) -> Result<Self, CatalogError> {
        for star in &stars {
            check_range(star)?;
        }
        stars.sort_unstable_by_key(|star| (star::mmag(star.v_mag), star.id));
        let names = resolve_names(&stars, names)?;
        let contents = Contents {
            title: title.into(),
            epoch_year: EPOCH_J2000_YEAR,
            stars,
            names,
        };
        let checksum = compact::checksum_of(&compact::encode(&contents));
        Ok(Self { contents, checksum })
    }

    /// The catalogue whose compact form is `bytes`.
    ///
    /// # Errors
    /// [`CompactFault`] if the bytes are damaged, cut short, or of another version.
    pub fn from_compact(bytes: &[u8]) -> Result<Self, CompactFault> {
        Ok(Self {
            contents: compact::decode(bytes)?,
            checksum: compact::checksum_of(bytes),
        })
    }

    /// The compact form, in which proper motions are rounded to 1 mas a year.
    pub fn to_compact(&self) -> Vec<u8> {
        compact::encode(&self.contents)
    }

    /// Writes the compact form to `path`, at once: a reader finds the old file or the new one, never half of it.
    ///
    /// # Errors
    /// [`CatalogError::Write`] if the folder cannot be written to.
    pub fn write_compact(&self, path: &Path) -> Result<(), CatalogError> {
        write_whole(path, &self.to_compact())
    }

    /// Where the catalogue comes from, for people.
    pub fn title(&self) -> &str {
        &self.contents.title
    }

    /// The epoch of the positions, as a Julian year.
    pub fn epoch_year(&self) -> f64 {
        self.contents.epoch_year
    }

    /// The stars, brightest first, ties by number.
    pub fn stars(&self) -> &[Star] {
        &self.contents.stars
    }

    /// One star.
    ///
    /// # Panics
    /// If there is no such star.
    pub fn star(&self, index: StarIndex) -> &Star {
        &self.stars()[index.get()]
    }

    /// How many stars are brighter than `v_mag` (Johnson V): they are the first so many of [`stars`](Self::stars).
    pub fn brighter_than(&self, v_mag: f64) -> usize {
        self.stars()
            .partition_point(|star| star.is_brighter_than(v_mag))
    }

    /// The Bayer or Flamsteed name of a star, as in `"1 alp UMi"`, if it has one.
    pub fn name_of(&self, star: StarIndex) -> Option<&str> {
        let names = &self.contents.names;
        let position = names.binary_search_by_key(&star.get(), |name| name.star_index as usize);
        position.ok().map(|position| &*names[position].text)
    }

    /// The catalogue's own designation of a star: its Skymap number, with eight digits, else `TYC a-b-c`,
    /// `HIP n`, another number, or a name.
    ///
    /// # Panics
    /// If there is no such star.
    pub fn designation(&self, star: StarIndex) -> String {
        let id = self.star(star).id;
        match (id, self.name_of(star)) {
            (StarId::Named(_), Some(name)) => name.to_owned(),
            _ => id.to_string(),
        }
    }

    /// The index of the star with the number `id`; looks through the whole catalogue.
    pub fn find(&self, id: StarId) -> Option<StarIndex> {
        let position = self.stars().iter().position(|star| star.id == id);
        position.map(StarIndex::new)
    }

    /// A checksum of the compact form: what is derived from a catalogue is valid for one of the same checksum.
    pub fn checksum(&self) -> u64 {
        self.checksum
    }

    /// The part of the catalogue that is brighter than `v_mag` (Johnson V).
    #[must_use]
    pub fn limited_to(&self, v_mag: f64) -> Self {
        let count = self.brighter_than(v_mag);
        let names = &self.contents.names;
        let name_count = names.partition_point(|name| (name.star_index as usize) < count);
        let contents = Contents {
            title: format!("{}, V < {v_mag}", self.contents.title),
            epoch_year: self.contents.epoch_year,
            stars: self.contents.stars[..count].to_vec(),
            names: names[..name_count].to_vec(),
        };
        let checksum = compact::checksum_of(&compact::encode(&contents));
        Self { contents, checksum }
    }
}

/// The catalogue in the file or directory `path`, as [`Catalog::read`] has it, and what it was made from.
///
/// # Errors
/// As for [`Catalog::read`].
pub fn read(path: &Path) -> Result<Reading, CatalogError> {
    source::read(path)
}

/// Reads a source catalogue, one that is not compact, and says what became of each record.
///
/// # Errors
/// As for [`Catalog::read`]; [`CatalogError::UnknownKind`] also for a compact catalogue, which holds no records.
pub fn import(path: &Path) -> Result<Reading, CatalogError> {
    let reading = read(path)?;
    if reading.files.is_empty() {
        return Err(CatalogError::UnknownKind {
            path: path.to_owned(),
            found: "the mark of a compact catalog, which is imported already".to_owned(),
            expected: source::KINDS_IMPORTED,
        });
    }
    Ok(reading)
}

fn check_range(star: &Star) -> Result<(), CatalogError> {
    let check = |quantity, value: f32, limit: f32, expected| {
        // Written so that NaN is out of range.
        if value.abs() <= limit {
            return Ok(());
        }
        Err(CatalogError::OutOfRange {
            id: star.id,
            quantity,
            value: f64::from(value),
            expected,
        })
    };
    let motion = "at most 32767 mas a year either way";
    check("V", star.v_mag, MAG_LIMIT, "-32 to 32 mag")?;
    check(
        "B-V",
        star.bv_mag.unwrap_or(0.0),
        MAG_LIMIT,
        "-32 to 32 mag",
    )?;
    check(
        "proper motion in RA",
        star.pm_ra_mas_per_yr,
        PM_LIMIT_MAS_PER_YR,
        motion,
    )?;
    check(
        "proper motion in Dec",
        star.pm_dec_mas_per_yr,
        PM_LIMIT_MAS_PER_YR,
        motion,
    )?;
    let length = star.direction.as_vector().norm() as f32;
    check(
        "the direction's length less 1",
        length - 1.0,
        1e-6,
        "0, within 1e-6",
    )
}

/// The names by index of the star; also sees that no two stars have one number.
fn resolve_names(
    stars: &[Star],
    mut names: Vec<(StarId, String)>,
) -> Result<Vec<Name>, CatalogError> {
    let mut by_id: Vec<(StarId, u32)> = stars.iter().map(|star| star.id).zip(0..).collect();
    by_id.sort_unstable();
    if let Some(pair) = by_id.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        return Err(CatalogError::DuplicateStar { id: pair[0].0 });
    }
    names.sort_unstable();
    let mut resolved = Vec::with_capacity(names.len());
    let mut previous = None;
    for (id, name) in names {
        let bad = |name: String, expected| Err(CatalogError::BadName { id, name, expected });
        let Ok(position) = by_id.binary_search_by_key(&id, |entry| entry.0) else {
            return bad(name, "the name of a star in the catalog");
        };
        if previous.replace(id) == Some(id) {
            return bad(name, "one name for a star");
        }
        if name.is_empty() || name.len() > NAME_BYTES_MAX {
            return bad(name, "a name of 1 to 255 bytes");
        }
        resolved.push(Name {
            star_index: by_id[position].1,
            text: name.into(),
        });
    }
    resolved.sort_unstable_by_key(|name| name.star_index);
    Ok(resolved)
}

/// Writes `bytes` into a temporary file beside `path`, and then gives it that name.
fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), CatalogError> {
    let write = || -> io::Result<()> {
        let mut file = files::beside(path)?;
        file.write_all(bytes)?;
        file.as_file().sync_all()?;
        file.persist(path).map_err(|refused| refused.error)?;
        Ok(())
    };
    write().map_err(|source| CatalogError::Write {
        path: path.to_owned(),
        source,
    })
}
