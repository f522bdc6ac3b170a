//! Darks, flats and calibration through the program: what was simulated is measured and corrected.

use crate::common::{Ran, fixture, names, number, starpipe};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde_json::Value;
use starpipe::calibration::{Calibration, Master};
use starpipe::camera::data_sheet::Preset;
use starpipe::frame::{self, FitsHeader, FitsSamples, Frame, write_fits};
use starpipe::lab::simulate::star_field;
use starpipe::predict::{Scenario, SkyBrightness};
use std::collections::{HashMap, HashSet};
use std::fs::{self, File};
use std::path::{Path, PathBuf};

/// Tolerance of measured values, in standard errors.
const SIGMAS: f64 = 5.0;
const READ_NOISE_E: f64 = 12.0;
const DARK_CURRENT_E_S: f64 = 30.0;
const GAIN_E_PER_ADU: f64 = 4.0;
const BIAS_ADU: f64 = 200.0;
const SIZE: (usize, usize) = (320, 240);

/// A camera in the dark.
fn scenario(exposure_s: f64) -> Scenario {
    let mut scenario = Scenario::of(Preset::Experiment2);
    scenario.conditions.sky = SkyBrightness::MagArcsec2(60.0);
    scenario.conditions.exposure_s = exposure_s;
    let sheet = &mut scenario.camera;
    (sheet.width_px, sheet.height_px) = SIZE;
    sheet.read_noise_e = READ_NOISE_E;
    sheet.dark_current_e_s = DARK_CURRENT_E_S;
    sheet.gain_e_per_adu = GAIN_E_PER_ADU;
    sheet.bias_adu = BIAS_ADU;
    sheet.bits = 12;
    sheet.full_well_e = 1e5;
    scenario
}

/// Non-uniformity of a detector's pixels, in ADU and ADU a second.
struct Detector {
    pattern: Vec<f32>,
    hot: HashMap<usize, f32>,
}

impl Detector {
    fn new(pixels: usize, width: usize, hot_share: f64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(11);
        let mut whole = |sigma: f64| -> f32 {
            let normal: f64 = StandardNormal.sample(&mut random);
            (sigma * normal).round() as f32
        };
        let columns: Vec<f32> = (0..width).map(|_| whole(2.0)).collect();
        let pattern = (0..pixels)
            .map(|i| columns[i % width] + whole(3.0))
            .collect();
        let count = (pixels as f64 * hot_share) as usize;
        let hot = (0..count).map(|_| {
            (
                random.random_range(0..pixels),
                random.random_range(60.0..600.0_f32).round(),
            )
        });
        Self {
            pattern,
            hot: hot.collect(),
        }
    }

    /// Adds the pattern and the hot pixels' current.
    fn add_to(&self, frame: &mut Frame, exposure_s: f64) {
        for (i, pixel) in frame.values_mut().iter_mut().enumerate() {
            let current = self.hot.get(&i).copied().unwrap_or(0.0);
            let level = *pixel + self.pattern[i] + (current * exposure_s as f32).round();
            *pixel = level.clamp(0.0, 65535.0);
        }
    }
}

fn write(path: &Path, frame: &Frame, exposure_s: Option<f64>) {
    let mut header = FitsHeader::default();
    if let Some(exposure_s) = exposure_s {
        header.real("EXPTIME", exposure_s, "");
    }
    write_fits(
        File::create(path).unwrap(),
        frame,
        FitsSamples::Unsigned16,
        &header,
    )
    .unwrap();
}

/// Writes `count` darks and returns their directory.
fn darks(place: &Path, detector: &Detector, exposure_s: f64, count: u64) -> PathBuf {
    let directory = place.join(format!("darks-{exposure_s}"));
    fs::create_dir(&directory).unwrap();
    for number in 0..count {
        let seed = number + (exposure_s * 1000.0) as u64;
        let mut dark = star_field(&scenario(exposure_s), &[], seed).unwrap();
        detector.add_to(&mut dark, exposure_s);
        write(
            &directory.join(format!("{number:02}.fits")),
            &dark,
            Some(exposure_s),
        );
    }
    directory
}

fn ran(arguments: &[&str]) -> Ran {
    Ran::new(starpipe().args(arguments))
}

