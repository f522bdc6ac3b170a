//! One SKY2000 record, cut into cells, → a star: what fixed-width files and tables have in common.
//!
//! Numbers are read as whole multiples of their last decimal place, so that nothing is rounded on
//! the way in. A cell may be padded with blanks before and after the number, and between its sign
//! and its digits (`"- 0.0135"`); nothing else is let through.

use super::error::{FaultPlace, RecordFault, quoted};
use super::import::Record;
use super::position::{GridPosition, STEPS_PER_MAS, STEPS_PER_TENTH_MS_OF_TIME};
use super::star::mag_from_mmag;
use super::{Star, StarFlags, StarId};

/// A column of SKY2000: its label, and the bytes it takes up in a fixed-width record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Column {
    /// The label of the published format description.
    pub(super) label: &'static str,
    /// First byte, from 1.
    pub(super) first_byte: usize,
    /// Last byte, included.
    pub(super) last_byte: usize,
}

impl Column {
    pub(super) const fn new(label: &'static str, first_byte: usize, last_byte: usize) -> Self {
        Self {
            label,
            first_byte,
            last_byte,
        }
    }

    /// The column's bytes in `record`, which is of full length.
    pub(super) fn cut<'a>(&self, record: &'a [u8]) -> &'a [u8] {
        &record[self.first_byte - 1..self.last_byte]
    }
}

/// The columns that a star is made of; the value is the position in [`COLUMNS`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Cell {
    Id,
    Name,
    VariableName,
    RaH,
    RaM,
    RaS,
    DecSign,
    DecD,
    DecM,
    DecS,
    BlendedPosition,
    PmRa,
    PmDec,
    VObserved,
    VDerived,
    BlendedV,
    BMinusV,
    Separation,
    VariableType,
}

/// The number of columns that a star is made of.
pub(super) const COLUMN_COUNT: usize = 19;

/// Where each [`Cell`] stands in a record of SKY2000, version 4 or 5 (V/109 and V/145 at the CDS).
pub(super) const COLUMNS: [Column; COLUMN_COUNT] = [
    Column::new("ID", 28, 35),
    Column::new("Name", 99, 108),
    Column::new("Vname", 109, 118),
    Column::new("RAh", 119, 120),
    Column::new("RAm", 121, 122),
    Column::new("RAs", 123, 129),
    Column::new("DE-", 130, 130),
    Column::new("DEd", 131, 132),
    Column::new("DEm", 133, 134),
    Column::new("DEs", 135, 140),
    Column::new("f_pos", 147, 147),
    Column::new("pmRA", 150, 157),
    Column::new("pmDE", 158, 165),
    Column::new("Vmag", 233, 238),
    Column::new("Vder", 239, 243),
    Column::new("f_Vmag", 249, 249),
    Column::new("B-V", 259, 264),
    Column::new("sep", 342, 348),
    Column::new("varTyp", 444, 446),
];

impl Cell {
    /// Where it stands in a record of SKY2000.
    pub(super) const fn column(self) -> Column {
        COLUMNS[self as usize]
    }
}

/// The columns without which a table is no catalogue.
pub(super) const REQUIRED: [Cell; 9] = [
    Cell::Id,
    Cell::RaH,
    Cell::RaM,
    Cell::RaS,
    Cell::DecSign,
    Cell::DecD,
    Cell::DecM,
    Cell::DecS,
    Cell::VObserved,
];

/// The cells of one record, in the order of [`COLUMNS`]; a column that the source lacks is empty.
pub(super) type Cells<'a> = [&'a [u8]; COLUMN_COUNT];

/// Why a record gives no star.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Rejection {
    /// It is read, but has no right ascension and declination.
    NoPosition,
    /// It is read, but has neither an observed nor a derived V magnitude.
    NoMagnitude,
    /// A cell does not hold what it should.
    Unreadable { cell: Cell, expected: &'static str },
}

/// What the record on `line` is; `place_of` tells where in the line a column stands.
pub(super) fn parse_record(
    line: u64,
    cells: &Cells,
    place_of: impl Fn(Cell) -> FaultPlace,
) -> Record {
    match parse_star(cells) {
        Ok(star) => Record::Star(star, parse_name(cells[Cell::Name as usize])),
        Err(Rejection::NoPosition) => Record::NoPosition,
        Err(Rejection::NoMagnitude) => Record::NoMagnitude,
        Err(Rejection::Unreadable { cell, expected }) => Record::Unreadable(RecordFault {
            line,
            place: place_of(cell),
            label: COLUMNS[cell as usize].label.to_owned(),
            found: quoted(cells[cell as usize]),
            expected,
        }),
    }
}

