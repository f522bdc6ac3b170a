//! Faults: processes that are killed, disks that are full, limits of the system, and many processes at
//! once. Nothing that is written is ever less than whole, and a rerun gives the same bytes.

#![cfg(target_os = "linux")]

use crate::common::disk::SmallDisk;
use crate::common::{files, fixture};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::Instant;

/// A command that writes into OUT.
struct Writes {
    arguments: Vec<String>,
}

const OUT: &str = "OUT";
const KILLS: u32 = 6;
/// Moments at which a directory vanishes.
const MOMENTS: u32 = 3;

/// Every command that writes files, with `inputs`, a directory with what they read.
fn commands(inputs: &Path) -> Vec<Writes> {
    let input = |name: &str| inputs.join(name).display().to_string();
    let frames = input("frames");
    let stars = input("stars.csv");
    let lines = [
        format!("process {frames} --out OUT"),
        format!("process {frames} --out-parquet OUT --frames-per-part 1"),
        "simulate --preset imx174-35mm --random-attitude --count 2 --out OUT".to_owned(),
        "validate --preset imx174-35mm --count 3 --out OUT".to_owned(),
        format!("catalog import {stars} --output OUT/stars.cat"),
        "camera new --preset imx174-35mm --output OUT/camera.toml".to_owned(),
        "limit --preset experiment-1 --sweep exposure_s=0.01:1:5 --plot OUT/plot.svg".to_owned(),
        format!("darks --exposure 1 {} --out OUT", input("darks")),
        format!("flats {} --out OUT", input("darks")),
        format!("archive merge {} --out OUT", input("archive")),
    ];
    let words = |line: &String| line.split(' ').map(str::to_owned).collect();
    lines
        .iter()
        .map(|line| Writes {
            arguments: words(line),
        })
        .collect()
}

/// Makes what the commands read.
fn inputs() -> tempfile::TempDir {
    let directory = tempfile::tempdir().unwrap();
    let at = |name: &str| directory.path().join(name);
    fs::create_dir(at("frames")).unwrap();
    for (name, from) in [("a.png", "orion/orion.png"), ("b.tif", "cygnus/cygnus.tif")] {
        fs::copy(fixture(from), at("frames").join(name)).unwrap();
    }
    let mut stars = "id,ra_deg,dec_deg,vmag\n".to_owned();
    for star in 0..2000 {
        stars += &format!(
            "{star},{},{},{}\n",
            star * 7 % 360,
            star * 13 % 170 - 85,
            star % 9
        );
    }
    fs::write(at("stars.csv"), stars).unwrap();
    let dark = [
        "simulate",
        "--preset",
        "imx174-35mm",
        "--dark",
        "--count",
        "3",
        "--out",
    ];
    let ran = program(&at(""))
        .args(dark)
        .arg(at("darks"))
        .output()
        .unwrap();
    assert!(ran.status.success(), "{ran:?}");
    let parts = ["--frames-per-part", "1", "--out-parquet"];
    let mut command = program(&at(""));
    command
        .arg("process")
        .arg(at("frames"))
        .args(parts)
        .arg(at("archive"));
    assert!(command.output().unwrap().status.success());
    directory
}

/// The program, whose index is in `work`.
fn program(work: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_starpipe"));
    command.env("STARPIPE_CACHE_DIR", work.join("cache"));
    command.env("STARPIPE_CATALOGS", "");
    command.stdout(Stdio::null()).stderr(Stdio::piped());
    command
}

impl Writes {
    fn name(&self) -> &str {
        &self.arguments[0]
    }

    /// The command, writing into `out`.
    fn writing(&self, work: &Path, out: &Path) -> Command {
        let mut command = program(work);
        let out = out.display().to_string();
        command.args(self.arguments.iter().map(|word| word.replace(OUT, &out)));
        command
    }

    /// What it writes where nothing disturbs it.
    fn expected(&self, work: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
        let out = new_directory(work, "expected");
        let ran = self.writing(work, &out).output().unwrap();
        assert!(ran.status.success(), "{:?} {ran:?}", self.arguments);
        results(&out)
    }

