use super::header::BLOCK_BYTES;
use super::*;
use crate::frame::read_budget::ReadBudget;
use crate::frame::{BayerPattern, RowOrder};
use proptest::prelude::*;

fn decode(bytes: &[u8], page: Option<NonZeroUsize>) -> Result<Frame<'static>, FrameError> {
    super::decode(bytes, page, &ReadBudget::default())
}

/// A header-data unit of these cards and data, padded to blocks.
fn unit(cards: &[&str], data: &[u8]) -> Vec<u8> {
    let mut text: String = cards.iter().map(|card| format!("{card:<80}")).collect();
    text += &format!("{:<80}", "END");
    let mut bytes = text.into_bytes();
    bytes.resize(bytes.len().next_multiple_of(BLOCK_BYTES), b' ');
    bytes.extend(data);
    bytes.resize(bytes.len().next_multiple_of(BLOCK_BYTES), 0);
    bytes
}

/// The primary image of this size and kind, with more cards, stored top-down unless these say
/// otherwise.
fn image(bitpix: i32, axes: &[usize], more: &[&str], data: &[u8]) -> Vec<u8> {
    let mut cards = vec![
        "SIMPLE  = T".to_owned(),
        format!("BITPIX  = {bitpix}"),
        format!("NAXIS   = {}", axes.len()),
    ];
    for (number, length) in axes.iter().enumerate() {
        cards.push(format!("NAXIS{:<3}= {length}", number + 1));
    }
    cards.extend(more.iter().map(|card| (*card).to_owned()));
    if !more.iter().any(|card| card.starts_with("ROWORDER")) {
        cards.push("ROWORDER= 'TOP-DOWN'".to_owned());
    }
    let cards: Vec<&str> = cards.iter().map(String::as_str).collect();
    unit(&cards, data)
}

fn extension(bytes: &[u8]) -> Vec<u8> {
    let text = format!("{:<80}", "XTENSION= 'IMAGE   '");
    [text.as_bytes(), &bytes[80..]].concat()
}

fn table(more: &[&str]) -> Vec<u8> {
    let cards = [
        "XTENSION= 'BINTABLE'",
        "BITPIX  = 8",
        "NAXIS   = 2",
        "NAXIS1  = 4",
        "NAXIS2  = 3",
        "PCOUNT  = 5000",
        "GCOUNT  = 1",
    ];
    unit(&[&cards, more].concat(), &[7; 5012])
}

fn empty_primary(more: &[&str]) -> Vec<u8> {
    image(8, &[], more, &[])
}

fn words(values: &[i16]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_be_bytes()).collect()
}

fn page(number: usize) -> Option<NonZeroUsize> {
    NonZeroUsize::new(number)
}

fn error_of(bytes: &[u8], page: Option<NonZeroUsize>) -> String {
    decode(bytes, page).unwrap_err().to_string()
}

#[test]
fn unsigned_16_bit_integers_are_exact() {
    let stored = [-32768, -32767, -1, 0, 1, 2, 3, 32766, 32767];
    let bytes = image(
        16,
        &[3, 3],
        &["BZERO   = 32768", "BSCALE  = 1"],
        &words(&stored),
    );
    let frame = decode(&bytes, None).unwrap();
    assert_eq!(
        *frame.values(),
        [
            0.0, 1.0, 32767.0, 32768.0, 32769.0, 32770.0, 32771.0, 65534.0, 65535.0
        ]
    );
    assert_eq!((frame.step_adu, frame.saturation_adu), (1.0, Some(65535.0)));
}

#[test]
fn every_bitpix_is_read() {
    let values = [1_i64, 2, 3, 4, 5, 6, 7, 8, 100];
    let expected: Vec<f32> = values.iter().map(|v| *v as f32).collect();
    let data = |f: &dyn Fn(i64) -> Vec<u8>| values.iter().flat_map(|v| f(*v)).collect::<Vec<_>>();
    for (bitpix, data, step, saturation) in [
        (8, data(&|v| vec![v as u8]), 1.0, Some(255.0)),
        (
            16,
            data(&|v| (v as i16).to_be_bytes().into()),
            1.0,
            Some(32767.0),
        ),
        (
            32,
            data(&|v| (v as i32).to_be_bytes().into()),
            1.0,
            Some(2147483648.0),
        ),
        (64, data(&|v| v.to_be_bytes().into()), 1.0, None),
        (-32, data(&|v| (v as f32).to_be_bytes().into()), 0.0, None),
        (-64, data(&|v| (v as f64).to_be_bytes().into()), 0.0, None),
    ] {
        let frame = decode(&image(bitpix, &[3, 3], &[], &data), None).unwrap();
        assert_eq!(frame.values(), expected, "BITPIX {bitpix}");
        assert_eq!((frame.step_adu, frame.saturation_adu), (step, saturation));
    }
}

