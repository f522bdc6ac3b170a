//! The images of a file with several.

use crate::errors::exception;
use pyo3::prelude::*;
use starpipe::Frame;
use starpipe::frame::{self, Buffers, FrameError};
use starpipe::pipeline;
use std::num::NonZeroUsize;
use std::path::Path;

/// An image of a file.
#[pyclass(frozen, module = "starpipe._starpipe")]
pub struct Page(pub Frame<'static>);

/// Image `number` of the file with this content and name.
#[pyfunction]
pub fn read_page(
    py: Python<'_>,
    content: &[u8],
    name: &str,
    number: NonZeroUsize,
) -> PyResult<Page> {
    let decoded = py.detach(|| frame::decode_page(content, Some(number)));
    decoded.map(Page).map_err(|error| unread(error, name))
}

fn unread(error: FrameError, name: &str) -> PyErr {
    exception(pipeline::Error::from(error.in_file(Path::new(name))))
}

/// All images of a file: the name of each, and the image or the exception that tells why there is
/// none.
#[pyclass(module = "starpipe._starpipe")]
pub struct Pages {
    name: String,
    pages: frame::Pages,
}

#[pymethods]
impl Pages {
    #[new]
    fn new(py: Python<'_>, content: &[u8], name: String) -> PyResult<Self> {
        let opened = py.detach(|| frame::Pages::of(content.to_vec(), &mut Buffers::new()));
        let pages = opened.map_err(|error| unread(error, &name))?;
        Ok(Self { name, pages })
    }

    fn __iter__(this: PyRef<'_, Self>) -> PyRef<'_, Self> {
        this
    }

    fn __next__<'py>(&mut self, py: Python<'py>) -> PyResult<Option<(String, Bound<'py, PyAny>)>> {
        let Some(number) = self.pages.advance() else {
            return Ok(None);
        };
        let frame = py.detach(|| self.pages.image(&mut Buffers::new()));
        let name = format!("{}[{number}]", self.name);
        let image = match frame {
            Ok(frame) => Bound::new(py, Page(frame))?.into_any(),
            Err(error) => unread(error, &name)
                .into_value(py)
                .into_bound(py)
                .into_any(),
        };
        Ok(Some((name, image)))
    }
}
