//! `starpipe limit` and `starpipe camera` through the program.

use crate::common::{Ran, names, number, starpipe};
use serde_json::Value;
use std::fs;
use std::path::Path;

fn limit(options: &[&str]) -> Ran {
    Ran::new(starpipe().arg("limit").args(options))
}

/// What `starpipe limit --format json` prints.
fn predictions(options: &[&str]) -> Vec<Value> {
    let ran = limit(&[options, &["--format", "json"]].concat());
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    ran.reports()
}

fn predicted(options: &[&str]) -> Value {
    let mut found = predictions(options);
    assert_eq!(found.len(), 1);
    found.remove(0)
}

/// The description of experiment 1 in `directory`, with one line replaced.
fn camera(directory: &Path, key: &str, line: &str) -> String {
    let text = Ran::new(starpipe().args(["camera", "new"])).stdout;
    let changed = text.lines().map(|old| match old.split(" = ").next() {
        Some(name) if name == key => line,
        _ => old,
    });
    let path = directory.join("camera.toml");
    fs::write(&path, changed.collect::<Vec<_>>().join("\n")).unwrap();
    path.to_str().unwrap().to_owned()
}

#[test]
fn the_papers_experiments_have_the_papers_limits() {
    // Tong, Li & Wang 2014, eqs. (13) and (14).
    let first = number(&predicted(&["--preset", "experiment-1"]), "/limit_vmag");
    assert!((first - 8.15).abs() < 0.01, "{first}");
    let second = number(&predicted(&["--preset", "experiment-2"]), "/limit_vmag");
    assert!((second - 9.01).abs() < 0.03, "{second}");
}

#[test]
fn the_readings_differ_by_what_the_documentation_says() {
    let at = |preset: &str, options: &[&str]| {
        number(
            &predicted(&[&["--preset", preset], options].concat()),
            "/limit_vmag",
        )
    };
    // The zenith distances at which Kasten & Young's airmass is 1 and √2.
    for (preset, zenith_distance_deg, air, expected) in [
        (
            "experiment-1",
            "1.392",
            0.725_426_27,
            [8.150, 8.158, 8.156, 7.765, 7.765, 7.765],
        ),
        (
            "experiment-2",
            "45.066",
            0.635_285_47,
            [8.989, 9.004, 9.000, 8.613, 8.614, 8.613],
        ),
    ] {
        let hemisphere = 0.01 / std::f64::consts::PI;
        let (lower, brighter) = (hemisphere.to_string(), (hemisphere / air).to_string());
        let exact = ["--reading", "physical", "--gain-e-per-adu", "1e-9"];
        let found = [
            at(preset, &[]),
            at(preset, &["--sky-illuminance-lx", &lower]),
            at(preset, &["--sky-illuminance-lx", &brighter]),
            at(
                preset,
                &[&exact[..], &["--zenith-distance", zenith_distance_deg]].concat(),
            ),
            at(preset, &exact),
            at(preset, &["--reading", "physical"]),
        ];
        for (found, expected) in found.iter().zip(expected) {
            assert!(
                (found - expected).abs() < 6e-4,
                "{preset}: {found} for {expected}"
            );
        }
    }
    for (temperature_k, expected) in [("3500", 8.08), ("10000", 7.71)] {
        let options = [
            "--reading",
            "physical",
            "--star-temperature-k",
            temperature_k,
        ];
        assert!((at("experiment-1", &options) - expected).abs() < 0.006);
    }
    // The noise that reproduces the paper's limits in the physical reading.
    let options = ["--reading", "physical", "--read-noise-e", "35.7"];
    for (preset, expected) in [("experiment-1", 8.15), ("experiment-2", 8.99)] {
        let found = at(preset, &options);
        assert!((found - expected).abs() < 0.005, "{preset}: {found}");
    }
}

/// Every number rounded to six digits: machines differ in the last ones.
fn rounded(value: &mut Value) {
    match value {
        Value::Number(number) => {
            let digits = format!("{:.5e}", number.as_f64().unwrap());
            *value = digits.parse::<f64>().unwrap().into();
        }
        Value::Array(values) => values.iter_mut().for_each(rounded),
        Value::Object(fields) => fields.values_mut().for_each(rounded),
        _ => {}
    }
}

