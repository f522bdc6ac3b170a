//! One index file.

use super::magnitude::MagnitudeColumns;
use super::tree::{DATA, HEADER, StarTree};
use crate::base::coords::{Icrs, UnitVector};
use crate::base::file_ranges::FileRanges;
use crate::base::fits_tables::{Column, FitsTable, Rows, read_tables};
use crate::base::interrupt::Interrupt;
use crate::base::units::{RAD_PER_DEG, WHOLE_SKY_SQ_DEG};
use crate::catalog::Band;
use crate::catalog::deep::error::Damage;
use crate::catalog::deep::healpix::{HealpixCell, samples};
use crate::catalog::deep::region::Region;
use crate::catalog::star::{J2000_YEAR, MAG_LIMIT, PM_LIMIT_MAS_PER_YR, rounded_mag};
use crate::catalog::{PlaceId, Star, StarFlags, StarId};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Rows that are read at once.
const ROWS_AT_ONCE: u64 = 1 << 16;

/// One index file of astrometry.net.
#[derive(Debug)]
pub struct IndexFile {
    /// Where it is.
    pub path: PathBuf,
    file: FileRanges,
    tables: Vec<FitsTable>,
    /// Read when it is first needed.
    tree: OnceLock<StarTree>,
    /// The part of the sky that it covers; `None` for all.
    covered: Option<CoveredCell>,
    /// The widest of its quads, in radians: the smaller, the more stars it has.
    pub widest_quad_rad: f64,
}

/// A cell of the sky.
#[derive(Debug, Clone, Copy)]
struct CoveredCell {
    number: u32,
    side: u32,
}

impl CoveredCell {
    /// The cell with a number, where each of the twelve faces is divided into `side` × `side`.
    fn new(number: i64, side: u32) -> Result<Self, Damage> {
        /// More than any file has, and few enough to number all cells.
        const MAX_SIDE: u32 = 1 << 14;
        let cells = u64::from(side) * u64::from(side) * 12;
        match u32::try_from(number) {
            Ok(number) if side <= MAX_SIDE && u64::from(number) < cells => {
                Ok(Self { number, side })
            }
            _ => {
                let message = format!("HEALPIX = {number} with HPNSIDE = {side}");
                Err(Damage::Invalid(message))
            }
        }
    }
}

impl IndexFile {
    /// Whether a file begins like an index file. It may be another FITS file.
    pub fn is_like(head: &[u8]) -> bool {
        /// The card is among the first.
        const CARD: &[u8] = b"AN_FILE = 'QUAD";
        head.starts_with(b"SIMPLE  =") && head.windows(CARD.len()).any(|window| window == CARD)
    }

    /// Reads the headers of a file.
    pub fn open(path: &Path, file: FileRanges) -> Result<Self, Damage> {
        let (primary, tables) = read_tables(&file)?;
        let side: u32 = primary.number("HPNSIDE").unwrap_or(0);
        let covered = match primary.number("HEALPIX").unwrap_or(-1_i64) {
            ..0 => None,
            number => Some(CoveredCell::new(number, side)?),
        };
        if !tables.iter().any(|table| table.is_called(HEADER)) {
            return Err(Damage::Invalid(format!("without the table {HEADER}")));
        }
        Ok(Self {
            path: path.to_owned(),
            file,
            tables,
            tree: OnceLock::new(),
            covered,
            widest_quad_rad: primary.number("SCALE_U").unwrap_or(f64::INFINITY),
        })
    }

    /// Whether the file may have stars of a region.
    pub fn may_reach(&self, region: &Region) -> bool {
        /// Files reach a little beyond their cells.
        const MARGIN_RAD: f64 = 1.0 * RAD_PER_DEG;
        let Some(CoveredCell { number, side }) = self.covered else {
            return true;
        };
        let near = samples(&region.centre, region.radius_rad + MARGIN_RAD);
        let is_it = |direction| HealpixCell::of(direction, side).number_by_face(side) == number;
        region.radius_rad > 20.0 * RAD_PER_DEG || near.iter().any(is_it)
    }

