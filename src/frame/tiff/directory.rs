//! The directories of a TIFF file, each of which describes one image: tags and their values.
//!
//! # Reference
//! TIFF 6.0 (1992), sect. 2; BigTIFF as in libtiff.

use crate::frame::error::FrameError;
use crate::frame::format::FrameFormat;
use std::collections::HashSet;

/// Most tags of a directory: as many as there are numbers for them.
const MAX_TAGS: u64 = 1 << 16;

/// A TIFF file, of which directories can be read.
#[derive(Clone, Copy)]
pub(in crate::frame) struct TiffFile<'a> {
    pub bytes: &'a [u8],
    pub is_little_endian: bool,
    /// BigTIFF: counts and offsets of 64 bits.
    is_big: bool,
}

/// A directory: one image and what is known of it.
#[derive(Clone, Copy)]
pub(in crate::frame) struct TiffDirectory<'a> {
    pub file: TiffFile<'a>,
    /// Its first byte in the file.
    pub place: u64,
    entries: &'a [u8],
    /// Place of the next directory in the file; 0 if this is the last one.
    next: u64,
}

/// The value of a tag.
struct TagValue<'a> {
    kind: u16,
    data: &'a [u8],
}

/// The unsigned numbers of a tag, as they are stored.
#[derive(Clone, Copy, Default)]
pub(in crate::frame) struct TagNumbers<'a> {
    data: &'a [u8],
    /// Bytes of each; 0 if there are none.
    size: usize,
    is_little_endian: bool,
}

impl<'a> TagNumbers<'a> {
    pub fn len(self) -> usize {
        self.data.len().checked_div(self.size).unwrap_or(0)
    }

    pub fn get(self, index: usize) -> Option<u64> {
        let start = index.checked_mul(self.size).filter(|_| self.size > 0)?;
        let bytes = self.data.get(start..)?.get(..self.size)?;
        Some(number(bytes, self.is_little_endian))
    }

    pub fn iter(self) -> impl Iterator<Item = u64> + 'a {
        (0..self.len()).filter_map(move |index| self.get(index))
    }
}

impl<'a> TiffFile<'a> {
    /// The file in `bytes`.
    /// # Errors
    /// [`FrameError::Malformed`] for other formats, [`FrameError::Truncated`].
    pub fn parse(bytes: &'a [u8]) -> Result<Self, FrameError> {
        let (is_little_endian, is_big) = match bytes.first_chunk() {
            Some(b"II*\0") => (true, false),
            Some(b"MM\0*") => (false, false),
            Some(b"II+\0") => (true, true),
            Some(b"MM\0+") => (false, true),
            _ => return Err(malformed("no TIFF header at byte 0".to_owned())),
        };
        Ok(Self {
            bytes,
            is_little_endian,
            is_big,
        })
    }

    /// All directories in the order of the file. The last item is an error if a directory cannot be
    /// read, which hides what comes after it.
    pub fn directories(self) -> impl Iterator<Item = Result<TiffDirectory<'a>, FrameError>> {
        let first = if self.is_big {
            self.number(8, 8)
        } else {
            self.number(4, 4)
        };
        let mut seen = HashSet::new();
        let mut next = first;
        std::iter::from_fn(move || {
            let place = match std::mem::replace(&mut next, Ok(0)) {
                Ok(0) => return None,
                Ok(place) => place,
                Err(error) => return Some(Err(error)),
            };
            if !seen.insert(place) {
                let detail =
                    format!("the chain of directories leads back to the one at byte {place}");
                return Some(Err(malformed(detail)));
            }
            let directory = self.directory(place);
            if let Ok(directory) = &directory {
                next = Ok(directory.next);
            }
            Some(directory)
        })
    }

    /// The directory at byte `place`.
    /// # Errors
    /// [`FrameError::Truncated`].
    pub fn directory(self, place: u64) -> Result<TiffDirectory<'a>, FrameError> {
        let (count_bytes, entry_bytes, next_bytes) =
            if self.is_big { (8, 20, 8) } else { (2, 12, 4) };
        let count = self.number(place, count_bytes)?;
        if count > MAX_TAGS {
            let detail = format!("{count} tags at byte {place}, expected at most {MAX_TAGS}");
            return Err(malformed(detail));
        }
        let start = place.saturating_add(count_bytes);
        let length = count.saturating_mul(entry_bytes);
        let entries = self.range(start, length)?;
        let next = self.number(start + length, next_bytes);
        Ok(TiffDirectory {
            file: self,
            place,
            entries,
            // Some writers leave it out at the end of the file.
            next: next.unwrap_or(0),
        })
    }

    /// The `length` bytes from `start` on.
    /// # Errors
    /// [`FrameError::Truncated`].
    pub fn range(self, start: u64, length: u64) -> Result<&'a [u8], FrameError> {
        let found = usize::try_from(start)
            .ok()
            .zip(usize::try_from(length).ok())
            .and_then(|(start, length)| self.bytes.get(start..start.checked_add(length)?));
        found.ok_or_else(|| truncated(self.bytes, format!("{length} bytes from byte {start} on")))
    }

    fn number(self, start: u64, length: u64) -> Result<u64, FrameError> {
        let bytes = self.range(start, length)?;
        Ok(number(bytes, self.is_little_endian))
    }
}

