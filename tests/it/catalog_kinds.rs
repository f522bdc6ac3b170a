//! Every kind of catalogue through the program: what is read, refused and reported.

use crate::common::{Ran, Truth, fixture, gzip, number, shared_dir, starpipe};
use proptest::prelude::*;
use starpipe::base::coords::UnitVector;
use starpipe::base::units::{ARCSEC_PER_RAD, RAD_PER_DEG};
use starpipe::catalog::{Catalog, LoadedCatalog, Star, StarFlags, StarId, StarIndex, TychoId};
use std::fs;
use std::path::{Path, PathBuf};

/// The step of positions, half a milliarcsecond, plus rounding in the tables of this file.
const POSITION_TOLERANCE_ARCSEC: f64 = 0.005;

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn path(&self) -> &Path {
        self.0.path()
    }

    fn write(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path().join(name);
        fs::write(&path, content).unwrap();
        path
    }

    /// `starpipe catalog import` of `source`; the compact file is `out.cat`.
    fn import(&self, source: &Path) -> Ran {
        let out = self.path().join("out.cat");
        Ran::new(
            starpipe()
                .args(["catalog", "import"])
                .arg(source)
                .arg("-o")
                .arg(out),
        )
    }

    /// The error message of importing a table with this content.
    fn refused(&self, content: impl AsRef<[u8]>) -> String {
        let ran = self.import(&self.write("table", content));
        assert_eq!(ran.status, 1, "{}", ran.stdout);
        assert!(
            ran.stderr.contains("table"),
            "names the file: {}",
            ran.stderr
        );
        assert!(!self.path().join("out.cat").exists(), "nothing is written");
        ran.stderr
    }
}

fn read(path: &Path) -> LoadedCatalog {
    starpipe::catalog::read(path).unwrap()
}

fn off_arcsec(star: &Star, ra_deg: f64, dec_deg: f64) -> f64 {
    let there = UnitVector::from_ra_dec(ra_deg * RAD_PER_DEG, dec_deg * RAD_PER_DEG);
    star.direction.angle_to(&there) * ARCSEC_PER_RAD
}

fn star<'a>(catalog: &'a Catalog, designation: &str) -> &'a Star {
    let stars = 0..catalog.stars().len();
    let index = stars
        .into_iter()
        .find(|&i| catalog.designation(StarIndex::new(i)) == designation);
    &catalog.stars()[index.unwrap_or_else(|| panic!("no star {designation}"))]
}

// ---- Tables made of SKY2000's bright stars

/// A row of the bright CSV.
struct Bright {
    id: String,
    ra: [String; 3],
    dec: [String; 4],
    motion: [String; 2],
    v_mag: String,
    v_derived: String,
    color: String,
}

impl Bright {
    fn all() -> Vec<Self> {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("catalogs/sky2000-bright.csv");
        let mut rows = csv::Reader::from_path(path).unwrap();
        let labels = rows.headers().unwrap().clone();
        rows.records()
            .map(|row| {
                let row = row.unwrap();
                let cell =
                    |label: &str| row[labels.iter().position(|l| l == label).unwrap()].to_owned();
                Self {
                    id: cell("ID"),
                    ra: ["RAh", "RAm", "RAs"].map(cell),
                    dec: ["DE-", "DEd", "DEm", "DEs"].map(cell),
                    motion: ["pmRA", "pmDE"].map(cell),
                    v_mag: cell("Vmag"),
                    v_derived: cell("Vder"),
                    color: cell("B-V"),
                }
            })
            .collect()
    }

    fn ra_deg(&self) -> f64 {
        let [h, m, s] = [0, 1, 2].map(|i| self.ra[i].parse::<f64>().unwrap());
        (h + m / 60.0 + s / 3600.0) * 15.0
    }

    fn dec_deg(&self) -> f64 {
        let [d, m, s] = [1, 2, 3].map(|i| self.dec[i].parse::<f64>().unwrap());
        let sign = if self.dec[0] == "-" { -1.0 } else { 1.0 };
        sign * (d + m / 60.0 + s / 3600.0)
    }

    fn v(&self) -> &str {
        if self.v_mag.is_empty() {
            &self.v_derived
        } else {
            &self.v_mag
        }
    }

    fn sexagesimal(&self, separator: &str) -> [String; 2] {
        let [h, m, s] = &self.ra;
        let [sign, degrees, minutes, seconds] = &self.dec;
        [
            format!("{h:0>2}{separator}{m:0>2}{separator}{s:0>7}"),
            format!("{sign}{degrees:0>2}{separator}{minutes:0>2}{separator}{seconds:0>6}"),
        ]
    }
}

