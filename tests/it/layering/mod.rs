//! The structure of `src`: rooms in one order, no circle between files, and a command line that
//! sees the public library only.

mod source;

use source::{Crate, ModulePath, rust_files};
use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

/// The rooms from the ground up, and for each the rooms below that it uses.
const ROOMS: &[(&str, &[&str])] = &[
    ("base", &[]),
    ("catalog", &["base"]),
    ("flight", &["base", "catalog"]),
    ("ephemeris", &["base", "catalog"]),
    ("frame", &["base", "ephemeris"]),
    ("camera", &["base", "ephemeris"]),
    ("calibration", &["base", "frame"]),
    ("detect", &["base", "frame"]),
    (
        "identify",
        &["base", "catalog", "ephemeris", "frame", "camera", "detect"],
    ),
    (
        "predict",
        &["base", "catalog", "ephemeris", "camera", "detect"],
    ),
    (
        "photometry",
        &[
            "base", "catalog", "frame", "camera", "detect", "identify", "predict",
        ],
    ),
    (
        "sky",
        &[
            "base",
            "ephemeris",
            "frame",
            "camera",
            "detect",
            "identify",
            "predict",
            "photometry",
        ],
    ),
    (
        "centroids",
        &[
            "base",
            "ephemeris",
            "camera",
            "detect",
            "identify",
            "photometry",
        ],
    ),
    (
        "solve",
        &[
            "base",
            "catalog",
            "ephemeris",
            "frame",
            "camera",
            "calibration",
            "detect",
            "identify",
            "predict",
            "photometry",
            "sky",
            "centroids",
        ],
    ),
    (
        "track",
        &[
            "base",
            "catalog",
            "ephemeris",
            "frame",
            "camera",
            "detect",
            "identify",
            "photometry",
            "solve",
        ],
    ),
    (
        "annotate",
        &["base", "catalog", "ephemeris", "identify", "solve"],
    ),
    (
        "report",
        &[
            "base",
            "annotate",
            "catalog",
            "ephemeris",
            "frame",
            "camera",
            "calibration",
            "detect",
            "identify",
            "photometry",
            "sky",
            "solve",
            "track",
        ],
    ),
    (
        "doors",
        &["base", "centroids", "frame", "identify", "report", "solve"],
    ),
    (
        "night",
        &[
            "base",
            "ephemeris",
            "frame",
            "camera",
            "identify",
            "sky",
            "solve",
            "report",
        ],
    ),
    ("store", &["base", "catalog", "solve", "report"]),
    (
        "lab",
        &[
            "base",
            "catalog",
            "ephemeris",
            "frame",
            "camera",
            "calibration",
            "detect",
            "identify",
            "predict",
            "photometry",
            "sky",
            "centroids",
            "solve",
            "night",
            "store",
        ],
    ),
];

fn src() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

fn room(module: &ModulePath) -> &str {
    module.first().map_or("lib", String::as_str)
}

/// Which rooms of the library each room uses, by what its files use.
fn uses_of_rooms(library: &Crate) -> BTreeMap<String, BTreeSet<String>> {
    let mut rooms: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (user, used) in library.uses() {
        let others = used.iter().map(|used| room(used).to_owned());
        let others = others.filter(|used| used != room(user));
        rooms
            .entry(room(user).to_owned())
            .or_default()
            .extend(others);
    }
    rooms
}

#[test]
fn the_rooms_are_those_of_the_table() {
    let library = Crate::read(&src());
    let outside = ["lib", "main", "cli"];
    let found: BTreeSet<&str> = library.files().map(|(module, _)| room(module)).collect();
    let found: Vec<_> = found
        .iter()
        .filter(|room| !outside.contains(room))
        .collect();
    let mut known: Vec<_> = ROOMS.iter().map(|(room, _)| room).collect();
    known.sort();
    assert_eq!(found, known);
}

#[test]
fn a_room_may_use_rooms_below_it_only() {
    for (place, (room, used)) in ROOMS.iter().enumerate() {
        let below: Vec<_> = ROOMS[..place].iter().map(|(room, _)| room).collect();
        assert!(used.iter().all(|used| below.contains(&used)), "{room}");
    }
}

