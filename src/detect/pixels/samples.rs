//! Adjacent pixels in the samples of the frame, and their conversion to floats.

use crate::frame::Pixels;
use multiversion::multiversion;
use std::ops::Range;

/// Adjacent pixels, in the samples of the frame.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Samples<'a> {
    /// Whole numbers from 0 to 255.
    U8(&'a [u8]),
    /// Whole numbers from 0 to 65535.
    U16(&'a [u16]),
    /// Any numbers, and NaN.
    F32(&'a [f32]),
}

impl<'a> From<&'a Pixels<'_>> for Samples<'a> {
    fn from(pixels: &'a Pixels<'_>) -> Self {
        match pixels {
            Pixels::U8(values) => Self::U8(values),
            Pixels::U16(values) => Self::U16(values),
            Pixels::F32(values) => Self::F32(values),
        }
    }
}

impl<'a> From<&'a Vec<f32>> for Samples<'a> {
    fn from(values: &'a Vec<f32>) -> Self {
        Self::F32(values)
    }
}

impl<'a> Samples<'a> {
    /// Some of the pixels.
    #[inline(always)]
    pub fn span(self, range: Range<usize>) -> Self {
        match self {
            Self::U8(values) => Self::U8(&values[range]),
            Self::U16(values) => Self::U16(&values[range]),
            Self::F32(values) => Self::F32(&values[range]),
        }
    }

    /// The pixel at `index`.
    #[inline(always)]
    pub fn at(self, index: usize) -> f32 {
        match self {
            Self::U8(values) => f32::from(values[index]),
            Self::U16(values) => f32::from(values[index]),
            Self::F32(values) => values[index],
        }
    }

    /// The number of pixels.
    fn len(self) -> usize {
        match self {
            Self::U8(values) => values.len(),
            Self::U16(values) => values.len(),
            Self::F32(values) => values.len(),
        }
    }

    /// Copies the first `N` pixels; NaN beyond the last.
    #[inline(always)]
    pub fn copy_group<const N: usize>(self, group: &mut [f32; N]) {
        match self {
            Self::U8(values) => copy_group(values, group),
            Self::U16(values) => copy_group(values, group),
            Self::F32(values) => copy_group(values, group),
        }
    }

    /// Copies all pixels to `target`, which is as long.
    #[inline]
    pub fn copy_to(self, target: &mut [f32]) {
        match self {
            Self::U8(values) => convert(values, target),
            Self::U16(values) => convert(values, target),
            Self::F32(values) => target.copy_from_slice(values),
        }
    }

    /// The pixels as floats, in `buffer` if they are none.
    pub fn as_floats<'b>(self, buffer: &'b mut Vec<f32>) -> &'b [f32]
    where
        'a: 'b,
    {
        if let Self::F32(values) = self {
            return values;
        }
        buffer.resize(self.len(), 0.0);
        self.copy_to(buffer);
        buffer
    }
}

#[inline(always)]
#[allow(
    clippy::needless_range_loop,
    reason = "loops over lanes, which become vectors"
)]
fn copy_group<T: Copy + Into<f32>, const N: usize>(values: &[T], group: &mut [f32; N]) {
    // A loop of a known length, and one that is not.
    if let Some(whole) = values.first_chunk::<N>() {
        for lane in 0..N {
            group[lane] = whole[lane].into();
        }
    } else {
        group.fill(f32::NAN);
        for (to, &from) in group.iter_mut().zip(values) {
            *to = from.into();
        }
    }
}

#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn convert<T: Copy + Into<f32>>(values: &[T], target: &mut [f32]) {
    for (to, &from) in target.iter_mut().zip(values) {
        *to = from.into();
    }
}
