//! The catalogue: committed files compared with their source, known stars, every kind of file.

use crate::common::{gzip, shared_dir};
use flate2::read::GzDecoder;
use proptest::prelude::*;
use starpipe::base::coords::{Icrs, UnitVector};
use starpipe::base::units::{ARCSEC_PER_RAD, RAD_PER_ARCSEC, RAD_PER_DEG};
use starpipe::catalog::{
    Catalog, CatalogError, HipparcosId, ImportSummary, RecordLocation, Star, StarFlags, StarId,
    StarIndex, TychoId, sky2000,
};
use std::collections::HashMap;
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};

/// SKY2000 has positions in steps of 1.5 mas and 1 mas; only floating-point error is tolerated.
const POSITION_TOLERANCE_ARCSEC: f64 = 1e-4;
/// Slightly more than half the compact form's step of proper motions, 1 mas a year.
const PM_TOLERANCE_MAS_PER_YR: f32 = 0.501;
/// SKY2000 and Tycho-2 are both at J2000 and agree to 0.06″ for these stars.
const TYCHO2_TOLERANCE_ARCSEC: f64 = 0.1;

fn catalogs() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("catalogs")
}

fn sky2000_file() -> Option<PathBuf> {
    shared_dir().map(|shared| shared.join("sky2000/SKYMAP_SKY2000_V5R4.gz"))
}

/// A catalogue read from one file, and the summary of its records.
fn import(path: &Path) -> Result<(Catalog, ImportSummary), CatalogError> {
    let mut reading = starpipe::catalog::import(path)?;
    assert_eq!(reading.files.len(), 1);
    Ok((reading.catalog, reading.files.remove(0).summary))
}

fn unpacked(path: &Path) -> Vec<u8> {
    let mut content = Vec::new();
    let file = fs::File::open(path).unwrap();
    GzDecoder::new(file).read_to_end(&mut content).unwrap();
    content
}

fn from_degrees(ra_deg: f64, dec_deg: f64) -> UnitVector<Icrs> {
    UnitVector::from_ra_dec(ra_deg * RAD_PER_DEG, dec_deg * RAD_PER_DEG)
}

fn star(catalog: &Catalog, id: u32) -> (StarIndex, Star) {
    let index = catalog
        .find(StarId::Skymap(id))
        .expect("the star is in the catalogue");
    (index, *catalog.star(index))
}

// ---- The committed files

#[test]
fn the_built_in_catalog_is_what_the_import_of_its_source_makes() {
    let Some(source) = sky2000_file() else { return };
    let (imported, summary) = import(&source).unwrap();
    assert_eq!(summary.records, 299_460);
    assert_eq!(summary.stars, 299_458);
    assert_eq!(summary.without_magnitude, [130_228, 242_078]);
    assert_eq!(
        (summary.without_position.len(), summary.unreadable.len()),
        (0, 0)
    );
    assert_eq!(
        summary.to_string(),
        "299460 records, 299458 stars, 2 without a magnitude (lines 130228, 242078)"
    );

    let folder = tempfile::tempdir().unwrap();
    let written = folder.path().join("sky2000.bin");
    imported.write_compact(&written).unwrap();
    let (made, committed) = (fs::read(&written).unwrap(), catalogs().join("sky2000.bin"));
    assert!(
        made == fs::read(committed).unwrap(),
        "catalogs/sky2000.bin is out of date"
    );

    let built_in = Catalog::built_in();
    assert_eq!(built_in.checksum(), imported.checksum());
    assert_eq!(built_in.title(), imported.title());
    assert_eq!(built_in.stars().len(), imported.stars().len());
    for (index, (ours, source)) in built_in.stars().iter().zip(imported.stars()).enumerate() {
        let without_motion = |star: &Star| Star {
            pm_ra_mas_per_yr: 0.0,
            pm_dec_mas_per_yr: 0.0,
            ..*star
        };
        assert_eq!(
            without_motion(ours),
            without_motion(source),
            "to the last bit"
        );
        let pm_ra_off = (ours.pm_ra_mas_per_yr - source.pm_ra_mas_per_yr).abs();
        let pm_dec_off = (ours.pm_dec_mas_per_yr - source.pm_dec_mas_per_yr).abs();
        assert!(
            pm_ra_off.max(pm_dec_off) <= PM_TOLERANCE_MAS_PER_YR,
            "{}",
            source.id
        );
        assert_eq!(
            built_in.name_of(StarIndex::new(index)),
            imported.name_of(StarIndex::new(index))
        );
    }
}

