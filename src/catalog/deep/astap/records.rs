//! The records of a file: stars, and markers that hold for those that follow.

use crate::catalog::deep::error::Damage;

/// Bytes before the records.
pub const HEADER_BYTES: usize = 110;
/// Where the header has the version and the size of a record.
const VERSION_AT: usize = 108;
const SIZE_AT: usize = 109;
/// The version whose records of six bytes have B−V.
const WITH_COLOR: u8 = 2;
/// The right ascension of a marker.
const MARKER: u32 = 0xff_ffff;
/// The declination of a pole.
const DEC_STEPS: f64 = 8_388_607.0;

/// What the header of a file says.
#[derive(Debug, Clone, PartialEq)]
pub struct AstapHeader {
    /// Bytes of a record.
    pub record_bytes: usize,
    /// Whether the last byte of a record is 50 (B−V).
    pub has_color: bool,
    /// The epoch of the positions, where it is stated.
    pub epoch_year: Option<f64>,
    /// Whether the text says that magnitudes are V.
    pub is_v: bool,
}

impl AstapHeader {
    /// The header in the first bytes of a file.
    pub fn read(head: &[u8]) -> Result<Self, Damage> {
        let head: &[u8; HEADER_BYTES] = head.first_chunk().ok_or(Damage::Truncated)?;
        let record_bytes = match head[SIZE_AT] {
            b' ' => 11,
            size => usize::from(size),
        };
        if ![5, 6, 7, 9, 10, 11].contains(&record_bytes) {
            let message = format!("records of {record_bytes} bytes");
            return Err(Damage::Invalid(message));
        }
        let text = String::from_utf8_lossy(&head[..VERSION_AT]).to_ascii_lowercase();
        let epoch = text.split("epoch").nth(1);
        let epoch = epoch.map(|rest| rest.trim_start_matches([' ', '=']));
        let year = epoch.and_then(|rest| {
            let end = rest.find(|c: char| !c.is_ascii_digit() && c != '.');
            let digits = &rest[..end.unwrap_or(rest.len())];
            digits.trim_end_matches('.').parse::<f64>().ok()
        });
        Ok(Self {
            record_bytes,
            has_color: record_bytes == 6 && head[VERSION_AT] == WITH_COLOR,
            epoch_year: year.filter(|year| (1850.0..2150.0).contains(year)),
            is_v: text.contains("magnitude is v"),
        })
    }
}

/// A star of a file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AstapStar {
    /// Right ascension.
    pub ra_deg: f64,
    /// Declination.
    pub dec_deg: f64,
    /// Magnitude in the band of the file.
    pub mag: f32,
    /// B−V, where it is known.
    pub bv_mag: Option<f32>,
}

/// Reads records one after the other.
#[derive(Debug, Clone)]
pub struct RecordReader {
    record_bytes: usize,
    has_color: bool,
    /// The last marker: upper byte of the declination, and magnitude in tenths.
    marker: Option<(i8, i16)>,
}

impl RecordReader {
    /// For a file with this header, from its first record on.
    pub const fn new(header: &AstapHeader) -> Self {
        Self {
            record_bytes: header.record_bytes,
            has_color: header.has_color,
            marker: None,
        }
    }

    /// The star in a record; `None` if it is a marker, or there was none before.
    pub fn star(&mut self, record: &[u8]) -> Option<AstapStar> {
        match (self.record_bytes, record) {
            (5, &[a, b, c, low, mid]) => self.short([a, b, c], [low, mid], None),
            (6, &[a, b, c, low, mid, color]) => {
                let color = color.cast_signed();
                let color = (self.has_color && color != i8::MIN).then_some(color);
                self.short([a, b, c], [low, mid], color)
            }
            (7, &[a, b, c, low, mid, high, mag]) => {
                Some(star([a, b, c], [low, mid, high], tenths(mag)))
            }
            (9, &[_, _, _, _, a, b, c, low, mid]) => self.short([a, b, c], [low, mid], None),
            (10, &[_, _, _, _, a, b, c, low, mid, high]) => {
                if ra_steps([a, b, c]) == MARKER {
                    self.marker = Some((0, tenths(high)));
                    return None;
                }
                Some(star([a, b, c], [low, mid, high], self.marker?.1))
            }
            (11, &[_, _, _, _, a, b, c, low, mid, high, mag]) => {
                Some(star([a, b, c], [low, mid, high], tenths(mag)))
            }
            _ => None,
        }
    }

    /// A record whose upper byte of the declination and whose magnitude are those of the last marker.
    fn short(&mut self, ra: [u8; 3], [low, mid]: [u8; 2], color: Option<i8>) -> Option<AstapStar> {
        if ra_steps(ra) == MARKER {
            let magnitude = i16::from(mid) - 16;
            // Some old files have faint stars at the right ascension of markers.
            if self
                .marker
                .is_none_or(|(_, before)| magnitude >= before || before < 150)
            {
                self.marker = Some((low.wrapping_sub(128).cast_signed(), magnitude));
            }
            return None;
        }
        let (high, magnitude) = self.marker?;
        let star = star(ra, [low, mid, high.cast_unsigned()], magnitude);
        Some(AstapStar {
            bv_mag: color.map(|color| f32::from(color) / 50.0),
            ..star
        })
    }
}

