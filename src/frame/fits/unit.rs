//! The header-data units of a file.

use super::error::truncated;
use super::header::{BLOCK_BYTES, UnitHeader};
use super::layout::FitsLayout;
use crate::frame::{FrameError, IgnoredValue};
use std::ops::RangeInclusive;

/// Iterates over the header-data units of a file.
pub(super) struct Units<'a> {
    bytes: &'a [u8],
    /// Offset of the next unit.
    next: usize,
    /// End of the data of the last unit, without padding.
    end: usize,
}

impl<'a> Units<'a> {
    /// The units in `bytes`, the content of a file.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self {
            bytes,
            next: 0,
            end: 0,
        }
    }

    /// The next unit, `None` after the last.
    pub fn next(&mut self) -> Result<Option<FitsUnit<'a>>, FrameError> {
        if self.end > self.bytes.len() {
            let detail = format!("the data before the next header end at byte {}", self.end);
            return Err(truncated(self.bytes.len(), detail));
        }
        let at = self.next;
        let rest = self.bytes.get(at..).unwrap_or_default();
        // Anything other than an extension ends the file.
        if at > 0 && !rest.starts_with(b"XTENSION") {
            return Ok(None);
        }
        let (header, data) = UnitHeader::parse(self.bytes, at)?;
        let unit = FitsUnit::new(header, data)?;
        self.end = unit.end();
        // Headers and data are padded to whole blocks.
        let next = self.end.checked_next_multiple_of(BLOCK_BYTES);
        self.next = next.unwrap_or(usize::MAX);
        Ok(Some(unit))
    }
}

/// Type of the stored values (BITPIX).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum StoredType {
    U8,
    I16,
    I32,
    I64,
    F32,
    F64,
}

impl StoredType {
    fn parse(header: &UnitHeader, keyword: &str) -> Result<Self, FrameError> {
        const EXPECTED: &str = "8, 16, 32, 64, -32 or -64";
        Ok(match header.required(keyword, EXPECTED)? {
            8 => Self::U8,
            16 => Self::I16,
            32 => Self::I32,
            64 => Self::I64,
            -32 => Self::F32,
            -64 => Self::F64,
            _ => return Err(header.invalid(keyword, EXPECTED)),
        })
    }

    /// Size of a value, in bytes.
    pub fn bytes(self) -> usize {
        match self {
            Self::U8 => 1,
            Self::I16 => 2,
            Self::I32 | Self::F32 => 4,
            Self::I64 | Self::F64 => 8,
        }
    }

    pub fn is_float(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }

    /// The stored whole numbers; quantized floats are stored as numbers of 32 bits.
    fn range(self) -> RangeInclusive<i64> {
        match self {
            Self::U8 => 0..=u8::MAX.into(),
            Self::I16 => i16::MIN.into()..=i16::MAX.into(),
            Self::I32 | Self::F32 | Self::F64 => i32::MIN.into()..=i32::MAX.into(),
            Self::I64 => i64::MIN..=i64::MAX,
        }
    }
}

/// One header-data unit.
pub(super) struct FitsUnit<'a> {
    pub header: UnitHeader<'a>,
    /// Offset of the data in the file.
    pub data: usize,
    /// Type of the values of the image, compressed or not.
    pub stored: StoredType,
    /// NAXIS1, NAXIS2, …; of a compressed image ZNAXIS1, ZNAXIS2, …
    pub axes: Vec<usize>,
    /// The axes of the table that holds a compressed image; none for other units.
    pub table: Vec<usize>,
    /// Size of the data without padding, in bytes; `None` on overflow.
    data_bytes: Option<usize>,
}

impl<'a> FitsUnit<'a> {
    fn new(header: UnitHeader<'a>, data: usize) -> Result<Self, FrameError> {
        let stored = StoredType::parse(&header, "BITPIX")?;
        let axes = axes(&header, "NAXIS")?;
        let data_bytes = data_bytes(&header, &axes, stored);
        let (stored, axes, table) = if header.is_true("ZIMAGE") {
            let stored = StoredType::parse(&header, "ZBITPIX")?;
            (stored, self::axes(&header, "ZNAXIS")?, axes)
        } else {
            (stored, axes, Vec::new())
        };
        Ok(Self {
            header,
            data,
            stored,
            axes,
            table,
            data_bytes,
        })
    }