#[test]
fn the_other_unsigned_and_signed_types_keep_their_full_scale() {
    let bytes = [0x80_u8, 0, 0x7f, 0xff].repeat(9);
    let zero = ["BZERO   = 2147483648.0"];
    let frame = decode(&image(32, &[3, 3], &zero, &bytes), None).unwrap();
    assert_eq!(frame.pixels.value(0), 32767.0);
    assert_eq!(frame.saturation_adu, Some(4294967296.0));
    let data: Vec<u8> = (28..37).collect();
    let frame = decode(&image(8, &[3, 3], &["BZERO   = -128"], &data), None).unwrap();
    assert_eq!(
        (frame.pixels.value(0), frame.saturation_adu),
        (-100.0, Some(127.0))
    );
}

#[test]
fn scaled_integers_have_a_step_and_no_saturation() {
    let bytes = image(
        16,
        &[3, 3],
        &["BZERO   = 100.5", "BSCALE  = -0.25"],
        &words(&[4; 9]),
    );
    let frame = decode(&bytes, None).unwrap();
    assert_eq!(frame.pixels.value(0), 99.5);
    assert_eq!((frame.step_adu, frame.saturation_adu), (0.25, None));
}

#[test]
fn blank_nan_and_infinity_are_no_values() {
    let mut stored = [5; 9];
    stored[4] = -7;
    for more in [
        &["BLANK   = -7"][..],
        &["BLANK   = -7", "BZERO   = 32768"],
        &["BLANK   = -7", "BSCALE  = 2"],
    ] {
        let frame = decode(&image(16, &[3, 3], more, &words(&stored)), None).unwrap();
        let without: Vec<usize> = (0..9).filter(|i| frame.pixels.value(*i).is_nan()).collect();
        assert_eq!(without, [4], "{more:?}");
    }
    let all_blank = image(16, &[3, 3], &["BLANK   = 5"], &words(&[5; 9]));
    assert!(matches!(
        decode(&all_blank, None),
        Err(FrameError::NoValues)
    ));
    let mut floats = [1.0_f32; 9];
    floats[..3].copy_from_slice(&[f32::NAN, f32::INFINITY, f32::NEG_INFINITY]);
    let data: Vec<u8> = floats.iter().flat_map(|v| v.to_be_bytes()).collect();
    let frame = decode(&image(-32, &[3, 3], &[], &data), None).unwrap();
    assert!(frame.values()[..3].iter().all(|p| p.is_nan()) && frame.pixels.value(3) == 1.0);
}

#[test]
fn a_blank_that_no_pixel_can_have_is_ignored_with_a_note() {
    for (bitpix, blank, is_noted) in [
        (16, "-32768", false),
        (16, "-32768.", true),
        (16, "0.0", true),
        (16, "NaN", true),
        (16, "'NaN'", true),
        (16, "'    '", false),
        (16, "1.0E+20", true),
        (16, "18446744073709551615", true),
        (16, "32768", true),
        (16, "T", true),
        (8, "-1", true),
        (8, "255", false),
        (64, "-9223372036854775808", false),
        // Floats have NaN, and no use for the keyword.
        (-32, "NaN", false),
    ] {
        let bytes = i32::unsigned_abs(bitpix) as usize / 8;
        let data = [7_u8, 0, 0, 7, 0, 0, 7, 0].repeat(9 * bytes)[..9 * bytes].to_vec();
        let card = format!("BLANK   = {blank}");
        let frame = decode(&image(bitpix, &[3, 3], &[&card], &data), None).unwrap();
        assert!(frame.values().iter().all(|value| !value.is_nan()));
        let ignored = frame.metadata.ignored;
        assert_eq!(ignored.len(), usize::from(is_noted), "{bitpix} {blank}");
    }
    let note = metadata_of(&["BLANK   = 1.5"]).ignored[0].to_string();
    assert_eq!(
        note,
        "BLANK is ignored: found 1.5, expected a whole number from 0 to 255"
    );
}

