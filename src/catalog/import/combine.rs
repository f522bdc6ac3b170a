//! Combines the files of a catalogue.

use super::summary::ImportSummary;
use super::tally::{ImportTally, RowParser};
use crate::catalog::{Catalog, CatalogError, Star, StarId};
use rayon::prelude::*;
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// A source file of a catalogue.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct SourceFile {
    /// The file.
    pub path: PathBuf,
    /// Its kind and, for a table, the columns used.
    pub kind: String,
    /// The summary of its records.
    pub summary: ImportSummary,
}

/// A catalogue, and the files it was read from.
#[derive(Debug, Clone)]
pub struct LoadedCatalog {
    /// The catalogue.
    pub catalog: Catalog,
    /// The source files, in the order of their names; none for the compact form.
    pub files: Vec<SourceFile>,
}

/// The records of one file of a catalogue.
pub(in crate::catalog) struct CatalogPart {
    pub(in crate::catalog) path: PathBuf,
    pub(in crate::catalog) format: Box<dyn RowParser + Send>,
    pub(in crate::catalog) tally: ImportTally,
}

/// The catalogue of all stars in `parts`, which were read from `path`.
///
/// Of two records with one identifier the first counts, in the order of the parts; the second is
/// unreadable.
pub(in crate::catalog) fn combine(
    path: &Path,
    title: String,
    mut parts: Vec<CatalogPart>,
) -> Result<LoadedCatalog, CatalogError> {
    remove_repeated(&mut parts)?;
    let (mut stars, mut names, mut files) = (Vec::new(), Vec::new(), Vec::new());
    for mut part in parts {
        part.tally.summary.stars = part.tally.stars.len() as u64;
        if stars.is_empty() {
            // Without a copy: most catalogues are one file.
            stars = part.tally.stars;
        } else {
            stars.append(&mut part.tally.stars);
        }
        names.append(&mut part.tally.names);
        files.push(SourceFile {
            path: part.path,
            kind: part.format.kind(),
            summary: part.tally.summary,
        });
    }
    if stars.is_empty() {
        return Err(CatalogError::NoStars {
            path: path.to_owned(),
            records: files.iter().map(|file| file.summary.records).sum(),
        });
    }
    // A repeated record may have had a name, too: that of the first counts.
    let mut named = HashSet::new();
    names.retain(|(id, _)| named.insert(*id));
    let catalog = Catalog::new(title, stars, names)?;
    Ok(LoadedCatalog { catalog, files })
}

/// Removes all but the first record of each identifier, and of each name without an identifier.
fn remove_repeated(parts: &mut [CatalogPart]) -> Result<(), CatalogError> {
    let stars = parts.iter().map(|part| part.tally.stars.as_slice());
    let mut ids: Vec<(StarId, usize)> = stars.flatten().map(|star| star.id).zip(0..).collect();
    ids.par_sort_unstable();
    let repeated = |pair: &&[(StarId, usize)]| pair[0].0 == pair[1].0;
    let mut removed: Vec<usize> = ids.windows(2).filter(repeated).map(|p| p[1].1).collect();
    removed.extend(repeated_names(parts));
    if removed.is_empty() {
        return Ok(());
    }
    let mut keep = vec![true; ids.len()];
    removed.into_iter().for_each(|index| keep[index] = false);
    let mut keep = keep.as_slice();
    for part in parts {
        let (ours, others) = keep.split_at(part.tally.stars.len());
        keep = others;
        part.tally.remove_repeated(&*part.format, ours);
        part.tally.check(&*part.format, &part.path)?;
    }
    Ok(())
}

/// The indices, counted through all parts, of stars that have only a name, and one used before.
fn repeated_names(parts: &[CatalogPart]) -> Vec<usize> {
    let mut repeated = Vec::new();
    let mut first = 0;
    let mut seen = HashSet::new();
    for part in parts {
        let is_named = |star: &Star| matches!(star.id, StarId::Named(_));
        let named = part.tally.stars.iter().enumerate();
        // Every star without another identifier has a name, in the same order.
        let named = named.filter(|(_, star)| is_named(star));
        let names = part.tally.names.iter();
        let names = names.filter(|(id, _)| matches!(id, StarId::Named(_)));
        for ((index, _), (_, name)) in named.zip(names) {
            if !seen.insert(name.as_str()) {
                repeated.push(first + index);
            }
        }
        first += part.tally.stars.len();
    }
    repeated
}