fn report(ran: &Ran) -> Value {
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    serde_json::from_str(&ran.stdout).unwrap()
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn camera(place: &Path) -> PathBuf {
    let path = place.join("camera.toml");
    let mut description = ran(&["camera", "new"]).stdout;
    for (key, value) in [
        ("gain_e_per_adu", GAIN_E_PER_ADU),
        ("bits", 12.0),
        ("bias_adu", BIAS_ADU),
    ] {
        let line = description
            .lines()
            .find(|line| line.starts_with(key))
            .unwrap()
            .to_owned();
        description = description.replace(&line, &format!("{key} = {value}"));
    }
    fs::write(&path, description).unwrap();
    path
}

fn spread(values: &[f32]) -> f64 {
    let count = values.len() as f64;
    let mean = values.iter().map(|v| f64::from(*v)).sum::<f64>() / count;
    let squares = values.iter().map(|v| (f64::from(*v) - mean).powi(2));
    (squares.sum::<f64>() / count).sqrt()
}

/// Asserts that dark current and bias are those simulated.
fn check_current(found: &Value, detector: &Detector) {
    let pixels = detector.pattern.len();
    let (current, sigma) = (
        number(found, "/dark_current/median_e_s"),
        number(found, "/dark_current/median_sigma_e_s"),
    );
    assert!(sigma < 0.2, "{sigma}");
    assert!(
        (current - DARK_CURRENT_E_S).abs() < SIGMAS * sigma,
        "{current} {sigma}"
    );
    let hot_mean = detector.hot.values().map(|v| f64::from(*v)).sum::<f64>() / pixels as f64;
    let mean = number(found, "/dark_current/mean_adu_s");
    let expected = DARK_CURRENT_E_S / GAIN_E_PER_ADU + hot_mean;
    assert!((mean / expected - 1.0).abs() < 0.01, "{mean} {expected}");
    let pattern_mean = f64::from(detector.pattern.iter().sum::<f32>()) / pixels as f64;
    let bias = number(found, "/dark_current/bias_adu");
    assert!(
        (bias - BIAS_ADU - pattern_mean).abs()
            < SIGMAS * number(found, "/dark_current/bias_sigma_adu"),
        "{bias}"
    );
}

/// Asserts that the hot pixels listed are those simulated.
fn check_hot_pixels(out: &Path, detector: &Detector) {
    let table = fs::read_to_string(out.join("hot-pixels.csv")).unwrap();
    let listed: HashSet<usize> = table
        .lines()
        .skip(1)
        .map(|line| {
            let fields: Vec<&str> = line.split(',').collect();
            fields[0].parse::<usize>().unwrap() + SIZE.0 * fields[1].parse::<usize>().unwrap()
        })
        .collect();
    let put_in: HashSet<usize> = detector.hot.keys().copied().collect();
    assert!(put_in.is_subset(&listed));
    assert!(
        listed.len() <= put_in.len() + 2,
        "{} {}",
        listed.len(),
        put_in.len()
    );
}

#[test]
fn noise_pattern_dark_current_and_hot_pixels_are_measured_as_simulated() {
    let place = tempfile::tempdir().unwrap();
    let pixels = SIZE.0 * SIZE.1;
    let detector = Detector::new(pixels, SIZE.0, 0.002);
    let short = darks(place.path(), &detector, 0.1, 12);
    let long = darks(place.path(), &detector, 2.0, 12);
    let (camera, out) = (camera(place.path()), place.path().join("out"));
    let arguments = [
        "darks",
        "--format",
        "json",
        "--camera",
        text(&camera),
        "--out",
        text(&out),
        text(&short),
        text(&long),
    ];
    let done = ran(&arguments);
    assert_eq!(done.stderr, "");
    let found = report(&done);

    // Each pixel's variance has 11 degrees of freedom.
    let noise_error = (0.5 / (11.0 * pixels as f64)).sqrt();
    let read_noise = number(&found, "/read_noise_e");
    assert!(
        (read_noise / READ_NOISE_E - 1.0).abs() < SIGMAS * noise_error + 5e-4,
        "{read_noise}"
    );
    let with_shot = (READ_NOISE_E.powi(2) + 2.0 * DARK_CURRENT_E_S).sqrt();
    let noise = number(&found, "/exposures/1/temporal_noise_e");
    assert!(
        (noise / with_shot - 1.0).abs() < SIGMAS * noise_error + 5e-4,
        "{noise} {with_shot}"
    );

    let spread = spread(&detector.pattern);
    let fixed = number(&found, "/pattern/fixed_pattern_adu");
    assert!((fixed / spread - 1.0).abs() < 0.01, "{fixed} {spread}");
    // Rounding adds a twelfth to the variance.
    let column = number(&found, "/pattern/column_adu");
    assert!(
        (column - (4.0 + 1.0 / 12.0_f64).sqrt()).abs() < SIGMAS * 2.0 / 640f64.sqrt(),
        "{column}"
    );
    assert!(number(&found, "/pattern/row_adu") < 0.1);

    check_current(&found, &detector);
    assert_eq!(
        names(&out),
        [
            "hot-pixels.csv",
            "master-dark-0.1s.fits",
            "master-dark-2s.fits",
            "noise.fits"
        ]
    );
    check_hot_pixels(&out, &detector);
    let master = frame::read(out.join("master-dark-2s.fits")).unwrap();
    assert_eq!(
        (master.width, master.height, master.metadata.exposure_s),
        (SIZE.0, SIZE.1, Some(2.0))
    );
    let hot = *detector.hot.iter().next().unwrap().0;
    assert!(master.pixels.value(hot) > 300.0);
    let text = ran(&[
        "darks",
        "--camera",
        text(&camera),
        text(&short),
        text(&long),
    ])
    .stdout;
    assert!(
        text.contains("dark current") && text.contains("read noise"),
        "{text}"
    );
}

#[test]
fn exposures_can_be_given_and_csv_rows_are_frames() {
    let place = tempfile::tempdir().unwrap();
    let detector = Detector::new(SIZE.0 * SIZE.1, SIZE.0, 0.0);
    let (short, long) = (
        darks(place.path(), &detector, 0.1, 2),
        darks(place.path(), &detector, 1.0, 2),
    );
    let of = |path: &Path, seconds: &str| format!("{seconds}:{}", path.display());
    let (one, two) = (of(&short, "5"), of(&long, "7"));
    let done = ran(&[
        "darks",
        "--exposure",
        &one,
        "--exposure",
        &two,
        "--format",
        "csv",
        "--bits",
        "12",
        text(&short),
        text(&long),
    ]);
    let rows: Vec<&str> = done.stdout.lines().collect();
    assert_eq!((done.status, rows.len()), (0, 5), "{}", done.stderr);
    assert!(
        rows[0].starts_with("frame,exposure_s,mean_adu,sigma_adu,relative_mean,relative_sigma,")
    );
    assert!(
        rows[1].contains("00.fits,5.0,") && rows[4].contains("01.fits,7.0,"),
        "{rows:?}"
    );
    let relative: f64 = rows[1].split(',').nth(4).unwrap().parse().unwrap();
    assert!((relative - BIAS_ADU / 4096.0).abs() < 1e-3, "{relative}");
    let done = ran(&["darks", "--exposure", "5:elsewhere", text(&short)]);
    assert_eq!(done.status, 2);
    assert!(
        done.stderr.contains(
            "--exposure gives the exposure of elsewhere, but no frame in it is processed"
        ),
        "{}",
        done.stderr
    );
    assert_eq!(ran(&["darks", "--exposure", "5:", text(&short)]).status, 2);
    assert_eq!(ran(&["darks", "--bits", "0", text(&short)]).status, 2);
    // Master frames in a directory are not processed as frames.
    let out = text(&short);
    assert_eq!(ran(&["darks", "--out", out, out]).status, 0);
    assert_eq!(
        report(&ran(&["darks", "--format", "json", "--out", out, out]))["frames"],
        2
    );
}

#[test]
fn frames_that_are_not_dark_are_named() {
    let place = tempfile::tempdir().unwrap();
    let detector = Detector::new(SIZE.0 * SIZE.1, SIZE.0, 0.0);
    let directory = darks(place.path(), &detector, 0.1, 2);
    let mut starry = scenario(0.1);
    starry.conditions.sky = SkyBrightness::MagArcsec2(20.0);
    let stars: Vec<_> = (0..30)
        .map(|i| {
            (
                starpipe::base::coords::PixelPoint::new(
                    20.0 + 9.3 * f64::from(i),
                    30.0 + 6.1 * f64::from(i),
                ),
                3.0,
            )
        })
        .collect();
    let frame = star_field(&starry, &stars, 1).unwrap();
    write(&directory.join("stars.fits"), &frame, Some(0.1));
    let done = ran(&["darks", text(&directory)]);
    assert_eq!(done.status, 0);
    assert!(
        done.stderr
            .contains("stars.fits does not look like a dark frame")
            && done.stderr.contains("look like stars"),
        "{}",
        done.stderr
    );
    assert_eq!(done.stderr.lines().count(), 1, "{}", done.stderr);

    let small = place.path().join("small.fits");
    write(&small, &Frame::new(10, 10, vec![5.0; 100]).unwrap(), None);
    let done = ran(&["darks", text(&directory), text(&small)]);
    assert_eq!((done.status, done.stdout.as_str()), (1, ""));
    assert!(
        done.stderr.contains("small.fits has 10 x 10 pixels, but")
            && done.stderr.contains("00.fits has 320 x 240"),
        "{}",
        done.stderr
    );

    fs::write(directory.join("broken.fits"), "SIMPLE  = no").unwrap();
    let done = ran(&["darks", "--format", "json", text(&directory)]);
    assert_eq!(done.status, 1);
    assert!(
        done.stderr.contains("broken.fits: truncated FITS"),
        "{}",
        done.stderr
    );
    assert_eq!(
        serde_json::from_str::<Value>(&done.stdout).unwrap()["frames"],
        3
    );
    let done = ran(&["darks", text(&directory.join("broken.fits"))]);
    assert_eq!((done.status, done.stdout.as_str()), (1, ""));
    let foreign = place.path().join("foreign");
    fs::create_dir(&foreign).unwrap();
    fs::write(foreign.join("hot-pixels.csv"), "mine").unwrap();
    let done = ran(&[
        "darks",
        "--out",
        text(&foreign),
        text(&directory.join("00.fits")),
    ]);
    assert_eq!(done.status, 2);
    assert!(
        done.stderr.contains("a file that starpipe did not write"),
        "{}",
        done.stderr
    );
    assert_eq!(names(&foreign), ["hot-pixels.csv"]);
}

/// Stars of Cygnus on a detector with a pattern and hot pixels, and its darks.
struct Night {
    place: tempfile::TempDir,
    clean: Frame<'static>,
    detector: Detector,
}

impl Night {
    fn new() -> Self {
        let place = tempfile::tempdir().unwrap();
        let clean = frame::read(fixture("cygnus/cygnus.tif")).unwrap();
        let (pixels, width) = (clean.pixels.len(), clean.width);
        let mut detector = Detector::new(pixels, width, 0.003);
        // The frame's noise is large, so the pattern is as large, and hot pixels are as bright as
        // easily detected stars.
        detector.pattern.iter_mut().for_each(|level| *level *= 3.0);
        detector
            .hot
            .values_mut()
            .for_each(|level| *level = 400.0 + 4.0 * *level);
        let mut night = clean.clone();
        detector.add_to(&mut night, 1.0);
        write(&place.path().join("night.fits"), &night, Some(1.0));
        let directory = place.path().join("darks");
        fs::create_dir(&directory).unwrap();
        let mut random = ChaCha8Rng::seed_from_u64(3);
        for number in 0..16 {
            let noise = |_| {
                let normal: f64 = StandardNormal.sample(&mut random);
                (300.0 + 5.0 * normal).round() as f32
            };
            let levels = (0..pixels).map(noise).collect();
            let mut dark = Frame::new(width, clean.height, levels).unwrap();
            detector.add_to(&mut dark, 1.0);
            write(&directory.join(format!("{number}.fits")), &dark, Some(1.0));
        }
        let masters = place.path().join("masters");
        assert_eq!(
            ran(&["darks", "--out", text(&masters), text(&directory)]).status,
            0
        );
        Self {
            place,
            clean,
            detector,
        }
    }

    fn path(&self, name: &str) -> String {
        text(&self.place.path().join(name)).to_owned()
    }

    fn process(&self, more: &[&str]) -> Ran {
        let night = self.path("night.fits");
        ran(&[&["process", "--format", "json"], more, &[&night]].concat())
    }
}

/// The detections within half a pixel of a hot pixel.
fn at_hot_pixels(report: &Value, detector: &Detector, width: usize) -> usize {
    let stars = report["stars"].as_array().unwrap();
    let on_hot = |star: &&Value| {
        let (x, y) = (star["x"].as_f64().unwrap(), star["y"].as_f64().unwrap());
        let (column, row) = (x.round() as usize, y.round() as usize);
        detector.hot.contains_key(&(row * width + column))
            && (x - x.round()).hypot(y - y.round()) < 0.3
    };
    stars.iter().filter(on_hot).count()
}

#[test]
fn calibrated_frames_have_their_stars_and_no_hot_pixels() {
    let night = Night::new();
    let width = night.clean.width;
    let (dark, hot) = (
        night.path("masters/master-dark.fits"),
        night.path("masters/hot-pixels.csv"),
    );
    let raw = night.process(&[]).reports().remove(0);
    let done = night.process(&["--dark", &dark, "--hot-pixels", &hot]);
    assert_eq!(done.status, 0, "{}", done.stderr);
    let calibrated = done.reports().remove(0);
    assert_eq!(calibrated["calibration"]["dark"], dark);
    assert_eq!(calibrated["calibration"]["flat"], Value::Null);
    assert_eq!(calibrated["calibration"]["hot_pixels"], hot);
    // There is no date.
    assert_eq!(
        calibrated["notes"].as_array().unwrap().len(),
        1,
        "{}",
        calibrated["notes"]
    );
    assert_eq!(raw["calibration"], Value::Null);
    let noted = night.process(&["--dark", &dark, "--exposure", "5"]);
    let note = noted.reports()[0]["notes"].to_string();
    assert!(
        note.contains("was exposed for 1 s, but the frame for 5 s"),
        "{note}"
    );

    let clean_path = night.path("clean.fits");
    write(Path::new(&clean_path), &night.clean, Some(1.0));
    let clean = ran(&["process", "--format", "json", &clean_path])
        .reports()
        .remove(0);
    let count = |report: &Value| at_hot_pixels(report, &night.detector, width);
    assert!(
        count(&raw) > night.detector.hot.len() / 2,
        "{}",
        count(&raw)
    );
    assert!(
        count(&calibrated) <= count(&clean) + 3,
        "{} {}",
        count(&calibrated),
        count(&clean)
    );
    let matched = |report: &Value| number(report, "/match/matched");
    assert!(
        matched(&calibrated) > 0.97 * matched(&clean),
        "{} {}",
        matched(&calibrated),
        matched(&clean)
    );
    // Level and noise equal those of the frame without a pattern.
    assert!(
        (number(&calibrated, "/background/level") - number(&clean, "/background/level")).abs()
            < 1.0
    );
    assert!(
        (number(&calibrated, "/background/noise") / number(&clean, "/background/noise") - 1.0)
            .abs()
            < 0.06
    );
    assert!(number(&calibrated, "/background/noise") < 0.95 * number(&raw, "/background/noise"));
}

#[test]
fn a_star_on_or_beside_an_invalid_pixel_keeps_position_and_flux() {
    let night = Night::new();
    let clean_path = night.path("clean.fits");
    write(Path::new(&clean_path), &night.clean, Some(1.0));
    let clean = ran(&["process", "--format", "json", &clean_path])
        .reports()
        .remove(0);
    // One invalid pixel for each of the brighter single stars: on it, beside it, and so on.
    let stars = clean["stars"].as_array().unwrap();
    let good = stars.iter().filter(|star| {
        star["id"].is_string()
            && star["flags"].as_array().unwrap().is_empty()
            && star["snr"].as_f64().unwrap() > 10.0
    });
    let mut table = "x,y,reason\n".to_owned();
    let mut chosen = HashMap::new();
    for (i, star) in good.enumerate().take(120) {
        let (x, y) = (
            star["x"].as_f64().unwrap().round() as usize,
            star["y"].as_f64().unwrap().round() as usize,
        );
        table += &format!("{},{},level\n", x + i % 3, y + i / 3 % 2);
        chosen.insert(star["id"].as_str().unwrap(), star);
    }
    assert!(chosen.len() > 40, "{}", chosen.len());
    let list = night.path("few.csv");
    fs::write(&list, table).unwrap();
    let done = ran(&[
        "process",
        "--format",
        "json",
        "--hot-pixels",
        &list,
        &clean_path,
    ]);
    let masked = done.reports().remove(0);
    let (mut missing, mut off) = (0, Vec::new());
    let found: HashMap<_, _> = masked["stars"]
        .as_array()
        .unwrap()
        .iter()
        .filter_map(|star| Some((star["id"].as_str()?, star)))
        .collect();
    for (id, before) in &chosen {
        let Some(after) = found.get(id) else {
            missing += 1;
            continue;
        };
        let shift = |axis: &str, sigma: &str| {
            let moved = after[axis].as_f64().unwrap() - before[axis].as_f64().unwrap();
            moved / after[sigma].as_f64().unwrap()
        };
        off.push(shift("x", "sigma_x").hypot(shift("y", "sigma_y")));
        let flux = |star: &Value| star["flux"].as_f64().unwrap();
        let change = (flux(after) / flux(before) - 1.0) * after["snr"].as_f64().unwrap();
        assert!(change.abs() < 4.0, "{id}: {change} standard errors");
    }
    off.sort_by(f64::total_cmp);
    println!(
        "missing {missing} of {}, median shift {:.3} sigma, largest {:.3}",
        chosen.len(),
        off[off.len() / 2],
        off[off.len() - 1]
    );
    assert!(missing <= 1, "{missing}");
    assert!(
        off[off.len() / 2] < 1.0 && off[off.len() * 95 / 100] < 2.5,
        "{off:?}"
    );
}

/// Transmission of a lens with vignetting.
fn lit(level_adu: f64, seed: u64) -> Frame<'static> {
    let (width, height) = SIZE;
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let pixels = (0..width * height).map(|i| {
        let x = (i % width) as f64 / width as f64 - 0.5;
        let y = (i / width) as f64 / height as f64 - 0.5;
        let signal = level_adu * (1.0 - 0.5 * (x * x + y * y));
        let normal: f64 = StandardNormal.sample(&mut random);
        let sigma = (signal / GAIN_E_PER_ADU).sqrt().hypot(3.0);
        (BIAS_ADU + signal + sigma * normal).round() as f32
    });
    Frame::new(width, height, pixels.collect()).unwrap()
}