#[test]
fn the_fields_are_those_that_other_programs_build_on() {
    let mut report = predicted(&["--preset", "experiment-1"]);
    for name in [
        "limit_vmag",
        "star_e",
        "background_e",
        "noise_e",
        "snr",
        "airmass",
    ] {
        assert_eq!(report[name], report["budget"][name], "{name}");
    }
    let bands = report["budget"]["bands"].as_array_mut().unwrap();
    assert_eq!(bands.len(), 43);
    // Only the first part of the spectrum is kept.
    bands.drain(..19);
    bands.truncate(1);
    rounded(&mut report);
    insta::assert_json_snapshot!(report);
}

#[test]
fn the_same_is_printed_every_time() {
    for format in ["text", "json", "csv"] {
        let run = || {
            limit(&[
                "--preset",
                "imx174-35mm",
                "--sweep",
                "exposure_s=0.01:1:7:log",
                "--format",
                format,
            ])
        };
        let first = run();
        assert_eq!((first.status, &first.stderr), (0, &String::new()));
        assert_eq!(first.stdout, run().stdout);
    }
}

/// The presets' limits as in docs/camera.md.
const LIMITS: [(&str, f64); 5] = [
    ("experiment-1", 8.15),
    ("experiment-2", 8.99),
    ("nanosat-tracker", 6.20),
    ("imx174-35mm", 9.52),
    ("asi183mm-135mm", 12.34),
];

#[test]
fn every_preset_is_predicted_and_its_description_says_the_same() {
    let directory = tempfile::tempdir().unwrap();
    let list = Ran::new(starpipe().args(["camera", "list"])).stdout;
    assert_eq!(list.lines().count(), 5);
    for line in list.lines() {
        let name = line.split_whitespace().next().unwrap();
        let path = directory.path().join(format!("{name}.toml"));
        let path = path.to_str().unwrap();
        let new = ["camera", "new", "--preset", name, "-o", path];
        assert_eq!(Ran::new(starpipe().args(new)).status, 0);
        let at = [
            "--exposure",
            "0.3",
            "--reading",
            "physical",
            "--zenith-distance",
            "0",
        ];
        let sky = ["--sky-mag-arcsec2", "20"];
        let of = |camera: &[&str]| predicted(&[camera, &at, &sky].concat());
        let (_, expected) = LIMITS.iter().find(|(known, _)| *known == name).unwrap();
        let as_it_is = number(&predicted(&["--preset", name]), "/limit_vmag");
        assert!((as_it_is - expected).abs() < 0.005, "{name}: {as_it_is}");
        let (built_in, read) = (of(&["--preset", name]), of(&["--camera", path]));
        assert_eq!(built_in["budget"], read["budget"], "{name}");
        assert_eq!(
            (&built_in["preset"], &read["preset"]),
            (&name.into(), &Value::Null)
        );
    }
}

#[test]
fn every_parameter_has_an_option_and_can_be_swept() {
    let report = predicted(&["--preset", "experiment-2", "--extinction", "0.2"]);
    let parameters = report["parameters"].as_object().unwrap();
    assert_eq!(parameters.len(), 30, "{parameters:?}");
    for (name, value) in parameters {
        let option = format!("--{}", name.replace('_', "-"));
        let value = value.to_string();
        let again = predicted(&["--preset", "experiment-2", &option, &value]);
        let found = number(&again, &format!("/parameters/{name}"));
        assert!((found - value.parse::<f64>().unwrap()).abs() < 1e-9 * found.abs().max(1e-9));
        if ["width_px", "height_px", "bits"].contains(&name.as_str()) {
            continue;
        }
        let value = value.parse::<f64>().unwrap().max(1e-3);
        // Within every parameter's limits, and the bands within the tables.
        let factor = if name == "band_to_nm" { 0.9 } else { 1.0 };
        let (from, to) = (0.9 * factor * value, factor * value);
        let (from, to) = if name == "band_from_nm" {
            (value, 1.1 * value)
        } else {
            (from, to)
        };
        let sweep = format!("{name}={from}:{to}:2");
        assert_eq!(
            predictions(&["--preset", "experiment-2", "--sweep", &sweep]).len(),
            2
        );
    }
}

