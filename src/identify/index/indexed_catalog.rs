//! A catalog prepared for identification: its stars by position and the triangles they form.

use super::cache::{self, CacheError};
use super::cache_directory::cache_directory;
use super::listing::{FIELD_TO_SMALLEST, class_limits_rad, classes_of_fields_rad};
use super::packed_vectors::PackedVectors;
use super::table::{CHUNKS, Triangle, TriangleRange};
use super::triangle_index::TriangleIndex;
use crate::base::interrupt::{Interrupt, Interrupted};
use crate::base::units::{RAD_PER_DEG, WHOLE_SKY_SQ_DEG};
use crate::catalog::sky_grid::SkyGrid;
use crate::catalog::{Catalog, Star};
use std::path::Path;
use std::sync::Arc;
use xxhash_rust::xxh3::xxh3_64_with_seed;

/// Wider lenses are no pinholes any more.
const WIDEST_FOV_DEG: f64 = 80.0;

/// A catalog with the index that identification searches.
///
/// The index depends on the catalog alone. For the built-in catalog, building it takes 8 s of
/// processor time in programs that are built without optimization, and much less in others; the
/// file in the cache has 40 MB.
///
/// # Example
/// ```
/// use starpipe::{Catalog, IndexedCatalog};
///
/// // Fewer stars are indexed sooner, and do for wide fields only.
/// let catalog = Catalog::built_in().limited_to(6.0);
/// let progress = |share: f64| assert!((0.0..=1.0).contains(&share));
/// let indexed = IndexedCatalog::build(&catalog, &progress);
/// assert_eq!(indexed.stars().len(), catalog.brighter_than(6.0));
///
/// // Kept in a directory, it is read from there the next time.
/// let directory = tempfile::tempdir()?;
/// IndexedCatalog::open(&catalog, Some(directory.path()), &progress);
/// let again = IndexedCatalog::open(&catalog, Some(directory.path()), &|_| unreachable!());
/// assert!(again.take_cache_errors().is_empty());
/// # Ok::<(), std::io::Error>(())
/// ```
pub struct IndexedCatalog<'a> {
    catalog: Held<'a>,
    /// The stars by position.
    pub grid: SkyGrid,
    /// The triangles.
    pub triangles: TriangleIndex,
    /// The directions of the stars, for triangles.
    pub(in crate::identify) vectors: PackedVectors,
    counts: MagnitudeCounts,
    /// Area of the sky that the catalog covers.
    area_sq_deg: f64,
}

/// The catalog that is indexed.
enum Held<'a> {
    Borrowed(&'a Catalog),
    Shared(Arc<Catalog>),
}

impl Held<'_> {
    fn get(&self) -> &Catalog {
        match self {
            Self::Borrowed(catalog) => catalog,
            Self::Shared(catalog) => catalog,
        }
    }
}

/// What of a catalog is indexed, and for which fields.
struct Scope {
    /// Names the index among others.
    key: u64,
    /// Smallest and largest longest side of each class of triangles.
    limits_rad: Vec<[f64; 2]>,
    /// Area of the sky that the catalog covers.
    area_sq_deg: f64,
}

impl Scope {
    /// A catalog of the whole sky, for all fields.
    fn whole(catalog: &Catalog) -> Self {
        Self {
            key: catalog.checksum(),
            limits_rad: class_limits_rad(catalog.stars().len()),
            area_sq_deg: WHOLE_SKY_SQ_DEG,
        }
    }
}

/// A part of the sky, and the fields that are searched there.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SearchedPart {
    /// Its area.
    pub area_sq_deg: f64,
    /// The narrowest and the widest field, in radians.
    pub fov_range_rad: [f64; 2],
}

