//! Files as other programs write them, and damaged ones.

use super::{Hats, ParquetFile};
use crate::base::coords::UnitVector;
use crate::base::interrupt::Interrupt;
use crate::base::units::RAD_PER_DEG;
use crate::catalog::deep::DeepCatalog;
use crate::catalog::deep::error::Damage;
use crate::catalog::deep::healpix::HealpixCell;
use crate::catalog::deep::region::Region;
use crate::catalog::{Star, StarFlags, StarId};
use parquet::basic::{Compression, ZstdLevel};
use parquet::column::writer::ColumnWriter;
use parquet::data_type::ByteArray;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;
use std::fs;
use std::path::Path;
use std::sync::Arc;

/// The columns of the archive, the last of no use.
const ARCHIVE: &str = "message schema {
    optional int64 _healpix_29; required int64 source_id; optional double ref_epoch; required double ra;
    required double dec; optional double pmra; optional double pmdec; optional float phot_g_mean_mag;
    optional binary designation (UTF8); optional group shape (LIST) { repeated group list { optional float ra; } } }";
const VIZIER: &str = "message schema {
    required int64 Source; required double RA_ICRS; required double DE_ICRS; optional float Gmag;
    optional double pmRA; optional double pmDE; }";
/// Numbers as text, and no identifiers.
const PLAIN: &str = "message schema {
    optional binary RA (UTF8); optional binary Dec (UTF8); required int32 Vmag; }";

/// Places over the whole sky, in degrees: one for each number up to `count`.
fn place(number: usize, count: usize) -> [f64; 2] {
    let z = 1.0 - (2.0 * number as f64 + 1.0) / count as f64;
    let ra_deg = (number as f64 * 137.507_764).rem_euclid(360.0);
    [ra_deg, libm::asin(z) / RAD_PER_DEG]
}

fn value(name: &str, number: usize, [ra_deg, dec_deg]: [f64; 2]) -> f64 {
    match name {
        "ra" | "RA_ICRS" | "RA" => ra_deg,
        "dec" | "DE_ICRS" | "Dec" => dec_deg,
        "ref_epoch" => 2016.0,
        "pmra" | "pmRA" => 100.0,
        "pmdec" | "pmDE" => -50.0,
        "source_id" | "Source" => 4_000_000_000_000_000_000.0 + 4096.0 * number as f64,
        _ => 6.0 + (number % 10) as f64,
    }
}