/// A magnitude in tenths, in a byte: large ones count beyond its range.
fn tenths(byte: u8) -> i16 {
    let signed = byte.cast_signed();
    if signed > -20 {
        i16::from(signed)
    } else {
        i16::from(byte)
    }
}

fn ra_steps([low, mid, high]: [u8; 3]) -> u32 {
    u32::from_le_bytes([low, mid, high, 0])
}

fn star(ra: [u8; 3], [low, mid, high]: [u8; 3], tenths: i16) -> AstapStar {
    let dec_steps = i32::from_le_bytes([0, low, mid, high]) >> 8;
    AstapStar {
        ra_deg: f64::from(ra_steps(ra)) * 360.0 / f64::from(MARKER),
        dec_deg: (f64::from(dec_steps) * 90.0 / DEC_STEPS).clamp(-90.0, 90.0),
        mag: f32::from(tenths) / 10.0,
        bv_mag: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(text: &str, version: u8, size: u8) -> Vec<u8> {
        let mut head = format!("{text:<108}").into_bytes();
        head.extend([version, size]);
        head
    }

    fn stars(head: &[u8], records: &[u8]) -> Vec<AstapStar> {
        let header = AstapHeader::read(head).unwrap();
        let mut reader = RecordReader::new(&header);
        let records = records.chunks_exact(header.record_bytes);
        records.filter_map(|record| reader.star(record)).collect()
    }

    fn assert_star(star: &AstapStar, ra_deg: f64, dec_deg: f64, mag: f32) {
        assert!((star.ra_deg - ra_deg).abs() < 1e-6, "{star:?}");
        assert!((star.dec_deg - dec_deg).abs() < 1e-6, "{star:?}");
        assert!((star.mag - mag).abs() < 1e-5, "{star:?}");
    }

    #[test]
    fn the_header_tells_size_epoch_and_band() {
        let head = header("GAIA eDR3, Epoch=2025. Magnitude is V, Bp-Rp info", 2, 6);
        let header = AstapHeader::read(&head).unwrap();
        let expected = AstapHeader {
            record_bytes: 6,
            has_color: true,
            epoch_year: Some(2025.0),
            is_v: true,
        };
        assert_eq!(header, expected);
        assert!(matches!(
            AstapHeader::read(&head[..109]),
            Err(Damage::Truncated)
        ));
        let mut wrong = head;
        wrong[109] = 8;
        assert!(matches!(AstapHeader::read(&wrong), Err(Damage::Invalid(_))));
    }

    /// Bytes of published files and of their description.
    #[test]
    fn published_records_are_read() {
        let polar = [
            0xff, 0xff, 0xff, 0xfe, 0x26, 0xf8, 0xfb, 0x1a, 0x13, 0xf4, 0xff, 0xff, 0xff, 0xfb,
            0x3c, 0xbc, 0x0f, 0xbb, 0x4a, 0x25,
        ];
        let read = stars(&header("", 0, 5), &polar);
        assert_eq!(read.len(), 2);
        assert_star(&read[0], 37.946_607_944, 89.264_130_505, 2.2);
        assert_star(&read[1], 263.055_197_183, 86.586_802_791, 4.4);
        let sirius = [0xff, 0xff, 0xff, 0x68, 0x06, 0xc3, 0x06, 0x48, 0xd7, 0x39];
        let read = stars(&header("", 0, 5), &sirius);
        assert_star(&read[0], 101.287_149_268, -16.716_140_117, -1.0);
        let nine: Vec<u8> = sirius
            .chunks(5)
            .flat_map(|r| [[0; 4].as_slice(), r].concat())
            .collect();
        assert_eq!(stars(&header("", 0, 9), &nine), read);
    }

    #[test]
    fn colors_are_read_where_they_are_known() {
        let records = [
            0xff, 0xff, 0xff, 0x80, 0x74, 0, 1, 0, 0, 0, 0, 35, 2, 0, 0, 0, 0, 0x80,
        ];
        let read = stars(&header("", 2, 6), &records);
        assert_eq!(read[0].bv_mag, Some(0.7));
        assert_eq!(read[1].bv_mag, None);
        assert_eq!(stars(&header("", 1, 6), &records)[0].bv_mag, None);
    }

    #[test]
    fn records_with_their_own_magnitude_are_read() {
        // 12.9 and −1.2 mag.
        let seven = [0, 0, 0, 1, 0, 0, 0x81, 0, 0, 0, 1, 0, 0xff, 0xf4];
        let read = stars(&header("", 0, 7), &seven);
        assert_star(&read[0], 0.0, 90.0 / DEC_STEPS, 12.9);
        assert_star(&read[1], 0.0, -65_535.0 * 90.0 / DEC_STEPS, -1.2);
        let eleven: Vec<u8> = seven
            .chunks(7)
            .flat_map(|r| [[9; 4].as_slice(), r].concat())
            .collect();
        assert_eq!(stars(&header("", 0, b' '), &eleven), read);
    }

    #[test]
    fn stars_before_any_marker_are_left_out() {
        assert!(stars(&header("", 0, 5), &[1, 2, 3, 4, 5]).is_empty());
    }
}