/// As VizieR answers `-mime=tsv` (tabs) or `csv` (semicolons), with its computed degrees.
fn vizier_in_degrees(separator: &str) -> String {
    let line = |cells: &[&str]| cells.join(separator) + "\n";
    let mut text = String::from(
        "#\n#   VizieR Astronomical Server vizier.cds.unistra.fr\n#\n#RESOURCE=yCat_5145\n#Name: V/145\n\
         #Table\tV_145_sky2kv5:\n#Column\t_RAJ2000\t(F10.6)\tRight ascension (FK5, Equinox=J2000.0) at \
         Epoch=J2000, proper motions taken into account \t[ucd=pos.eq.ra]\n#Column\tID\t(I8)\tSkymap number\n\n",
    );
    text += &line(&[
        "_RAJ2000", "_DEJ2000", "recno", "ID", "pmRA", "pmDE", "Vmag", "Vder", "B-V",
    ]);
    text += &line(&[
        "deg",
        "deg",
        "",
        "",
        "s/yr",
        "arcsec/yr",
        "mag",
        "mag",
        "mag",
    ]);
    text += &line(&["----------"; 9]);
    for (number, row) in Bright::all().iter().enumerate() {
        let (ra, dec) = (
            format!("{:010.6}", row.ra_deg()),
            format!("{:+010.6}", row.dec_deg()),
        );
        let id = format!("{:>8}", row.id);
        let [pm_ra, pm_dec] = &row.motion;
        let recno = (number + 1).to_string();
        text += &line(&[
            &ra,
            &dec,
            &recno,
            &id,
            pm_ra,
            pm_dec,
            &row.v_mag,
            &row.v_derived,
            &row.color,
        ]);
    }
    text + "\n"
}

/// As VizieR answers with `-oc.form=sexa`, with bars between columns and the line of units.
fn vizier_sexagesimal() -> String {
    let mut text = String::from(
        "#\n\nRAJ2000|DEJ2000|ID|Vmag|Vder\n\"h:m:s\"|\"d:m:s\"||mag|mag\n----|----|---|---|---\n",
    );
    for row in Bright::all() {
        let [ra, dec] = row.sexagesimal(" ");
        text += &format!("{ra}|{dec}|{}|{}|{}\n", row.id, row.v_mag, row.v_derived);
    }
    text
}

fn generic_csv(separator: &str) -> String {
    let mut text = String::from("name,ra,dec,vmag\n");
    for row in Bright::all() {
        let [ra, dec] = row.sexagesimal(separator);
        text += &format!("star {},{ra},{dec},{}\n", row.id, row.v());
    }
    text
}

fn assert_is_bright(catalog: &Catalog, tolerance_arcsec: f64) {
    let built_in = Catalog::built_in();
    assert_eq!(catalog.stars().len(), 8787);
    let mut by_id: Vec<(String, &Star)> = built_in.stars()[..8787]
        .iter()
        .map(|star| (star.id.to_string(), star))
        .collect();
    by_id.sort_by(|a, b| a.0.cmp(&b.0));
    for (index, ours) in catalog.stars().iter().enumerate() {
        let designation = catalog.designation(StarIndex::new(index));
        let digits = designation.trim_start_matches(|c: char| !c.is_ascii_digit());
        let key = format!("SKYMAP {digits:0>8}");
        let theirs = by_id[by_id.binary_search_by(|entry| entry.0.cmp(&key)).unwrap()].1;
        assert_eq!(ours.v_mag, theirs.v_mag, "{designation}");
        let off_arcsec = ours.direction.angle_to(&theirs.direction) * ARCSEC_PER_RAD;
        assert!(
            off_arcsec < tolerance_arcsec,
            "{designation}: {off_arcsec}″"
        );
        if !ours.flags.contains(StarFlags::NO_PROPER_MOTION) {
            assert!(
                (ours.pm_ra_mas_per_yr - theirs.pm_ra_mas_per_yr).abs() < 0.51,
                "{designation}"
            );
            assert!(
                (ours.pm_dec_mas_per_yr - theirs.pm_dec_mas_per_yr).abs() < 0.51,
                "{designation}"
            );
        }
    }
}

#[test]
fn exports_from_vizier_and_any_tables_hold_the_same_stars() {
    let folder = Folder::new();
    for separator in ["\t", ";", ","] {
        let text = vizier_in_degrees(separator);
        for text in [text.clone(), text.replace('\n', "\r\n")] {
            let reading = read(&folder.write("vizier", &text));
            assert_eq!(reading.files[0].summary.left_out(), None);
            assert_is_bright(&reading.catalog, POSITION_TOLERANCE_ARCSEC);
            let motions = reading.catalog.stars().iter();
            let unknown = motions.filter(|star| star.flags.contains(StarFlags::NO_PROPER_MOTION));
            assert!(
                unknown.count() < 10,
                "proper motions are read, from seconds of time"
            );
            assert!(matches!(reading.catalog.stars()[0].id, StarId::Skymap(_)));
        }
    }
    assert_is_bright(
        &read(&folder.write("sixtieths", vizier_sexagesimal())).catalog,
        1e-4,
    );
    for separator in [":", " "] {
        assert_is_bright(
            &read(&folder.write("generic.csv", generic_csv(separator))).catalog,
            1e-4,
        );
    }
    // Two exports joined by `cat`: headings, units and dashes are repeated.
    let export = vizier_in_degrees("\t");
    let lines: Vec<&str> = export.lines().collect();
    let joined = [&lines[..1000], &[""], &lines[..12], &lines[1000..]]
        .concat()
        .join("\n");
    let reading = read(&folder.write("joined", joined));
    assert_eq!(
        reading.files[0].summary.to_string(),
        "8787 records, 8787 stars"
    );
}

