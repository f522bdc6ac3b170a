//! Image formats that are recognised but not read, and what to convert them to.
//!
//! Raw files of cameras are often TIFF files whose first image is a small preview. They are told by
//! what such a preview has, so that it is not taken for the frame.
//!
//! # Reference
//! ISO/IEC 14496-12 (file type box); TIFF 6.0 (1992), sect. 2; TIFF/EP (ISO 12234-2) and the DNG
//! specification for the tags of raw files.

use super::error::FrameError;
use super::tiff::{TiffFile, has_picture_in_sub_directories};

/// A format that is not read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct UnsupportedFormat {
    /// What it is, with an article.
    pub name: &'static str,
    /// What to do.
    pub advice: &'static str,
}

impl UnsupportedFormat {
    /// Whether it has many pictures, one after the other in time.
    pub(super) fn is_video(&self) -> bool {
        self.name.ends_with("video")
    }
}

impl From<UnsupportedFormat> for FrameError {
    fn from(known: UnsupportedFormat) -> Self {
        Self::ForeignFormat {
            found: known.name,
            advice: known.advice,
        }
    }
}

const PHOTOGRAPH: &str =
    "convert it to PNG first, for example with heif-convert FILE.heic FILE.png";
const RAW: &str = "develop it to 16-bit TIFF first, for example with LibRaw's dcraw_emu -4 -T FILE, \
                   or save it as TIFF or FITS with Siril, darktable or RawTherapee";
const VIDEO: &str = "save its frames as FITS or 16-bit TIFF first, for example with Siril or PIPP";
const PICTURE: &str =
    "convert it to PNG or 16-bit TIFF first, for example with magick FILE FILE.png";

const HEIC: UnsupportedFormat = UnsupportedFormat {
    name: "a HEIC photograph (HEIF)",
    advice: PHOTOGRAPH,
};
const AVIF: UnsupportedFormat = UnsupportedFormat {
    name: "an AVIF photograph",
    advice: "convert it to PNG first, for example with avifdec FILE.avif FILE.png",
};
const MP4: UnsupportedFormat = UnsupportedFormat {
    name: "an MP4 or QuickTime video",
    advice: "save its frames as PNG first, for example with ffmpeg -i FILE frame-%04d.png",
};
const MATROSKA: UnsupportedFormat = UnsupportedFormat {
    name: "a Matroska or WebM video",
    advice: MP4.advice,
};
const AVI: UnsupportedFormat = UnsupportedFormat {
    name: "an AVI video",
    advice: VIDEO,
};
const WEBP: UnsupportedFormat = UnsupportedFormat {
    name: "a WebP picture",
    advice: "convert it to PNG first, for example with dwebp FILE.webp -o FILE.png",
};

const fn raw(name: &'static str) -> UnsupportedFormat {
    UnsupportedFormat { name, advice: RAW }
}

const fn picture(name: &'static str) -> UnsupportedFormat {
    UnsupportedFormat {
        name,
        advice: PICTURE,
    }
}

/// Formats with a signature at the beginning.
const SIGNATURES: [(&[u8], UnsupportedFormat); 21] = [
    (b"\x1a\x45\xdf\xa3", MATROSKA),
    (
        b"FUJIFILMCCD-RAW",
        raw("a raw file of a Fujifilm camera (RAF)"),
    ),
    (b"IIRO", raw("a raw file of an Olympus camera (ORF)")),
    (b"IIRS", raw("a raw file of an Olympus camera (ORF)")),
    (b"MMOR", raw("a raw file of an Olympus camera (ORF)")),
    (b"IIU\0", raw("a raw file of a Panasonic camera (RW2)")),
    (b"FOVb", raw("a raw file of a Sigma camera (X3F)")),
    (b"\0MRM", raw("a raw file of a Minolta camera (MRW)")),
    (
        b"II\x1a\0\0\0HEAPCCDR",
        raw("a raw file of a Canon camera (CRW)"),
    ),
    (
        b"XISF0100",
        UnsupportedFormat {
            name: "an XISF image",
            advice: "save it as FITS first, with PixInsight or Siril",
        },
    ),
    (
        b"LUCAM-RECORDER",
        UnsupportedFormat {
            name: "a SER video",
            advice: VIDEO,
        },
    ),
    (b"GIF87a", picture("a GIF picture")),
    (b"GIF89a", picture("a GIF picture")),
    (b"\0\0\0\x0cJXL \r\n\x87\n", picture("a JPEG XL picture")),
    (b"\xff\x0a", picture("a JPEG XL picture")),
    (b"\0\0\0\x0cjP  \r\n\x87\n", picture("a JPEG 2000 picture")),
    (b"\xff\x4f\xff\x51", picture("a JPEG 2000 picture")),
    (b"8BPS", picture("a Photoshop document")),
    (b"\x76\x2f\x31\x01", picture("an OpenEXR image")),
    (b"qoif", picture("a QOI picture")),
    (b"%PDF", picture("a PDF document")),
];

