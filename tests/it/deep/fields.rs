//! Narrow fields are identified with deep catalogues, with right and wrong hints, and never wrongly.

use super::areas;
use super::index_file::{Series, index_file};
use super::patch::{Patch, near};
use super::tables::Form;
use crate::common::{Ran, sky, starpipe};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use starpipe::base::coords::{Icrs, Rotation, UnitVector};
use starpipe::base::units::RAD_PER_DEG;
use starpipe::catalog::deep::DeepCatalog;
use starpipe::centroids::ListedCentroid;
use starpipe::identify::{Photometry, Scale, SkyRegion};
use starpipe::solve::DeepSky;
use starpipe::{
    CameraModel, CentroidList, Context, Priors, ScalePrior, Workspace, solve_centroids,
};
use std::f64::consts::TAU;
use std::ffi::OsString;
use std::fs;
use std::path::Path;

const SIZE: [u32; 2] = [1600, 1200];
const FIELDS: usize = 20;

/// A frame of a part of the sky, and where it points.
pub struct Field {
    list: CentroidList,
    centre: UnitVector<Icrs>,
    fov_rad: f64,
    /// Stars of the catalogue in it.
    stars: usize,
}

/// Draws a frame: its stars with errors, a few of them missing, and as many false detections.
pub fn field(patch: &Patch, fov_deg: f64, random: &mut ChaCha8Rng) -> Field {
    const ERROR_PX: f64 = 0.15;
    const ERROR_MAG: f64 = 0.15;
    const DETECTED: usize = 60;
    let [width, height] = SIZE;
    let fov_rad = fov_deg * RAD_PER_DEG;
    let centre = near(&patch.centre, 2.0 * RAD_PER_DEG, random);
    let focal_px = f64::from(width) / 2.0 / (fov_rad / 2.0).tan();
    let [width_px, height_px] = SIZE.map(f64::from);
    let camera = CameraModel::pinhole(width_px, height_px, focal_px, random.random());
    let attitude = Rotation::looking_at(&centre, TAU * random.random::<f64>());
    let (place, magnitude) = (
        Normal::new(0.0, ERROR_PX).unwrap(),
        Normal::new(0.0, ERROR_MAG).unwrap(),
    );
    let mut stars = 0;
    let mut centroids = Vec::new();
    for star in &patch.stars {
        let pixel = camera.pixel_of(&attitude.apply(&star.direction));
        let Some(mut pixel) = pixel.filter(|pixel| camera.contains(pixel)) else {
            continue;
        };
        stars += 1;
        if centroids.len() < DETECTED && random.random::<f64>() > 0.1 {
            pixel.x = (pixel.x + place.sample(random)).clamp(0.0, width_px - 1.0);
            pixel.y = (pixel.y + place.sample(random)).clamp(0.0, height_px - 1.0);
            let mag = star.v_mag + magnitude.sample(random);
            centroids.push(ListedCentroid::new(pixel, mag - 20.0));
        }
    }
    for _ in 0..centroids.len() / 8 {
        let mut false_one = centroids[random.random_range(0..centroids.len())];
        false_one.position.x = random.random_range(0.0..width_px - 1.0);
        false_one.position.y = random.random_range(0.0..height_px - 1.0);
        centroids.push(false_one);
    }
    Field {
        list: CentroidList {
            width: Some(width as usize),
            height: Some(height as usize),
            photometry: Photometry::Instrumental,
            has_brightness: true,
            centroids,
        },
        centre,
        fov_rad,
        stars,
    }
}

/// Whether a field is identified with what is known of it; never wrongly.
pub fn is_identified(field: &Field, deep: &DeepSky, known: Priors) -> bool {
    let mut context = Context::new(sky());
    context.deep = Some(deep);
    context.priors = known;
    let solution = solve_centroids(&field.list, &context, &mut Workspace::new()).unwrap();
    let Some(found) = solution.outcome.identification() else {
        return false;
    };
    let off_rad = found.icrs_to_camera.boresight().angle_to(&field.centre);
    assert!(off_rad < 0.01 * field.fov_rad, "wrong: {off_rad}");
    assert!(solution.catalog(sky().catalog()).stars().len() > 10);
    true
}

/// A scale that is stated, with an error.
pub fn scale(field: &Field, error: f64) -> Priors {
    let scale = Scale::FieldOfView(field.fov_rad * (1.0 + error));
    Priors {
        scale: Some(ScalePrior::by_user(scale, 0.1)),
        ..Priors::default()
    }
}

/// The surroundings of a direction.
fn around(centre: UnitVector<Icrs>) -> Option<SkyRegion> {
    Some(SkyRegion {
        centre,
        radius_rad: 2.0 * RAD_PER_DEG,
    })
}

