//! Deep catalogues, and the indexes of their stars.

use super::around::merged;
use super::plan::{Attempt, Part, Sweep};
use crate::base::interrupt::Interrupt;
use crate::base::units::{DEG_PER_RAD, RAD_PER_DEG};
use crate::catalog::deep::{DeepCatalog, DeepContents, Region, SkyZone};
use crate::catalog::{Catalog, CatalogError};
use crate::identify::{IndexedCatalog, MIN_STARS, SearchedPart};
use crate::solve::limits::FrameLimits;
use std::collections::HashMap;
use std::fmt;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

/// Version of the stars in the cache: it changes with what is read of catalogues, and with how stars are chosen.
const STARS_VERSION: u32 = 2;

/// To index fewer costs nothing to speak of.
const TOLD_STARS: f64 = 200_000.0;

/// How far an index of the whole sky, or of a part, is built.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum DeepProgress {
    /// The work begins: what it costs.
    Begins(IndexingWork),
    /// This share of a part is done.
    Share(f64),
    /// A part is done.
    Done,
}

/// What an index costs that is built when a frame first needs it, and kept. `Display` says so.
#[derive(Debug, Clone, PartialEq)]
pub struct IndexingWork {
    /// The catalogue.
    pub catalog: String,
    /// Stars that are indexed.
    pub stars: f64,
    /// The narrowest and the widest field, in radians.
    pub fov_range_rad: [f64; 2],
    /// Where it is kept; `None` where it is not.
    pub cache_directory: Option<PathBuf>,
}

impl fmt::Display for IndexingWork {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        /// On two cores, from a fast disk.
        const STARS_PER_MINUTE: f64 = 5e6;
        const BYTES_PER_STAR: f64 = 120.0;
        let [low_deg, high_deg] = self.fov_range_rad.map(|rad| rad * DEG_PER_RAD);
        let minutes = (self.stars / STARS_PER_MINUTE).ceil();
        write!(
            f,
            "indexing {:.1} million stars of {} for fields of {low_deg:.2}° to {high_deg:.2}°: about {minutes} minute{}",
            self.stars / 1e6,
            self.catalog,
            if minutes > 1.0 { "s" } else { "" },
        )?;
        match &self.cache_directory {
            Some(directory) => write!(
                f,
                " once, and {:.1} GB in {}",
                self.stars * BYTES_PER_STAR / 1e9,
                directory.display()
            ),
            None => f.write_str(" in each run: there is no directory to keep the index in"),
        }
    }
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
    /// The indexes of the whole sky that were needed so far, and the last of a part of it.
    swept: Mutex<Swept>,
    errors: Mutex<Vec<CatalogError>>,
}

/// Where the catalogues are from.
enum Source {
    Given(Mutex<Vec<DeepCatalog>>),
    Installed(Vec<PathBuf>),
}

/// The stars of an attempt, or of what is around an answer.
pub type Indexed = Arc<IndexedCatalog<'static>>;

/// Indexes of catalogues, by the catalogue's number and the density of the stars.
#[derive(Default)]
struct Swept {
    whole: HashMap<(usize, u64), Indexed>,
    /// All parts would take too much memory.
    part: Option<((usize, u64, SkyZone), Indexed)>,
    /// Of which the cost was told.
    told: Vec<(usize, u64)>,
}

impl Swept {
    fn get(&self, number: usize, sweep: &Sweep) -> Option<Indexed> {
        let density = sweep.per_sq_deg.to_bits();
        match (sweep.zone, &self.part) {
            (None, _) => self.whole.get(&(number, density)).cloned(),
            (Some(zone), Some((key, indexed))) if *key == (number, density, zone) => {
                Some(indexed.clone())
            }
            (Some(_), _) => None,
        }
    }