#[test]
fn integers_of_64_bits_are_exact_at_any_offset() {
    let levels = [0_i128, 1, 66, 4095, 65_535, 16_777_215, 3, 2, 1];
    let half = 1_i128 << 63;
    for (zero, offset) in [
        ("9223372036854775808", half),
        ("9.223372036854775808E18", half),
        ("-4611686018427387904.", -half / 2),
        ("0", 0),
        ("32768", 32_768),
        ("-128", -128),
    ] {
        let stored = levels.iter().map(|level| (level - offset) as i64);
        let data: Vec<u8> = stored.flat_map(i64::to_be_bytes).collect();
        let card = format!("BZERO   = {zero}");
        let bytes = image(
            64,
            &[3, 3],
            &[&card, "BLANK   = 9223372036854775800"],
            &data,
        );
        let frame = decode(&bytes, None).unwrap();
        let expected = levels.map(|level| level as f32);
        assert_eq!(*frame.values(), expected, "{zero}");
        assert_eq!((frame.step_adu, frame.saturation_adu), (1.0, None));
    }
    let data: Vec<u8> = (-4_i64..5).flat_map(i64::to_be_bytes).collect();
    let scaled = ["BZERO   = 100.5", "BSCALE  = -0.25", "BLANK   = 0"];
    let frame = decode(&image(64, &[3, 3], &scaled, &data), None).unwrap();
    assert_eq!(frame.pixels.value(0), 101.5);
    assert!(frame.pixels.value(4).is_nan());
}

#[test]
fn the_top_row_comes_first_whichever_way_the_file_is_stored() {
    let top_down: Vec<u8> = (0..15).collect();
    let bottom_up: Vec<u8> = top_down.rchunks(3).flatten().copied().collect();
    let upright: Vec<f32> = top_down.iter().copied().map(f32::from).collect();
    // Without the keyword a file is bottom-up; any card may stand in its place.
    for (card, data, order, ignored) in [
        ("ROWORDER= 'TOP-DOWN'", &top_down, RowOrder::TopDown, 0),
        ("ROWORDER= 'top-down'", &top_down, RowOrder::TopDown, 0),
        ("ROWORDER= 'BOTTOM-UP'", &bottom_up, RowOrder::BottomUp, 0),
        ("ROWORDER= 'sideways'", &bottom_up, RowOrder::BottomUp, 1),
        ("ROWORDER", &bottom_up, RowOrder::BottomUp, 0),
    ] {
        let frame = decode(&image(8, &[3, 5], &[card], data), None).unwrap();
        assert_eq!(frame.values(), upright, "{card}");
        assert_eq!(frame.metadata.row_order, order, "{card}");
        assert_eq!(frame.metadata.ignored.len(), ignored, "{card}");
        let stored = frame.as_stored();
        let values: Vec<f32> = data.iter().copied().map(f32::from).collect();
        assert_eq!(stored.values(), values, "{card}");
        assert_eq!(stored.metadata.row_order, RowOrder::TopDown);
    }
}

#[test]
fn the_filters_of_rows_as_stored_are_those_of_the_first_one_there() {
    let data: Vec<u8> = (0..12).collect();
    for (height, stored) in [(4, BayerPattern::Gbrg), (3, BayerPattern::Rggb)] {
        let cards = ["ROWORDER= 'BOTTOM-UP'", "BAYERPAT= 'RGGB'"];
        let file = image(8, &[3, height], &cards, &data[..3 * height]);
        let frame = decode(&file, None).unwrap();
        assert_eq!(frame.metadata.bayer_pattern, Some(BayerPattern::Rggb));
        assert_eq!(frame.as_stored().metadata.bayer_pattern, Some(stored));
    }
}

#[test]
fn the_order_of_rows_may_stand_in_the_primary_header() {
    let file = [
        empty_primary(&["ROWORDER= 'TOP-DOWN'"]),
        extension(&image(
            8,
            &[3, 3],
            &["ROWORDER"],
            &[1, 1, 1, 2, 2, 2, 3, 3, 3],
        )),
    ];
    assert_eq!(decode(&file.concat(), None).unwrap().pixels.value(0), 1.0);
}

#[test]
fn pages_are_images_of_two_axes_and_planes_of_cubes() {
    let plane = |value: u8| vec![value; 9];
    let file = [
        empty_primary(&["EXPTIME = 7.5"]),
        table(&[]),
        extension(&image(8, &[3, 3], &["EXPTIME = 2"], &plane(1))),
        extension(&image(8, &[9], &[], &plane(9))),
        extension(&image(8, &[3, 3, 2], &[], &[plane(2), plane(3)].concat())),
        extension(&image(
            8,
            &[3, 3, 3],
            &[],
            &[plane(100), plane(50), plane(20)].concat(),
        )),
    ]
    .concat();
    let first = |page| decode(&file, page).unwrap().pixels.value(0);
    assert_eq!(first(None), 1.0);
    assert_eq!([1, 2, 3].map(|n| first(page(n))), [1.0, 2.0, 3.0]);
    assert!((first(page(4)) - (29.9 + 29.35 + 2.28)).abs() < 1e-4);
    assert_eq!(
        error_of(&file, page(5)),
        "no page 5: found 4 pages, expected at least 5"
    );
    let exposure = |n| decode(&file, page(n)).unwrap().metadata.exposure_s;
    assert_eq!([1, 2].map(exposure), [Some(2.0), Some(7.5)]);
}