#[test]
fn a_frame_is_identified_with_each_kind() {
    let folder = Folder::new();
    let truth = Truth {
        ra_deg: 83.7,
        dec_deg: -0.4,
        fov_x_deg: 20.0,
    };
    let frame = fixture("orion/orion.png");
    let compact = folder.path().join("compact");
    read(&folder.write("t.tsv", vizier_in_degrees("\t")))
        .catalog
        .write_compact(&compact)
        .unwrap();
    let inside = folder.path().join("directory");
    fs::create_dir(&inside).unwrap();
    fs::write(inside.join("README"), "Nothing to read\nhere.\n").unwrap();
    fs::write(
        inside.join("stars.csv.gz"),
        gzip(generic_csv(":").as_bytes()),
    )
    .unwrap();
    for path in [
        folder.write("vizier.tsv", vizier_in_degrees("\t")),
        folder.write("vizier.csv", vizier_in_degrees(";")),
        folder.write("generic.csv", generic_csv(" ")),
        compact,
        inside,
    ] {
        let ran = Ran::new(
            starpipe()
                .args(["process", "--format", "json", "--catalog"])
                .arg(&path)
                .arg(&frame),
        );
        assert_eq!(
            (ran.status, ran.stderr.as_str()),
            (0, ""),
            "{}",
            path.display()
        );
        let report = &ran.reports()[0];
        assert!(truth.centre_error_deg(report) < 0.003, "{}", path.display());
        assert!(number(report, "/match/matched") >= 50.0);
    }
}

// ---- Tycho-2

/// Records of CDS I/259 (Høg et al. 2000, A&A 355, L27), each a special case.
const TYCHO2_MAIN: &str = "\
3124 02056 1| |286.00694770| 40.11621858|  -20.8|  -26.1|  6|  6| 0.8| 0.8|1990.63|1990.85|20|0.8|0.7|0.9|0.8| 9.842|0.022| 7.929|0.011|999|T| 93631   |286.00701139| 40.11627889|1.61|1.67|  5.8|  5.9| | 0.1
1675 00198 1|X|            |            |       |       |   |   |    |    |       |       |  |   |   |   |   |13.599|0.407|12.115|0.199|999| |         |320.65787417| 21.30806722|1.63|1.79|110.9|109.9| |-0.1
4376 00685 1|P|138.24797425| 69.63890173|  -18.9|  -52.3| 21| 19| 1.9| 1.8|1989.84|1990.14| 5|0.3|0.3|0.3|0.3|10.820|0.035|10.244|0.030|  9|T|         |138.24793611| 69.63902500|1.62|1.65| 20.6| 19.2|D|-0.1
4376 00685 2|P|138.24797425| 69.63890173|  -18.9|  -52.3| 21| 19| 1.9| 1.8|1989.84|1990.14| 5|0.3|0.3|0.3|0.3|11.645|0.060|10.896|0.052|  9|T|         |138.24863861| 69.63901722|1.62|1.64| 44.8| 41.8|D|-0.1
0077 01286 1| | 63.94277263|  3.26324035|   -4.9|  -10.1| 53| 55| 1.7| 1.7|1967.98|1965.43| 5|0.5|0.2|0.5|0.2|      |     |11.189|0.131|999| |         | 63.94277139|  3.26326528|1.82|1.75|129.1|147.5| |-0.1
0077 00412 1| | 64.92261166|  3.76889045|   23.5|   -6.6| 95|106| 2.7| 2.7|1969.49|1961.52| 2|   |   |   |   |11.690|0.132|      |     |999| |         | 64.92255667|  3.76890611|1.62|1.44|111.5|133.6| |-0.1
0049 01674 1| | 39.65333898|  3.44319968|   31.7|    5.9|  4|  4| 0.9| 1.0|1991.30|1991.35|21|1.2|1.0|1.2|1.1| 7.507|0.015| 6.348|0.010|  9|T| 12318A  | 39.65326611|  3.44318583|1.76|1.73|  3.6|  4.3| |-0.2
";
const TYCHO2_SUPPLEMENT_1: &str = "\
0002 00580 1|T|003.03708871|+01.57351477|       |       | 42.9| 39.5|     |     | |11.688|0.122|11.171|0.121|999|T|       \n\
0049 01674 1|H|039.65311086|+03.44338599|   34.9|    7.9| 36.8| 24.6|  1.2|  1.2|H|      |     |10.511|0.130|  9|T| 12318B\n\
5949 02777 1|H|101.28854105|-16.71314306| -546.0|-1223.1|  1.2|  1.0|  1.3|  1.2|H|      |     |-1.088|0.002|999| | 32349 \n\
5331 01752 1|H|078.63446353|-08.20163919|    1.9|   -0.6|  0.6|  0.5|  0.7|  0.5| | 0.312|0.012| 0.283|0.010|999|T| 24436 \n";
const TYCHO2_SUPPLEMENT_2: &str = "0015 01286 1|T|014.75945681|+02.66526179|       |       | 68.9| 56.9|     |     | |12.417|0.374|11.063|0.163|236|T|\n";

