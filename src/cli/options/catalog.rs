//! Star catalogue, its index, and threads: what commands need that identify or simulate stars.

use super::threads::ThreadOptions;
use crate::cli::exit::CommandError;
use crate::cli::output::messages::{one_line, report_warning};
use crate::cli::progress::bar;
use clap::Args;
use indicatif::ProgressBar;
use starpipe::catalog::deep::{DeepCatalog, installed_paths};
use starpipe::catalog::{self, Catalog};
use starpipe::identify::{IndexedCatalog, cache_directory};
use starpipe::solve::{DeepProgress, DeepSky};
use std::borrow::Cow;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(next_help_heading = "Resources")]
pub(crate) struct CatalogOptions {
    /// Star catalog to use in place of the built-in one: SKY2000, Tycho-2 (a directory of its
    /// files), a table (CSV, TSV, from VizieR), or a file written by `starpipe catalog import`,
    /// which loads fastest
    #[arg(long, value_name = "PATH")]
    catalog: Option<PathBuf>,
    /// Directory in which the index of the catalog is kept [default: $STARPIPE_CACHE_DIR, else
    /// the user's cache directory]
    #[arg(long, value_name = "DIR")]
    cache_dir: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) threads: ThreadOptions,
}

impl CatalogOptions {
    /// Runs `work` with the threads and the catalogue with its index; errors of the index's cache
    /// are reported.
    pub(crate) fn with_index<R>(
        &self,
        work: impl FnOnce(&rayon::ThreadPool, &IndexedCatalog) -> Result<R, CommandError>,
    ) -> Result<R, CommandError> {
        self.with_index_reporting(true, work)
    }

    /// The same; with `tells`, progress and warnings are shown.
    pub(crate) fn with_index_reporting<R>(
        &self,
        tells: bool,
        work: impl FnOnce(&rayon::ThreadPool, &IndexedCatalog) -> Result<R, CommandError>,
    ) -> Result<R, CommandError> {
        let pool = self.threads.pool()?;
        let catalog = pool.install(|| self.read_reporting(tells))?;
        let indexed = pool.install(|| self.index(&catalog, tells));
        report_cache_errors(&indexed, tells);
        let result = work(&pool, &indexed);
        report_cache_errors(&indexed, tells);
        result
    }

    /// Reads the catalogue, or takes the built-in one.
    pub(crate) fn read(&self) -> anyhow::Result<Cow<'static, Catalog>> {
        self.read_reporting(true)
    }

    /// The deep catalogues for narrow fields: those that are stated, else those that are installed.
    pub(crate) fn deep(&self, tells: bool) -> anyhow::Result<Option<DeepSky>> {
        let cache = self.cache_dir.clone().or_else(cache_directory);
        let deep = match &self.catalog {
            Some(path) => match DeepCatalog::find(path)? {
                found if found.is_empty() => return Ok(None),
                found => DeepSky::new(found, cache),
            },
            None => match installed_paths() {
                paths if paths.is_empty() => return Ok(None),
                paths => DeepSky::installed(paths, cache),
            },
        };
        let progress = match tells {
            true => bar(100, "indexing the deep catalog {wide_bar} {percent} %"),
            false => ProgressBar::hidden(),
        };
        Ok(Some(deep.with_progress(Box::new(move |done| match done {
            DeepProgress::Share(share) => progress.set_position((share * 100.0) as u64),
            DeepProgress::Done => progress.finish_and_clear(),
            _ => {}
        }))))
    }

    fn read_reporting(&self, tells: bool) -> anyhow::Result<Cow<'static, Catalog>> {
        let stated = self.catalog.as_ref();
        let is_deep = match stated {
            Some(path) => !DeepCatalog::find(path)?.is_empty(),
            None => false,
        };
        let Some(path) = stated.filter(|_| !is_deep) else {
            return Ok(Cow::Borrowed(Catalog::built_in()));
        };
        let reading = catalog::read(path)?;
        for file in reading.files.iter().filter(|_| tells) {
            if let Some(reasons) = file.summary.left_out() {
                let (path, records) = (file.path.display(), file.summary.records);
                report_warning(format_args!(
                    "{path}: some of its {records} records are skipped: {reasons}"
                ));
            }
        }
        Ok(Cow::Owned(reading.catalog))
    }

    /// The catalogue with its index, from the cache if possible.
    fn index<'a>(&self, catalog: &'a Catalog, tells: bool) -> IndexedCatalog<'a> {
        let progress = match tells {
            true => bar(100, "indexing the catalog {wide_bar} {percent} %"),
            false => ProgressBar::hidden(),
        };
        let show = |part: f64| progress.set_position((part * 100.0) as u64);
        let directory = self.cache_dir.clone().or_else(cache_directory);
        let indexed = IndexedCatalog::open(catalog, directory.as_deref(), &show);
        progress.finish_and_clear();
        indexed
    }
}

/// Reports the errors of the cache since the last report, where warnings are shown.
fn report_cache_errors(indexed: &IndexedCatalog, tells: bool) {
    for error in indexed.take_cache_errors().into_iter().filter(|_| tells) {
        let error = one_line(&error);
        report_warning(format_args!(
            "{error}; results are unaffected, but take longer"
        ));
    }
}