#[test]
fn the_bright_stars_are_those_of_the_built_in_catalog() {
    let made = Catalog::built_in().limited_to(6.5).to_compact();
    let committed = fs::read(catalogs().join("sky2000-bright.bin")).unwrap();
    assert!(
        committed == made,
        "catalogs/sky2000-bright.bin is out of date"
    );
}

#[test]
fn the_bright_csv_is_what_its_source_makes() {
    let Some(source) = sky2000_file() else { return };
    let folder = tempfile::tempdir().unwrap();
    let written = folder.path().join("bright.csv");
    let (summary, rows) = sky2000::write_bright_csv(&source, 6.5, &written).unwrap();
    assert_eq!((summary.records, rows), (299_460, 8787));
    let committed = fs::read(catalogs().join("sky2000-bright.csv")).unwrap();
    assert!(
        committed == fs::read(written).unwrap(),
        "catalogs/sky2000-bright.csv is out of date"
    );
}

/// The published layout, not the code's columns, defines the bytes of each cell.
#[test]
fn every_cell_of_the_bright_csv_is_what_the_layout_has_under_its_label() {
    let Some(shared) = shared_dir() else { return };
    let mut layout = csv::Reader::from_path(shared.join("sky2000/v4-layout.csv")).unwrap();
    let layout: HashMap<String, (usize, usize)> = layout
        .records()
        .map(|row| row.unwrap())
        .map(|row| {
            (
                row[4].to_owned(),
                (row[0].parse().unwrap(), row[1].parse().unwrap()),
            )
        })
        .collect();
    let text = unpacked(&shared.join("sky2000/SKYMAP_SKY2000_V5R4.gz"));
    let cell = |record: &[u8], label: &str| -> String {
        let (first_byte, last_byte) = layout[label];
        let cell = str::from_utf8(&record[first_byte - 1..last_byte])
            .unwrap()
            .trim();
        match cell.strip_prefix(['+', '-']) {
            Some(digits) => format!("{}{}", &cell[..1], digits.trim_start()),
            None => cell.to_owned(),
        }
    };
    let records: HashMap<String, &[u8]> = text
        .split(|&byte| byte == b'\n')
        .filter(|record| record.len() == 521)
        .map(|record| (cell(record, "ID"), record))
        .collect();
    let mut bright = csv::Reader::from_path(catalogs().join("sky2000-bright.csv")).unwrap();
    let labels = bright.headers().unwrap().clone();
    let mut rows = 0;
    for row in bright.records() {
        let row = row.unwrap();
        let record = records[&row[0]];
        for (label, value) in labels.iter().zip(&row) {
            assert_eq!(value, cell(record, label), "{label} of {}", &row[0]);
        }
        rows += 1;
    }
    assert_eq!(rows, 8787);
}

#[test]
fn the_bright_csv_holds_the_same_stars_as_the_built_in_catalog() {
    let path = catalogs().join("sky2000-bright.csv");
    let bright = Catalog::read(&path).unwrap();
    let built_in = Catalog::built_in();
    assert_eq!(bright.stars().len(), 8787);
    assert_eq!(built_in.brighter_than(6.5), 8787);
    for (index, (ours, theirs)) in bright.stars().iter().zip(built_in.stars()).enumerate() {
        assert_eq!((ours.id, ours.flags), (theirs.id, theirs.flags));
        assert_eq!((ours.v_mag, ours.bv_mag), (theirs.v_mag, theirs.bv_mag));
        assert_eq!(ours.direction, theirs.direction, "{}", ours.id);
        assert_eq!(
            bright.name_of(StarIndex::new(index)),
            built_in.name_of(StarIndex::new(index))
        );
    }
    let part = built_in.limited_to(6.5);
    assert_eq!(part.stars(), &built_in.stars()[..8787]);
    assert_eq!(Catalog::from_compact(&part.to_compact()).unwrap(), part);
}

