//! `catalog import`.

use super::args::{CatalogArgs, CatalogCommand, ImportArgs};
use super::output::print;
use super::{Exit, Fault};
use starpipe::catalog;
use starpipe::report::counted;

/// `starpipe catalog`
pub(crate) fn catalog(arguments: CatalogArgs) -> Result<Exit, Fault> {
    match arguments.command {
        CatalogCommand::Import(arguments) => Ok(import(&arguments)?),
    }
}

fn import(arguments: &ImportArgs) -> anyhow::Result<Exit> {
    let reading = catalog::import(&arguments.file)?;
    let mut catalog = reading.catalog;
    if let Some(limit) = arguments.vmag_limit {
        catalog = catalog.limited_to(limit);
    }
    catalog.write_compact(&arguments.output)?;
    let mut told = String::new();
    for file in reading.files {
        let (path, kind) = (file.path.display(), &file.kind);
        told += &format!("{path} ({kind}): {}\n", file.summary);
    }
    told += &format!(
        "{}: {}, {}\n",
        arguments.output.display(),
        counted(catalog.stars().len(), "star"),
        catalog.title(),
    );
    // Nobody left to read it: nothing is lost.
    let _ = print(&told)?;
    Ok(Exit::Success)
}
