//! Compressed images made here, whole and damaged.

use crate::frame::fits::header::BLOCK_BYTES;
use crate::frame::{FrameError, decode, decode_page};
use proptest::prelude::*;
use std::num::NonZeroUsize;

/// A compressed image of 6 x 4 pixels, to be changed.
#[derive(Clone)]
struct Packed {
    cards: Vec<String>,
    /// Data of each tile, as bytes of the heap.
    tiles: Vec<Vec<u8>>,
    /// Length and offset of each tile instead of its own.
    descriptors: Vec<Option<(i32, i32)>>,
}

impl Packed {
    /// Tiles that are rows, compressed as `method` says.
    fn new(method: &str, bitpix: i32, tiles: Vec<Vec<u8>>) -> Self {
        let cards = [
            "TFIELDS = 1".to_owned(),
            "TTYPE1  = 'COMPRESSED_DATA'".to_owned(),
            "TFORM1  = '1PB(100)'".to_owned(),
            "ZIMAGE  = T".to_owned(),
            format!("ZBITPIX = {bitpix}"),
            "ZNAXIS  = 2".to_owned(),
            "ZNAXIS1 = 6".to_owned(),
            "ZNAXIS2 = 4".to_owned(),
            format!("ZCMPTYPE= '{method}'"),
            "ROWORDER= 'TOP-DOWN'".to_owned(),
        ];
        Self {
            cards: cards.into(),
            descriptors: vec![None; tiles.len()],
            tiles,
        }
    }

    /// Rows of bytes without compression.
    fn plain() -> Self {
        let row = |y: u8| (0..6).map(|x| 10 * y + x).collect();
        Self::new("NOCOMPRESS", 8, (0..4).map(row).collect())
    }

    /// With a card instead of that of the same keyword, or a new one.
    fn with(mut self, card: &str) -> Self {
        self.cards.retain(|old| old[..8] != card[..8]);
        self.cards.push(card.to_owned());
        self
    }

    fn bytes(&self) -> Vec<u8> {
        let primary = ["SIMPLE  = T", "BITPIX  = 8", "NAXIS   = 0"].map(str::to_owned);
        let heap = self.tiles.concat();
        let mut cards = [
            "XTENSION= 'BINTABLE'".to_owned(),
            "BITPIX  = 8".to_owned(),
            "NAXIS   = 2".to_owned(),
            "NAXIS1  = 8".to_owned(),
            format!("NAXIS2  = {}", self.tiles.len()),
            format!("PCOUNT  = {}", heap.len()),
            "GCOUNT  = 1".to_owned(),
        ]
        .to_vec();
        cards.extend(self.cards.iter().cloned());
        let mut bytes = header(&primary);
        bytes.extend(header(&cards));
        let mut offset = 0;
        for (tile, descriptor) in self.tiles.iter().zip(&self.descriptors) {
            let (length, place) = descriptor.unwrap_or((tile.len() as i32, offset));
            bytes.extend([length.to_be_bytes(), place.to_be_bytes()].concat());
            offset += tile.len() as i32;
        }
        bytes.extend(heap);
        bytes
    }

    fn error(&self) -> String {
        decode(&self.bytes()).unwrap_err().to_string()
    }
}

fn header(cards: &[String]) -> Vec<u8> {
    let mut text: String = cards.iter().map(|card| format!("{card:<80}")).collect();
    text += &format!("{:<80}", "END");
    let mut bytes = text.into_bytes();
    bytes.resize(bytes.len().next_multiple_of(BLOCK_BYTES), b' ');
    bytes
}

#[test]
fn tiles_of_any_shape_are_put_in_their_places() {
    let frame = decode(&Packed::plain().bytes()).unwrap();
    assert_eq!((frame.at(0, 0), frame.at(5, 3)), (0.0, 35.0));
    // Of 4 x 3, 2 x 3, 4 x 1 and 2 x 1 pixels.
    let tile = |xs: std::ops::Range<u8>, ys: std::ops::Range<u8>| {
        ys.flat_map(|y| xs.clone().map(move |x| 10 * y + x))
            .collect()
    };
    let tiles = vec![
        tile(0..4, 0..3),
        tile(4..6, 0..3),
        tile(0..4, 3..4),
        tile(4..6, 3..4),
    ];
    let blocks = Packed::new("NOCOMPRESS", 8, tiles)
        .with("ZTILE1  = 4")
        .with("ZTILE2  = 3");
    assert_eq!(decode(&blocks.bytes()).unwrap(), frame);
}

