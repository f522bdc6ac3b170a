//! Identifiers of catalogue stars.

use super::PlaceId;
use std::fmt;

/// The identifier of a star, unique within a catalogue.
///
/// `Display` names the catalogue, so that no reader of a table takes the identifier for a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
pub enum StarId {
    /// SKY2000's Skymap number.
    ///
    /// Printed with eight digits as in SKY2000 and the papers, `SKYMAP 02480053` for Polaris. It is
    /// HHMMnnnn after a right ascension, but not always that of the star: never derive a position
    /// from it.
    Skymap(u32),
    /// A number of Tycho-1 and Tycho-2, as in `TYC 3124-2056-1`.
    Tycho(TychoId),
    /// A number of Hipparcos, as in `HIP 11767` or, for a component of a double star, `HIP 12318B`.
    Hipparcos(HipparcosId),
    /// A number whose catalogue is not known; printed as `ID 7`.
    Number(u64),
    /// A star that has only a name (see [`Catalog::name_of`](super::Catalog::name_of)); the number
    /// is arbitrary.
    Named(u32),
    /// Gaia's `source_id`; printed as `GAIA 4472832130942575872`.
    Gaia(u64),
    /// A star that has only a place, as in `J053516.47-052323.1`.
    Place(PlaceId),
}

impl fmt::Display for StarId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Skymap(number) => write!(f, "SKYMAP {number:08}"),
            Self::Tycho(id) => write!(f, "{id}"),
            Self::Hipparcos(id) => write!(f, "{id}"),
            Self::Number(number) => write!(f, "ID {number}"),
            Self::Named(number) => write!(f, "named star {number}"),
            Self::Gaia(number) => write!(f, "GAIA {number}"),
            Self::Place(id) => write!(f, "{id}"),
        }
    }
}

impl StarId {
    /// The kind and value of the identifier in the compact form.
    pub(super) const fn to_raw(self) -> (u8, u64) {
        match self {
            Self::Skymap(number) => (0, number as u64),
            Self::Tycho(TychoId(packed)) => (1, packed as u64),
            Self::Hipparcos(HipparcosId(packed)) => (2, packed as u64),
            Self::Number(number) => (3, number),
            Self::Named(number) => (4, number as u64),
            Self::Gaia(number) => (5, number),
            Self::Place(id) => (6, id.packed()),
        }
    }

    /// The inverse of [`to_raw`](Self::to_raw); `None` for an unknown kind or a value out of range.
    pub(super) fn from_raw(kind: u8, value: u64) -> Option<Self> {
        let small = || u32::try_from(value).ok();
        match kind {
            0 => small().map(Self::Skymap),
            1 => small().map(|packed| Self::Tycho(TychoId(packed))),
            2 => small().map(|packed| Self::Hipparcos(HipparcosId(packed))),
            3 => Some(Self::Number(value)),
            4 => small().map(Self::Named),
            5 => Some(Self::Gaia(value)),
            6 => PlaceId::from_packed(value).map(Self::Place),
            _ => None,
        }
    }

    /// Parses an identifier with its catalogue: `SKYMAP 02480053`, `TYC 1-13-1`, `HIP 11767`, `HIP
    /// 12318B`, `GAIA 4472832130942575872`, `J053516.47-052323.1`, `ID 7`.
    pub(super) fn parse(text: &str) -> Option<Self> {
        let number_of = |catalog: &str| {
            let (start, number) = text.split_at_checked(catalog.len())?;
            let is_it = start.eq_ignore_ascii_case(catalog);
            is_it.then(|| number.trim_start())
        };
        if let Some(number) = number_of("TYC") {
            TychoId::parse(number).map(Self::Tycho)
        } else if let Some(number) = number_of("HIP") {
            HipparcosId::parse(number).map(Self::Hipparcos)
        } else if let Some(number) = number_of("SKYMAP") {
            let number = whole_number(number.as_bytes())?;
            u32::try_from(number).ok().map(Self::Skymap)
        } else if let Some(number) = number_of("GAIA ") {
            whole_number(number.as_bytes()).map(Self::Gaia)
        } else if let Some(place) = PlaceId::parse(text) {
            Some(Self::Place(place))
        } else {
            whole_number(number_of("ID ")?.as_bytes()).map(Self::Number)
        }
    }
}

/// A number of Tycho-1 and Tycho-2: a region of the Guide Star Catalog, a star in it, a component
/// of that star.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TychoId(u32);

impl TychoId {
    const REGION_BITS: u32 = 14;
    const STAR_BITS: u32 = 14;
    const COMPONENT_BITS: u32 = 4;

