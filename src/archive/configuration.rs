//! All that the results of a frame depend on beside the frame.

use crate::sky::catalog::Catalog;
use serde::Serialize;
use std::fs;
use std::io;
use std::path::Path;
use xxhash_rust::xxh3::xxh3_64;

/// What is stated for all frames of an archive: results of other values are never mixed. `None` stands
/// for the default.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
#[expect(missing_docs, reason = "named as the options of `process`, with units")]
pub struct Configuration {
    pub catalog: CatalogIdentity,
    pub fov_deg: Option<f64>,
    pub pixel_scale_arcsec: Option<f64>,
    pub scale_error_percent: Option<f64>,
    pub near_deg: Option<[f64; 2]>,
    pub radius_deg: Option<f64>,
    pub date: Option<String>,
    pub site: Option<[f64; 3]>,
    pub camera: Option<FileHash>,
    pub dark: Option<FileHash>,
    pub flat: Option<FileHash>,
    pub hot_pixels: Option<FileHash>,
    pub sigma: Option<f64>,
    pub false_alarms: Option<f64>,
    pub max_stars: Option<u64>,
    pub centroid: Option<String>,
    pub exposure_s: Option<f64>,
    pub zenith_distance_deg: Option<f64>,
    pub extinction_mag: Option<f64>,
    pub name_odds: f64,
    pub attitude_only: bool,
    pub time_limit_s: Option<f64>,
    pub page: Option<String>,
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