#[test]
fn options_in_other_units_are_equivalent() {
    let base = predicted(&["--preset", "experiment-1"]);
    let of = |option: &str, name: &str| {
        let value = number(&base, &format!("/parameters/{name}")).to_string();
        number(
            &predicted(&["--preset", "experiment-1", option, &value]),
            "/limit_vmag",
        )
    };
    for (option, name) in [
        ("--sky-mag-arcsec2", "sky_mag_arcsec2"),
        ("--sky-luminance-cd-m2", "sky_luminance_cd_m2"),
        ("--zenith-transmission", "zenith_transmission"),
        ("--pixel-area-um2", "pixel_area_um2"),
    ] {
        assert!(
            (of(option, name) - number(&base, "/limit_vmag")).abs() < 1e-9,
            "{option}"
        );
    }
}

#[test]
fn a_spot_in_pixels_refers_to_the_given_pixels() {
    let options = [
        "--preset",
        "experiment-1",
        "--spot-sigma-px",
        "0.8",
        "--pixel-area-um2",
        "30",
    ];
    let report = predicted(&options);
    assert_eq!(number(&report, "/parameters/spot_sigma_px"), 0.8);
    assert!((number(&report, "/parameters/peak_share") - 0.219_051).abs() < 1e-5);
}

#[test]
fn a_curve_comes_from_a_file() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("qe.csv");
    fs::write(&path, "wavelength_nm,qe\n350,0.3\n800,0.3\n").unwrap();
    let path = path.to_str().unwrap();
    let by_file = predicted(&["--preset", "experiment-1", "--quantum-efficiency", path]);
    assert_eq!(number(&by_file, "/parameters/quantum_efficiency"), 0.3);
    assert_eq!(by_file["budget"]["bands"][7]["quantum_efficiency"], 0.3);
    // A number scales the curve to that peak: at 430 nm it is 41/60 of it.
    let by_peak = predicted(&["--preset", "experiment-1", "--quantum-efficiency", "0.3"]);
    let found = number(&by_peak, "/budget/bands/7/quantum_efficiency");
    assert!((found - 0.205).abs() < 1e-9, "{found}");
}

#[test]
fn a_sweep_is_a_row_for_each_value() {
    let options = [
        "--preset",
        "experiment-1",
        "--sweep",
        "aperture-mm=50:100:3",
        "--sweep",
        "sky_illuminance_lx=1e-4:1e-2:3:log",
    ];
    let rows = predictions(&options);
    let swept: Vec<String> = rows
        .iter()
        .map(|row| format!("{}={}", row["swept"]["parameter"], row["swept"]["value"]))
        .collect();
    assert_eq!(
        swept,
        [
            "\"aperture_mm\"=50.0",
            "\"aperture_mm\"=75.0",
            "\"aperture_mm\"=100.0",
            "\"sky_illuminance_lx\"=0.0001",
            "\"sky_illuminance_lx\"=0.001",
            "\"sky_illuminance_lx\"=0.01"
        ]
    );
    assert_eq!(rows[2]["limit_vmag"], rows[5]["limit_vmag"]);
    let csv = limit(&[&options[..], &["--format", "csv"]].concat()).stdout;
    let mut reader = csv::Reader::from_reader(csv.as_bytes());
    let headings = reader
        .headers()
        .unwrap()
        .iter()
        .take(8)
        .collect::<Vec<_>>()
        .join(",");
    assert_eq!(
        headings,
        "parameter,value,limit_vmag,star_e,background_e,noise_e,snr,airmass"
    );
    let rows_of_table: Vec<_> = reader.records().map(Result::unwrap).collect();
    assert_eq!(rows_of_table.len(), 6);
    for (row, of_table) in rows.iter().zip(&rows_of_table) {
        assert_eq!(row["limit_vmag"].as_f64(), of_table[2].parse().ok());
    }
    let single = limit(&["--preset", "experiment-1", "--format", "csv"]).stdout;
    assert_eq!(single.lines().count(), 2);
}