/// Writes rows at places, of which every fifth has none of the optional values of proper motion, every seventh no
/// magnitude.
fn write(
    path: &Path,
    schema: &str,
    places: &[[f64; 2]],
    properties: WriterProperties,
    per_group: usize,
) {
    let schema = Arc::new(parse_message_type(schema).unwrap());
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    let file = fs::File::create(path).unwrap();
    let mut writer = SerializedFileWriter::new(file, schema, Arc::new(properties)).unwrap();
    let rows: Vec<(usize, [f64; 2])> = places.iter().copied().enumerate().collect();
    for group in rows.chunks(per_group) {
        let mut columns = writer.next_row_group().unwrap();
        while let Some(mut column) = columns.next_column().unwrap() {
            let (name, nullable, nested) = match column.untyped() {
                ColumnWriter::DoubleColumnWriter(of) => of.get_descriptor().clone(),
                ColumnWriter::FloatColumnWriter(of) => of.get_descriptor().clone(),
                ColumnWriter::Int64ColumnWriter(of) => of.get_descriptor().clone(),
                ColumnWriter::Int32ColumnWriter(of) => of.get_descriptor().clone(),
                ColumnWriter::ByteArrayColumnWriter(of) => of.get_descriptor().clone(),
                _ => unreachable!(),
            }
            .into_parts();
            let is_null = |number: usize| match name.as_str() {
                "pmra" | "pmRA" => number.is_multiple_of(5),
                "phot_g_mean_mag" | "Gmag" => number.is_multiple_of(7),
                _ => nested,
            };
            let levels: Vec<i16> = group
                .iter()
                .map(|(number, _)| i16::from(!is_null(*number)))
                .collect();
            let levels = nullable.then_some(&levels[..]);
            let zeros = vec![0; group.len()];
            let repeats = nested.then_some(&zeros[..]);
            let values = group
                .iter()
                .filter(|(number, _)| !nullable || !is_null(*number));
            let values = values.map(|(number, place)| value(&name, *number, *place));
            match column.untyped() {
                ColumnWriter::DoubleColumnWriter(to) => {
                    to.write_batch(&values.collect::<Vec<_>>(), levels, repeats)
                        .unwrap();
                }
                ColumnWriter::FloatColumnWriter(to) => {
                    let values: Vec<f32> = values.map(|value| value as f32).collect();
                    to.write_batch(&values, levels, repeats).unwrap();
                }
                ColumnWriter::Int64ColumnWriter(to) => {
                    let values: Vec<i64> = values.map(|value| value as i64).collect();
                    to.write_batch(&values, levels, repeats).unwrap();
                }
                ColumnWriter::Int32ColumnWriter(to) => {
                    let values: Vec<i32> = values.map(|value| value as i32).collect();
                    to.write_batch(&values, levels, repeats).unwrap();
                }
                ColumnWriter::ByteArrayColumnWriter(to) => {
                    let values: Vec<ByteArray> = values
                        .map(|value| ByteArray::from(value.to_string().as_str()))
                        .collect();
                    to.write_batch(&values, levels, repeats).unwrap();
                }
                _ => unreachable!(),
            }
            column.close().unwrap();
        }
        columns.close().unwrap();
    }
    writer.close().unwrap();
}

/// Name, whether values may be missing, whether it is nested.
trait Parts {
    fn into_parts(self) -> (String, bool, bool);
}

impl Parts for parquet::schema::types::ColumnDescPtr {
    fn into_parts(self) -> (String, bool, bool) {
        (
            self.name().to_owned(),
            self.max_def_level() > 0,
            self.max_rep_level() > 0,
        )
    }
}

fn plain() -> WriterProperties {
    WriterProperties::builder().build()
}

fn region(ra_deg: f64, dec_deg: f64, radius_deg: f64) -> Region {
    Region {
        centre: UnitVector::from_ra_dec(ra_deg * RAD_PER_DEG, dec_deg * RAD_PER_DEG),
        radius_rad: radius_deg * RAD_PER_DEG,
        per_sq_deg: f64::INFINITY,
    }
}

fn stars_in(file: &ParquetFile, region: &Region) -> Vec<Star> {
    let mut stars = Vec::new();
    let mut add = |star: Star| stars.push(star);
    file.stars_in(region, &Interrupt::default(), &mut add)
        .unwrap();
    stars.retain(|star| region.contains(&star.direction));
    stars.sort_by_key(|star| star.id);
    stars
}

/// The regions that are asked for: one across the equinox, one at each pole, one without either.
fn regions() -> [Region; 4] {
    [
        region(359.0, 10.0, 8.0),
        region(20.0, 89.0, 9.0),
        region(100.0, -87.0, 5.0),
        region(200.0, -30.0, 6.0),
    ]
}

