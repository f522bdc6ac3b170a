//! Damaged, truncated and foreign files give a message.

use super::areas;
use super::index_file::{Series, index_file};
use super::patch::Patch;
use super::tables::Form;
use proptest::prelude::*;
use starpipe::base::interrupt::Interrupt;
use starpipe::catalog::deep::{DeepCatalog, Region};
use std::error::Error;
use std::fs;
use std::path::Path;

/// Reads all that is in a path. Whatever it is, this must not panic.
fn read_all(path: &Path) -> Result<usize, String> {
    let text = |error: starpipe::catalog::CatalogError| {
        let mut words = error.to_string();
        let mut cause = error.source();
        while let Some(error) = cause {
            words += &format!(": {error}");
            cause = error.source();
        }
        assert!(words.contains(&path.display().to_string()[..4]), "{words}");
        words
    };
    let mut stars = 0;
    for deep in DeepCatalog::find(path).map_err(text)? {
        assert!(deep.contents().per_sq_deg() >= 0.0);
        let whole_sky = Region {
            per_sq_deg: 10.0,
            ..Region::WHOLE_SKY
        };
        stars += deep
            .stars_in(whole_sky, &Interrupt::default())
            .map_err(text)?
            .len();
    }
    Ok(stars)
}

#[test]
fn truncated_tables_say_so() {
    let patch = Patch::draw([10.0, 10.0], 1.0, 300.0, 5);
    let folder = tempfile::tempdir().unwrap();
    for form in [Form::TableData, Form::Binary, Form::Binary2, Form::Parquet] {
        let path = folder.path().join(form.file_name());
        form.write(&path, &patch);
        let whole = fs::read(&path).unwrap();
        assert!(read_all(&path).unwrap() > 20);
        for percent in [40, 70, 99] {
            fs::write(&path, &whole[..whole.len() * percent / 100]).unwrap();
            let error = read_all(&path).unwrap_err();
            let words = ["cut off", "truncated", "damaged", "ends", "end of"];
            assert!(
                words.iter().any(|word| error.contains(word)),
                "{form:?} {percent}: {error}"
            );
        }
    }
}

fn index() -> Vec<u8> {
    index_file(
        &Patch::draw([10.0, 10.0], 1.0, 300.0, 5).stars,
        Series::Tycho,
        false,
    )
}

#[test]
fn a_truncated_index_file_says_so() {
    let file = tempfile::NamedTempFile::new().unwrap();
    let whole = index();
    fs::write(&file, &whole).unwrap();
    assert!(read_all(file.path()).unwrap() > 20);
    for blocks in [1, 3, 6, 10, 14] {
        fs::write(&file, &whole[..2880 * blocks + 100]).unwrap();
        let error = read_all(file.path()).unwrap_err();
        assert!(
            error.contains("truncated") || error.contains("without the table"),
            "{blocks}: {error}"
        );
    }
}

#[test]
fn a_truncated_file_of_an_area_is_read_as_far_as_it_goes_and_an_empty_one_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let patch = Patch::draw([10.0, 10.0], 1.0, 300.0, 5);
    areas::write(folder.path(), "d50", &patch.stars, true, false);
    let file = fs::read_dir(folder.path())
        .unwrap()
        .next()
        .unwrap()
        .unwrap()
        .path();
    let whole = fs::read(&file).unwrap();
    fs::write(&file, &whole[..whole.len() / 2 + 1]).unwrap();
    assert!(read_all(folder.path()).unwrap() > 10);
    fs::write(&file, &whole[..50]).unwrap();
    let error = read_all(folder.path()).unwrap_err();
    assert!(error.contains("truncated"), "{error}");
    let mut wrong = whole;
    wrong[109] = 77;
    fs::write(&file, wrong).unwrap();
    let error = read_all(folder.path()).unwrap_err();
    assert!(error.contains("records of 77 bytes"), "{error}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn a_damaged_index_file_is_read_or_refused(
        places in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..20)
    ) {
        let mut bytes = index();
        for (place, byte) in places {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        let file = tempfile::NamedTempFile::new().unwrap();
        fs::write(&file, bytes).unwrap();
        let _ = read_all(file.path());
    }

    /// The headers are most of what can be wrong.
    #[test]
    fn an_index_file_with_a_damaged_header_is_read_or_refused(
        block in 0..16usize, card in 0..36usize, text in "[0-9 TF'=-]{1,20}"
    ) {
        let mut bytes = index();
        let at = 2880 * block + 80 * card + 10;
        if at + text.len() < bytes.len() {
            bytes[at..at + text.len()].copy_from_slice(text.as_bytes());
        }
        let file = tempfile::NamedTempFile::new().unwrap();
        fs::write(&file, bytes).unwrap();
        let _ = read_all(file.path());
    }
}
