//! File formats and the signatures that identify them.

use std::fmt;

/// A file format that can be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum FrameFormat {
    /// Flexible Image Transport System.
    Fits,
    /// Tagged Image File Format, also BigTIFF.
    Tiff,
    /// Portable Network Graphics.
    Png,
    /// JPEG (JFIF or Exif).
    Jpeg,
    /// Windows bitmap.
    Bmp,
    /// Portable anymap: PBM, PGM, PPM or PAM.
    Pnm,
    /// Any of the formats above, compressed with gzip.
    Gzip,
    /// The same with bzip2.
    Bzip2,
}

impl fmt::Display for FrameFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Fits => "FITS",
            Self::Tiff => "TIFF",
            Self::Png => "PNG",
            Self::Jpeg => "JPEG",
            Self::Bmp => "BMP",
            Self::Pnm => "PNM",
            Self::Gzip => "gzip",
            Self::Bzip2 => "bzip2",
        })
    }
}

impl FrameFormat {
    /// Whether it is one of the other formats, compressed.
    pub(super) fn is_compressed(self) -> bool {
        matches!(self, Self::Gzip | Self::Bzip2)
    }

    /// The format whose signature `bytes` begin with.
    pub(super) fn detect(bytes: &[u8]) -> Option<Self> {
        const SIGNATURES: [(&[u8], FrameFormat); 8] = [
            (b"SIMPLE  =", FrameFormat::Fits),
            (b"II*\0", FrameFormat::Tiff),
            (b"MM\0*", FrameFormat::Tiff),
            (b"II+\0", FrameFormat::Tiff),
            (b"MM\0+", FrameFormat::Tiff),
            (b"\x89PNG\r\n\x1a\n", FrameFormat::Png),
            (b"\xff\xd8\xff", FrameFormat::Jpeg),
            (b"\x1f\x8b", FrameFormat::Gzip),
        ];
        match bytes {
            [b'B', b'Z', b'h', b'1'..=b'9', ..] => Some(Self::Bzip2),
            [b'P', b'1'..=b'7', space, ..] if space.is_ascii_whitespace() => Some(Self::Pnm),
            // "BM" alone is too short a signature: the reserved bytes after the file size must be
            // 0.
            [b'B', b'M', _, _, _, _, 0, 0, 0, 0, ..] => Some(Self::Bmp),
            _ => SIGNATURES
                .iter()
                .find(|(signature, _)| bytes.starts_with(signature))
                .map(|&(_, format)| format),
        }
    }
}

/// The first bytes for an error message: as text if they are text, otherwise in hexadecimal.
pub(super) fn first_bytes(bytes: &[u8]) -> String {
    let head = &bytes[..bytes.len().min(8)];
    let is_text = |b: &u8| b.is_ascii_graphic() || b.is_ascii_whitespace();
    if head.iter().all(is_text) {
        return format!("the text {:?}", String::from_utf8_lossy(head));
    }
    let hex: Vec<String> = head.iter().map(|b| format!("{b:02x}")).collect();
    format!("the bytes {}", hex.join(" "))
}
