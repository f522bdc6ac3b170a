//! Pages that `--html` writes: one file that needs no other, with the numbers of the command's JSON.

use crate::common::{Ran, fixture, names, number, starpipe};
use image::{GrayImage, Luma};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use starpipe::frame::{FitsHeader, FitsSamples, Frame, write_fits};
use std::fs::{self, File};
use std::path::Path;

/// A page and the tables in it.
struct Page {
    html: String,
    tables: Vec<Value>,
}

impl Page {
    fn read(path: &Path) -> Self {
        let html = fs::read_to_string(path).unwrap();
        let beside_drawings = html.replace("http://www.w3.org/2000/svg", "");
        for reference in ["http:", "https:", "url(", "@import", "<link", "<script src"] {
            assert!(!beside_drawings.contains(reference), "{reference}");
        }
        let sources = html.matches("src=\"").count();
        assert_eq!(
            sources,
            html.matches("src=\"data:image/jpeg;base64,").count()
        );
        let data = html.split("id=\"data\">").nth(1).unwrap();
        let data = data.split("</script>").next().unwrap();
        let tables = serde_json::from_str(data).unwrap();
        Self { html, tables }
    }

    fn has(&self, text: &str) {
        assert!(
            self.html.contains(text),
            "{text} is not in {}",
            &self.html[..3000.min(self.html.len())]
        );
    }

    /// The title, which is the heading, too.
    fn is_titled(&self, title: &str) {
        let title = title.replace('&', "&amp;").replace('/', "&#x2f;");
        self.has(&format!("<title>{title} · starpipe</title>"));
        self.has(&format!("<h1>{title}</h1>"));
    }

    fn table(&self, title: &str) -> &Value {
        let found = self.tables.iter().find(|table| table["title"] == title);
        found.unwrap_or_else(|| panic!("no table {title}"))
    }

    /// A cell of a table.
    fn cell(&self, title: &str, column: &str, row: usize) -> Value {
        let columns = self.table(title)["columns"].as_array().unwrap();
        let column = columns
            .iter()
            .find(|found| found["name"] == column)
            .unwrap();
        match column.get("numbers") {
            Some(numbers) => numbers[row].clone(),
            None => {
                let which = column["texts"]["which"][row].as_u64().unwrap() as usize;
                column["texts"]["all"][which].clone()
            }
        }
    }

    fn pictures(&self) -> usize {
        self.html.matches("<img ").count()
    }

    fn figures(&self) -> usize {
        self.html.matches("class=\"drawing").count()
    }
}

fn run(directory: &Path, arguments: &[&str]) -> Ran {
    Ran::new(starpipe().args(arguments).current_dir(directory))
}

#[test]
fn a_limit_has_its_budget_and_a_sweep_its_values() {
    let directory = tempfile::tempdir().unwrap();
    let options = ["limit", "--preset", "experiment-1", "--format=json"];
    let ran = run(directory.path(), &[&options[..], &["--html"]].concat());
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let prediction = &ran.reports()[0];
    let page = Page::read(&directory.path().join("limit.html"));
    let camera = prediction["camera"].as_str().unwrap();
    page.is_titled(&format!("Limiting magnitude of {camera}"));
    page.has(&format!("V {:.2}", number(prediction, "/limit_vmag")));
    page.has("starpipe limit --preset experiment-1 --format=json --html");
    assert_eq!(page.figures(), 2);
    let budget = page.table("Signal and noise budget")["rows"]
        .as_u64()
        .unwrap() as usize;
    let noise = (0..budget)
        .find(|&row| page.cell("Signal and noise budget", "quantity", row) == "total noise");
    let noise = page.cell("Signal and noise budget", "value", noise.unwrap());
    assert_eq!(noise.as_f64().unwrap(), number(prediction, "/noise_e"));

    let sweep = ["--sweep=exposure_s=0.1:1:4", "--html=sweep.html"];
    let ran = run(directory.path(), &[&options[..], &sweep].concat());
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let page = Page::read(&directory.path().join("sweep.html"));
    for (row, prediction) in ran.reports().iter().enumerate() {
        let limit = page.cell("Predictions", "limit_vmag", row);
        assert_eq!(limit.as_f64().unwrap(), number(prediction, "/limit_vmag"));
    }
    assert_eq!(names(directory.path()), ["limit.html", "sweep.html"]);
}

