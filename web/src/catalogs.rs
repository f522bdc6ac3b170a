//! The stars: the bright ones are within the module, the whole catalog is given to it.

use crate::told;
use starpipe::catalog::StarNumbers;
use starpipe::{Catalog, IndexedCatalog};
use std::sync::OnceLock;
use wasm_bindgen::prelude::*;

static WHOLE: OnceLock<Catalog> = OnceLock::new();

/// Gives the module the whole catalog: `catalogs/sky2000.bin`.
///
/// # Errors
/// A file that is damaged.
#[wasm_bindgen]
pub fn open_catalog(stars: &[u8]) -> Result<(), JsError> {
    let catalog = Catalog::from_compact(stars).map_err(told)?;
    WHOLE.get_or_init(|| catalog);
    Ok(())
}

/// Gives the module the numbers of the stars in other catalogs: `catalogs/star-numbers.bin`.
///
/// # Errors
/// A file that is damaged.
#[wasm_bindgen]
pub fn open_numbers(numbers: Vec<u8>) -> Result<(), JsError> {
    StarNumbers::give_table(numbers).map_err(told)
}

/// The name under which the index of the catalog may be kept.
///
/// # Errors
/// Without a catalog.
#[wasm_bindgen]
pub fn index_name() -> Result<String, JsError> {
    Ok(IndexedCatalog::index_name(whole()?))
}

/// The whole catalog.
///
/// # Errors
/// Before it was given.
pub(crate) fn whole() -> Result<&'static Catalog, JsError> {
    WHOLE
        .get()
        .ok_or_else(|| JsError::new("the catalog is not here yet"))
}

/// The stars to V = 6.5.
pub(crate) fn bright() -> &'static Catalog {
    static BRIGHT: OnceLock<Catalog> = OnceLock::new();
    BRIGHT.get_or_init(|| {
        Catalog::from_compact(include_bytes!("../../catalogs/sky2000-bright.bin"))
            .expect("tests/it/catalog.rs checks it")
    })
}
