//! The compact form: a whole catalogue in 21 or 22 bytes a star, decoded in milliseconds.
//!
//! All numbers are little-endian. In order, without gaps (n stars, m names):
//!
//! | Bytes | Content |
//! |---|---|
//! | 8 | [`MAGIC`] |
//! | 4 | version, `u32`: 1 or 2 |
//! | 4, 4 | n and m, `u32` each |
//! | 4, 4 | bytes of the title and of all name texts, `u32` each |
//! | 8 | epoch of the positions, Julian year, `f64` |
//! | … | title, UTF-8 |
//! | 4 n | Skymap number, `u32` (version 1); or identifier, see below (version 2) |
//! | 4 n | right ascension, 0.5 mas, `u32` |
//! | 4 n | declination, 0.5 mas, `i32` |
//! | 2 n | proper motion in right ascension times cos(declination), mas a year, `i16` |
//! | 2 n | proper motion in declination, mas a year, `i16` |
//! | 2 n | V, 0.001 mag, `i16` |
//! | 2 n | B−V, 0.001 mag, `i16`; −32768 where unknown |
//! | n | flags ([`StarFlags`]) |
//! | 4 m | index of the star named, `u32`, ascending |
//! | m | bytes of the name, `u8` |
//! | … | the names, UTF-8, one after the other |
//! | 8 | XXH3-64 of everything before, `u64` |
//!
//! A catalogue of Skymap numbers alone is written as version 1. In version 2 there stands, in place of
//! the numbers: how many bytes a value has, `u32`, 4 or 8; n bytes, the kind of each star's identifier
//! (0 Skymap, 1 Tycho, 2 Hipparcos, 3 another number, 4 none but the name); n values. A Tycho value is
//! the region, star and component in 14, 14 and 4 bits, a Hipparcos value the number and 8 bits for
//! the component's letter.
//!
//! Columns rather than records: they pack better under gzip, and what is checked is checked a column
//! at a time. Stars are ordered by (V, number), so the stars down to a magnitude are a prefix.
//!
//! Caveat: proper motions are rounded to 1 mas a year, 13 mas after 26 years. Positions, magnitudes
//! and colours of SKY2000 are kept exactly.

use super::error::{CompactFault, quoted};
use super::position::GridPosition;
use super::star::{mag_from_mmag, mmag};
use super::{Contents, Name, Star, StarFlags, StarId};
use rayon::prelude::*;
use xxhash_rust::xxh3::xxh3_64;

/// The first bytes of every compact catalogue; not text, so that it is never taken for a table.
pub(super) const MAGIC: [u8; 8] = *b"\x89STARCAT";
/// The version of catalogues in which every identifier is a Skymap number.
const VERSION_SKYMAP: u32 = 1;
/// The version of all others.
const VERSION_ANY_ID: u32 = 2;

const HEADER_BYTES: usize = 36;
/// Without the identifier.
const BYTES_PER_STAR: u64 = 17;
const BYTES_PER_NAME: u64 = 5;
const CHECKSUM_BYTES: usize = 8;
const UNKNOWN_COLOR_MMAG: i16 = i16::MIN;