#[test]
fn a_file_that_cannot_be_written_costs_neither_the_answer_nor_the_others() {
    let directory = tempfile::tempdir().unwrap();
    let options = ["limit", "--preset=experiment-1", "--format=json"];
    let files = [
        "--sweep=exposure_s=0.1:1:4",
        "--plot=a.svg",
        "--html=not/there.html",
    ];
    let ran = run(directory.path(), &[&options[..], &files].concat());
    assert_eq!(ran.status, 1);
    assert!(ran.stderr.contains("not/there.html"), "{}", ran.stderr);
    assert_eq!(ran.reports().len(), 4);
    assert_eq!(names(directory.path()), ["a.svg"]);
}

#[test]
fn a_page_overwrites_a_page_and_nothing_else() {
    let directory = tempfile::tempdir().unwrap();
    let limit = || {
        run(
            directory.path(),
            &["limit", "--preset=experiment-1", "--html"],
        )
    };
    for _ in 0..2 {
        let ran = limit();
        assert_eq!(ran.status, 0, "{}", ran.stderr);
    }
    fs::write(directory.path().join("limit.html"), "<p>mine</p>").unwrap();
    let ran = limit();
    assert_eq!(ran.status, 2);
    assert!(
        ran.stderr
            .contains("a file that starpipe did not write: limit.html"),
        "{}",
        ran.stderr
    );
    assert!(ran.stderr.contains("--html=FILE"), "{}", ran.stderr);
    let text = fs::read_to_string(directory.path().join("limit.html")).unwrap();
    assert_eq!(text, "<p>mine</p>");
    let ran = run(
        directory.path(),
        &["limit", "--preset=experiment-1", "--html=limit.txt"],
    );
    assert_eq!(ran.status, 2);
    assert!(
        ran.stderr.contains("expected a file name ending in .html"),
        "{}",
        ran.stderr
    );
}

#[test]
fn a_study_of_the_spot_has_its_radius_and_curve() {
    let directory = tempfile::tempdir().unwrap();
    let options = [
        "defocus",
        "--preset=nanosat-tracker",
        "--vmag=5",
        "--radius-px=0.3:1.5:7",
        "--noise-e=2:20:5:log",
        "--count=40",
        "--required-error=0.0001",
        "--format=json",
        "--out=out",
        "--html",
    ];
    let ran = run(directory.path(), &options);
    // No radius is that good.
    assert_eq!(ran.status, 3, "{}", ran.stderr);
    let report = &ran.reports()[0];
    let page = Page::read(&directory.path().join("out/defocus.html"));
    page.is_titled("Spot radius with the smallest centroid error");
    page.has(&format!(
        "{:.2} px, with an error of {:.4} px",
        number(report, "/stars/0/best/radius_px"),
        number(report, "/stars/0/best/error_px")
    ));
    page.has("no radius meets a required error");
    assert_eq!(page.figures(), 4);
    for row in 0..7 {
        let error = page.cell("Error versus radius", "error_px", row);
        assert_eq!(error, report["stars"][0]["curve"][row]["error_px"]);
    }
}

#[test]
fn dark_frames_have_their_noise_and_hot_pixels() {
    const SIZE: (usize, usize) = (64, 48);
    let directory = tempfile::tempdir().unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(5);
    for number in 0..4 {
        let noise = |random: &mut ChaCha8Rng| (0..12).map(|_| random.random::<f32>()).sum::<f32>();
        let mut pixels: Vec<f32> = (0..SIZE.0 * SIZE.1)
            .map(|_| (100.0 + 5.0 * (noise(&mut random) - 6.0)).round())
            .collect();
        pixels[700] += 900.0;
        let frame = Frame::new(SIZE.0, SIZE.1, pixels).unwrap();
        let file = File::create(directory.path().join(format!("dark{number}.fits"))).unwrap();
        write_fits(file, &frame, FitsSamples::Float32, &FitsHeader::default()).unwrap();
    }
    let ran = run(
        directory.path(),
        &["darks", "--exposure=1", "--format=json", "--html", "."],
    );
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let report = &ran.reports()[0];
    let page = Page::read(&directory.path().join("darks.html"));
    page.is_titled("Dark frames");
    page.has(&format!(
        "a read noise of {:.3} ADU",
        number(report, "/read_noise_adu")
    ));
    page.has("1 hot pixel ");
    assert_eq!(page.cell("Hot pixels", "x", 0), 700 % SIZE.0);
    assert_eq!(page.cell("Hot pixels", "y", 0), 700 / SIZE.0);
    for row in 0..4 {
        let mean = page.cell("Frames", "mean_adu", row);
        assert_eq!(mean.as_f64(), report["per_frame"][row]["mean_adu"].as_f64());
    }
    assert_eq!(page.figures(), 1);
}

