//! Tycho-2 as the CDS distributes it: one star a line, fields between bars.
//!
//! `tyc2.dat` (whole, or in the twenty parts `tyc2.dat.00` to `.19`) and the supplements `suppl_1.dat`,
//! `suppl_2.dat` → stars at J2000.
//!
//! - A star goes by its TYC number; a component of a Hipparcos double star in a supplement, which shares
//!   its TYC number with the main catalogue's star, by its Hipparcos number and letter.
//! - V = VT − 0.090 (BT − VT) and B−V = 0.850 (BT − VT). With VT alone (or Hp, which takes its place in a
//!   supplement) that is V; with BT alone V is that of a star of the median colour. All are flagged as derived.
//! - A mean position counts as it is. Where it is that of the photocentre of two entries (`P`), each is put at
//!   its own observed position, moved by the common proper motion: so no two stars stand at one place.
//!   Where there is none (`X`) the observed position counts, and the proper motion is unknown.
//! - The positions of the supplements, of J1991.25, are moved to J2000 where the proper motion is known.
//!
//! # Reference
//! Høg et al. 2000, A&A 355, L27 (CDS I/259, whose description gives layout and magnitudes).

use super::error::{FaultPlace, RecordFault, quoted};
use super::id::whole_number;
use super::import::{Format, Record};
use super::position::GridPosition;
use super::rows::Row;
use super::star::{StarFlags, mag_on_grid};
use super::{HipparcosId, MAG_LIMIT, PM_LIMIT_MAS_PER_YR, Star, StarId, TychoId};
use crate::base::angle::decimal;

/// V less VT, in units of BT − VT.
const V_PER_COLOR: f64 = -0.090;
/// B − V in units of BT − VT.
const BV_PER_COLOR: f64 = 0.850;
/// Median of BT − VT over the 2,539,802 stars of the main catalogue that have both.
const MEDIAN_COLOR_MAG: f64 = 0.721;
const J2000_YEAR: f64 = 2000.0;
/// Epoch of the supplements.
const SUPPLEMENT_YEAR: f64 = 1991.25;

/// The length of the records of each file, in bytes without the line end.
const MAIN_BYTES: usize = 206;
const SUPPLEMENT_1_BYTES: usize = 122;
const SUPPLEMENT_2_BYTES: usize = 115;

/// Which of its files it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Tycho2 {
    Main,
    Supplement1,
    /// Stars of Tycho-1 that are probably none, or heavily disturbed.
    Supplement2,
}

/// A field of a record: its number between the bars, from 0, and its label.
#[derive(Clone, Copy)]
struct Field(usize, &'static str);

/// Where the fields of a file stand.
struct Layout {
    fields: usize,
    ra: Field,
    dec: Field,
    bt: Field,
    vt: Field,
}

const ID: Field = Field(0, "TYC");
const FLAG: Field = Field(1, "flag");
const PM_RA: Field = Field(4, "pmRA");
const PM_DEC: Field = Field(5, "pmDE");
const OBSERVED_RA: Field = Field(24, "RAdeg");
const OBSERVED_DEC: Field = Field(25, "DEdeg");
const OBSERVED_RA_EPOCH: Field = Field(26, "EpRA-1990");
const OBSERVED_DEC_EPOCH: Field = Field(27, "EpDE-1990");
const SUPPLEMENT_HIP: Field = Field(17, "HIP");

const MAIN: Layout = Layout {
    fields: 32,
    ra: Field(2, "RAmdeg"),
    dec: Field(3, "DEmdeg"),
    bt: Field(17, "BTmag"),
    vt: Field(19, "VTmag"),
};
const SUPPLEMENT: Layout = Layout {
    fields: 18,
    ra: Field(2, "RAdeg"),
    dec: Field(3, "DEdeg"),
    bt: Field(11, "BTmag"),
    vt: Field(13, "VTmag"),
};

impl Tycho2 {
    /// Which file begins with `head`, some hundred bytes; `None` if it is none of Tycho-2.
    pub(super) fn of(head: &[u8]) -> Option<Self> {
        let line = head.split(|&byte| byte == b'\n').next()?;
        let line = line.strip_suffix(b"\r").unwrap_or(line);
        let [id @ .., b'|', flag, b'|'] = line.get(..15)? else {
            return None;
        };
        TychoId::parse(str::from_utf8(id).ok()?)?;
        let bars = line.iter().filter(|&&byte| byte == b'|').count();
        match (flag, line.len(), bars) {
            (b' ' | b'P' | b'X', MAIN_BYTES, _) => Some(Self::Main),
            (b'H' | b'T', SUPPLEMENT_2_BYTES, 17) => Some(Self::Supplement2),
            (b'H' | b'T', ..=SUPPLEMENT_1_BYTES, 17) => Some(Self::Supplement1),
            _ => None,
        }
    }

    fn layout(self) -> &'static Layout {
        match self {
            Self::Main => &MAIN,
            Self::Supplement1 | Self::Supplement2 => &SUPPLEMENT,
        }
    }
}