#[test]
fn a_parameter_without_effect_is_reported() {
    let options = [
        "--preset",
        "experiment-1",
        "--sweep",
        "star_temperature_k=3000:9000:3",
    ];
    let ran = limit(&options);
    assert_eq!(ran.status, 0);
    assert!(
        ran.stderr.contains("star_temperature_k changes nothing"),
        "{}",
        ran.stderr
    );
    let physical = limit(&[&options[..], &["--reading", "physical"]].concat());
    assert_eq!(physical.stderr, "");
    // Irrelevant to the brightest pixel, but not to the detector.
    for sweep in ["false_alarms_per_mpx=0.1:10:2:log", "motion_px=0:5:2"] {
        let ran = limit(&["--preset", "experiment-1", "--sweep", sweep]);
        assert_eq!(ran.stderr, "", "{sweep}");
    }
}

#[test]
fn a_threshold_below_the_noise_has_no_limit() {
    for (options, rule, other) in [
        (["--snr", "0.5"], "peak_pixel", "detector"),
        (["--snr", "1"], "peak_pixel", "detector"),
        (["--false-alarms-per-mpx", "1e5"], "detector", "peak_pixel"),
    ] {
        let options = [&["--preset", "experiment-1"], &options[..]].concat();
        let report = predicted(&options);
        assert_eq!(report[rule]["limit50_vmag"], Value::Null, "{options:?}");
        assert!(report[other]["limit50_vmag"].is_number(), "{options:?}");
        for point in report[rule]["completeness"].as_array().unwrap() {
            let part = point["part"].as_f64().unwrap();
            assert!((0.0..=1.0).contains(&part) && point["vmag"].is_number());
        }
        let text = limit(&options).stdout;
        assert!(
            text.contains(" none ") || text.contains(" none\n"),
            "{text}"
        );
        let table = limit(&[&options[..], &["--format", "csv"]].concat()).stdout;
        assert!(!table.contains("inf") && !table.contains("NaN"), "{table}");
    }
}

#[test]
fn an_endless_or_huge_table_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("qe.csv");
    fs::write(&path, vec![b'7'; 3 << 20]).unwrap();
    let path = path.to_str().unwrap();
    let ran = limit(&["--preset", "experiment-1", "--quantum-efficiency", path]);
    assert_eq!((ran.status, ran.stdout.as_str()), (1, ""));
    assert!(
        ran.stderr.contains("larger than 1048576 bytes"),
        "{}",
        ran.stderr
    );
}

#[test]
fn the_text_has_the_budget_and_fits_a_terminal() {
    let text = limit(&["--preset", "experiment-1"]).stdout;
    for words in [
        "V 8.15",
        "N_C ",
        "52.5 e",
        "μ ",
        "M_V ",
        "336.81 e",
        "the paper's reading",
    ] {
        assert!(text.contains(words), "{words}: {text}");
    }
    let sweep = limit(&["--preset", "experiment-1", "--sweep", "aperture_mm=5:200:4"]).stdout;
    for line in text.lines().chain(sweep.lines()) {
        assert!(line.chars().count() <= 96, "{line}");
    }
    assert!(
        sweep.contains("aperture_mm") && sweep.contains("9.625"),
        "{sweep}"
    );
}

fn is_svg(drawing: &[u8]) -> bool {
    let text = std::str::from_utf8(drawing).unwrap();
    text.starts_with("<svg") && text.trim_end().ends_with("</svg>")
}

