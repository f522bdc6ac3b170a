//! The triangles of a catalog by size and shape.
//!
//! Each size class is sorted by shape. It is listed from the stars, or read from a file chunk by
//! chunk, when a search first needs a chunk.
//!
//! # Reference
//! Triangle matching by two ratios: Groth 1986, AJ 91, 1244; patterns at all scales over cells of
//! the sky: Lang et al. 2010, AJ 139, 1782.

use super::cache::{CacheError, IndexFile};
use super::listing::{ListedStar, fainter_mag, list_class};
use super::table::{MAX_STARS, SizeClass, Triangle};
use crate::base::interrupt::{Interrupt, Interrupted};
use crate::catalog::Star;
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

/// All triangles, smallest class first.
#[derive(Debug)]
pub struct TriangleIndex {
    /// The size classes, in ascending order and without gaps.
    pub classes: Vec<SizeClass>,
    /// Smallest and largest longest side of each, in radians.
    limits_rad: Vec<[f64; 2]>,
    /// The file that holds the chunks that are not yet in memory.
    file: Option<IndexFile>,
    /// Classes listed again because a chunk of them could not be read.
    relisted: Vec<OnceLock<SizeClass>>,
    cache_errors: Mutex<Vec<CacheError>>,
}

impl TriangleIndex {
    /// Lists the triangles of `stars`, brightest first, in classes with these smallest and largest longest sides;
    /// calls `progress` with the share done.
    ///
    /// # Errors
    /// [`Interrupted`] when `interrupt` is due.
    pub fn build(
        stars: &[Star],
        limits_rad: Vec<[f64; 2]>,
        progress: &(dyn Fn(f64) + Sync),
        interrupt: &Interrupt,
    ) -> Result<Self, Interrupted> {
        let stars = ListedStar::all(stars);
        let mut classes = Vec::with_capacity(limits_rad.len());
        for limits in &limits_rad {
            classes.push(list_class(&stars, *limits, interrupt)?);
            progress(classes.len() as f64 / limits_rad.len() as f64);
        }
        Ok(Self::new(classes, None, limits_rad))
    }

    /// The index of `classes`, with their limits; chunks that are not in memory are read from `file`.
    pub fn new(
        classes: Vec<SizeClass>,
        file: Option<IndexFile>,
        limits_rad: Vec<[f64; 2]>,
    ) -> Self {
        Self {
            relisted: classes.iter().map(|_| OnceLock::new()).collect(),
            classes,
            limits_rad,
            file,
            cache_errors: Mutex::default(),
        }
    }

