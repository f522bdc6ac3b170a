//! Encodes a catalogue.

use super::identifiers::IdEncoding;
use super::layout::{HEADER_BYTES, MAGIC, UNKNOWN_COLOR_MMAG};
use crate::catalog::contents::Contents;
use crate::catalog::position::Position;
use crate::catalog::star::mmag;
use rayon::prelude::*;
use xxhash_rust::xxh3::xxh3_64;

/// The compact form of `contents`.
pub(in crate::catalog) fn encode(contents: &Contents) -> Vec<u8> {
    let (stars, names) = (&contents.stars, &contents.names);
    let text_bytes: usize = names.iter().map(|name| name.text.len()).sum();
    let count = |n: usize| u32::try_from(n).expect("validated: fewer than 2³² stars and bytes");

    let mut out = Vec::with_capacity(HEADER_BYTES + stars.len() * 21 + text_bytes + 64);
    out.extend(MAGIC);
    let ids = IdEncoding::shortest_for(stars);
    out.extend(ids.version().to_le_bytes());
    for n in [stars.len(), names.len(), contents.title.len(), text_bytes] {
        out.extend(count(n).to_le_bytes());
    }
    out.extend(contents.epoch_year.to_le_bytes());
    out.extend(contents.title.as_bytes());

    ids.encode(stars, &mut out);
    let positions = stars
        .par_iter()
        .map(|star| Position::nearest(&star.direction));
    let positions: Vec<Position> = positions.collect();
    column(&mut out, &positions, |at| at.ra_steps().to_le_bytes());
    column(&mut out, &positions, |at| at.dec_steps().to_le_bytes());
    let rounded = |mas_per_yr: f32| (mas_per_yr.round() as i16).to_le_bytes();
    column(&mut out, stars, |star| rounded(star.pm_ra_mas_per_yr));
    column(&mut out, stars, |star| rounded(star.pm_dec_mas_per_yr));
    column(&mut out, stars, |star| mmag(star.v_mag).to_le_bytes());
    column(&mut out, stars, |star| {
        star.bv_mag.map_or(UNKNOWN_COLOR_MMAG, mmag).to_le_bytes()
    });
    column(&mut out, stars, |star| [star.flags.bits()]);

    column(&mut out, names, |name| name.star_index.to_le_bytes());
    column(&mut out, names, |name| [name.text.len() as u8]);
    for name in names {
        out.extend(name.text.as_bytes());
    }
    let checksum = xxh3_64(&out);
    out.extend(checksum.to_le_bytes());
    out
}

fn column<T, const N: usize>(out: &mut Vec<u8>, items: &[T], bytes_of: impl Fn(&T) -> [u8; N]) {
    items.iter().for_each(|item| out.extend(bytes_of(item)));
}