/// Mean of a 40-pixel square with this corner.
fn mean_of_square(frame: &Frame, (left, top): (usize, usize)) -> f64 {
    let values = frame.values();
    let row = |y: usize| &values[y * frame.width + left..][..40];
    let rows = (top..top + 40).flat_map(row);
    rows.map(|p| f64::from(*p)).sum::<f64>() / 1600.0
}

#[test]
fn a_flat_corrects_vignetting() {
    let place = tempfile::tempdir().unwrap();
    let levels = [4000.0, 4000.0, 20_000.0, 20_100.0, 20_000.0, 20_000.0];
    let mut names = Vec::new();
    for (number, level_adu) in levels.into_iter().enumerate() {
        let path = place.path().join(format!("flat-{number}.fits"));
        write(&path, &lit(level_adu, number as u64), None);
        names.push(text(&path).to_owned());
    }
    let (camera, out) = (camera(place.path()), place.path().join("out"));
    let options = ["flats", "--format", "json", "--camera", text(&camera)];
    let mut arguments = [&options[..], &["--out", text(&out)]].concat();
    arguments.extend(names.iter().map(String::as_str));
    let found = report(&ran(&arguments));
    let gain = number(&found, "/gain_e_per_adu");
    let sigma = number(&found, "/gain_sigma_e_per_adu");
    assert!(
        (gain - GAIN_E_PER_ADU).abs() < SIGMAS * sigma && sigma < 0.05,
        "{gain} {sigma}"
    );

    let flat = out.join("master-flat.fits");
    let sky = place.path().join("sky.fits");
    let mut frame = lit(2000.0, 99);
    write(&sky, &frame, None);
    let arguments = ["process", "--format", "json", "--camera", text(&camera)];
    let done = ran(&[&arguments[..], &["--flat", text(&flat), text(&sky)]].concat());
    assert_eq!(done.status, 3, "{}", done.stderr);
    let calibrated = &done.reports()[0];
    assert_eq!(calibrated["calibration"]["flat"], text(&flat));
    let noise = number(calibrated, "/background/noise");
    // Photon and read noise in the middle of the frame.
    let expected = (2000.0_f64 / GAIN_E_PER_ADU).sqrt().hypot(3.0);
    assert!((noise / expected - 1.0).abs() < 0.1, "{noise} {expected}");

    let master = Master {
        name: String::new(),
        frame: frame::read(&flat).unwrap(),
    };
    let sum: f64 = master.frame.values().iter().map(|p| f64::from(*p)).sum();
    assert!((sum / (SIZE.0 * SIZE.1) as f64 - 1.0).abs() < 1e-6);
    let calibration = Calibration::new(None, Some(master), None, BIAS_ADU).unwrap();
    calibration.apply(&mut frame).unwrap();
    let corner = mean_of_square(&frame, (0, 0));
    let middle = mean_of_square(&frame, (140, 100));
    // 1600 pixels each, with a noise of about 23, slightly more in the corner.
    assert!(
        (corner - middle).abs() < SIGMAS * 27.0 / 40.0 * 2f64.sqrt(),
        "{corner} {middle}"
    );
}

