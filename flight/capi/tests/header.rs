//! The header is that of the sources.

use std::env;
use std::path::Path;

#[test]
fn the_header_is_that_of_the_sources() {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(package.join("cbindgen.toml")).unwrap();
    let bindings = cbindgen::generate_with_config(package, config).unwrap();
    let mut made = Vec::new();
    bindings.write(&mut made);
    let path = package.join("include/starpipe.h");
    if env::var_os("WRITE_HEADER").is_some() {
        std::fs::write(&path, &made).unwrap();
    }
    let kept = std::fs::read(&path).unwrap();
    assert!(made == kept, "WRITE_HEADER=1 writes it anew");
}
