//! The scans of a JPEG file: how much work they are, and whether they are all there.

use super::error::FrameError;
use super::format::FrameFormat;
use crate::base::size::Size;
use memchr::{memchr, memmem};

/// Pixels of all scans together. Cameras write ten scans or fewer.
const MAX_PIXELS_IN_SCANS: usize = 4_000_000_000;

/// Second byte of the marker that begins a scan.
const START_OF_SCAN: u8 = 0xda;
/// Second byte of the marker that begins a progressive image.
const START_OF_PROGRESSIVE: u8 = 0xc2;
/// Second byte of the marker that ends the image.
const END_OF_IMAGE: u8 = 0xd9;

/// The scans of a file.
pub(super) struct Scans {
    /// How many there are, without those of thumbnails and of what comes after the image.
    pub count: usize,
    is_progressive: bool,
}

impl Scans {
    /// The scans of the image in `bytes`.
    pub fn parse(bytes: &[u8]) -> Self {
        let (mut at, mut count, mut is_progressive) = (2, 0, false);
        while let Some((marker, end)) = next_marker(bytes, at) {
            match marker {
                END_OF_IMAGE => break,
                // In scan data these stand for a byte 0xff, and for a restart.
                0x00 | 0xd0..=0xd7 => at = end,
                _ => {
                    count += usize::from(marker == START_OF_SCAN);
                    is_progressive |= marker == START_OF_PROGRESSIVE;
                    let length = bytes.get(end..).and_then(<[u8]>::first_chunk);
                    at = end + length.map_or(2, |length| usize::from(u16::from_be_bytes(*length)));
                }
            }
        }
        Self {
            count,
            is_progressive,
        }
    }

    /// Whether the decoder must have all of them before it has a pixel.
    pub fn are_collected(&self) -> bool {
        self.is_progressive || self.count > 1
    }

    /// Refuses more scans of an image of this size than any camera writes: each is a pass over all
    /// pixels, however few bytes it has.
    pub fn check(&self, size: Size) -> Result<(), FrameError> {
        let Size { width, height } = size;
        let pixels = width.saturating_mul(height).saturating_mul(self.count);
        if pixels <= MAX_PIXELS_IN_SCANS {
            return Ok(());
        }
        Err(FrameError::Unsupported {
            format: FrameFormat::Jpeg,
            found: format!("{} scans of {width} x {height} pixels", self.count),
            expected: "fewer",
        })
    }
}

/// The second byte of the next marker from `at` on, and where the marker ends.
fn next_marker(bytes: &[u8], at: usize) -> Option<(u8, usize)> {
    let start = at + memchr(0xff, bytes.get(at..)?)?;
    let fill = bytes[start..]
        .iter()
        .take_while(|byte| **byte == 0xff)
        .count();
    let end = start + fill;
    bytes.get(end).map(|marker| (*marker, end + 1))
}

/// Whether an end-of-image marker follows the last start of a scan; scan data cannot contain
/// either.
pub(super) fn has_end(bytes: &[u8]) -> bool {
    let last = |marker: u8| memmem::rfind(bytes, &[0xff, marker]);
    match (last(START_OF_SCAN), last(END_OF_IMAGE)) {
        (Some(scan), Some(end)) => end > scan,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scans_are_those_of_the_image_alone() {
        let segment = |marker: u8, data: &[u8]| {
            let length = (data.len() + 2) as u8;
            [&[0xff, marker, 0, length], data].concat()
        };
        let thumbnail = [0xff, START_OF_SCAN, 0xff, START_OF_SCAN];
        let scan = [
            segment(START_OF_SCAN, &[1, 1, 0, 0, 63, 0]),
            vec![1, 0xff, 0, 2, 0xff, 0xd0, 3],
        ]
        .concat();
        let file = |scans: usize| {
            let image = [&[0xff, 0xd8][..], &segment(0xe1, &thumbnail)].concat();
            let video = [0xff, START_OF_SCAN, 0, 9];
            [
                &image[..],
                &scan.repeat(scans),
                &[0xff, END_OF_IMAGE],
                &video,
            ]
            .concat()
        };
        for scans in [0, 1, 3] {
            assert_eq!(Scans::parse(&file(scans)).count, scans);
        }
        // Whatever is cut off, it ends.
        for end in 0..file(2).len() {
            assert!(Scans::parse(&file(2)[..end]).count <= 2);
        }
        let sizes = [(20_000, 10_000), (63_245, 63_245), (63_246, 63_246)];
        let one = Scans {
            count: 1,
            is_progressive: true,
        };
        assert_eq!(
            sizes.map(|(width, height)| one.check(Size::new(width, height)).is_ok()),
            [true, true, false]
        );
    }
}