#[test]
fn a_plot_is_an_svg_or_a_png() {
    let directory = tempfile::tempdir().unwrap();
    let options = [
        "--preset",
        "experiment-1",
        "--sweep",
        "aperture_mm=5:200:9",
        "--sweep",
        "sky_illuminance_lx=1e-4:0.1:9:log",
    ];
    let plot = |name: &str| {
        let path = directory.path().join(name);
        let ran = limit(&[&options[..], &["--plot", path.to_str().unwrap()]].concat());
        assert_eq!(ran.status, 0, "{}", ran.stderr);
        fs::read(path).unwrap()
    };
    let svg = plot("a.svg");
    assert!(is_svg(&svg));
    let text = String::from_utf8(svg.clone()).unwrap();
    for words in [
        "aperture (mm)",
        "sky illuminance (lx)",
        "limiting magnitude (V)",
        "exposure 0.5 s",
    ] {
        assert!(text.contains(words), "{words}");
    }
    assert_eq!(svg, plot("b.SVG"));
    let picture = image::load_from_memory(&plot("a.png")).unwrap().to_rgb8();
    // Both curves and the text.
    for color in [[0, 114, 178], [213, 94, 0], [0, 0, 0]] {
        assert!(
            picture.pixels().filter(|pixel| pixel.0 == color).count() > 100,
            "{color:?}"
        );
    }
    assert_eq!(names(directory.path()), ["a.png", "a.svg", "b.SVG"]);
}

#[test]
fn a_plot_over_an_input_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("qe.svg");
    let table = "wavelength_nm,qe\n350,0.3\n800,0.3\n";
    fs::write(&path, table).unwrap();
    let name = path.to_str().unwrap();
    let sweep = ["--sweep", "aperture_mm=5:200:3", "--plot", name];
    let curve = ["--preset", "experiment-1", "--quantum-efficiency", name];
    is_refused(&[&curve[..], &sweep].concat(), "would overwrite the input");
    let camera = ["--camera", name];
    is_refused(&[&camera[..], &sweep].concat(), "would overwrite the input");
    assert_eq!(fs::read_to_string(&path).unwrap(), table);
}

#[test]
fn the_papers_figures_are_eleven_and_a_sheet() {
    let directory = tempfile::tempdir().unwrap();
    let figures = directory.path().join("new/figures");
    let ran = limit(&["--figures", figures.to_str().unwrap()]);
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let found = names(&figures);
    assert_eq!(ran.stdout.lines().count(), 12);
    assert_eq!(found.len(), 12);
    for id in [
        "3a", "3b", "3c", "3d", "3e", "3f", "3g", "3h", "4a", "4b", "4c",
    ] {
        assert!(
            found
                .iter()
                .any(|name| name.starts_with(&format!("figure-{id}-"))),
            "{id}"
        );
    }
    for name in &found {
        assert!(is_svg(&fs::read(figures.join(name)).unwrap()), "{name}");
    }
    let exposure = fs::read_to_string(figures.join("figure-3h-exposure.svg")).unwrap();
    assert!(exposure.contains("aperture 100 mm") && exposure.contains("aperture 50 mm"));
    // Another camera gives other figures.
    let other = directory.path().join("other");
    limit(&[
        "--preset",
        "imx174-35mm",
        "--figures",
        other.to_str().unwrap(),
    ]);
    let sheet = |directory: &Path| fs::read(directory.join("figures.svg")).unwrap();
    assert_ne!(sheet(&figures), sheet(&other));
}

/// Asserts that a command line is refused with these words and prints nothing.
fn is_refused(options: &[&str], expected: &str) {
    let ran = limit(options);
    let found = (ran.status, ran.stdout.as_str());
    assert_eq!(found, (2, ""), "{options:?} {}", ran.stderr);
    assert!(ran.stderr.contains(expected), "{options:?} {}", ran.stderr);
}