/// The compact form of `contents`, whose stars are in order and in range (see `Contents::validate`).
pub(super) fn encode(contents: &Contents) -> Vec<u8> {
    let (stars, names) = (&contents.stars, &contents.names);
    let text_bytes: usize = names.iter().map(|name| name.text.len()).sum();
    let count = |n: usize| u32::try_from(n).expect("validated: fewer than 2³² stars and bytes");

    let mut out = Vec::with_capacity(HEADER_BYTES + stars.len() * 21 + text_bytes + 64);
    out.extend(MAGIC);
    let ids = Ids::of(stars);
    out.extend(ids.version().to_le_bytes());
    for n in [stars.len(), names.len(), contents.title.len(), text_bytes] {
        out.extend(count(n).to_le_bytes());
    }
    out.extend(contents.epoch_year.to_le_bytes());
    out.extend(contents.title.as_bytes());

    ids.encode(stars, &mut out);
    let positions: Vec<GridPosition> = stars
        .par_iter()
        .map(|star| GridPosition::nearest(&star.direction))
        .collect();
    let mut column_u32 = |values: &mut dyn Iterator<Item = u32>| {
        values.for_each(|value| out.extend(value.to_le_bytes()));
    };
    column_u32(&mut positions.iter().map(|position| position.ra_steps()));
    column_u32(
        &mut positions
            .iter()
            .map(|position| position.dec_steps().cast_unsigned()),
    );
    let mut column_i16 = |values: &mut dyn Iterator<Item = i16>| {
        values.for_each(|value| out.extend(value.to_le_bytes()));
    };
    column_i16(
        &mut stars
            .iter()
            .map(|star| star.pm_ra_mas_per_yr.round() as i16),
    );
    column_i16(
        &mut stars
            .iter()
            .map(|star| star.pm_dec_mas_per_yr.round() as i16),
    );
    column_i16(&mut stars.iter().map(|star| mmag(star.v_mag)));
    column_i16(
        &mut stars
            .iter()
            .map(|star| star.bv_mag.map_or(UNKNOWN_COLOR_MMAG, mmag)),
    );
    out.extend(stars.iter().map(|star| star.flags.bits()));

    names
        .iter()
        .for_each(|name| out.extend(name.star_index.to_le_bytes()));
    out.extend(names.iter().map(|name| name.text.len() as u8));
    names
        .iter()
        .for_each(|name| out.extend(name.text.as_bytes()));
    let checksum = xxh3_64(&out);
    out.extend(checksum.to_le_bytes());
    out
}

/// The checksum at the end of a compact catalogue.
pub(super) fn checksum_of(encoded: &[u8]) -> u64 {
    encoded
        .last_chunk()
        .map_or(0, |bytes| u64::from_le_bytes(*bytes))
}

/// What is in a compact catalogue.
///
/// # Errors
/// [`CompactFault`] for anything that [`encode`] does not write: another version, a file cut short
/// or too long, a wrong checksum, a value out of range, stars or names out of order.
pub(super) fn decode(bytes: &[u8]) -> Result<Contents, CompactFault> {
    let header = Header::read(bytes)?;
    header.check_length(bytes)?;
    check_checksum(bytes)?;

    let mut input = Input {
        bytes,
        at: HEADER_BYTES,
    };
    let title = input
        .text(header.title_bytes, "a title in UTF-8")?
        .to_owned();
    let stars = decode_stars(&mut input, &header)?;
    let names = decode_names(&mut input, &header)?;
    Ok(Contents {
        title,
        epoch_year: header.epoch_year,
        stars,
        names,
    })
}

/// How identifiers are written.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Ids {
    Skymap,
    Any { value_bytes: usize },
}

impl Ids {
    /// The shortest way for `stars`.
    fn of(stars: &[Star]) -> Self {
        let raw = || stars.iter().map(|star| star.id.to_raw());
        if raw().all(|(kind, _)| kind == 0) {
            return Self::Skymap;
        }
        let short = raw().all(|(_, value)| u32::try_from(value).is_ok());
        Self::Any {
            value_bytes: if short { 4 } else { 8 },
        }
    }

    fn version(self) -> u32 {
        match self {
            Self::Skymap => VERSION_SKYMAP,
            Self::Any { .. } => VERSION_ANY_ID,
        }
    }

    /// The bytes of `count` identifiers.
    fn length(self, count: usize) -> u64 {
        match self {
            Self::Skymap => 4 * count as u64,
            Self::Any { value_bytes } => 4 + (1 + value_bytes as u64) * count as u64,
        }
    }

    fn encode(self, stars: &[Star], out: &mut Vec<u8>) {
        let mut value_bytes = 4;
        if let Self::Any { value_bytes: bytes } = self {
            value_bytes = bytes;
            out.extend((bytes as u32).to_le_bytes());
            out.extend(stars.iter().map(|star| star.id.to_raw().0));
        }
        for star in stars {
            out.extend(&star.id.to_raw().1.to_le_bytes()[..value_bytes]);
        }
    }