/// The star in `cells`.
pub(super) fn parse_star(cells: &Cells) -> Result<Star, Rejection> {
    let id = parse_id(cells)?;
    let position = parse_position(cells)?;
    let magnitude = parse_v_magnitude(cells)?;
    let bv_mmag = parse_magnitude(cells, Cell::BMinusV)?;
    // At the equator if the position is missing: only to see whether the cells can be read.
    let dec_rad = position.map_or(0.0, GridPosition::dec_rad);
    let motion = parse_proper_motion(cells, dec_rad)?;

    let position = position.ok_or(Rejection::NoPosition)?;
    let (v_mmag, derived) = magnitude.ok_or(Rejection::NoMagnitude)?;
    let present = |cell: Cell| !is_blank(cells[cell as usize]);
    let flags = StarFlags::NONE
        .union(StarFlags::BLENDED_POSITION.only_if(present(Cell::BlendedPosition)))
        .union(StarFlags::BLENDED_MAGNITUDE.only_if(present(Cell::BlendedV)))
        .union(StarFlags::MULTIPLE.only_if(present(Cell::Separation)))
        .union(
            StarFlags::VARIABLE.only_if(present(Cell::VariableType) || present(Cell::VariableName)),
        )
        .union(StarFlags::DERIVED_MAGNITUDE.only_if(derived))
        .union(StarFlags::NO_PROPER_MOTION.only_if(motion.is_none()));
    let (pm_ra_mas_per_yr, pm_dec_mas_per_yr) = motion.unwrap_or_default();
    Ok(Star {
        id,
        direction: position.direction(),
        pm_ra_mas_per_yr,
        pm_dec_mas_per_yr,
        v_mag: mag_from_mmag(v_mmag),
        bv_mag: bv_mmag.map(mag_from_mmag),
        flags,
    })
}

