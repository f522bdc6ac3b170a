//! Arithmetic of groups of pixels, lane by lane.
//!
//! The compiler makes one vector instruction of each of these, also inside of larger loops, of which
//! it may choose the wrong one to vectorise.

use super::gaussian::PixelGroup;

/// `f` of each value.
#[inline(always)]
pub(crate) fn each(a: &PixelGroup, f: impl Fn(f32) -> f32) -> PixelGroup {
    let mut results = *a;
    for result in &mut results {
        *result = f(*result);
    }
    results
}

/// `f` of each pair of values.
#[inline(always)]
pub(crate) fn each_of(a: &PixelGroup, b: &PixelGroup, f: impl Fn(f32, f32) -> f32) -> PixelGroup {
    let mut results = *a;
    for (result, b) in results.iter_mut().zip(b) {
        *result = f(*result, *b);
    }
    results
}

/// The products.
#[inline(always)]
pub(crate) fn times(a: &PixelGroup, b: &PixelGroup) -> PixelGroup {
    each_of(a, b, |a, b| a * b)
}

/// The sums.
#[inline(always)]
pub(crate) fn plus(a: &PixelGroup, b: &PixelGroup) -> PixelGroup {
    each_of(a, b, |a, b| a + b)
}
