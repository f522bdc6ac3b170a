//! The pixels of a frame, in the samples of its file or of the array that they are borrowed from.

use std::borrow::Cow;

/// Pixel values, row-major. Whole numbers of few bits stay what they are: they take less memory, and
/// less time to look through.
#[derive(Debug, Clone)]
pub enum Pixels<'p> {
    /// Whole numbers from 0 to 255.
    U8(Cow<'p, [u8]>),
    /// Whole numbers from 0 to 65535.
    U16(Cow<'p, [u16]>),
    /// Any numbers; NaN marks a pixel without a value.
    F32(Cow<'p, [f32]>),
}

impl Pixels<'_> {
    /// The number of pixels.
    pub fn len(&self) -> usize {
        match self {
            Self::U8(values) => values.len(),
            Self::U16(values) => values.len(),
            Self::F32(values) => values.len(),
        }
    }

    /// The memory that they take.
    pub(crate) fn bytes(&self) -> u64 {
        let bytes = match self {
            Self::U8(values) => size_of_val(&values[..]),
            Self::U16(values) => size_of_val(&values[..]),
            Self::F32(values) => size_of_val(&values[..]),
        };
        bytes as u64
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The value of the pixel at `index`.
    ///
    /// # Panics
    /// If there is none.
    pub fn value(&self, index: usize) -> f32 {
        match self {
            Self::U8(values) => f32::from(values[index]),
            Self::U16(values) => f32::from(values[index]),
            Self::F32(values) => values[index],
        }
    }

    /// The highest value; NaN is left out.
    pub fn highest(&self) -> f32 {
        let higher = |a: f32, b: f32| if b > a { b } else { a };
        match self {
            Self::U8(values) => f32::from(values.iter().copied().max().unwrap_or(0)),
            Self::U16(values) => f32::from(values.iter().copied().max().unwrap_or(0)),
            Self::F32(values) => reduce(values, f32::NEG_INFINITY, higher),
        }
    }

    /// The lowest value; NaN is left out.
    pub(crate) fn lowest(&self) -> f32 {
        let lower = |a: f32, b: f32| if b < a { b } else { a };
        match self {
            Self::U8(values) => f32::from(values.iter().copied().min().unwrap_or(0)),
            Self::U16(values) => f32::from(values.iter().copied().min().unwrap_or(0)),
            Self::F32(values) => reduce(values, f32::INFINITY, lower),
        }
    }

    /// The number of pixels for which `is` is true.
    pub(crate) fn count(&self, is: impl Fn(f32) -> bool) -> usize {
        match self {
            Self::U8(values) => values.iter().filter(|&&v| is(v.into())).count(),
            Self::U16(values) => values.iter().filter(|&&v| is(v.into())).count(),
            Self::F32(values) => values.iter().filter(|&&v| is(v)).count(),
        }
    }

    /// The values one after the other, without a copy of all of them.
    pub fn values(&self) -> impl Iterator<Item = f32> {
        (0..self.len()).map(|index| self.value(index))
    }

    /// All values as floats; whole numbers are converted each time.
    pub fn to_f32(&self) -> Cow<'_, [f32]> {
        match self {
            Self::U8(values) => values.iter().map(|&v| f32::from(v)).collect(),
            Self::U16(values) => values.iter().map(|&v| f32::from(v)).collect(),
            Self::F32(values) => Cow::Borrowed(values),
        }
    }

    /// The values as floats that can be changed: whole numbers become floats for good.
    pub fn as_f32_mut(&mut self) -> &mut Vec<f32> {
        if let Self::U8(_) | Self::U16(_) = self {
            *self = Self::F32(self.to_f32().into_owned().into());
        }
        match self {
            Self::F32(values) => values.to_mut(),
            Self::U8(_) | Self::U16(_) => unreachable!("they are floats now"),
        }
    }

    /// The pixels, copied where they are borrowed.
    pub(super) fn into_owned(self) -> Pixels<'static> {
        match self {
            Self::U8(values) => Pixels::U8(values.into_owned().into()),
            Self::U16(values) => Pixels::U16(values.into_owned().into()),
            Self::F32(values) => Pixels::F32(values.into_owned().into()),
        }
    }

    /// Reverses the order of the rows of `width` pixels.
    pub(super) fn reverse_rows(&mut self, width: usize) {
        match self {
            Self::U8(values) => reverse_rows(values.to_mut(), width),
            Self::U16(values) => reverse_rows(values.to_mut(), width),
            Self::F32(values) => reverse_rows(values.to_mut(), width),
        }
    }
}

/// All `values` and the `first` reduced to one, whatever their order: many at once.
#[inline(always)]
pub(super) fn reduce<T: Copy>(values: &[T], first: T, by: impl Fn(T, T) -> T) -> T {
    const LANES: usize = 64;
    let (chunks, rest) = values.as_chunks::<LANES>();
    let mut lanes = [first; LANES];
    for chunk in chunks {
        for (lane, &value) in lanes.iter_mut().zip(chunk) {
            *lane = by(*lane, value);
        }
    }
    lanes.iter().chain(rest).copied().fold(first, by)
}

fn reverse_rows<T>(values: &mut [T], width: usize) {
    let height = values.len() / width;
    let (upper, lower) = values.split_at_mut(height / 2 * width);
    let from_bottom = lower.rchunks_exact_mut(width);
    for (above, below) in upper.chunks_exact_mut(width).zip(from_bottom) {
        above.swap_with_slice(below);
    }
}

/// Compares values, in whatever samples they are.
impl PartialEq for Pixels<'_> {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::U8(a), Self::U8(b)) => a == b,
            (Self::U16(a), Self::U16(b)) => a == b,
            _ => self.to_f32() == other.to_f32(),
        }
    }
}

impl From<Vec<f32>> for Pixels<'_> {
    fn from(values: Vec<f32>) -> Self {
        Self::F32(values.into())
    }
}

impl<'p> From<&'p [f32]> for Pixels<'p> {
    fn from(values: &'p [f32]) -> Self {
        Self::F32(values.into())
    }
}

impl From<Vec<u16>> for Pixels<'_> {
    fn from(values: Vec<u16>) -> Self {
        Self::U16(values.into())
    }
}

impl<'p> From<&'p [u16]> for Pixels<'p> {
    fn from(values: &'p [u16]) -> Self {
        Self::U16(values.into())
    }
}

impl From<Vec<u8>> for Pixels<'_> {
    fn from(values: Vec<u8>) -> Self {
        Self::U8(values.into())
    }
}

impl<'p> From<&'p [u8]> for Pixels<'p> {
    fn from(values: &'p [u8]) -> Self {
        Self::U8(values.into())
    }
}
