//! Deep catalogues, and the indexes of their stars.

use super::around::merged;
use super::plan::{Attempt, FIELDS_OF_SKY_RAD, MAX_STARS};
use crate::base::interrupt::Interrupt;
use crate::base::units::{RAD_PER_DEG, WHOLE_SKY_SQ_DEG};
use crate::catalog::deep::{DeepCatalog, DeepContents, Region};
use crate::catalog::{Catalog, CatalogError};
use crate::identify::{IndexedCatalog, MIN_STARS, SearchedPart};
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

/// Density of the stars of the whole sky that are indexed, where there are as many.
const PER_SQ_DEG_OF_SKY: f64 = MAX_STARS / WHOLE_SKY_SQ_DEG;

/// Version of the stars in the cache: it changes with what is read of catalogues, and with how stars are chosen.
const STARS_VERSION: u32 = 1;

/// How far the index of the whole sky is built.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum DeepProgress {
    /// So many stars are to be indexed.
    Stars(usize),
    /// This share of the work is done.
    Share(f64),
    /// It is done.
    Done,
}

/// Tells how far the index of the whole sky is built.
pub type OnProgress = Box<dyn Fn(DeepProgress) + Send + Sync>;

/// Deep catalogues for narrow fields, in the order in which they are used.
pub struct DeepSky {
    source: Source,
    /// Those of the source, once they are needed.
    catalogs: OnceLock<Vec<(DeepCatalog, DeepContents)>>,
    cache_directory: Option<PathBuf>,
    on_progress: Option<OnProgress>,
    /// The indexes of the whole sky that were needed so far, by the number of the catalogue.
    whole: Mutex<HashMap<usize, Arc<IndexedCatalog<'static>>>>,
    errors: Mutex<Vec<CatalogError>>,
}

/// Where the catalogues are from.
enum Source {
    Given(Mutex<Vec<DeepCatalog>>),
    Installed(Vec<PathBuf>),
}

/// The stars of an attempt, or of what is around an answer.
pub type Indexed = Arc<IndexedCatalog<'static>>;

impl DeepSky {
    /// These catalogues. The indexes of the whole sky are kept in a directory, if one is given.
    pub fn new(catalogs: Vec<DeepCatalog>, cache_directory: Option<PathBuf>) -> Self {
        Self::of(Source::Given(Mutex::new(catalogs)), cache_directory)
    }

    /// Those that are installed in these folders and files, which are looked at when a frame first needs them. What
    /// is damaged is left out, and told by [`take_errors`](Self::take_errors).
    pub fn installed(paths: Vec<PathBuf>, cache_directory: Option<PathBuf>) -> Self {
        Self::of(Source::Installed(paths), cache_directory)
    }

    fn of(source: Source, cache_directory: Option<PathBuf>) -> Self {
        Self {
            source,
            catalogs: OnceLock::new(),
            cache_directory,
            on_progress: None,
            whole: Mutex::default(),
            errors: Mutex::default(),
        }
    }

    /// Tells `on_progress` how far the index of the whole sky is built, whenever one is.
    #[must_use]
    pub fn with_progress(self, on_progress: OnProgress) -> Self {
        Self {
            on_progress: Some(on_progress),
            ..self
        }
    }

    /// The catalogues, the densest first, and what they have.
    pub fn catalogs(&self) -> &[(DeepCatalog, DeepContents)] {
        self.catalogs.get_or_init(|| {
            let found = match &self.source {
                Source::Given(given) => {
                    std::mem::take(&mut *given.lock().unwrap_or_else(PoisonError::into_inner))
                }
                Source::Installed(paths) => {
                    let found = paths.iter().map(|path| DeepCatalog::find_installed(path));
                    found
                        .filter_map(|found| self.kept(found))
                        .flatten()
                        .collect()
                }
            };
            let with_contents = |catalog: DeepCatalog| {
                let contents = catalog.contents();
                (catalog, contents)
            };
            let mut catalogs: Vec<_> = found.into_iter().map(with_contents).collect();
            catalogs.sort_by(|a, b| b.1.per_sq_deg().total_cmp(&a.1.per_sq_deg()));
            catalogs
        })
    }

    /// Errors of catalogues since the last call: frames were searched without them.
    pub fn take_errors(&self) -> Vec<CatalogError> {
        std::mem::take(&mut *self.errors())
    }

    fn errors(&self) -> MutexGuard<'_, Vec<CatalogError>> {
        self.errors.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The narrowest field of a catalogue, in radians.
    pub(super) fn narrowest_rad(&self, number: usize) -> f64 {
        self.catalogs()[number].1.narrowest_fov_deg() * RAD_PER_DEG
    }

