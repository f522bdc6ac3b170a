//! A star catalogue in memory.

use super::contents::Contents;
use super::star::J2000_YEAR;
use super::{
    CatalogError, CompactError, Star, StarId, StarIndex, StarNumbers, bayer, compact, proper_names,
};
use crate::base::files;
use std::path::Path;

/// A star catalogue: stars, brightest first, and their names.
///
/// ```
/// use starpipe::catalog::{Catalog, StarIndex};
///
/// let catalog = Catalog::built_in();
/// let to_naked_eye = &catalog.stars()[..catalog.brighter_than(6.0)];
/// assert_eq!(to_naked_eye.len(), 5008);
/// let sirius = StarIndex::new(0);
/// assert_eq!(catalog.designation(sirius), "SKYMAP 06450045");
/// assert_eq!(catalog.name_of(sirius), Some("9 alp CMa"));
/// assert_eq!(catalog.proper_name(sirius), Some("Sirius"));
/// assert_eq!(catalog.numbers_of(sirius).hd, Some(48_915));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Catalog {
    contents: Contents,
    checksum: u64,
    v_sigma_mag: f64,
}

impl Catalog {
    /// SKY2000 version 5 revision 4, embedded in the program; decoded at the first call. Needs the
    /// feature `built-in-catalog`.
    #[cfg(any(feature = "built-in-catalog", test))]
    pub fn built_in() -> &'static Self {
        static BUILT_IN: std::sync::OnceLock<Catalog> = std::sync::OnceLock::new();
        BUILT_IN.get_or_init(|| {
            Self::from_compact(include_bytes!("../../catalogs/sky2000.bin"))
                .expect("tests/it/catalog.rs checks the embedded catalog")
        })
    }

    /// The catalogue of `stars`, in any order, with names for some of them.
    ///
    /// # Errors
    /// [`CatalogError::OutOfRange`], [`CatalogError::DuplicateStar`] or [`CatalogError::BadName`]
    /// for what the compact form cannot hold: |V| or |B−V| above 32 mag, a proper motion above
    /// 32.767″ a year, two stars with one identifier, a name without a star, above 255 bytes, or a
    /// second one for a star.
    pub fn new(
        title: impl Into<String>,
        stars: Vec<Star>,
        names: Vec<(StarId, String)>,
    ) -> Result<Self, CatalogError> {
        let contents = Contents::new(title.into(), J2000_YEAR, stars, names)?;
        Ok(Self::from_contents(contents))
    }

    fn from_contents(contents: Contents) -> Self {
        let checksum = compact::checksum_of(&compact::encode(&contents));
        Self {
            contents,
            checksum,
            v_sigma_mag: 0.0,
        }
    }

    /// Decodes the compact form.
    ///
    /// # Errors
    /// [`CompactError`] if the bytes are damaged, truncated, or of another version.
    pub fn from_compact(bytes: &[u8]) -> Result<Self, CompactError> {
        Ok(Self {
            contents: compact::decode(bytes)?,
            checksum: compact::checksum_of(bytes),
            v_sigma_mag: 0.0,
        })
    }

    /// The compact form, in which proper motions are rounded to 1 mas a year.
    pub fn to_compact(&self) -> Vec<u8> {
        compact::encode(&self.contents)
    }

    /// Writes the compact form to `path`, atomically.
    ///
    /// # Errors
    /// [`CatalogError::Write`] if the folder is not writable.
    pub fn write_compact(&self, path: &Path) -> Result<(), CatalogError> {
        files::write(path, &self.to_compact()).map_err(CatalogError::write(path))
    }

    /// The same, where the V magnitudes of all stars may be off together by this.
    #[must_use]
    pub(crate) fn with_v_sigma_mag(self, v_sigma_mag: f64) -> Self {
        Self {
            v_sigma_mag,
            ..self
        }
    }

    /// By how much the V magnitudes of all stars may be off together, where they are derived from another band.
    pub(crate) const fn v_sigma_mag(&self) -> f64 {
        self.v_sigma_mag
    }

    /// The title of the catalogue, for people.
    pub fn title(&self) -> &str {
        &self.contents.title
    }

    /// The epoch of the positions, as a Julian year.
    pub fn epoch_year(&self) -> f64 {
        self.contents.epoch_year
    }

    /// The stars, brightest first, ties by identifier.
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

    /// The number of stars brighter than `v_mag` (Johnson V), which come first in
    /// [`stars`](Self::stars).
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

    /// The proper name of a bright star, as in `"Polaris"`, if the International Astronomical Union
    /// has approved one. Stars are known by their Skymap or Hipparcos number.
    ///
    /// # Panics
    /// If there is no such star.
    pub fn proper_name(&self, star: StarIndex) -> Option<&'static str> {
        proper_names::find(self.star(star).id)
    }

    /// All names of a star, the proper one first: `"Polaris (1 alp UMi)"`.
    ///
    /// # Panics
    /// If there is no such star.
    pub fn full_name(&self, star: StarIndex) -> Option<String> {
        match (self.proper_name(star), self.name_of(star)) {
            (Some(proper), Some(name)) if proper != name => Some(format!("{proper} ({name})")),
            (proper, name) => proper.or(name).map(str::to_owned),
        }
    }

    /// The name of a star in a picture: its proper name, else its Bayer letter in Greek or its Flamsteed
    /// number, as in `Rigel`, `α CMi` and `24 Tau`.
    pub(crate) fn short_name(&self, star: StarIndex) -> Option<String> {
        let proper = self.proper_name(star).map(str::to_owned);
        proper.or_else(|| self.name_of(star).map(bayer::short))
    }

    /// What a star is called in a picture: its short name, else its HD number, its Hipparcos number, or its
    /// designation.
    pub(crate) fn label(&self, star: StarIndex) -> String {
        let numbers = self.numbers_of(star);
        let hd = || numbers.hd.map(|number| format!("HD {number}"));
        let hip = || numbers.hip.map(|number| format!("HIP {number}"));
        let name = self.short_name(star).or_else(hd).or_else(hip);
        name.unwrap_or_else(|| self.designation(star))
    }

    /// The catalogue's own designation of a star: `SKYMAP nnnnnnnn`, `TYC a-b-c`, `HIP n`,
    /// `GAIA n`, `ID n`, or a name.
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

    /// The numbers of a star in other catalogues. Stars are known by their Skymap or Hipparcos number.
    ///
    /// # Panics
    /// If there is no such star.
    pub fn numbers_of(&self, star: StarIndex) -> StarNumbers {
        StarNumbers::find(self.star(star).id)
    }

    /// The index of the star `id`; a linear search.
    pub fn find(&self, id: StarId) -> Option<StarIndex> {
        let position = self.stars().iter().position(|star| star.id == id);
        position.map(StarIndex::new)
    }

    /// A checksum of the compact form, which identifies the catalogue to derived data.
    pub fn checksum(&self) -> u64 {
        self.checksum
    }

    /// The catalogue of the stars brighter than `v_mag` (Johnson V).
    #[must_use]
    pub fn limited_to(&self, v_mag: f64) -> Self {
        let count = self.brighter_than(v_mag);
        let names = &self.contents.names;
        let name_count = names.partition_point(|name| (name.star_index as usize) < count);
        Self::from_contents(Contents {
            title: format!("{}, V < {v_mag}", self.contents.title),
            epoch_year: self.contents.epoch_year,
            stars: self.contents.stars[..count].to_vec(),
            names: names[..name_count].to_vec(),
        })
    }
}