#[test]
fn the_stars_of_a_region_are_found_with_and_without_statistics() {
    let folder = tempfile::tempdir().unwrap();
    let count = 30_000;
    let mut places: Vec<[f64; 2]> = (0..count).map(|number| place(number, count)).collect();
    places.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let zstd = Compression::ZSTD(ZstdLevel::default());
    let kinds = [
        (ARCHIVE, plain(), 1000),
        (
            ARCHIVE,
            WriterProperties::builder()
                .set_statistics_enabled(EnabledStatistics::None)
                .build(),
            20_000,
        ),
        (
            VIZIER,
            WriterProperties::builder().set_compression(zstd).build(),
            4000,
        ),
        (
            VIZIER,
            WriterProperties::builder()
                .set_compression(Compression::GZIP(Default::default()))
                .build(),
            30_000,
        ),
    ];
    for (schema, properties, per_group) in kinds {
        let path = folder.path().join("gaia.parquet");
        write(&path, schema, &places, properties, per_group);
        let file = ParquetFile::open(&path).unwrap();
        assert_eq!((file.rows, file.epoch_year), (count as u64, Some(2016.0)));
        for region in regions() {
            let stars = stars_in(&file, &region);
            let expected: Vec<usize> = (0..count)
                .filter(|number| number % 7 != 0)
                .filter(|number| {
                    let [ra, dec] = places[*number].map(|deg| deg * RAD_PER_DEG);
                    region.contains(&UnitVector::from_ra_dec(ra, dec))
                })
                .collect();
            assert!(expected.len() > 20, "{}", expected.len());
            let id =
                |number: &usize| StarId::Gaia(4_000_000_000_000_000_000 + 4096 * *number as u64);
            let ids: Vec<StarId> = stars.iter().map(|star| star.id).collect();
            assert_eq!(ids, expected.iter().map(id).collect::<Vec<_>>());
            for (star, number) in stars.iter().zip(&expected) {
                let [ra, dec] = places[*number].map(|deg| deg * RAD_PER_DEG);
                let there = UnitVector::from_ra_dec(ra, dec);
                let moved_mas = star.direction.angle_to(&there) / RAD_PER_DEG * 3.6e6;
                let is_still = star.flags.contains(StarFlags::NO_PROPER_MOTION);
                assert_eq!(is_still, number % 5 == 0);
                let expected_mas = if is_still { 0.0 } else { 16.0 * 111.8 };
                assert!((moved_mas - expected_mas).abs() < 2.0, "{moved_mas}");
            }
        }
    }
}

#[test]
fn numbers_as_text_and_rows_without_identifiers_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plain.parquet");
    let places: Vec<[f64; 2]> = (0..500).map(|number| place(number, 500)).collect();
    write(&path, PLAIN, &places, plain(), 200);
    let file = ParquetFile::open(&path).unwrap();
    let stars = stars_in(&file, &region(50.0, 0.0, 180.0));
    assert_eq!(stars.len(), 500);
    assert!(stars.iter().all(|star| matches!(star.id, StarId::Place(_))));
    assert_eq!(stars.iter().filter(|star| star.v_mag == 7.0).count(), 50);
    let interrupt = Interrupt::when(|| true);
    let read = file.stars_in(&Region::WHOLE_SKY, &interrupt, &mut |_| {});
    assert!(matches!(read, Err(Damage::Interrupted)));
}

#[test]
fn a_table_of_something_else_names_what_it_lacks() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("other.parquet");
    let places = [[1.0, 2.0]];
    let refused = |schema: &str| {
        write(&path, schema, &places, plain(), 10);
        ParquetFile::open(&path).unwrap_err().to_string()
    };
    let found = refused("message schema { required double ra; required double dec; }");
    assert!(found.contains("of magnitudes (vmag"), "{found}");
    let found = refused("message schema { required double x; }");
    assert_eq!(
        found,
        "it has no columns of positions and magnitudes of stars"
    );
    // Beside catalogues it is passed over; by itself it is refused.
    write(
        &folder.path().join("a.parquet"),
        VIZIER,
        &places,
        plain(),
        10,
    );
    write(
        &folder.path().join("b.parquet"),
        VIZIER,
        &[[3.0, 4.0]],
        plain(),
        10,
    );
    let found = DeepCatalog::find(folder.path()).unwrap();
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].contents().stars, 2);
    DeepCatalog::find(&path).unwrap_err();
}

#[test]
fn a_file_with_too_many_unreadable_rows_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bad.parquet");
    let mut places: Vec<[f64; 2]> = (0..1000).map(|number| place(number, 1000)).collect();
    for place in places.iter_mut().step_by(20) {
        place[1] = 100.0;
    }
    write(&path, VIZIER, &places, plain(), 300);
    let file = ParquetFile::open(&path).unwrap();
    let read = file.stars_in(&Region::WHOLE_SKY, &Interrupt::default(), &mut |_| {});
    let found = read.unwrap_err().to_string();
    assert!(
        found.contains("50 of 1000 rows cannot be read, first line 1, column 3 (DE_ICRS)"),
        "{found}"
    );
}