#[test]
fn a_cube_is_refused_unless_a_plane_is_chosen() {
    let cube = image(8, &[3, 3, 5], &[], &[6; 45]);
    assert!(error_of(&cube, None).contains("a cube of 5 planes"));
    assert_eq!(decode(&cube, page(5)).unwrap().pixels.value(0), 6.0);
    let one = image(8, &[3, 3, 1, 1], &[], &[6; 9]);
    assert_eq!(decode(&one, None).unwrap().pixels.len(), 9);
}

#[test]
fn colors_are_read_from_any_axis() {
    const SIZE: usize = 5 * 6;
    let (red, green, blue) = (100.0, 50.0, 20.0);
    let expected = 0.299 * red + 0.587 * green + 0.114 * blue;
    let [r, g, b, a] = [red as u8, green as u8, blue as u8, 255];
    let planes = |colors: &[u8]| -> Vec<u8> { colors.iter().flat_map(|&c| [c; SIZE]).collect() };
    let rows = |colors: &[u8]| -> Vec<u8> {
        let row: Vec<u8> = colors.iter().flat_map(|&c| [c; 5]).collect();
        row.repeat(6)
    };
    for (axes, data, assumed) in [
        (&[5, 6, 3][..], planes(&[r, g, b]), 0),
        (&[5, 6, 1, 3], planes(&[r, g, b]), 0),
        (&[5, 6, 4], planes(&[r, g, b, a]), 1),
        (&[3, 5, 6], [r, g, b].repeat(SIZE), 0),
        (&[4, 5, 6], [r, g, b, 9].repeat(SIZE), 0),
        (&[5, 3, 6], rows(&[r, g, b]), 0),
    ] {
        let frame = decode(&image(8, axes, &[], &data), None).unwrap();
        assert_eq!((frame.width, frame.height), (5, 6), "{axes:?}");
        let near = |value: &f32| (value - expected).abs() < 1e-4;
        let values = frame.values();
        let is_saturated = axes == [5, 6, 4];
        assert!(
            is_saturated || values.iter().all(near),
            "{axes:?} {values:?}"
        );
        assert_eq!(frame.metadata.assumed.len(), assumed);
    }
    let four = image(8, &[5, 6, 4], &[], &planes(&[r, g, b, a]));
    assert_eq!(decode(&four, page(3)).unwrap().pixels.value(0), blue);
    let squeezed = image(8, &[1, 5, 6], &[], &[7; SIZE]);
    assert_eq!(decode(&squeezed, None).unwrap().height, 6);
}

#[test]
fn the_largest_image_is_read_and_a_note_tells_of_it() {
    let extension_of = |side: usize, level: u8| {
        extension(&image(8, &[side, side], &[], &vec![level; side * side]))
    };
    let read = |parts: &[&[u8]]| {
        let frame = decode(&parts.concat(), None).unwrap();
        (frame.pixels.value(0), frame.metadata.choice)
    };
    let thumbnail = image(8, &[4, 4], &["EXPTIME = 7.5"], &[1; 16]);
    let (level, choice) = read(&[&thumbnail, &table(&[]), &extension_of(6, 2)]);
    assert_eq!(level, 2.0);
    let choice = choice.unwrap();
    assert_eq!((choice.images, choice.page), (2, 2));
    assert_eq!((choice.size_px, choice.first_px), ([6, 6], [4, 4]));
    // Of equal ones the first, as files of several detectors have them.
    let equal = [extension_of(6, 2), extension_of(6, 3), extension_of(5, 4)].concat();
    assert_eq!(read(&[&empty_primary(&[]), &equal]), (2.0, None));
    // A larger cube does not say which of its planes it is.
    let cube = extension(&image(8, &[9, 9, 5], &[], &[9; 405]));
    assert_eq!(read(&[&thumbnail, &cube]), (1.0, None));
    let (level, choice) = read(&[&image(8, &[9, 9, 5], &[], &[9; 405]), &extension_of(6, 2)]);
    assert_eq!((level, choice.map(|choice| choice.page)), (2.0, Some(6)));
    // Damage behind a whole image does not matter to it; a cut of the largest does.
    let mut cut = [thumbnail.clone(), extension_of(6, 2)].concat();
    cut.truncate(thumbnail.len() + BLOCK_BYTES + 10);
    assert!(error_of(&cut, None).contains("6 x 6 pixels ends"));
    let mut broken = extension_of(6, 2);
    broken[80..88].fill(b'X');
    assert_eq!(read(&[&thumbnail, &broken]), (1.0, None));
    let keywords = decode(&[thumbnail, extension_of(6, 2)].concat(), None).unwrap();
    assert_eq!(keywords.metadata.exposure_s, Some(7.5));
}

