//! Star catalogue, its index, and threads: what commands need that identify or simulate stars.

use super::threads::ThreadOptions;
use crate::cli::exit::CommandError;
use crate::cli::output::messages::{one_line, report, report_warning};
use crate::cli::progress::bar;
use anyhow::bail;
use clap::Args;
use indicatif::ProgressBar;
use starpipe::catalog::deep::{DeepCatalog, installed_paths};
use starpipe::catalog::{self, Catalog, SourceFile};
use starpipe::identify::{IndexedCatalog, cache_directory};
use starpipe::solve::{DeepProgress, DeepSky, OnProgress};
use std::borrow::Cow;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(next_help_heading = "Resources")]
pub(crate) struct CatalogOptions {
    /// Star catalog to use in place of the built-in one: SKY2000, Tycho-2 (a directory of its
    /// files), a table (CSV, TSV, VOTable), or a file written by `starpipe catalog import`, which loads
    /// fastest. Or one to use beside it for narrow fields: files of astrometry.net or ASTAP, or tables of
    /// Gaia (CSV, VOTable, Parquet, HATS)
    #[arg(long, value_name = "PATH")]
    catalog: Option<PathBuf>,
    /// Directory in which the index of the catalog is kept [default: $STARPIPE_CACHE_DIR, else
    /// the user's cache directory]
    #[arg(long, value_name = "DIR")]
    cache_dir: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) threads: ThreadOptions,
}

/// What `--catalog` and this computer have.
struct Opened {
    /// The catalogue of all frames.
    catalog: Cow<'static, Catalog>,
    /// The deep ones that `--catalog` names.
    deep: Vec<DeepCatalog>,
}

impl CatalogOptions {
    /// The catalogue at `path`, unless another is stated.
    pub(crate) fn set_if_none(&mut self, path: PathBuf) {
        self.catalog.get_or_insert(path);
    }

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
        self.index_and_run((&pool, tells), &catalog, work)
    }

    /// The same, with the deep catalogues for narrow fields: those that are stated, else those that are
    /// installed.
    pub(crate) fn with_deep<R>(
        &self,
        tells: bool,
        work: impl FnOnce(
            &rayon::ThreadPool,
            &IndexedCatalog,
            Option<&DeepSky>,
        ) -> Result<R, CommandError>,
    ) -> Result<R, CommandError> {
        let pool = self.threads.pool()?;
        let opened = pool.install(|| self.opened(tells))?;
        let deep = self.deep(opened.deep, tells);
        let result = self.index_and_run((&pool, tells), &opened.catalog, |pool, indexed| {
            work(pool, indexed, deep.as_ref())
        });
        for error in deep.iter().flat_map(DeepSky::take_errors).filter(|_| tells) {
            report_warning(format_args!("{}; it was not used", one_line(&error)));
        }
        result
    }

    /// Reads the catalogue, or takes the built-in one.
    pub(crate) fn read(&self) -> anyhow::Result<Cow<'static, Catalog>> {
        self.read_reporting(true)
    }

    /// Reads the catalogue, which must be one that is held in memory.
    fn read_reporting(&self, tells: bool) -> anyhow::Result<Cow<'static, Catalog>> {
        let opened = self.opened(tells)?;
        if let Some(deep) = opened.deep.first() {
            let (path, kind) = (deep.path().display(), deep.contents().kind);
            bail!(
                "{path}: found {kind}, which process and identify read for narrow fields; this command needs a \
                 catalog that is held in memory: starpipe catalog import {path} -o FILE.cat makes one"
            );
        }
        Ok(opened.catalog)
    }

    fn opened(&self, tells: bool) -> anyhow::Result<Opened> {
        let built_in = |deep| Opened {
            catalog: Cow::Borrowed(Catalog::built_in()),
            deep,
        };
        let Some(path) = &self.catalog else {
            return Ok(built_in(Vec::new()));
        };
        let deep = DeepCatalog::find(path)?;
        if !deep.is_empty() {
            let files = deep.iter().flat_map(DeepCatalog::files);
            files.filter(|_| tells).for_each(report_left_out);
            return Ok(built_in(deep));
        }
        let reading = catalog::read(path)?;
        let files = reading.files.iter();
        files.filter(|_| tells).for_each(report_left_out);
        Ok(Opened {
            catalog: Cow::Owned(reading.catalog),
            deep,
        })
    }

    /// The deep catalogues that are `stated`; without `--catalog`, those that are installed.
    fn deep(&self, stated: Vec<DeepCatalog>, tells: bool) -> Option<DeepSky> {
        let cache = self.cache_dir.clone().or_else(cache_directory);
        let deep = match (stated.is_empty(), &self.catalog) {
            (false, _) => DeepSky::new(stated, cache),
            (true, Some(_)) => return None,
            (true, None) => match installed_paths() {
                paths if paths.is_empty() => return None,
                paths => DeepSky::installed(paths, cache),
            },
        };
        Some(if tells {
            deep.with_progress(on_deep_progress())
        } else {
            deep
        })
    }

    fn index_and_run<R>(
        &self,
        (pool, tells): (&rayon::ThreadPool, bool),
        catalog: &Catalog,
        work: impl FnOnce(&rayon::ThreadPool, &IndexedCatalog) -> Result<R, CommandError>,
    ) -> Result<R, CommandError> {
        let indexed = pool.install(|| self.index(catalog, tells));
        report_cache_errors(&indexed, tells);
        let result = work(pool, &indexed);
        report_cache_errors(&indexed, tells);
        result
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

/// Reports that some records of a file give no stars.
fn report_left_out(file: &SourceFile) {
    if let Some(reasons) = file.summary.left_out() {
        let (path, records) = (file.path.display(), file.summary.records);
        report_warning(format_args!(
            "{path}: some of its {records} records are skipped: {reasons}"
        ));
    }
}

/// Tells what indexing deep catalogues costs before it begins, and shows how far it is.
fn on_deep_progress() -> OnProgress {
    let progress = bar(100, "indexing the deep catalog {wide_bar} {percent} %");
    Box::new(move |done| match done {
        DeepProgress::Begins(work) => progress.suspend(|| report(work)),
        DeepProgress::Share(share) => progress.set_position((share * 100.0) as u64),
        DeepProgress::Done => progress.finish_and_clear(),
        _ => {}
    })
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