#[test]
fn the_built_in_catalog_has_the_counts_of_sky2000() {
    let catalog = Catalog::built_in();
    let stars = catalog.stars();
    assert_eq!(stars.len(), 299_458);
    assert_eq!(catalog.epoch_year(), 2000.0);
    let counts = [
        (4.0, 514),
        (5.0, 1613),
        (6.0, 5008),
        (6.5, 8787),
        (7.0, 15_424),
        (8.0, 45_530),
        (9.0, 128_980),
        (10.0, 265_542),
    ];
    for (v_mag, count) in counts {
        assert_eq!(catalog.brighter_than(v_mag), count, "V < {v_mag}");
    }
    assert_eq!(catalog.brighter_than(f64::NEG_INFINITY), 0);
    assert_eq!(catalog.brighter_than(f64::INFINITY), stars.len());
    let with = |flag| {
        stars
            .iter()
            .filter(|star| star.flags.contains(flag))
            .count()
    };
    assert_eq!(with(StarFlags::DERIVED_MAGNITUDE), 1514);
    assert_eq!(with(StarFlags::BLENDED_MAGNITUDE), 934);
    assert_eq!(with(StarFlags::BLENDED_POSITION), 1035);
    assert_eq!(with(StarFlags::MULTIPLE), 29_355);
    assert_eq!(with(StarFlags::VARIABLE), 12_988);
    assert_eq!(with(StarFlags::NO_PROPER_MOTION), 5);
    assert_eq!(with(StarFlags::SMALL_AMPLITUDE), 2181);
    assert_eq!(with(StarFlags::FAINT_COMPANION), 5239);
    assert!(stars.is_sorted_by_key(|star| ((star.v_mag * 1000.0).round() as i32, star.id)));
}

#[test]
fn known_stars_are_where_their_records_say() {
    let catalog = Catalog::built_in();
    // Sexagesimal, V and name as in the source's columns.
    let hms = |h: f64, m: f64, s: f64| (h + m / 60.0 + s / 3600.0) * 15.0;
    let dms = |d: f64, m: f64, s: f64| d + m / 60.0 + s / 3600.0;
    let known = [
        (
            2_480_053,
            hms(2., 31., 49.0837),
            dms(89., 15., 50.794),
            2.00,
            "1 alp UMi",
        ),
        (
            6_450_045,
            hms(6., 45., 8.9173),
            -dms(16., 42., 58.017),
            -1.44,
            "9 alp CMa",
        ),
        (
            18_360_206,
            hms(18., 36., 56.3364),
            dms(38., 47., 1.291),
            0.03,
            "3 alp Lyr",
        ),
    ];
    for (id, ra_deg, dec_deg, v_mag, name) in known {
        let (index, star) = star(catalog, id);
        let off_arcsec = star.direction.angle_to(&from_degrees(ra_deg, dec_deg)) * ARCSEC_PER_RAD;
        assert!(
            off_arcsec < POSITION_TOLERANCE_ARCSEC,
            "{name}: {off_arcsec}″"
        );
        assert_eq!(star.v_mag, v_mag);
        assert_eq!(catalog.name_of(index), Some(name));
    }
    assert_eq!(
        catalog.designation(StarIndex::new(0)),
        "SKYMAP 06450045",
        "Sirius is the brightest"
    );
    assert_eq!(
        catalog.designation(star(catalog, 2_480_053).0),
        "SKYMAP 02480053"
    );
    // Vega, ESA 1997 (HIP 91262): 201.03 and 287.47 mas a year.
    let (_, vega) = star(catalog, 18_360_206);
    assert!((vega.pm_ra_mas_per_yr - 201.0).abs() < 1.0);
    assert!((vega.pm_dec_mas_per_yr - 287.5).abs() < 1.0);
}