    /// The star `TYC region-star-component`; `None` unless region and star are from 1 to 16383 and
    /// the component from 1 to 15.
    pub fn new(region: u32, star: u32, component: u32) -> Option<Self> {
        let fits = |value: u32, bits: u32| value > 0 && value < 1 << bits;
        let valid = fits(region, Self::REGION_BITS)
            && fits(star, Self::STAR_BITS)
            && fits(component, Self::COMPONENT_BITS);
        valid.then_some(Self(
            (region << (Self::STAR_BITS + Self::COMPONENT_BITS))
                | (star << Self::COMPONENT_BITS)
                | component,
        ))
    }

    /// Parses three numbers separated by hyphens or blanks.
    pub(super) fn parse(text: &str) -> Option<Self> {
        let mut parts = text
            .split(['-', ' '])
            .filter(|part| !part.is_empty())
            .map(|part| whole_number(part.as_bytes()));
        let mut next = || u32::try_from(parts.next()??).ok();
        let (region, star, component) = (next()?, next()?, next()?);
        parts.next().is_none().then_some(())?;
        Self::new(region, star, component)
    }
}

impl fmt::Display for TychoId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let region = self.0 >> (Self::STAR_BITS + Self::COMPONENT_BITS);
        let star = (self.0 >> Self::COMPONENT_BITS) & ((1 << Self::STAR_BITS) - 1);
        let component = self.0 & ((1 << Self::COMPONENT_BITS) - 1);
        write!(f, "TYC {region}-{star}-{component}")
    }
}

/// A number of the Hipparcos Catalogue, with the component of a double star.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct HipparcosId(u32);

impl HipparcosId {
    /// The star `HIP number`, or its component with a capital letter; `None` for a number above
    /// 16,777,215 or another letter.
    pub fn new(number: u32, component: Option<u8>) -> Option<Self> {
        let valid = number < 1 << 24 && component.is_none_or(|letter| letter.is_ascii_uppercase());
        valid.then_some(Self((number << 8) | u32::from(component.unwrap_or(0))))
    }

    /// The number, without a component.
    pub(super) const fn number(self) -> u32 {
        self.0 >> 8
    }

    /// Parses a number, optionally followed by a letter.
    pub(super) fn parse(text: &str) -> Option<Self> {
        let bytes = text.as_bytes();
        let (digits, component) = match bytes {
            [digits @ .., letter] if letter.is_ascii_uppercase() => (digits, Some(*letter)),
            _ => (bytes, None),
        };
        let number = whole_number(digits.trim_ascii_end())?;
        Self::new(u32::try_from(number).ok()?, component)
    }
}

impl fmt::Display for HipparcosId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "HIP {}", self.number())?;
        match self.0 as u8 {
            0 => Ok(()),
            letter => write!(f, "{}", char::from(letter)),
        }
    }
}

/// Parses a number of digits alone.
pub(super) fn whole_number(digits: &[u8]) -> Option<u64> {
    let digits = str::from_utf8(digits).ok()?;
    // `parse` would accept a sign.
    let plain = digits.bytes().all(|byte| byte.is_ascii_digit());
    plain.then(|| digits.parse().ok()).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_skymap_number_is_shown_with_eight_digits_after_its_catalogue() {
        assert_eq!(StarId::Skymap(2_480_053).to_string(), "SKYMAP 02480053");
        assert_eq!(StarId::Skymap(14_220_079).to_string(), "SKYMAP 14220079");
    }

    #[test]
    fn identifiers_with_their_catalogue_are_parsed() {
        for text in [
            "TYC 1-13-1",
            "TYC 9537-12121-4",
            "HIP 11767",
            "HIP 12318B",
            "SKYMAP 02480053",
            "GAIA 4472832130942575872",
            "ID 7",
        ] {
            assert_eq!(StarId::parse(text).unwrap().to_string(), text);
        }
        let padded = StarId::parse("TYC 0001 00013 1").unwrap();
        assert_eq!(padded.to_string(), "TYC 1-13-1");
        for text in [
            "",
            "TYC",
            "TYC 1-13",
            "TYC 1-13-1-1",
            "TYC 0-13-1",
            "TYC 1-13-16",
            "TYC 20000-1-1",
            "HIP",
            "HIP -3",
            "HIP x",
            "HIP 3b",
            "HIP 99999999",
            "HD 1",
            "SKYMAP",
            "SKYMAP 4294967296",
            "SKYMAP -1",
            "ID",
            "ID ",
            "ID x",
            "IDA 1",
            "ÄÖÜ",
        ] {
            assert_eq!(StarId::parse(text), None, "{text}");
        }
    }

    proptest! {
        #[test]
        fn identifiers_survive_the_compact_form(
            kind in 0..7_u8,
            value in any::<u64>(),
            small in any::<u32>(),
        ) {
            for value in [value, u64::from(small)] {
                if let Some(id) = StarId::from_raw(kind, value) {
                    prop_assert_eq!(id.to_raw(), (kind, value));
                }
            }
        }
    }
}