    /// Asserts that a rerun writes what was expected from the first.
    fn complete(&self, work: &Path, out: &Path, expected: &BTreeMap<PathBuf, Vec<u8>>) {
        let mut rerun = self.writing(work, out);
        if ["simulate", "camera"].contains(&self.name()) {
            // They refuse to overwrite what is there.
            rerun.arg("--force");
        }
        let ran = rerun.output().unwrap();
        assert!(ran.status.success(), "{:?} {ran:?}", self.arguments);
        assert!(results(out) == *expected, "{:?}", self.arguments);
    }

    /// Asserts that a run succeeded, or failed with a message; `fault` is what disturbed it.
    fn assert_ended(&self, ran: &Output, fault: &str) {
        let told = String::from_utf8_lossy(&ran.stderr);
        let code = ran.status.code();
        let arguments = &self.arguments;
        assert!(matches!(code, Some(0 | 1)), "{fault} {arguments:?} {told}");
        let is_told = code == Some(0) || told.contains("starpipe: ");
        assert!(is_told, "{fault} {arguments:?} {told}");
    }

    /// The command under limits of the shell's `ulimit`.
    fn limited(&self, limit: &str, work: &Path, out: &Path) -> Command {
        let whole = self.writing(work, out);
        let mut command = Command::new("sh");
        command
            .arg("-c")
            .arg(format!("ulimit {limit} && exec \"$0\" \"$@\""));
        command.arg(whole.get_program()).args(whole.get_args());
        command.env("STARPIPE_CACHE_DIR", work.join("cache"));
        command.env("STARPIPE_CATALOGS", "");
        command.stdout(Stdio::null()).stderr(Stdio::piped());
        command
    }
}

fn new_directory(parent: &Path, name: &str) -> PathBuf {
    let directory = parent.join(name);
    fs::create_dir(&directory).unwrap();
    directory
}

/// All files below a directory without temporary ones, and without what tells times.
fn results(directory: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = files(directory);
    found.retain(|path, _| {
        let name = path.file_name().unwrap().to_str().unwrap();
        !(name.starts_with(".starpipe-") || name == "timing.json")
    });
    for content in found.values_mut() {
        *content = without_times(std::mem::take(content));
    }
    found
}

fn without_times(content: Vec<u8>) -> Vec<u8> {
    let Ok(text) = String::from_utf8(content.clone()) else {
        return content;
    };
    let Some((before, times)) = text.split_once("\"timing_ms\":{") else {
        return content;
    };
    let after = times.split_once('}').map_or("", |(_, after)| after);
    format!("{before}{after}").into_bytes()
}

/// Asserts that each file is as expected; some may be missing. `validate` appends to its tables.
fn assert_whole(command: &Writes, out: &Path, expected: &BTreeMap<PathBuf, Vec<u8>>) {
    for (path, content) in results(out) {
        let whole = expected.get(&path);
        let is_growing =
            command.name() == "validate" && path.extension().is_some_and(|e| e == "csv");
        let is_whole = whole
            .is_some_and(|whole| *whole == content || (is_growing && whole.starts_with(&content)));
        assert!(is_whole, "{}: {}", command.name(), path.display());
    }
}

#[test]
fn killed_at_any_moment_nothing_is_half_written_and_a_rerun_completes_it() {
    let inputs = inputs();
    for command in commands(inputs.path()) {
        let work = tempfile::tempdir().unwrap();
        let out = new_directory(work.path(), "out");
        let started = Instant::now();
        let expected = command.expected(work.path());
        let duration = started.elapsed();
        for kill in 1..=KILLS {
            let mut child = command.writing(work.path(), &out).spawn().unwrap();
            std::thread::sleep(duration * kill / (KILLS + 1));
            child.kill().unwrap();
            child.wait().unwrap();
            assert_whole(&command, &out, &expected);
        }
        command.complete(work.path(), &out, &expected);
    }
}