#[test]
fn the_stars_of_the_papers_have_their_magnitudes_and_stand_where_tycho_2_has_them() {
    let Some(shared) = shared_dir() else { return };
    let mut checked = 0;
    for table in ["experiment-1.csv", "experiment-2.csv"] {
        let mut rows = csv::Reader::from_path(shared.join("seeds").join(table)).unwrap();
        let headings = rows.headers().unwrap().clone();
        for row in rows.records() {
            let row = row.unwrap();
            let value = |label: &str| -> f64 {
                let column = headings
                    .iter()
                    .position(|heading| heading == label)
                    .unwrap();
                row[column].parse().unwrap()
            };
            let (index, star) = star(Catalog::built_in(), value("skymap_number") as u32);
            let designation = Catalog::built_in().designation(index);
            assert_eq!(designation, format!("SKYMAP {}", &row[0]));
            // The papers print two decimals; SKY2000 has three for some stars.
            let rounded = (f64::from(star.v_mag) * 100.0).round() / 100.0;
            assert_eq!(rounded, value("vmag"), "{}", star.id);
            let tycho2 = from_degrees(value("tycho2_ra_deg"), value("tycho2_dec_deg"));
            let off_arcsec = star.direction.angle_to(&tycho2) * ARCSEC_PER_RAD;
            assert!(
                off_arcsec < TYCHO2_TOLERANCE_ARCSEC,
                "{}: {off_arcsec}″",
                star.id
            );
            checked += 1;
        }
    }
    assert_eq!(checked, 16);
}

/// SKY2000 repeats each position as a unit vector with six decimals: an oracle for the parser.
#[test]
fn every_position_agrees_with_the_unit_vector_in_its_record() {
    const VECTOR_TOLERANCE: f64 = 0.6e-6;
    let Some(source) = sky2000_file() else { return };
    let text = unpacked(&source);
    let catalog = Catalog::built_in();
    let mut by_id: Vec<&Star> = catalog.stars().iter().collect();
    by_id.sort_by_key(|star| star.id);
    let mut compared = 0;
    for record in text
        .split(|&byte| byte == b'\n')
        .filter(|record| record.len() == 521)
    {
        let number = |from: usize, to: usize| -> Option<f64> {
            let cell = str::from_utf8(&record[from - 1..to])
                .unwrap()
                .replace(' ', "");
            cell.parse().ok()
        };
        let id = StarId::Skymap(number(28, 35).unwrap() as u32);
        let Ok(index) = by_id.binary_search_by_key(&id, |star| star.id) else {
            continue;
        };
        let ours = by_id[index].direction;
        for (axis, from) in [194, 203, 212].into_iter().enumerate() {
            let theirs = number(from, from + 8).unwrap();
            assert!(
                (ours.as_vector()[axis] - theirs).abs() < VECTOR_TOLERANCE,
                "{id}"
            );
        }
        compared += 1;
    }
    assert_eq!(compared, 299_458);
}

// ---- Kinds of file, and what is wrong with them

/// A record of Polaris, overwritten with `edits` (first byte, counted from 1; text).
fn record(edits: &[(usize, &str)]) -> Vec<u8> {
    let mut record = vec![b' '; sky2000::RECORD_BYTES];
    let cells = [
        (1, "SKY2000"),
        (9, "J023149.08+891550.7"),
        (28, " 2480053"),
        (99, "  1alp UMi"),
        (119, " 23149.0837+891550.794"),
        (150, "+0.22953- 0.0118"),
        (233, " 2.00 "),
        (259, "+0.620"),
    ];
    for (first_byte, text) in cells.iter().chain(edits) {
        record[first_byte - 1..][..text.len()].copy_from_slice(text.as_bytes());
    }
    record
}

fn numbered(id: usize) -> Vec<u8> {
    record(&[(28, &format!("{id:>8}"))])
}

fn written(folder: &tempfile::TempDir, bytes: &[u8]) -> PathBuf {
    let path = folder.path().join("a catalogue by any name");
    fs::write(&path, bytes).unwrap();
    path
}