#[test]
fn tycho_2_is_read_record_by_record_as_it_is_described() {
    let folder = Folder::new();
    let reading = read(&folder.write("tyc2.dat", TYCHO2_MAIN));
    let catalog = &reading.catalog;
    assert_eq!(reading.files[0].summary.to_string(), "7 records, 7 stars");

    let plain = star(catalog, "TYC 3124-2056-1");
    assert!(off_arcsec(plain, 286.006_947_70, 40.116_218_58) < 4e-4);
    assert_eq!(
        (plain.pm_ra_mas_per_yr, plain.pm_dec_mas_per_yr),
        (-20.8, -26.1)
    );
    // V = 7.929 − 0.090 · 1.913, B−V = 0.850 · 1.913
    assert_eq!((plain.v_mag, plain.bv_mag), (7.757, Some(1.626)));
    assert_eq!(plain.flags, StarFlags::DERIVED_MAGNITUDE);

    let unmoving = star(catalog, "TYC 1675-198-1");
    assert!(off_arcsec(unmoving, 320.657_874_17, 21.308_067_22) < 4e-4);
    assert!(unmoving.flags.contains(StarFlags::NO_PROPER_MOTION));

    // Both have the photocentre's mean position; by the record they are 0.9″ apart.
    let pair = ["TYC 4376-685-1", "TYC 4376-685-2"].map(|id| star(catalog, id));
    let apart_arcsec = pair[0].direction.angle_to(&pair[1].direction) * ARCSEC_PER_RAD;
    assert!((apart_arcsec - 0.9).abs() < 0.1, "{apart_arcsec}");
    for star in pair {
        assert!(off_arcsec(star, 138.247_974_25, 69.638_901_73) < 0.9);
        assert!(star.flags.contains(StarFlags::MULTIPLE));
    }

    assert_eq!(
        star(catalog, "TYC 77-1286-1").v_mag,
        11.189,
        "VT alone is V"
    );
    // BT alone: 11.690 − 1.090 · 0.721
    assert_eq!(star(catalog, "TYC 77-412-1").v_mag, 10.904);
    assert_eq!(star(catalog, "TYC 77-412-1").bv_mag, None);
}

#[test]
fn the_supplement_is_brought_to_j2000_and_read_together_with_the_main_catalogue() {
    let folder = Folder::new();
    folder.write("tyc2.dat.00", TYCHO2_MAIN);
    folder.write("suppl_1.dat.gz", gzip(TYCHO2_SUPPLEMENT_1.as_bytes()));
    folder.write("suppl_2.dat", TYCHO2_SUPPLEMENT_2);
    folder.write("index.dat", "      1|     1|  0.00|  2.49|  0.00|  2.49\n");
    folder.write("ReadMe", "I/259               The Tycho-2 Catalogue\n");
    let ran = folder.import(folder.path());
    assert_eq!((ran.status, ran.stderr.as_str()), (0, ""));
    assert!(
        ran.stdout
            .contains("suppl_1.dat.gz (Tycho-2, supplement 1): 4 records, 4 stars"),
        "{}",
        ran.stdout
    );
    assert!(
        ran.stdout
            .contains("suppl_2.dat (Tycho-2, supplement 2, left out"),
        "{}",
        ran.stdout
    );
    assert!(
        ran.stdout.contains("out.cat: 11 stars, Tycho-2 Catalogue"),
        "{}",
        ran.stdout
    );

    let catalog = Catalog::read(folder.path().join("out.cat")).unwrap();
    // Sirius, which moves by 1.3″ a year, and SKY2000's position of 2000.
    let sirius = star(&catalog, "TYC 5949-2777-1");
    let sky2000 = star(Catalog::built_in(), "SKYMAP 06450045");
    assert!(sirius.direction.angle_to(&sky2000.direction) * ARCSEC_PER_RAD < 0.05);
    assert_eq!(sirius.v_mag, -1.088, "Hp stands for V");
    let moved = off_arcsec(sirius, 101.288_541_05, -16.713_143_06);
    assert!((moved - 8.75 * 1.3394).abs() < 0.01, "{moved}");
    assert_eq!(star(&catalog, "TYC 5331-1752-1").v_mag, 0.28);
    // The companion has its primary's TYC number.
    assert_eq!(star(&catalog, "HIP 12318B").v_mag, 10.511);
    assert_eq!(star(&catalog, "TYC 49-1674-1").bv_mag, Some(0.985));

    // Without its blanks the supplement looks like the main catalogue; it is still read correctly.
    fs::remove_file(folder.path().join("suppl_1.dat.gz")).unwrap();
    fs::remove_file(folder.path().join("suppl_2.dat")).unwrap();
    fs::remove_file(folder.path().join("out.cat")).unwrap();
    let cut: Vec<&str> = TYCHO2_SUPPLEMENT_1.lines().map(str::trim_end).collect();
    folder.write("suppl_1.dat", cut.join("\n"));
    assert_eq!(read(folder.path()).catalog.stars().len(), 11);

    folder.write("suppl_2.dat", TYCHO2_SUPPLEMENT_2);
    let alone = folder.import(&folder.path().join("suppl_2.dat"));
    assert_eq!(
        alone.status, 0,
        "asked for by name it is read: {}",
        alone.stderr
    );
    let found = star(
        &Catalog::read(folder.path().join("out.cat")).unwrap(),
        "TYC 15-1286-1",
    )
    .v_mag;
    assert_eq!(found, 10.941);
}