#[test]
fn files_without_an_image_say_what_they_hold() {
    let tables = [empty_primary(&[]), table(&[])].concat();
    assert!(
        error_of(&tables, None).contains("found no image in it, and 1 table, expected an image")
    );
    let compressed = [empty_primary(&[]), table(&["ZIMAGE  = T"])].concat();
    assert!(error_of(&compressed, None).contains("has no ZBITPIX, expected 8, 16"));
}

#[test]
fn damage_is_reported_with_its_offset() {
    let bad = |card: &str, instead: &str| {
        let bytes = image(16, &[3, 3], &["BSCALE  = 1"], &words(&[1; 9]));
        let text: String = bytes.iter().map(|b| char::from(*b)).collect();
        let changed = text.replacen(&format!("{card:<80}"), &format!("{instead:<80}"), 1);
        assert_ne!(text, changed);
        error_of(&changed.chars().map(|c| c as u8).collect::<Vec<_>>(), None)
    };
    for (card, instead, expected) in [
        (
            "BITPIX  = 16",
            "BITPIX  = 17",
            "keyword BITPIX at byte 80: found 17, expected 8, 16",
        ),
        ("NAXIS1  = 3", "COMMENT", "has no NAXIS1, expected"),
        (
            "NAXIS1  = 3",
            "NAXIS1  = -3",
            "keyword NAXIS1 at byte 240: found -3",
        ),
        (
            "NAXIS   = 2",
            "NAXIS   = -2",
            "keyword NAXIS at byte 160: found -2",
        ),
        (
            "NAXIS   = 2",
            "NAXIS   = 2.5",
            "keyword NAXIS at byte 160: found 2.5",
        ),
        (
            "BSCALE  = 1",
            "BSCALE  = NaN",
            "keyword BSCALE at byte 400: found NaN",
        ),
        (
            "BSCALE  = 1",
            "BSCALE  = 0",
            "keyword BSCALE at byte 400: found 0",
        ),
        (
            "BSCALE  = 1",
            "BZERO   = 'x'",
            "keyword BZERO at byte 400: found x",
        ),
        (
            "NAXIS1  = 3",
            "NAXIS1  = 1000000000",
            "too large: found 1000000000 x 3",
        ),
        ("NAXIS1  = 3", "NAXIS1  = 2", "too small: found 2 x 3"),
        ("NAXIS1  = 3", "NAXIS1  = 9000", "found 5760 bytes"),
    ] {
        let found = bad(card, instead);
        assert!(found.contains(expected), "{instead}: {found}");
    }
}

#[test]
fn a_truncated_image_says_how_many_bytes_are_there_and_needed() {
    let bytes = image(16, &[100, 100], &[], &words(&[1; 10_000]));
    assert_eq!(
        error_of(&bytes[..9999], None),
        "truncated FITS: found 9999 bytes, expected more (the image of 100 x 100 pixels ends at byte 22880)"
    );
    // The padding after the last pixel is not needed.
    assert!(decode(&bytes[..22_880], None).is_ok());
    assert!(error_of(&bytes[..22_879], None).contains("truncated"));
    assert!(error_of(&bytes[..300], None).contains("has no END"));
    let cut_in_table = [empty_primary(&[]), table(&[])].concat();
    assert_eq!(
        error_of(&cut_in_table[..9000], None),
        "truncated FITS: found 9000 bytes, expected more (the data before the next header end at byte 10772)"
    );
}

#[test]
fn overflowing_sizes_are_refused() {
    let huge = usize::MAX / 2;
    for axes in [
        vec![huge, huge],
        vec![huge, huge, huge],
        vec![3, 3, huge, huge],
    ] {
        for page in [None, page(1), page(huge)] {
            assert!(decode(&image(-64, &axes, &[], &[]), page).is_err());
        }
    }
    // Nothing can follow a table of absurd size.
    let mut endless = table(&["NAXIS2  = 9"]);
    let at = endless.windows(6).position(|w| w == b"PCOUNT").unwrap();
    endless[at + 10..at + 29].copy_from_slice(b"9223372036854775807");
    let file = [
        empty_primary(&[]),
        endless,
        extension(&image(8, &[3, 3], &[], &[1; 9])),
    ]
    .concat();
    assert!(error_of(&file, None).contains("truncated"));
}

