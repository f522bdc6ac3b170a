//! Round trips and damage of the compact form.

use super::decode::decode;
use super::layout::{CHECKSUM_BYTES, HEADER_BYTES, MAGIC};
use crate::base::coords::UnitVector;
use crate::catalog::{Catalog, Star, StarId};
use proptest::prelude::*;
use xxhash_rust::xxh3::xxh3_64;

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

/// `bytes` with the right checksum, to reach the checks after it.
fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let payload = bytes.len() - CHECKSUM_BYTES;
    let checksum = xxh3_64(&bytes[..payload]).to_le_bytes();
    bytes[payload..].copy_from_slice(&checksum);
    bytes
}

fn expect_error(bytes: &[u8], part: &str) {
    let message = decode(bytes).unwrap_err().to_string();
    assert!(message.contains(part), "{message}");
}

#[test]
fn an_empty_catalog_is_valid() {
    let none = Catalog::new("", vec![], vec![]).unwrap();
    let bytes = none.to_compact();
    assert_eq!(bytes.len(), HEADER_BYTES + CHECKSUM_BYTES);
    assert!(decode(&bytes).unwrap().stars.is_empty());
}

#[test]
fn each_kind_of_damage_has_its_message() {
    let good = small().to_compact();
    expect_error(&good[..20], "header");
    expect_error(&good[..good.len() - 1], "the end of a file of");
    expect_error(&[&good[..], b"x"].concat(), "the end of a file of");
    let with = |at: usize, value: u8| {
        let mut bytes = good.clone();
        bytes[at] = value;
        bytes
    };
    expect_error(&with(0, b'x'), "the signature");
    expect_error(&with(8, 3), "version 3");
    expect_error(&with(8, 2), "identifiers of");
    expect_error(&with(12, 200), "200 stars");
    expect_error(&with(40, b'x'), "checksum");
    let title = HEADER_BYTES + "test stars".len();
    expect_error(&sealed(with(HEADER_BYTES, 0xff)), "a title in UTF-8");
    let (ras, vs, flags) = (title + 16, title + 64, title + 80);
    expect_error(&sealed(with(ras + 3, 0xff)), "a position on the sphere");
    expect_error(&sealed(with(vs + 1, 0x7f)), "out of order");
    expect_error(&sealed(with(flags + 4, 200)), "ascending indices");
    expect_error(&sealed(with(flags + 8, 200)), "more bytes");
    expect_error(&sealed(with(flags + 8, 2)), "text after the last name");
    expect_error(&sealed(with(flags + 9, 0xff)), "a name in UTF-8");
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
    expect_error(&with(HEADER_BYTES, 5), "identifiers of 5 bytes");
    expect_error(&with(HEADER_BYTES, 4), "the end of a file of");
    expect_error(
        &with(HEADER_BYTES + 4, 9),
        "an identifier of kind 9 and value 7",
    );
    expect_error(
        &with(HEADER_BYTES + 5, 0),
        "an identifier of kind 0 and value 1099511627776",
    );
    for keep in 0..good.len() {
        assert!(decode(&good[..keep]).is_err());
    }
}

proptest! {
    #[test]
    fn any_bytes_are_rejected_without_a_panic(
        bytes in prop::collection::vec(any::<u8>(), 0..200),
    ) {
        prop_assert!(decode(&bytes).is_err());
        prop_assert!(decode(&[&MAGIC[..], &bytes].concat()).is_err());
    }

    #[test]
    fn a_truncated_catalog_is_rejected(keep in 0.0..1.0) {
        let bytes = small().to_compact();
        let keep = (bytes.len() as f64 * keep) as usize;
        prop_assert!(decode(&bytes[..keep]).is_err());
    }

    #[test]
    fn a_flipped_bit_is_rejected(at in any::<prop::sample::Index>(), bit in 0..8_u32) {
        let mut bytes = small().to_compact();
        let at = at.index(bytes.len());
        bytes[at] ^= 1_u8 << bit;
        prop_assert!(decode(&bytes).is_err());
    }

    // A checksum is no protection against malice: damage with a right one must not panic either.
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