impl IndexedCatalog<'static> {
    /// Indexes a catalog of a part of the sky. With a directory the index is kept there.
    ///
    /// # Errors
    /// [`Interrupted`] when `interrupt` is due.
    pub(crate) fn of_part(
        catalog: Arc<Catalog>,
        part: SearchedPart,
        cache_directory: Option<&Path>,
        progress: &(dyn Fn(f64) + Sync),
        interrupt: &Interrupt,
    ) -> Result<Self, Interrupted> {
        let [narrowest_rad, widest_rad] = part.fov_range_rad;
        let fields = [narrowest_rad.to_bits(), widest_rad.to_bits()];
        let bytes = fields.map(u64::to_le_bytes).concat();
        let scope = Scope {
            key: xxh3_64_with_seed(&bytes, catalog.checksum()),
            limits_rad: classes_of_fields_rad(part.fov_range_rad),
            area_sq_deg: part.area_sq_deg,
        };
        Self::open_scope(
            Held::Shared(catalog),
            scope,
            cache_directory,
            progress,
            interrupt,
        )
    }
}

#[cfg(any(feature = "built-in-catalog", test))]
impl IndexedCatalog<'static> {
    /// The built-in catalog, indexed as by [`new`](Self::new). Needs the feature `built-in-catalog`.
    pub fn built_in() -> Self {
        Self::new(Catalog::built_in())
    }
}

impl<'a> IndexedCatalog<'a> {
    /// Indexes `catalog`. The index is kept in the [`cache_directory`] for later processes.
    pub fn new(catalog: &'a Catalog) -> Self {
        Self::open(catalog, cache_directory().as_deref(), &|_| ())
    }

