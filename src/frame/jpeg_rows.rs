//! Are all rows of a JPEG image there? The decoder fills those that are missing, and reports nothing.
//!
//! The scans are walked through without being decoded: every code is looked up and its bits are
//! skipped. Scans of a progressive image that refine coefficients need the coefficients themselves;
//! they are not looked at, since every row is in earlier scans, too.
//!
//! # Reference
//! ITU-T T.81 (1992), annexes B, C, F and G.

use super::error::FrameError;
use super::format::FrameFormat;
use super::read_budget::ReadBudget;

/// Coefficients of a block.
const BLOCK: usize = 64;
/// Bits that are looked up at once; longer codes are rare.
const LOOKUP_BITS: u32 = 10;
/// Units of blocks between two looks at the time.
const UNITS_BETWEEN_CHECKS: usize = 1 << 12;
/// Length of the longest code.
const MAX_CODE_BITS: u32 = 16;

/// Refuses an image whose data end, or cannot be decoded any further, before its last row.
/// # Errors
/// [`FrameError::Truncated`], [`FrameError::Interrupted`].
pub(super) fn check_rows(bytes: &[u8], budget: &ReadBudget) -> Result<(), FrameError> {
    let walk = Walk {
        budget: Some(budget),
        ..Walk::default()
    };
    let Some(missing) = walk.missing_rows(bytes) else {
        return Ok(());
    };
    Err(budget.why(FrameError::Truncated {
        format: FrameFormat::Jpeg,
        found_bytes: bytes.len(),
        detail: format!(
            "the data end or are damaged in row {} of the {} that the header states",
            missing.row, missing.height
        ),
    }))
}

/// Where the data end.
#[derive(Debug, PartialEq, Eq)]
struct MissingRows {
    row: usize,
    height: usize,
}

/// What the segments before a scan say.
#[derive(Default)]
struct Walk<'a> {
    budget: Option<&'a ReadBudget>,
    is_progressive: bool,
    width: usize,
    height: usize,
    components: Vec<Component>,
    /// For DC and AC, by their numbers.
    tables: [[Option<Box<Huffman>>; 4]; 2],
    /// Units between two restart markers; 0 without them.
    restart_interval: usize,
}

#[derive(Clone, Copy)]
struct Component {
    id: u8,
    /// Blocks of a unit, across and down.
    across: usize,
    down: usize,
}

/// A component in a scan, and its tables.
struct InScan<'a> {
    blocks: usize,
    dc: Option<&'a Huffman>,
    ac: Option<&'a Huffman>,
}

/// What a scan has of each block.
#[derive(Clone, Copy)]
struct CoefficientRange {
    /// First and last coefficient, in zigzag order.
    first: usize,
    last: usize,
    /// Whether a code may stand for the ends of several blocks.
    has_runs: bool,
}

impl CoefficientRange {
    const ALL: Self = Self {
        first: 0,
        last: BLOCK - 1,
        has_runs: false,
    };
}

