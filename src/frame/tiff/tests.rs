//! TIFF files made by hand, of every layout.

use super::directory::{TiffDirectory, TiffFile};
use super::has_picture_in_sub_directories;
use crate::base::size::Size;
use crate::frame::{Frame, FrameError, decode, decode_page};
use proptest::prelude::*;
use std::num::NonZeroUsize;

/// An image of a TIFF file: its tags, but for those of its strips or tiles.
#[derive(Clone)]
struct Page {
    tags: Vec<(u16, Vec<u32>)>,
    is_tiled: bool,
    chunks: Vec<Vec<u8>>,
    attached: Vec<Page>,
}

impl Page {
    fn new(tags: &[(u16, u32)], chunks: &[Vec<u8>]) -> Self {
        Self {
            tags: tags
                .iter()
                .map(|&(tag, value)| (tag, vec![value]))
                .collect(),
            is_tiled: tags.iter().any(|(tag, _)| *tag == 322),
            chunks: chunks.to_vec(),
            attached: Vec::new(),
        }
    }

    /// A grey page of 8 bits, all of one level.
    fn grey(width: u32, height: u32, level: u8) -> Self {
        let tags = [(256, width), (257, height), (258, 8), (262, 1)];
        Self::new(&tags, &[vec![level; (width * height) as usize]])
    }

    fn with(mut self, tag: u16, value: u32) -> Self {
        self.tags.retain(|(known, _)| *known != tag);
        self.tags.push((tag, vec![value]));
        self
    }

    fn with_attached(mut self, page: Self) -> Self {
        self.attached.push(page);
        self
    }
}

/// Writes numbers in one byte order.
struct Writer {
    bytes: Vec<u8>,
    is_little_endian: bool,
}

impl Writer {
    fn number(&mut self, value: u32, bytes: usize) {
        let value = value.to_be_bytes();
        let mut value = value[4 - bytes..].to_vec();
        if self.is_little_endian {
            value.reverse();
        }
        self.bytes.extend(value);
    }

    /// Appends a page and returns its place, and where the place of the next one is written.
    fn page(&mut self, page: &Page) -> (u32, usize) {
        let attached: Vec<u32> = page.attached.iter().map(|page| self.page(page).0).collect();
        let mut offsets = Vec::new();
        for chunk in &page.chunks {
            offsets.push(self.bytes.len() as u32);
            self.bytes.extend(chunk);
        }
        let lengths = page.chunks.iter().map(|chunk| chunk.len() as u32).collect();
        let (place, length) = if page.is_tiled {
            (324, 325)
        } else {
            (273, 279)
        };
        let mut tags = page.tags.clone();
        tags.extend([(place, offsets), (length, lengths)]);
        if !attached.is_empty() {
            tags.push((330, attached));
        }
        tags.sort_unstable();
        let mut values = Vec::new();
        for (_, numbers) in &tags {
            values.push(self.bytes.len() as u32);
            if numbers.len() > 1 {
                numbers.iter().for_each(|number| self.number(*number, 4));
            }
        }
        let start = self.bytes.len() as u32;
        self.number(tags.len() as u32, 2);
        for ((tag, numbers), place) in tags.iter().zip(values) {
            self.number((*tag).into(), 2);
            self.number(4, 2);
            self.number(numbers.len() as u32, 4);
            self.number(
                if numbers.len() == 1 {
                    numbers[0]
                } else {
                    place
                },
                4,
            );
        }
        let next = self.bytes.len();
        self.number(0, 4);
        (start, next)
    }
}

fn tiff(pages: &[Page], is_little_endian: bool) -> Vec<u8> {
    let start = if is_little_endian { b"II*\0" } else { b"MM\0*" };
    let mut writer = Writer {
        bytes: start.to_vec(),
        is_little_endian,
    };
    writer.number(0, 4);
    let mut link = 4;
    for page in pages {
        let (start, next) = writer.page(page);
        let end = writer.bytes.len();
        writer.number(start, 4);
        let start = writer.bytes.split_off(end);
        writer.bytes[link..link + 4].copy_from_slice(&start);
        link = next;
    }
    writer.bytes
}

fn read(page: &Page) -> Frame<'static> {
    decode(&tiff(std::slice::from_ref(page), true)).unwrap()
}

fn error(page: &Page) -> String {
    let error = decode(&tiff(std::slice::from_ref(page), true)).unwrap_err();
    error.to_string()
}

/// How the samples of an image are stored.
#[derive(Debug, Clone)]
struct Storage {
    width: usize,
    height: usize,
    bits: u32,
    samples: usize,
    is_planar: bool,
    /// Size of a tile, else the rows of a strip.
    tile: Option<Size>,
    rows_per_strip: usize,
    is_little_endian: bool,
    is_bit_reversed: bool,
    is_white_zero: bool,
}

