//! Callers of ASTAP: each test passes the words of a program, and reads its answer as that program does. The table
//! in docs/doors/astap.md names where.

use crate::common::{
    Ran, cache_dir, fits_unit, fixture, gzip, names, number, orion, report, starpipe,
};
use crate::deep::areas;
use crate::deep::patch::{DrawnStar, Patch};
use image::{GrayImage, ImageBuffer, Luma};
use starpipe::base::coords::Rotation;
use starpipe::{CameraModel, UnitVector};
use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Columns and rows of the fixture of Orion, and the height of its field in degrees.
const ORION_PX: [f64; 2] = [640.0, 480.0];
const ORION_HEIGHT_DEG: &str = "15.072";

/// A folder with a copy of Orion.
fn folder() -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("light.png");
    fs::copy(orion(), &path).unwrap();
    (folder, path)
}

/// Runs `starpipe astap` in a folder with these words.
fn astap(folder: &TempDir, words: &str) -> Ran {
    let mut command = starpipe();
    command.current_dir(folder.path()).arg("astap");
    Ran::new(command.args(words.split_whitespace()))
}

/// The values of `.ini`: every line that is not blank is a key, `=`, and a value, and no key comes twice.
fn read_ini(path: &Path) -> HashMap<String, String> {
    let text = fs::read_to_string(path).unwrap();
    let mut values = HashMap::new();
    for line in text.lines().filter(|line| !line.trim().is_empty()) {
        let (key, value) = line.split_once('=').unwrap();
        assert_eq!(
            values.insert(key.to_owned(), value.to_owned()),
            None,
            "{key}"
        );
    }
    values
}

fn value(ini: &HashMap<String, String>, key: &str) -> f64 {
    ini[key]
        .trim()
        .parse()
        .unwrap_or_else(|_| panic!("{key}: {}", ini[key]))
}

/// The coordinates of `.ini` by the book (Calabretta & Greisen 2002): pixel, from 1, of a direction in degrees.
fn pixel_of(ini: &HashMap<String, String>, [ra_deg, dec_deg]: [f64; 2]) -> [f64; 2] {
    let v = |key: &str| value(ini, key);
    let (sin_dec, cos_dec) = dec_deg.to_radians().sin_cos();
    let (sin_ra, cos_ra) = (ra_deg - v("CRVAL1")).to_radians().sin_cos();
    let (sin_0, cos_0) = v("CRVAL2").to_radians().sin_cos();
    let depth = sin_dec * sin_0 + cos_dec * cos_0 * cos_ra;
    let east = (cos_dec * sin_ra / depth).to_degrees();
    let north = ((sin_dec * cos_0 - cos_dec * sin_0 * cos_ra) / depth).to_degrees();
    let [xx, xy, yx, yy] = ["CD1_1", "CD1_2", "CD2_1", "CD2_2"].map(v);
    let determinant = xx * yy - xy * yx;
    [
        v("CRPIX1") + (yy * east - xy * north) / determinant,
        v("CRPIX2") + (xx * north - yx * east) / determinant,
    ]
}

/// The coordinates are those that `process` finds: at the centre, and at the stars. `row` counts rows from 1, of
/// one that counts from 0 at the top.
fn assert_like_process(ini: &HashMap<String, String>, row: impl Fn(f64) -> f64) {
    let report = report("orion/orion.png", &[]);
    let at = |name: &str| number(&report, &format!("/attitude/{name}"));
    let [width, height] = ORION_PX;
    let centre = pixel_of(ini, [at("ra_deg"), at("dec_deg")]);
    assert!((centre[0] - (width + 1.0) / 2.0).abs() < 0.01, "{centre:?}");
    assert!(
        (centre[1] - (height + 1.0) / 2.0).abs() < 0.01,
        "{centre:?}"
    );
    let stars = report["stars"].as_array().unwrap();
    let named: Vec<_> = stars
        .iter()
        .filter(|star| star["ra_deg"].is_number())
        .collect();
    assert!(named.len() > 100);
    for star in named {
        let of = |name: &str| star[name].as_f64().unwrap();
        let [x, y] = pixel_of(ini, [of("ra_deg"), of("dec_deg")]);
        let off = (x - of("x") - 1.0).hypot(y - row(of("y")));
        // Detections are as far from their stars as the report says.
        let difference = off - star["residual_px"].as_f64().unwrap_or(0.0);
        assert!(difference.abs() < 0.05, "{star}: {x} {y}");
    }
}

