//! The fuzz targets with the inputs in `fuzz/corpus/`, and changes of them that depend on a seed alone.

// Compiled here, so that library and dependencies are not compiled for it once more.
#[path = "../../fuzz/src/lib.rs"]
#[allow(dead_code, reason = "the fuzzer looks a target up by its name")]
mod targets;

use std::fs;
use std::path::{Path, PathBuf};

/// Changes of each input: few where one takes long.
fn changes(target: &str) -> u64 {
    match target {
        "index" | "pipeline" | "centroids" => 100,
        _ => 1000,
    }
}

/// The inputs of a target, by name.
fn corpus(target: &str) -> Vec<(PathBuf, Vec<u8>)> {
    let place = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("fuzz/corpus")
        .join(target);
    let files = fs::read_dir(&place).unwrap_or_else(|error| panic!("{}: {error}", place.display()));
    let mut paths: Vec<PathBuf> = files.map(|file| file.expect("a file").path()).collect();
    paths.sort();
    let read = |path: PathBuf| {
        let content = fs::read(&path).expect("a file of the corpus");
        (path, content)
    };
    paths.into_iter().map(read).collect()
}

/// A copy of `input` with some bytes changed, cut, or repeated.
fn changed(input: &[u8], seed: u64) -> Vec<u8> {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut random = move |below: usize| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state % below.max(1) as u64) as usize
    };
    let mut bytes = input.to_vec();
    for _ in 0..=random(8) {
        if bytes.is_empty() {
            return bytes;
        }
        let at = random(bytes.len());
        match random(6) {
            0 => bytes.truncate(at),
            1 => bytes[at] = 0xff,
            2 => bytes[at] = 0,
            3 => bytes[at] ^= 1 << random(8),
            4 => bytes[at] = random(256) as u8,
            _ => {
                let piece = bytes[at..bytes.len().min(at + 1 + random(16))].to_vec();
                let to = random(bytes.len());
                bytes.splice(to..to, piece);
            }
        }
    }
    bytes
}

#[test]
fn all_targets_hold_for_the_corpus_and_changes_of_it() {
    for (name, target) in targets::TARGETS {
        let inputs = corpus(name);
        assert!(!inputs.is_empty(), "no inputs for {name}");
        for (path, input) in &inputs {
            eprintln!("{}", path.display());
            target(input);
            for seed in 1..=changes(name) {
                target(&changed(input, seed));
            }
        }
    }
}
