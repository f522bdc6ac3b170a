//! What several tests need.

use std::path::PathBuf;

/// The real frames and lists that lie beside the repository, if they are there.
///
/// # Panics
/// If they are not, and STARPIPE_REQUIRE_SHARED=1.
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