fn metadata_of(more: &[&str]) -> crate::frame::FrameMetadata {
    decode(&image(8, &[3, 3], more, &[1; 9]), None)
        .unwrap()
        .metadata
}

#[test]
fn a_camera_s_keywords_are_read() {
    let metadata = metadata_of(&[
        "DATE-OBS= '2019-07-29T20:47:26.5' / UTC",
        "EXPTIME =                  2.5",
        "XPIXSZ  =                  9.3 / binned",
        "XBINNING=                    2",
        "FOCALLEN=                 35.0",
    ]);
    assert_eq!(metadata.date.unwrap().to_iso(), "2019-07-29T20:47:26.5Z");
    assert_eq!(metadata.exposure_s, Some(2.5));
    assert_eq!(metadata.pixel_size_um, Some(9.3));
    assert_eq!(metadata.focal_length_mm, Some(35.0));
    assert!(metadata.ignored.is_empty());
    let unbinned = metadata_of(&["PIXSIZE1= 4.65", "XBINNING= 2", "EXPOSURE= '3'"]);
    assert_eq!(unbinned.pixel_size_um, Some(9.3));
    assert_eq!(unbinned.exposure_s, Some(3.0));
}

#[test]
fn dates_are_read_as_programs_have_written_them() {
    for (cards, expected) in [
        (&["DATE-OBS= '2019-07-29'"][..], "2019-07-29"),
        (
            &["DATE-OBS= '2019-07-29'", "TIME-OBS= '20:47:26'"],
            "2019-07-29T20:47:26Z",
        ),
        (
            &["UT      = '20:47:26'", "DATE-OBS= '29/07/94'"],
            "1994-07-29T20:47:26Z",
        ),
        (
            &["DATE-OBS= '29/07/94'", "UT      = 3"],
            "1994-07-29T03:00:00Z",
        ),
        (
            &["DATE-BEG= '2019-07-29T20:47:26Z'"],
            "2019-07-29T20:47:26Z",
        ),
        (&["MJD-OBS = 51544.5"], "2000-01-01T12:00:00Z"),
    ] {
        assert_eq!(
            metadata_of(cards).date.unwrap().to_iso(),
            expected,
            "{cards:?}"
        );
    }
}

/// Cards, the date that they tell, and how many of them are ignored.
const DATES: &str = "\
DATE-OBS= '15/01/20'; MJD-OBS = 58863.8333333 => 2020-01-15T20:00:00Z => 1
DATE-OBS= '15/01/94'; MJD-OBS = 58863.8333333 => 2020-01-15T20:00:00Z => 1
DATE-OBS= '15/01/94'; MJD-OBS = 49367.8333333 => 1994-01-15T20:00:00Z => 0
DATE-OBS= '2020-01-15'; JD      = 2458864.3333333 => 2020-01-15T20:00:00Z => 0
DATE-OBS= '2020-01-15'; MJD-OBS = 58000.5 => 2020-01-15 => 1
DATE-OBS= '2020-01-15T20:00:00'; MJD-OBS = 58863.9 => 2020-01-15T20:00:00Z => 1
DATE-OBS= '2020-01-15T20:00:00'; MJD-OBS = 58863.9; EXPTIME = 7200 => 2020-01-15T20:00:00Z => 0
DATE-OBS= '2020-01-15T20:00:00'; MJD-AVG = 58864.0 => 2020-01-15T20:00:00Z => 0
DATE-OBS= '2020-01-15T20:00:00'; MJD-OBS = 0.0 => 2020-01-15T20:00:00Z => 1
DATE_OBS= '2020-01-15T20:00:00' => 2020-01-15T20:00:00Z => 0
MJD     = 58863.8333334 => 2020-01-15T20:00:00Z => 0
JD-OBS  = 2458864.3333334 => 2020-01-15T20:00:00Z => 0
JD_UTC  = '2458864.3333334' => 2020-01-15T20:00:00Z => 0
MJD-OBS = 58863 => 2020-01-15 => 0
DATE-OBS= '2020-01-15'; TIME-OBS= '20 00 00' => 2020-01-15T20:00:00Z => 0
DATE-OBS= '2020-01-15'; UT-START= '20:00:00' => 2020-01-15T20:00:00Z => 0
DATE-OBS= '2020-01-15'; UT      = 20.0 => 2020-01-15T20:00:00Z => 0
DATE-OBS= '2020-01-15'; UTC     = 72000.000 => 2020-01-15T20:00:00Z => 0
DATE-OBS= '2020-01-15'; TIME-OBS= 'late'; UT      = '20:00:00' => 2020-01-15T20:00:00Z => 1
DATE-OBS= '15/01/2020'; TIME-OBS= '2020-01-15T20:00:00' => 2020-01-15T20:00:00Z => 0
DATE-OBS= '2020-01-15T20:01:09.184'; TIMESYS = 'TT' => 2020-01-15T20:00:00Z => 0
MJD-OBS = 58863.8337614; TIMESYS = 'TAI' => 2020-01-15T20:00:00Z => 0
DATE-OBS= '2020-01-15T20:00:37(TAI)'; TIMESYS = 'UTC' => 2020-01-15T20:00:00Z => 0
DATE-OBS= '2020-01-15T20:00:00'; TIMESYS = 'LOCAL' => 2020-01-15 => 1
DATE-OBS= 'tonight'; DATE-BEG= '2020-01-15' => 2020-01-15 => 1";