/// The format of `bytes`, if it is one that is known but not read.
pub(super) fn detect(bytes: &[u8]) -> Option<UnsupportedFormat> {
    let by_signature = SIGNATURES
        .iter()
        .find(|(start, _)| bytes.starts_with(start));
    by_signature
        .map(|&(_, foreign)| foreign)
        .or_else(|| of_boxes(bytes))
        .or_else(|| of_riff(bytes))
}

/// Files of the ISO base media format: by the main brand, else by the compatible ones.
fn of_boxes(bytes: &[u8]) -> Option<UnsupportedFormat> {
    let length = u32::from_be_bytes(*bytes.first_chunk()?) as usize;
    let (kind, brands) = bytes.get(4..bytes.len().min(length))?.split_at_checked(4)?;
    if kind != b"ftyp" {
        return None;
    }
    let known = |brand: &[u8; 4]| match brand {
        b"heic" | b"heix" | b"hevc" | b"hevx" | b"heim" | b"heis" | b"mif1" | b"msf1" => Some(HEIC),
        b"avif" | b"avis" => Some(AVIF),
        b"crx " => Some(raw("a raw file of a Canon camera (CR3)")),
        _ => None,
    };
    // A main brand of "mif1" says only that it is a still picture.
    let mut all = brands
        .as_chunks()
        .0
        .iter()
        .filter(|brand| *brand != b"mif1");
    all.find_map(known)
        .or_else(|| brands.as_chunks().0.iter().find_map(known))
        .or(Some(MP4))
}

fn of_riff(bytes: &[u8]) -> Option<UnsupportedFormat> {
    match (bytes.get(..4)?, bytes.get(8..12)?) {
        (b"RIFF", b"WEBP") => Some(WEBP),
        (b"RIFF", b"AVI ") => Some(AVI),
        _ => None,
    }
}

