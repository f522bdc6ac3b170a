//! Readers of images.

use starpipe::Frame;
use starpipe::calibration::darks::{DarkConfig, DarkStack, FrameStatistics};
use starpipe::frame::{self, Buffers, MAX_PAGES, MAX_PIXELS, MIN_SIDE_PX, MemoryLimit, Pages};
use std::num::NonZeroUsize;

/// A small limit: what asks for more is refused, and each run stays fast.
const MEMORY: MemoryLimit = MemoryLimit::of_bytes(50_000_000);

fn buffers() -> Buffers {
    let mut buffers = Buffers::new();
    buffers.set_memory(MEMORY);
    buffers
}

/// The first byte is the page, the rest a file in any format.
pub fn image(data: &[u8]) {
    let Some((page, bytes)) = data.split_first() else {
        return;
    };
    let page = NonZeroUsize::new(usize::from(*page % 4));
    let read = || frame::read_stream(bytes, page, &mut buffers());
    match (read(), read()) {
        (Ok(found), Ok(again)) => {
            check(&found);
            assert_eq!(bits(&found), bits(&again));
        }
        (Err(found), Err(again)) => assert_eq!(told(&found), told(&again)),
        _ => panic!("read once, refused once"),
    }
}

/// Exif attributes, in a small JPEG.
pub fn exif(attributes: &[u8]) {
    const JPEG: &[u8] = include_bytes!("../corpus/jpeg/grey.bin");
    const APP1: [u8; 2] = [0xff, 0xe1];
    const EXIF: &[u8] = b"Exif\0\0";
    let Ok(length) = u16::try_from(2 + EXIF.len() + attributes.len()) else {
        return;
    };
    // Of the corpus's input the first byte is the page; then come two that begin each JPEG.
    let (start, rest) = JPEG.split_at(3);
    let pieces = [start, &APP1, &length.to_be_bytes(), EXIF, attributes, rest];
    image(&pieces.concat());
}

/// A file in any format, of which each image is read.
pub fn pages(bytes: &[u8]) {
    let Ok(mut pages) = Pages::from_bytes(bytes.to_vec(), &mut buffers()) else {
        return;
    };
    for _ in 0..20 {
        let Some(page) = pages.advance() else { break };
        let found = pages.image(&mut buffers());
        assert!(page.get() <= MAX_PAGES);
        let alone = frame::read_stream(bytes, Some(page), &mut buffers());
        match (found, alone) {
            (Ok(found), Ok(alone)) => {
                check(&found);
                assert_eq!(bits(&found), bits(&alone));
            }
            (Ok(_), Err(error)) => panic!("image {page} is read with the others alone: {error}"),
            (Err(error), _) => {
                told(&error);
            }
        }
    }
}

/// A file in any format as a dark frame: a sequence of exposures of it.
pub fn darks(bytes: &[u8]) {
    let Ok(frame) = frame::read_stream(bytes, None, &mut buffers()) else {
        return;
    };
    let mut stack = DarkStack::new();
    for exposure_s in [0.1, 1.0, 10.0] {
        let statistics = FrameStatistics::measure("dark", &frame, Some(exposure_s));
        if stack.add(&frame, statistics).is_err() {
            return;
        }
    }
    if let Ok(darks) = stack.measure(&DarkConfig::default()) {
        let json = serde_json::to_string(&darks.report()).expect("a report is JSON");
        assert!(!json.contains("inf"), "{json}");
        assert!(!darks.report().to_text().contains("NaN"));
    }
}

/// What holds for every frame.
fn check(frame: &Frame) {
    let (width, height) = (frame.width, frame.height);
    assert!(width >= MIN_SIDE_PX && height >= MIN_SIDE_PX);
    assert!(width * height <= MAX_PIXELS);
    assert_eq!(frame.pixels.len(), width * height);
    assert!(frame.values().iter().all(|value| !value.is_infinite()));
    assert!(frame.step_adu.is_finite());
    if let Some(exposure_s) = frame.metadata.exposure_s {
        assert!(exposure_s.is_finite() && exposure_s > 0.0);
    }
}

fn bits(frame: &Frame) -> Vec<u32> {
    frame.values().iter().map(|value| value.to_bits()).collect()
}

/// The message of an error: some words on one line or more.
fn told(error: &frame::FrameError) -> String {
    let text = error.to_string();
    assert!(!text.is_empty());
    text
}