    fn decode(self, input: &mut Input, count: usize) -> Result<Vec<StarId>, CompactFault> {
        let Self::Any { value_bytes } = self else {
            let numbers = input.column::<4>(count).iter();
            return Ok(numbers
                .map(|&number| StarId::Skymap(u32::from_le_bytes(number)))
                .collect());
        };
        input.take::<4>();
        let kinds_at = input.at;
        let kinds = input.column::<1>(count);
        let values: Vec<u64> = if value_bytes == 4 {
            let values = input.column::<4>(count).iter();
            values.map(|&v| u64::from(u32::from_le_bytes(v))).collect()
        } else {
            let values = input.column::<8>(count).iter();
            values.map(|&v| u64::from_le_bytes(v)).collect()
        };
        let pairs = kinds.iter().zip(values).enumerate();
        pairs
            .map(
                |(i, (&[kind], value))| match StarId::from_raw(kind, value) {
                    Some(id) => Ok(id),
                    None => fault(
                        kinds_at + i,
                        format!("an identifier of kind {kind} and value {value}"),
                        "a kind from 0 to 4, and a value that it can have",
                    ),
                },
            )
            .collect()
    }
}

struct Header {
    ids: Ids,
    stars: usize,
    names: usize,
    title_bytes: usize,
    text_bytes: usize,
    epoch_year: f64,
}

impl Header {
    fn read(bytes: &[u8]) -> Result<Self, CompactFault> {
        let Some(header) = bytes.first_chunk::<HEADER_BYTES>() else {
            return fault(bytes.len(), "the end of the file", "a header of 36 bytes");
        };
        if !header.starts_with(&MAGIC) {
            let expected = format!("the mark {}", quoted(&MAGIC));
            return fault(0, quoted(&header[..MAGIC.len()]), expected);
        }
        let mut input = Input {
            bytes: header,
            at: MAGIC.len(),
        };
        let version = u32::from_le_bytes(input.take());
        if ![VERSION_SKYMAP, VERSION_ANY_ID].contains(&version) {
            let expected = format!("version {VERSION_SKYMAP} or {VERSION_ANY_ID}");
            return fault(MAGIC.len(), format!("version {version}"), expected);
        }
        let [stars, names, title_bytes, text_bytes] =
            [(); 4].map(|()| u32::from_le_bytes(input.take()) as usize);
        let epoch_year = f64::from_le_bytes(input.take());
        let ids = if version == VERSION_SKYMAP {
            Ids::Skymap
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

    /// How many bytes an identifier's value has; the number stands at `at`.
    fn id_width(bytes: &[u8], at: usize) -> Result<Ids, CompactFault> {
        let Some(width) = bytes.get(at..).and_then(<[u8]>::first_chunk) else {
            return fault(bytes.len(), "the end of the file", "a title");
        };
        match u32::from_le_bytes(*width) {
            4 => Ok(Ids::Any { value_bytes: 4 }),
            8 => Ok(Ids::Any { value_bytes: 8 }),
            other => fault(at, format!("identifiers of {other} bytes"), "4 or 8 bytes"),
        }
    }

    fn check_length(&self, bytes: &[u8]) -> Result<(), CompactFault> {
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
        fault(bytes.len(), found, expected)
    }
}

fn check_checksum(bytes: &[u8]) -> Result<(), CompactFault> {
    let payload = &bytes[..bytes.len() - CHECKSUM_BYTES];
    let (computed, stored) = (xxh3_64(payload), checksum_of(bytes));
    if computed == stored {
        return Ok(());
    }
    let found = format!("the checksum {stored:016x}");
    let expected = format!("{computed:016x} after what comes before: the file is damaged");
    fault(payload.len(), found, expected)
}

fn decode_stars(input: &mut Input, header: &Header) -> Result<Vec<Star>, CompactFault> {
    let count = header.stars;
    let ids = header.ids.decode(input, count)?;
    let (ra_at, ras) = (input.at, input.column::<4>(count));
    let decs = input.column::<4>(count);
    let pm_ras = input.column::<2>(count);
    let pm_decs = input.column::<2>(count);
    let (v_at, vs) = (input.at, input.column::<2>(count));
    let colors = input.column::<2>(count);
    let (flags_at, flags) = (input.at, input.column::<1>(count));

    let order = |i: usize| (i16::from_le_bytes(vs[i]), ids[i]);
    let star = |i: usize| {
        let (v_mmag, id) = order(i);
        if i > 0 && order(i - 1) >= (v_mmag, id) {
            let expected = "stars ordered by magnitude, then number";
            return fault(v_at + 2 * i, format!("star {i} out of order"), expected);
        }
        let (ra_steps, dec_steps) = (u32::from_le_bytes(ras[i]), i32::from_le_bytes(decs[i]));
        let Some(position) = GridPosition::new(ra_steps, dec_steps) else {
            let found = format!("star {i} at ({ra_steps}, {dec_steps})");
            return fault(ra_at + 4 * i, found, "a place on the sphere, in 0.5 mas");
        };
        let Some(flags) = StarFlags::from_bits(flags[i][0]) else {
            let found = format!("flags {:#04x}", flags[i][0]);
            return fault(flags_at + i, found, "flags that have a meaning");
        };
        let bv_mmag = i16::from_le_bytes(colors[i]);
        Ok(Star {
            id,
            direction: position.direction(),
            pm_ra_mas_per_yr: f32::from(i16::from_le_bytes(pm_ras[i])),
            pm_dec_mas_per_yr: f32::from(i16::from_le_bytes(pm_decs[i])),
            v_mag: mag_from_mmag(v_mmag),
            bv_mag: (bv_mmag != UNKNOWN_COLOR_MMAG).then(|| mag_from_mmag(bv_mmag)),
            flags,
        })
    };
    let stars: Result<Vec<Star>, CompactFault> = (0..count).into_par_iter().map(star).collect();
    // Of several faults the first is told, whatever the threads did.
    stars.or_else(|_| (0..count).map(star).collect())
}

fn decode_names(input: &mut Input, header: &Header) -> Result<Vec<Name>, CompactFault> {
    let (indices_at, indices) = (input.at, input.column::<4>(header.names));
    let lengths = input.column::<1>(header.names);
    let mut names: Vec<Name> = Vec::with_capacity(header.names);
    let end = input.at + header.text_bytes;
    for (i, (index, length)) in indices.iter().zip(lengths).enumerate() {
        let star_index = u32::from_le_bytes(*index);
        let ascending = names.last().is_none_or(|last| last.star_index < star_index);
        if !ascending || star_index as usize >= header.stars {
            let found = format!("name {i} of star {star_index}");
            return fault(indices_at + 4 * i, found, "ascending indices of stars");
        }
        let length = usize::from(length[0]);
        if length > end - input.at {
            return fault(
                input.at,
                "the end of the names",
                format!("{length} bytes more"),
            );
        }
        names.push(Name {
            star_index,
            text: input.text(length, "a name in UTF-8")?.into(),
        });
    }
    if input.at != end {
        return fault(input.at, "text that no name lays claim to", "the checksum");
    }
    Ok(names)
}

/// The bytes and how far they are read. The length was checked before, so that no step can run over the end.
struct Input<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Input<'a> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        self.column(1)[0]
    }

