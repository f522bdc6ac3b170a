//! Decodes and validates a catalogue.

use super::identifiers::IdEncoding;
use super::layout::{
    BYTES_PER_NAME, BYTES_PER_STAR, CHECKSUM_BYTES, HEADER_BYTES, MAGIC, UNKNOWN_COLOR_MMAG,
    VERSION_ANY_ID, VERSION_SKYMAP, checksum_of,
};
use super::reader::{ByteReader, invalid};
use crate::catalog::contents::{Contents, StarName};
use crate::catalog::error::{CompactError, quoted};
use crate::catalog::position::Position;
use crate::catalog::star::mag_from_mmag;
use crate::catalog::{Star, StarFlags};
use rayon::prelude::*;
use xxhash_rust::xxh3::xxh3_64;

/// Decodes a compact catalogue.
///
/// # Errors
/// [`CompactError`] for anything that [`encode`](fn@super::encode) does not write: another version,
/// a wrong length or checksum, a value out of range, stars or names out of order.
pub(in crate::catalog) fn decode(bytes: &[u8]) -> Result<Contents, CompactError> {
    let header = CompactHeader::read(bytes)?;
    header.check_length(bytes)?;
    check_checksum(bytes)?;

    let mut input = ByteReader {
        bytes,
        at: HEADER_BYTES,
    };
    let title = input.text(header.title_bytes, "a title in UTF-8")?;
    Ok(Contents {
        title: title.to_owned(),
        epoch_year: header.epoch_year,
        stars: decode_stars(&mut input, &header)?,
        names: decode_names(&mut input, &header)?,
    })
}

/// What the beginning of a compact catalogue says.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::catalog) struct CompactSummary {
    pub(in crate::catalog) title: String,
    pub(in crate::catalog) epoch_year: f64,
    pub(in crate::catalog) stars: u64,
}

impl CompactSummary {
    /// What `head` says; `None` where it is not the beginning of one, with the whole title.
    pub(in crate::catalog) fn of_head(head: &[u8]) -> Option<Self> {
        let header = CompactHeader::read(head).ok()?;
        let title = head.get(HEADER_BYTES..HEADER_BYTES + header.title_bytes)?;
        Some(Self {
            title: String::from_utf8(title.to_owned()).ok()?,
            epoch_year: header.epoch_year,
            stars: header.stars as u64,
        })
    }
}

struct CompactHeader {
    ids: IdEncoding,
    stars: usize,
    names: usize,
    title_bytes: usize,
    text_bytes: usize,
    epoch_year: f64,
}

impl CompactHeader {
    fn read(bytes: &[u8]) -> Result<Self, CompactError> {
        let Some(header) = bytes.first_chunk::<HEADER_BYTES>() else {
            return invalid(bytes.len(), "the end of the file", "a header of 36 bytes");
        };
        if !header.starts_with(&MAGIC) {
            let expected = format!("the signature {}", quoted(&MAGIC));
            return invalid(0, quoted(&header[..MAGIC.len()]), expected);
        }
        let mut input = ByteReader {
            bytes: header,
            at: MAGIC.len(),
        };
        let version = u32::from_le_bytes(input.take());
        if ![VERSION_SKYMAP, VERSION_ANY_ID].contains(&version) {
            let expected = format!("version {VERSION_SKYMAP} or {VERSION_ANY_ID}");
            return invalid(MAGIC.len(), format!("version {version}"), expected);
        }
        let [stars, names, title_bytes, text_bytes] =
            [(); 4].map(|()| u32::from_le_bytes(input.take()) as usize);
        let epoch_year = f64::from_le_bytes(input.take());
        let ids = if version == VERSION_SKYMAP {
            IdEncoding::Skymap
        } else {
            Self::id_width(bytes, HEADER_BYTES + title_bytes)?
        };
        Ok(Self {
            ids,
            stars,
            names,
            title_bytes,
            text_bytes,
            epoch_year,
        })
    }

    /// The encoding of identifiers of version 2; their width is at byte `at`.
    fn id_width(bytes: &[u8], at: usize) -> Result<IdEncoding, CompactError> {
        let Some(width) = bytes.get(at..).and_then(<[u8]>::first_chunk) else {
            return invalid(bytes.len(), "the end of the file", "a title");
        };
        match u32::from_le_bytes(*width) {
            4 => Ok(IdEncoding::Any { value_bytes: 4 }),
            8 => Ok(IdEncoding::Any { value_bytes: 8 }),
            other => invalid(at, format!("identifiers of {other} bytes"), "4 or 8 bytes"),
        }
    }