#[test]
fn line_ends_the_end_of_file_mark_and_gzip_make_no_difference() {
    let folder = tempfile::tempdir().unwrap();
    let (first, second) = (numbered(1), numbered(2));
    let expected = {
        let path = written(&folder, &[&first[..], b"\n", &second, b"\n"].concat());
        Catalog::read(&path).unwrap()
    };
    assert_eq!(expected.stars().len(), 2);
    assert_eq!(expected.name_of(StarIndex::new(1)), Some("1 alp UMi"));
    for content in [
        [&first[..], b"\n", &second].concat(),
        [&first[..], b"\r\n", &second, b"\r\n\x1a"].concat(),
        // Trailing blanks removed.
        [
            first.trim_ascii_end(),
            b"\n",
            second.trim_ascii_end(),
            b"\n",
        ]
        .concat(),
        [&first[..], b"\r\n", &second, b"\r\n"].concat(),
        gzip(&[&first[..], b"\n", &second, b"\n\x1a"].concat()),
        // Two gzip members in one file, as `cat a.gz b.gz` makes it.
        [gzip(&[&first[..], b"\n"].concat()), gzip(&second)].concat(),
        expected.to_compact(),
        gzip(&expected.to_compact()),
    ] {
        let read = Catalog::read(written(&folder, &content)).unwrap();
        let ids = |catalog: &Catalog| {
            catalog
                .stars()
                .iter()
                .map(|star| star.id)
                .collect::<Vec<_>>()
        };
        assert_eq!(ids(&read), ids(&expected));
        assert_eq!(read.checksum(), expected.checksum());
    }
}

#[test]
fn records_that_are_not_stars_are_counted_with_their_lines() {
    let folder = tempfile::tempdir().unwrap();
    let mut lines: Vec<Vec<u8>> = (1..=300).map(numbered).collect();
    lines[9] = record(&[(28, "      10"), (233, "      ")]);
    lines[19] = record(&[(28, "      20"), (119, &" ".repeat(22))]);
    lines[29] = record(&[(28, "      30"), (233, " 2.o0 ")]);
    lines[39].truncate(519); // Ends in a blank: not one of which the blanks were cut off.
    lines[49] = numbered(1);
    let (catalog, summary) = import(&written(&folder, &lines.join(&b'\n'))).unwrap();
    assert_eq!(catalog.stars().len(), 295);
    assert_eq!((summary.records, summary.stars), (300, 295));
    assert_eq!(
        (summary.without_magnitude, summary.without_position),
        (vec![10], vec![20])
    );
    let errors: Vec<String> = summary.unreadable.iter().map(ToString::to_string).collect();
    assert_eq!(
        errors,
        [
            "line 30, byte 233 (Vmag): found \" 2.o0 \", expected magnitudes from -32 to 32, in 0.001 mag",
            "line 40, byte 520: found the end of the line after 519 bytes, expected a record of 520 bytes",
            "line 50, byte 28 (ID): found SKYMAP 00000001, expected an identifier that no record before has",
        ]
    );
    assert_eq!(summary.unreadable[0].location, RecordLocation::Byte(233));
}

#[test]
fn more_than_one_percent_unreadable_is_refused_with_the_first_lines() {
    let folder = tempfile::tempdir().unwrap();
    let mut lines: Vec<Vec<u8>> = (1..=99).map(numbered).collect();
    lines[50][128] = b'x';
    let one_of_99 = import(&written(&folder, &lines.join(&b'\n')));
    assert!(matches!(
        one_of_99,
        Err(CatalogError::TooManyUnreadable { .. })
    ));
    lines.push(numbered(100));
    let (_, summary) = import(&written(&folder, &lines.join(&b'\n'))).unwrap();
    assert_eq!(summary.unreadable.len(), 1, "1 of 100 is tolerated");
    for line in &mut lines[1..] {
        line.insert(200, b' ');
    }
    let error = Catalog::read(written(&folder, &lines.join(&b'\n'))).unwrap_err();
    let message = error.to_string();
    assert!(
        message.contains("99 of 100 records are unreadable"),
        "{message}"
    );
    assert!(
        message.contains("line 2, byte 521: found \" \""),
        "{message}"
    );
    assert!(
        message.contains("line 6,") && !message.contains("line 7,"),
        "{message}"
    );
}

