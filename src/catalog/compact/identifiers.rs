//! How the compact form holds identifiers.

use super::layout::{VERSION_ANY_ID, VERSION_SKYMAP};
use super::reader::{ByteReader, invalid};
use crate::catalog::error::CompactError;
use crate::catalog::{Star, StarId};

/// How identifiers are encoded.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum IdEncoding {
    Skymap,
    Any { value_bytes: usize },
}

impl IdEncoding {
    /// The shortest encoding for `stars`.
    pub(super) fn shortest_for(stars: &[Star]) -> Self {
        let raw = || stars.iter().map(|star| star.id.to_raw());
        if raw().all(|(kind, _)| kind == 0) {
            return Self::Skymap;
        }
        let short = raw().all(|(_, value)| u32::try_from(value).is_ok());
        Self::Any {
            value_bytes: if short { 4 } else { 8 },
        }
    }

    pub(super) fn version(self) -> u32 {
        match self {
            Self::Skymap => VERSION_SKYMAP,
            Self::Any { .. } => VERSION_ANY_ID,
        }
    }

    /// The number of bytes of `count` identifiers.
    pub(super) fn length(self, count: usize) -> u64 {
        match self {
            Self::Skymap => 4 * count as u64,
            Self::Any { value_bytes } => 4 + (1 + value_bytes as u64) * count as u64,
        }
    }

    pub(super) fn encode(self, stars: &[Star], out: &mut Vec<u8>) {
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

    pub(super) fn decode(
        self,
        input: &mut ByteReader,
        count: usize,
    ) -> Result<Vec<StarId>, CompactError> {
        let Self::Any { value_bytes } = self else {
            let numbers = input.column::<4>(count).iter();
            let ids = numbers.map(|&number| StarId::Skymap(u32::from_le_bytes(number)));
            return Ok(ids.collect());
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
        let id =
            |(i, (&[kind], value)): (usize, (&[u8; 1], u64))| match StarId::from_raw(kind, value) {
                Some(id) => Ok(id),
                None => invalid(
                    kinds_at + i,
                    format!("an identifier of kind {kind} and value {value}"),
                    "a kind from 0 to 6, and a value in its range",
                ),
            };
        kinds.iter().zip(values).enumerate().map(id).collect()
    }
}