    /// Reads the index of `catalog` from a cache directory, or builds it and stores it there.
    ///
    /// Calls `progress` with the share done while it builds. A cache that cannot be used costs time
    /// only: see [`take_cache_errors`](Self::take_cache_errors). Without a directory nothing is
    /// stored.
    pub fn open(
        catalog: &'a Catalog,
        cache_directory: Option<&Path>,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Self {
        Self::open_until(catalog, cache_directory, progress, &Interrupt::default())
            .expect("nothing interrupts it")
    }

    /// As [`open`](Self::open); ends early when `interrupt` is due, and then stores nothing.
    ///
    /// # Errors
    /// [`Interrupted`].
    pub fn open_until(
        catalog: &'a Catalog,
        cache_directory: Option<&Path>,
        progress: &(dyn Fn(f64) + Sync),
        interrupt: &Interrupt,
    ) -> Result<Self, Interrupted> {
        let scope = Scope::whole(catalog);
        Self::open_scope(
            Held::Borrowed(catalog),
            scope,
            cache_directory,
            progress,
            interrupt,
        )
    }

    fn open_scope(
        catalog: Held<'a>,
        scope: Scope,
        cache_directory: Option<&Path>,
        progress: &(dyn Fn(f64) + Sync),
        interrupt: &Interrupt,
    ) -> Result<Self, Interrupted> {
        let build = |scope: &Scope| {
            let stars = catalog.get().stars();
            TriangleIndex::build(stars, scope.limits_rad.clone(), progress, interrupt)
        };
        let Some(directory) = cache_directory else {
            let triangles = build(&scope)?;
            return Ok(Self::with_index(catalog, triangles, scope.area_sq_deg));
        };
        let path = cache::index_path(directory, scope.key);
        let mut errors = Vec::new();
        let triangles = match cache::load(&path, scope.key) {
            Ok(Some((classes, file))) => TriangleIndex::new(classes, Some(file), scope.limits_rad),
            not_loaded => {
                errors.extend(not_loaded.err());
                let built = build(&scope)?;
                errors.extend(cache::store(&path, scope.key, &built.classes).err());
                built
            }
        };
        triangles.cache_errors().extend(errors);
        Ok(Self::with_index(catalog, triangles, scope.area_sq_deg))
    }

    /// Reads the index of `catalog` from bytes that [`index_bytes`](Self::index_bytes) returned.
    ///
    /// # Errors
    /// [`CacheError::Damaged`] if the bytes are not the index of this catalog.
    pub fn with_index_bytes(catalog: &'a Catalog, bytes: Vec<u8>) -> Result<Self, CacheError> {
        let Scope {
            key,
            limits_rad,
            area_sq_deg,
        } = Scope::whole(catalog);
        let (classes, file) = cache::from_bytes(bytes, key)?;
        let triangles = TriangleIndex::new(classes, Some(file), limits_rad);
        Ok(Self::with_index(
            Held::Borrowed(catalog),
            triangles,
            area_sq_deg,
        ))
    }

    /// The index as the file in a cache directory has it, for programs that keep it elsewhere.
    pub fn index_bytes(&self) -> Vec<u8> {
        for class in 0..self.triangles.classes.len() {
            for chunk in 0..CHUNKS {
                self.triangles.chunk(self.stars(), class, chunk);
            }
        }
        cache::to_bytes(self.catalog().checksum(), &self.triangles.classes)
    }

    /// The name of the index of `catalog`: it changes with the catalog and with the format.
    pub fn index_name(catalog: &Catalog) -> String {
        cache::index_name(catalog.checksum())
    }

    /// Builds the index of `catalog` without a cache; calls `progress` with the share done.
    pub fn build(catalog: &'a Catalog, progress: &(dyn Fn(f64) + Sync)) -> Self {
        Self::open(catalog, None, progress)
    }

    fn with_index(catalog: Held<'a>, mut triangles: TriangleIndex, area_sq_deg: f64) -> Self {
        let stars = catalog.get().stars();
        triangles.set_magnitudes_of(stars);
        Self {
            grid: SkyGrid::new(stars),
            triangles,
            vectors: PackedVectors::new(stars),
            counts: MagnitudeCounts::new(stars),
            area_sq_deg,
            catalog,
        }
    }

    /// Errors of the cache since the last call. Results do not depend on them: an index that could
    /// not be read was built again.
    pub fn take_cache_errors(&self) -> Vec<CacheError> {
        std::mem::take(&mut *self.triangles.cache_errors())
    }

    /// The triangles of a size class at a place.
    #[inline]
    pub(in crate::identify) fn triangles_at(
        &self,
        class: usize,
        place: &TriangleRange,
    ) -> &[Triangle] {
        let chunk = place.chunk as usize;
        place.triangles(self.triangles.chunk(self.stars(), class, chunk))
    }

    /// The narrowest and the widest horizontal field of view that can be identified, in radians.
    pub fn fov_range_rad(&self) -> [f64; 2] {
        let smallest = self
            .triangles
            .classes
            .first()
            .map_or(f64::INFINITY, |class| class.low);
        [FIELD_TO_SMALLEST * smallest, WIDEST_FOV_DEG * RAD_PER_DEG]
    }

    /// The stars of the catalog, brightest first.
    pub fn stars(&self) -> &[Star] {
        self.catalog().stars()
    }

    /// The catalog.
    pub fn catalog(&self) -> &Catalog {
        self.catalog.get()
    }

    /// V magnitude of the faintest star; 0 if there is none.
    pub fn faintest_v_mag(&self) -> f64 {
        self.stars().last().map_or(0.0, |s| f64::from(s.v_mag))
    }

    /// Probability that a star between two magnitudes lies within `radius_rad` of a random
    /// direction.
    pub fn chance_within(&self, radius_rad: f64, bright_v_mag: f64, faint_v_mag: f64) -> f64 {
        let stars =
            self.counts.brighter_than(faint_v_mag) - self.counts.brighter_than(bright_v_mag);
        // The disc's share of the sphere, as if that had everywhere as many stars.
        let whole = WHOLE_SKY_SQ_DEG / self.area_sq_deg;
        (stars * whole * radius_rad * radius_rad / 4.0).max(1e-9)
    }

    /// Mean density of its stars.
    pub(crate) fn per_sq_deg(&self) -> f64 {
        self.stars().len() as f64 / self.area_sq_deg
    }

    /// The limiting V magnitude at which the mean density of stars is `per_sq_deg`.
    pub fn magnitude_of_density(&self, per_sq_deg: f64) -> f64 {
        let rank = (per_sq_deg * self.area_sq_deg) as usize;
        match self.stars().get(rank) {
            Some(star) => f64::from(star.v_mag),
            None => self.faintest_v_mag(),
        }
    }
}

/// Cumulative star counts by V magnitude, in steps fine enough to interpolate.
struct MagnitudeCounts(Vec<f64>);

impl MagnitudeCounts {
    const BRIGHTEST_V_MAG: f64 = -2.0;
    const STEPS_PER_MAG: f64 = 4.0;
    const STEPS: usize = 100;