fn from_bottom(row: f64) -> f64 {
    ORION_PX[1] - row
}

/// A card of a header as text, without blanks around it.
fn card(cards: &HashMap<String, String>, name: &str) -> f64 {
    cards[name]
        .parse()
        .unwrap_or_else(|_| panic!("{name}: {}", cards[name]))
}

/// The cards of 80 characters, up to END.
fn cards<'a>(cards: impl Iterator<Item = &'a str>) -> HashMap<String, String> {
    let own = cards.take_while(|card| card.trim_end() != "END");
    let pair = |card: &str| {
        let (keyword, rest) = card.split_at_checked(8)?;
        let text = rest.strip_prefix("= ")?.split('/').next()?;
        Some((keyword.trim().to_owned(), text.trim().to_owned()))
    };
    own.filter_map(pair).collect()
}

fn blocks(bytes: &[u8]) -> HashMap<String, String> {
    cards(
        bytes
            .chunks(80)
            .map(|card| std::str::from_utf8(card).unwrap()),
    )
}

/// Orion as FITS with one byte a pixel, its first row the lowest or the uppermost.
fn orion_fits(is_bottom_up: bool) -> Vec<u8> {
    let picture: GrayImage = image::open(orion()).unwrap().to_luma8();
    let [width, height] = ORION_PX.map(|side| side as u32);
    let mut rows: Vec<&[u8]> = picture.as_raw().chunks(width as usize).collect();
    if is_bottom_up {
        rows.reverse();
    }
    let order = if is_bottom_up {
        "BOTTOM-UP"
    } else {
        "TOP-DOWN"
    };
    let order = format!("ROWORDER= '{order}'");
    let more = [
        &order,
        "OBJECT  = 'Orion''s belt' / a text",
        "CRVAL1  = 1.0",
        "A_ORDER = 2",
    ];
    fits_unit(
        "SIMPLE  =                    T",
        8,
        &[width, height],
        &more,
        &rows.concat(),
    )
}

// ---- N.I.N.A.: NINA.PlateSolving/Solvers/ASTAPSolver.cs

#[test]
fn nina_solves_near_and_blindly() {
    let (folder, path) = folder();
    for words in [
        format!("-f light.png -fov {ORION_HEIGHT_DEG} -z 0 -s 500 -r 30 -ra 5.58 -spd 89.6"),
        format!("-f light.png -fov {ORION_HEIGHT_DEG} -z 0 -s 500 -r 180"),
    ] {
        let ran = astap(&folder, &words);
        assert_eq!((ran.status, ran.stderr.as_str()), (0, ""), "{words}");
        assert!(
            ran.stdout
                .starts_with("Solution found: 05: 34  48.0 -00d 2"),
            "{}",
            ran.stdout
        );
        let ini = read_ini(&path.with_extension("ini"));
        assert_eq!(ini["PLTSOLVD"], "T");
        assert!(ini["CMDLINE"].ends_with(&format!("astap {words}")));
        assert_eq!(ini["DIMENSIONS"], "640 x 480");
        assert!(!ini.contains_key("WARNING") && !ini.contains_key("ERROR"));
        assert_like_process(&ini, from_bottom);
        // The scale and the angle that are shown; the true ones are 113.7″ and −50° at the upper border.
        let scale_arcsec = value(&ini, "CD1_2").hypot(value(&ini, "CD2_2")) * 3600.0;
        let truth_arcsec = (2.0 * 10.0_f64.to_radians().tan() / 640.0).to_degrees() * 3600.0;
        assert!(
            (scale_arcsec / truth_arcsec - 1.0).abs() < 1e-3,
            "{scale_arcsec}"
        );
        assert!((value(&ini, "CROTA2") - 50.0).abs() < 0.05);
        assert!((value(&ini, "CROTA1") - 50.0).abs() < 0.05);
        assert!(value(&ini, "CDELT1") < 0.0 && value(&ini, "CDELT2") > 0.0);
    }
}