/// The kind of raw file that this TIFF file is, if it is one.
pub(super) fn raw_tiff(bytes: &[u8]) -> Option<UnsupportedFormat> {
    const CFA: u64 = 32803;
    const REDUCED_IMAGE: u64 = 1;
    let first = TiffFile::parse(bytes).ok()?.directories().next()?.ok()?;
    let is = |tag: u16, value: u64| first.first(tag, 0).is_ok_and(|found| found == value);
    if first.has(50706) {
        return Some(raw("a raw file in Adobe's format (DNG)"));
    }
    if bytes.get(8..10) == Some(b"CR") {
        return Some(raw("a raw file of a Canon camera (CR2)"));
    }
    // A picture may have a preview before it, too.
    let is_preview = is(254, REDUCED_IMAGE) && first.has(330);
    let is_raw = is_preview && !has_picture_in_sub_directories(&first);
    if !is_raw && !is(262, CFA) {
        return None;
    }
    let make = first.bytes_of(271).ok().flatten().unwrap_or_default();
    let make = make.to_ascii_uppercase();
    Some(raw(if make.starts_with(b"NIKON") {
        "a raw file of a Nikon camera (NEF)"
    } else if make.starts_with(b"SONY") {
        "a raw file of a Sony camera (ARW)"
    } else if make.starts_with(b"PENTAX") || make.starts_with(b"RICOH") {
        "a raw file of a Pentax camera (PEF)"
    } else {
        "a camera's raw file"
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn name(bytes: &[u8]) -> &'static str {
        detect(bytes).map_or("", |foreign| foreign.name)
    }

    fn boxed(main: &[u8; 4], compatible: &[u8]) -> Vec<u8> {
        let length = (16 + compatible.len()) as u32;
        let mut bytes = length.to_be_bytes().to_vec();
        bytes.extend(b"ftyp");
        bytes.extend(main);
        bytes.extend([0; 4]);
        bytes.extend(compatible);
        bytes.extend(b"\0\0\0\x08mdat");
        bytes
    }

    #[test]
    fn formats_are_known_by_their_content() {
        for (bytes, part) in [
            (boxed(b"heic", b"mif1heic"), "HEIC"),
            (boxed(b"mif1", b"mif1heic"), "HEIC"),
            (boxed(b"mif1", b"mif1avif"), "AVIF"),
            (boxed(b"avif", b"mif1"), "AVIF"),
            (boxed(b"crx ", b"isom"), "CR3"),
            (boxed(b"mp42", b"isom"), "MP4"),
            (b"RIFF\x24\0\0\0WEBPVP8 ".to_vec(), "WebP"),
            (b"RIFF\x24\0\0\0AVI LIST".to_vec(), "AVI"),
            (b"GIF89a\x01\0".to_vec(), "GIF"),
            (b"XISF0100\0\0".to_vec(), "XISF"),
            (b"LUCAM-RECORDER\0".to_vec(), "SER"),
            (b"FUJIFILMCCD-RAW 0201".to_vec(), "RAF"),
        ] {
            let name = name(&bytes);
            assert!(name.contains(part), "{part}: {name}");
        }
        for bytes in [
            &b""[..],
            b"\0\0\0",
            b"\0\0\0\x08ftyp",
            b"RIFF",
            b"text of no format",
        ] {
            assert!(!name(bytes).contains("HEIC"), "{bytes:?}");
        }
        assert_eq!(detect(b"RIFF\x24\0\0\0WAVEfmt "), None);
        assert_eq!(detect(b"text of no format"), None);
    }

    /// A TIFF file of one directory: tags with a long each, and the maker at the end.
    fn tiff(is_little_endian: bool, tags: &[(u16, u32)], make: &[u8]) -> Vec<u8> {
        let word = |v: u16| {
            if is_little_endian {
                v.to_le_bytes()
            } else {
                v.to_be_bytes()
            }
        };
        let long = |v: u32| {
            if is_little_endian {
                v.to_le_bytes()
            } else {
                v.to_be_bytes()
            }
        };
        let mut bytes = if is_little_endian { b"II*\0" } else { b"MM\0*" }.to_vec();
        bytes.extend(long(8));
        bytes.extend(word(tags.len() as u16 + 1));
        for (tag, value) in tags {
            bytes.extend(word(*tag));
            bytes.extend(word(4));
            bytes.extend(long(1));
            bytes.extend(long(*value));
        }
        bytes.extend(word(271));
        bytes.extend(word(2));
        bytes.extend(long(make.len() as u32));
        let after = bytes.len() as u32 + 8;
        bytes.extend(long(after));
        bytes.extend(long(0));
        bytes.extend(make);
        bytes
    }

    #[test]
    fn raw_files_that_are_tiff_are_told_from_pictures() {
        let preview = [(254, 1), (330, 1000)];
        for little in [false, true] {
            let name = |tags: &[(u16, u32)], make: &[u8]| {
                raw_tiff(&tiff(little, tags, make)).map_or("", |foreign| foreign.name)
            };
            assert!(name(&preview, b"NIKON CORPORATION\0").contains("NEF"));
            assert!(name(&preview, b"SONY\0\0").contains("ARW"));
            assert!(name(&preview, b"Unknown\0").contains("a camera's raw file"));
            assert!(name(&[(262, 32803)], b"Unknown\0").contains("raw"));
            assert!(name(&[(50706, 1)], b"Unknown\0").contains("DNG"));
            // A picture may have a smaller copy of itself, and a maker.
            assert_eq!(name(&[(254, 0), (330, 1000)], b"NIKON CORPORATION\0"), "");
            assert_eq!(name(&[(262, 1)], b"SONY\0\0"), "");
        }
        let mut canon = tiff(true, &[(254, 0)], b"Canon\0");
        canon.splice(4..8, 16_u32.to_le_bytes());
        canon.splice(8..8, *b"CR\x02\0\0\0\0\0");
        assert!(raw_tiff(&canon).is_some_and(|foreign| foreign.name.contains("CR2")));
        let whole = tiff(true, &preview, b"NIKON\0\0");
        for length in 0..whole.len() {
            // No end of a file is too early.
            let _ = raw_tiff(&whole[..length]);
        }
    }
}
