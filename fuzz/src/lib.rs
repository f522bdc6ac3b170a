//! What holds for any input: the readers and the pipeline end with a result or an error, and results
//! are numbers that can be.
//!
//! Each target is a function of bytes. `cargo fuzz run TARGET` looks for bytes that break it;
//! the tests of starpipe replay those in `corpus/` and changes of them.

mod deep;
mod frames;
mod pipeline;
mod scratch;
mod tables;

/// A target.
pub type Target = fn(&[u8]);

/// All targets, by name.
pub const TARGETS: &[(&str, Target)] = &[
    ("tiff", frames::image),
    ("fits", frames::image),
    ("png", frames::image),
    ("jpeg", frames::image),
    ("bmp", frames::image),
    ("pnm", frames::image),
    ("gzip", frames::image),
    ("exif", frames::exif),
    ("pages", frames::pages),
    ("catalog", tables::catalog),
    ("deep", deep::deep),
    ("compact", tables::compact),
    ("index", tables::index),
    ("camera", tables::camera),
    ("response", tables::response),
    ("spot_image", tables::spot_image),
    ("hot_pixels", tables::hot_pixels),
    ("names", tables::names),
    ("run", tables::run),
    ("darks", frames::darks),
    ("centroids", pipeline::centroids),
    ("pipeline", pipeline::pipeline),
];

/// The target of this name.
///
/// # Panics
/// If there is none.
pub fn target(name: &str) -> Target {
    let found = TARGETS.iter().find(|(target, _)| *target == name);
    found.unwrap_or_else(|| panic!("no target {name}")).1
}