#[test]
fn every_room_uses_what_the_table_says_and_no_more() {
    let uses = uses_of_rooms(&Crate::read(&src()));
    for (room, allowed) in ROOMS {
        let allowed: BTreeSet<_> = allowed.iter().map(|&used| used.to_owned()).collect();
        let found = &uses[*room];
        let breaches: Vec<_> = found.difference(&allowed).collect();
        let unused: Vec<_> = allowed.difference(found).collect();
        assert!(breaches.is_empty(), "{room} uses {breaches:?}");
        assert!(unused.is_empty(), "{room} does not use {unused:?}");
    }
}

#[test]
fn no_files_use_each_other_in_a_circle() {
    let library = Crate::read(&src());
    let uses = library.uses();
    let circles = circles(&uses);
    let shown: Vec<String> = circles
        .iter()
        .map(|circle| {
            let names: Vec<_> = circle.iter().map(|module| module.join("::")).collect();
            names.join(" ")
        })
        .collect();
    assert!(shown.is_empty(), "{} circles: {shown:#?}", shown.len());
}

/// The sets of modules of which each is reached from each other.
fn circles<'a>(
    uses: &BTreeMap<&'a ModulePath, BTreeSet<&'a ModulePath>>,
) -> Vec<BTreeSet<&'a ModulePath>> {
    let reached = |start: &'a ModulePath| {
        let mut reached = BTreeSet::new();
        let mut open: Vec<&ModulePath> = uses[start].iter().copied().collect();
        while let Some(module) = open.pop() {
            if reached.insert(module) {
                open.extend(&uses[module]);
            }
        }
        reached
    };
    let reached: BTreeMap<_, _> = uses
        .keys()
        .map(|&module| (module, reached(module)))
        .collect();
    let circle = |module: &&'a ModulePath| -> BTreeSet<&'a ModulePath> {
        let others = reached[*module].iter().copied();
        others
            .filter(|other| reached[*other].contains(*module))
            .collect()
    };
    let found: BTreeSet<_> = uses.keys().map(circle).filter(|c| !c.is_empty()).collect();
    found.into_iter().collect()
}

#[test]
fn the_command_line_uses_the_public_library_only() {
    for file in source::rust_files(&src().join("cli")) {
        let text = std::fs::read_to_string(&file).unwrap();
        let inside = text.matches("crate::").count();
        let own = text.matches("crate::cli").count() + text.matches("$crate::").count();
        assert_eq!(inside, own, "{}", file.display());
    }
}

/// Flags in the texts of a file, without its comments and tests.
fn flags_in(source: &str) -> Vec<&str> {
    let product = source
        .split("#[cfg(test)]\nmod tests")
        .next()
        .unwrap_or(source);
    let code = product
        .lines()
        .filter(|line| !line.trim_start().starts_with("//"));
    let is_flag = |part: &&str| {
        let word = part.trim_start_matches(['"', '(', '`']);
        let name = word.strip_prefix("--");
        name.is_some_and(|name| name.starts_with(|first: char| first.is_ascii_lowercase()))
    };
    code.flat_map(str::split_whitespace)
        .filter(is_flag)
        .collect()
}

#[test]
fn messages_of_the_library_name_no_flags_of_the_command_line() {
    assert_eq!(flags_in("    \"see (--fov) or\"\n// --near"), ["(--fov)"]);
    let is_of_library = |path: &&PathBuf| {
        let is_other = |part: &OsStr| {
            ["cli", "main.rs", "tests.rs"]
                .iter()
                .any(|name| part == *name)
        };
        !path.iter().any(is_other)
    };
    let files = rust_files(&src());
    let files: Vec<_> = files.iter().filter(is_of_library).collect();
    assert!(files.len() > 300, "{}", files.len());
    for path in files {
        let source = fs::read_to_string(path).unwrap();
        assert_eq!(flags_in(&source), [""; 0], "{}", path.display());
    }
}
