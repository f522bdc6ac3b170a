//! Lists of centroids as astrometry.net has them: binary tables of FITS.
//!
//! file → [`CentroidList`]. Pixels count from 1 in these tables, in the order of the rows of the frame's file.
//!
//! # Reference
//! astrometry.net 0.93, `xylist.c`: the columns `X`, `Y` and `FLUX`, the keywords `IMAGEW` and `IMAGEH`.

use super::list::{CentroidList, ListedCentroid};
use super::table::CentroidListError;
use crate::base::coords::PixelPoint;
use crate::base::file_ranges::FileRanges;
use crate::base::fits_tables::{Cards, Column, FitsTable, read_tables};
use crate::identify::Photometry;
use crate::photometry::instrumental_mag;
use memchr::memmem;
use std::io;
use std::path::Path;

/// How to read lists of astrometry.net.
#[derive(Debug, Clone, Default)]
pub struct XylistOptions {
    /// The column of x; that called `X` unless it is stated.
    pub x: Option<String>,
    /// The column of y; that called `Y` unless it is stated.
    pub y: Option<String>,
    /// The column by which stars are sorted; `FLUX` or `MAG`, if there is one, unless it is stated. Without one the
    /// rows are in order of brightness.
    pub sort: Option<String>,
    /// Whether its smallest value is that of the brightest star: it has magnitudes, and not fluxes.
    pub is_ascending: bool,
    /// Width and height of the frame, where they are not those of the file.
    pub size: [Option<u32>; 2],
}

impl XylistOptions {
    /// Whether a file has such a list.
    pub fn is_list(&self, path: &Path) -> bool {
        let tables = FileRanges::open(path).and_then(|file| read_tables(&file));
        tables.is_ok_and(|(_, tables)| tables.iter().any(|table| self.position(table).is_some()))
    }

    /// The list in the bytes of a file that has one and no picture.
    ///
    /// # Errors
    /// It has more than `max_rows` rows.
    pub fn read_bytes(
        &self,
        file: &[u8],
        max_rows: usize,
    ) -> Option<Result<CentroidList, CentroidListError>> {
        /// The first header ends before.
        const MAX_HEADER_BYTES: usize = 36 * 2880;
        let head = &file[..file.len().min(MAX_HEADER_BYTES)];
        memmem::find(head, b"XTENSION= 'BINTABLE")?;
        let file = FileRanges::of_bytes(file.to_vec());
        let (_, tables) = read_tables(&file).ok()?;
        let table = tables.iter().find(|table| self.position(table).is_some())?;
        let count = table.rows.count;
        if count > max_rows as u64 {
            let message = format!("found {count} rows, expected at most {max_rows}");
            return Some(Err(CentroidListError::of_list(message)));
        }
        let list = self.first_list(&file).ok()??;
        (!list.centroids.is_empty()).then_some(Ok(list))
    }

    /// Reads the first list in a file.
    ///
    /// # Errors
    /// The file cannot be read, or has no such list, or an empty one.
    pub fn read(&self, path: &Path) -> Result<CentroidList, CentroidListError> {
        let list = FileRanges::open(path).and_then(|file| self.first_list(&file));
        let list = list.map_err(|error| CentroidListError::of_list(error.to_string()))?;
        let [x, y] = self.position_names();
        let missing = || format!("found no table with the columns {x} and {y}");
        let list = list.ok_or_else(|| CentroidListError::of_list(missing()))?;
        if list.centroids.is_empty() {
            return Err(CentroidListError::of_list("found a table without rows"));
        }
        Ok(list)
    }

    fn first_list(&self, file: &FileRanges) -> io::Result<Option<CentroidList>> {
        let (primary, tables) = read_tables(file)?;
        let found = |table| Some((table, self.position(table)?));
        let Some((table, position)) = tables.iter().find_map(found) else {
            return Ok(None);
        };
        let rows = table.rows.read_all(file)?;
        let (brightness, is_ascending) = match (&self.sort, table.column("FLUX")) {
            (Some(stated), _) => (table.column(stated), self.is_ascending),
            (None, Some(flux)) => (Some(flux), false),
            (None, None) => (table.column("MAG"), true),
        };
        let of_row = |(number, row): (usize, &[u8])| {
            let number_of = |column: &Column| column.number(row).unwrap_or(f64::NAN);
            let [x, y] = position.map(|column| number_of(column) - 1.0);
            let value = brightness.map(number_of);
            let flux = value.filter(|_| !is_ascending);
            let mag = match (value, flux) {
                (_, Some(flux)) => instrumental_mag(flux),
                (Some(mag), None) => mag,
                (None, None) => ListedCentroid::mag_of_rank(number),
            };
            ListedCentroid {
                flux,
                row: number as u64 + 1,
                ..ListedCentroid::new(PixelPoint::new(x, y), mag)
            }
        };
        let [width, height] = self.sides([&primary, &table.cards]);
        Ok(Some(CentroidList {
            width,
            height,
            photometry: Photometry::Instrumental,
            has_brightness: brightness.is_some(),
            centroids: rows
                .chunks_exact(table.rows.bytes.max(1))
                .enumerate()
                .map(of_row)
                .collect(),
        }))
    }