impl Storage {
    /// The level of a sample.
    fn level(&self, x: usize, y: usize, sample: usize) -> u32 {
        let number = (x * 7919 + y * 104_729 + sample * 1_299_709) as u32;
        number.wrapping_mul(2_654_435_761) >> (32 - self.bits)
    }

    fn packed(&self, levels: &[u32]) -> Vec<u8> {
        let bytes = self
            .bits
            .is_multiple_of(8)
            .then_some(self.bits as usize / 8);
        let packed: Vec<u8> = match bytes {
            Some(bytes) if self.is_little_endian => levels
                .iter()
                .flat_map(|level| level.to_le_bytes()[..bytes].to_vec())
                .collect(),
            _ => {
                let width = self.bits as usize;
                let digits: Vec<String> = levels
                    .iter()
                    .map(|level| format!("{level:0width$b}"))
                    .collect();
                let digits = digits.concat();
                let byte = |digits: &[u8]| {
                    let digits = std::str::from_utf8(digits).unwrap();
                    u8::from_str_radix(&format!("{digits:0<8}"), 2).unwrap()
                };
                digits.as_bytes().chunks(8).map(byte).collect()
            }
        };
        if self.is_bit_reversed {
            return packed.iter().map(|byte| byte.reverse_bits()).collect();
        }
        packed
    }

    /// One chunk: rows of the samples from `first` to `end`, 0 outside the image.
    fn chunk(&self, left: usize, top: usize, samples: std::ops::Range<usize>) -> Vec<u8> {
        let Size {
            width: columns,
            height: rows,
        } = self
            .tile
            .unwrap_or_else(|| Size::new(self.width, self.rows_per_strip.min(self.height - top)));
        let full = u32::MAX >> (32 - self.bits);
        let rows = (top..top + rows).map(|y| {
            let pixels = (left..left + columns).flat_map(|x| {
                let is_inside = x < self.width && y < self.height;
                samples.clone().map(move |sample| match is_inside {
                    true if self.is_white_zero => full - self.level(x, y, sample),
                    true => self.level(x, y, sample),
                    false => 0,
                })
            });
            let levels: Vec<u32> = pixels.collect();
            self.packed(&levels)
        });
        rows.collect::<Vec<_>>().concat()
    }

    fn page(&self) -> Page {
        let strip = Size::new(self.width, self.rows_per_strip);
        let Size {
            width: columns,
            height: rows,
        } = self.tile.unwrap_or(strip);
        let planes: Vec<std::ops::Range<usize>> = if self.is_planar {
            (0..self.samples).map(|sample| sample..sample + 1).collect()
        } else {
            std::iter::once(0..self.samples).collect()
        };
        let mut chunks = Vec::new();
        for plane in planes {
            for top in (0..self.height).step_by(rows) {
                for left in (0..self.width).step_by(columns) {
                    chunks.push(self.chunk(left, top, plane.clone()));
                }
            }
        }
        let color = match (self.samples, self.is_white_zero) {
            (3.., _) => 2,
            (_, true) => 0,
            (_, false) => 1,
        };
        let mut page = Page::new(
            &[
                (256, self.width as u32),
                (257, self.height as u32),
                (262, color),
                (266, 1 + u32::from(self.is_bit_reversed)),
                (277, self.samples as u32),
                (284, 1 + u32::from(self.is_planar)),
            ],
            &chunks,
        );
        page.tags.push((258, vec![self.bits; self.samples]));
        match self.tile {
            Some(Size { width, height }) => {
                page.is_tiled = true;
                page = page.with(322, width as u32).with(323, height as u32);
            }
            None => page = page.with(278, self.rows_per_strip as u32),
        }
        page
    }

    /// The value of a pixel: of the first channel, or the luminance.
    fn expected(&self, x: usize, y: usize) -> f32 {
        let level = |sample: usize| self.level(x, y, sample) as f32;
        if self.samples < 3 {
            return level(0);
        }
        let full = (u32::MAX >> (32 - self.bits)) as f32;
        let channels = [level(0), level(1), level(2)];
        if channels.contains(&full) {
            return full;
        }
        let weights = crate::frame::LUMINANCE_WEIGHTS;
        channels.iter().zip(weights).map(|(c, w)| c * w).sum()
    }
}

