//! Parses one SKY2000 record, of a fixed-width file or a table: cells → star.
//!
//! Numbers are parsed as integer multiples of their last decimal place, so they are exact. A cell
//! may be padded with blanks around its number, and between sign and digits (`"- 0.0135"`).

use super::columns::{COLUMN_COUNT, POSITION, StarColumn};
use crate::catalog::error::{RecordError, RecordLocation, quoted};
use crate::catalog::import::{NamedStar, Parsed, Rejection, both_or_neither};
use crate::catalog::position::{EXPECTED_DEC, Position, STEPS_PER_MAS, STEPS_PER_TENTH_MS_OF_TIME};
use crate::catalog::star::{PM_LIMIT_MAS_PER_YR, mag_from_mmag};
use crate::catalog::{Star, StarFlags, StarId};

/// A record, split into cells.
pub(in crate::catalog) struct Sky2000Record<'a> {
    pub(in crate::catalog) line: u64,
    /// The cell of each [`StarColumn`]; empty if the file lacks the column.
    pub(in crate::catalog) cells: [&'a [u8]; COLUMN_COUNT],
    /// Locates a column in the line.
    pub(in crate::catalog) location_of: &'a dyn Fn(StarColumn) -> RecordLocation,
}

impl Sky2000Record<'_> {
    pub(in crate::catalog) fn parse(&self) -> Parsed<NamedStar> {
        Ok((self.star()?, parse_name(self.cell(StarColumn::Name))))
    }

    fn star(&self) -> Parsed<Star> {
        let id = self.id()?;
        let position = self.position()?;
        let magnitude = self.v_magnitude()?;
        let bv_mmag = self.magnitude(StarColumn::BMinusV)?;
        // Without a position the proper motion is only validated.
        let dec_rad = position.map_or(0.0, Position::dec_rad);
        let motion = self.proper_motion(dec_rad)?;
        let small_amplitude = self.has_small_amplitude()?;
        let faint_companion = self.has_faint_companion()?;

        let position = position.ok_or(Rejection::NoPosition)?;
        let (v_mmag, derived) = magnitude.ok_or(Rejection::NoMagnitude)?;
        let (pm_ra_mas_per_yr, pm_dec_mas_per_yr) = motion.unwrap_or_default();
        Ok(Star {
            id,
            direction: position.direction(),
            pm_ra_mas_per_yr,
            pm_dec_mas_per_yr,
            v_mag: mag_from_mmag(v_mmag),
            bv_mag: bv_mmag.map(mag_from_mmag),
            flags: self
                .flags()
                .union(StarFlags::DERIVED_MAGNITUDE.only_if(derived))
                .union(StarFlags::NO_PROPER_MOTION.only_if(motion.is_none()))
                .union(StarFlags::SMALL_AMPLITUDE.only_if(small_amplitude))
                .union(StarFlags::FAINT_COMPANION.only_if(faint_companion)),
        })
    }

    fn flags(&self) -> StarFlags {
        [
            (StarColumn::BlendedPosition, StarFlags::BLENDED_POSITION),
            (StarColumn::BlendedV, StarFlags::BLENDED_MAGNITUDE),
            (StarColumn::Separation, StarFlags::MULTIPLE),
            (StarColumn::VariableType, StarFlags::VARIABLE),
            (StarColumn::VariableName, StarFlags::VARIABLE),
        ]
        .into_iter()
        .fold(StarFlags::NONE, |flags, (column, flag)| {
            flags.union(flag.only_if(!self.cell(column).is_empty()))
        })
    }

    fn has_small_amplitude(&self) -> Parsed<bool> {
        const LARGEST_MMAG: u16 = 100;
        let brightest = self.magnitude(StarColumn::MaximumMag)?;
        let range = self.magnitude(StarColumn::MinimumMag)?.zip(brightest);
        let by_range = range.map(|(faintest, brightest)| faintest.abs_diff(brightest));
        let amplitude = self.magnitude(StarColumn::Amplitude)?;
        let amplitude_mmag = amplitude.map(i16::unsigned_abs).or(by_range);
        Ok(amplitude_mmag.is_some_and(|mmag| mmag <= LARGEST_MMAG))
    }

    fn has_faint_companion(&self) -> Parsed<bool> {
        const MIN_MMAG: i16 = 4000;
        let fainter = self.magnitude(StarColumn::MagDifference)?;
        Ok(fainter.is_some_and(|mmag| mmag >= MIN_MMAG))
    }

    /// The bytes of a cell without padding.
    fn cell(&self, column: StarColumn) -> &[u8] {
        self.cells[column as usize].trim_ascii()
    }

    fn id(&self) -> Parsed<StarId> {
        let expected = "a Skymap number from 1 to 99999999";
        match self.decimal(StarColumn::Id, 0, expected)? {
            Some(number @ 1..=99_999_999) => Ok(StarId::Skymap(number.cast_unsigned())),
            _ => self.unreadable(StarColumn::Id, expected),
        }
    }

    /// `None` if every part is blank.
    fn position(&self) -> Parsed<Option<Position>> {
        if POSITION.iter().all(|&part| self.cell(part).is_empty()) {
            return Ok(None);
        }
        let ra_h = self.sexagesimal(StarColumn::RaH, 0, 24, "hours from 0 to 23")?;
        let ra_m = self.sexagesimal(StarColumn::RaM, 0, 60, "minutes from 0 to 59")?;
        let ra_s4 = self.sexagesimal(StarColumn::RaS, 4, 60, "seconds below 60, in 0.0001 s")?;
        let south = match self.cell(StarColumn::DecSign) {
            b"+" => false,
            b"-" => true,
            _ => return self.unreadable(StarColumn::DecSign, "the sign + or -"),
        };
        let dec_d = self.sexagesimal(StarColumn::DecD, 0, 91, "degrees from 0 to 90")?;
        let dec_m = self.sexagesimal(StarColumn::DecM, 0, 60, "minutes from 0 to 59")?;
        let dec_s3 = self.sexagesimal(StarColumn::DecS, 3, 60, "seconds below 60, in 0.001\"")?;

        let ra_steps = ((ra_h * 60 + ra_m) * 600_000 + ra_s4) * STEPS_PER_TENTH_MS_OF_TIME;
        let dec_steps = (((dec_d * 60 + dec_m) * 60_000 + dec_s3) * STEPS_PER_MAS).cast_signed();
        match Position::new(ra_steps, if south { -dec_steps } else { dec_steps }) {
            Some(position) => Ok(Some(position)),
            None => self.unreadable(StarColumn::DecD, EXPECTED_DEC),
        }
    }

    /// V in millimagnitudes, and whether it is derived; `None` if there is neither.
    fn v_magnitude(&self) -> Parsed<Option<(i16, bool)>> {
        let observed = self.magnitude(StarColumn::VObserved)?;
        let derived = self.magnitude(StarColumn::VDerived)?;
        let observed = observed.map(|mmag| (mmag, false));
        Ok(observed.or(derived.map(|mmag| (mmag, true))))
    }

    /// In mas a year, in right ascension times cos(declination) and in declination; `None` if both
    /// are blank.
    fn proper_motion(&self, dec_rad: f64) -> Parsed<Option<(f32, f32)>> {
        let motion = both_or_neither(
            self.decimal(StarColumn::PmRa, 5, "seconds of time a year, in 0.00001 s")?,
            self.decimal(StarColumn::PmDec, 4, "arcseconds a year, in 0.0001\"")?,
            || self.error(StarColumn::PmRa, "a value, because pmDE has one"),
            || self.error(StarColumn::PmDec, "a value, because pmRA has one"),
        )?;
        let Some((ra, dec)) = motion else {
            return Ok(None);
        };
        // 0.00001 s of time is 0.15 mas along the equator; 0.0001″ is 0.1 mas.
        let ra_mas_per_yr = f64::from(ra) * 15.0 / 100.0 * libm::cos(dec_rad);
        let dec_mas_per_yr = f64::from(dec) / 10.0;
        for (column, mas_per_yr) in [
            (StarColumn::PmRa, ra_mas_per_yr),
            (StarColumn::PmDec, dec_mas_per_yr),
        ] {
            if mas_per_yr.abs() > f64::from(PM_LIMIT_MAS_PER_YR) {
                return self.unreadable(column, "a proper motion within 32.767\" a year");
            }
        }
        Ok(Some((ra_mas_per_yr as f32, dec_mas_per_yr as f32)))
    }

    /// A magnitude or color in millimagnitudes.
    fn magnitude(&self, column: StarColumn) -> Parsed<Option<i16>> {
        let expected = "magnitudes from -32 to 32, in 0.001 mag";
        match self.decimal(column, 3, expected)? {
            None => Ok(None),
            Some(mmag) if mmag.abs() <= 32_000 => Ok(Some(mmag as i16)),
            Some(_) => self.unreadable(column, expected),
        }
    }

    /// A part of a sexagesimal number, in units of its last decimal place, below `limit` whole
    /// units.
    fn sexagesimal(
        &self,
        column: StarColumn,
        decimals: u32,
        limit: u32,
        expected: &'static str,
    ) -> Parsed<u32> {
        let is_sign = |byte: &u8| matches!(byte, b'+' | b'-');
        let is_signed = self.cell(column).iter().any(is_sign);
        let value = self.decimal(column, decimals, expected)?;
        match value.map(u32::try_from) {
            Some(Ok(value)) if value < limit * 10_u32.pow(decimals) && !is_signed => Ok(value),
            _ => self.unreadable(column, expected),
        }
    }

    /// The number in a cell, times 10^`decimals`; `None` if the cell is blank.
    fn decimal(
        &self,
        column: StarColumn,
        decimals: u32,
        expected: &'static str,
    ) -> Parsed<Option<i32>> {
        let text = self.cell(column);
        if text.is_empty() {
            return Ok(None);
        }
        match scaled_number(text, decimals) {
            Some(value) => Ok(Some(value)),
            None => self.unreadable(column, expected),
        }
    }

    fn unreadable<T>(&self, column: StarColumn, expected: &'static str) -> Parsed<T> {
        Err(self.error(column, expected))
    }

    fn error(&self, column: StarColumn, expected: &'static str) -> Box<Rejection> {
        Box::new(Rejection::Unreadable(RecordError {
            line: self.line,
            location: (self.location_of)(column),
            label: column.label().to_owned(),
            found: quoted(self.cells[column as usize]),
            expected,
        }))
    }
}

