//! Parses one row of a general table.

use super::cells::unquoted;
use super::columns::GeneralColumns;
use super::headings::HeadingUnit;
use super::roles::{
    AngleColumn, ColorColumns, EPOCH_YEARS, Epoch, IdColumns, IdKind, MagnitudeColumns,
    PositionColumns,
};
use crate::base::angle::{Angle, decimal};
use crate::catalog::contents::NAME_BYTES_MAX;
use crate::catalog::error::{RecordError, RecordLocation, quoted};
use crate::catalog::id::whole_number;
use crate::catalog::import::{NamedStar, Parsed, Rejection, both_or_neither};
use crate::catalog::position::{EXPECTED_DEC, Position};
use crate::catalog::star::{J2000_YEAR, MAG_LIMIT, PM_LIMIT_MAS_PER_YR, rounded_mag};
use crate::catalog::tycho2::johnson;
use crate::catalog::{HipparcosId, PlaceId, Star, StarFlags, StarId, TychoId, gaia};
use std::borrow::Cow;
use std::ops::RangeInclusive;
use std::sync::atomic::Ordering;

/// The cells of a row.
pub(in crate::catalog) struct GeneralRow<'a> {
    pub(in crate::catalog) columns: &'a GeneralColumns,
    pub(in crate::catalog) line: u64,
    pub(in crate::catalog) cells: &'a [Cow<'a, str>],
}

