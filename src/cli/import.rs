//! `catalog import`.

use super::args::{CatalogArgs, CatalogCommand, ImportArgs};
use super::{Exit, Fault};
use starpipe::catalog;

/// `starpipe catalog`
pub(crate) fn catalog(arguments: CatalogArgs) -> Result<Exit, Fault> {
    match arguments.command {
        CatalogCommand::Import(arguments) => Ok(import(&arguments)?),
    }
}

fn import(arguments: &ImportArgs) -> anyhow::Result<Exit> {
    let (catalog, summary) = catalog::import_sky2000(&arguments.file)?;
    let _ = (catalog, summary);
    Ok(Exit::Success)
}