/// The star's Bayer or Flamsteed name, as in `"1 alp UMi"`, `"25 eta Tau"`, `"tau5 Ser"`.
///
/// The cell's ten bytes are a Flamsteed number (3), a Greek letter (3), its superscript (1) and a
/// constellation (3). `None` for anything else (an AGK3 number, a stray number).
fn parse_name(cell: &[u8]) -> Option<String> {
    // In a table the leading blanks may be missing; the constellation always comes last.
    let name = str::from_utf8(cell).ok()?.trim();
    if !name.is_ascii() || name.len() > 10 {
        return None;
    }
    let name = format!("{name:>10}");
    let (flamsteed, letter) = (name[..3].trim(), name[3..6].trim());
    let (superscript, constellation) = (name[6..7].trim(), &name[7..]);
    let is_number = |text: &str| text.bytes().all(|b| b.is_ascii_digit());
    let is_word = |text: &str| text.bytes().all(|b| b.is_ascii_alphabetic());
    let well_formed =
        is_number(flamsteed) && is_word(letter) && is_number(superscript) && is_word(constellation);
    if !well_formed || (flamsteed.is_empty() && letter.is_empty()) {
        return None;
    }
    let letter = format!("{letter}{superscript}");
    let parts = [flamsteed, &letter, constellation];
    let parts: Vec<&str> = parts.into_iter().filter(|part| !part.is_empty()).collect();
    Some(parts.join(" "))
}