    /// The share of the sky that it covers.
    pub fn share_of_sky(&self) -> f64 {
        let cells = |cell: CoveredCell| 12.0 * f64::from(cell.side) * f64::from(cell.side);
        self.covered.map_or(1.0, |cell| 1.0 / cells(cell))
    }

    /// Number of stars, and the band of their magnitudes.
    pub fn contents(&self) -> (u64, Band) {
        let details = Details::find(&self.tables, self.share_of_sky());
        let vectors = self.tables.iter().find(|table| table.is_called(DATA));
        (vectors.map_or(0, |table| table.rows.count), details.band())
    }

    /// Calls `visit` with every star that may lie in a region, and some around it.
    pub fn stars_in(
        &self,
        region: &Region,
        interrupt: &Interrupt,
        visit: &mut dyn FnMut(Star),
    ) -> Result<(), Damage> {
        let tree = self.tree()?;
        let details = Details::find(&self.tables, self.share_of_sky());
        // Stars move by this much at most until the epoch of the file.
        const MARGIN: f64 = 1e-3;
        let chord = region.chord() + MARGIN;
        for rows in tree.rows_in_cone(region.centre.as_vector(), chord) {
            let mut from = rows.start;
            while from < rows.end {
                interrupt.check().map_err(|_| Damage::Interrupted)?;
                let to = rows.end.min(from + ROWS_AT_ONCE);
                self.visit_rows(tree, &details, from..to, visit)?;
                from = to;
            }
        }
        Ok(())
    }

    fn visit_rows(
        &self,
        tree: &StarTree,
        details: &Details,
        rows: Range<u64>,
        visit: &mut dyn FnMut(Star),
    ) -> Result<(), Damage> {
        let tags = match details.rows() {
            Some(table) => table.read(&self.file, rows.clone())?,
            None => Vec::new(),
        };
        let width = details.rows().map_or(0, |table| table.bytes);
        for (number, vector) in tree.vectors(&self.file, rows)?.enumerate() {
            let length = vector.norm();
            if !(0.999..1.001).contains(&length) {
                return Err(Damage::Invalid("a star without a direction".to_owned()));
            }
            let direction = UnitVector::from_vector(vector);
            let row = &tags[number * width..(number + 1) * width];
            if let Some(star) = details.star(direction, row) {
                visit(star);
            }
        }
        Ok(())
    }

    fn tree(&self) -> Result<&StarTree, Damage> {
        if let Some(tree) = self.tree.get() {
            return Ok(tree);
        }
        let tree = StarTree::read(&self.file, &self.tables)?;
        Ok(self.tree.get_or_init(|| tree))
    }
}

/// What is known of each star besides its direction.
enum Details<'a> {
    /// A table beside the tree has magnitudes.
    Table {
        table: &'a FitsTable,
        magnitudes: MagnitudeColumns<'a>,
        /// In right ascension times cos(declination), and in declination.
        motion: Option<[&'a Column; 2]>,
        epoch_year: f64,
    },
    /// A table has the rank of each star, the brightest first, in 256 steps.
    Ranks {
        rows: Rows,
        /// Density of all stars.
        per_sq_deg: f64,
    },
    /// Nothing.
    None,
}

impl<'a> Details<'a> {
    fn find(tables: &'a [FitsTable], share_of_sky: f64) -> Self {
        let beside = |table: &&FitsTable| table.cards.text("AN_FILE") == Some("TAGALONG");
        if let Some(table) = tables.iter().find(beside)
            && let Some(magnitudes) = MagnitudeColumns::find(table)
        {
            let motion = table.column("PMRA").or_else(|| table.column("PM_RA"));
            let dec = table.column("PMDEC").or_else(|| table.column("PM_DEC"));
            // Those of Gaia's second release are of 2015.5; others are taken for those of J2000.
            let is_gaia = matches!(magnitudes, MagnitudeColumns::Gaia(..));
            return Self::Table {
                table,
                magnitudes,
                motion: motion.zip(dec).map(<[_; 2]>::from),
                epoch_year: if is_gaia { 2015.5 } else { J2000_YEAR },
            };
        }
        match tables.iter().find(|table| table.is_called("sweep")) {
            Some(ranks) if ranks.rows.bytes == 1 => Self::Ranks {
                rows: ranks.rows,
                per_sq_deg: ranks.rows.count as f64 / (WHOLE_SKY_SQ_DEG * share_of_sky),
            },
            _ => Self::None,
        }
    }