#[test]
fn groups_of_rows_elsewhere_are_not_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("gaia.parquet");
    let mut places: Vec<[f64; 2]> = (0..4000).map(|number| place(number, 4000)).collect();
    places.sort_by(|a, b| a[0].total_cmp(&b[0]));
    write(&path, VIZIER, &places, plain(), 1000);
    let mut bytes = fs::read(&path).unwrap();
    bytes[4..2000].fill(0xff);
    fs::write(&path, bytes).unwrap();
    let file = ParquetFile::open(&path).unwrap();
    assert!(stars_in(&file, &region(200.0, 0.0, 10.0)).len() > 10);
    let read = |region| file.stars_in(&region, &Interrupt::default(), &mut |_| {});
    read(region(40.0, 0.0, 10.0)).unwrap_err();
}

#[test]
fn damaged_files_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("gaia.parquet");
    let places: Vec<[f64; 2]> = (0..400).map(|number| place(number, 400)).collect();
    let kinds = [
        plain(),
        WriterProperties::builder()
            .set_compression(Compression::SNAPPY)
            .build(),
    ];
    for properties in kinds {
        write(&path, ARCHIVE, &places, properties, 150);
        let whole = fs::read(&path).unwrap();
        let read = |bytes: &[u8]| {
            fs::write(&path, bytes).unwrap();
            let file = ParquetFile::open(&path)?;
            file.stars_in(&Region::WHOLE_SKY, &Interrupt::default(), &mut |_| {})
        };
        read(&whole).unwrap();
        for length in (0..whole.len()).step_by(97) {
            assert!(read(&whole[..length]).is_err(), "{length}");
        }
        // Some of these can be read, with other numbers.
        let mut state: u32 = 1;
        for _ in 0..300 {
            let mut bytes = whole.clone();
            for _ in 0..=(state >> 8) % 4 {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                let at = (state >> 4) as usize % bytes.len();
                bytes[at] = (state >> 20) as u8;
            }
            let _ = read(&bytes);
        }
    }
}

/// Writes the partitions of some cells, each with its places among `places`.
fn write_partitions(directory: &Path, places: &[[f64; 2]], cells: &[(u32, u64)]) {
    for &(order, number) in cells {
        let is_within = |place: &&[f64; 2]| {
            let [ra, dec] = place.map(|deg| deg * RAD_PER_DEG);
            let cell = HealpixCell::of(&UnitVector::from_ra_dec(ra, dec), 1 << order);
            cell == HealpixCell::from_nested(number, order)
        };
        let within: Vec<[f64; 2]> = places.iter().filter(is_within).copied().collect();
        let folder = directory.join(format!("Norder={order}/Dir={}", number / 10_000 * 10_000));
        write(
            &folder.join(format!("Npix={number}.parquet")),
            PLAIN,
            &within,
            plain(),
            500,
        );
    }
}