#[test]
fn a_file_of_unknown_kind_is_refused_with_the_known_kinds() {
    let folder = tempfile::tempdir().unwrap();
    for content in [
        &b""[..],
        b"\x89PNG\r\n\x1a\n",
        b"x,y,flux\n1,2,3\n",
        b"no table at all",
        &[0; 5000],
        &gzip(b"SIMPLE  =                    T"),
    ] {
        let error = Catalog::read(written(&folder, content)).unwrap_err();
        assert!(matches!(error, CatalogError::UnknownKind { .. }), "{error}");
        let message = error.to_string();
        assert!(
            message.contains("by any name") && message.contains("compact"),
            "{message}"
        );
    }
    let compact = written(&folder, &Catalog::built_in().limited_to(0.0).to_compact());
    let error = import(&compact).unwrap_err();
    assert!(matches!(error, CatalogError::UnknownKind { .. }), "{error}");
    let error = sky2000::write_bright_csv(&compact, 6.5, &folder.path().join("out")).unwrap_err();
    assert!(error.to_string().contains("STARCAT"), "{error}");
    assert!(!folder.path().join("out").exists());
}

#[test]
fn errors_of_the_system_name_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let error = Catalog::read(folder.path().join("absent.gz")).unwrap_err();
    assert!(matches!(error, CatalogError::Open { .. }) && error.to_string().contains("absent.gz"));
    let catalog = Catalog::new("none", vec![], vec![]).unwrap();
    let error = catalog
        .write_compact(&folder.path().join("no/folder"))
        .unwrap_err();
    assert!(matches!(error, CatalogError::Write { .. }), "{error}");

    let lines: Vec<Vec<u8>> = (1..=300).map(numbered).collect();
    let mut packed = gzip(&lines.join(&b'\n'));
    packed.truncate(packed.len() - 20);
    let error = Catalog::read(written(&folder, &packed)).unwrap_err();
    assert!(
        matches!(error, CatalogError::Read { .. }),
        "cut short: {error}"
    );
    let mut damaged = catalog.to_compact();
    damaged.pop();
    let error = Catalog::read(written(&folder, &damaged)).unwrap_err();
    assert!(matches!(error, CatalogError::Compact { .. }), "{error}");
    let only_blank = record(&[(233, "      ")]);
    let error = Catalog::read(written(&folder, &only_blank)).unwrap_err();
    assert!(matches!(error, CatalogError::NoStars { .. }), "{error}");
}

#[test]
fn a_catalog_is_written_at_once_and_readable_by_others() {
    let folder = tempfile::tempdir().unwrap();
    let path = written(&folder, b"an older file");
    let catalog = Catalog::built_in().limited_to(3.0);
    catalog.write_compact(&path).unwrap();
    assert_eq!(Catalog::read(&path).unwrap(), catalog);
    assert_eq!(
        fs::read_dir(folder.path()).unwrap().count(),
        1,
        "no temporary file is left"
    );
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let beside = written(&folder, b"").with_file_name("beside");
        fs::write(&beside, b"").unwrap();
        catalog.write_compact(&path).unwrap();
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&path), mode(&beside));
    }
}

#[test]
fn tables_are_read_by_their_labels_whatever_separates_them() {
    let folder = tempfile::tempdir().unwrap();
    let labels = "Vmag ID RAh RAm RAs DE- DEd DEm DEs SpMK B-V pmRA pmDE Name extra";
    let units = "mag _ h min s _ deg arcmin arcsec _ mag s/a arcsec/a _ _";
    let dashes = "------ -------- -- -- ------- - -- -- ------ --- ------ --- --- --- -";
    let values = "2.00 2480053 2 31 49.0837 + 89 15 50.794 F7: +0.620 +0.22953 -0.0118 1alp_UMi 7";
    let reference = written(&folder, &record(&[]));
    let expected = Catalog::read(&reference).unwrap();
    for separator in ["\t", ";", "|", ","] {
        let row = |text: &str| text.replace(' ', separator).replace('_', " ");
        let plain = format!("{}\n{}\n", row(labels), row(values));
        let vizier = format!(
            "#\n#   VizieR\n#Column\tVmag\n\n{}\n{}\n{}\n{}\n\n",
            row(labels),
            row(units),
            row(dashes),
            row(values)
        );
        for text in [plain, vizier.clone(), vizier.replace('\n', "\r\n")] {
            let read = Catalog::read(written(&folder, text.as_bytes())).unwrap();
            assert_eq!(read.stars(), expected.stars(), "{text}");
            assert_eq!(read.name_of(StarIndex::new(0)), Some("1 alp UMi"));
        }
    }
}