impl Walk<'_> {
    /// Where the first scan that lacks rows ends. `None` where there is none, or where a segment is not
    /// understood: the decoder reports it.
    fn missing_rows(mut self, bytes: &[u8]) -> Option<MissingRows> {
        let mut at = 2;
        loop {
            // Between segments, fill bytes and what belongs to no segment are skipped.
            at += memchr::memchr(0xff, bytes.get(at..)?)?;
            let marker = *bytes.get(at + 1)?;
            if marker == 0xff {
                at += 1;
                continue;
            }
            at += 2;
            match marker {
                0xd9 => return None,
                0x00 | 0x01 | 0xd0..=0xd8 => continue,
                _ => {}
            }
            let length = usize::from(u16::from_be_bytes(*bytes.get(at..)?.first_chunk()?));
            let segment = bytes.get(at + 2..at + length.max(2))?;
            at += length.max(2);
            match marker {
                0xc0..=0xc2 => self.frame(segment, marker == 0xc2)?,
                0xc4 => self.huffman_tables(segment)?,
                0xdd => {
                    self.restart_interval = usize::from(u16::from_be_bytes(*segment.first_chunk()?))
                }
                0xda => {
                    let mut bits = ScanBits::new(bytes.get(at..)?);
                    if let Some(missing) = self.scan(segment, &mut bits)? {
                        return Some(missing);
                    }
                    at += bits.end();
                }
                // Other frames than Huffman's sequential and progressive ones are not decoded.
                0xc3 | 0xc5..=0xc7 | 0xc9..=0xcf => return None,
                _ => {}
            }
        }
    }

    fn frame(&mut self, segment: &[u8], is_progressive: bool) -> Option<()> {
        let [_, h1, h0, w1, w0, count] = *segment.first_chunk()?;
        self.height = usize::from(u16::from_be_bytes([h1, h0]));
        self.width = usize::from(u16::from_be_bytes([w1, w0]));
        self.is_progressive = is_progressive;
        let components = segment.get(6..)?.as_chunks::<3>().0;
        self.components = components
            .get(..usize::from(count))?
            .iter()
            .map(|&[id, sampling, _]| Component {
                id,
                across: usize::from(sampling >> 4),
                down: usize::from(sampling & 15),
            })
            .collect();
        let is_sampled = |c: &Component| c.across > 0 && c.down > 0;
        let is_whole = self.height > 0 && self.width > 0 && !self.components.is_empty();
        (is_whole && self.components.iter().all(is_sampled)).then_some(())
    }

    fn huffman_tables(&mut self, mut segment: &[u8]) -> Option<()> {
        while let Some((&[head], rest)) = segment.split_first_chunk() {
            let (counts, rest) = rest.split_first_chunk::<16>()?;
            let symbols: usize = counts.iter().map(|&count| usize::from(count)).sum();
            let (symbols, rest) = rest.split_at_checked(symbols)?;
            let kind = self.tables.get_mut(usize::from(head >> 4))?;
            *kind.get_mut(usize::from(head & 15))? = Some(Box::new(Huffman::new(counts, symbols)?));
            segment = rest;
        }
        Some(())
    }

    /// Walks through a scan. `None` if it is not understood, `Some(None)` if it is whole.
    fn scan(&self, segment: &[u8], bits: &mut ScanBits) -> Option<Option<MissingRows>> {
        let (&[count], rest) = segment.split_first_chunk()?;
        let (selectors, rest) = rest.split_at_checked(2 * usize::from(count))?;
        let &[first, last, approximation] = rest.first_chunk()?;
        let part = match (self.is_progressive, approximation >> 4) {
            (false, _) => CoefficientRange::ALL,
            (true, 0) => CoefficientRange {
                first: usize::from(first),
                last: usize::from(last).min(BLOCK - 1),
                has_runs: true,
            },
            // A refinement.
            (true, _) => return Some(None),
        };
        let find = |&[id, tables]: &[u8; 2]| {
            let component = self.components.iter().find(|c| c.id == id)?;
            let table =
                |kind: usize, number: u8| self.tables[kind].get(usize::from(number))?.as_deref();
            let scanned = InScan {
                blocks: component.across * component.down,
                dc: table(0, tables >> 4),
                ac: table(1, tables & 15),
            };
            // Without a table the decoder has its own, or reports that it is missing.
            let is_known = (part.first > 0 || scanned.dc.is_some())
                && (part.last == 0 || scanned.ac.is_some());
            is_known.then_some((*component, scanned))
        };
        let selected: Option<Vec<_>> = selectors.as_chunks().0.iter().map(find).collect();
        let selected = selected?;
        let (across, down, unit_rows) = self.units(&selected)?;
        let is_alone = selected.len() == 1;
        let scanned = selected.into_iter().map(|(_, mut scanned)| {
            // The blocks of a lone component are in the order of the picture.
            scanned.blocks = if is_alone { 1 } else { scanned.blocks };
            scanned
        });
        let scanned: Vec<InScan> = scanned.collect();
        let units = across * down;
        let found = self.units_found(&scanned, part, bits, units);
        Some((found < units).then(|| MissingRows {
            row: (found / across * unit_rows).min(self.height),
            height: self.height,
        }))
    }

    /// Units of a scan, across and down, and the rows of the picture that one covers.
    fn units(&self, selected: &[(Component, InScan)]) -> Option<(usize, usize, usize)> {
        const BLOCK_PX: usize = 8;
        let largest = |of: fn(&Component) -> usize| self.components.iter().map(of).max();
        let (across, down) = (largest(|c| c.across)?, largest(|c| c.down)?);
        let (wide, high) = match selected {
            // Of a lone component only the blocks that have pixels of the picture.
            [(alone, _)] => {
                let columns = (self.width * alone.across).div_ceil(across);
                let rows = (self.height * alone.down).div_ceil(down);
                (columns.div_ceil(BLOCK_PX), rows.div_ceil(BLOCK_PX))
            }
            _ => (
                self.width.div_ceil(BLOCK_PX * across),
                self.height.div_ceil(BLOCK_PX * down),
            ),
        };
        Some((wide, high, self.height.div_ceil(high)))
    }

    /// The units of a scan that can be decoded, at most `units`.
    fn units_found(
        &self,
        scanned: &[InScan],
        part: CoefficientRange,
        bits: &mut ScanBits,
        units: usize,
    ) -> usize {
        // Blocks without a bit of their own that follow in a progressive scan.
        let mut empty_blocks = 0;
        for unit in 0..units {
            let is_look = unit.is_multiple_of(UNITS_BETWEEN_CHECKS);
            if is_look && self.budget.is_some_and(|a| a.check_time().is_err()) {
                return unit;
            }
            let is_restart =
                self.restart_interval > 0 && unit > 0 && unit.is_multiple_of(self.restart_interval);
            if is_restart {
                empty_blocks = 0;
                if !bits.restart() {
                    return unit;
                }
            }
            let blocks = scanned
                .iter()
                .flat_map(|c| std::iter::repeat_n(c, c.blocks));
            for component in blocks {
                if empty_blocks > 0 {
                    empty_blocks -= 1;
                    continue;
                }
                match component.skip_block(part, bits) {
                    Some(empty) => empty_blocks = empty,
                    None => return unit,
                }
            }
            if bits.is_overrun() {
                return unit;
            }
        }
        units
    }
}