prop_compose! {
    fn storage()(
        (width, height) in (3_usize..30, 3_usize..30),
        (bits, samples) in (1_u32..=32, 1_usize..=4),
        is_planar: bool,
        tile in proptest::option::of((1_usize..20, 1_usize..20)),
        rows_per_strip in 1_usize..40,
        (is_little_endian, is_bit_reversed, is_white_zero) in any::<(bool, bool, bool)>(),
    ) -> Storage {
        Storage {
            width,
            height,
            bits,
            samples,
            is_planar: is_planar && samples > 1,
            tile: tile.map(|(width, height)| Size::new(width, height)),
            rows_per_strip,
            is_little_endian,
            is_bit_reversed,
            is_white_zero: is_white_zero && samples < 3,
        }
    }
}

proptest! {
    #[test]
    fn every_layout_gives_the_levels_that_were_stored(storage in storage()) {
        let frame = decode(&tiff(&[storage.page()], storage.is_little_endian)).unwrap();
        prop_assert_eq!((frame.width, frame.height), (storage.width, storage.height));
        let values = frame.values();
        for y in 0..storage.height {
            for x in 0..storage.width {
                let (found, expected) = (values[y * storage.width + x], storage.expected(x, y));
                let is_near = (found - expected).abs() <= 1e-6 * expected;
                prop_assert!(is_near, "({x}, {y}): {found}, expected {expected}");
            }
        }
    }

    #[test]
    fn damaged_files_of_every_layout_never_panic(
        storage in storage(),
        changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        end in any::<prop::sample::Index>(),
    ) {
        let mut bytes = tiff(&[storage.page()], storage.is_little_endian);
        for (index, value) in changes {
            let place = index.index(bytes.len());
            bytes[place] = value;
        }
        let _ = decode(&bytes);
        let _ = decode(&bytes[..end.index(bytes.len())]);
    }
}

#[test]
fn full_scale_is_that_of_the_bits() {
    for bits in [1, 7, 10, 12, 14, 15, 16, 24] {
        let row = vec![0; (5 * bits as usize).div_ceil(8)];
        let page = Page::new(
            &[(256, 5), (257, 3), (258, bits), (262, 1)],
            &[row.repeat(3)],
        );
        let frame = read(&page);
        let full = (u32::MAX >> (32 - bits)) as f32;
        assert_eq!(
            (frame.step_adu, frame.saturation_adu),
            (1.0, Some(full)),
            "{bits}"
        );
    }
}

#[test]
fn what_is_not_read_is_named_with_what_is() {
    let grey = || Page::grey(5, 3, 7);
    let mut mixed = grey().with(262, 2).with(277, 3);
    mixed.tags.retain(|(tag, _)| *tag != 258);
    mixed.tags.push((258, vec![5, 6, 5]));
    for (page, found) in [
        (
            grey().with(258, 33),
            "unsigned integers of 33 bits, expected",
        ),
        (
            grey().with(258, 12).with(339, 2),
            "signed integers of 12 bits",
        ),
        (grey().with(258, 24).with(339, 3), "floats of 24 bits"),
        (grey().with(339, 6), "samples of type 6"),
        (mixed, "samples of 5, 6, 5 bits"),
        (grey().with(262, 3), "a color palette"),
        (grey().with(262, 5), "CMYK"),
        (
            grey().with(262, 6).with(277, 3),
            "YCbCr that is not in JPEG",
        ),
        (grey().with(277, 3), "3 samples of a gray pixel"),
        (grey().with(259, 6), "old-style JPEG (compression 6)"),
        (grey().with(259, 7).with(258, 12), "JPEG of 12 bits"),
        (grey().with(259, 7).with(277, 2), "JPEG of 2 samples"),
        (grey().with(259, 3), "group 3"),
        (grey().with(259, 50_000), "Zstandard"),
        (
            grey().with(259, 5).with(317, 2).with(258, 12),
            "predictor 2 with 12 bits",
        ),
        (grey().with(278, 0), "RowsPerStrip is 0"),
        (grey().with(278, 1), "1 strips, expected 3"),
        (grey().with(322, 0).with(323, 16), "TileWidth is 0"),
        (grey().with(284, 3), "PlanarConfiguration 3"),
    ] {
        let page = Page {
            is_tiled: page.tags.iter().any(|(tag, _)| *tag == 322),
            ..page
        };
        let error = error(&page);
        assert!(error.contains(found), "{found}: {error}");
    }
    let absent = Page::new(&[(256, 5), (257, 3), (258, 8)], &[vec![0; 15]]);
    assert!(error(&absent).contains("no PhotometricInterpretation"));
}