    fn check_length(&self, bytes: &[u8]) -> Result<(), CompactError> {
        let expected = (HEADER_BYTES + CHECKSUM_BYTES) as u64
            + self.ids.length(self.stars)
            + self.stars as u64 * BYTES_PER_STAR
            + self.names as u64 * BYTES_PER_NAME
            + self.title_bytes as u64
            + self.text_bytes as u64;
        if bytes.len() as u64 == expected {
            return Ok(());
        }
        let (found, expected) = (
            format!("the end of a file of {} bytes", bytes.len()),
            format!("{expected} bytes for {} stars", self.stars),
        );
        invalid(bytes.len(), found, expected)
    }
}

fn check_checksum(bytes: &[u8]) -> Result<(), CompactError> {
    let payload = &bytes[..bytes.len() - CHECKSUM_BYTES];
    let (computed, stored) = (xxh3_64(payload), checksum_of(bytes));
    if computed == stored {
        return Ok(());
    }
    let found = format!("the checksum {stored:016x}");
    let expected = format!("{computed:016x}, computed from the content: the file is damaged");
    invalid(payload.len(), found, expected)
}

fn decode_stars(input: &mut ByteReader, header: &CompactHeader) -> Result<Vec<Star>, CompactError> {
    let count = header.stars;
    let ids = header.ids.decode(input, count)?;
    let (ra_at, ras) = (input.at, input.column::<4>(count));
    let decs = input.column::<4>(count);
    let pm_ras = input.column::<2>(count);
    let pm_decs = input.column::<2>(count);
    let (v_at, vs) = (input.at, input.column::<2>(count));
    let colors = input.column::<2>(count);
    let flags = input.column::<1>(count);

    let order = |i: usize| (i16::from_le_bytes(vs[i]), ids[i]);
    let star = |i: usize| {
        let (v_mmag, id) = order(i);
        if i > 0 && order(i - 1) >= (v_mmag, id) {
            let expected = "stars ordered by magnitude, then identifier";
            return invalid(v_at + 2 * i, format!("star {i} out of order"), expected);
        }
        let (ra_steps, dec_steps) = (u32::from_le_bytes(ras[i]), i32::from_le_bytes(decs[i]));
        let Some(position) = Position::new(ra_steps, dec_steps) else {
            let found = format!("star {i} at ({ra_steps}, {dec_steps})");
            return invalid(ra_at + 4 * i, found, "a position on the sphere, in 0.5 mas");
        };
        let bv_mmag = i16::from_le_bytes(colors[i]);
        Ok(Star {
            id,
            direction: position.direction(),
            pm_ra_mas_per_yr: f32::from(i16::from_le_bytes(pm_ras[i])),
            pm_dec_mas_per_yr: f32::from(i16::from_le_bytes(pm_decs[i])),
            v_mag: mag_from_mmag(v_mmag),
            bv_mag: (bv_mmag != UNKNOWN_COLOR_MMAG).then(|| mag_from_mmag(bv_mmag)),
            flags: StarFlags::from_bits(flags[i][0]),
        })
    };
    let stars: Result<Vec<Star>, CompactError> = (0..count).into_par_iter().map(star).collect();
    // Of several errors the first is returned, on any number of threads.
    stars.or_else(|_| (0..count).map(star).collect())
}

fn decode_names(
    input: &mut ByteReader,
    header: &CompactHeader,
) -> Result<Vec<StarName>, CompactError> {
    let (indices_at, indices) = (input.at, input.column::<4>(header.names));
    let lengths = input.column::<1>(header.names);
    let mut names: Vec<StarName> = Vec::with_capacity(header.names);
    let end = input.at + header.text_bytes;
    for (i, (index, length)) in indices.iter().zip(lengths).enumerate() {
        let star_index = u32::from_le_bytes(*index);
        let ascending = names.last().is_none_or(|last| last.star_index < star_index);
        if !ascending || star_index as usize >= header.stars {
            let found = format!("name {i} of star {star_index}");
            return invalid(indices_at + 4 * i, found, "ascending indices of stars");
        }
        let length = usize::from(length[0]);
        if length > end - input.at {
            return invalid(
                input.at,
                "the end of the names",
                format!("{length} more bytes"),
            );
        }
        names.push(StarName {
            star_index,
            text: input.text(length, "a name in UTF-8")?.into(),
        });
    }
    if input.at != end {
        return invalid(input.at, "text after the last name", "the checksum");
    }
    Ok(names)
}