    /// Offset of the end of the data in the file, without padding.
    pub fn end(&self) -> usize {
        let end = self
            .data_bytes
            .and_then(|length| self.data.checked_add(length));
        end.unwrap_or(usize::MAX)
    }

    pub fn is_table(&self) -> bool {
        let kind = self.header.text("XTENSION");
        !self.is_compressed_image() && kind.is_some_and(|kind| kind.ends_with("TABLE"))
    }

    /// Whether the unit is a tile-compressed image, which is stored as a table.
    pub fn is_compressed_image(&self) -> bool {
        self.header.is_true("ZIMAGE")
    }

    /// The stored integer that marks a pixel without a value: BLANK, in compressed images ZBLANK too.
    pub fn blank(&self) -> Option<i64> {
        let mut keywords = self.blank_keywords().iter();
        keywords.find_map(|keyword| self.blank_of(keyword)?.ok())
    }

    /// The values of BLANK and ZBLANK that no pixel of this type can have.
    pub fn ignored_blanks(&self) -> impl Iterator<Item = IgnoredValue> {
        let is_used = self.is_compressed_image() || !self.stored.is_float();
        let keywords = self.blank_keywords().iter().filter(move |_| is_used);
        keywords.filter_map(|keyword| self.blank_of(keyword)?.err())
    }

    fn blank_keywords(&self) -> &'static [&'static str] {
        if self.is_compressed_image() {
            &["ZBLANK", "BLANK"]
        } else {
            &["BLANK"]
        }
    }

    fn blank_of(&self, keyword: &str) -> Option<Result<i64, IgnoredValue>> {
        let found = self.header.text(keyword)?;
        let range = self.stored.range();
        let blank = found.parse().ok().filter(|blank| range.contains(blank));
        Some(blank.ok_or_else(|| IgnoredValue {
            keyword: keyword.to_owned(),
            expected: format!("a whole number from {} to {}", range.start(), range.end()),
            found: found.into_owned(),
        }))
    }

    /// How the values are arranged; `None` if the unit is no image.
    pub fn layout(&self) -> Option<FitsLayout> {
        let kind = self.header.text("XTENSION");
        let is_image = self.is_compressed_image() || kind.is_none_or(|kind| kind == "IMAGE");
        FitsLayout::from_axes(&self.axes).filter(|_| is_image)
    }

    /// Number of images in it: none, one, or the planes of a cube.
    pub fn pages(&self) -> usize {
        self.layout().map_or(0, |layout| layout.pages)
    }
}

/// The lengths of the axes, whose number `keyword` says: NAXIS and NAXIS1, NAXIS2, …
fn axes(header: &UnitHeader, keyword: &str) -> Result<Vec<usize>, FrameError> {
    /// The standard allows 999. NumPy, which most files are written with, has no arrays of more.
    const MAX_AXES: i64 = 32;
    let expected = "a number of axes from 0 to 32";
    let count = header.required(keyword, expected)?;
    if !(0..=MAX_AXES).contains(&count) {
        return Err(header.invalid(keyword, expected));
    }
    let axis = |number: i64| {
        let keyword = format!("{keyword}{number}");
        let expected = "a length of 0 or more";
        let length = header.required(&keyword, expected)?;
        usize::try_from(length).map_err(|_| header.invalid(&keyword, expected))
    };
    (1..=count).map(axis).collect()
}

/// Size of the data without padding, in bytes; `None` on overflow.
fn data_bytes(header: &UnitHeader, axes: &[usize], stored: StoredType) -> Option<usize> {
    let count = |keyword: &str, default: usize| {
        let found = header.optional(keyword, "a count").ok().flatten();
        found
            .and_then(|n| usize::try_from(n).ok())
            .unwrap_or(default)
    };
    if axes.is_empty() {
        return Some(0);
    }
    product(axes)?
        .checked_add(count("PCOUNT", 0))?
        .checked_mul(count("GCOUNT", 1))?
        .checked_mul(stored.bytes())
}

fn product(lengths: &[usize]) -> Option<usize> {
    lengths.iter().try_fold(1, |n: usize, &l| n.checked_mul(l))
}