#[test]
fn a_table_that_lacks_a_column_or_has_a_bad_row_says_which() {
    let folder = tempfile::tempdir().unwrap();
    let error = Catalog::read(written(&folder, b"# x\nID,RAh,RAm,RAs,DE-,DEd,DEs\n")).unwrap_err();
    let message = error.to_string();
    assert!(
        message.contains("line 2: the table has no column DEm, Vmag"),
        "{message}"
    );

    let mut text = String::from("ID,RAh,RAm,RAs,DE-,DEd,DEm,DEs,Vmag\n");
    for id in 1..=300 {
        text += &format!("{id},2,31,49.0837,+,89,15,50.794,2.00\n");
    }
    let text = text.replace("\n7,2,31,", "\n# a comment\n\n7,2,61,");
    let text = text.replace("\n9,2,31,", "\n9,31,");
    let (_, summary) = import(&written(&folder, text.as_bytes())).unwrap();
    let errors: Vec<String> = summary.unreadable.iter().map(ToString::to_string).collect();
    assert_eq!(
        errors,
        [
            "line 10, column 3 (RAm): found \"61\", expected minutes from 0 to 59",
            "line 12, column 9: found 8 columns, \"9,31,49.0837,+,89,15,50.794,2.00\", expected as many columns as headings",
        ]
    );
}

#[test]
fn a_catalog_refuses_what_the_compact_form_cannot_hold() {
    let star = |id| Star::new(StarId::Skymap(id), from_degrees(10.0, 20.0), 5.0);
    let new = |stars, names| Catalog::new("", stars, names).unwrap_err();
    let name = |id, text: &str| (StarId::Skymap(id), text.to_owned());

    let error = new(vec![star(1), star(1)], vec![]);
    assert!(
        matches!(
            error,
            CatalogError::DuplicateStar {
                id: StarId::Skymap(1)
            }
        ),
        "{error}"
    );
    for broken in [
        Star {
            v_mag: f32::NAN,
            ..star(1)
        },
        Star {
            v_mag: 40.0,
            ..star(1)
        },
        Star {
            bv_mag: Some(-33.0),
            ..star(1)
        },
        Star {
            pm_ra_mas_per_yr: 40_000.0,
            ..star(1)
        },
        Star {
            pm_dec_mas_per_yr: f32::INFINITY,
            ..star(1)
        },
        Star {
            direction: UnitVector::from_ra_dec(f64::NAN, 0.0),
            ..star(1)
        },
    ] {
        let error = new(vec![broken], vec![]);
        assert!(matches!(error, CatalogError::OutOfRange { .. }), "{error}");
    }
    for names in [
        vec![name(2, "of no star")],
        vec![name(1, "first"), name(1, "second")],
        vec![name(1, "")],
        vec![name(1, &"x".repeat(256))],
    ] {
        let error = new(vec![star(1)], names);
        assert!(matches!(error, CatalogError::BadName { .. }), "{error}");
    }
}

// ---- Properties

fn any_id() -> impl Strategy<Value = StarId> {
    let tycho = (1..9538_u32, 1..12_122_u32, 1..5_u32);
    let component = prop::option::of(b'A'..=b'Z');
    prop_oneof![
        (1..99_999_999_u32).prop_map(StarId::Skymap),
        tycho.prop_map(|(a, b, c)| StarId::Tycho(TychoId::new(a, b, c).unwrap())),
        (1..120_405_u32, component)
            .prop_map(|(n, c)| StarId::Hipparcos(HipparcosId::new(n, c).unwrap())),
        any::<u64>().prop_map(StarId::Number),
        any::<u32>().prop_map(StarId::Named),
    ]
}