#[test]
fn nina_shows_why_a_frame_is_not_solved() {
    let (folder, _) = folder();
    fs::copy(
        fixture("regression/no-stars.tif"),
        folder.path().join("dark.tif"),
    )
    .unwrap();
    let ran = astap(
        &folder,
        "-f dark.tif -fov 1.5 -z 2 -s 500 -r 5 -ra 5.58 -spd 89.6",
    );
    assert!([1, 2].contains(&ran.status), "{}", ran.status);
    let ini = read_ini(&folder.path().join("dark.ini"));
    assert_eq!(ini["PLTSOLVD"], "F");
    assert!(!ini["WARNING"].is_empty() && !ini.contains_key("CRVAL1"));
    assert_eq!(ini.contains_key("ERROR"), ran.status == 2);
    assert!(!folder.path().join("dark.wcs").exists());
}

#[test]
fn hints_may_be_wrong() {
    let (folder, path) = folder();
    let ran = astap(&folder, "-f light.png -fov 3,5 -ra 18 -spd 20 -r 5");
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let ini = read_ini(&path.with_extension("ini"));
    assert_like_process(&ini, from_bottom);
    assert_eq!(
        ini["WARNING"],
        "Warning scale was inaccurate! Set FOV=15.07d, scale=113.7\""
    );
    let text = fs::read_to_string(path.with_extension("wcs")).unwrap();
    assert!(
        text.contains("\nWARNING = 'Warning scale was inaccurate! "),
        "{text}"
    );
}

// ---- CCDciel: src/cu_astrometry_engine.pas

#[test]
fn ccdciel_reads_lines_of_the_header() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("in.fits"), orion_fits(true)).unwrap();
    assert_eq!(astap(&folder, "-z 0 -r 30 -f in.fits").status, 0);
    let text = fs::read_to_string(folder.path().join("in.wcs")).unwrap();
    assert!(text.lines().all(|line| line.len() <= 80));
    assert_eq!(text.lines().last().unwrap().trim_end(), "END");
    let header = cards(text.lines());
    // The header of the frame, without its image and the coordinates that it had.
    assert_eq!(card(&header, "NAXIS"), 0.0);
    assert!(header["OBJECT"].starts_with("'Orion''s belt'"));
    assert!(!header.contains_key("NAXIS1") && !header.contains_key("A_ORDER"));
    assert_eq!(
        text.lines()
            .filter(|line| line.starts_with("CRVAL1"))
            .count(),
        1
    );
    assert_eq!(header["CTYPE1"], "'RA---TAN'");
    assert_eq!(header["PLTSOLVD"], "T");
    let ini = read_ini(&folder.path().join("in.ini"));
    for key in ["CRPIX1", "CRVAL2", "CDELT1", "CROTA2", "CD1_2", "CD2_1"] {
        assert!(
            (card(&header, key) - value(&ini, key)).abs() < 1e-9,
            "{key}"
        );
    }
}

#[test]
fn rows_of_fits_count_as_they_are_stored() {
    let folder = tempfile::tempdir().unwrap();
    for (name, is_bottom_up) in [("up.fits", true), ("down.fits", false)] {
        fs::write(folder.path().join(name), orion_fits(is_bottom_up)).unwrap();
        assert_eq!(astap(&folder, &format!("-f {name}")).status, 0);
        let ini = read_ini(&folder.path().join(name).with_extension("ini"));
        // Rows from the top show the sky as in a mirror.
        assert_eq!(value(&ini, "CDELT1") < 0.0, is_bottom_up);
        let row = |y: f64| {
            if is_bottom_up {
                from_bottom(y)
            } else {
                y + 1.0
            }
        };
        assert_like_process(&ini, row);
    }
    fs::write(folder.path().join("up.fits.gz"), gzip(&orion_fits(true))).unwrap();
    assert_eq!(astap(&folder, "-f up.fits.gz -o packed.x").status, 0);
    assert_like_process(&read_ini(&folder.path().join("packed.ini")), from_bottom);
}

