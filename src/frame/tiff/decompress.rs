//! The bytes of a strip or a tile, decompressed.

use super::directory::{TiffFile, malformed, truncated};
use super::layout::{Chunk, Color, Compression, Layout};
use crate::base::size::Size;
use crate::frame::error::FrameError;
use crate::frame::jpeg::Jpeg;
use crate::frame::read_budget::ReadBudget;
use std::borrow::Cow;
use std::io::Read;

/// Where samples are read from, and what reading them may take.
#[derive(Clone, Copy)]
pub(super) struct ChunkSource<'a> {
    pub file: TiffFile<'a>,
    pub budget: &'a ReadBudget,
}

/// Rows of a chunk.
pub(super) struct StripRows<'a> {
    pub bytes: Cow<'a, [u8]>,
    pub row_bytes: usize,
}

impl Layout<'_> {
    /// The rows of `chunk` that are inside the image.
    /// # Errors
    /// [`FrameError::Truncated`], [`FrameError::Malformed`], [`FrameError::Interrupted`].
    pub fn decompress<'a>(
        &self,
        source: ChunkSource<'a>,
        chunk: &Chunk,
    ) -> Result<StripRows<'a>, FrameError> {
        let ChunkSource { file, budget } = source;
        budget.check_time()?;
        let row_bytes = self.row_bytes();
        let wanted = row_bytes.saturating_mul(chunk.rows);
        let stored = self.stored(file, chunk, wanted as u64)?;
        if self.compression == Compression::Jpeg {
            return self.jpeg(&stored, chunk, budget);
        }
        let bytes = match self.compression {
            Compression::None | Compression::Jpeg => stored,
            Compression::Lzw => lzw(&stored, wanted, budget)?.into(),
            Compression::Deflate => deflate(&stored, wanted, budget)?.into(),
            Compression::PackBits => pack_bits(&stored, wanted).into(),
            Compression::Group4 => {
                let size = Size::new(self.chunk_size.width, chunk.rows);
                group_4(&stored, size, budget)?.into()
            }
        };
        if bytes.len() < wanted {
            let found = bytes.len();
            let detail = format!(
                "the strip or tile at byte {} has {found} bytes, expected {wanted}",
                chunk.place
            );
            return Err(truncated(file.bytes, detail));
        }
        Ok(StripRows { bytes, row_bytes })
    }

    /// The bytes of a chunk as they are stored, with the highest bit of each byte first.
    fn stored<'a>(
        &self,
        file: TiffFile<'a>,
        chunk: &Chunk,
        wanted: u64,
    ) -> Result<Cow<'a, [u8]>, FrameError> {
        let rest = (file.bytes.len() as u64).saturating_sub(chunk.place);
        let length = match self.compression {
            // What is stored is known, whatever the file says.
            Compression::None => wanted,
            _ => chunk.length.unwrap_or(rest),
        };
        let bytes = file.range(chunk.place, length)?;
        Ok(if self.is_bit_reversed {
            bytes.iter().map(|byte| byte.reverse_bits()).collect()
        } else {
            bytes.into()
        })
    }

    /// A chunk that is a JPEG file of its own, but for the tables that all of them share.
    fn jpeg(
        &self,
        stored: &[u8],
        chunk: &Chunk,
        budget: &ReadBudget,
    ) -> Result<StripRows<'static>, FrameError> {
        let fail = |detail: String| {
            budget.why(malformed(format!("JPEG at byte {}: {detail}", chunk.place)))
        };
        let bytes = self
            .whole_jpeg(stored)
            .ok_or_else(|| fail(format!("{} bytes without a start of image", stored.len())))?;
        let jpeg = Jpeg::open(&bytes, budget).map_err(|e| fail(e.to_string()))?;
        let (width, height, channels) = (jpeg.width, jpeg.height, jpeg.channels);
        let is_whole = width >= chunk.columns && height >= chunk.rows;
        let is_expected = width <= self.chunk_size.width && channels == self.chunk_samples;
        if !is_whole || !is_expected || height > self.chunk_size.height {
            let Size {
                width: columns,
                height: rows,
            } = self.chunk_size;
            let samples = self.chunk_samples;
            return Err(fail(format!(
                "{width} x {height} pixels of {channels} samples, expected {columns} x {rows} of {samples}"
            )));
        }
        // Beside the copy of the file and the samples of the image.
        let held = (width * height * jpeg.bytes_per_pixel() + bytes.len()) as u64;
        budget.hold(held)?;
        let pixels = jpeg.samples(budget)?;
        budget.release(held);
        Ok(StripRows {
            bytes: pixels.into(),
            row_bytes: width * channels,
        })
    }

    /// A complete JPEG file: shared tables, and a marker that says whether colors are YCbCr, which
    /// is otherwise guessed.
    fn whole_jpeg(&self, stored: &[u8]) -> Option<Vec<u8>> {
        const START_OF_IMAGE: [u8; 2] = [0xff, 0xd8];
        const END_OF_IMAGE: [u8; 2] = [0xff, 0xd9];
        let body = stored.strip_prefix(&START_OF_IMAGE)?;
        let tables = self.jpeg_tables.unwrap_or_default();
        let tables = tables.strip_prefix(&START_OF_IMAGE).unwrap_or(tables);
        let tables = tables.strip_suffix(&END_OF_IMAGE).unwrap_or(tables);
        let transform = u8::from(self.color == Color::YCbCr);
        let adobe = [
            b"\xff\xee\0\x0eAdobe\0\x64\0\0\0\0".as_slice(),
            &[transform],
        ]
        .concat();
        let adobe = if self.chunk_samples == 1 {
            &[][..]
        } else {
            &adobe
        };
        Some([&START_OF_IMAGE, adobe, tables, body].concat())
    }
}

