//! The images of a file with several.

use crate::errors::exception;
use crate::interrupt::on_this_thread;
use pyo3::prelude::*;
use starpipe::frame::{self, Buffers, FrameError, ImageName};
use starpipe::solve;
use starpipe::{Frame, Interrupt};
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
    on_this_thread(py, |interrupt| {
        let decoded = frame::decode_page_with(content, Some(number), &mut buffers(interrupt));
        decoded.map(Page).map_err(|error| unread(error, name))
    })
}

/// Buffers for a frame that ends with `interrupt`.
pub fn buffers(interrupt: &Interrupt) -> Buffers {
    let mut buffers = Buffers::new();
    buffers.set_interrupt(interrupt.clone());
    buffers
}

fn unread(error: FrameError, name: &str) -> PyErr {
    exception(solve::Error::from(error.in_file(Path::new(name))))
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
        on_this_thread(py, |interrupt| {
            let opened = frame::Pages::from_bytes(content.to_vec(), &mut buffers(interrupt));
            let pages = opened.map_err(|error| unread(error, &name))?;
            Ok(Self { name, pages })
        })
    }

    fn __iter__(this: PyRef<'_, Self>) -> PyRef<'_, Self> {
        this
    }

    fn __next__<'py>(&mut self, py: Python<'py>) -> PyResult<Option<(String, Bound<'py, PyAny>)>> {
        let Some(number) = self.pages.advance() else {
            return Ok(None);
        };
        let pages = &mut self.pages;
        let frame = on_this_thread(py, |interrupt| Ok(pages.image(&mut buffers(interrupt))))?;
        let name = ImageName::new(Path::new(&self.name))
            .page(number)
            .to_string();
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