#[test]
fn a_lens_has_its_errors_and_the_frames_that_are_left_out() {
    let directory = tempfile::tempdir().unwrap();
    let camera = concat!(
        "--camera=",
        env!("CARGO_MANIFEST_DIR"),
        "/docs/validation/camera.toml"
    );
    let simulate = [
        "simulate",
        "--random-attitude",
        "--date=2000-01-01T12:00:00Z",
        "--seed=3",
        "--count=5",
        camera,
    ];
    let lens = ["--distortion-px=-30", "--out=night"];
    let ran = run(directory.path(), &[&simulate[..], &lens].concat());
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    fs::copy(
        fixture("cygnus/cygnus.tif"),
        directory.path().join("night/other.tif"),
    )
    .unwrap();
    let frames: Vec<String> = names(&directory.path().join("night"))
        .into_iter()
        .filter(|name| name.ends_with(".tif"))
        .map(|name| format!("night/{name}"))
        .collect();
    let frames: Vec<&str> = frames.iter().map(String::as_str).collect();
    let options = [
        "calibrate",
        "--format=json",
        "--date=2000-01-01T12:00:00Z",
        "--out=lens.toml",
        "--html",
    ];
    let arguments = [&options[..], &frames].concat();
    let ran = run(directory.path(), &arguments);
    assert_eq!(ran.status, 3, "{}", ran.stderr);
    let report = &ran.reports()[0];
    let page = Page::read(&directory.path().join("lens.html"));
    page.is_titled("The lens of a camera");
    page.has(&format!(
        "focal length {:.3} ± {:.3} px",
        number(report, "/lens/focal_length_px"),
        number(report, "/lens/focal_length_sigma_px")
    ));
    page.has(&format!(
        "to {:.3} px on each axis",
        number(report, "/held_out_rms_px")
    ));
    page.has("<li>night&#x2f;other.tif was not used: ");
    assert_eq!((page.figures(), page.pictures()), (1, 1));
    assert_eq!(
        page.cell("Frames that were not used", "frame", 0),
        "night/other.tif"
    );
    for (row, frame) in report["frames"].as_array().unwrap().iter().enumerate() {
        assert_eq!(page.cell("Frames", "stars", row), frame["stars"]);
    }
    let ran = run(directory.path(), &arguments);
    assert_eq!(ran.status, 2, "{}", ran.stderr);
    fs::remove_file(directory.path().join("lens.toml")).unwrap();
    let ran = run(directory.path(), &arguments);
    assert!(
        ran.stderr
            .contains("lens.html exists; --force overwrites it"),
        "{}",
        ran.stderr
    );
}

