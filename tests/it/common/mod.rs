//! Helpers of several tests.

pub mod disk;
pub mod drawing;
pub mod sequence;

use assert_cmd::Command;
use flate2::Compression;
use flate2::write::GzEncoder;
use serde_json::Value;
use starpipe::catalog::Catalog;
use starpipe::identify::IndexedCatalog;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Output;
use std::sync::OnceLock;

/// The directory of real frames and lists beside the repository, if it exists.
///
/// # Panics
/// If it does not exist and STARPIPE_REQUIRE_SHARED=1.
pub fn shared_dir() -> Option<PathBuf> {
    let directory = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared");
    if directory.join("frames/truth.csv").is_file() {
        return Some(directory);
    }
    let required = std::env::var_os("STARPIPE_REQUIRE_SHARED").is_some_and(|value| value == "1");
    assert!(
        !required,
        "{} is absent, and STARPIPE_REQUIRE_SHARED=1",
        directory.display()
    );
    eprintln!("skipped: {} is absent", directory.display());
    None
}

/// The cache shared by all tests, separate from the user's.
pub fn cache_dir() -> PathBuf {
    std::env::var_os("STARPIPE_CACHE_DIR").map_or_else(
        || Path::new(env!("CARGO_TARGET_TMPDIR")).join("cache"),
        PathBuf::from,
    )
}

/// The program, with the cache of the tests, and without the catalogues that are installed.
pub fn starpipe() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_starpipe"));
    command.env("STARPIPE_CACHE_DIR", cache_dir());
    command.env("STARPIPE_CATALOGS", "");
    command
}

/// Exit status and largest memory in kB of a command.
///
/// # Panics
/// If it cannot be started.
#[cfg(unix)]
pub fn measured(command: &mut std::process::Command) -> (Option<i32>, u64) {
    let mut child = command
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let status = format!("/proc/{}/status", child.id());
    let mut peak_kb = 0;
    loop {
        // The high-water mark, as long as the process is there.
        let text = std::fs::read_to_string(&status).unwrap_or_default();
        let peak = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let kb = peak.and_then(|peak| peak.trim().strip_suffix("kB")?.trim().parse().ok());
        peak_kb = peak_kb.max(kb.unwrap_or(0));
        if let Some(done) = child.try_wait().unwrap() {
            return (done.code(), peak_kb);
        }
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
}

/// The built-in catalogue and its index, built once.
pub fn sky() -> &'static IndexedCatalog<'static> {
    static SKY: OnceLock<IndexedCatalog> = OnceLock::new();
    SKY.get_or_init(|| IndexedCatalog::build(Catalog::built_in(), &|_| ()))
}

/// Cards as a header of FITS, and blanks to its end.
pub fn fits_header(cards: &[String]) -> Vec<u8> {
    let end = "END".to_owned();
    let cards = cards.iter().chain([&end]).map(|card| format!("{card:<80}"));
    let mut header = cards.collect::<String>().into_bytes();
    header.resize(header.len().next_multiple_of(2880), b' ');
    header
}

/// A header-data unit of FITS; `first` is the first card.
pub fn fits_unit(first: &str, bitpix: i32, axes: &[u32], more: &[&str], data: &[u8]) -> Vec<u8> {
    let mut cards = vec![
        first.to_owned(),
        format!("BITPIX  = {bitpix:20}"),
        format!("NAXIS   = {:20}", axes.len()),
    ];
    for (number, length) in axes.iter().enumerate() {
        cards.push(format!("NAXIS{:<3}= {length:20}", number + 1));
    }
    cards.extend(more.iter().map(|card| (*card).to_owned()));
    if !more.iter().any(|card| card.starts_with("ROWORDER")) {
        cards.push("ROWORDER= 'TOP-DOWN'".to_owned());
    }
    let mut bytes = fits_header(&cards);
    bytes.extend(data);
    bytes.resize(bytes.len().next_multiple_of(2880), 0);
    bytes
}

/// A finished run, with its output as text.
pub struct Ran {
    pub status: i32,
    pub stdout: String,
    pub stderr: String,
}

impl Ran {
    pub fn new(command: &mut Command) -> Self {
        let Output {
            status,
            stdout,
            stderr,
        } = command.output().expect("the program starts");
        let text = |bytes| String::from_utf8(bytes).expect("text");
        let ran = Self {
            status: status.code().expect("an exit status, and not a signal"),
            stdout: text(stdout),
            stderr: text(stderr),
        };
        assert!(!ran.stderr.contains("panicked"), "{}", ran.stderr);
        assert!(!ran.stderr.contains('\u{1b}') && !ran.stdout.contains('\u{1b}'));
        ran
    }

    /// Standard output as JSON Lines.
    pub fn reports(&self) -> Vec<Value> {
        let parse = |line| serde_json::from_str(line).expect("a line of JSON");
        self.stdout.lines().map(parse).collect()
    }
}

/// The path of a fixture.
pub fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("fixtures")
        .join(name)
}

/// The frame of Orion.
pub fn orion() -> PathBuf {
    fixture("orion/orion.png")
}

/// The bytes, compressed.
pub fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

/// The names of the entries of `directory`, sorted.
pub fn names(directory: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(directory).expect("readable");
    let mut names: Vec<_> = entries
        .map(|entry| {
            entry
                .expect("an entry")
                .file_name()
                .into_string()
                .expect("text")
        })
        .collect();
    names.sort();
    names
}

/// All files below a directory, by their path in it.
pub fn files(directory: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut left = vec![directory.to_owned()];
    while let Some(below) = left.pop() {
        for entry in std::fs::read_dir(below).expect("readable") {
            let path = entry.expect("readable").path();
            if path.is_dir() {
                left.push(path);
            } else {
                let name = path.strip_prefix(directory).expect("readable").to_owned();
                found.insert(name, std::fs::read(path).expect("readable"));
            }
        }
    }
    found
}

/// The number at `pointer` in `report`.
pub fn number(report: &Value, pointer: &str) -> f64 {
    let value = report.pointer(pointer).and_then(Value::as_f64);
    value.unwrap_or_else(|| panic!("{} has no number at {pointer}", report["frame"]))
}

/// Where a frame points and how wide it is, in degrees.
#[derive(Debug)]
pub struct Truth {
    pub ra_deg: f64,
    pub dec_deg: f64,
    pub fov_x_deg: f64,
}

impl Truth {
    /// Distance of the centre of `report` from the true one, in degrees.
    pub fn centre_error_deg(&self, report: &Value) -> f64 {
        let unit = |ra_deg: f64, dec_deg: f64| {
            let (ra, dec) = (ra_deg.to_radians(), dec_deg.to_radians());
            [dec.cos() * ra.cos(), dec.cos() * ra.sin(), dec.sin()]
        };
        let found = unit(
            number(report, "/attitude/ra_deg"),
            number(report, "/attitude/dec_deg"),
        );
        let truth = unit(self.ra_deg, self.dec_deg);
        let chord_sq: f64 = (0..3).map(|i| (found[i] - truth[i]).powi(2)).sum();
        2.0 * (chord_sq.sqrt() / 2.0).asin().to_degrees()
    }

    /// Relative error of the horizontal field of view.
    pub fn fov_error(&self, report: &Value) -> f64 {
        number(report, "/optics/fov_x_deg") / self.fov_x_deg - 1.0
    }
}

/// The report of the fixture `name` by `process`.
pub fn report(name: &str, options: &[&str]) -> Value {
    let mut command = starpipe();
    command.args(["process", "--format", "json"]).args(options);
    let ran = Ran::new(command.arg(fixture(name)));
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    ran.reports().remove(0)
}