#[test]
fn nonsensical_options_are_refused() {
    for (option, value, expected) in [
        ("--camera", "a.toml", "cannot be used with"),
        ("--aperture-mm", "-5", "expected a number above 0"),
        ("--aperture-mm", "nan", "expected a number above 0"),
        ("--aperture-mm", "big", "expected a number above 0"),
        ("--exposure", "0", "expected a number above 0"),
        ("--quantum-efficiency", "1.5", "above 0 and at most 1"),
        ("--zenith-distance", "90", "from 0 to below 90"),
        (
            "--zenith-distance",
            "89.99999",
            "there is no limiting magnitude",
        ),
        (
            "--sky-luminance-cd-m2",
            "1e308",
            "sky_illuminance_lx is inf",
        ),
        ("--apertur-mm", "5", "'--aperture-mm'"),
        (
            "--band-to-nm",
            "900",
            "360 to 780 nm, which does not cover the band",
        ),
        (
            "--band-to-nm",
            "300",
            "band_from_nm must be below band_to_nm",
        ),
        ("--band-to-nm", "1e300", "to below 10000"),
        ("--plot", "a.svg", "--sweep"),
    ] {
        is_refused(&["--preset", "experiment-1", option, value], expected);
    }
    is_refused(&[], "--camera <camera.toml>|--preset <NAME>");
    is_refused(
        &["--preset", "experiment-3"],
        "possible values: experiment-1",
    );
}

#[test]
fn equivalent_options_exclude_each_other() {
    for [one, other] in [
        ["--sky-mag-arcsec2=20", "--sky-illuminance-lx=0.01"],
        ["--sky-luminance-cd-m2=1", "--sky-illuminance-lx=0.01"],
        ["--sky-luminance-cd-m2=1", "--sky-mag-arcsec2=20"],
        ["--zenith-transmission=0.5", "--extinction=0.1"],
        ["--pixel-area-um2=20", "--pitch-y-um=4"],
    ] {
        is_refused(
            &["--preset", "experiment-1", one, other],
            "cannot be used with",
        );
    }
}

#[test]
fn nonsensical_sweeps_are_refused_before_anything_is_printed() {
    for (sweep, expected) in [
        ("aperture_mm=200:5:10", "the sweep runs from 200 to 5"),
        ("aperture_mm=5:200:1", "the number of sweep values is 1"),
        ("aperture_mm=5:200:1001", "expected 2 to 1000"),
        (
            "aperture_mm=5:200:99999999999999999999",
            "is not a whole number",
        ),
        ("apertur=5:200:10", "did you mean 'aperture_mm'?"),
        ("aperture_mm=5:200", "NAME=FROM:TO:COUNT"),
        ("aperture_mm=5:200:4:lin", "NAME=FROM:TO:COUNT"),
        ("aperture_mm=-5:200:10", "aperture_mm would be -5"),
        ("aperture_mm=5:inf:10", "'inf' is not a number"),
        (
            "zenith_distance_deg=0:90:10",
            "zenith_distance_deg would be 90",
        ),
        (
            "zenith_distance_deg=0:89.9999:3",
            "zenith_distance_deg of 89.9999: there is no",
        ),
        (
            "dark_current_e_s=0:10:3:log",
            "the logarithmic sweep starts at 0",
        ),
        (
            "band_to_nm=700:900:3",
            "does not cover the band from 360 to 800 nm",
        ),
    ] {
        is_refused(&["--preset", "experiment-1", "--sweep", sweep], expected);
    }
    let sweep = ["--preset", "experiment-1", "--sweep", "aperture_mm=5:200:3"];
    is_refused(&[&sweep[..], &["--plot", "a.pdf"]].concat(), ".svg or .png");
    let many = ["--sweep=aperture_mm=5:200:3"; 65];
    is_refused(
        &[&sweep[..2], &many].concat(),
        "given 65 times, expected at most 64",
    );
    is_refused(
        &[&sweep[..], &["--figures", "a"]].concat(),
        "cannot be used with",
    );
}