    fn new(stars: &[Star]) -> Self {
        let count = |step: usize| {
            let v_mag = Self::BRIGHTEST_V_MAG + step as f64 / Self::STEPS_PER_MAG;
            stars.partition_point(|s| f64::from(s.v_mag) < v_mag) as f64
        };
        Self((0..=Self::STEPS).map(count).collect())
    }

    fn brighter_than(&self, v_mag: f64) -> f64 {
        let position = (v_mag - Self::BRIGHTEST_V_MAG) * Self::STEPS_PER_MAG;
        let position = position.clamp(0.0, Self::STEPS as f64 - 1e-9);
        let step = position as usize;
        self.0[step] + (position - step as f64) * (self.0[step + 1] - self.0[step])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::coords::UnitVector;
    use crate::catalog::StarId;

    fn small_catalog() -> Catalog {
        let star = |i: u32| {
            let direction =
                UnitVector::from_ra_dec(f64::from(i * i % 97) * 0.01, f64::from(i) * 0.004);
            Star::new(StarId::Skymap(i), direction, i as f32 * 0.1)
        };
        Catalog::new("test stars", (0..60).map(star).collect(), vec![]).unwrap()
    }

    #[test]
    fn an_index_is_built_once_and_then_read() {
        let catalog = small_catalog();
        let directory = tempfile::tempdir().unwrap();
        let cache = directory.path().join("new");
        let first = IndexedCatalog::open(&catalog, Some(&cache), &|_| ());
        assert!(first.take_cache_errors().is_empty());
        let second = IndexedCatalog::open(&catalog, Some(&cache), &|_| panic!("built again"));
        assert!(second.take_cache_errors().is_empty());
        assert!(!first.triangles.is_empty());
        assert_eq!(second.triangles.len(), first.triangles.len());
    }

    #[test]
    fn a_cache_that_cannot_be_used_is_reported_and_not_fatal() {
        let catalog = small_catalog();
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("no directory");
        std::fs::write(&file, "").unwrap();
        let indexed = IndexedCatalog::open(&catalog, Some(&file), &|_| ());
        assert!(!indexed.triangles.is_empty());
        assert!(!indexed.take_cache_errors().is_empty());
        assert!(indexed.take_cache_errors().is_empty());
    }

    #[test]
    fn an_index_that_is_kept_as_bytes_is_that_of_the_file() {
        let catalog = small_catalog();
        let directory = tempfile::tempdir().unwrap();
        let built = IndexedCatalog::open(&catalog, Some(directory.path()), &|_| ());
        let name = IndexedCatalog::index_name(&catalog);
        let bytes = std::fs::read(directory.path().join(name)).unwrap();
        assert_eq!(built.index_bytes(), bytes);
        let read = IndexedCatalog::with_index_bytes(&catalog, bytes.clone()).unwrap();
        assert_eq!(read.index_bytes(), bytes);
        for damaged in [&[], &bytes[1..], &bytes[..bytes.len() - 1]] {
            assert!(IndexedCatalog::with_index_bytes(&catalog, damaged.to_vec()).is_err());
        }
        let other = catalog.limited_to(3.0);
        let error = IndexedCatalog::with_index_bytes(&other, bytes)
            .err()
            .unwrap();
        assert!(
            error.to_string().contains("in memory is damaged"),
            "{error}"
        );
    }

    /// If this fails, raise the version of the file: caches hold the earlier index.
    #[test]
    fn the_index_of_the_built_in_catalog_is_that_of_the_file_version() {
        let directory = tempfile::tempdir().unwrap();
        let catalog = Catalog::built_in();
        let indexed = IndexedCatalog::open(catalog, Some(directory.path()), &|_| ());
        let path = cache::index_path(directory.path(), catalog.checksum());
        assert!(path.ends_with("triangles-d7367f22ffaa361f-v4.bin"));
        let bytes = std::fs::read(&path).unwrap();
        let (_, triangles) = bytes.split_at(bytes.len() - 16 * indexed.triangles.len());
        assert_eq!(xxhash_rust::xxh3::xxh3_64(triangles), 0x839d_f2aa_c7b9_7300);
    }
}