    fn column<const N: usize>(&mut self, count: usize) -> &'a [[u8; N]] {
        let start = self.at;
        self.at += N * count;
        self.bytes[start..self.at].as_chunks().0
    }

    fn text(&mut self, length: usize, expected: &str) -> Result<&'a str, CompactFault> {
        let start = self.at;
        let text = &self.bytes[start..start + length];
        self.at += length;
        str::from_utf8(text).or_else(|_| fault(start, quoted(text), expected))
    }
}

fn fault<T>(
    byte: usize,
    found: impl Into<String>,
    expected: impl Into<String>,
) -> Result<T, CompactFault> {
    Err(CompactFault {
        byte,
        found: found.into(),
        expected: expected.into(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::coords::UnitVector;
    use crate::sky::catalog::Catalog;
    use proptest::prelude::*;

    fn small() -> Catalog {
        let star = |id: u32, v_mag: f32| {
            let direction = UnitVector::from_ra_dec(f64::from(id), 0.5);
            Star::new(StarId::Skymap(id), direction, v_mag)
        };
        let stars = vec![star(3, 2.0), star(1, 4.5), star(2, 2.0), star(9, -1.44)];
        Catalog::new(
            "test stars",
            stars,
            vec![(StarId::Skymap(2), "bet Tst".to_owned())],
        )
        .unwrap()
    }

    /// `bytes` with a checksum that fits, to reach the checks behind it.
    fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
        let payload = bytes.len() - CHECKSUM_BYTES;
        let checksum = xxh3_64(&bytes[..payload]).to_le_bytes();
        bytes[payload..].copy_from_slice(&checksum);
        bytes
    }

    fn expect_fault(bytes: &[u8], part: &str) {
        let message = decode(bytes).unwrap_err().to_string();
        assert!(message.contains(part), "{message}");
    }

    #[test]
    fn an_empty_catalog_is_one() {
        let none = Catalog::new("", vec![], vec![]).unwrap();
        let bytes = none.to_compact();
        assert_eq!(bytes.len(), HEADER_BYTES + CHECKSUM_BYTES);
        assert!(decode(&bytes).unwrap().stars.is_empty());
    }

    #[test]
    fn each_kind_of_damage_is_named() {
        let good = small().to_compact();
        expect_fault(&good[..20], "header");
        expect_fault(&good[..good.len() - 1], "the end of a file of");
        expect_fault(&[&good[..], b"x"].concat(), "the end of a file of");
        let with = |at: usize, value: u8| {
            let mut bytes = good.clone();
            bytes[at] = value;
            bytes
        };
        expect_fault(&with(0, b'x'), "the mark");
        expect_fault(&with(8, 3), "version 3");
        expect_fault(&with(8, 2), "identifiers of");
        expect_fault(&with(12, 200), "200 stars");
        expect_fault(&with(40, b'x'), "checksum");
        let title = HEADER_BYTES + "test stars".len();
        expect_fault(&sealed(with(HEADER_BYTES, 0xff)), "a title in UTF-8");
        let (ras, vs, flags) = (title + 16, title + 64, title + 80);
        expect_fault(&sealed(with(ras + 3, 0xff)), "a place on the sphere");
        expect_fault(&sealed(with(vs + 1, 0x7f)), "out of order");
        expect_fault(&sealed(with(flags, 0x80)), "flags 0x80");
        expect_fault(&sealed(with(flags + 4, 200)), "ascending indices");
        expect_fault(&sealed(with(flags + 8, 200)), "bytes more");
        expect_fault(&sealed(with(flags + 8, 2)), "no name lays claim to");
        expect_fault(&sealed(with(flags + 9, 0xff)), "a name in UTF-8");
    }

    #[test]
    fn identifiers_of_other_kinds_are_checked_too() {
        let direction = UnitVector::from_ra_dec(1.0, 0.5);
        let stars = [7, 1 << 40].map(|n| Star::new(StarId::Number(n), direction, 2.0));
        let good = Catalog::new("", stars.to_vec(), vec![])
            .unwrap()
            .to_compact();
        assert_eq!(decode(&good).unwrap().stars.len(), 2);
        let with = |at: usize, value: u8| {
            let mut bytes = good.clone();
            bytes[at] = value;
            sealed(bytes)
        };
        expect_fault(&with(HEADER_BYTES, 5), "identifiers of 5 bytes");
        expect_fault(&with(HEADER_BYTES, 4), "the end of a file of");
        expect_fault(
            &with(HEADER_BYTES + 4, 9),
            "an identifier of kind 9 and value 7",
        );
        expect_fault(
            &with(HEADER_BYTES + 5, 0),
            "an identifier of kind 0 and value 1099511627776",
        );
        for keep in 0..good.len() {
            assert!(decode(&good[..keep]).is_err());
        }
    }

    proptest! {
        #[test]
        fn any_bytes_are_refused_without_a_panic(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            prop_assert!(decode(&bytes).is_err());
            prop_assert!(decode(&[&MAGIC[..], &bytes].concat()).is_err());
        }

        #[test]
        fn a_catalog_cut_short_is_refused(keep in 0.0..1.0) {
            let bytes = small().to_compact();
            let keep = (bytes.len() as f64 * keep) as usize;
            prop_assert!(decode(&bytes[..keep]).is_err());
        }

        #[test]
        fn a_flipped_bit_is_refused(at in any::<prop::sample::Index>(), bit in 0..8_u32) {
            let mut bytes = small().to_compact();
            let at = at.index(bytes.len());
            bytes[at] ^= 1_u8 << bit;
            prop_assert!(decode(&bytes).is_err());
        }

        // Nobody checks a checksum against malice: with a right one, damage must still not panic.
        #[test]
        fn damage_with_a_right_checksum_does_not_panic(
            damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        ) {
            let mut bytes = small().to_compact();
            for (at, value) in damage {
                let at = at.index(bytes.len());
                bytes[at] = value;
            }
            let _ = decode(&sealed(bytes));
        }
    }
}
