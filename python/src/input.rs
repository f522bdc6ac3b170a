//! A frame with what is to be done to it before it is solved or shown.

use crate::errors::exception;
use crate::image::{ColorSource, Image, Source, bad_pixels};
use numpy::PyReadonlyArray2;
use pyo3::prelude::*;
use starpipe::calibration::Master;
use starpipe::frame::{Buffers, Colors, RowOrder};
use starpipe::solve;
use starpipe::{Calibration, Frame};
use std::path::{Path, PathBuf};

/// What Python passes of a frame; `name` stands for the name of its file.
#[derive(FromPyObject)]
pub struct Input<'py> {
    image: Image<'py>,
    name: Option<PathBuf>,
    mask: Option<PyReadonlyArray2<'py, bool>>,
    dark: Option<Image<'py>>,
    flat: Option<Image<'py>>,
    /// Level without light, where there is no dark.
    bias_adu: f64,
}

/// The same without Python's objects, so that the interpreter is free while it is used.
pub struct Borrowed<'a> {
    pub name: PathBuf,
    pub source: Source<'a>,
    pub colors: ColorSource<'a>,
    pub bad: Option<&'a [bool]>,
    pub masters: Masters<'a>,
}

/// Dark and flat.
pub struct Masters<'a> {
    dark: Option<Source<'a>>,
    flat: Option<Source<'a>>,
    bias_adu: f64,
}

/// Why a frame could not be read, or not be solved.
pub struct Failed(pub PyErr);

impl<E: Into<solve::Error>> From<E> for Failed {
    fn from(error: E) -> Self {
        Self(exception(error.into()))
    }
}

impl From<Failed> for PyErr {
    fn from(Failed(error): Failed) -> Self {
        error
    }
}

impl Input<'_> {
    /// Borrows the pixels of arrays.
    pub fn borrow(&self) -> PyResult<Borrowed<'_>> {
        let source = self.image.source()?;
        Ok(Borrowed {
            name: self.name.clone().unwrap_or_else(|| source.name()),
            source,
            colors: self.image.colors()?,
            bad: bad_pixels(self.mask.as_ref())?,
            masters: Masters {
                dark: self.dark.as_ref().map(Image::source).transpose()?,
                flat: self.flat.as_ref().map(Image::source).transpose()?,
                bias_adu: self.bias_adu,
            },
        })
    }
}

impl<'a> Borrowed<'a> {
    /// The frame as it was solved: calibrated, with its rows as stored; and its colors.
    pub fn shown(self, buffers: &mut Buffers) -> Result<(Frame<'a>, Option<Colors>), Failed> {
        let is_file = self.source.is_file();
        let mut frame = self.source.frame(&self.name, self.bad, buffers)?;
        let colors = self.colors.of(&frame, buffers);
        let row_order = is_file.then_some(frame.metadata.row_order);
        if let Some(calibration) = self
            .masters
            .calibration(row_order, buffers)
            .map_err(Failed)?
        {
            apply(&calibration, &mut frame, &self.name)?;
        }
        Ok((frame.as_stored(), colors))
    }
}

impl Masters<'_> {
    /// Whether nothing is to be done.
    pub fn is_empty(&self) -> bool {
        self.dark.is_none() && self.flat.is_none()
    }

    /// The calibration of a frame as drawn, whose file has its rows in this order; `None` without
    /// masters. The masters of an array, and arrays as masters, apply row by row.
    pub fn calibration(
        self,
        row_order: Option<RowOrder>,
        buffers: &mut Buffers,
    ) -> PyResult<Option<Calibration>> {
        if self.is_empty() {
            return Ok(None);
        }
        let mut master = |source: Source| {
            let (name, is_file) = (source.name(), source.is_file());
            let frame = source.frame(&name, None, buffers);
            let mut frame = frame.map_err(exception)?.into_owned();
            if !is_file {
                frame.metadata.row_order = row_order.unwrap_or_default();
            }
            if !is_file || row_order.is_none() {
                frame = frame.as_stored();
            }
            let name = name.display().to_string();
            Ok::<_, PyErr>(Master { name, frame })
        };
        let dark = self.dark.map(&mut master).transpose()?;
        let flat = self.flat.map(&mut master).transpose()?;
        let made = Calibration::new(dark, flat, None, self.bias_adu);
        made.map(Some).map_err(exception)
    }
}

/// Calibrates the frame called `name`.
pub fn apply(calibration: &Calibration, frame: &mut Frame, name: &Path) -> Result<(), Failed> {
    let applied = calibration.apply(frame);
    Ok(applied.map_err(|source| {
        let path = name.to_owned();
        solve::Error::Calibrate { path, source }
    })?)
}
