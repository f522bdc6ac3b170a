//! The compiled part of the Python package `starpipe`. Its Python part checks types and units, and
//! makes numpy's and astropy's objects of what this part returns.

#![allow(clippy::too_many_arguments, reason = "keywords of Python functions")]

mod archive;
mod camera;
mod catalogs;
mod darks;
mod detect;
mod errors;
mod flats;
mod image;
mod input;
mod interrupt;
mod lens;
mod options;
mod pages;
mod picture;
mod pipeline;
mod simulate;
mod solved;
mod studies;
mod track;

use pyo3::prelude::*;

/// The module `starpipe._starpipe`.
#[pymodule]
mod _starpipe {
    #[pymodule_export]
    use super::archive::{
        ArchivePlan, PartRows, archive_differences, archive_nights, archive_plan, star_columns,
    };
    #[pymodule_export]
    use super::darks::{DarkFrames, Darks};
    #[pymodule_export]
    use super::detect::detect;
    #[pymodule_export]
    use super::flats::{FlatFrames, Flats};
    #[pymodule_export]
    use super::image::check_size;
    #[pymodule_export]
    use super::lens::calibrate;
    #[pymodule_export]
    use super::options::check_options;
    #[pymodule_export]
    use super::pages::{Page, Pages, read_page};
    #[pymodule_export]
    use super::picture::{picture, write_file};
    #[pymodule_export]
    use super::pipeline::Pipeline;
    #[pymodule_export]
    use super::simulate::{Simulated, simulate};
    #[pymodule_export]
    use super::solved::Solved;
    #[pymodule_export]
    use super::studies::{defocus, limit, robustness, validate};
    #[pymodule_export]
    use super::track::Tracker;
    use pyo3::prelude::*;

    /// Panics become exceptions, and print nothing.
    #[pymodule_init]
    fn init(_module: &Bound<'_, PyModule>) -> PyResult<()> {
        starpipe::base::panics::silence();
        Ok(())
    }
}
