//! Images as frames: an array of numpy is borrowed, a file or its bytes are decoded.

use crate::errors::exception;
use crate::pages::Page;
use numpy::{PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use starpipe::Frame;
use starpipe::base::size::Size;
use starpipe::frame::{self, Buffers, FrameError, RowOrder};
use std::path::{Path, PathBuf};

/// What Python passes as an image. Arrays are C-contiguous, in the byte order of the machine.
#[derive(FromPyObject)]
pub enum Image<'py> {
    Bytes(PyBackedBytes),
    Path(PathBuf),
    Page(PyRef<'py, Page>),
    U8(PyReadonlyArray2<'py, u8>),
    U16(PyReadonlyArray2<'py, u16>),
    F32(PyReadonlyArray2<'py, f32>),
    /// Whole numbers of another type, and the largest of that type.
    Integers(PyReadonlyArray2<'py, i64>, i64),
    /// Red, green and blue of each pixel.
    Colors(Colors<'py>),
}

/// A picture of colors: whole numbers, and the largest of their type, or floats.
#[derive(FromPyObject)]
pub enum Colors<'py> {
    Integers(PyReadonlyArray3<'py, i64>, i64),
    F32(PyReadonlyArray3<'py, f32>),
}

/// The same without Python's objects, so that the interpreter is free while it is used.
pub enum Source<'a> {
    Bytes(&'a [u8]),
    Path(&'a Path),
    Page(&'a Frame<'static>),
    Array(Box<Frame<'a>>),
}

impl Image<'_> {
    /// Where the colors of its pixels are.
    pub fn colors(&self) -> PyResult<ColorSource<'_>> {
        Ok(match self {
            Self::Bytes(bytes) => ColorSource::Bytes(bytes),
            Self::Path(path) => ColorSource::Path(path),
            Self::Colors(colors) => colors.levels()?,
            _ => ColorSource::None,
        })
    }

    /// Borrows the pixels of an array.
    pub fn source(&self) -> PyResult<Source<'_>> {
        let frame = match self {
            Self::Bytes(bytes) => return Ok(Source::Bytes(bytes)),
            Self::Path(path) => return Ok(Source::Path(path)),
            Self::Page(page) => return Ok(Source::Page(&page.0)),
            Self::U8(array) => samples(array, slice(array)?),
            Self::U16(array) => samples(array, slice(array)?),
            Self::F32(array) => samples(array, slice(array)?),
            Self::Integers(array, full_scale) => {
                let [height, width] = sides(array);
                Frame::from_integers(width, height, slice(array)?, *full_scale)
            }
            Self::Colors(colors) => colors.luminance()?,
        };
        let array = frame.map(|frame| Source::Array(Box::new(frame)));
        array.map_err(exception)
    }
}

/// Where the colors of a frame are.
pub enum ColorSource<'a> {
    None,
    Path(&'a Path),
    Bytes(&'a [u8]),
    /// Whole numbers, of so many channels.
    Integers(&'a [i64], usize),
    F32(&'a [f32], usize),
}

impl ColorSource<'_> {
    /// The colors of `frame`, which was read from there.
    pub fn of(&self, frame: &Frame, buffers: &mut Buffers) -> Option<frame::Colors> {
        let pixels = match *self {
            Self::None => return None,
            Self::Path(path) => return frame::Colors::read(path, frame, buffers),
            Self::Bytes(bytes) => return frame::Colors::decode(bytes, frame, buffers),
            Self::Integers(levels, channels) => {
                let highest = levels.iter().copied().max().unwrap_or(0);
                // Levels of up to 16 bits keep their steps.
                let scale = match highest {
                    ..=0xff => 257.0,
                    0x100..=0xffff => 1.0,
                    _ => f32::from(u16::MAX) / highest as f32,
                };
                scaled(levels, channels, |level| level as f32 * scale)
            }
            Self::F32(levels, channels) => {
                let finite = levels.iter().copied().filter(|level| level.is_finite());
                let highest = finite.fold(f32::MIN_POSITIVE, f32::max);
                let scale = f32::from(u16::MAX) / highest;
                scaled(levels, channels, |level| level * scale)
            }
        };
        frame::Colors::new(frame, pixels)
    }
}

/// Red, green and blue of each pixel, where 65535 is full scale.
fn scaled<T: Copy>(levels: &[T], channels: usize, scale: impl Fn(T) -> f32) -> Vec<[u16; 3]> {
    let pixels = levels.chunks_exact(channels);
    // Conversion from floats saturates.
    let pixel = |levels: &[T]| [0, 1, 2].map(|channel| scale(levels[channel]).round() as u16);
    pixels.map(pixel).collect()
}

impl Colors<'_> {
    fn luminance(&self) -> PyResult<Result<Frame<'static>, FrameError>> {
        let shape = match self {
            Self::Integers(array, _) => array.shape(),
            Self::F32(array) => array.shape(),
        };
        let size = Size::new(shape[1], shape[0]);
        let channels = shape[2];
        Ok(match self {
            Self::Integers(array, full_scale) => {
                let samples = array.as_slice().map_err(contiguous)?;
                Frame::from_colors(size, channels, samples, *full_scale)
            }
            Self::F32(array) => {
                let samples = array.as_slice().map_err(contiguous)?.to_vec();
                Frame::from_float_colors(size, channels, samples)
            }
        })
    }

    /// The levels of all channels, pixel after pixel.
    fn levels(&self) -> PyResult<ColorSource<'_>> {
        Ok(match self {
            Self::Integers(array, _) => {
                let samples = array.as_slice().map_err(contiguous)?;
                ColorSource::Integers(samples, array.shape()[2])
            }
            Self::F32(array) => {
                let samples = array.as_slice().map_err(contiguous)?;
                ColorSource::F32(samples, array.shape()[2])
            }
        })
    }
}

/// Refuses sizes that no frame has, before anything is copied.
#[pyfunction]
pub fn check_size(width: usize, height: usize) -> PyResult<()> {
    frame::check_size(width, height).map_err(exception)
}

/// A mask: true where a pixel is to be left out.
pub fn bad_pixels<'a>(
    mask: Option<&'a PyReadonlyArray2<'_, bool>>,
) -> PyResult<Option<&'a [bool]>> {
    mask.map(slice).transpose()
}

fn slice<'a, T: numpy::Element>(array: &'a PyReadonlyArray2<'_, T>) -> PyResult<&'a [T]> {
    array.as_slice().map_err(contiguous)
}

fn contiguous(_: numpy::AsSliceError) -> PyErr {
    PyTypeError::new_err("the array must be C-contiguous")
}

fn sides<T: numpy::Element>(array: &PyReadonlyArray2<'_, T>) -> [usize; 2] {
    [array.shape()[0], array.shape()[1]]
}

fn samples<'a, T: numpy::Element>(
    array: &PyReadonlyArray2<'_, T>,
    samples: &'a [T],
) -> Result<Frame<'a>, FrameError>
where
    frame::Pixels<'a>: From<&'a [T]>,
{
    let [height, width] = sides(array);
    Frame::from_samples(width, height, samples)
}

impl<'a> Source<'a> {
    /// Stands for a file's name.
    pub fn name(&self) -> PathBuf {
        match self {
            Self::Bytes(_) => "bytes".into(),
            Self::Path(path) => path.to_path_buf(),
            Self::Page(_) => "page".into(),
            Self::Array(_) => "array".into(),
        }
    }

    /// Whether the order of the rows as drawn is known: that of a file is, that of an array is not.
    pub fn is_file(&self) -> bool {
        !matches!(self, Self::Array(_))
    }

    /// The frame as drawn, with its pixels where `bad` is true without a value; the rows of `bad` are
    /// in the order of the file. Errors in bytes have `name`.
    pub fn frame(
        self,
        name: &Path,
        bad: Option<&[bool]>,
        buffers: &mut Buffers,
    ) -> Result<Frame<'a>, FrameError> {
        let mut frame = match self {
            Self::Bytes(bytes) => frame::decode_page_with(bytes, None, buffers)
                .map_err(|error| error.in_file(name))?,
            Self::Path(path) => frame::read_page_with(path, None, buffers)?,
            Self::Page(frame) => frame.clone(),
            Self::Array(frame) => *frame,
        };
        let Some(bad) = bad else { return Ok(frame) };
        let expected = frame.width * frame.height;
        if bad.len() != expected {
            let found = bad.len();
            return Err(FrameError::WrongLength { expected, found });
        }
        let width = frame.width;
        let is_reversed = frame.metadata.row_order == RowOrder::BottomUp;
        let rows = frame.values_mut().chunks_exact_mut(width).enumerate();
        for (row, pixels) in rows {
            let stored = if is_reversed {
                expected / width - 1 - row
            } else {
                row
            };
            let bad = &bad[stored * width..][..width];
            for (pixel, _) in pixels.iter_mut().zip(bad).filter(|(_, bad)| **bad) {
                *pixel = f32::NAN;
            }
        }
        Ok(frame)
    }
}