    /// The stars are these.
    pub(super) fn set_magnitudes_of(&mut self, stars: &[Star]) {
        let listed = &stars[..stars.len().min(MAX_STARS)];
        let fainter_mag = fainter_mag(listed.last().map(|star| star.v_mag));
        for class in &mut self.classes {
            class.fainter_mag = fainter_mag;
        }
    }

    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.classes.iter().map(SizeClass::len).sum()
    }

    /// Whether there is no triangle at all.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The triangles of a chunk. If it cannot be read, its class is listed again from `stars`.
    pub fn chunk(&self, stars: &[Star], class: usize, chunk: usize) -> &[Triangle] {
        self.classes[class].chunks[chunk].get_or_init(|| {
            self.read(class, chunk, stars.len())
                .unwrap_or_else(|| self.list_again(stars, class, chunk))
        })
    }

    fn read(&self, class: usize, chunk: usize, stars: usize) -> Option<Box<[Triangle]>> {
        let range = self.classes[class].range(chunk);
        match self.file.as_ref()?.chunk(class, chunk, range, stars) {
            Ok(triangles) => Some(triangles),
            Err(error) => {
                self.cache_errors().push(error);
                None
            }
        }
    }

    fn list_again(&self, stars: &[Star], class: usize, chunk: usize) -> Box<[Triangle]> {
        let relisted = self.relisted[class].get_or_init(|| {
            let stars = ListedStar::all(stars);
            list_class(&stars, self.limits_rad[class], &Interrupt::default())
                .expect("nothing interrupts it")
        });
        relisted.chunks[chunk].get().cloned().unwrap_or_default()
    }

    /// Errors of the cache that were not yet taken.
    pub(super) fn cache_errors(&self) -> MutexGuard<'_, Vec<CacheError>> {
        self.cache_errors
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::super::listing::class_limits_rad;
    use super::super::table::WantedShape;
    use super::super::triangle::TriangleShape;
    use super::*;
    use crate::base::coords::UnitVector;
    use crate::catalog::Catalog;
    use crate::identify::index::cache;
    use std::collections::HashSet;

    fn built(stars: &[Star]) -> TriangleIndex {
        let limits_rad = class_limits_rad(stars.len());
        TriangleIndex::build(stars, limits_rad, &|_| (), &Interrupt::default()).unwrap()
    }

    /// All triangles of a class.
    fn listed(class: &SizeClass) -> impl Iterator<Item = &Triangle> {
        class
            .chunks
            .iter()
            .flat_map(|chunk| chunk.get().unwrap().iter())
    }

    #[test]
    fn a_search_finds_what_going_through_all_triangles_finds() {
        let stars = &Catalog::built_in().stars()[..3000];
        let index = built(stars);
        let mut compared = 0;
        for (number, class) in index.classes.iter().enumerate() {
            for (wanted, tolerance) in [
                ([0.7, 0.5], 0.01),
                ([0.9, 0.35], 0.03),
                ([0.6, 0.55], 0.01),
                ([0.98, 0.09], 0.02),
            ] {
                let mut found = HashSet::new();
                let shape = WantedShape {
                    ratios: wanted,
                    tolerance,
                };
                let has_shape = shape.test();
                for place in class.places(&shape) {
                    let chunk = index.chunk(stars, number, place.chunk as usize);
                    let similar = place.triangles(chunk).iter().filter(|t| has_shape(t));
                    for triangle in similar {
                        assert!(found.insert(triangle.corners()), "listed twice");
                    }
                }
                let off = |corners: &[u32; 3]| {
                    let ratios = shape_of(stars, corners).ratios;
                    (ratios[0] - wanted[0]).hypot(ratios[1] - wanted[1])
                };
                // Ratios are rounded to 1/65536.
                assert!(found.iter().all(|corners| off(corners) < tolerance + 2e-5));
                for corners in listed(class).map(Triangle::corners) {
                    assert!(found.contains(&corners) || off(&corners) > tolerance - 2e-5);
                }
                compared += found.len();
            }
        }
        assert!(compared > 100, "{compared}");
    }

    fn shape_of(stars: &[Star], corners: &[u32; 3]) -> TriangleShape {
        let vectors = corners.map(|c| stars[c as usize].direction.as_vector());
        let shape = TriangleShape::new(vectors).unwrap();
        assert_eq!(shape.order, [0, 1, 2], "corners are listed as A, B, C");
        shape
    }

    #[test]
    fn the_brightest_stars_of_a_field_make_listed_triangles() {
        let stars = &Catalog::built_in().stars()[..9000];
        let index = built(stars);
        let listed = index.classes.iter().flat_map(listed);
        let listed: HashSet<[u32; 3]> = listed.map(|triangle| sorted(triangle.corners())).collect();
        for (ra_rad, dec_rad) in [(0.3, 0.2), (2.0, -1.2), (4.0, 1.5), (5.5, -0.5)] {
            let centre = UnitVector::from_ra_dec(ra_rad, dec_rad);
            let is_near = |&i: &u32| stars[i as usize].direction.angle_to(&centre) < 0.15;
            let field: Vec<u32> = (0..9000).filter(is_near).take(6).collect();
            let mut triangles = 0;
            for (i, a) in field.iter().enumerate() {
                for (j, b) in field[..i].iter().enumerate() {
                    let is_listed = |c: &&u32| listed.contains(&sorted([*a, *b, **c]));
                    triangles += field[..j].iter().filter(is_listed).count();
                }
            }
            assert!(triangles >= 3, "{triangles} at {ra_rad}, {dec_rad}");
        }
    }

    #[test]
    fn a_class_of_which_a_chunk_is_damaged_is_listed_again() {
        let stars = &Catalog::built_in().stars()[..100];
        let built = built(stars);
        let directory = tempfile::tempdir().unwrap();
        let path = cache::index_path(directory.path(), 7);
        cache::store(&path, 7, &built.classes).unwrap();
        let mut bytes = std::fs::read(&path).unwrap();
        *bytes.last_mut().unwrap() ^= 1;
        std::fs::write(&path, bytes).unwrap();
        let (classes, file) = cache::load(&path, 7).unwrap().unwrap();
        let read = TriangleIndex::new(classes, Some(file), class_limits_rad(stars.len()));
        for (number, class) in built.classes.iter().enumerate() {
            for (chunk, expected) in class.chunks.iter().enumerate() {
                let expected = &expected.get().unwrap()[..];
                assert_eq!(read.chunk(stars, number, chunk), expected);
            }
        }
        assert_eq!(read.cache_errors().len(), 1);
    }

    fn sorted(mut corners: [u32; 3]) -> [u32; 3] {
        corners.sort_unstable();
        corners
    }
}