#[test]
fn a_frame_that_cannot_be_read_has_a_status_of_its_own() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("text.fits"), "no frame").unwrap();
    for name in ["text.fits", "missing.fits"] {
        for more in ["", " -analyse 10"] {
            let ran = astap(&folder, &format!("-f {name} -o answer{more}"));
            assert_eq!(ran.status, 16, "{name}");
            assert!(ran.stderr.contains(name), "{}", ran.stderr);
            let ini = read_ini(&folder.path().join("answer.ini"));
            assert_eq!(ini["PLTSOLVD"], "F");
            assert_eq!(ini["ERROR"], "Error reading image file.");
        }
    }
}

// ---- StellarSolver (Ekos): stellarsolver/externalextractorsolver.cpp

#[test]
fn stellarsolver_reads_first_line_header_and_log() {
    let (folder, _) = folder();
    let words = format!(
        "-o out/sextractor_1.ini -speed auto -f light.png -wcs -z 0 -fov {ORION_HEIGHT_DEG} -ra 5.58 -spd 89.6 \
         -r 15 -log"
    );
    fs::create_dir(folder.path().join("out")).unwrap();
    assert_eq!(astap(&folder, &words).status, 0);
    let out = folder.path().join("out");
    assert_eq!(
        names(&out),
        ["sextractor_1.ini", "sextractor_1.log", "sextractor_1.wcs"]
    );
    let ini = fs::read_to_string(out.join("sextractor_1.ini")).unwrap();
    assert_eq!(ini.lines().next().unwrap(), "PLTSOLVD=T");
    let wcs = fs::read(out.join("sextractor_1.wcs")).unwrap();
    assert_eq!(wcs.len() % 2880, 0);
    let header = blocks(&wcs);
    assert_eq!(header["CTYPE2"], "'DEC--TAN'");
    assert!((card(&header, "CRVAL1") - 83.7).abs() < 1e-3);
    let log = fs::read_to_string(out.join("sextractor_1.log")).unwrap();
    assert!(log.starts_with("Solution found: "));
}

// ---- Scripts, by ASTAP's own documentation

#[test]
fn distortion_is_written_where_it_is_wanted() {
    let folder = tempfile::tempdir().unwrap();
    fs::copy(
        fixture("regression/distorted.tif"),
        folder.path().join("a.tif"),
    )
    .unwrap();
    let header = |words: &str| {
        assert_eq!(astap(&folder, &format!("-f a.tif -wcs {words}")).status, 0);
        blocks(&fs::read(folder.path().join("a.wcs")).unwrap())
    };
    let (plain, without) = (header(""), header("-sip n"));
    assert_eq!(plain, without);
    let with = header("-sip");
    assert_eq!(plain["CTYPE1"], "'RA---TAN'");
    assert!(
        with["CTYPE1"].contains("-SIP") && with.contains_key("A_ORDER"),
        "{with:?}"
    );
    assert!(!plain.contains_key("A_ORDER"));
}

#[test]
fn the_header_of_a_frame_is_updated_and_nothing_else() {
    let (folder, _) = folder();
    let before = orion_fits(true);
    fs::write(folder.path().join("a.fits"), &before).unwrap();
    assert_eq!(astap(&folder, "-f a.fits -update").status, 0);
    let after = fs::read(folder.path().join("a.fits")).unwrap();
    assert_eq!(
        names(folder.path()),
        ["a.fits", "a.ini", "a.wcs", "light.png"]
    );
    let data = |file: &[u8]| file[2880..].to_vec();
    assert_eq!(data(&before), data(&after));
    let (old, new) = (blocks(&before), blocks(&after));
    for name in ["BITPIX", "NAXIS1", "NAXIS2", "OBJECT", "ROWORDER"] {
        assert_eq!(old[name], new[name]);
    }
    let ini = read_ini(&folder.path().join("a.ini"));
    assert!((card(&new, "CRVAL1") - value(&ini, "CRVAL1")).abs() < 1e-9);
    // It can be solved again, and has no card twice then.
    assert_eq!(astap(&folder, "-f a.fits -update").status, 0);
    assert_eq!(fs::read(folder.path().join("a.fits")).unwrap(), after);
    // Other files stay as they are, and are solved nevertheless.
    fs::write(folder.path().join("b.fits.gz"), gzip(&before)).unwrap();
    for name in ["light.png", "b.fits.gz"] {
        let path = folder.path().join(name);
        let before = fs::read(&path).unwrap();
        let ran = astap(&folder, &format!("-f {name} -update -o answer"));
        assert_eq!(ran.status, 34);
        assert!(ran.stderr.contains(name), "{}", ran.stderr);
        assert_eq!(fs::read(&path).unwrap(), before);
        assert_eq!(read_ini(&folder.path().join("answer.ini"))["PLTSOLVD"], "T");
    }
}

