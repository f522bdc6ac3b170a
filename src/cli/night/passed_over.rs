//! What is no frame of a night, by kind.

use starpipe::frame::PassedOver;
use starpipe::night::{NightRow, PassedOverFiles};
use std::collections::BTreeMap;

/// Files that were no frames, and frames that show no sky.
pub(super) fn counts(files: &[PassedOver], rows: &[NightRow]) -> Vec<PassedOverFiles> {
    let mut by_kind: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    for file in files {
        let names = by_kind.entry(file.kind.code()).or_default();
        names.push(file.path.display().to_string());
    }
    for row in rows {
        if let Some(kind) = row.no_sky() {
            let names = by_kind.entry(kind.code()).or_default();
            names.push(row.frame.clone());
        }
    }
    let kinds = by_kind.into_iter();
    let counted = kinds.map(|(kind, files)| PassedOverFiles {
        kind: kind.to_owned(),
        count: files.len(),
        files,
    });
    counted.collect()
}