#[test]
fn a_date_is_put_together_from_all_keywords() {
    for line in DATES.lines() {
        let [cards, expected, ignored] = line.split(" => ").collect::<Vec<_>>()[..] else {
            panic!("{line}");
        };
        let found = metadata_of(&cards.split("; ").collect::<Vec<_>>());
        assert_eq!(found.date.unwrap().to_iso(), expected, "{line}");
        let count = found.ignored.len().to_string();
        assert_eq!(count, ignored, "{line} {:?}", found.ignored);
        assert!(found.assumed.is_empty());
    }
}

#[test]
fn a_date_that_is_unclear_is_told() {
    let unclear = metadata_of(&["DATE-OBS= '02/03/2020'"]);
    assert_eq!(unclear.date.unwrap().to_iso(), "2020-03-02");
    assert_eq!(
        unclear.assumed[0].to_string(),
        "DATE-OBS is ambiguous: found 02/03/2020, read as day, month, year"
    );
    for (text, expected) in [
        (
            "15/01/20",
            "DATE-OBS is ignored: found 15/01/20, expected a year of four digits",
        ),
        (
            "1066-10-14",
            "DATE-OBS is ignored: found 1066-10-14, expected a year from 1850 to 2100",
        ),
        (
            "tonight",
            "DATE-OBS is ignored: found tonight, expected a date such as 2019-07-29, \
             2019-07-29T20:47:26 or 29/07/2019",
        ),
    ] {
        let metadata = metadata_of(&[&format!("DATE-OBS= '{text}'")]);
        assert_eq!(metadata.date, None);
        assert_eq!(metadata.ignored[0].to_string(), expected);
    }
}

#[test]
fn an_exposure_is_read_in_all_its_keywords() {
    for card in [
        "EXPTIME = 1.5",
        "EXPOSURE= 1.5",
        "EXP_TIME= 1.5",
        "EXP-TIME= 1.5",
        "XPOSURE = 1.5",
        "EXPOINUS= 1500000",
    ] {
        assert_eq!(metadata_of(&[card]).exposure_s, Some(1.5), "{card}");
    }
    let both = metadata_of(&["EXPOINUS= 1500000", "EXPTIME = 2"]);
    assert_eq!(both.exposure_s, Some(2.0));
}

#[test]
fn a_site_that_is_not_set_is_none() {
    for (cards, ignored) in [
        (&["SITELAT = 0.0", "SITELONG= 0.0"][..], 1),
        (
            &[
                "LAT-OBS = '+00 00 00'",
                "LONG-OBS= '00 00 00'",
                "ALT-OBS = 0",
            ],
            1,
        ),
        (&["SITELAT = '-0.0'", "SITELONG= '0'"], 1),
        (&["SITELAT = '     '", "SITELONG= ''"], 0),
        (&["SITELAT =", "SITELONG="], 0),
    ] {
        let metadata = metadata_of(cards);
        assert_eq!(
            (metadata.site, metadata.ignored.len()),
            (None, ignored),
            "{cards:?}"
        );
    }
    let second = metadata_of(&[
        "SITELAT = 0",
        "SITELONG= 0",
        "OBSGEO-B= 52.2",
        "OBSGEO-L= 4.4",
    ]);
    assert!(second.site.is_some());
    let equator = metadata_of(&["SITELAT = 0", "SITELONG= -78.5"]);
    assert!(equator.site.is_some());
}

