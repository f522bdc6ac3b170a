//! What commands that identify stars need first: threads, the catalogue, its index.

use super::args::ResourceArgs;
use super::{cache, chained, warn};
use anyhow::Context;
use indicatif::{ProgressBar, ProgressStyle};
use starpipe::identify::{CacheError, Sky};
use starpipe::sky::catalog::{self, Catalog};
use std::borrow::Cow;
use std::path::Path;

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
                    warn(format_args!(
                        "{path}: not every one of {records} records is a star: {reasons}"
                    ));
                }
            }
            Cow::Owned(reading.catalog)
        }
        None => Cow::Borrowed(Catalog::built_in()),
    })
}

/// The index comes from the cache where it is there and whole; a cache of no use costs time, not results.
pub(crate) fn sky<'a>(catalog: &'a Catalog, resources: &ResourceArgs) -> Sky<'a> {
    let progress = bar(100, "indexing the catalogue {wide_bar} {percent} %");
    let show = |part: f64| progress.set_position((part * 100.0) as u64);
    let Some(directory) = cache::directory(resources.cache_dir.clone()) else {
        return Sky::build(catalog, &show);
    };
    let (sky, troubles) = Sky::open(catalog, &directory, &show);
    progress.finish_and_clear();
    warn_of(troubles);
    sky
}

/// Tells of a cache that is of no use.
pub(crate) fn warn_of(troubles: Vec<CacheError>) {
    for trouble in troubles {
        let trouble = chained(&trouble);
        warn(format_args!("{trouble}; this costs time and nothing else"));
    }
}

/// A bar on standard error, which stays empty where that is no terminal.
pub(crate) fn bar(length: u64, template: &str) -> ProgressBar {
    let style =
        ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(length).with_style(style)
}
