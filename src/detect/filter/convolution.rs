//! Inner loops of the matched filter: normalisation, and sums along rows and columns.

use crate::detect::background::Piece;
use crate::detect::pixels::{PixelLevel, Samples};
use crate::detect::psf::MAX_TAPS;
use multiversion::multiversion;

/// Pixels treated together.
pub(super) const VECTOR_PX: usize = 32;
/// Adjacent pixels of a row.
type Vector = [f32; VECTOR_PX];

/// `target = (row − background) / sigma` along the pieces of a row; 0 where the pixel is NaN.
pub(crate) fn normalise(row: Samples<'_>, pieces: &[Piece], target: &mut [f32]) {
    match row {
        Samples::U8(row) => normalise_of(row, pieces, target),
        Samples::U16(row) => normalise_of(row, pieces, target),
        Samples::F32(row) => normalise_of(row, pieces, target),
    }
}

#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
fn normalise_of<T: PixelLevel + Into<f32>>(row: &[T], pieces: &[Piece], target: &mut [f32]) {
    const LANES: usize = 16;
    let lanes: [f32; LANES] = std::array::from_fn(|lane| lane as f32);
    for piece in pieces {
        let (row, target) = (
            &row[piece.start..piece.end],
            &mut target[piece.start..piece.end],
        );
        let (chunks, rest) = row.as_chunks::<LANES>();
        let (outs, out_rest) = target.as_chunks_mut::<LANES>();
        let piece = *piece;
        let mut first = 0.0;
        for (pixels, out) in chunks.iter().zip(outs) {
            for lane in 0..LANES {
                out[lane] = standardised(pixels[lane], first + lanes[lane], &piece);
            }
            first += LANES as f32;
        }
        for (lane, (&pixel, out)) in rest.iter().zip(out_rest).enumerate() {
            *out = standardised(pixel, first + lane as i32 as f32, &piece);
        }
    }
}

/// A pixel `t` columns from the start of a piece, less the background and over the noise.
#[inline(always)]
fn standardised<T: PixelLevel + Into<f32>>(pixel: T, t: f32, piece: &Piece) -> f32 {
    let value = (pixel.into() - (piece.background + t * piece.background_slope))
        * (piece.inverse_sigma + t * piece.inverse_sigma_slope);
    if T::MAY_BE_NAN && value.is_nan() {
        0.0
    } else {
        value
    }
}

/// Calls `$sum::<N>` where the number of weights `$count` is one of the usual `$length`s N, so that
/// the compiler unrolls its loops; else `$sum::<MAX_TAPS>`.
macro_rules! with_known_length {
    ($count:expr, $sum:ident $arguments:tt, $($length:literal)*) => {
        match $count {
            $($length => $sum::<$length> $arguments,)*
            _ => $sum::<MAX_TAPS> $arguments,
        }
    };
}

/// `out[x] = half[0]·padded[x+r] + Σ half[j]·(padded[x+r−j] + padded[x+r+j])`, r the kernel's
/// radius.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
pub(super) fn sum_along_row(half: &[f32], padded: &[f32], out: &mut [f32]) {
    with_known_length!(half.len(), sum_along_row_of(half, padded, out), 2 3 4 5 6 7);
}

#[inline(always)]
fn sum_along_row_of<const N: usize>(half: &[f32], padded: &[f32], out: &mut [f32]) {
    let half = if N < MAX_TAPS { &half[..N] } else { half };
    let radius = half.len() - 1;
    for (block, out) in out.as_chunks_mut::<VECTOR_PX>().0.iter_mut().enumerate() {
        let near = &padded[block * VECTOR_PX..][..VECTOR_PX + 2 * radius];
        let mut sum: Vector = [0.0; VECTOR_PX];
        for lane in 0..VECTOR_PX {
            sum[lane] = half[0] * near[radius + lane];
        }
        for j in 1..=radius {
            let (left, right) = (
                &near[radius - j..][..VECTOR_PX],
                &near[radius + j..][..VECTOR_PX],
            );
            for lane in 0..VECTOR_PX {
                sum[lane] += half[j] * (left[lane] + right[lane]);
            }
        }
        *out = sum;
    }
}

/// `out = factor·(half[0]·pairs[0][0] + Σ half[j]·(pairs[j][0] + pairs[j][1]))`, where `pairs[j]`
/// are the rows j above and j below, as long as `out`.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2+fma"))]
pub(super) fn sum_along_columns(half: &[f32], pairs: &[[&[f32]; 2]], factor: f32, out: &mut [f32]) {
    with_known_length!(half.len(), sum_along_columns_of(half, pairs, factor, out), 2 3 4 5 6 7);
}

#[inline(always)]
fn sum_along_columns_of<const N: usize>(
    half: &[f32],
    pairs: &[[&[f32]; 2]],
    factor: f32,
    out: &mut [f32],
) {
    let half = if N < MAX_TAPS { &half[..N] } else { half };
    let out = out.as_chunks_mut::<VECTOR_PX>().0;
    let chunks = |row| -> &[Vector] {
        let row: &[f32] = row;
        &row.as_chunks().0[..out.len()]
    };
    let none: [&[Vector]; 2] = [&[]; 2];
    let rows: [[&[Vector]; 2]; N] =
        std::array::from_fn(|j| pairs.get(j).map_or(none, |pair| pair.map(chunks)));
    for (part, out) in out.iter_mut().enumerate() {
        let mut sum = rows[0][0][part];
        for value in &mut sum {
            *value *= half[0];
        }
        for j in 1..half.len() {
            let (above, below) = (&rows[j][0][part], &rows[j][1][part]);
            for lane in 0..VECTOR_PX {
                sum[lane] += half[j] * (above[lane] + below[lane]);
            }
        }
        for value in &mut sum {
            *value *= factor;
        }
        *out = sum;
    }
}