#[test]
fn an_archive_has_its_counts_and_pictures_of_frames_that_failed() {
    let directory = tempfile::tempdir().unwrap();
    let night = directory.path().join("night");
    fs::create_dir(&night).unwrap();
    for hour in 0..3 {
        let name = night.join(format!("2020-03-01T2{hour}0000.tif"));
        fs::copy(fixture("cygnus/cygnus.tif"), name).unwrap();
    }
    fs::write(night.join("broken.tif"), "no image").unwrap();
    GrayImage::from_fn(300, 200, |x, y| Luma([((x * 7 + y * 13) % 11) as u8]))
        .save(night.join("empty.png"))
        .unwrap();
    let ran = run(
        directory.path(),
        &["process", "night/*", "--out-parquet=results"],
    );
    assert_eq!(ran.status, 1, "{}", ran.stderr);
    let before = names(&directory.path().join("results"));
    let ran = run(
        directory.path(),
        &["archive", "report", "results", "--format=json", "--html"],
    );
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let page = Page::read(&directory.path().join("results/report.html"));
    page.is_titled("Archive results");
    page.has("3 of 5 frames identified (60.0 %), 1 not identified, 1 could not be read.");
    // The file that is no image has no picture.
    assert_eq!((page.figures(), page.pictures()), (1, 1));
    page.has("<b>night&#x2f;empty.png</b>");
    let status = |row| page.cell("Frames", "status", row);
    let statuses: Vec<Value> = (0..5).map(status).collect();
    assert_eq!(statuses[2..], ["identified"; 3]);
    let nights = ran.reports();
    let dated = nights
        .iter()
        .position(|night| night["night"] == "2020-03-01")
        .unwrap();
    for name in ["frames", "identified", "limit50_vmag", "zero_point_vmag"] {
        assert_eq!(
            page.cell("Nights", name, dated),
            nights[dated][name],
            "{name}"
        );
    }
    assert_eq!(page.table("Why frames are not identified")["rows"], 2);
    // An archive with a page is still one.
    let ran = run(directory.path(), &["archive", "status", "results"]);
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let after: Vec<_> = names(&directory.path().join("results"));
    assert_eq!(after.len(), before.len() + 1);
}

/// A camera whose frames have few stars, so that some are not identified.
const CAMERA: [&str; 9] = [
    "--preset=nanosat-tracker",
    "--width-px=192",
    "--height-px=192",
    "--pitch-x-um=20",
    "--pitch-y-um=20",
    "--focal-length-mm=24.4",
    "--aperture-mm=3",
    "--spot-sigma-px=0.8",
    "--scale-unknown",
];

#[test]
fn a_validation_has_its_rates_and_pictures_of_frames_that_failed() {
    let directory = tempfile::tempdir().unwrap();
    let options = [
        "validate",
        "--out=run",
        "--count=24",
        "--seed=2",
        "--format=json",
        "--html",
    ];
    let ran = run(directory.path(), &[&options[..], &CAMERA].concat());
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let summary = &ran.reports()[0];
    let page = Page::read(&directory.path().join("run/validate.html"));
    page.is_titled(&format!(
        "Validation of {}",
        summary["camera"].as_str().unwrap()
    ));
    let all = &summary["identification"];
    let (right, failed) = (
        all["right"].as_u64().unwrap(),
        24 - all["right"].as_u64().unwrap(),
    );
    assert!(right > 0 && failed > 0, "{all}");
    page.has(&format!("{right} of 24 frames identified correctly"));
    page.has(&format!(
        "V {:.3}",
        number(summary, "/completeness/predicted_limit_vmag")
    ));
    page.has(&format!(
        "{:.3} ± {:.3}",
        number(summary, "/attitude/nees_mean"),
        number(summary, "/attitude/nees_sigma")
    ));
    assert_eq!((page.figures(), page.pictures()), (6, failed as usize));
    let status = |row| page.cell("Frames, failures first", "status", row);
    assert_ne!(status(0), "right");
    assert_eq!(status(23), "right");
    let sd = page.cell("Pulls", "sd", 0);
    assert_eq!(sd.as_f64().unwrap(), number(summary, "/pulls/x/sd"));
}

#[test]
fn a_study_of_a_parameter_has_a_row_for_each_value() {
    let directory = tempfile::tempdir().unwrap();
    let options = [
        "validate",
        "--out=study",
        "--count=4",
        "--format=json",
        "--html",
        "--sweep=read_noise_e=5:20:2",
    ];
    let ran = run(directory.path(), &[&options[..], &CAMERA].concat());
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let page = Page::read(&directory.path().join("study/validate.html"));
    for (row, study) in ran.reports().iter().enumerate() {
        for name in ["value", "right", "predicted_limit_vmag"] {
            let cell = page.cell("Values", name, row);
            assert_eq!(cell.as_f64(), study[name].as_f64(), "{name}");
        }
    }
    assert_eq!(page.figures(), 1);
}