impl GeneralRow<'_> {
    /// Parses the star and its name.
    pub(in crate::catalog) fn star(&self) -> Parsed<NamedStar> {
        let columns = self.columns;
        let position = self.position()?;
        let (id, mut name) = self.id(position)?;
        let magnitude = self.magnitude()?;
        let bv_mag = match columns.b_minus_v {
            Some(cell) => {
                let bv_mag = self.in_range(cell, MAG_LIMIT, "a color in magnitudes")?;
                bv_mag.map(rounded_mag)
            }
            None => magnitude.and_then(|(_, bv_mag, _)| bv_mag),
        };
        let motion = self.motion(position.map_or(0.0, Position::dec_rad))?;
        let year = self.epoch_year()?;

        let position = position.ok_or(Rejection::NoPosition)?;
        let (v_mag, _, derived) = magnitude.ok_or(Rejection::NoMagnitude)?;
        let (pm_ra_mas_per_yr, pm_dec_mas_per_yr) = motion.unwrap_or_default();
        let mut star = Star {
            id,
            direction: position.direction(),
            pm_ra_mas_per_yr,
            pm_dec_mas_per_yr,
            v_mag,
            bv_mag,
            flags: StarFlags::DERIVED_MAGNITUDE
                .only_if(derived)
                .union(StarFlags::NO_PROPER_MOTION.only_if(motion.is_none())),
        };
        if year != J2000_YEAR && motion.is_some() {
            let moved = star.direction_at(J2000_YEAR - year);
            star.direction = Position::nearest(&moved).direction();
        }
        if name.is_none() {
            let cell = columns.name.and_then(|cell| self.value(cell));
            name = cell.map(str::to_owned);
        }
        Ok((star, name.map(truncated)))
    }

    /// The text of a cell; `None` if it has no value.
    fn value(&self, cell: usize) -> Option<&str> {
        const NO_VALUE: [&str; 7] = ["", "nan", "null", "none", "--", "n/a", "masked"];
        let text = unquoted(&self.cells[cell]);
        let is_missing = NO_VALUE.iter().any(|word| text.eq_ignore_ascii_case(word));
        (!is_missing).then_some(text)
    }

    /// The identifier, and the name that replaces it if it is not a number.
    fn id(&self, position: Option<Position>) -> Parsed<(StarId, Option<String>)> {
        let IdColumns { kind, cells } = &self.columns.id;
        if *kind == IdKind::Place {
            let position = position.ok_or(Rejection::NoPosition)?;
            let place = PlaceId::of(&position.direction());
            return Ok((StarId::Place(place), None));
        }
        let parts: Option<Vec<&str>> = cells.iter().map(|&cell| self.value(cell)).collect();
        let error = |expected| self.error(cells[0], expected);
        let text = parts.ok_or_else(|| error("an identifier"))?.join(" ");
        let number = || whole_number(text.as_bytes());
        let skymap = || u32::try_from(number()?).ok().map(StarId::Skymap);
        let tycho = || TychoId::parse(&text).map(StarId::Tycho);
        let hipparcos = || HipparcosId::parse(&text).map(StarId::Hipparcos);
        let with_catalog = || StarId::parse(&text);
        let (known, expected) = match kind {
            IdKind::Skymap => (skymap().or_else(with_catalog), "a Skymap number"),
            IdKind::Tycho => (tycho().or_else(with_catalog), "a TYC number like 1-13-1"),
            IdKind::Hipparcos => (hipparcos().or_else(with_catalog), "a Hipparcos number"),
            IdKind::Any | IdKind::Gaia => {
                let numbered = match kind {
                    IdKind::Gaia => StarId::Gaia,
                    _ => StarId::Number,
                };
                let known = with_catalog().or_else(|| number().map(numbered));
                return known.map_or_else(|| self.named(text), |id| Ok((id, None)));
            }
            IdKind::NumberOf(catalog) if number().is_some() => {
                return self.named(format!("{catalog} {text}"));
            }
            IdKind::NumberOf(_) | IdKind::Place => return self.named(text),
        };
        Ok((known.ok_or_else(|| error(expected))?, None))
    }

    /// A star that has only a name.
    fn named(&self, name: String) -> Parsed<(StarId, Option<String>)> {
        let line = u32::try_from(self.line);
        let line =
            line.map_err(|_| self.error(self.columns.id.cells[0], "at most 4294967295 lines"))?;
        Ok((StarId::Named(line), Some(truncated(name))))
    }

    fn position(&self) -> Parsed<Option<Position>> {
        /// Right ascension may be counted west of the equinox as well.
        const RA_RANGE_DEG: RangeInclusive<f64> = -180.0..=360.0;
        let PositionColumns { ra, dec } = &self.columns.position;
        let position = both_or_neither(
            self.angle(ra, HeadingUnit::Hours)?,
            self.angle(dec, HeadingUnit::Degrees)?,
            || self.error(ra.cell, "a right ascension, because there is a declination"),
            || {
                self.error(
                    dec.cell,
                    "a declination, because there is a right ascension",
                )
            },
        )?;
        let Some((ra_deg, dec_deg)) = position else {
            return Ok(None);
        };
        if !RA_RANGE_DEG.contains(&ra_deg) {
            let expected = "a right ascension from 0 to 360 degrees or 0 to 24 hours";
            return Err(self.error(ra.cell, expected));
        }
        let position = Position::from_degrees(ra_deg, dec_deg);
        let position = position.ok_or_else(|| self.error(dec.cell, EXPECTED_DEC))?;
        Ok(Some(position))
    }

    /// An angle in degrees; `sexagesimal` is the unit of sexagesimal numbers without one.
    fn angle(&self, column: &AngleColumn, sexagesimal: HeadingUnit) -> Parsed<Option<f64>> {
        let Some(text) = self.value(column.cell) else {
            return Ok(None);
        };
        let angle = Angle::parse(text);
        if !matches!(angle, Some(Angle::Decimal(_))) {
            let seen = &self.columns.sexagesimal_seen;
            seen.fetch_or(angle.is_some(), Ordering::Relaxed);
        }
        let degrees = match angle {
            Some(Angle::Decimal(value)) => column
                .unit
                .unwrap_or(HeadingUnit::Degrees)
                .to_degrees(value),
            // Also under a heading in degrees, a right ascension like `05:34:48` is in hours.
            Some(Angle::Sexagesimal(value)) => sexagesimal.to_degrees(value),
            Some(Angle::Hours(value)) if sexagesimal == HeadingUnit::Hours => value * 15.0,
            Some(Angle::Degrees(value)) => value,
            Some(Angle::Hours(_)) | None => {
                let expected = "an angle like 83.7, 05:34:48.0 or -00 24 00";
                return Err(self.error(column.cell, expected));
            }
        };
        Ok(Some(degrees))
    }

    /// V, B−V if the magnitudes give it, and whether V is derived.
    fn magnitude(&self) -> Parsed<Option<(f32, Option<f32>, bool)>> {
        let number = |cell: usize| self.in_range(cell, MAG_LIMIT, "a magnitude from -32 to 32");
        let plain = |v_mag: f64, derived: bool| (rounded_mag(v_mag), None, derived);
        Ok(match self.columns.magnitude {
            MagnitudeColumns::Johnson { observed, derived } => {
                let second = derived.map_or(Ok(None), number)?;
                let first = number(observed)?.map(|v_mag| plain(v_mag, false));
                first.or(second.map(|v_mag| plain(v_mag, true)))
            }
            MagnitudeColumns::Tycho { bt, vt } => {
                let bt = bt.map_or(Ok(None), number)?;
                johnson(bt, number(vt)?).map(|(v_mag, bv_mag)| (v_mag, bv_mag, true))
            }
            MagnitudeColumns::Gaia { g, color } => {
                let color = self.gaia_color(color)?;
                let johnson = |g: f64| gaia::johnson(g, color);
                number(g)?
                    .map(johnson)
                    .map(|(v_mag, bv_mag)| (v_mag, bv_mag, true))
            }
            MagnitudeColumns::Approximate { cell, .. } => {
                number(cell)?.map(|v_mag| plain(v_mag, true))
            }
        })
    }

    /// BP−RP, if it is known.
    fn gaia_color(&self, columns: ColorColumns) -> Parsed<Option<f64>> {
        let number = |cell: usize| self.in_range(cell, MAG_LIMIT, "a magnitude from -32 to 32");
        Ok(match columns {
            ColorColumns::Unknown => None,
            ColorColumns::Color(color) => number(color)?,
            ColorColumns::Magnitudes { bp, rp } => {
                number(bp)?.zip(number(rp)?).map(|(bp, rp)| bp - rp)
            }
        })
    }

    /// In mas a year, in right ascension times cos(declination) and in declination; `None` unless
    /// both are known.
    fn motion(&self, dec_rad: f64) -> Parsed<Option<(f32, f32)>> {
        let Some(motion) = &self.columns.motion else {
            return Ok(None);
        };
        let number = |cell: usize, mas: f64| {
            let limit = PM_LIMIT_MAS_PER_YR / mas as f32;
            self.in_range(cell, limit, "a proper motion within 32.767\" a year")
        };
        let ra_mas = if motion.ra_needs_cos_dec {
            motion.ra_unit_mas * libm::cos(dec_rad)
        } else {
            motion.ra_unit_mas
        };
        let (ra, dec) = (
            number(motion.ra, ra_mas)?,
            number(motion.dec, motion.dec_unit_mas)?,
        );
        Ok(ra
            .zip(dec)
            .map(|(ra, dec)| ((ra * ra_mas) as f32, (dec * motion.dec_unit_mas) as f32)))
    }

    fn epoch_year(&self) -> Parsed<f64> {
        match self.columns.epoch {
            Epoch::Year(year) => Ok(year),
            Epoch::Column(cell) => match self.value(cell) {
                None => Ok(J2000_YEAR),
                Some(text) => decimal(text.trim_start_matches(['J', 'j']))
                    .filter(|year| EPOCH_YEARS.contains(year))
                    .ok_or_else(|| self.error(cell, "a year from 1850 to 2100")),
            },
        }
    }

    /// The number in a cell; `None` if it has no value.
    fn in_range(&self, cell: usize, limit: f32, expected: &'static str) -> Parsed<Option<f64>> {
        let Some(text) = self.value(cell) else {
            return Ok(None);
        };
        let number = decimal(text).filter(|number| number.abs() <= f64::from(limit));
        number.map(Some).ok_or_else(|| self.error(cell, expected))
    }

    fn error(&self, cell: usize, expected: &'static str) -> Box<Rejection> {
        Box::new(Rejection::Unreadable(RecordError {
            line: self.line,
            location: RecordLocation::Column(cell + 1),
            label: self.columns.texts[cell].clone(),
            found: quoted(self.cells[cell].as_bytes()),
            expected,
        }))
    }
}

/// A name no longer than the compact form can hold.
fn truncated(mut name: String) -> String {
    while name.len() > NAME_BYTES_MAX {
        name.pop();
    }
    name
}