/// The rows of a table with these columns.
fn table(path: &Path, columns: &str) -> Vec<Vec<f64>> {
    let text = fs::read_to_string(path).unwrap();
    let (first, rest) = text.split_once('\n').unwrap();
    assert_eq!(first, columns);
    let row = |line: &str| {
        line.split(',')
            .map(|value| value.parse().unwrap())
            .collect()
    };
    rest.lines().map(row).collect()
}

#[test]
fn stars_are_measured_for_focusing() {
    let (folder, path) = folder();
    let ran = astap(&folder, "-f light.png -analyse 10");
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let lines: Vec<_> = ran
        .stdout
        .lines()
        .map(|line| line.split_once('=').unwrap())
        .collect();
    assert_eq!(
        lines.iter().map(|(key, _)| *key).collect::<Vec<_>>(),
        ["HFD_MEDIAN", "STARS"]
    );
    let hfd_px: f64 = lines[0].1.parse().unwrap();
    let count: usize = lines[1].1.parse().unwrap();
    // ASTAP 2022.12 finds 2.6 in this frame.
    assert!(
        (2.2..=3.0).contains(&hfd_px) && count > 50,
        "{hfd_px} {count}"
    );
    assert_eq!(names(folder.path()), ["light.png"]);

    let again = astap(&folder, "-f light.png -extract 10 -o elsewhere");
    assert_eq!(again.stdout, ran.stdout);
    let stars = table(&path.with_extension("csv"), "x,y,hfd,snr,flux");
    assert_eq!(stars.len(), count);
    assert!(stars.iter().all(|star| star[3] >= 10.0 && star.len() == 5));
    assert!(astap(&folder, "-f light.png -analyse 30").stdout != ran.stdout);

    let solved = astap(&folder, "-f light.png -extract2 10");
    assert_eq!(solved.status, 0);
    let columns = "x,y,hfd,snr,flux,ra[0..360],dec[0..360]";
    let directed = table(&path.with_extension("csv"), columns);
    let ini = read_ini(&path.with_extension("ini"));
    assert!(directed.len() > 60);
    for star in &directed {
        let [x, y] = pixel_of(&ini, [star[5], star[6]]);
        assert!((x - star[0]).hypot(y - star[1]) < 0.2, "{star:?}: {x} {y}");
    }
    // Out of focus, stars are wider.
    let blurred = image::open(orion()).unwrap().to_luma8();
    image::imageops::blur(&blurred, 3.0)
        .save(folder.path().join("blurred.png"))
        .unwrap();
    let wide = astap(&folder, "-f blurred.png -analyse 10");
    let wide_px: f64 = wide.stdout.lines().next().unwrap()["HFD_MEDIAN=".len()..]
        .parse()
        .unwrap();
    assert!(wide_px > 2.0 * hfd_px && wide_px < 20.0, "{}", wide.stdout);
}

#[test]
fn what_is_not_known_is_left_out() {
    let (folder, _) = folder();
    let ran = astap(&folder, "-f light.png -tolerant 3 -annotate -fov");
    assert_eq!(ran.status, 0);
    for name in ["-tolerant", "-annotate", "-fov"] {
        assert!(ran.stderr.contains(name), "{name}: {}", ran.stderr);
    }
    // 2 would tell that there are not enough stars.
    for words in ["-stack .", "-focus1 light.png -focus2 light.png", "-fov 3"] {
        let ran = astap(&folder, words);
        assert_eq!((ran.status, ran.stdout.as_str()), (1, ""), "{words}");
        assert_eq!(ran.stderr.lines().count(), 1, "{}", ran.stderr);
    }
    for words in ["", "-h", "-help", "--help"] {
        let help = astap(&folder, words);
        assert_eq!(help.status, 0);
        assert!(help.stdout.contains("--spd"), "{}", help.stdout);
    }
}