#[test]
fn damaged_records_of_tycho_2_are_named() {
    let folder = Folder::new();
    let line = TYCHO2_MAIN.lines().next().unwrap();
    let mut lines: Vec<String> = (1..=400)
        .map(|n| format!("3124 {n:05}{}", &line[10..]))
        .collect();
    lines[4] = lines[4].replace(" 40.11621858|", " 94.11621858|");
    lines[7] = lines[7].replace("| 9.842|", "| 9.x42|");
    lines[9] = lines[9]
        .replace("| 9.842|", "|      |")
        .replace("| 7.929|", "|      |");
    lines[11].truncate(100);
    let ran = folder.import(&folder.write("tyc2.dat", lines.join("\r\n")));
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let expected =
        "400 records, 396 stars, 1 without a magnitude (line 10), 3 unreadable (lines 5, 8, 12)";
    assert!(ran.stdout.contains(expected), "{}", ran.stdout);

    lines.truncate(200);
    let ran = folder.import(&folder.write("tyc2.dat", lines.join("\n")));
    assert_eq!(ran.status, 1);
    for part in [
        "3 of 200 records are unreadable",
        "line 5, byte 29 (DEmdeg): found \" 94.11621858\", expected a declination",
        "line 8, byte 111 (BTmag): found \" 9.x42\", expected a magnitude",
        "line 12, byte 1: found 15 fields",
    ] {
        assert!(ran.stderr.contains(part), "{}", ran.stderr);
    }
    let twice = folder.import(&folder.write("tyc2.dat", [TYCHO2_MAIN, TYCHO2_MAIN].concat()));
    assert_eq!(twice.status, 1);
    assert!(
        twice.stderr.contains(
            "(TYC): found TYC 3124-2056-1, expected an identifier that no record before has"
        ),
        "{}",
        twice.stderr
    );
}

#[test]
fn the_whole_of_tycho_2_becomes_stars() {
    let Some(path) = std::env::var_os("STARPIPE_TYCHO2") else {
        eprintln!("skipped: STARPIPE_TYCHO2 does not say where Tycho-2 is");
        return;
    };
    let reading = read(Path::new(&path));
    let records: u64 = reading.files.iter().map(|file| file.summary.records).sum();
    assert_eq!(records, 2_539_913 + 17_588);
    assert_eq!(reading.catalog.stars().len(), 2_557_501);
    assert!(
        reading
            .files
            .iter()
            .all(|file| file.summary.left_out().is_none())
    );
    assert_eq!(
        Catalog::from_compact(&reading.catalog.to_compact())
            .unwrap()
            .checksum(),
        reading.catalog.checksum()
    );
    let Some(_) = shared_dir() else { return };
    // It contains nearly all of SKY2000's bright stars, at the same position and magnitude.
    let bright: Vec<&Star> = Catalog::built_in().stars()[..15_424].iter().collect();
    let grid = starpipe::catalog::sky_grid::SkyGrid::new(reading.catalog.stars());
    let has_twin = |star: &&&Star| {
        let mut twin = false;
        grid.for_each_within(
            &star.direction,
            2.0 / ARCSEC_PER_RAD,
            star.v_mag + 0.3,
            |found| {
                twin |= (found.v_mag - star.v_mag).abs() < 0.3;
            },
        );
        twin
    };
    let twins = bright.iter().filter(has_twin).count();
    assert!(twins > 14_900, "{twins}");
}

// ---- Other people's tables