    const fn band(&self) -> Band {
        match self {
            Self::Table { magnitudes, .. } => magnitudes.band(),
            Self::Ranks { .. } => Band::Ranks,
            Self::None => Band::Unknown,
        }
    }

    const fn rows(&self) -> Option<Rows> {
        match self {
            Self::Table { table, .. } => Some(table.rows),
            Self::Ranks { rows, .. } => Some(*rows),
            Self::None => None,
        }
    }

    /// The star with a direction and a row of the table; `None` where its brightness is not known.
    fn star(&self, direction: UnitVector<Icrs>, row: &[u8]) -> Option<Star> {
        let id = StarId::Place(PlaceId::of(&direction));
        let derived = StarFlags::DERIVED_MAGNITUDE;
        match self {
            Self::Table {
                magnitudes,
                motion,
                epoch_year,
                ..
            } => {
                let (v_mag, bv_mag) = magnitudes.johnson(row)?;
                let star = Star {
                    bv_mag: bv_mag.filter(|bv_mag| bv_mag.abs() < MAG_LIMIT),
                    ..Star::new(id, direction, v_mag)
                };
                Some(match motion.and_then(|motion| motion_of(motion, row)) {
                    Some([ra, dec]) => moved(star, [ra, dec], *epoch_year),
                    None => Star {
                        flags: star.flags.union(derived),
                        ..star
                    },
                })
            }
            Self::Ranks { per_sq_deg, .. } => {
                let share = (f64::from(*row.first()?) + 0.5) / 256.0;
                let v_mag = v_mag_of_density(share * per_sq_deg);
                let star = Star::new(id, direction, v_mag);
                Some(Star {
                    flags: star.flags.union(derived),
                    ..star
                })
            }
            Self::None => None,
        }
    }
}

/// The motion in a row, in mas a year; `None` where it is not known.
fn motion_of([ra, dec]: [&Column; 2], row: &[u8]) -> Option<[f32; 2]> {
    let motion = [ra.number(row)? as f32, dec.number(row)? as f32];
    let is_known = motion
        .iter()
        .all(|value| value.abs() <= PM_LIMIT_MAS_PER_YR);
    (is_known && motion != [0.0; 2]).then_some(motion)
}

/// A star whose direction is that of an epoch, at J2000.
fn moved(star: Star, [ra, dec]: [f32; 2], epoch_year: f64) -> Star {
    let star = Star {
        pm_ra_mas_per_yr: ra,
        pm_dec_mas_per_yr: dec,
        flags: StarFlags::DERIVED_MAGNITUDE,
        ..star
    };
    Star {
        direction: star.direction_at(J2000_YEAR - epoch_year),
        ..star
    }
}

/// The V magnitude to which the mean density of stars is this, within about a magnitude at any place.
///
/// # Reference
/// Star counts over the whole sky: Cox 2000, Allen's Astrophysical Quantities, 4th edition, table 19.10.
fn v_mag_of_density(per_sq_deg: f64) -> f32 {
    /// Logarithms of the number of stars to a V magnitude, in a square degree.
    const COUNTS: [(f64, f64); 8] = [
        (4.0, -1.92),
        (6.0, -0.92),
        (8.0, 0.04),
        (10.0, 0.97),
        (12.0, 1.81),
        (14.0, 2.59),
        (16.0, 3.30),
        (20.0, 4.44),
    ];
    let wanted = libm::log10(per_sq_deg);
    let after = COUNTS.iter().position(|(_, count)| *count > wanted);
    let after = after.unwrap_or(COUNTS.len() - 1).max(1);
    let [(low_mag, low), (high_mag, high)] = [COUNTS[after - 1], COUNTS[after]];
    let share = (wanted - low) / (high - low);
    rounded_mag((low_mag + share * (high_mag - low_mag)).clamp(-1.0, 24.0))
}