    /// The stars of an attempt in a catalogue, indexed; `None` where they cannot be had.
    pub(super) fn indexed(
        &self,
        number: usize,
        attempt: &Attempt,
        interrupt: &Interrupt,
    ) -> Option<Indexed> {
        match attempt.region {
            Some(region) => {
                let stars = self.catalogs()[number].0.stars_in(region, interrupt);
                let title = self.title(number);
                let catalog = stars.and_then(|stars| Catalog::new(title, stars, Vec::new()));
                let part = SearchedPart {
                    area_sq_deg: region.area_sq_deg(),
                    fov_range_rad: attempt.fov_range_rad,
                };
                let catalog = Arc::new(self.kept(catalog)?);
                if catalog.stars().len() < MIN_STARS {
                    return None;
                }
                IndexedCatalog::of_part(catalog, part, None, &|_| (), interrupt)
                    .ok()
                    .map(Arc::new)
            }
            None => self.whole_sky(number, interrupt),
        }
    }

    /// All stars of a region, with the names of those that are in `known`.
    pub(super) fn around(
        &self,
        number: usize,
        region: Region,
        fov_rad: f64,
        known: &Catalog,
        interrupt: &Interrupt,
    ) -> Option<Indexed> {
        let (deep, contents) = &self.catalogs()[number];
        let stars = self.kept(deep.stars_in(region, interrupt))?;
        let title = format!("{} and {}", self.title(number), known.title());
        let merged = merged(title, stars, contents.epoch_year, known, &region);
        let part = SearchedPart {
            area_sq_deg: region.area_sq_deg(),
            fov_range_rad: [fov_rad * 0.97, fov_rad * 1.03],
        };
        let catalog = Arc::new(self.kept(merged)?);
        let indexed = IndexedCatalog::of_part(catalog, part, None, &|_| (), interrupt);
        indexed.ok().map(Arc::new)
    }

    fn title(&self, number: usize) -> String {
        let (catalog, contents) = &self.catalogs()[number];
        format!("{} ({})", contents.kind, catalog.path().display())
    }

    /// What was made, unless an error is in its place: that is kept to be told.
    fn kept<T>(&self, made: Result<T, CatalogError>) -> Option<T> {
        made.map_err(|error| self.errors().push(error)).ok()
    }

    /// The index of the whole sky, made when it is first needed.
    fn whole_sky(&self, number: usize, interrupt: &Interrupt) -> Option<Indexed> {
        let mut whole = self.whole.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = whole.get(&number) {
            return Some(known.clone());
        }
        // On a thread of its own: one of a pool that waits for parts of its work may begin another frame, which
        // would wait for this lock.
        let made = std::thread::scope(|scope| {
            let making = scope.spawn(|| self.make_whole_sky(number, interrupt));
            making.join().ok().flatten()
        });
        let made = Arc::new(made?);
        whole.insert(number, made.clone());
        Some(made)
    }

    /// The stars of a region, from the cache if they are there: to choose them takes longer than to read them.
    fn stars_of(&self, number: usize, region: Region, interrupt: &Interrupt) -> Option<Catalog> {
        let deep = &self.catalogs()[number].0;
        let name = format!("stars-{:016x}-v{STARS_VERSION}.cat", deep.fingerprint());
        let path = self
            .cache_directory
            .as_ref()
            .map(|directory| directory.join(name));
        if let Some(kept) = path.as_deref().and_then(|path| Catalog::read(path).ok()) {
            return Some(kept);
        }
        let stars = self.kept(deep.stars_in(region, interrupt))?;
        let catalog = self.kept(Catalog::new(self.title(number), stars, Vec::new()))?;
        if let Some(path) = path {
            // Without it the next process takes longer. The index beside it tells why it cannot be kept.
            let _ = path.parent().map(std::fs::create_dir_all);
            let _ = catalog.write_compact(&path);
        }
        Some(catalog)
    }

    fn make_whole_sky(
        &self,
        number: usize,
        interrupt: &Interrupt,
    ) -> Option<IndexedCatalog<'static>> {
        let tell = |progress: DeepProgress| {
            if let Some(on_progress) = &self.on_progress {
                on_progress(progress);
            }
        };
        let whole_sky = Region {
            per_sq_deg: PER_SQ_DEG_OF_SKY,
            ..Region::WHOLE_SKY
        };
        let catalog = self.stars_of(number, whole_sky, interrupt)?;
        tell(DeepProgress::Stars(catalog.stars().len()));
        let part = SearchedPart {
            area_sq_deg: whole_sky.area_sq_deg(),
            fov_range_rad: FIELDS_OF_SKY_RAD,
        };
        let made = IndexedCatalog::of_part(
            Arc::new(catalog),
            part,
            self.cache_directory.as_deref(),
            &|share| tell(DeepProgress::Share(share)),
            interrupt,
        );
        tell(DeepProgress::Done);
        made.ok()
    }
}