#[test]
fn the_largest_image_is_the_frame_wherever_it_is() {
    let small = || Page::grey(4, 3, 1).with(254, 1);
    let large = |level: u8| Page::grey(40, 30, level);
    let level = |pages: &[Page], page: usize| {
        let frame = decode_page(&tiff(pages, false), NonZeroUsize::new(page)).unwrap();
        let choice = frame.metadata.choice.as_ref().map(ToString::to_string);
        (frame.at(0, 0), choice.unwrap_or_default())
    };
    let first = (2.0, String::new());
    assert_eq!(
        level(&[large(2), large(3)], 0),
        first,
        "of equal ones, the first"
    );
    assert_eq!(level(&[large(2), small()], 0), first);
    let later = [small(), large(2), Page::grey(20, 15, 3)];
    assert_eq!(
        level(&later, 0),
        (
            2.0,
            "the largest of 3 images in the file was read: page 2, 40 × 30 pixels; the first image has 4 × \
             3 pixels"
                .to_owned()
        )
    );
    assert_eq!(level(&later, 1), (1.0, String::new()), "as chosen");
    assert_eq!(level(&later, 3), (3.0, String::new()));
    let attached = small().with_attached(large(2).with(254, 0));
    let (found, note) = level(std::slice::from_ref(&attached), 0);
    assert_eq!(found, 2.0);
    assert!(
        note.contains("the image attached to page 1, 40 × 30"),
        "{note}"
    );
    assert_eq!(level(&[attached], 1).0, 1.0);
    // A mask of transparency is no picture.
    let mask = large(9).with(254, 4);
    assert_eq!(level(&[Page::grey(20, 15, 2), mask], 0), first);
}

#[test]
fn raw_data_behind_a_preview_are_not_hidden_by_it() {
    let preview = Page::grey(4, 3, 1).with(254, 1);
    let raw = Page::grey(40, 30, 2).with(262, 32_803);
    let error = error(&preview.with_attached(raw));
    assert!(error.contains("a camera's raw file"), "{error}");
}

#[test]
fn an_attached_image_is_turned_as_its_page_is() {
    let page = Page::grey(4, 3, 1).with(254, 1).with(274, 6);
    let frame = read(&page.clone().with_attached(Page::grey(40, 30, 2)));
    assert_eq!((frame.width, frame.height), (30, 40));
    let frame = read(&page.with_attached(Page::grey(40, 30, 2).with(274, 1)));
    assert_eq!((frame.width, frame.height), (40, 30));
}

#[test]
fn directories_that_follow_each_other_in_a_circle_end() {
    let mut bytes = tiff(&[Page::grey(4, 3, 1), Page::grey(40, 30, 2)], true);
    // The second one is last in the file, and its successor is the first.
    let first: [u8; 4] = *bytes[4..].first_chunk().unwrap();
    let end = bytes.len() - 4;
    bytes[end..].copy_from_slice(&first);
    assert_eq!(decode(&bytes).unwrap().at(0, 0), 2.0);
    let error = decode_page(&bytes, NonZeroUsize::new(5)).unwrap_err();
    assert!(error.to_string().contains("leads back"), "{error}");
}

#[test]
fn a_chunk_that_the_file_does_not_have_is_truncated() {
    let whole = tiff(&[Page::grey(40, 30, 2)], true);
    for compression in [1, 5, 8, 32_773] {
        let mut page = Page::grey(40, 30, 2).with(259, compression);
        page.chunks = vec![Vec::new()];
        let read = decode(&tiff(&[page], true));
        assert!(
            matches!(
                read,
                Err(FrameError::Truncated { .. } | FrameError::Malformed { .. })
            ) || compression == 1,
            "{compression}: {read:?}"
        );
    }
    for end in 0..whole.len() {
        assert!(
            decode(&whole[..end]).is_err() || end + 4 >= whole.len(),
            "{end}"
        );
    }
}

#[test]
fn samples_of_a_pixel_need_no_memory_before_their_bytes_are_there() {
    let page = Page::grey(1_000_000, 3, 2).with(262, 2).with(277, 65_535);
    let read = decode(&tiff(&[page], true));
    assert!(
        matches!(read, Err(FrameError::Truncated { .. })),
        "{read:?}"
    );
}

#[test]
fn numbers_of_a_directory_are_of_the_types_that_hold_them() {
    let bytes = tiff(&[Page::grey(4, 3, 1)], false);
    let file = TiffFile::parse(&bytes).unwrap();
    let directories: Result<Vec<TiffDirectory>, FrameError> = file.directories().collect();
    let [directory] = directories.unwrap().try_into().ok().unwrap();
    let numbers = |tag: u16| -> Vec<u64> { directory.numbers(tag).unwrap().iter().collect() };
    assert_eq!(numbers(256), [4]);
    assert!(numbers(999).is_empty());
    assert_eq!(directory.first(999, 5).unwrap(), 5);
    assert!(!has_picture_in_sub_directories(&directory));
}
