//! The catalogue made ready for identification.

use super::cache::{self, CacheError};
use super::index::TriangleIndex;
use crate::base::units::RAD_PER_DEG;
use crate::sky::catalog::sky_grid::SkyGrid;
use crate::sky::catalog::{Catalog, Star};
use std::path::Path;

/// A field is at least so many times as wide as the smallest triangles listed: else it holds too few of them.
const FIELD_TO_SMALLEST: f64 = 3.75;
/// Wider fields are no pinhole camera's.
const WIDEST_FOV_DEG: f64 = 60.0;
/// Square degrees on the whole sky.
const WHOLE_SKY_SQ_DEG: f64 = 41_252.96;

/// The catalogue's stars by place, and the triangles that they form.
pub struct IndexedCatalog<'a> {
    catalog: &'a Catalog,
    /// The stars by place.
    pub grid: SkyGrid,
    /// The triangles.
    pub triangles: TriangleIndex,
    counts: MagnitudeCounts,
}

/// How many stars there are to each magnitude, in steps small enough to interpolate.
struct MagnitudeCounts(Vec<f64>);

impl MagnitudeCounts {
    const BRIGHTEST_V_MAG: f64 = -2.0;
    const STEPS_PER_MAG: f64 = 4.0;
    const STEPS: usize = 80;

    fn new(stars: &[Star]) -> Self {
        let count = |step: usize| {
            let v_mag = Self::BRIGHTEST_V_MAG + step as f64 / Self::STEPS_PER_MAG;
            stars.partition_point(|s| f64::from(s.v_mag) < v_mag) as f64
        };
        Self((0..=Self::STEPS).map(count).collect())
    }

    fn brighter_than(&self, v_mag: f64) -> f64 {
        let place = (v_mag - Self::BRIGHTEST_V_MAG) * Self::STEPS_PER_MAG;
        let place = place.clamp(0.0, Self::STEPS as f64 - 1e-9);
        let step = place as usize;
        self.0[step] + (place - step as f64) * (self.0[step + 1] - self.0[step])
    }
}

impl<'a> IndexedCatalog<'a> {
    /// Takes the triangles from the cache directory, or makes them (`progress` is then called with the share
    /// done) and puts them there. Also returns what went wrong with the cache, which is no reason to stop.
    pub fn open(
        catalog: &'a Catalog,
        cache_directory: &Path,
        progress: &(dyn Fn(f64) + Sync),
    ) -> (Self, Vec<CacheError>) {
        let path = cache::index_path(cache_directory, catalog.checksum());
        let mut troubles = Vec::new();
        let cached = cache::load(&path, catalog.checksum()).unwrap_or_else(|trouble| {
            troubles.push(trouble);
            None
        });
        let sky = match cached {
            Some((classes, file)) => Self::new(catalog, TriangleIndex::new(classes, Some(file))),
            None => {
                let sky = Self::build(catalog, progress);
                troubles
                    .extend(cache::store(&path, catalog.checksum(), &sky.triangles.classes).err());
                sky
            }
        };
        (sky, troubles)
    }

    fn new(catalog: &'a Catalog, triangles: TriangleIndex) -> Self {
        Self {
            catalog,
            grid: SkyGrid::new(catalog.stars()),
            triangles,
            counts: MagnitudeCounts::new(catalog.stars()),
        }
    }

    /// Makes everything anew.
    pub fn build(catalog: &'a Catalog, progress: &(dyn Fn(f64) + Sync)) -> Self {
        Self::new(catalog, TriangleIndex::build(catalog.stars(), progress))
    }

    /// Calls `visit` with the corners of every triangle of a size class whose ratios lie within a tolerance of those given, in
    /// an order that depends on nothing but the arguments.
    #[inline]
    pub(super) fn for_each_similar(
        &self,
        similar: (usize, [f64; 2], f64),
        visit: impl FnMut(&[u32; 3]),
    ) {
        self.triangles
            .for_each_similar(self.stars(), similar, visit);
    }

    /// What went wrong with the cache since [`Self::open`], or since it was last asked: no reason to stop, since what could not be read was
    /// made anew.
    pub fn take_troubles(&self) -> Vec<CacheError> {
        self.triangles.take_read_errors()
    }

    /// The narrowest and the widest horizontal field of view in which the triangles listed are found, in radians.
    pub fn fov_range_rad(&self) -> (f64, f64) {
        let smallest = self
            .triangles
            .classes
            .first()
            .map_or(f64::INFINITY, |c| c.low);
        (FIELD_TO_SMALLEST * smallest, WIDEST_FOV_DEG * RAD_PER_DEG)
    }

    /// The catalogue's stars, brightest first.
    pub fn stars(&self) -> &'a [Star] {
        self.catalog.stars()
    }

    /// The catalogue.
    pub fn catalog(&self) -> &'a Catalog {
        self.catalog
    }

    /// The V magnitude of the faintest star; 0 if there is none.
    pub fn faintest_v_mag(&self) -> f64 {
        self.stars().last().map_or(0.0, |s| f64::from(s.v_mag))
    }

    /// The probability that one of the catalogue's stars between two magnitudes stands within `radius_rad` of a direction
    /// taken at random.
    pub fn chance_within(&self, radius_rad: f64, bright_v_mag: f64, faint_v_mag: f64) -> f64 {
        let stars =
            self.counts.brighter_than(faint_v_mag) - self.counts.brighter_than(bright_v_mag);
        // The disc's share of the sphere.
        (stars * radius_rad * radius_rad / 4.0).max(1e-9)
    }

    /// The limiting magnitude to which there are, on average, so many stars on a square degree.
    pub fn magnitude_of_density(&self, per_sq_deg: f64) -> f64 {
        let rank = (per_sq_deg * WHOLE_SKY_SQ_DEG) as usize;
        match self.stars().get(rank) {
            Some(star) => f64::from(star.v_mag),
            None => self.faintest_v_mag(),
        }
    }
}