/// The star's Bayer or Flamsteed name, as in `"1 alp UMi"`, `"25 eta Tau"`, `"tau5 Ser"`.
///
/// SKY2000's ten bytes are a Flamsteed number (3), a Greek letter (3), its superscript (1) and a
/// constellation (3). Anything else there (an AGK3 number, a stray number) is no name: `None`.
pub(super) fn parse_name(cell: &[u8]) -> Option<String> {
    // In a table the blanks before the name may be gone; the constellation always ends it.
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

fn parse_id(cells: &Cells) -> Result<StarId, Rejection> {
    let expected = "a Skymap number from 1 to 99999999";
    match whole_number(cells, Cell::Id, expected)? {
        Some(number @ 1..=99_999_999) => Ok(StarId::Skymap(number)),
        _ => unreadable(Cell::Id, expected),
    }
}

/// `None` if every part is blank.
fn parse_position(cells: &Cells) -> Result<Option<GridPosition>, Rejection> {
    const PARTS: [Cell; 7] = [
        Cell::RaH,
        Cell::RaM,
        Cell::RaS,
        Cell::DecSign,
        Cell::DecD,
        Cell::DecM,
        Cell::DecS,
    ];
    if PARTS.iter().all(|&part| is_blank(cells[part as usize])) {
        return Ok(None);
    }
    let ra_h = sexagesimal(cells, Cell::RaH, 0, 24, "hours from 0 to 23")?;
    let ra_m = sexagesimal(cells, Cell::RaM, 0, 60, "minutes from 0 to 59")?;
    let ra_s4 = sexagesimal(cells, Cell::RaS, 4, 60, "seconds below 60, in 0.0001 s")?;
    let south = match cells[Cell::DecSign as usize].trim_ascii() {
        b"+" => false,
        b"-" => true,
        _ => return unreadable(Cell::DecSign, "the sign + or -"),
    };
    let dec_d = sexagesimal(cells, Cell::DecD, 0, 91, "degrees from 0 to 90")?;
    let dec_m = sexagesimal(cells, Cell::DecM, 0, 60, "minutes from 0 to 59")?;
    let dec_s3 = sexagesimal(cells, Cell::DecS, 3, 60, "seconds below 60, in 0.001\"")?;

    let ra_steps = ((ra_h * 60 + ra_m) * 600_000 + ra_s4) * STEPS_PER_TENTH_MS_OF_TIME;
    let dec_steps = (((dec_d * 60 + dec_m) * 60_000 + dec_s3) * STEPS_PER_MAS).cast_signed();
    match GridPosition::new(ra_steps, if south { -dec_steps } else { dec_steps }) {
        Some(position) => Ok(Some(position)),
        None => unreadable(Cell::DecD, "a declination from -90 to +90 degrees"),
    }
}

/// V in millimagnitudes, and whether it is derived; `None` if there is neither.
fn parse_v_magnitude(cells: &Cells) -> Result<Option<(i16, bool)>, Rejection> {
    let observed = parse_magnitude(cells, Cell::VObserved)?;
    let derived = parse_magnitude(cells, Cell::VDerived)?;
    let observed = observed.map(|mmag| (mmag, false));
    Ok(observed.or(derived.map(|mmag| (mmag, true))))
}

/// In mas a year, in right ascension times cos(declination) and in declination; `None` if both are blank.
fn parse_proper_motion(cells: &Cells, dec_rad: f64) -> Result<Option<(f32, f32)>, Rejection> {
    let ra = decimal(cells, Cell::PmRa, 5, "seconds of time a year, in 0.00001 s")?;
    let dec = decimal(cells, Cell::PmDec, 4, "arcseconds a year, in 0.0001\"")?;
    let (ra, dec) = match (ra, dec) {
        (None, None) => return Ok(None),
        (Some(ra), Some(dec)) => (ra, dec),
        (None, Some(_)) => return unreadable(Cell::PmRa, "a value, as pmDE has one"),
        (Some(_), None) => return unreadable(Cell::PmDec, "a value, as pmRA has one"),
    };
    // 0.00001 s of time is 0.15 mas along the equator; 0.0001″ is 0.1 mas.
    let ra_mas_per_yr = f64::from(ra) * 15.0 / 100.0 * dec_rad.cos();
    let dec_mas_per_yr = f64::from(dec) / 10.0;
    let limit = f64::from(i16::MAX);
    if ra_mas_per_yr.abs() > limit {
        return unreadable(Cell::PmRa, "a proper motion within 32.767\" a year");
    }
    if dec_mas_per_yr.abs() > limit {
        return unreadable(Cell::PmDec, "a proper motion within 32.767\" a year");
    }
    Ok(Some((ra_mas_per_yr as f32, dec_mas_per_yr as f32)))
}

/// A magnitude or colour in millimagnitudes.
fn parse_magnitude(cells: &Cells, cell: Cell) -> Result<Option<i16>, Rejection> {
    let expected = "magnitudes from -32 to 32, in 0.001 mag";
    match decimal(cells, cell, 3, expected)? {
        None => Ok(None),
        Some(mmag) if mmag.abs() <= 32_000 => Ok(Some(mmag as i16)),
        Some(_) => unreadable(cell, expected),
    }
}

/// A part of a sexagesimal number, in units of its last decimal place, below `limit` whole units.
fn sexagesimal(
    cells: &Cells,
    cell: Cell,
    decimals: u32,
    limit: u32,
    expected: &'static str,
) -> Result<u32, Rejection> {
    let is_signed = cells[cell as usize]
        .iter()
        .any(|b| matches!(b, b'+' | b'-'));
    let value = decimal(cells, cell, decimals, expected)?;
    match value.map(u32::try_from) {
        Some(Ok(value)) if value < limit * 10_u32.pow(decimals) && !is_signed => Ok(value),
        _ => unreadable(cell, expected),
    }
}

fn whole_number(
    cells: &Cells,
    cell: Cell,
    expected: &'static str,
) -> Result<Option<u32>, Rejection> {
    match decimal(cells, cell, 0, expected)?.map(u32::try_from) {
        None => Ok(None),
        Some(Ok(number)) => Ok(Some(number)),
        Some(Err(_)) => unreadable(cell, expected),
    }
}

/// The number in a cell, times 10^`decimals`; `None` if the cell is blank.
fn decimal(
    cells: &Cells,
    cell: Cell,
    decimals: u32,
    expected: &'static str,
) -> Result<Option<i32>, Rejection> {
    let text = cells[cell as usize].trim_ascii();
    if text.is_empty() {
        return Ok(None);
    }
    match scaled_number(text, decimals) {
        Some(value) => Ok(Some(value)),
        None => unreadable(cell, expected),
    }
}

/// `text`, a sign, blanks, digits and at most `decimals` decimals, times 10^`decimals`.
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

fn is_blank(cell: &[u8]) -> bool {
    cell.trim_ascii().is_empty()
}

fn unreadable<T>(cell: Cell, expected: &'static str) -> Result<T, Rejection> {
    Err(Rejection::Unreadable { cell, expected })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::units::{ARCSEC_PER_RAD, RAD_PER_DEG};

    /// A star with everything, Polaris, as the source has it.
    const POLARIS: Cells<'static> = [
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
        b"  1",
    ];

    fn polaris_with(cell: Cell, text: &'static [u8]) -> Result<Star, Rejection> {
        let mut cells = POLARIS;
        cells[cell as usize] = text;
        parse_star(&cells)
    }

    fn fault_of(cell: Cell, text: &'static [u8]) -> Cell {
        match polaris_with(cell, text) {
            Err(Rejection::Unreadable { cell, .. }) => cell,
            other => panic!("{cell:?} {}: {other:?}", text.escape_ascii()),
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
        let star = polaris_with(Cell::VObserved, b" 1.97 ").unwrap();
        assert_eq!(star.v_mag, 1.97);
        assert!(!star.flags.contains(StarFlags::DERIVED_MAGNITUDE));
    }

    #[test]
    fn without_magnitude_or_position_is_not_unreadable() {
        assert_eq!(
            polaris_with(Cell::VDerived, b"     "),
            Err(Rejection::NoMagnitude)
        );
        let mut cells = POLARIS;
        for cell in &mut cells[Cell::RaH as usize..=Cell::DecS as usize] {
            *cell = b"";
        }
        assert_eq!(parse_star(&cells), Err(Rejection::NoPosition));
        assert_eq!(fault_of(Cell::RaH, b"  "), Cell::RaH);
    }

    #[test]
    fn proper_motion_is_known_in_both_coordinates_or_in_neither() {
        let mut cells = POLARIS;
        cells[Cell::PmRa as usize] = b"        ";
        cells[Cell::PmDec as usize] = b"        ";
        let star = parse_star(&cells).unwrap();
        assert!(star.flags.contains(StarFlags::NO_PROPER_MOTION));
        assert_eq!((star.pm_ra_mas_per_yr, star.pm_dec_mas_per_yr), (0.0, 0.0));
        assert_eq!(fault_of(Cell::PmRa, b"        "), Cell::PmRa);
        assert_eq!(fault_of(Cell::PmDec, b"        "), Cell::PmDec);
        assert_eq!(fault_of(Cell::PmDec, b"-33.0000"), Cell::PmDec);
        let sign_after_blank = polaris_with(Cell::PmDec, b" -0.0300").unwrap();
        assert_eq!(sign_after_blank.pm_dec_mas_per_yr, -30.0);
    }

    #[test]
    fn the_sign_of_a_declination_between_0_and_minus_1_is_kept() {
        let mut cells = POLARIS;
        cells[Cell::DecSign as usize] = b"-";
        cells[Cell::DecD as usize] = b" 0";
        cells[Cell::DecM as usize] = b" 1";
        cells[Cell::DecS as usize] = b"20.432";
        let (_, dec_rad) = parse_star(&cells).unwrap().direction.to_ra_dec();
        assert!((dec_rad * ARCSEC_PER_RAD + 80.432).abs() < 1e-6);
    }

    #[test]
    fn a_cell_that_holds_something_else_is_named() {
        for (cell, text) in [
            (Cell::Id, &b"       0"[..]),
            (Cell::Id, b"12 34567"),
            (Cell::Id, b""),
            (Cell::RaH, b"24"),
            (Cell::RaM, b"-1"),
            (Cell::RaM, b"+1"),
            (Cell::RaS, b"60.0000"),
            (Cell::RaS, b"1.23456"),
            (Cell::DecSign, b" "),
            (Cell::DecSign, b"0"),
            (Cell::DecM, b"60"),
            (Cell::DecS, b" .    "),
            (Cell::VDerived, b"2.o0 "),
            (Cell::VObserved, b"99.99 "),
            (Cell::BMinusV, b"+-0.62"),
            (Cell::PmRa, b"0.2-2953"),
        ] {
            assert_eq!(fault_of(cell, text), cell);
        }
        let mut over_the_pole = POLARIS;
        over_the_pole[Cell::DecD as usize] = b"90";
        assert!(matches!(
            parse_star(&over_the_pole),
            Err(Rejection::Unreadable {
                cell: Cell::DecD,
                ..
            })
        ));
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
