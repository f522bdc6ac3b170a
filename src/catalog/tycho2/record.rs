//! Parses one record of Tycho-2.

use super::johnson::johnson;
use super::layout::{
    FLAG, ID, OBSERVED_DEC, OBSERVED_DEC_EPOCH, OBSERVED_RA, OBSERVED_RA_EPOCH, PM_DEC, PM_RA,
    SUPPLEMENT_HIP, Tycho2, Tycho2Field, Tycho2Layout,
};
use crate::base::angle::decimal;
use crate::catalog::error::{RecordError, RecordLocation, quoted};
use crate::catalog::id::whole_number;
use crate::catalog::import::{Parsed, Rejection, Row, both_or_neither};
use crate::catalog::position::{EXPECTED_DEC, Position};
use crate::catalog::star::{J2000_YEAR, MAG_LIMIT, PM_LIMIT_MAS_PER_YR};
use crate::catalog::{HipparcosId, Star, StarFlags, StarId, TychoId};

/// The most fields that a record has.
const FIELDS_MAX: usize = 32;

/// A record, split into fields.
pub(super) struct Tycho2Record<'a> {
    file: Tycho2,
    line: u64,
    /// The offset and the bytes of each field.
    fields: [(usize, &'a [u8]); FIELDS_MAX],
}

impl<'a> Tycho2Record<'a> {
    /// Splits a row of `file`.
    pub(super) fn split(file: Tycho2, row: Row<'a>) -> Parsed<Self> {
        let mut fields = [(0, &b""[..]); FIELDS_MAX];
        let (mut start, mut count) = (0, 0);
        for field in row.bytes.split(|&byte| byte == b'|') {
            if let Some(slot) = fields.get_mut(count) {
                *slot = (start, field);
            }
            start += field.len() + 1;
            count += 1;
        }
        let (layout, line) = (file.layout(), row.line);
        if count != layout.field_count {
            return Err(Box::new(Rejection::Unreadable(RecordError {
                line,
                location: RecordLocation::Byte(1),
                label: String::new(),
                found: format!("{count} fields, {}", quoted(row.bytes)),
                expected: layout.expected_fields,
            })));
        }
        Ok(Self { file, line, fields })
    }

    pub(super) fn star(&self) -> Parsed<Star> {
        /// The epoch of the supplements.
        const SUPPLEMENT_YEAR: f64 = 1991.25;
        let (file, layout) = (self.file, self.file.layout());
        let id = match file {
            Tycho2::Main => self.tycho_id()?,
            _ => self.supplement_id()?,
        };
        let motion = self.motion()?;
        let (position, flags) = match (file, self.text(FLAG)) {
            (Tycho2::Main, b"X") => (self.observed()?.0, StarFlags::NONE),
            (Tycho2::Main, b"P") => {
                let (observed, year) = self.observed()?;
                (at_j2000(observed, motion, year), StarFlags::MULTIPLE)
            }
            (Tycho2::Main, b"") => (self.position(layout.ra, layout.dec)?, StarFlags::NONE),
            (Tycho2::Supplement1 | Tycho2::Supplement2, b"H" | b"T") => {
                let position = self.position(layout.ra, layout.dec)?;
                (at_j2000(position, motion, SUPPLEMENT_YEAR), StarFlags::NONE)
            }
            (Tycho2::Main, _) => return Err(self.error(FLAG, "a blank, P or X")),
            _ => return Err(self.error(FLAG, "H or T")),
        };
        let (v_mag, bv_mag) = self.photometry(layout)?;
        let (pm_ra_mas_per_yr, pm_dec_mas_per_yr) = motion.unwrap_or_default();
        Ok(Star {
            id,
            direction: position.direction(),
            pm_ra_mas_per_yr,
            pm_dec_mas_per_yr,
            v_mag,
            bv_mag,
            flags: flags
                .union(StarFlags::DERIVED_MAGNITUDE)
                .union(StarFlags::NO_PROPER_MOTION.only_if(motion.is_none())),
        })
    }

    fn text(&self, field: Tycho2Field) -> &'a [u8] {
        self.fields[field.index].1.trim_ascii()
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
            .ok_or_else(|| self.error(ID, "the three numbers of a TYC identifier"))
    }

    fn supplement_id(&self) -> Parsed<StarId> {
        let tycho = self.tycho_id()?;
        let hipparcos = self.text(SUPPLEMENT_HIP);
        if hipparcos.iter().any(u8::is_ascii_uppercase) {
            let id = str::from_utf8(hipparcos).ok().and_then(HipparcosId::parse);
            let id =
                id.ok_or_else(|| self.error(SUPPLEMENT_HIP, "a Hipparcos number and a letter"))?;
            return Ok(StarId::Hipparcos(id));
        }
        Ok(tycho)
    }

    /// In mas a year, in right ascension times cos(declination) and in declination; `None` if both
    /// are blank.
    fn motion(&self) -> Parsed<Option<(f32, f32)>> {
        let expected = "a proper motion in mas a year, or none in both coordinates";
        let limit = f64::from(PM_LIMIT_MAS_PER_YR);
        let motion = both_or_neither(
            self.number(PM_RA, expected)?,
            self.number(PM_DEC, expected)?,
            || self.error(PM_RA, expected),
            || self.error(PM_DEC, expected),
        )?;
        match motion {
            Some((ra, dec)) if ra.abs().max(dec.abs()) > limit => Err(self.error(PM_DEC, expected)),
            motion => Ok(motion.map(|(ra, dec)| (ra as f32, dec as f32))),
        }
    }

    /// The observed position, and the mean of the epochs of its coordinates as a Julian year.
    fn observed(&self) -> Parsed<(Position, f64)> {
        let position = self.position(OBSERVED_RA, OBSERVED_DEC)?;
        let epoch = |field| {
            let years = self.number(field, "years since 1990")?;
            years.ok_or_else(|| self.error(field, "years since 1990"))
        };
        let year = 1990.0 + (epoch(OBSERVED_RA_EPOCH)? + epoch(OBSERVED_DEC_EPOCH)?) / 2.0;
        Ok((position, year))
    }

    fn position(&self, ra: Tycho2Field, dec: Tycho2Field) -> Parsed<Position> {
        let expected_ra = "a right ascension from 0 to 360 degrees";
        let (ra_deg, dec_deg) = both_or_neither(
            self.number(ra, expected_ra)?,
            self.number(dec, EXPECTED_DEC)?,
            || self.error(ra, expected_ra),
            || self.error(dec, EXPECTED_DEC),
        )?
        .ok_or(Rejection::NoPosition)?;
        if !(0.0..=360.0).contains(&ra_deg) {
            return Err(self.error(ra, expected_ra));
        }
        Position::from_degrees(ra_deg, dec_deg).ok_or_else(|| self.error(dec, EXPECTED_DEC))
    }

    /// V and B−V.
    fn photometry(&self, layout: &Tycho2Layout) -> Parsed<(f32, Option<f32>)> {
        let magnitude = |field| {
            let expected = "a magnitude from -32 to 32";
            match self.number(field, expected)? {
                Some(mag) if mag.abs() > f64::from(MAG_LIMIT) => Err(self.error(field, expected)),
                mag => Ok(mag),
            }
        };
        let johnson = johnson(magnitude(layout.bt)?, magnitude(layout.vt)?);
        Ok(johnson.ok_or(Rejection::NoMagnitude)?)
    }

    fn number(&self, field: Tycho2Field, expected: &'static str) -> Parsed<Option<f64>> {
        let text = self.text(field);
        if text.is_empty() {
            return Ok(None);
        }
        let number = str::from_utf8(text).ok().and_then(decimal);
        number.map(Some).ok_or_else(|| self.error(field, expected))
    }

    fn error(&self, field: Tycho2Field, expected: &'static str) -> Box<Rejection> {
        let (start, text) = self.fields[field.index];
        Box::new(Rejection::Unreadable(RecordError {
            line: self.line,
            location: RecordLocation::Byte(start + 1),
            label: field.label.to_owned(),
            found: quoted(text),
            expected,
        }))
    }
}

/// The position at J2000 of a star at `position` in `year`.
fn at_j2000(position: Position, motion: Option<(f32, f32)>, year: f64) -> Position {
    let Some((pm_ra_mas_per_yr, pm_dec_mas_per_yr)) = motion else {
        return position;
    };
    let star = Star {
        pm_ra_mas_per_yr,
        pm_dec_mas_per_yr,
        ..Star::new(StarId::Number(0), position.direction(), 0.0)
    };
    Position::nearest(&star.direction_at(J2000_YEAR - year))
}