/// Parses a sign, blanks, digits and at most `decimals` decimals; the result is times
/// 10^`decimals`.
fn scaled_number(text: &[u8], decimals: u32) -> Option<i32> {
    let (negative, digits) = match text {
        [b'-', rest @ ..] => (true, rest.trim_ascii_start()),
        [b'+', rest @ ..] => (false, rest.trim_ascii_start()),
        _ => (false, text),
    };
    let point = digits.iter().position(|&b| b == b'.');
    let (whole, fraction) = match point {
        Some(point) => (&digits[..point], &digits[point + 1..]),
        None => (digits, &digits[..0]),
    };
    let missing = decimals.checked_sub(u32::try_from(fraction.len()).ok()?)?;
    if whole.is_empty() && fraction.is_empty() {
        return None;
    }
    let mut value: i32 = 0;
    for &byte in whole.iter().chain(fraction) {
        let digit = i32::from(byte.checked_sub(b'0').filter(|&digit| digit <= 9)?);
        value = value.checked_mul(10)?.checked_add(digit)?;
    }
    value = value.checked_mul(10_i32.checked_pow(missing)?)?;
    Some(if negative { -value } else { value })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::units::{ARCSEC_PER_RAD, RAD_PER_DEG};

    /// Polaris, with all columns, as in the source.
    const POLARIS: [&[u8]; COLUMN_COUNT] = [
        b" 2480053",
        b"  1alp UMi",
        b"alp   UMi ",
        b" 2",
        b"31",
        b"49.0837",
        b"+",
        b"89",
        b"15",
        b"50.794",
        b" ",
        b"+0.22953",
        b"- 0.0118",
        b"      ",
        b" 2.00",
        b" ",
        b"+0.620",
        b" 18.4  ",
        b" 7.0 ",
        b" 1.86",
        b" 2.13",
        b"     ",
        b"  1",
    ];

    fn parse_star(cells: &[&[u8]; COLUMN_COUNT]) -> Parsed<Star> {
        let record = Sky2000Record {
            line: 1,
            cells: *cells,
            location_of: &|column| RecordLocation::Byte(column.fixed().first_byte),
        };
        record.star()
    }

    fn polaris_with(column: StarColumn, text: &'static [u8]) -> Parsed<Star> {
        let mut cells = POLARIS;
        cells[column as usize] = text;
        parse_star(&cells)
    }

    /// Asserts that the error is in `column`.
    fn assert_unreadable(parsed: Parsed<Star>, column: StarColumn) {
        match parsed.map_err(|rejection| *rejection) {
            Err(Rejection::Unreadable(error)) => assert_eq!(error.label, column.label()),
            other => panic!("{column:?}: {other:?}"),
        }
    }

    #[test]
    fn a_full_record_becomes_a_star() {
        let star = parse_star(&POLARIS).unwrap();
        assert_eq!(star.id, StarId::Skymap(2_480_053));
        let (ra_rad, dec_rad) = star.direction.to_ra_dec();
        let ra_deg = (2.0 + 31.0 / 60.0 + 49.0837 / 3600.0) * 15.0;
        let dec_deg = 89.0 + 15.0 / 60.0 + 50.794 / 3600.0;
        assert!((ra_rad - ra_deg * RAD_PER_DEG).abs() * ARCSEC_PER_RAD < 1e-6);
        assert!((dec_rad - dec_deg * RAD_PER_DEG).abs() * ARCSEC_PER_RAD < 1e-6);
        // 0.22953 s · 15 · cos δ = 0.0442″: ESA 1997 has 44.22 mas for HIP 11767.
        assert!((star.pm_ra_mas_per_yr - 44.22).abs() < 0.05);
        assert_eq!(star.pm_dec_mas_per_yr, -11.8);
        assert_eq!((star.v_mag, star.bv_mag), (2.0, Some(0.62)));
        for flag in [
            StarFlags::MULTIPLE,
            StarFlags::VARIABLE,
            StarFlags::DERIVED_MAGNITUDE,
        ] {
            assert!(star.flags.contains(flag));
        }
        assert!(!star.flags.contains(StarFlags::NO_PROPER_MOTION));
        assert!(!star.flags.contains(StarFlags::BLENDED_MAGNITUDE));
    }

    #[test]
    fn an_observed_magnitude_is_preferred_to_a_derived_one() {
        let star = polaris_with(StarColumn::VObserved, b" 1.97 ").unwrap();
        assert_eq!(star.v_mag, 1.97);
        assert!(!star.flags.contains(StarFlags::DERIVED_MAGNITUDE));
    }

    #[test]
    fn amplitudes_and_companions_tell_which_stars_are_fit_for_photometry() {
        let fit = |cells: &[(StarColumn, &'static [u8])]| {
            let mut all = POLARIS;
            for (column, text) in cells {
                all[*column as usize] = text;
            }
            parse_star(&all).unwrap().flags.is_constant_and_single()
        };
        // It varies by 0.27 mag.
        assert!(!fit(&[]));
        assert!(fit(&[(StarColumn::MinimumMag, b" 1.96")]));
        assert!(!fit(&[(StarColumn::MinimumMag, b"     ")]));
        let constant: (_, &[u8]) = (StarColumn::Amplitude, b" 0.03");
        assert!(fit(&[constant]));
        assert!(!fit(&[constant, (StarColumn::MagDifference, b" 3.9 ")]));
        assert!(!fit(&[constant, (StarColumn::MagDifference, b"     ")]));
        assert!(!fit(&[constant, (StarColumn::BlendedV, b"b")]));
    }

    #[test]
    fn records_without_magnitude_or_position_are_not_unreadable() {
        assert_eq!(
            polaris_with(StarColumn::VDerived, b"     "),
            Err(Box::new(Rejection::NoMagnitude))
        );
        let mut cells = POLARIS;
        for cell in &mut cells[StarColumn::RaH as usize..=StarColumn::DecS as usize] {
            *cell = b"";
        }
        assert_eq!(parse_star(&cells), Err(Box::new(Rejection::NoPosition)));
        assert_unreadable(polaris_with(StarColumn::RaH, b"  "), StarColumn::RaH);
    }

    #[test]
    fn proper_motion_is_known_in_both_coordinates_or_in_neither() {
        let mut cells = POLARIS;
        cells[StarColumn::PmRa as usize] = b"        ";
        cells[StarColumn::PmDec as usize] = b"        ";
        let star = parse_star(&cells).unwrap();
        assert!(star.flags.contains(StarFlags::NO_PROPER_MOTION));
        assert_eq!((star.pm_ra_mas_per_yr, star.pm_dec_mas_per_yr), (0.0, 0.0));
        assert_unreadable(
            polaris_with(StarColumn::PmRa, b"        "),
            StarColumn::PmRa,
        );
        assert_unreadable(
            polaris_with(StarColumn::PmDec, b"        "),
            StarColumn::PmDec,
        );
        assert_unreadable(
            polaris_with(StarColumn::PmDec, b"-33.0000"),
            StarColumn::PmDec,
        );
        let sign_after_blank = polaris_with(StarColumn::PmDec, b" -0.0300").unwrap();
        assert_eq!(sign_after_blank.pm_dec_mas_per_yr, -30.0);
    }

    #[test]
    fn the_sign_of_a_declination_between_0_and_minus_1_is_kept() {
        let mut cells = POLARIS;
        cells[StarColumn::DecSign as usize] = b"-";
        cells[StarColumn::DecD as usize] = b" 0";
        cells[StarColumn::DecM as usize] = b" 1";
        cells[StarColumn::DecS as usize] = b"20.432";
        let (_, dec_rad) = parse_star(&cells).unwrap().direction.to_ra_dec();
        assert!((dec_rad * ARCSEC_PER_RAD + 80.432).abs() < 1e-6);
    }

    #[test]
    fn errors_name_the_column() {
        for (column, text) in [
            (StarColumn::Id, &b"       0"[..]),
            (StarColumn::Id, b"12 34567"),
            (StarColumn::Id, b""),
            (StarColumn::RaH, b"24"),
            (StarColumn::RaM, b"-1"),
            (StarColumn::RaM, b"+1"),
            (StarColumn::RaS, b"60.0000"),
            (StarColumn::RaS, b"1.23456"),
            (StarColumn::DecSign, b" "),
            (StarColumn::DecSign, b"0"),
            (StarColumn::DecM, b"60"),
            (StarColumn::DecS, b" .    "),
            (StarColumn::VDerived, b"2.o0 "),
            (StarColumn::VObserved, b"99.99 "),
            (StarColumn::BMinusV, b"+-0.62"),
            (StarColumn::PmRa, b"0.2-2953"),
        ] {
            assert_unreadable(polaris_with(column, text), column);
        }
        let mut over_the_pole = POLARIS;
        over_the_pole[StarColumn::DecD as usize] = b"90";
        assert_unreadable(parse_star(&over_the_pole), StarColumn::DecD);
    }

    #[test]
    fn names_are_bayer_and_flamsteed_only() {
        for (cell, name) in [
            (&b"  1alp UMi"[..], Some("1 alp UMi")),
            (b" 24    Tau", Some("24 Tau")),
            (b"24    Tau", Some("24 Tau")),
            (b"   tau5Ser", Some("tau5 Ser")),
            (b" 50mu  Cet", Some("50 mu Cet")),
            (b"AG+59 1669", None),
            (b"        36", None),
            (b"          ", None),
            (b"       UMi", None),
            (b"", None),
            (b"\xff\xfe", None),
            (b"a long name that is none", None),
        ] {
            assert_eq!(parse_name(cell).as_deref(), name, "{}", cell.escape_ascii());
        }
    }

    #[test]
    fn numbers_may_be_padded_but_not_broken() {
        for (text, decimals, value) in [
            (&b"- 0.0135"[..], 4, Some(-135)),
            (b"+0.00157", 5, Some(157)),
            (b"9.", 3, Some(9000)),
            (b".5", 1, Some(5)),
            (b"-", 1, None),
            (b"+.", 1, None),
            (b"1 2", 0, None),
            (b"1.2.3", 3, None),
            (b"1.23", 1, None),
            (b"99999999999", 0, None),
            (b"2147483647", 1, None),
        ] {
            assert_eq!(
                scaled_number(text, decimals),
                value,
                "{}",
                text.escape_ascii()
            );
        }
    }
}
