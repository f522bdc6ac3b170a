//! What commands that identify stars need first: threads, the catalogue, its index.

use crate::cli::output::messages::{one_line, report_warning};
use crate::cli::progress::bar;
use anyhow::Context;
use clap::Args;
use starpipe::identify::{IndexedCatalog, cache_directory};
use starpipe::sky::catalog::{self, Catalog};
use std::borrow::Cow;
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
#[command(next_help_heading = "Resources")]
pub(crate) struct CatalogOptions {
    /// Star catalogue to use in place of the built-in one: SKY2000, Tycho-2 (a directory of its files), a table
    /// (CSV, TSV, from VizieR), or what `starpipe catalog import` makes of one, which loads fastest
    #[arg(long, value_name = "PATH")]
    pub(crate) catalog: Option<PathBuf>,
    /// Where to keep the index of the catalogue [default: $STARPIPE_CACHE_DIR, else the user's cache
    /// directory]
    #[arg(long, value_name = "DIR")]
    pub(crate) cache_dir: Option<PathBuf>,
    /// Threads to work with [default: one for each processor]
    #[arg(long, value_name = "NUMBER", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub(crate) threads: Option<u32>,
}

pub(crate) fn thread_pool(threads: Option<u32>) -> anyhow::Result<rayon::ThreadPool> {
    rayon::ThreadPoolBuilder::new()
        // None at all stands for one for each processor.
        .num_threads(threads.unwrap_or(0) as usize)
        .build()
        .context("starting threads")
}

/// The catalogue that is asked for, kept by the caller if it is not the built-in one.
pub(crate) fn read_catalog(path: Option<&Path>) -> anyhow::Result<Cow<'static, Catalog>> {
    Ok(match path {
        Some(path) => {
            let reading = catalog::read(path)?;
            for file in &reading.files {
                if let Some(reasons) = file.summary.left_out() {
                    let (path, records) = (file.path.display(), file.summary.records);
                    report_warning(format_args!(
                        "{path}: not every one of {records} records is a star: {reasons}"
                    ));
                }
            }
            Cow::Owned(reading.catalog)
        }
        None => Cow::Borrowed(Catalog::built_in()),
    })
}

/// The catalog with its index, which is kept in the cache directory.
pub(crate) fn index_catalog<'a>(
    catalog: &'a Catalog,
    options: &CatalogOptions,
) -> IndexedCatalog<'a> {
    let progress = bar(100, "indexing the catalogue {wide_bar} {percent} %");
    let show = |part: f64| progress.set_position((part * 100.0) as u64);
    let directory = options.cache_dir.clone().or_else(cache_directory);
    let indexed = IndexedCatalog::open(catalog, directory.as_deref(), &show);
    progress.finish_and_clear();
    warn_of_cache(&indexed);
    indexed
}

/// Reports the errors of the cache that were not yet reported.
pub(crate) fn warn_of_cache(indexed: &IndexedCatalog) {
    for error in indexed.take_cache_errors() {
        let error = one_line(&error);
        report_warning(format_args!("{error}; this costs time and nothing else"));
    }
}