/// A star whose values are multiples of the compact form's steps.
fn any_star() -> impl Strategy<Value = Star> {
    let place = (0.0..360.0_f64, -89.9..89.9_f64);
    let photometry = (-2000..15_000_i16, prop::option::of(-500..6000_i16));
    let motion = (any::<i16>(), any::<i16>());
    (any_id(), place, photometry, motion).prop_map(|(id, place, photometry, motion)| Star {
        direction: from_degrees(place.0, place.1),
        bv_mag: photometry.1.map(|mmag| f32::from(mmag) / 1000.0),
        pm_ra_mas_per_yr: f32::from(motion.0.max(-i16::MAX)),
        pm_dec_mas_per_yr: f32::from(motion.1.max(-i16::MAX)),
        flags: StarFlags::VARIABLE.union(StarFlags::MULTIPLE),
        ..Star::new(id, from_degrees(0.0, 0.0), f32::from(photometry.0) / 1000.0)
    })
}

proptest! {
    #[test]
    fn the_compact_form_gives_back_what_it_was_given(stars in prop::collection::vec(any_star(), 0..50)) {
        let mut stars = stars;
        stars.sort_by_key(|star| star.id);
        stars.dedup_by_key(|star| star.id);
        let names: Vec<_> = stars.iter().step_by(3).map(|star| (star.id, format!("α {}", star.id))).collect();
        // All kinds, and Skymap numbers alone, which have another format.
        let skymap: Vec<Star> = stars.iter().filter(|star| matches!(star.id, StarId::Skymap(_))).copied().collect();
        let only_skymap = Catalog::new("", skymap, vec![]).unwrap();
        prop_assert_eq!(only_skymap.to_compact()[8], 1);
        prop_assert_eq!(Catalog::from_compact(&only_skymap.to_compact()).unwrap().checksum(), only_skymap.checksum());
        let catalog = Catalog::new("a title", stars, names).unwrap();
        let encoded = catalog.to_compact();
        let decoded = Catalog::from_compact(&encoded).unwrap();
        prop_assert_eq!(decoded.checksum(), catalog.checksum());
        prop_assert_eq!(decoded.title(), "a title");
        prop_assert_eq!(decoded.to_compact(), encoded);
        for (index, (ours, theirs)) in decoded.stars().iter().zip(catalog.stars()).enumerate() {
            // Half the step of 0.5 mas in each coordinate.
            prop_assert!(ours.direction.angle_to(&theirs.direction) < 0.0004 * RAD_PER_ARCSEC);
            prop_assert_eq!(Star { direction: theirs.direction, ..*ours }, *theirs);
            prop_assert_eq!(decoded.name_of(StarIndex::new(index)), catalog.name_of(StarIndex::new(index)));
        }
    }

    #[test]
    fn no_content_makes_the_reading_panic(content in prop::collection::vec(any::<u8>(), 0..300)) {
        let folder = tempfile::tempdir().unwrap();
        let _ = Catalog::read(written(&folder, &content));
        let _ = Catalog::read(written(&folder, &[b"SKY2000 J", &content[..]].concat()));
        let _ = Catalog::read(written(&folder, &[b"\x1f\x8b\x08", &content[..]].concat()));
        let headings = b"ID,RAh,RAm,RAs,DE-,DEd,DEm,DEs,Vmag\n";
        let _ = Catalog::read(written(&folder, &[headings, &content[..]].concat()));
    }

    #[test]
    fn a_record_with_anything_in_it_does_not_panic(
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..40),
    ) {
        let folder = tempfile::tempdir().unwrap();
        let mut line = record(&[]);
        for (at, byte) in edits {
            line[9..][at.index(sky2000::RECORD_BYTES - 9)] = byte;
        }
        let _ = Catalog::read(written(&folder, &line));
    }
}