#[test]
fn a_full_or_read_only_disk_is_told_and_loses_nothing() {
    let inputs = inputs();
    for command in commands(inputs.path()) {
        let work = tempfile::tempdir().unwrap();
        let expected = command.expected(work.path());
        let Some(disk) = SmallDisk::new("size=4k") else {
            return;
        };
        let out = new_directory(disk.path(), "out");
        let ran = command.writing(work.path(), &out).output().unwrap();
        assert_whole(&command, &out, &expected);
        let told = String::from_utf8_lossy(&ran.stderr).into_owned();
        if expected.values().map(Vec::len).sum::<usize>() > 4096 {
            assert_eq!(ran.status.code(), Some(1), "{:?} {told}", command.arguments);
            assert!(
                told.contains("No space left"),
                "{:?} {told}",
                command.arguments
            );
        }
        disk.enlarge("size=200m");
        command.complete(work.path(), &out, &expected);

        disk.enlarge("ro");
        let new = disk.path().join("new");
        let ran = command.writing(work.path(), &new).output().unwrap();
        assert_eq!(ran.status.code(), Some(1), "{:?}", command.arguments);
    }
}

#[test]
fn under_limits_of_the_system_a_command_ends_with_an_error_or_whole() {
    let inputs = inputs();
    for command in commands(inputs.path()) {
        let work = tempfile::tempdir().unwrap();
        let expected = command.expected(work.path());
        // Descriptors, and memory in kB.
        for limit in ["-n 8", "-n 14", "-n 20", "-v 120000", "-v 300000"] {
            let out = new_directory(work.path(), &limit.replace(' ', ""));
            let ran = command.limited(limit, work.path(), &out).output().unwrap();
            let told = String::from_utf8_lossy(&ran.stderr);
            // Where memory ends, the allocator ends the process.
            let is_out_of_memory =
                ran.status.code().is_none() && told.contains("memory allocation of");
            if !is_out_of_memory {
                command.assert_ended(&ran, limit);
            }
            assert_whole(&command, &out, &expected);
        }
    }
}

#[test]
fn a_file_cut_by_a_limit_is_not_left_behind_and_a_rerun_completes_it() {
    let inputs = inputs();
    for command in commands(inputs.path()) {
        let work = tempfile::tempdir().unwrap();
        let expected = command.expected(work.path());
        let out = new_directory(work.path(), "out");
        // Blocks of 512 bytes; with the signal ignored, writing beyond them fails.
        let mut limited = command.limited("-f 4 && trap '' XFSZ", work.path(), &out);
        let ran = limited.output().unwrap();
        let told = String::from_utf8_lossy(&ran.stderr).into_owned();
        if expected.values().any(|content| content.len() > 2048) {
            assert_eq!(ran.status.code(), Some(1), "{:?} {told}", command.arguments);
            assert!(told.contains("File too large"), "{told}");
        }
        assert_whole(&command, &out, &expected);
        command.complete(work.path(), &out, &expected);
    }
}

#[test]
fn a_directory_that_vanishes_meanwhile_is_told_or_made_again() {
    let inputs = inputs();
    for command in commands(inputs.path()) {
        let work = tempfile::tempdir().unwrap();
        let started = Instant::now();
        let expected = command.expected(work.path());
        let duration = started.elapsed();
        for moment in 1..=MOMENTS {
            let out = new_directory(work.path(), "out");
            let child = command.writing(work.path(), &out).spawn().unwrap();
            std::thread::sleep(duration * moment / (MOMENTS + 1));
            let _ = fs::remove_dir_all(&out);
            let ran = child.wait_with_output().unwrap();
            command.assert_ended(&ran, "vanished");
            if out.exists() {
                assert_whole(&command, &out, &expected);
                fs::remove_dir_all(&out).unwrap();
            }
        }
        let out = new_directory(work.path(), "out");
        command.complete(work.path(), &out, &expected);
    }
}

#[test]
fn eight_processes_at_once_write_what_one_writes() {
    let inputs = inputs();
    for command in commands(inputs.path()) {
        if ["simulate", "camera", "validate"].contains(&command.name()) {
            // They refuse what is there, or that another is at work.
            continue;
        }
        let work = tempfile::tempdir().unwrap();
        let expected = command.expected(work.path());
        let out = new_directory(work.path(), "out");
        let start = || command.writing(work.path(), &out).spawn().unwrap();
        let processes: Vec<_> = (0..8).map(|_| start()).collect();
        for process in processes {
            let ran = process.wait_with_output().unwrap();
            assert!(ran.status.success(), "{:?} {ran:?}", command.arguments);
        }
        assert!(results(&out) == expected, "{:?}", command.arguments);
    }
}
