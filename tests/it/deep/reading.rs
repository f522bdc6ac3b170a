//! What is read of each format is what was written.

use super::areas;
use super::index_file::{Series, index_file};
use super::patch::{DrawnStar, Patch};
use super::tables::Form;
use starpipe::base::interrupt::Interrupt;
use starpipe::base::units::{RAD_PER_ARCSEC, RAD_PER_DEG};
use starpipe::catalog::Star;
use starpipe::catalog::deep::{DeepCatalog, Region};
use std::fs;
use std::path::Path;

/// The stars of a circle in the catalogue that a path has.
pub fn stars_in(path: &Path, region: Region) -> Vec<Star> {
    let found = DeepCatalog::find(path).unwrap();
    assert_eq!(found.len(), 1, "{found:?}");
    found[0].stars_in(region, &Interrupt::default()).unwrap()
}

/// Each drawn star of a circle must be there, within these errors, and no other.
fn assert_same(read: &[Star], patch: &Patch, region: Region, within_arcsec: f64, within_mag: f64) {
    let mut expected: Vec<&DrawnStar> = patch.stars.iter().collect();
    let margin_rad = within_arcsec * RAD_PER_ARCSEC;
    expected
        .retain(|star| star.direction.angle_to(&region.centre) < region.radius_rad - margin_rad);
    assert!(expected.len() > 200, "{}", expected.len());
    assert!(read.len() >= expected.len() && read.len() < expected.len() + 5);
    for star in expected {
        let nearest = read.iter().min_by(|a, b| {
            let apart = |other: &Star| other.direction.angle_to(&star.direction);
            apart(a).total_cmp(&apart(b))
        });
        let nearest = nearest.unwrap();
        let off_arcsec = nearest.direction.angle_to(&star.direction) / RAD_PER_ARCSEC;
        assert!(off_arcsec < within_arcsec, "{off_arcsec}");
        let off_mag = f64::from(nearest.v_mag) - star.v_mag;
        assert!(off_mag.abs() < within_mag, "{off_mag}");
    }
}

fn circle(patch: &Patch, radius_deg: f64) -> Region {
    Region {
        centre: patch.centre,
        radius_rad: radius_deg * RAD_PER_DEG,
        per_sq_deg: 1e6,
    }
}

#[test]
fn index_files_of_each_series_and_byte_order_are_read() {
    let patch = Patch::draw([359.5, 20.0], 3.0, 400.0, 1);
    let file = tempfile::NamedTempFile::new().unwrap();
    for big_endian in [false, true] {
        for (series, within_mag) in [(Series::Tycho, 0.01), (Series::Gaia, 0.01)] {
            fs::write(&file, index_file(&patch.stars, series, big_endian)).unwrap();
            let region = circle(&patch, 0.9);
            let read = stars_in(file.path(), region);
            assert_same(&read, &patch, region, 0.001, within_mag);
            assert!(read.iter().all(|star| star.id.to_string().starts_with('J')));
        }
    }
}

/// Their order of brightness is right, as far as ranks tell it.
#[test]
fn ranks_stand_for_magnitudes_where_there_are_none() {
    let patch = Patch::draw([100.0, -30.0], 2.0, 400.0, 2);
    let file = tempfile::NamedTempFile::new().unwrap();
    fs::write(&file, index_file(&patch.stars, Series::Lite, false)).unwrap();
    let read = stars_in(file.path(), circle(&patch, 1.0));
    let faintness = |star: &Star| {
        let same =
            |drawn: &&DrawnStar| drawn.direction.angle_to(&star.direction) < 0.01 * RAD_PER_ARCSEC;
        patch.stars.iter().find(same).unwrap().v_mag
    };
    let brighter: Vec<f64> = read[..read.len() / 4].iter().map(faintness).collect();
    let fainter: Vec<f64> = read[3 * read.len() / 4..].iter().map(faintness).collect();
    let brightest = fainter.iter().copied().fold(f64::INFINITY, f64::min);
    assert!(brighter.iter().all(|v_mag| *v_mag <= brightest + 0.1));
}

#[test]
fn databases_of_areas_are_read() {
    for (centre_deg, coarse, colored) in [
        ([0.0, 0.2], true, false),
        ([211.0, -66.0], false, true),
        ([40.0, 89.0], false, false),
    ] {
        let patch = Patch::draw(centre_deg, 3.0, 400.0, 3);
        let folder = tempfile::tempdir().unwrap();
        areas::write(folder.path(), "d50", &patch.stars, coarse, colored);
        fs::write(folder.path().join("readme.txt"), "not a star").unwrap();
        let region = circle(&patch, 0.9);
        let read = stars_in(folder.path(), region);
        assert_same(&read, &patch, region, 0.2, 0.06);
        assert_eq!(read[0].bv_mag, colored.then_some(0.6));
        // One of the files stands for all of them.
        let first = fs::read_dir(folder.path()).unwrap().flatten();
        let mut files = first.map(|file| file.path());
        let one = files
            .find(|path| path.extension().unwrap() != "txt")
            .unwrap();
        assert_eq!(stars_in(&one, region).len(), read.len());
    }
}

#[test]
fn tables_of_gaia_are_read_in_each_form() {
    let patch = Patch::draw([0.2, 51.0], 2.0, 1200.0, 5);
    let folder = tempfile::tempdir().unwrap();
    for form in Form::ALL {
        let path = folder.path().join(form.file_name());
        form.write(&path, &patch);
        let region = circle(&patch, 0.9);
        let read = stars_in(&path, region);
        assert_same(&read, &patch, region, 0.005, 0.002);
        let colored = read.iter().filter(|star| star.bv_mag.is_some()).count();
        assert!((0.85..0.95).contains(&(colored as f64 / read.len() as f64)));
        assert!(
            read.iter()
                .all(|star| star.id.to_string().starts_with("GAIA 1152921504"))
        );
        // Its density is that of the part of the sky that it covers.
        let contents = DeepCatalog::find(&path).unwrap()[0].contents();
        let density = contents.per_sq_deg();
        assert!((900.0..1300.0).contains(&density), "{form:?}: {density}");
    }
}

#[test]
fn of_a_wide_region_only_as_many_stars_are_kept_as_are_wanted() {
    let patch = Patch::draw([150.0, 40.0], 5.0, 900.0, 4);
    let file = tempfile::NamedTempFile::new().unwrap();
    fs::write(&file, index_file(&patch.stars, Series::Tycho, false)).unwrap();
    let region = Region {
        per_sq_deg: 20.0,
        ..circle(&patch, 5.0)
    };
    let read = stars_in(file.path(), region);
    let wanted = 20.0 * region.area_sq_deg();
    assert!(
        (0.8 * wanted..1.3 * wanted).contains(&(read.len() as f64)),
        "{}",
        read.len()
    );
    // Bright ones: a 45th of the stars reaches V 12.2. Cells at the edge have fewer, and so fainter ones.
    let fainter = read.iter().filter(|star| star.v_mag > 13.5).count();
    assert!(fainter * 10 < read.len(), "{fainter}");
}