impl InScan<'_> {
    /// Skips a block, and returns the number of empty ones after it; `None` if a code is in no table.
    fn skip_block(&self, part: CoefficientRange, bits: &mut ScanBits) -> Option<u32> {
        let mut at = part.first;
        if at == 0 {
            let size = bits.symbol(self.dc?)?;
            bits.skip(u32::from(size).min(MAX_CODE_BITS));
            at = 1;
        }
        if at > part.last {
            return Some(0);
        }
        let table = self.ac?;
        while at <= part.last {
            let symbol = bits.symbol(table)?;
            let (run, size) = (symbol >> 4, u32::from(symbol & 15));
            match (run, size) {
                (15, 0) => at += 16,
                (run, 0) if part.has_runs => {
                    return Some((1 << run) + bits.take(run.into()) - 1);
                }
                (_, 0) => return Some(0),
                (run, size) => {
                    bits.skip(size);
                    at += usize::from(run) + 1;
                }
            }
        }
        Some(0)
    }
}

/// A table of codes (T.81, annex C).
struct Huffman {
    /// Length and symbol of the code that begins with these bits; length 0 for longer codes.
    lookup: [(u8, u8); 1 << LOOKUP_BITS],
    /// For each length: the first code that is longer, aligned to 16 bits, and the index of a code's
    /// symbol less the code.
    longer: [(u32, i32); MAX_CODE_BITS as usize + 1],
    symbols: Vec<u8>,
}