    fn put(&mut self, number: usize, sweep: &Sweep, indexed: Indexed) {
        let density = sweep.per_sq_deg.to_bits();
        match sweep.zone {
            None => {
                self.whole.insert((number, density), indexed);
            }
            Some(zone) => self.part = Some(((number, density, zone), indexed)),
        }
    }
}

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
            swept: Mutex::default(),
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

    /// The stars of an attempt in a catalogue, indexed; `None` where they cannot be had.
    pub(super) fn indexed(
        &self,
        number: usize,
        attempt: &Attempt,
        limits: &FrameLimits,
    ) -> Option<Indexed> {
        match attempt.part {
            Part::Near(region, _) => {
                let interrupt = &limits.of_frame;
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
            Part::Sweep(sweep) => limits
                .paused
                .during(|| self.swept(number, sweep, attempt.fov_range_rad, &limits.of_all)),
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
        let catalog = self.kept(merged)?;
        let catalog = Arc::new(catalog.with_v_sigma_mag(contents.band.v_sigma_mag()));
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

    /// The index of the whole sky or of a part, made when it is first needed.
    fn swept(
        &self,
        number: usize,
        sweep: Sweep,
        fov_range_rad: [f64; 2],
        interrupt: &Interrupt,
    ) -> Option<Indexed> {
        let mut swept = self.swept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = swept.get(number, &sweep) {
            return Some(known);
        }
        let key = (number, sweep.per_sq_deg.to_bits());
        let is_told = swept.told.contains(&key);
        let making = Making {
            number,
            sweep,
            fov_range_rad,
            interrupt,
        };
        // On a thread of its own: one of a pool that waits for parts of its work may begin another frame, which
        // would wait for this lock.
        let made = std::thread::scope(|scope| {
            let making = scope.spawn(|| self.make(&making, is_told));
            making.join().ok().flatten()
        });
        let (made, tells) = made?;
        if tells {
            swept.told.push(key);
        }
        swept.put(number, &sweep, made.clone());
        Some(made)
    }

    /// Makes an index, or reads it from the cache. Also returns whether its cost was told.
    fn make(&self, making: &Making, is_told: bool) -> Option<(Indexed, bool)> {
        let tell = |progress: DeepProgress| {
            if let Some(on_progress) = &self.on_progress {
                on_progress(progress);
            }
        };
        let path = self.path_of_stars(making);
        let kept = path.as_deref().and_then(|path| Catalog::read(path).ok());
        let tells = kept.is_none() && !is_told && making.sweep.stars > TOLD_STARS;
        let catalog = match kept {
            Some(kept) => kept,
            None => {
                if tells {
                    tell(DeepProgress::Begins(self.work(making)));
                }
                self.stars_of(making, path)?
            }
        };
        if catalog.stars().len() < MIN_STARS {
            return None;
        }
        let area_sq_deg = Region::WHOLE_SKY.area_sq_deg();
        let zones = f64::from(making.sweep.zone.map_or(1, |_| SkyZone::COUNT));
        let part = SearchedPart {
            area_sq_deg: area_sq_deg / zones,
            fov_range_rad: making.fov_range_rad,
        };
        let made = IndexedCatalog::of_part(
            Arc::new(catalog),
            part,
            self.cache_directory.as_deref(),
            &|share| tell(DeepProgress::Share(share)),
            making.interrupt,
        );
        tell(DeepProgress::Done);
        Some((Arc::new(made.ok()?), tells))
    }

    fn work(&self, making: &Making) -> IndexingWork {
        IndexingWork {
            catalog: self.title(making.number),
            stars: making.sweep.stars,
            fov_range_rad: making.fov_range_rad,
            cache_directory: self.cache_directory.clone(),
        }
    }

    /// The file of the cache for the stars: to choose them takes longer than to read them.
    fn path_of_stars(&self, making: &Making) -> Option<PathBuf> {
        let directory = self.cache_directory.as_ref()?;
        let fingerprint = self.catalogs()[making.number].0.fingerprint();
        let density = making.sweep.per_sq_deg.round();
        let zone = making
            .sweep
            .zone
            .map(|zone| format!("-{:02}", zone.number()));
        let zone = zone.unwrap_or_default();
        let name = format!("stars-{fingerprint:016x}-{density}{zone}-v{STARS_VERSION}.cat");
        Some(directory.join(name))
    }

    /// Chooses the stars, and keeps them in a file.
    fn stars_of(&self, making: &Making, path: Option<PathBuf>) -> Option<Catalog> {
        /// Fields that reach beyond a part have their stars in it.
        const MARGIN_RAD: f64 = 0.5 * RAD_PER_DEG;
        let (number, per_sq_deg) = (making.number, making.sweep.per_sq_deg);
        let deep = &self.catalogs()[number].0;
        let region = match making.sweep.zone {
            None => Region {
                per_sq_deg,
                ..Region::WHOLE_SKY
            },
            Some(zone) => Region {
                centre: zone.centre(),
                radius_rad: SkyZone::RADIUS_RAD + MARGIN_RAD,
                per_sq_deg,
            },
        };
        let mut stars = self.kept(deep.stars_in(region, making.interrupt))?;
        if let Some(zone) = making.sweep.zone {
            stars.retain(|star| zone.contains(&star.direction, MARGIN_RAD));
        }
        let catalog = self.kept(Catalog::new(self.title(number), stars, Vec::new()))?;
        if let Some(path) = path {
            // Without it the next process takes longer. The index beside it tells why it cannot be kept.
            let _ = path.parent().map(std::fs::create_dir_all);
            let _ = catalog.write_compact(&path);
        }
        Some(catalog)
    }
}

/// An index that is to be made.
struct Making<'a> {
    /// The catalogue.
    number: usize,
    sweep: Sweep,
    fov_range_rad: [f64; 2],
    interrupt: &'a Interrupt,
}