/// Bytes that are decompressed between two looks at the time.
const BYTES_BETWEEN_CHECKS: usize = 1 << 16;

/// At most `wanted` bytes of LZW.
fn lzw(stored: &[u8], wanted: usize, budget: &ReadBudget) -> Result<Vec<u8>, FrameError> {
    use weezl::decode::Configuration;
    use weezl::{BitOrder, LzwStatus};
    let configuration = Configuration::with_tiff_size_switch(BitOrder::Msb, 8);
    let mut decoder = configuration.with_yield_on_full_buffer(true).build();
    let mut bytes = vec![0; wanted];
    let (mut read, mut written) = (0, 0);
    while written < wanted {
        budget.check_time()?;
        let end = wanted.min(written + BYTES_BETWEEN_CHECKS);
        let step = decoder.decode_bytes(&stored[read..], &mut bytes[written..end]);
        read += step.consumed_in;
        written += step.consumed_out;
        match step.status {
            Ok(LzwStatus::Ok) => {}
            Ok(LzwStatus::Done | LzwStatus::NoProgress) => break,
            Err(error) => return Err(malformed(format!("LZW: {error}"))),
        }
    }
    bytes.truncate(written);
    Ok(bytes)
}

/// At most `wanted` bytes of a zlib stream.
fn deflate(stored: &[u8], wanted: usize, budget: &ReadBudget) -> Result<Vec<u8>, FrameError> {
    let mut bytes = Vec::with_capacity(wanted);
    let decoder = flate2::read::ZlibDecoder::new(budget.timed(stored));
    match decoder.take(wanted as u64).read_to_end(&mut bytes) {
        // What is missing is reported by its length.
        Err(e) if e.kind() != std::io::ErrorKind::UnexpectedEof => {
            Err(budget.why(malformed(format!("deflate: {e}"))))
        }
        _ => Ok(bytes),
    }
}

/// At most `wanted` bytes of PackBits (TIFF 6.0, sect. 9).
fn pack_bits(mut stored: &[u8], wanted: usize) -> Vec<u8> {
    /// Longest run.
    const MAX_RUN: usize = 128;
    let mut bytes = Vec::with_capacity(wanted + MAX_RUN);
    while let Some((&header, rest)) = stored.split_first()
        && bytes.len() < wanted
    {
        stored = rest;
        match header as i8 {
            i8::MIN => {}
            literal @ 0.. => {
                let run = &stored[..stored.len().min(literal as usize + 1)];
                bytes.extend(run);
                stored = &stored[run.len()..];
            }
            repeats => {
                let Some((&value, rest)) = stored.split_first() else {
                    break;
                };
                bytes.resize(bytes.len() + 1 + usize::from(repeats.unsigned_abs()), value);
                stored = rest;
            }
        }
    }
    bytes.truncate(wanted);
    bytes
}

/// Rows of one bit per pixel in CCITT group 4; black is 1, as libtiff has it.
fn group_4(stored: &[u8], size: Size, budget: &ReadBudget) -> Result<Vec<u8>, FrameError> {
    use fax::Color::Black;
    use fax::decoder::{DecodeStatus, Group4Decoder, pels};
    let fail = |detail: String| malformed(format!("CCITT group 4: {detail}"));
    let Size {
        width,
        height: rows,
    } = size;
    let width = u16::try_from(width).map_err(|_| fail(format!("{width} columns")))?;
    let input = stored.iter().map(|byte| std::io::Result::Ok(*byte));
    let mut decoder = Group4Decoder::new(input, width).map_err(|e| fail(e.to_string()))?;
    let mut bytes = Vec::with_capacity(rows * usize::from(width).div_ceil(8));
    for _ in 0..rows {
        budget.check_time()?;
        match decoder.advance().map_err(|e| fail(e.to_string()))? {
            DecodeStatus::End => break,
            DecodeStatus::Incomplete => {
                let row: Vec<bool> = pels(decoder.transition(), width)
                    .map(|color| color == Black)
                    .collect();
                let byte = |bits: &[bool]| {
                    let bits = bits.iter().enumerate();
                    bits.fold(0, |byte, (i, bit)| byte | u8::from(*bit) << (7 - i))
                };
                bytes.extend(row.chunks(8).map(byte));
            }
        }
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pack_bits_of_the_standard_s_example_are_unpacked() {
        let packed = b"\xfe\xaa\x02\x80\x00\x2a\xfd\xaa\x03\x80\x00\x2a\x22\xf7\xaa";
        let unpacked = [
            &[0xaa; 3][..],
            &[0x80, 0, 0x2a],
            &[0xaa; 4],
            &[0x80, 0, 0x2a, 0x22],
            &[0xaa; 10],
        ]
        .concat();
        assert_eq!(pack_bits(packed, 24), unpacked);
        assert_eq!(pack_bits(packed, 5), unpacked[..5]);
        for end in 0..packed.len() {
            assert!(unpacked.starts_with(&pack_bits(&packed[..end], 24)));
        }
    }
}