#[test]
fn a_blank_of_either_keyword_has_no_value() {
    for card in ["ZBLANK  = 12", "BLANK   = 12"] {
        let frame = decode(&Packed::plain().with(card).bytes()).unwrap();
        assert!(frame.at(2, 1).is_nan() && frame.at(3, 1) == 13.0, "{card}");
    }
}

#[test]
fn quantized_floats_may_have_their_scale_in_keywords() {
    let row = |y: i32| (0..6).flat_map(|x| (10 * y + x).to_be_bytes()).collect();
    let packed = Packed::new("NOCOMPRESS", -32, (0..4).map(row).collect())
        .with("ZSCALE  = 0.5")
        .with("ZZERO   = 100")
        .with("ZBLANK  = 12");
    let frame = decode(&packed.bytes()).unwrap();
    assert_eq!((frame.at(3, 1), frame.at(0, 2)), (106.5, 110.0));
    assert!(frame.at(2, 1).is_nan());
}

#[test]
fn damage_of_a_tile_names_it() {
    let damaged = |descriptor| {
        let mut packed = Packed::plain();
        packed.descriptors[2] = Some(descriptor);
        packed.error()
    };
    for (descriptor, expected) in [
        ((0, 12), "damaged FITS: tile 3: it has no data"),
        ((5, 12), "tile 3: its data end before its 6 pixels"),
        (
            (100, 12),
            "tile 3: its data are at 12 to 112 of the heap, expected to end at 24",
        ),
        ((6, i32::MAX), "of the heap"),
        (
            (-1, 12),
            "tile 3: found a length of -1 and an offset of 12, expected no negative",
        ),
    ] {
        let found = damaged(descriptor);
        assert!(found.contains(expected), "{found}");
    }
    let long = Packed::new("NOCOMPRESS", 8, vec![vec![7; 25]; 4]);
    assert!(
        long.error()
            .contains("tile 1: its data hold more than its 6 pixels")
    );
    for method in ["RICE_1", "GZIP_1", "GZIP_2", "HCOMPRESS_1", "PLIO_1"] {
        let found = Packed::new(method, 8, vec![vec![9; 3]; 4]).error();
        assert!(found.starts_with("damaged FITS: tile 1: "), "{found}");
    }
    let mut bytes = Packed::plain().bytes();
    bytes.truncate(bytes.len() - 3);
    let short = decode(&bytes).unwrap_err();
    assert!(matches!(short, FrameError::Truncated { .. }), "{short}");
    assert!(short.to_string().contains("tile 4: "), "{short}");
}