impl Format for Tycho2 {
    fn catalog(&self) -> Option<&'static str> {
        Some("Tycho-2 Catalogue")
    }

    fn kind(&self) -> String {
        let part = match self {
            Self::Main => "main catalogue",
            Self::Supplement1 => "supplement 1",
            Self::Supplement2 => "supplement 2",
        };
        format!("Tycho-2, {part}")
    }

    fn id_place(&self) -> (FaultPlace, String) {
        (FaultPlace::Byte(1), ID.1.to_owned())
    }

    fn parse(&self, row: Row) -> Record {
        let mut fields = [(0, &b""[..]); 32];
        let count = split(row.bytes, &mut fields);
        let record = Fields { row, fields };
        let layout = self.layout();
        let parsed = if count == layout.fields {
            record.star(*self)
        } else {
            Err(Box::new(Record::Unreadable(RecordFault {
                line: row.line,
                place: FaultPlace::Byte(1),
                label: String::new(),
                found: format!("{count} fields, {}", quoted(row.bytes)),
                expected: match self {
                    Self::Main => "32 fields between bars",
                    _ => "18 fields between bars",
                },
            })))
        };
        parsed.map_or_else(|record| *record, |star| Record::Star(star, None))
    }
}

/// The fields of `bytes` between bars, each with its offset; returns how many there are.
fn split<'a>(bytes: &'a [u8], fields: &mut [(usize, &'a [u8]); 32]) -> usize {
    let (mut start, mut count) = (0, 0);
    for field in bytes.split(|&byte| byte == b'|') {
        if let Some(slot) = fields.get_mut(count) {
            *slot = (start, field);
        }
        start += field.len() + 1;
        count += 1;
    }
    count
}

/// One record. What is no star is an error: boxed, since it is rare.
struct Fields<'a> {
    row: Row<'a>,
    fields: [(usize, &'a [u8]); 32],
}

type Parsed<T> = Result<T, Box<Record>>;

impl<'a> Fields<'a> {
    fn star(&self, file: Tycho2) -> Parsed<Star> {
        let layout = file.layout();
        let id = match file {
            Tycho2::Main => self.tycho_id()?,
            _ => self.supplement_id()?,
        };
        let motion = self.motion()?;
        let (direction, mut flags) = match (file, self.text(FLAG)) {
            (Tycho2::Main, b"X") => (self.observed()?.0, StarFlags::NONE),
            (Tycho2::Main, b"P") => {
                let (observed, year) = self.observed()?;
                (moved(observed, motion, year), StarFlags::MULTIPLE)
            }
            (Tycho2::Main, b"") => (self.position(layout.ra, layout.dec)?, StarFlags::NONE),
            (Tycho2::Supplement1 | Tycho2::Supplement2, b"H" | b"T") => {
                let position = self.position(layout.ra, layout.dec)?;
                (moved(position, motion, SUPPLEMENT_YEAR), StarFlags::NONE)
            }
            (Tycho2::Main, _) => return Err(self.fault(FLAG, "a blank, P or X")),
            _ => return Err(self.fault(FLAG, "H or T")),
        };
        flags = flags
            .union(StarFlags::DERIVED_MAGNITUDE)
            .union(StarFlags::NO_PROPER_MOTION.only_if(motion.is_none()));
        let (v_mag, bv_mag) = self.photometry(layout)?;
        let (pm_ra_mas_per_yr, pm_dec_mas_per_yr) = motion.unwrap_or_default();
        Ok(Star {
            id,
            direction: direction.direction(),
            pm_ra_mas_per_yr,
            pm_dec_mas_per_yr,
            v_mag,
            bv_mag,
            flags,
        })
    }

    fn text(&self, field: Field) -> &'a [u8] {
        self.fields[field.0].1.trim_ascii()
    }

    fn tycho_id(&self) -> Parsed<StarId> {
        let parts = self.text(ID).split(|&byte| byte == b' ');
        let mut numbers = parts.map(|part| u32::try_from(whole_number(part)?).ok());
        let mut next = || numbers.next().flatten();
        let id = match (next(), next(), next(), next()) {
            (Some(region), Some(star), Some(component), None) => {
                TychoId::new(region, star, component)
            }
            _ => None,
        };
        id.map(StarId::Tycho)
            .ok_or_else(|| self.fault(ID, "the three numbers of a TYC identifier"))
    }

    fn supplement_id(&self) -> Parsed<StarId> {
        let tycho = self.tycho_id()?;
        let hipparcos = self.text(SUPPLEMENT_HIP);
        if hipparcos.iter().any(u8::is_ascii_uppercase) {
            let id = str::from_utf8(hipparcos).ok().and_then(HipparcosId::parse);
            let id =
                id.ok_or_else(|| self.fault(SUPPLEMENT_HIP, "a Hipparcos number and a letter"))?;
            return Ok(StarId::Hipparcos(id));
        }
        Ok(tycho)
    }

    /// In mas a year, along the circles; `None` if both are blank.
    fn motion(&self) -> Parsed<Option<(f32, f32)>> {
        let expected = "a proper motion in mas a year, or none in both coordinates";
        let limit = f64::from(PM_LIMIT_MAS_PER_YR);
        match (
            self.number(PM_RA, expected)?,
            self.number(PM_DEC, expected)?,
        ) {
            (None, None) => Ok(None),
            (Some(ra), Some(dec)) if ra.abs() <= limit && dec.abs() <= limit => {
                Ok(Some((ra as f32, dec as f32)))
            }
            (None, Some(_)) => Err(self.fault(PM_RA, expected)),
            _ => Err(self.fault(PM_DEC, expected)),
        }
    }

    /// The observed position and the mean of the years at which its coordinates hold.
    fn observed(&self) -> Parsed<(GridPosition, f64)> {
        let position = self.position(OBSERVED_RA, OBSERVED_DEC)?;
        let epoch = |field| {
            let years = self.number(field, "years since 1990")?;
            years.ok_or_else(|| self.fault(field, "years since 1990"))
        };
        let year = 1990.0 + (epoch(OBSERVED_RA_EPOCH)? + epoch(OBSERVED_DEC_EPOCH)?) / 2.0;
        Ok((position, year))
    }

    fn position(&self, ra: Field, dec: Field) -> Parsed<GridPosition> {
        let expected_ra = "a right ascension from 0 to 360 degrees";
        let expected_dec = "a declination from -90 to +90 degrees";
        let (ra_deg, dec_deg) = match (
            self.number(ra, expected_ra)?,
            self.number(dec, expected_dec)?,
        ) {
            (Some(ra_deg), Some(dec_deg)) => (ra_deg, dec_deg),
            (None, None) => return Err(Box::new(Record::NoPosition)),
            (None, _) => return Err(self.fault(ra, expected_ra)),
            (_, None) => return Err(self.fault(dec, expected_dec)),
        };
        if !(0.0..=360.0).contains(&ra_deg) {
            return Err(self.fault(ra, expected_ra));
        }
        GridPosition::from_degrees(ra_deg, dec_deg).ok_or_else(|| self.fault(dec, expected_dec))
    }

    /// V and B−V.
    fn photometry(&self, layout: &Layout) -> Parsed<(f32, Option<f32>)> {
        let magnitude = |field| {
            let expected = "a magnitude from -32 to 32";
            match self.number(field, expected)? {
                Some(mag) if mag.abs() > f64::from(MAG_LIMIT) => Err(self.fault(field, expected)),
                mag => Ok(mag),
            }
        };
        let johnson = johnson(magnitude(layout.bt)?, magnitude(layout.vt)?);
        johnson.ok_or_else(|| Box::new(Record::NoMagnitude))
    }

    fn number(&self, field: Field, expected: &'static str) -> Parsed<Option<f64>> {
        let text = self.text(field);
        if text.is_empty() {
            return Ok(None);
        }
        let number = str::from_utf8(text).ok().and_then(decimal);
        number.map(Some).ok_or_else(|| self.fault(field, expected))
    }

    fn fault(&self, field: Field, expected: &'static str) -> Box<Record> {
        let (start, text) = self.fields[field.0];
        Box::new(Record::Unreadable(RecordFault {
            line: self.row.line,
            place: FaultPlace::Byte(start + 1),
            label: field.1.to_owned(),
            found: quoted(text),
            expected,
        }))
    }
}

/// Where a star at `position` in `year` stands at J2000.
fn moved(position: GridPosition, motion: Option<(f32, f32)>, year: f64) -> GridPosition {
    let Some((pm_ra_mas_per_yr, pm_dec_mas_per_yr)) = motion else {
        return position;
    };
    let star = Star {
        pm_ra_mas_per_yr,
        pm_dec_mas_per_yr,
        ..Star::new(StarId::Number(0), position.direction(), 0.0)
    };
    GridPosition::nearest(&star.direction_at(J2000_YEAR - year))
}

/// V and B−V in Johnson's system, to the thousandth; `None` without any magnitude.
pub(super) fn johnson(bt_mag: Option<f64>, vt_mag: Option<f64>) -> Option<(f32, Option<f32>)> {
    let (v_mag, bv_mag) = match (bt_mag, vt_mag) {
        (Some(bt), Some(vt)) => {
            let color = bt - vt;
            (vt + V_PER_COLOR * color, Some(BV_PER_COLOR * color))
        }
        (None, Some(vt)) => (vt, None),
        (Some(bt), None) => (bt - (1.0 - V_PER_COLOR) * MEDIAN_COLOR_MAG, None),
        (None, None) => return None,
    };
    Some((mag_on_grid(v_mag), bv_mag.map(mag_on_grid)))
}