fn assert_fields(path: &Path, patch: &Patch) {
    let deep = DeepSky::new(DeepCatalog::find(path).unwrap(), None);
    let mut random = ChaCha8Rng::seed_from_u64(68);
    let mut identified = 0;
    // Two hundred and more for a report.
    let fields = std::env::var("STARPIPE_NARROW_FIELDS").ok();
    let fields = fields.map_or(FIELDS, |fields| fields.parse().unwrap());
    for number in 0..fields {
        let fov_deg = [0.2, 0.25, 0.3, 0.4, 0.5][number % 5];
        let field = field(patch, fov_deg, &mut random);
        assert!(field.stars > 10);
        let stated = near(&field.centre, 2.0 * RAD_PER_DEG, &mut random);
        let known = scale(&field, random.random_range(-0.09..0.09));
        // By the mount, or by the user.
        let [mount, user] = match number % 2 {
            0 => [around(stated), None],
            _ => [None, around(stated)],
        };
        let hinted = Priors {
            mount,
            near: user,
            ..known
        };
        identified += usize::from(is_identified(&field, &deep, hinted));
        if number % 5 == 0 {
            let wrong = Priors {
                near: around(near(&patch.centre, 0.3, &mut random)),
                ..known
            };
            is_identified(&field, &deep, wrong);
        }
    }
    assert!(deep.take_errors().is_empty());
    eprintln!("{}: {identified} of {fields}", path.display());
    assert!(
        identified + fields.div_ceil(20) >= fields,
        "{identified} of {fields}"
    );
}

/// Draws a frame of 0.4° as a list in a folder; what the program is to be told to identify it.
pub fn identify_drawn(patch: &Patch, folder: &Path) -> Vec<OsString> {
    const FOV_DEG: f64 = 0.4;
    let field = field(patch, FOV_DEG, &mut ChaCha8Rng::seed_from_u64(7));
    let rows = field.list.centroids.iter().map(|centroid| {
        let place = centroid.position;
        format!("{},{},{}\n", place.x, place.y, centroid.mag)
    });
    let list = folder.join("list.csv");
    fs::write(&list, format!("x,y,mag\n{}", rows.collect::<String>())).unwrap();
    let (ra_rad, dec_rad) = patch.centre.to_ra_dec();
    let (ra_deg, dec_deg) = (ra_rad / RAD_PER_DEG, dec_rad / RAD_PER_DEG);
    let [width, height] = SIZE;
    let stated = format!(
        "identify --format json --fov {FOV_DEG} --width {width} --height {height} --near {ra_deg},{dec_deg} --radius 3"
    );
    let stated = stated.split(' ').map(OsString::from);
    stated.chain([list.into_os_string()]).collect()
}

/// The program names the catalogue that it used, and says how many stars it expects where there are too few.
#[test]
fn the_report_names_the_catalogue_that_was_used() {
    let patch = Patch::draw([200.0, -40.0], 3.0, 900.0, 7);
    let folder = tempfile::tempdir().unwrap();
    let index = folder.path().join("index.fits");
    fs::write(&index, index_file(&patch.stars, Series::Gaia, false)).unwrap();
    let arguments = identify_drawn(&patch, folder.path());
    let ran = Ran::new(starpipe().args(&arguments));
    assert!(
        ran.stdout
            .contains("too narrow for the catalog: 1 star is expected"),
        "{}",
        ran.stdout
    );
    let ran = Ran::new(starpipe().args(&arguments).arg("--catalog").arg(&index));
    assert_eq!(ran.status, 0, "{}", ran.stdout);
    let report: serde_json::Value = serde_json::from_str(&ran.stdout).unwrap();
    let catalog = report["match"]["catalog"].as_str().unwrap();
    assert!(
        catalog.contains("astrometry.net") && catalog.contains("SKY2000"),
        "{catalog}"
    );
    // Other commands say that it is not for them.
    let mut calibrate = starpipe();
    calibrate.args(["calibrate", "fixtures/orion/orion.png", "--catalog"]);
    let ran = Ran::new(calibrate.arg(&index));
    assert_eq!(ran.status, 1);
    assert!(
        ran.stderr.contains("starpipe catalog import"),
        "{}",
        ran.stderr
    );
}

#[test]
fn fields_of_a_fifth_to_half_a_degree_are_identified_with_each_kind_of_catalogue() {
    let patch = Patch::draw([83.0, 22.0], 5.5, 1500.0, 68);
    let folder = tempfile::tempdir().unwrap();
    for (name, series) in [
        ("gaia", Series::Gaia),
        ("tycho", Series::Tycho),
        ("lite", Series::Lite),
    ] {
        let path = folder.path().join(format!("index-{name}.fits"));
        fs::write(&path, index_file(&patch.stars, series, false)).unwrap();
        assert_fields(&path, &patch);
    }
    for form in Form::ALL {
        let path = folder.path().join(form.file_name());
        form.write(&path, &patch);
        assert_fields(&path, &patch);
    }
    for (name, coarse, colored) in [("d80", false, false), ("v05", true, true)] {
        let database = folder.path().join(name);
        fs::create_dir(&database).unwrap();
        areas::write(&database, name, &patch.stars, coarse, colored);
        assert_fields(&database, &patch);
    }
}