#[test]
fn the_site_is_read_in_all_its_keywords() {
    for cards in [
        &[
            "SITELAT = '+52 13 12'",
            "SITELONG= '04 25 12'",
            "SITEELEV= 3",
        ][..],
        &["LAT-OBS = 52.22", "LONG-OBS= 4.42", "ALT-OBS = 3.0"],
        &["OBSGEO-B= 52.22", "OBSGEO-L= 4.42", "OBSGEO-H= 3.0"],
        &[
            "SITELAT = '52:13:12'",
            "SITELONG= '364:25:12'",
            "LAT-OBS = 52.22",
            "LONG-OBS= 4.42",
            "ALT-OBS = 3",
        ],
    ] {
        let site = metadata_of(cards).site.unwrap();
        let [lat, lon] = [site.lat_deg() - 52.22, site.lon_deg() - 4.42];
        assert!(lat.abs() < 1e-9 && lon.abs() < 1e-9, "{cards:?}");
        assert_eq!(site.height_m(), 3.0);
    }
    let south_west = metadata_of(&["SITELAT = '-30 14 27'", "SITELONG= '-70 44 12.0'"]);
    assert!(
        south_west
            .site
            .is_some_and(|s| s.lat_deg() < -30.2 && s.lon_deg() < -70.7)
    );
    let wrong = metadata_of(&["SITELAT = 'here'", "SITELONG= '4'", "CENTALT = '-5'"]);
    assert_eq!((wrong.site, wrong.zenith_distance_deg), (None, None));
    assert!(
        wrong.ignored[0]
            .to_string()
            .starts_with("SITELAT, SITELONG is ignored: found here, 4")
    );
    assert_eq!(wrong.ignored.len(), 2);
    let altitude = metadata_of(&["OBJCTALT= '61.2'"]).zenith_distance_deg;
    assert!((altitude.unwrap() - 28.8).abs() < 1e-9);
}

#[test]
fn absurd_values_are_recorded_and_the_next_keyword_is_used() {
    let metadata = metadata_of(&[
        "DATE-OBS= '0000-00-00T00:00:00'",
        "MJD-OBS = 51544.5",
        "EXPTIME = -1",
        "EXPOSURE= 2",
        "FOCALLEN= 0",
        "XPIXSZ  = NaN",
    ]);
    assert_eq!(metadata.date.unwrap().to_iso(), "2000-01-01T12:00:00Z");
    assert_eq!(metadata.exposure_s, Some(2.0));
    assert_eq!(
        (metadata.focal_length_mm, metadata.pixel_size_um),
        (None, None)
    );
    let named: Vec<_> = metadata
        .ignored
        .iter()
        .map(|n| n.keyword.as_str())
        .collect();
    assert_eq!(named, ["EXPTIME", "FOCALLEN", "XPIXSZ", "DATE-OBS"]);
    let none = metadata_of(&["MJD-OBS = 1E300", "DATE-OBS= 'tonight'"]);
    assert_eq!((none.date, none.ignored.len()), (None, 2));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn a_damaged_header_never_panics(
        changes in proptest::collection::vec((0_usize..1200, "[0-9A-Z=' /.\\-]"), 1..6),
        length in 0_usize..9000,
        page in 0_usize..5,
    ) {
        let cards = ["BZERO   = 32768", "BLANK   = -7", "DATE-OBS= '2019-07-29'", "EXPTIME = 2.5", "XPIXSZ  = 9.3"];
        let mut bytes = image(16, &[3, 3, 4], &cards, &words(&[1; 36]));
        bytes.extend(table(&[]));
        for (at, text) in changes {
            bytes[at] = text.as_bytes()[0];
        }
        bytes.truncate(length);
        let _ = decode(&bytes, NonZeroUsize::new(page));
    }
}

#[test]
fn pixels_without_light_tell_their_level_and_have_no_value() {
    let data = [10, 12, 200, 201, 11, 9, 202, 203, 10, 10, 204, 205];
    let section = |text: &str| format!("BIASSEC = '{text}'");
    let with = |text: &str| decode(&image(8, &[4, 3], &[&section(text)], &data), None).unwrap();
    let frame = with("[1:2,1:3]");
    let level_adu = frame.metadata.dark_level_adu.unwrap();
    assert!((level_adu - (9.5 + 2.0 / 3.0)).abs() < 0.01, "{level_adu}");
    let dark: Vec<bool> = frame.values().iter().map(|pixel| pixel.is_nan()).collect();
    assert_eq!(dark, [true, true, false, false].repeat(3));
    for wrong in ["[1:5,1:3]", "[1:4,1:3]", "overscan"] {
        let frame = with(wrong);
        assert_eq!(frame.metadata.dark_level_adu, None);
        assert_eq!(frame.metadata.ignored[0].keyword, "BIASSEC");
        assert!(frame.values().iter().all(|pixel| !pixel.is_nan()));
    }
}
