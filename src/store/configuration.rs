//! All that the results of a frame depend on beside the frame.

use crate::catalog::Catalog;
use crate::solve::SolveOptions;
use serde::Serialize;
use std::path::Path;
use std::{fmt, fs, io};
use xxhash_rust::xxh3::xxh3_64;

/// What the frames of an archive are solved with: results of other values are never mixed.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
#[expect(missing_docs, reason = "named as the options of `process`")]
pub struct Configuration {
    pub catalog: CatalogIdentity,
    #[serde(flatten)]
    pub options: SolveOptions,
    pub camera: Option<FileHash>,
    pub dark: Option<FileHash>,
    pub flat: Option<FileHash>,
    pub hot_pixels: Option<FileHash>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mask: Option<FileHash>,
    pub page: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub night: Option<NightConfiguration>,
}

/// What the rows of a night depend on besides.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
#[expect(missing_docs, reason = "named as the options of `night`")]
pub struct NightConfiguration {
    pub mask_hot_pixels: bool,
}

/// Which catalogue was used.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct CatalogIdentity {
    title: String,
    stars: usize,
    checksum: String,
}

impl From<&Catalog> for CatalogIdentity {
    fn from(catalog: &Catalog) -> Self {
        Self {
            title: catalog.title().to_owned(),
            stars: catalog.stars().len(),
            checksum: format!("{:016x}", catalog.checksum()),
        }
    }
}

/// The hash of a file's content.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(transparent)]
pub struct FileHash(String);

impl fmt::Display for FileHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl FileHash {
    /// The hash of a content.
    pub fn of(content: &[u8]) -> Self {
        Self(format!("{:016x}", xxh3_64(content)))
    }

    /// The hash of what is in a file.
    ///
    /// # Errors
    /// I/O errors.
    pub fn of_file(path: &Path) -> io::Result<Self> {
        Ok(Self::of(&fs::read(path)?))
    }
}