#[test]
fn what_is_not_read_is_named() {
    for (card, expected) in [
        (
            "ZCMPTYPE= 'BZIP2_1'",
            "tiles of 8 bits compressed with BZIP2_1 (ZCMPTYPE), expected GZIP_1, GZIP_2",
        ),
        ("ZCMPTYPE= ''", "has no ZCMPTYPE"),
        ("ZBITPIX = 9", "keyword ZBITPIX at byte"),
        ("ZBITPIX = 64", "tile 1: its data end before"),
        ("ZNAXIS1 = -6", "keyword ZNAXIS1 at byte"),
        ("ZNAXIS1 = 99999999", "too large: found 99999999 x 4 pixels"),
        ("ZNAXIS2 = 5", "keyword NAXIS2 at byte"),
        ("ZTILE1  = 0", "keyword ZTILE1 at byte"),
        (
            "ZTILE1  = 1",
            "expected 24 rows in the table, one for each tile",
        ),
        ("TFIELDS = 1000", "a number of columns from 0 to 999"),
        ("TFORM1  = '1PZ'", "the type of a column"),
        ("TFORM1  = '8B'", "a column COMPRESSED_DATA"),
        ("TFORM1  = '1QB'", "rows of 8 bytes (NAXIS1), expected 16"),
        ("TTYPE1  = 'DATA'", "a column COMPRESSED_DATA"),
        (
            "TTYPE1  = 'NULL_PIXEL_MASK'",
            "a mask of pixels without a value",
        ),
        ("THEAP   = 3", "the place of the heap behind the table"),
    ] {
        let found = Packed::plain().with(card).error();
        assert!(found.contains(expected), "{card}: {found}");
    }
    let float = |cards: &[&str]| {
        let packed = Packed::new("RICE_1", -32, vec![vec![0; 99]; 4]);
        cards
            .iter()
            .fold(packed, |packed, card| packed.with(card))
            .error()
    };
    assert!(float(&[]).contains("floats in tiles without ZSCALE"));
    let dither = float(&["ZSCALE  = 1", "ZQUANTIZ= 'OTHER'"]);
    assert!(
        dither.contains("found OTHER, expected NONE, NO_DITHER"),
        "{dither}"
    );
    let parameter = |name: &str, value: &str| {
        float(&[
            "ZSCALE  = 1",
            &format!("ZNAME1  = '{name}'"),
            &format!("ZVAL1   = {value}"),
        ])
    };
    assert!(parameter("BYTEPIX", "8").contains("8 bytes a pixel (BYTEPIX)"));
    assert!(parameter("BLOCKSIZE", "0").contains("blocks of 0 pixels (BLOCKSIZE)"));
}

#[test]
fn compressed_images_are_pages_beside_others() {
    let mut bytes = Packed::plain().bytes();
    bytes.resize(bytes.len().next_multiple_of(BLOCK_BYTES), 0);
    let extension = Packed::plain().with("ZBLANK  = 35").bytes();
    bytes.extend(&extension[BLOCK_BYTES..]);
    let page = |number| decode_page(&bytes, NonZeroUsize::new(number));
    assert_eq!(page(1).unwrap().at(5, 3), 35.0);
    assert!(page(2).unwrap().at(5, 3).is_nan());
    assert!(page(3).unwrap_err().to_string().contains("found 2 pages"));
}

/// Kinds of compression, of pixels and of the floats among them.
fn kinds() -> impl Strategy<Value = (&'static str, i32, Option<&'static str>)> {
    let methods = [
        "RICE_1",
        "GZIP_1",
        "GZIP_2",
        "HCOMPRESS_1",
        "PLIO_1",
        "NOCOMPRESS",
    ];
    let dithers = [
        None,
        Some("NO_DITHER"),
        Some("SUBTRACTIVE_DITHER_1"),
        Some("SUBTRACTIVE_DITHER_2"),
    ];
    (
        proptest::sample::select(methods.to_vec()),
        proptest::sample::select(vec![8, 16, 32, 64, -32, -64]),
        proptest::sample::select(dithers.to_vec()),
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn arbitrary_tiles_never_panic(
        (method, bitpix, dither) in kinds(),
        tiles in proptest::collection::vec(proptest::collection::vec(any::<u8>(), 0..80), 4),
        descriptors in proptest::collection::vec(proptest::option::of(any::<(i32, i8)>()), 4),
        tile in (1_u8..9, 1_u8..5),
        changes in proptest::collection::vec((2880_usize..5800, "[0-9A-Z=' /.\\-]"), 0..4),
    ) {
        let mut packed = Packed::new(method, bitpix, tiles)
            .with(&format!("ZTILE1  = {}", tile.0))
            .with(&format!("ZTILE2  = {}", tile.1));
        if let Some(dither) = dither {
            packed = packed.with("ZSCALE  = 2").with(&format!("ZQUANTIZ= '{dither}'"));
        }
        // Most descriptors stay what they are, so that data are decoded.
        for (place, changed) in packed.descriptors.iter_mut().zip(descriptors) {
            *place = changed
                .filter(|(length, _)| length % 7 == 0)
                .map(|(length, offset)| (length, offset.into()));
        }
        let mut bytes = packed.bytes();
        for (at, text) in changes {
            bytes[at] = text.as_bytes()[0];
        }
        let _ = decode(&bytes);
    }
}