/// The unsigned number that up to eight bytes hold.
pub(super) fn number(bytes: &[u8], is_little_endian: bool) -> u64 {
    let append = |number: u64, byte: &u8| number << 8 | u64::from(*byte);
    if is_little_endian {
        bytes.iter().rev().fold(0, append)
    } else {
        bytes.iter().fold(0, append)
    }
}

impl<'a> TiffDirectory<'a> {
    /// Whether the directory has the tag.
    pub fn has(&self, tag: u16) -> bool {
        self.found(tag).is_some()
    }

    /// The bytes of a tag's value, of whatever type.
    /// # Errors
    /// [`FrameError::Truncated`].
    pub fn bytes_of(&self, tag: u16) -> Result<Option<&'a [u8]>, FrameError> {
        Ok(self.entry(tag)?.map(|entry| entry.data))
    }

    /// The unsigned numbers of a tag; none if it is absent.
    /// # Errors
    /// [`FrameError::Malformed`] if they are no unsigned numbers, [`FrameError::Truncated`].
    pub fn numbers(&self, tag: u16) -> Result<TagNumbers<'a>, FrameError> {
        let Some(TagValue { kind, data }) = self.entry(tag)? else {
            return Ok(TagNumbers::default());
        };
        let size = match kind {
            BYTE | SHORT | LONG | IFD | LONG8 | IFD8 => size_of_kind(kind),
            _ => {
                let detail = format!("tag {tag} is of type {kind}, expected unsigned numbers");
                return Err(malformed(detail));
            }
        };
        Ok(TagNumbers {
            data,
            size,
            is_little_endian: self.file.is_little_endian,
        })
    }

    /// The first number of a tag; `default` if it is absent or empty.
    /// # Errors
    /// As [`Self::numbers`].
    pub fn first(&self, tag: u16, default: u64) -> Result<u64, FrameError> {
        Ok(self.numbers(tag)?.get(0).unwrap_or(default))
    }

    /// The twelve or twenty bytes that describe a tag.
    fn found(&self, tag: u16) -> Option<&'a [u8]> {
        let entry_bytes = if self.file.is_big { 20 } else { 12 };
        let is_little_endian = self.file.is_little_endian;
        let is_it = |entry: &&[u8]| number(&entry[..2], is_little_endian) == u64::from(tag);
        self.entries.chunks_exact(entry_bytes).find(is_it)
    }

    fn entry(&self, tag: u16) -> Result<Option<TagValue<'a>>, FrameError> {
        let Some(entry) = self.found(tag) else {
            return Ok(None);
        };
        let is_little_endian = self.file.is_little_endian;
        let kind = number(&entry[2..4], is_little_endian) as u16;
        let (count, value) = entry[4..].split_at((entry.len() - 4) / 2);
        let count = number(count, is_little_endian);
        let length = count.saturating_mul(size_of_kind(kind) as u64);
        let data = match usize::try_from(length).ok().and_then(|n| value.get(..n)) {
            Some(data) => data,
            None => self.file.range(number(value, is_little_endian), length)?,
        };
        Ok(Some(TagValue { kind, data }))
    }
}

const BYTE: u16 = 1;
const SHORT: u16 = 3;
const LONG: u16 = 4;
const IFD: u16 = 13;
const LONG8: u16 = 16;
const IFD8: u16 = 18;

/// Bytes of one value of a type.
fn size_of_kind(kind: u16) -> usize {
    match kind {
        SHORT | 8 => 2,
        LONG | IFD | 9 | 11 => 4,
        5 | 10 | 12 | LONG8 | 17 | IFD8 => 8,
        _ => 1,
    }
}

pub(super) fn malformed(detail: String) -> FrameError {
    FrameError::Malformed {
        format: FrameFormat::Tiff,
        detail,
    }
}

pub(super) fn truncated(bytes: &[u8], detail: String) -> FrameError {
    FrameError::Truncated {
        format: FrameFormat::Tiff,
        found_bytes: bytes.len(),
        detail,
    }
}