impl Huffman {
    fn new(counts: &[u8; 16], symbols: &[u8]) -> Option<Self> {
        let mut table = Self {
            lookup: [(0, 0); 1 << LOOKUP_BITS],
            longer: [(0, 0); MAX_CODE_BITS as usize + 1],
            symbols: symbols.to_vec(),
        };
        let (mut code, mut index) = (0_u32, 0_usize);
        for (length, &count) in (1..=MAX_CODE_BITS).zip(counts) {
            table.longer[length as usize].1 = index as i32 - code as i32;
            for _ in 0..count {
                if code >> length != 0 {
                    return None;
                }
                if length <= LOOKUP_BITS {
                    let free = LOOKUP_BITS - length;
                    let start = (code << free) as usize;
                    table.lookup[start..start + (1 << free)].fill((length as u8, symbols[index]));
                }
                code += 1;
                index += 1;
            }
            table.longer[length as usize].0 = code << (MAX_CODE_BITS - length);
            code <<= 1;
        }
        Some(table)
    }
}

/// The bits of a scan up to the next marker, and zeros after them.
struct ScanBits<'a> {
    bytes: &'a [u8],
    at: usize,
    /// The next bits, from the highest on.
    window: u64,
    count: u32,
    /// Zeros among them that are not in the data.
    padding: u32,
}