#[cfg(unix)]
#[test]
fn it_answers_to_the_names_of_astap() {
    let (folder, path) = folder();
    for name in ["astap", "astap_cli"] {
        let link = folder.path().join(name);
        std::os::unix::fs::symlink(env!("CARGO_BIN_EXE_starpipe"), &link).unwrap();
        let mut command = assert_cmd::Command::new(&link);
        command
            .env("STARPIPE_CACHE_DIR", cache_dir())
            .env("STARPIPE_CATALOGS", "");
        let ran =
            Ran::new(
                command
                    .current_dir(folder.path())
                    .args(["-f", "light.png", "-fov", "0"]),
            );
        assert_eq!(ran.status, 0, "{}", ran.stderr);
        let ini = read_ini(&path.with_extension("ini"));
        assert!(ini["CMDLINE"].ends_with(&format!("{name} -f light.png -fov 0")));
    }
}

/// A frame 1° wide of these stars, 640 × 480 pixels.
fn narrow(
    stars: &[DrawnStar],
    centre: &UnitVector<starpipe::Icrs>,
) -> ImageBuffer<Luma<u16>, Vec<u16>> {
    let [width, height] = ORION_PX;
    let focal_px = width / 2.0 / 0.5_f64.to_radians().tan();
    let camera = CameraModel::pinhole(width, height, focal_px, false);
    let attitude = Rotation::looking_at(centre, 0.7);
    let mut levels = vec![1000.0; (width * height) as usize];
    for (place, level) in levels.iter_mut().enumerate() {
        *level += (place * 7919 % 101) as f64 * 0.2;
    }
    let pixels = stars.iter().filter_map(|star| {
        let pixel = camera.pixel_of(&attitude.apply(&star.direction));
        Some((pixel.filter(|pixel| camera.contains(pixel))?, star.v_mag))
    });
    for (pixel, v_mag) in pixels {
        let peak = 20_000.0 * 10_f64.powf(-0.4 * (v_mag - 11.0));
        for y in (pixel.y as i64 - 8).max(0)..(pixel.y as i64 + 9).min(height as i64) {
            for x in (pixel.x as i64 - 8).max(0)..(pixel.x as i64 + 9).min(width as i64) {
                let square = (x as f64 - pixel.x).powi(2) + (y as f64 - pixel.y).powi(2);
                levels[y as usize * width as usize + x as usize] += peak * (-square / 3.0).exp();
            }
        }
    }
    let levels = levels
        .into_iter()
        .map(|level| level.min(65_535.0) as u16)
        .collect();
    ImageBuffer::from_raw(width as u32, height as u32, levels).unwrap()
}

#[test]
fn a_database_of_astap_is_used_and_none_is_needed() {
    let folder = tempfile::tempdir().unwrap();
    let centre_deg = [201.0, 33.0];
    let patch = Patch::draw(centre_deg, 2.0, 400.0, 5);
    fs::create_dir(folder.path().join("data")).unwrap();
    areas::write(
        &folder.path().join("data"),
        "d50",
        &patch.stars,
        false,
        false,
    );
    narrow(&patch.stars, &patch.centre)
        .save(folder.path().join("a.png"))
        .unwrap();
    let hints = "-f a.png -fov 0.75 -ra 13.4 -spd 123 -r 3";
    for words in ["-d data", "-d data -D D50"] {
        let ran = astap(&folder, &format!("{hints} {words}"));
        assert_eq!(ran.status, 0, "{words}: {}", ran.stdout);
        let ini = read_ini(&folder.path().join("a.ini"));
        assert!(
            (value(&ini, "CRVAL1") - centre_deg[0]).abs() < 1e-3,
            "{ini:?}"
        );
        assert!(
            (value(&ini, "CRVAL2") - centre_deg[1]).abs() < 1e-3,
            "{ini:?}"
        );
    }
    // Without the stars of that sky, no other are found; and never is a database missed.
    for words in ["", "-d data -D v17", "-d nowhere"] {
        assert_eq!(
            astap(&folder, &format!("{hints} {words}")).status,
            1,
            "{words}"
        );
    }
}