#[test]
fn of_a_hats_directory_only_the_files_of_a_region_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let gaia = folder.path().join("gaia");
    let places: Vec<[f64; 2]> = (0..20_000).map(|number| place(number, 20_000)).collect();
    write_partitions(&gaia.join("dataset"), &places, &[(0, 4), (1, 0), (2, 5)]);
    fs::write(
        gaia.join("hats.properties"),
        "#HATS\nobs_collection=gaia\ndataproduct_type=object\nhats_nrows=20000\n",
    )
    .unwrap();
    fs::write(
        gaia.join("partition_info.csv"),
        "Norder,Npix\n0,4\n1,0\n2,5\n",
    )
    .unwrap();
    let hats = Hats::open(&gaia).unwrap().unwrap();
    assert_eq!((&*hats.name, hats.rows()), ("gaia", 20_000));
    let share = 1.0 / 12.0 + 1.0 / 48.0 + 1.0 / 192.0;
    assert!((hats.share_of_sky() - share).abs() < 1e-12);
    // Face 4 is around the equinox, and partition 1/0 at the south corner of face 0.
    let count = |region: &Region| {
        let mut stars = Vec::new();
        let mut add = |star: Star| stars.push(star);
        hats.stars_in(region, &Interrupt::default(), &mut add)
            .map(|()| stars.len())
    };
    let around = region(0.0, 0.0, 3.0);
    let expected = places.iter().filter(|place| {
        let [ra, dec] = place.map(|deg| deg * RAD_PER_DEG);
        around.contains(&UnitVector::from_ra_dec(ra, dec))
    });
    let expected = expected.count();
    assert!(expected > 10 && count(&around).unwrap() >= expected);
    assert_eq!(count(&region(200.0, -60.0, 3.0)).unwrap(), 0);
    // Damage elsewhere is not met.
    let damaged = gaia.join("dataset/Norder=1/Dir=0/Npix=0.parquet");
    fs::write(&damaged, b"PAR1").unwrap();
    assert!(count(&around).unwrap() >= expected);
    assert_eq!(count(&region(45.0, 15.0, 3.0)).unwrap_err().0, damaged);
    // One that is not there is counted out.
    fs::remove_file(&damaged).unwrap();
    let hats = Hats::open(&gaia).unwrap().unwrap();
    assert!((1500..2100).contains(&hats.rows()), "{}", hats.rows());
}

#[test]
fn collections_have_one_catalogue_and_margins_none() {
    let folder = tempfile::tempdir().unwrap();
    let places: Vec<[f64; 2]> = (0..300).map(|number| place(number, 300)).collect();
    for (name, kind) in [("gaia", "object"), ("gaia_10arcs", "margin")] {
        let directory = folder.path().join("dr3").join(name);
        write_partitions(&directory.join("dataset"), &places, &[(0, 4)]);
        fs::write(
            directory.join("properties"),
            format!("dataproduct_type = {kind}\n"),
        )
        .unwrap();
    }
    let collection = folder.path().join("dr3/collection.properties");
    fs::write(
        &collection,
        "hats_primary_table_url=gaia\nall_margins=gaia_10arcs\n",
    )
    .unwrap();
    assert!(
        Hats::open(&folder.path().join("dr3/gaia_10arcs"))
            .unwrap()
            .is_none()
    );
    assert!(Hats::open(folder.path()).unwrap().is_none());
    // The collection is found in the directory of catalogues.
    for path in [folder.path().to_owned(), folder.path().join("dr3")] {
        let found = DeepCatalog::find(&path).unwrap();
        assert_eq!(found.len(), 1);
        let contents = found[0].contents();
        assert_eq!(contents.kind, "HATS catalog gaia");
        assert!((20..30).contains(&contents.stars), "{}", contents.stars);
        assert!(
            !found[0]
                .stars_in(Region::WHOLE_SKY, &Interrupt::default())
                .unwrap()
                .is_empty()
        );
    }
    fs::write(
        &collection,
        "hats_primary_table_url=https://example.org/gaia\n",
    )
    .unwrap();
    let (path, error) = Hats::open(&folder.path().join("dr3")).unwrap_err();
    assert_eq!(path, collection);
    assert!(
        error.to_string().contains("hats_primary_table_url"),
        "{error}"
    );
}

#[test]
fn older_directories_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let places = [[45.0, 20.0], [45.0, 25.0]];
    write(
        &folder.path().join("Norder0/Npix0/catalog.parquet"),
        PLAIN,
        &places,
        plain(),
        10,
    );
    fs::write(
        folder.path().join("catalog_info.json"),
        r#"{"catalog_name": "old", "catalog_type": "object", "total_rows": 2}"#,
    )
    .unwrap();
    let hats = Hats::open(folder.path()).unwrap().unwrap();
    assert_eq!((&*hats.name, hats.rows()), ("old", 2));
}
