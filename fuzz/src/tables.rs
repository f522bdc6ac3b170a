//! Readers of catalogues, descriptions and tables.

use super::scratch::{directory, with_file};
use starpipe::calibration::read_hot_pixels;
use starpipe::camera::data_sheet::{DataSheet, Response, SpotImage};
use starpipe::catalog::Catalog;
use starpipe::lab::validation::RunTables;
use starpipe::store::names_in;
use starpipe::{IndexedCatalog, Interrupt};
use std::fs;
use std::path::Path;
use std::sync::OnceLock;
use xxhash_rust::xxh3::xxh3_64;

/// A catalogue in any form.
pub fn catalog(bytes: &[u8]) {
    with_file("catalog", bytes, |path| {
        let Ok(catalog) = Catalog::read(path) else {
            return;
        };
        check_stars(&catalog);
        let again = Catalog::from_compact(&catalog.to_compact());
        assert_eq!(
            again.expect("its own form is read").stars(),
            catalog.stars()
        );
    });
}

/// A compact catalogue; its checksum is made right.
pub fn compact(bytes: &[u8]) {
    let mut bytes = bytes.to_vec();
    if let Some(payload) = bytes.len().checked_sub(8) {
        let checksum = xxh3_64(&bytes[..payload]).to_le_bytes();
        bytes[payload..].copy_from_slice(&checksum);
    }
    if let Ok(catalog) = Catalog::from_compact(&bytes) {
        check_stars(&catalog);
    }
}

fn check_stars(catalog: &Catalog) {
    for star in catalog.stars() {
        assert!(star.v_mag.is_finite());
        let length = star.direction_at(0.0).dot(&star.direction_at(0.0));
        assert!((length - 1.0).abs() < 1e-9, "{length}");
    }
}

/// Changes of an index: place (four bytes) and value, again and again. The checksum of its table is
/// made right. It is used, or found to be damaged; to make it anew would take most of the time.
pub fn index(changes: &[u8]) {
    const HEADER_BYTES: usize = 48;
    let (catalog, name, whole) = indexed();
    let mut bytes = whole.clone();
    for change in changes.as_chunks::<5>().0 {
        let [a, b, c, d, value] = *change;
        let at = u32::from_le_bytes([a, b, c, d]) as usize % bytes.len();
        bytes[at] = value;
    }
    let table_bytes = u64::from_le_bytes(bytes[32..40].try_into().expect("eight bytes"));
    let table_end = HEADER_BYTES.saturating_add(usize::try_from(table_bytes).unwrap_or(usize::MAX));
    if let Some(table) = bytes.get(HEADER_BYTES..table_end) {
        let checksum = xxh3_64(table).to_le_bytes();
        bytes[40..48].copy_from_slice(&checksum);
    }
    let place = directory().join(format!("index-{:?}", std::thread::current().id()));
    fs::create_dir_all(&place).expect("the temporary directory can be written");
    fs::write(place.join(name), &bytes).expect("the temporary directory can be written");
    let at_once = Interrupt::when(|| true);
    let Ok(indexed) = IndexedCatalog::open_until(catalog, Some(&place), &|_| (), &at_once) else {
        return;
    };
    assert_eq!(indexed.stars().len(), catalog.stars().len());
    // Damage behind the table is found when it is used, and mended.
    super::pipeline::identify_some(&indexed);
    let _ = indexed.take_cache_errors();
}

/// A small catalogue, the name of its index, and the index.
fn indexed() -> &'static (Catalog, String, Vec<u8>) {
    static MADE: OnceLock<(Catalog, String, Vec<u8>)> = OnceLock::new();
    MADE.get_or_init(|| {
        let mut text = "id,ra_deg,dec_deg,vmag\n".to_owned();
        for star in 0..60_u32 {
            let (ra, dec) = (
                f64::from(star * 37 % 100) / 8.0,
                f64::from(star * 61 % 90) / 8.0,
            );
            text += &format!("{star},{ra},{dec},{}\n", 2.0 + f64::from(star) / 20.0);
        }
        let catalog = with_file("stars.csv", text.as_bytes(), |path: &std::path::Path| {
            Catalog::read(path)
        });
        let catalog = catalog.expect("it is a catalogue");
        let place = directory().join("index");
        fs::create_dir_all(&place).expect("the temporary directory can be written");
        IndexedCatalog::open(&catalog, Some(&place), &|_| ());
        let mut files = fs::read_dir(&place).expect("the index is written");
        let path = files.next().expect("a file").expect("a name").path();
        let name = path
            .file_name()
            .expect("a name")
            .to_string_lossy()
            .into_owned();
        let bytes = fs::read(&path).expect("the index is read");
        (catalog, name, bytes)
    })
}

/// The description of a camera.
pub fn camera(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    if let Ok(sheet) = DataSheet::parse(Path::new("camera.toml"), &text) {
        assert!(sheet.width_px > 0 && sheet.height_px > 0);
        assert!(sheet.full_scale_adu().is_finite());
        assert!(sheet.saturation_adu() > 0.0);
    }
}

/// The response of a detector.
pub fn response(bytes: &[u8]) {
    if let Ok(response) = Response::parse(Path::new("response.csv"), bytes) {
        assert!((0.0..=1.0).contains(&response.peak()));
        assert!((0.0..=1.0).contains(&response.at(550.0)));
    }
}

/// The image of a spot.
pub fn spot_image(bytes: &[u8]) {
    with_file("spot.csv", bytes, |path| {
        if let Ok(image) = SpotImage::read(path) {
            assert!((0.0..=1.0 + 1e-9).contains(&image.share(0.0, 0.0, 1.0)));
        }
    });
}

/// A list of hot pixels.
pub fn hot_pixels(bytes: &[u8]) {
    with_file("hot.csv", bytes, |path| {
        if let Ok(list) = read_hot_pixels(path) {
            assert!(list.pixels().count() <= bytes.len());
        }
    });
}

/// A Parquet table with names of frames.
pub fn names(bytes: &[u8]) {
    with_file("frames.parquet", bytes, |path| {
        let _ = names_in(path);
    });
}

/// The tables of a validation: those of frames and of stars, separated by a zero byte.
pub fn run(bytes: &[u8]) {
    let place = directory().join(format!("run-{:?}", std::thread::current().id()));
    fs::create_dir_all(&place).expect("the temporary directory can be written");
    let middle = bytes
        .iter()
        .position(|byte| *byte == 0)
        .unwrap_or(bytes.len());
    for (name, content) in [
        ("frames.csv", &bytes[..middle]),
        ("stars.csv", bytes.get(middle + 1..).unwrap_or_default()),
    ] {
        fs::write(place.join(name), content).expect("the temporary directory can be written");
    }
    if let Ok(tables) = RunTables::open(&place, |frame| frame) {
        let done = tables.done();
        assert!(done as usize <= bytes.len());
    }
}
