//! Data flows down through the modules, and no module looks up: every `crate::` path is checked against one table.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should stop")]

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Each module, and the modules of the crate that it may use.
const MAY_USE: &[(&str, &[&str])] = &[
    ("units", &[]),
    ("angle", &[]),
    ("coords", &["units"]),
    ("epoch", &[]),
    ("files", &[]),
    ("statistics", &[]),
    ("observer", &["units", "coords", "epoch"]),
    ("sensor", &[]),
    ("frame", &["units", "coords", "epoch", "angle", "observer"]),
    ("calibration", &["frame", "statistics"]),
    ("camera", &["units", "coords"]),
    ("catalog", &["units", "coords", "files", "angle"]),
    ("detect", &["units", "coords", "frame"]),
    ("attitude", &["units", "coords", "camera"]),
    (
        "sensitivity",
        &["units", "observer", "sensor", "detect", "statistics"],
    ),
    (
        "simulate",
        &[
            "units",
            "coords",
            "observer",
            "frame",
            "camera",
            "catalog",
            "sensor",
            "sensitivity",
            "statistics",
        ],
    ),
    (
        "identify",
        &[
            "units",
            "coords",
            "camera",
            "catalog",
            "attitude",
            "statistics",
        ],
    ),
    (
        "comparison",
        &[
            "units",
            "statistics",
            "sensor",
            "detect",
            "photometry",
            "sensitivity",
        ],
    ),
    (
        "diagnosis",
        &["units", "coords", "camera", "frame", "detect", "identify"],
    ),
    (
        "photometry",
        &[
            "units",
            "coords",
            "camera",
            "catalog",
            "detect",
            "identify",
            "statistics",
        ],
    ),
    (
        "pipeline",
        &[
            "units",
            "coords",
            "epoch",
            "frame",
            "camera",
            "catalog",
            "calibration",
            "comparison",
            "detect",
            "identify",
            "diagnosis",
            "statistics",
            "sensor",
            "observer",
            "photometry",
        ],
    ),
    (
        "report",
        &[
            "units",
            "coords",
            "calibration",
            "camera",
            "catalog",
            "detect",
            "comparison",
            "identify",
            "observer",
            "photometry",
            "pipeline",
            "statistics",
        ],
    ),
    ("darks", &["statistics", "frame", "report"]),
    ("flats", &["darks", "frame", "report"]),
    (
        "defocus",
        &[
            "coords",
            "frame",
            "sensor",
            "detect",
            "sensitivity",
            "simulate",
            "statistics",
        ],
    ),
    (
        "robustness",
        &[
            "units",
            "coords",
            "camera",
            "statistics",
            "identify",
            "photometry",
            "pipeline",
        ],
    ),
    (
        "validation",
        &[
            "units",
            "coords",
            "camera",
            "sensor",
            "frame",
            "comparison",
            "detect",
            "sensitivity",
            "simulate",
            "statistics",
            "identify",
            "pipeline",
            "report",
            "robustness",
        ],
    ),
    (
        "experiment",
        &[
            "units",
            "coords",
            "epoch",
            "observer",
            "sensor",
            "frame",
            "camera",
            "catalog",
            "detect",
            "sensitivity",
            "simulate",
            "identify",
            "pipeline",
            "report",
            "validation",
        ],
    ),
    (
        "overlay",
        &[
            "units", "coords", "camera", "catalog", "detect", "frame", "identify", "pipeline",
            "report",
        ],
    ),
    (
        "wcs",
        &["units", "coords", "frame", "camera", "identify", "pipeline"],
    ),
];

fn source() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

fn rust_files(place: &Path) -> Vec<PathBuf> {
    if place.is_file() {
        return vec![place.to_owned()];
    }
    fs::read_dir(place)
        .unwrap()
        .flat_map(|entry| rust_files(&entry.unwrap().path()))
        .filter(|path| path.extension().is_some_and(|e| e == "rs"))
        .collect()
}

/// The code without comments, where modules may be named freely.
fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).unwrap();
    let lines = text.lines().map(|line| line.split("//").next().unwrap());
    lines.collect::<Vec<_>>().join("\n")
}

/// The names that follow `crate::`, those in braces included.
fn modules_used(code: &str) -> BTreeSet<String> {
    let name = |text: &str| -> String {
        let end = text.find(|c: char| !(c.is_alphanumeric() || c == '_'));
        text[..end.unwrap_or(text.len())].to_owned()
    };
    let mut used = BTreeSet::new();
    for (start, found) in code.match_indices("crate::") {
        let rest = &code[start + found.len()..];
        match rest.strip_prefix('{') {
            None => drop(used.insert(name(rest))),
            Some(list) => {
                let mut depth = 0;
                let mut first = true;
                for (at, c) in list.char_indices() {
                    if depth == 0 && first && c.is_alphabetic() {
                        used.insert(name(&list[at..]));
                        first = false;
                    }
                    match c {
                        '{' => depth += 1,
                        '}' if depth == 0 => break,
                        '}' => depth -= 1,
                        ',' if depth == 0 => first = true,
                        _ => {}
                    }
                }
            }
        }
    }
    used
}

#[test]
fn the_names_after_crate_are_found_in_and_out_of_braces() {
    let code = "use crate::a::B; use crate::{b, c::{self, D}, e}; crate::f()";
    let used: Vec<_> = modules_used(code).into_iter().collect();
    assert_eq!(used, ["a", "b", "c", "e", "f"]);
}

#[test]
fn every_module_is_in_the_table() {
    let known: BTreeSet<_> = MAY_USE.iter().map(|(module, _)| *module).collect();
    for entry in fs::read_dir(source()).unwrap() {
        let path = entry.unwrap().path();
        let stem = path.file_stem().unwrap().to_str().unwrap().to_owned();
        let outside = ["lib", "main", "cli"].contains(&stem.as_str());
        assert!(outside || known.contains(stem.as_str()), "{stem}");
    }
}

#[test]
fn no_module_uses_one_above_it() {
    let known: BTreeSet<_> = MAY_USE.iter().map(|(module, _)| *module).collect();
    let mut breaches = Vec::new();
    for (module, allowed) in MAY_USE {
        let (file, folder) = (source().join(format!("{module}.rs")), source().join(module));
        let places = [file, folder].into_iter().filter(|place| place.exists());
        for path in places.flat_map(|place| rust_files(&place)) {
            for used in modules_used(&code(&path)) {
                let inside = used == *module || !known.contains(used.as_str());
                if !inside && !allowed.contains(&used.as_str()) {
                    breaches.push(format!("{} uses {used}", path.display()));
                }
            }
        }
    }
    assert!(breaches.is_empty(), "{breaches:#?}");
}

#[test]
fn the_command_line_uses_the_public_library_only() {
    for path in rust_files(&source().join("cli")) {
        let outside: Vec<_> = modules_used(&code(&path))
            .into_iter()
            .filter(|used| used != "cli")
            .collect();
        assert!(outside.is_empty(), "{}: {outside:?}", path.display());
    }
}