#[test]
fn hipparcos_and_gaia_tables_are_read_with_their_own_units_and_epochs() {
    let folder = Folder::new();
    let hipparcos = "#Column\tRAICRS\t(F12.8)\t*? alpha, degrees (ICRS, Epoch=J1991.25) (H8)\n\
        HIP;RAICRS;DEICRS;Vmag;pmRA;pmDE;B-V\n;deg;deg;mag;mas/yr;mas/yr;mag\n------;---;---;---;---;---;---\n\
        32349;101.28854105;-16.71314306;-1.44;-546.01;-1223.08;0.009\n";
    let reading = read(&folder.write("hip", hipparcos));
    let sirius = star(&reading.catalog, "HIP 32349");
    let sky2000 = star(Catalog::built_in(), "SKYMAP 06450045");
    assert!(sirius.direction.angle_to(&sky2000.direction) * ARCSEC_PER_RAD < 0.05);
    assert_eq!((sirius.v_mag, sirius.bv_mag), (-1.44, Some(0.009)));
    let kind = &reading.files[0].kind;
    assert!(
        kind.contains("identifier HIP, position RAICRS and DEICRS, V Vmag")
            && kind.contains("J1991.25"),
        "{kind}"
    );

    let gaia = "source_id,ra,dec,ref_epoch,pmra,pmdec,phot_g_mean_mag\n\
        6917528443525529728,10.0,60.0,2016.0,1000.0,-500.0,12.25\n\
        4472832130942575872,20.0,-60.0,2016.0,,,9.5\n";
    let reading = read(&folder.write("gaia", gaia));
    let found = star(&reading.catalog, "GAIA 6917528443525529728");
    let (ra, dec) = (10.0 - 16.0 / 3600.0 / 0.5, 60.0 + 8.0 / 3600.0);
    assert!(off_arcsec(found, ra, dec) < 0.01);
    // Without a color, V is that of a star of the median color.
    assert_eq!(found.v_mag, 12.428);
    assert!(
        star(&reading.catalog, "GAIA 4472832130942575872")
            .flags
            .contains(StarFlags::NO_PROPER_MOTION)
    );
    assert!(
        reading.files[0].kind.contains("V from phot_g_mean_mag"),
        "{}",
        reading.files[0].kind
    );
    // The compact form keeps nineteen digits.
    let again = Catalog::from_compact(&reading.catalog.to_compact()).unwrap();
    assert_eq!(
        again.designation(StarIndex::new(1)),
        reading.catalog.designation(StarIndex::new(1))
    );

    // VizieR's computed positions are at J2000, whatever the catalogue's epoch.
    let computed =
        "source_id,_RAJ2000,_DEJ2000,epoch,pmra,pmdec,mag\n1,10.0,60.0,1950.0,1000.0,0.0,9\n";
    let found = *star(&read(&folder.write("computed", computed)).catalog, "GAIA 1");
    assert!(off_arcsec(&found, 10.0, 60.0) < 0.001);
    // A proper motion in an unknown unit is ignored.
    let parsecs = "id,ra,dec,pmra (pc),pmdec (pc),mag\n1,10.0,60.0,1000.0,0.0,9\n";
    let reading = read(&folder.write("parsecs", parsecs));
    assert!(
        reading.files[0].kind.contains("no proper motion"),
        "{}",
        reading.files[0].kind
    );
    assert!(
        reading.catalog.stars()[0]
            .flags
            .contains(StarFlags::NO_PROPER_MOTION)
    );

    let tycho = "TYC1\tTYC2\tTYC3\tRAmdeg\tDEmdeg\tBTmag\tVTmag\n3124\t2056\t1\t286.0069477\t40.11621858\t9.842\t7.929\n";
    let found = *star(
        &read(&folder.write("tycho", tycho)).catalog,
        "TYC 3124-2056-1",
    );
    assert_eq!((found.v_mag, found.bv_mag), (7.757, Some(1.626)));
}

#[test]
fn coordinates_are_read_in_every_common_notation() {
    let folder = Folder::new();
    let (ra, dec) = (83.7, -0.4);
    for (headings, cells) in [
        ("id,ra,dec,mag", "1,83.7,-0.4,5"),
        ("ID,RA_deg,DEC_deg,V", "1,83.7,-0.4,5"),
        ("id;ra;dec;mag", "1;05:34:48.0;-00:24:00;5"),
        ("id\tRAJ2000\tDEJ2000\tVmag", "1\t05 34 48.0\t-00 24 00\t5"),
        ("id,alpha,delta,mag", "1,05h34m48.0s,-00d24m00s,5"),
        ("id,ra_hours,dec,mag", "1,5.58,-0.4,5"),
        ("id,ra_h,dec_deg,mag", "1,5.58,-0.4,5"),
        ("id,RA (hours),Dec [deg],mag", "1,5.58,-0.4,5"),
        ("id,RAdeg,DEdeg,mag", "1,83.7,-0.4,5"),
        (
            "mag,dec,ra,junk,id",
            "5,-0.4,83.7,\"a, b\n and \"\"c\"\"\",1",
        ),
        ("\u{feff}id,_RAJ2000,_DEJ2000,gmag", "1,83.7,-0.4,5"),
        (
            "id,ra_rad,dec_rad,mag",
            "1,1.460840583918,-0.006981317008,5",
        ),
    ] {
        let catalog = read(&folder.write("table", format!("{headings}\n{cells}\n"))).catalog;
        let found = star(&catalog, "ID 1");
        assert!(off_arcsec(found, ra, dec) < 0.001, "{headings}: {cells}");
        assert_eq!(found.v_mag, 5.0);
    }
}

#[test]
fn identifiers_are_what_the_table_calls_its_stars() {
    let folder = Folder::new();
    for (headings, cell, expected) in [
        ("hip,ra,dec,mag", "11767", "HIP 11767"),
        ("hd,ra,dec,mag", "8890", "HD 8890"),
        ("name,ra,dec,mag", "Polaris", "Polaris"),
        ("id,ra,dec,mag", "TYC 1-13-1", "TYC 1-13-1"),
        (
            "designation,ra,dec,mag",
            "Gaia DR3 576402619921510144",
            "Gaia DR3 576402619921510144",
        ),
        ("tyc,ra,dec,mag", "1-13-1", "TYC 1-13-1"),
        ("star,ra,dec,mag", "α Umi", "α Umi"),
        ("Skymap,ra,dec,mag", "2480053", "SKYMAP 02480053"),
    ] {
        let table = folder.write("table", format!("{headings}\n{cell},37.95,89.26,2.0\n"));
        let catalog = read(&table).catalog;
        assert_eq!(
            catalog.designation(StarIndex::new(0)),
            expected,
            "{headings}"
        );
        assert_eq!(
            Catalog::from_compact(&catalog.to_compact())
                .unwrap()
                .designation(StarIndex::new(0)),
            expected
        );
    }
    let both = folder.write("table", "id,proper,ra,dec,mag\n7,Polaris,37.95,89.26,2.0\n");
    let catalog = read(&both).catalog;
    assert_eq!(
        (
            catalog.designation(StarIndex::new(0)).as_str(),
            catalog.name_of(StarIndex::new(0))
        ),
        ("ID 7", Some("Polaris"))
    );
    assert_eq!(catalog.stars()[0].id, StarId::Number(7));
    assert_eq!(TychoId::new(1, 13, 1).unwrap().to_string(), "TYC 1-13-1");
}