/// Asserts that processing the fixture (640 × 480) with `option` is refused in one line with these
/// words.
fn check_refused(option: &str, path: &Path, words: [&str; 2]) {
    let orion = fixture("orion/orion.png");
    let arguments = ["process", "--format", "json", option, text(path)];
    let done = ran(&[&arguments[..], &[text(&orion)]].concat());
    assert_eq!((done.status, done.stdout.as_str()), (1, ""), "{words:?}");
    for word in words {
        assert!(done.stderr.contains(word), "{word}: {}", done.stderr);
    }
    assert_eq!(done.stderr.lines().count(), 1, "{}", done.stderr);
}

fn write_master(path: PathBuf, (width, height): (usize, usize), pixels: Vec<f32>) -> PathBuf {
    let frame = Frame::new(width, height, pixels).unwrap();
    let file = File::create(&path).unwrap();
    write_fits(file, &frame, FitsSamples::Float32, &FitsHeader::default()).unwrap();
    path
}

#[test]
fn masters_that_do_not_fit_are_refused() {
    let place = tempfile::tempdir().unwrap();
    let file = |name: &str| place.path().join(name);
    let (size, all) = ((640, 480), 640 * 480);
    let small = write_master(file("small.fits"), (10, 10), vec![1.0; 100]);
    let zeros = write_master(file("zeros.fits"), size, vec![0.0; all]);
    let mut holes = vec![1.0; all];
    holes[..all / 5].fill(-1.0);
    let holes = write_master(file("holes.fits"), size, holes);
    let expected = "has 10 x 10 pixels: expected 640 x 480, as the frame";
    check_refused("--dark", &small, ["the dark", expected]);
    check_refused("--flat", &small, ["the flat", expected]);
    let expected = "found 307200 of 307200 pixels without a response";
    check_refused("--flat", &zeros, ["the flat", expected]);
    let expected = "found 61440 of 307200 pixels without a response";
    check_refused("--flat", &holes, ["the flat", expected]);
    check_refused(
        "--dark",
        &file("absent.fits"),
        ["absent.fits", "cannot be read"],
    );
    fs::write(file("empty.fits"), "").unwrap();
    check_refused(
        "--dark",
        &file("empty.fits"),
        ["empty.fits", "found 0 bytes"],
    );
    let dark = write_master(file("dark.fits"), size, vec![0.0; all]);
    let orion = fixture("orion/orion.png");
    let done = ran(&["process", "--dark", text(&dark), text(&orion)]);
    assert_eq!(done.status, 0, "{}", done.stderr);
}

#[test]
fn lists_that_are_not_of_hot_pixels_are_refused() {
    let place = tempfile::tempdir().unwrap();
    let check = |content: &str, words: [&str; 2]| {
        let path = place.path().join("list.csv");
        fs::write(&path, content).unwrap();
        check_refused("--hot-pixels", &path, words);
    };
    let expected = "found the pixel (640, 3), expected x below 640 and y below 480";
    check("x,y\n1,2\n640,3\n", ["list.csv, line 3", expected]);
    let expected = "found \"-1\", expected a whole number from 0";
    check("x,y\n-1,2\n", ["list.csv, line 2", expected]);
    check("x,y\n1\n", ["list.csv", "found record with 1 fields"]);
    let expected = "expected x and y among them";
    check("12,13\n14,15\n", ["list.csv, line 1", expected]);
    check("", ["list.csv, line 1", expected]);
    let absent = place.path().join("absent.csv");
    check_refused("--hot-pixels", &absent, ["absent.csv", "No such file"]);
}
