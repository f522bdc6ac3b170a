//! What the integration tests share.

use std::path::PathBuf;

/// The folder with the source catalogue and the real frames, `../shared` beside the repository.
///
/// `None`, with a line that says so, where it is absent: the test is to be skipped.
///
/// # Panics
/// If it is absent though `STARPIPE_REQUIRE_SHARED=1` demands it.
pub fn shared_dir() -> Option<PathBuf> {
    let dir = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared"));
    if dir.is_dir() {
        return Some(dir);
    }
    let required = std::env::var("STARPIPE_REQUIRE_SHARED").is_ok_and(|value| value == "1");
    assert!(
        !required,
        "{} is absent, and STARPIPE_REQUIRE_SHARED=1",
        dir.display()
    );
    println!("skipped: {} is absent", dir.display());
    None
}