// ---- What is refused

/// A table of `count` stars distributed over the sky, right ascension in units of `ra_unit_deg`.
fn random_table(headings: &str, count: usize, ra_unit_deg: f64) -> Vec<String> {
    let row = |i: usize| {
        let (ra_deg, dec_deg) = ((i * 137) as f64 % 360.0, (i * 53) as f64 % 170.0 - 85.0);
        format!(
            "{i},{},{dec_deg},{}",
            ra_deg / ra_unit_deg,
            5.0 + i as f64 * 0.01
        )
    };
    std::iter::once(headings.to_owned())
        .chain((1..=count).map(row))
        .collect()
}

#[test]
fn bad_records_are_reported_below_one_percent_and_refused_above() {
    let folder = Folder::new();
    let mut lines = random_table("id,ra,dec,mag", 300, 1.0);
    lines[10] = "10,137.0,xx,5.1".to_owned();
    lines[20] = "20,,,5.1".to_owned();
    lines[30] = "30,30.0,5.0,".to_owned();
    let path = folder.write("table", lines.join("\n"));
    let ran = folder.import(&path);
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let expected = "300 records, 297 stars, 1 without a magnitude (line 31), 1 without a position (line 21), 1 unreadable (line 11)";
    assert!(ran.stdout.contains(expected), "{}", ran.stdout);
    let ran = Ran::new(
        starpipe()
            .args(["process", "--catalog"])
            .arg(&path)
            .arg(fixture("orion/orion.png")),
    );
    assert!(
        ran.stderr
            .contains("some of its 300 records are skipped: 1 without a magnitude"),
        "{}",
        ran.stderr
    );

    fs::remove_file(folder.path().join("out.cat")).unwrap();
    lines[40..44].fill("10,137.0,5.0".to_owned());
    let message = folder.refused(lines.join("\n"));
    assert!(
        message.contains("5 of 300 records are unreadable, at most 1 % are tolerated"),
        "{message}"
    );
    assert!(
        message.contains("line 11, column 3 (dec): found \"xx\", expected an angle like"),
        "{message}"
    );
    assert!(
        message.contains("line 41, column 4: found 3 columns"),
        "{message}"
    );
}

#[test]
fn swapped_columns_and_hours_for_degrees_are_detected() {
    let folder = Folder::new();
    let swapped = random_table("id,dec,ra,mag", 300, 1.0).join("\n");
    let message = folder.refused(swapped);
    assert!(message.contains("seem to be swapped"), "{message}");
    assert!(
        message.contains("expected a declination from -90 to +90 degrees"),
        "{message}"
    );

    for headings in ["id,ra,dec,mag", "id,ra_deg,dec_deg,mag"] {
        let message = folder.refused(random_table(headings, 300, 15.0).join("\n"));
        assert!(
            message.contains("rename the column to ra_hours"),
            "{message}"
        );
    }
    // Sexagesimal values are unambiguous: a strip of the sky, 24 degrees wide.
    let mut strip = random_table("id,ra,dec,mag", 300, 15.0);
    for line in &mut strip[1..] {
        let cells: Vec<&str> = line.split(',').collect();
        let minutes = cells[1].parse::<f64>().unwrap() * 4.0;
        let ra = format!("{:02}:{:05.2}", (minutes / 60.0) as u32, minutes % 60.0);
        *line = [cells[0], &ra, cells[2], cells[3]].join(",");
    }
    let ran = folder.import(&folder.write("table", strip.join("\n")));
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    for (headings, unit_deg) in [("id,ra_hours,dec,mag", 15.0), ("id,ra,dec,mag", 1.0)] {
        let ran =
            folder.import(&folder.write("table", random_table(headings, 300, unit_deg).join("\n")));
        assert_eq!(ran.status, 0, "{}", ran.stderr);
    }
}