#[test]
fn a_description_that_is_wrong_is_refused_with_its_line() {
    let directory = tempfile::tempdir().unwrap();
    let place = directory.path();
    fs::write(place.join("short.csv"), "nm,qe\n400,0.5\n700,0.5\n").unwrap();
    fs::write(place.join("unsorted.csv"), "nm,qe\n400,0.5\n390,0.5\n").unwrap();
    fs::write(place.join("dark.csv"), "nm,qe\n350,0\n800,0\n").unwrap();
    for (key, line, expected) in [
        (
            "aperture_mm",
            "aperture_mm = -5",
            "aperture_mm is -5, expected a number above 0",
        ),
        ("aperture_mm", "", "aperture_mm is missing"),
        (
            "aperture_mm",
            "apertur_mm = 5",
            "did you mean 'aperture_mm'?",
        ),
        (
            "lens_transmission",
            "lens_transmission = \"short.csv\"",
            "known from 400 to 700 nm, which does not cover the band from 360 to 780 nm",
        ),
        (
            "lens_transmission",
            "lens_transmission = \"dark.csv\"",
            "lens_transmission is 0, expected a number above 0 and at most 1",
        ),
        (
            "lens_transmission",
            "lens_transmission = \"unsorted.csv\"",
            "line 3: 390 nm after 400 nm: wavelengths must rise",
        ),
    ] {
        let path = camera(place, key, line);
        let ran = limit(&["--camera", &path]);
        assert_eq!(
            (ran.status, ran.stdout.as_str()),
            (1, ""),
            "{line} {}",
            ran.stderr
        );
        assert!(
            ran.stderr.contains(expected) && ran.stderr.contains("camera.toml"),
            "{}",
            ran.stderr
        );
    }
    for (name, expected) in [
        (
            "short.csv",
            "quantum_efficiency is known from 400 to 700 nm",
        ),
        ("unsorted.csv", "line 3: 390 nm after 400 nm"),
        ("absent.csv", "No such file"),
    ] {
        let path = place.join(name);
        let path = path.to_str().unwrap();
        let ran = limit(&["--preset", "experiment-1", "--quantum-efficiency", path]);
        assert_eq!(ran.status, 1, "{name} {}", ran.stderr);
        assert!(
            ran.stderr.contains(expected) && ran.stderr.contains(name),
            "{}",
            ran.stderr
        );
    }
    let ran = limit(&["--camera", "/no/such/camera.toml"]);
    assert_eq!(ran.status, 1);
    assert!(
        ran.stderr.contains("/no/such/camera.toml"),
        "{}",
        ran.stderr
    );
}

#[test]
fn a_figure_that_cannot_be_written_costs_no_table() {
    let sweep = ["--preset", "experiment-1", "--sweep", "aperture_mm=5:200:3"];
    let ran = limit(&[&sweep[..], &["--plot", "/no/such/place.svg"]].concat());
    assert_eq!(ran.status, 1);
    assert_eq!(ran.stdout, limit(&sweep).stdout);
    assert!(ran.stderr.contains("/no/such/place.svg"), "{}", ran.stderr);
}

#[test]
fn the_papers_reading_needs_a_curve_over_the_papers_band() {
    let directory = tempfile::tempdir().unwrap();
    let path = camera(directory.path(), "band_from_nm", "band_from_nm = 420");
    let table = directory.path().join("qe.csv");
    fs::write(&table, "nm,qe\n410,0.5\n800,0.5\n").unwrap();
    let table = table.to_str().unwrap();
    let options = ["--camera", &path, "--quantum-efficiency", table];
    assert_eq!(limit(&options).status, 0);
    let paper = limit(&[&options[..], &["--reading", "paper"]].concat());
    assert_eq!(paper.status, 1);
    assert!(
        paper.stderr.contains("of the paper's equations"),
        "{}",
        paper.stderr
    );
}

#[test]
fn a_camera_is_not_overwritten_without_force() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("camera.toml");
    fs::write(&path, "mine").unwrap();
    let new = |more: &[&str]| {
        let mut command = starpipe();
        Ran::new(command.args(["camera", "new", "-o"]).arg(&path).args(more))
    };
    let refused = new(&[]);
    assert_eq!(refused.status, 2);
    assert!(
        refused.stderr.contains("exists; --force"),
        "{}",
        refused.stderr
    );
    assert_eq!(fs::read_to_string(&path).unwrap(), "mine");
    assert_eq!(new(&["--force"]).status, 0);
    let printed = Ran::new(starpipe().args(["camera", "new"])).stdout;
    assert_eq!(fs::read_to_string(&path).unwrap(), printed);
    assert!(printed.contains("# diameter of the entrance pupil, in mm\naperture_mm = 100"));
    assert_eq!(names(directory.path()), ["camera.toml"]);
}
