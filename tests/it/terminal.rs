//! What differs on a terminal: the progress bar, and the width of tables.

use crate::common::{cache_dir, orion};
use std::process::Command;

/// What a terminal shows of `starpipe process` over some frames; `before` and `redirect` are passed to the shell.
/// `None`, saying so, without util-linux's `script`, which provides the terminal.
fn shown(before: &str, format: &str, redirect: &str) -> Option<String> {
    let frame = orion();
    let frames = format!("'{}' ", frame.display()).repeat(6);
    let program = env!("CARGO_BIN_EXE_starpipe");
    let line = format!("{before} '{program}' process --format {format} {frames} {redirect}");
    let mut script = Command::new("script");
    script.args(["-qec", &line, "/dev/null"]);
    // The bar needs a terminal that can move its cursor.
    script
        .env("TERM", "xterm")
        .env("STARPIPE_CACHE_DIR", cache_dir())
        .env("STARPIPE_CATALOGS", "");
    match script.output() {
        Ok(done) if done.status.success() => Some(String::from_utf8(done.stdout).unwrap()),
        Ok(done) => panic!("{}", String::from_utf8_lossy(&done.stdout)),
        Err(_) => {
            eprintln!("skipped: there is no `script` here");
            None
        }
    }
}

/// Lines without cursor and erase sequences.
fn plain_lines(shown: &str) -> Vec<String> {
    let mut plain = String::new();
    let mut rest = shown;
    while let Some(start) = rest.find('\u{1b}') {
        plain += &rest[..start];
        let sequence = &rest[start + 2..];
        let end = sequence.find(|c: char| c.is_ascii_alphabetic()).unwrap();
        rest = &sequence[end + 1..];
    }
    plain += rest;
    plain.split(['\r', '\n']).map(str::to_owned).collect()
}

fn results(lines: &[String]) -> usize {
    let whole = |line: &&String| {
        serde_json::from_str::<serde_json::Value>(line).is_ok_and(|v| v.is_object())
    };
    lines.iter().filter(whole).count()
}

#[test]
fn a_bar_is_on_the_terminal_and_results_are_complete() {
    let (Some(alone), Some(both)) = (shown("", "json", ">/dev/null"), shown("", "json", "")) else {
        return;
    };
    for shown in [&alone, &both] {
        let has_bar = |line: &String| line.starts_with("frames ") && line.contains("/6");
        assert!(plain_lines(shown).iter().any(has_bar), "{shown}");
    }
    assert_eq!(results(&plain_lines(&both)), 6);
}

#[test]
fn without_a_terminal_on_standard_error_there_is_no_bar() {
    let directory = tempfile::tempdir().unwrap();
    let errors = directory.path().join("errors");
    let Some(shown) = shown("", "json", &format!("2>'{}'", errors.display())) else {
        return;
    };
    assert_eq!(std::fs::read_to_string(errors).unwrap(), "");
    assert!(!shown.contains('\u{1b}'));
    assert_eq!(results(&plain_lines(&shown)), 6);
}

#[test]
fn a_table_is_as_wide_as_the_terminal() {
    for (columns, name) in [(60, "…n/orion.png"), (70, "…tures/orion/orion.png")] {
        let Some(shown) = shown(
            &format!("stty cols {columns} rows 24;"),
            "table",
            "2>/dev/null",
        ) else {
            return;
        };
        let lines = plain_lines(&shown);
        let rows: Vec<&String> = lines.iter().filter(|line| line.ends_with(".png")).collect();
        assert_eq!(rows.len(), 6, "{shown}");
        for row in rows {
            assert_eq!(row.chars().count(), columns, "{row}");
            assert!(row.ends_with(name), "{row}");
        }
    }
}