#[test]
fn files_that_are_not_catalogues_are_refused_with_what_is_missing() {
    let folder = Folder::new();
    for (content, part) in [
        ("", "the file is empty"),
        (
            "id,ra,dec,mag\n",
            "no star with a position and a magnitude among 0 records",
        ),
        ("id,ra,dec,mag\n1,,,\n", "among 1 records"),
        ("id,ra,dec\n1,2,3\n", "no column of magnitudes"),
        ("ra,dec,mag\n1,2,3\n", "no column of identifiers"),
        (
            "id,ra,mag\n1,2,3\n",
            "no column of right ascensions and declinations",
        ),
        ("x,y,flux\n1,2,3\n", "unknown catalog format"),
        (
            "id,ra,dec,mag\n1,2,3,99\n",
            "expected a magnitude from -32 to 32",
        ),
        ("id,ra,dec,mag\n,2,3,9\n", "expected an identifier"),
        (
            "id,ra,dec,mag\n1,-276.3,3,9\n",
            "expected a right ascension from 0 to 360 degrees",
        ),
        (
            "name,ra,dec,mag\nVega,2,3,9\nVega,5,6,7\n",
            "found \"Vega\", expected an identifier that no record before has",
        ),
    ] {
        let message = folder.refused(content);
        assert!(message.contains(part), "{content:?}: {message}");
    }
    let text = random_table("id,ra,dec,mag", 3000, 1.0).join("\n");
    let mut packed = gzip(text.as_bytes());
    packed.truncate(packed.len() / 2);
    let message = folder.refused(&packed);
    assert!(
        message.contains("reading the catalog") && message.contains("after line"),
        "{message}"
    );
    let ran = Ran::new(starpipe().args(["process", "--catalog", "/no/such/file", "x.png"]));
    assert_eq!(ran.status, 1);
    assert!(ran.stderr.contains("/no/such/file"), "{}", ran.stderr);
}

#[test]
fn a_directory_holds_one_catalogue_or_is_refused() {
    let folder = Folder::new();
    let inside = folder.path().join("inside");
    fs::create_dir(&inside).unwrap();
    let refusal = |part: &str| {
        let ran = folder.import(&inside);
        assert_eq!(ran.status, 1, "{}", ran.stdout);
        assert!(
            ran.stderr.contains("inside") && ran.stderr.contains(part),
            "{}",
            ran.stderr
        );
    };
    refusal("found no catalog in it");
    fs::write(inside.join("notes.txt"), "no, table").unwrap();
    refusal("found no catalog in it");
    fs::write(inside.join("a.csv"), "id,ra,dec,mag\n1,2,3,4\n").unwrap();
    assert_eq!(folder.import(&inside).status, 0);
    fs::write(inside.join("b.csv"), "id,ra,dec,mag\n2,3,3,4\n").unwrap();
    refusal("found more than one catalog in it (a.csv, b.csv");
    fs::remove_file(inside.join("b.csv")).unwrap();
    fs::write(inside.join("tyc2.dat.00"), TYCHO2_MAIN).unwrap();
    refusal("found more than one catalog in it (tyc2.dat.00, a.csv");
}

proptest! {
    #[test]
    fn any_damage_to_tycho_2_is_refused_or_read_but_never_a_panic(
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..20),
        supplement in any::<bool>(),
    ) {
        let folder = Folder::new();
        let source = if supplement { TYCHO2_SUPPLEMENT_1 } else { TYCHO2_MAIN };
        let mut content = source.as_bytes().to_vec();
        for (at, byte) in edits {
            // The bytes that identify the kind are kept.
            content[16..][at.index(source.len() - 16)] = byte;
        }
        let _ = starpipe::catalog::read(&folder.write("tyc2.dat", content));
    }

    #[test]
    fn any_cells_under_headings_are_refused_or_read_but_never_a_panic(content in "[-+0-9a-z:,.\"\n ]{0,120}") {
        let folder = Folder::new();
        let table = folder.write("table", format!("id,ra,dec,mag,pmra,pmdec,epoch\n{content}"));
        let _ = starpipe::catalog::read(&table);
    }

    #[test]
    fn records_of_tycho_2_are_read_back(
        id in (1..9538_u32, 1..12122_u32, 1..4_u32),
        place in (0.0..360.0_f64, -90.0..=90.0_f64),
        motion in (-4000.0..6000.0_f64, -5000.0..9999.0_f64),
        magnitude in (2.0..15.0_f64, -0.5..2.0_f64),
    ) {
        let folder = Folder::new();
        let (vt, bt) = (magnitude.0, magnitude.0 + magnitude.1);
        let record = format!(
            "{:04} {:05} {}| |{:12.8}|{:12.8}|{:7.1}|{:7.1}|  6|  6| 0.8| 0.8|1990.63|1990.85|20|0.8|0.7|0.9|0.8|\
             {bt:6.3}|0.022|{vt:6.3}|0.011|999|T|         |{:12.8}|{:12.8}|1.61|1.67|  5.8|  5.9| | 0.1\n",
            id.0, id.1, id.2, place.0, place.1, motion.0, motion.1, place.0, place.1,
        );
        prop_assert_eq!(record.len(), 207);
        let catalog = read(&folder.write("tyc2.dat", record)).catalog;
        let found = &catalog.stars()[0];
        prop_assert_eq!(found.id, StarId::Tycho(TychoId::new(id.0, id.1, id.2).unwrap()));
        prop_assert!(off_arcsec(found, place.0, place.1) < 5e-4);
        let as_written = |mas_per_yr: f64| format!("{mas_per_yr:.1}").parse::<f32>().unwrap();
        prop_assert_eq!(found.pm_ra_mas_per_yr, as_written(motion.0));
        prop_assert_eq!(found.pm_dec_mas_per_yr, as_written(motion.1));
        let v_mag = vt - 0.09 * (bt - vt);
        prop_assert!((f64::from(found.v_mag) - v_mag).abs() < 0.002);
    }
}
