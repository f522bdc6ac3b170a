//! The catalogue made ready for identification.

use super::cache::{self, CacheError};
use super::index::TriangleIndex;
use crate::catalog::Star;
use crate::catalog::sky_grid::SkyGrid;
use std::path::Path;

/// Square degrees on the whole sky.
const WHOLE_SKY_SQ_DEG: f64 = 41_252.96;

/// The catalogue's stars by place, and the triangles that they form.
pub struct Sky<'a> {
    stars: &'a [Star],
    /// The stars by place.
    pub grid: SkyGrid,
    /// The triangles.
    pub triangles: TriangleIndex,
}

impl<'a> Sky<'a> {
    /// Takes the triangles from the cache directory, or makes them (`progress` is then called with the share
    /// done) and puts them there. Also returns what went wrong with the cache, which is no reason to stop.
    pub fn open(
        stars: &'a [Star],
        catalog_checksum: u64,
        cache_directory: &Path,
        progress: &(dyn Fn(f64) + Sync),
    ) -> (Self, Vec<CacheError>) {
        let path = cache::index_path(cache_directory, catalog_checksum);
        let mut troubles = Vec::new();
        let cached = cache::load(&path, catalog_checksum).unwrap_or_else(|trouble| {
            troubles.push(trouble);
            None
        });
        let sky = match cached {
            Some(triangles) => Self {
                stars,
                grid: SkyGrid::new(stars),
                triangles,
            },
            None => {
                let sky = Self::build(stars, progress);
                troubles.extend(cache::store(&path, catalog_checksum, &sky.triangles).err());
                sky
            }
        };
        (sky, troubles)
    }

    /// Makes everything anew.
    pub fn build(stars: &'a [Star], progress: &(dyn Fn(f64) + Sync)) -> Self {
        let grid = SkyGrid::new(stars);
        let triangles = TriangleIndex::build(stars, &grid, progress);
        Self {
            stars,
            grid,
            triangles,
        }
    }

    /// The catalogue's stars, brightest first.
    pub fn stars(&self) -> &'a [Star] {
        self.stars
    }

    /// The V magnitude of the faintest star; 0 if there is none.
    pub fn faintest_v_mag(&self) -> f64 {
        self.stars.last().map_or(0.0, |s| f64::from(s.v_mag))
    }

    /// The limiting magnitude to which there are, on average, so many stars on a square degree.
    pub fn magnitude_of_density(&self, per_sq_deg: f64) -> f64 {
        let rank = (per_sq_deg * WHOLE_SKY_SQ_DEG) as usize;
        match self.stars.get(rank) {
            Some(star) => f64::from(star.v_mag),
            None => self.faintest_v_mag(),
        }
    }
}