    fn position_names(&self) -> [&str; 2] {
        [(&self.x, "X"), (&self.y, "Y")].map(|(stated, usual)| stated.as_deref().unwrap_or(usual))
    }

    /// The columns of x and y.
    fn position<'a>(&self, table: &'a FitsTable) -> Option<[&'a Column; 2]> {
        let [x, y] = self.position_names();
        Some([table.column(x)?, table.column(y)?])
    }

    /// Width and height, as they are stated, else as headers have them.
    fn sides(&self, headers: [&Cards; 2]) -> [Option<usize>; 2] {
        [0, 1].map(|axis| {
            let keyword = ["IMAGEW", "IMAGEH"][axis];
            let of_file = |cards: &&Cards| cards.number::<f64>(keyword).map(|side| side as u32);
            let side = self.size[axis].or_else(|| headers.iter().find_map(of_file));
            side.filter(|side| *side > 0).map(|side| side as usize)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file with one table of the columns a (4-byte floats) and X and Y (8-byte floats).
    fn file(rows: &[(f32, f64, f64)]) -> tempfile::NamedTempFile {
        let card = |text: String| format!("{text:<80}");
        let unit = |cards: &[&str]| {
            let cards = cards.iter().map(|text| card((*text).to_owned()));
            let text: String = cards.chain([card("END".to_owned())]).collect();
            let length = text.len().next_multiple_of(2880);
            format!("{text:<length$}").into_bytes()
        };
        let mut bytes = unit(&[
            "SIMPLE  = T",
            "BITPIX  = 8",
            "NAXIS   = 0",
            "IMAGEW  = 1024",
        ]);
        let count = format!("NAXIS2  = {}", rows.len());
        bytes.extend(unit(&[
            "XTENSION= 'BINTABLE'",
            "BITPIX  = 8",
            "NAXIS   = 2",
            "NAXIS1  = 20",
            &count,
            "PCOUNT  = 0",
            "GCOUNT  = 1",
            "TFIELDS = 3",
            "TTYPE1  = 'MAG_AUTO'",
            "TFORM1  = 'E'",
            "TTYPE2  = 'X'",
            "TFORM2  = '1D'",
            "TTYPE3  = 'Y'",
            "TFORM3  = 'D'",
            "IMAGEH  = 768",
        ]));
        for (mag, x, y) in rows {
            bytes.extend(mag.to_be_bytes());
            bytes.extend(x.to_be_bytes());
            bytes.extend(y.to_be_bytes());
        }
        bytes.resize(bytes.len().next_multiple_of(2880), 0);
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(&file, bytes).unwrap();
        file
    }

    #[test]
    fn pixels_count_from_1_and_the_size_is_that_of_the_headers() {
        let file = file(&[(9.0, 1.0, 2.5), (7.0, 11.0, 12.0)]);
        let options = XylistOptions::default();
        assert!(options.is_list(file.path()));
        let list = options.read(file.path()).unwrap();
        assert_eq!((list.width, list.height), (Some(1024), Some(768)));
        assert_eq!(list.centroids[0].position, PixelPoint::new(0.0, 1.5));
        // Without a column of brightness the first is the brightest.
        assert!(!list.has_brightness && list.centroids[0].mag < list.centroids[1].mag);
    }

    #[test]
    fn a_list_that_is_too_long_is_refused() {
        let bytes = std::fs::read(file(&[(9.0, 1.0, 2.5), (7.0, 11.0, 12.0)])).unwrap();
        let read = |max_rows| XylistOptions::default().read_bytes(&bytes, max_rows);
        assert_eq!(read(2).unwrap().unwrap().centroids.len(), 2);
        let refused = read(1).unwrap().unwrap_err().to_string();
        assert!(refused.contains("2 rows, expected at most 1"), "{refused}");
    }

    #[test]
    fn the_column_that_sorts_has_magnitudes_if_the_smallest_comes_first() {
        let file = file(&[(9.0, 1.0, 2.0), (7.0, 11.0, 12.0)]);
        let mut options = XylistOptions {
            sort: Some("mag_auto".to_owned()),
            is_ascending: true,
            size: [None, Some(900)],
            ..XylistOptions::default()
        };
        let list = options.read(file.path()).unwrap();
        assert_eq!((list.centroids[1].mag, list.centroids[1].flux), (7.0, None));
        assert_eq!((list.width, list.height), (Some(1024), Some(900)));
        options.is_ascending = false;
        assert_eq!(
            options.read(file.path()).unwrap().centroids[0].flux,
            Some(9.0)
        );
    }

    #[test]
    fn other_files_are_refused() {
        let file = file(&[]);
        let empty = XylistOptions::default().read(file.path()).unwrap_err();
        assert_eq!(empty.to_string(), "found a table without rows");
        let options = XylistOptions {
            x: Some("X_IMAGE".to_owned()),
            ..XylistOptions::default()
        };
        assert!(!options.is_list(file.path()));
        let missing = options.read(file.path()).unwrap_err().to_string();
        assert_eq!(missing, "found no table with the columns X_IMAGE and Y");
        std::fs::write(&file, "x,y\n1,2\n").unwrap();
        assert!(!options.is_list(file.path()) && options.read(file.path()).is_err());
    }
}