impl<'a> ScanBits<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        Self {
            bytes,
            at: 0,
            window: 0,
            count: 0,
            padding: 0,
        }
    }

    /// Whether more bits were used than there are.
    fn is_overrun(&self) -> bool {
        self.count < self.padding
    }

    /// Where the data end: at a marker, or at the end of the file.
    fn end(&self) -> usize {
        let mut at = self.at;
        while let Some(found) = memchr::memchr(0xff, &self.bytes[at..]) {
            at += found;
            match self.bytes.get(at + 1) {
                // A stuffed byte, or a restart that the units did not need.
                Some(0x00 | 0xd0..=0xd7) => at += 2,
                _ => return at,
            }
        }
        self.bytes.len()
    }

    fn fill(&mut self) {
        while self.count <= u64::BITS - 8 {
            let byte = match self.bytes.get(self.at..) {
                Some([0xff, 0x00, ..]) => {
                    self.at += 2;
                    0xff
                }
                Some([0xff, ..] | []) | None => {
                    self.padding += 8;
                    0
                }
                Some([byte, ..]) => {
                    self.at += 1;
                    *byte
                }
            };
            self.window |= u64::from(byte) << (u64::BITS - 8 - self.count);
            self.count += 8;
        }
    }

    fn skip(&mut self, bits: u32) {
        self.window <<= bits;
        self.count -= bits;
    }

    /// At most 16 bits as a number.
    fn take(&mut self, bits: u32) -> u32 {
        if self.count < MAX_CODE_BITS {
            self.fill();
        }
        let number = (self.window >> 1 >> (u64::BITS - 1 - bits)) as u32;
        self.skip(bits);
        number
    }

    /// The symbol of the next code; at least as many bits as a symbol can ask for are there after it.
    fn symbol(&mut self, table: &Huffman) -> Option<u8> {
        if self.count < 2 * MAX_CODE_BITS {
            self.fill();
        }
        let (length, symbol) = table.lookup[(self.window >> (u64::BITS - LOOKUP_BITS)) as usize];
        if length > 0 {
            self.skip(length.into());
            return Some(symbol);
        }
        let code = (self.window >> (u64::BITS - MAX_CODE_BITS)) as u32;
        let mut lengths = LOOKUP_BITS + 1..=MAX_CODE_BITS;
        let length = lengths.find(|&length| code < table.longer[length as usize].0)?;
        let number = (code >> (MAX_CODE_BITS - length)) as i32;
        let index = number + table.longer[length as usize].1;
        self.skip(length);
        table.symbols.get(usize::try_from(index).ok()?).copied()
    }

    /// Goes past the next restart marker, if it is there.
    fn restart(&mut self) -> bool {
        (self.window, self.count, self.padding) = (0, 0, 0);
        loop {
            match self.bytes.get(self.at..) {
                Some([0xff, 0xff, ..]) => self.at += 1,
                Some([0xff, 0xd0..=0xd7, ..]) => {
                    self.at += 2;
                    return true;
                }
                Some([0xff, 0x00, ..]) => self.at += 2,
                Some([0xff, ..] | []) | None => return false,
                Some(_) => self.at += 1,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::codecs::jpeg::{JpegEncoder, PixelDensity};
    use image::{ExtendedColorType, ImageEncoder};

    const WIDTH: usize = 50;
    const HEIGHT: usize = 40;

    /// A baseline JPEG of grey or color noise.
    fn jpeg(color: ExtendedColorType) -> Vec<u8> {
        let channels = usize::from(color.channel_count());
        let noise = (0..WIDTH * HEIGHT * channels).map(|i| (i * i * 31 % 251) as u8);
        let pixels: Vec<u8> = noise.collect();
        let mut bytes = Vec::new();
        let mut encoder = JpegEncoder::new_with_quality(&mut bytes, 90);
        encoder.set_pixel_density(PixelDensity::default());
        let size = (WIDTH as u32, HEIGHT as u32);
        encoder.write_image(&pixels, size.0, size.1, color).unwrap();
        bytes
    }

    fn position(bytes: &[u8], marker: u8) -> usize {
        memchr::memmem::find(bytes, &[0xff, marker]).unwrap()
    }

    fn missing(bytes: &[u8]) -> Option<MissingRows> {
        Walk::default().missing_rows(bytes)
    }

    #[test]
    fn a_whole_image_has_all_rows() {
        for color in [ExtendedColorType::L8, ExtendedColorType::Rgb8] {
            let mut bytes = jpeg(color);
            assert_eq!(missing(&bytes), None);
            // Bytes after the last unit are not asked for.
            let end = bytes.len() - 2;
            bytes.splice(end..end, [0; 20]);
            assert_eq!(missing(&bytes), None);
        }
    }

    #[test]
    fn data_that_end_early_are_found_wherever_they_end() {
        for color in [ExtendedColorType::L8, ExtendedColorType::Rgb8] {
            let bytes = jpeg(color);
            let start = position(&bytes, 0xda) + 14;
            let last = bytes.len() - 2;
            let mut rows = Vec::new();
            // The last byte may hold nothing but padding.
            for end in start..last - 1 {
                let cut = [&bytes[..end], &[0xff, 0xd9]].concat();
                let missing = missing(&cut).expect("rows are missing");
                assert_eq!(missing.height, HEIGHT);
                rows.push(missing.row);
            }
            assert!(rows.is_sorted());
            assert_eq!((rows[0], rows[rows.len() - 1]), (0, 32));
        }
    }

    #[test]
    fn a_header_with_more_rows_than_the_data_is_found() {
        let mut bytes = jpeg(ExtendedColorType::L8);
        let frame = position(&bytes, 0xc0);
        bytes[frame + 5..frame + 7].copy_from_slice(&100_u16.to_be_bytes());
        let error = check_rows(&bytes, &ReadBudget::default())
            .unwrap_err()
            .to_string();
        assert!(error.contains("row 40 of the 100"), "{error}");
    }

    #[test]
    fn codes_of_all_lengths_are_known() {
        // One code of each length: 0, 10, 110, ...
        let symbols: Vec<u8> = (1..=16).collect();
        let table = Huffman::new(&[1; 16], &symbols).unwrap();
        for length in 1..=16_u8 {
            let digits = format!("{:0<32}", "1".repeat(usize::from(length) - 1));
            let code = u32::from_str_radix(&digits, 2).unwrap();
            // A byte of ones is stuffed with a zero.
            let stuffed = |byte: u8| {
                if byte == 0xff {
                    vec![byte, 0]
                } else {
                    vec![byte]
                }
            };
            let data: Vec<u8> = code.to_be_bytes().into_iter().flat_map(stuffed).collect();
            assert_eq!(ScanBits::new(&data).symbol(&table), Some(length));
        }
        assert!(Huffman::new(&[3; 16], &[0; 48]).is_none(), "too many codes");
    }
}
