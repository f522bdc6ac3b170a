//! Which columns of any star table hold what, and a row's star.
//!
//! Headings → [`Columns`] → with a row's cells, a star at J2000. Headings are compared without regard to case,
//! and a unit in brackets behind a heading, or in a line of its own under the headings, is heeded.

use super::error::{FaultPlace, RecordFault, quoted};
use super::id::whole_number;
use super::import::Record;
use super::position::GridPosition;
use super::star::{StarFlags, mag_on_grid};
use super::tycho2::johnson;
use super::{HipparcosId, MAG_LIMIT, PM_LIMIT_MAS_PER_YR, Star, StarId, TychoId};
use crate::base::angle::{Angle, decimal};
use std::ops::RangeInclusive;
use std::sync::atomic::{AtomicBool, Ordering};

/// Pairs of headings for right ascension and declination, without a unit at their end, the first wanted most.
const POSITIONS: [(&str, &[&str]); 13] = [
    ("_raj2000", &["_dej2000"]),
    ("raj2000", &["dej2000", "decj2000"]),
    ("ra_j2000", &["dec_j2000", "de_j2000"]),
    ("ra2000", &["dec2000", "de2000"]),
    ("ra_epoch2000", &["dec_epoch2000"]),
    ("ramdeg", &["demdeg"]),
    ("ra_icrs", &["de_icrs", "dec_icrs"]),
    ("raicrs", &["deicrs", "decicrs"]),
    ("ra", &["dec", "de"]),
    ("_ra", &["_de", "_dec"]),
    ("alpha", &["delta"]),
    ("alpha_j2000", &["delta_j2000"]),
    ("right_ascension", &["declination"]),
];
/// What may end the heading of a coordinate, and the unit that it means.
const UNIT_ENDINGS: [(&str, Unit); 9] = [
    ("degrees", Unit::Degrees),
    ("degree", Unit::Degrees),
    ("deg", Unit::Degrees),
    ("hours", Unit::Hours),
    ("hour", Unit::Hours),
    ("_hr", Unit::Hours),
    ("_h", Unit::Hours),
    ("_rad", Unit::Radians),
    ("rad", Unit::Radians),
];
/// The same, where the cells tell the unit themselves.
const FORM_ENDINGS: [&str; 4] = ["hms", "dms", "sexagesimal", "sex"];
/// Headings of identifiers, the first wanted most.
const IDENTIFIERS: [(&str, IdKind); 22] = [
    ("skymap", IdKind::Skymap),
    ("skymap_number", IdKind::Skymap),
    ("id", IdKind::Any),
    ("star_id", IdKind::Any),
    ("starid", IdKind::Any),
    ("source_id", IdKind::Any),
    ("source", IdKind::Any),
    ("objid", IdKind::Any),
    ("tyc", IdKind::Tycho),
    ("tyc_id", IdKind::Tycho),
    ("tycho", IdKind::Tycho),
    ("tyc2", IdKind::Tycho),
    ("hip", IdKind::Hipparcos),
    ("identifier", IdKind::Any),
    ("designation", IdKind::Any),
    ("main_id", IdKind::Any),
    ("star", IdKind::Any),
    ("name", IdKind::Any),
    ("hd", IdKind::In("HD")),
    ("hr", IdKind::In("HR")),
    ("sao", IdKind::In("SAO")),
    ("recno", IdKind::Any),
];
const JOHNSON_V: [&str; 9] = [
    "vmag",
    "v",
    "v_mag",
    "mag_v",
    "vjmag",
    "v_johnson",
    "johnson_v",
    "vmag_johnson",
    "mag_johnson_v",
];
/// Magnitudes near V, the first wanted most.
const NEAR_V: [(&str, &str); 10] = [
    ("mag", "magnitude"),
    ("magnitude", "magnitude"),
    ("hpmag", "Hipparcos Hp"),
    ("hp", "Hipparcos Hp"),
    ("phot_g_mean_mag", "Gaia G"),
    ("gmag", "Gaia G"),
    ("g_mag", "Gaia G"),
    ("g", "Gaia G"),
    ("vder", "derived V"),
    ("phot_visual_mag", "visual magnitude"),
];
const B_LESS_V: [&str; 4] = ["b-v", "b_v", "bv", "b_minus_v"];
const MOTION_RA: [&str; 7] = [
    "pmra",
    "pm_ra",
    "pmra*",
    "pm_ra_cosdec",
    "pmra_cosdec",
    "mu_alpha_star",
    "mu_alpha",
];
const MOTION_DEC: [&str; 5] = ["pmde", "pmdec", "pm_de", "pm_dec", "mu_delta"];
const EPOCHS: [&str; 3] = ["ref_epoch", "epoch", "ep"];
/// What stands for no value.
const NOTHING: [&str; 7] = ["", "nan", "null", "none", "--", "n/a", "masked"];
/// Years in which positions of stars can hold.
const EPOCH_YEARS: RangeInclusive<f64> = 1850.0..=2100.0;
const J2000_YEAR: f64 = 2000.0;
/// As far as right ascension is counted west of the equinox, and east of it, in degrees.
const RA_RANGE_DEG: RangeInclusive<f64> = -180.0..=360.0;

/// The unit of a decimal number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Unit {
    Degrees,
    Hours,
    Radians,
}

impl Unit {
    /// The unit that `text` stands for; `None` for any other, and for the form of text in sixtieths.
    fn parse(text: &str) -> Option<Self> {
        match text {
            "deg" | "degree" | "degrees" | "°" => Some(Self::Degrees),
            "h" | "hr" | "hour" | "hours" => Some(Self::Hours),
            "rad" | "radian" | "radians" => Some(Self::Radians),
            _ => None,
        }
    }

    fn to_degrees(self, value: f64) -> f64 {
        match self {
            Self::Degrees => value,
            Self::Hours => value * 15.0,
            Self::Radians => value.to_degrees(),
        }
    }
}

/// What numbers or texts a column of identifiers holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum IdKind {
    Skymap,
    Tycho,
    Hipparcos,
    /// Numbers of the catalogue of this name.
    In(&'static str),
    /// Whatever the cell says.
    Any,
}

/// A heading, as it stands and as it is compared.
pub(super) struct Heading {
    text: String,
    label: String,
    unit: String,
}

impl Heading {
    /// The heading `text`, and what stands under it in a line of units.
    pub(super) fn new(text: &str, unit_below: &str) -> Self {
        let text = unquoted(text);
        let (label, bracket) = match text.split_once(['(', '[']) {
            Some((label, bracket)) if !label.is_empty() => (label, bracket),
            _ => (text, ""),
        };
        let bracket = bracket.trim_end_matches([')', ']']);
        let unit = if unit_below.is_empty() {
            bracket
        } else {
            unit_below
        };
        Self {
            text: text.to_owned(),
            label: label.trim().to_lowercase().replace([' ', '.'], "_"),
            unit: unquoted(unit).to_lowercase(),
        }
    }
}

/// A column of angles.
struct AngleColumn {
    cell: usize,
    /// `None` where nothing tells.
    unit: Option<Unit>,
}

/// The columns of magnitudes.
enum Magnitude {
    /// Johnson V, and one derived from others that takes its place.
    Johnson {
        observed: usize,
        derived: Option<usize>,
    },
    Tycho {
        bt: Option<usize>,
        vt: usize,
    },
    Near {
        cell: usize,
        what: &'static str,
    },
}

/// Proper motions, and what one of their units is in mas a year; along the circle of declination or not.
struct Motion {
    ra: usize,
    dec: usize,
    ra_mas: f64,
    /// The right ascension's is an angle at the pole, still to be shortened by cos(declination).
    ra_at_pole: bool,
    dec_mas: f64,
}

enum Epoch {
    Column(usize),
    Year(f64),
}

/// What each column is taken for.
pub(super) struct Columns {
    texts: Vec<String>,
    id: Vec<usize>,
    id_kind: IdKind,
    name: Option<usize>,
    ra: AngleColumn,
    dec: AngleColumn,
    magnitude: Magnitude,
    b_less_v: Option<usize>,
    motion: Option<Motion>,
    epoch: Epoch,
    /// An angle was written in sixtieths, so its unit is beyond doubt.
    sixtieths_seen: AtomicBool,
}

impl Columns {
    /// What the columns under `headings` are. `note_of` gives what the file says of the column with a heading.
    ///
    /// Fails with what is missing, or with an empty list if the table does not seem to be one of stars.
    pub(super) fn find(
        headings: &[Heading],
        note_of: impl Fn(&str) -> Option<String>,
    ) -> Result<Self, Vec<&'static str>> {
        let position = find_position(headings);
        let magnitude = find_magnitude(headings);
        let id = find_id(headings);
        let mut missing = Vec::new();
        if position.is_none() && magnitude.is_none() {
            return Err(missing);
        }
        if id.is_none() {
            missing.push("of identifiers (id, name, hip, tyc, source_id, ...)");
        }
        if position.is_none() {
            missing.push(
                "of right ascensions and declinations (ra and dec, raj2000 and dej2000, ...)",
            );
        }
        if magnitude.is_none() {
            missing.push("of magnitudes (vmag, mag, vtmag, phot_g_mean_mag, ...)");
        }
        let (Some((ra, dec)), Some(magnitude), Some((id_kind, id))) = (position, magnitude, id)
        else {
            return Err(missing);
        };
        let note = note_of(&headings[ra.cell].text).unwrap_or_default();
        // VizieR computes this one for J2000, whatever the epoch of the catalogue's own.
        let computed = headings[ra.cell].label == POSITIONS[0].0;
        let epoch = match column(headings, &EPOCHS) {
            Some(cell) if !computed => Epoch::Column(cell),
            _ => Epoch::Year(epoch_in(&note).unwrap_or(J2000_YEAR)),
        };
        let name = column(headings, &["name", "proper"]).filter(|cell| !id.contains(cell));
        Ok(Self {
            texts: headings
                .iter()
                .map(|heading| heading.text.clone())
                .collect(),
            id,
            id_kind,
            name,
            ra,
            dec,
            magnitude,
            b_less_v: column(headings, &B_LESS_V),
            motion: find_motion(headings),
            epoch,
            sixtieths_seen: AtomicBool::new(false),
        })
    }

    /// Which columns were taken for what, for people.
    pub(super) fn told(&self) -> String {
        let text = |cell: usize| self.texts[cell].as_str();
        let id: Vec<&str> = self.id.iter().map(|&cell| text(cell)).collect();
        let magnitude = match &self.magnitude {
            Magnitude::Johnson {
                observed,
                derived: None,
            } => format!("V {}", text(*observed)),
            Magnitude::Johnson {
                observed,
                derived: Some(derived),
            } => {
                format!("V {}, else {}", text(*observed), text(*derived))
            }
            Magnitude::Tycho { bt: Some(bt), vt } => {
                format!("V from {} and {}", text(*vt), text(*bt))
            }
            Magnitude::Tycho { bt: None, vt } => format!("V from {}", text(*vt)),
            Magnitude::Near { cell, what } => format!("{what} {} for V", text(*cell)),
        };
        let motion = self
            .motion
            .as_ref()
            .map_or("no proper motion".to_owned(), |motion| {
                format!("proper motion {} and {}", text(motion.ra), text(motion.dec))
            });
        let epoch = match self.epoch {
            Epoch::Column(cell) => format!("epoch {}", text(cell)),
            Epoch::Year(year) => format!("epoch J{year}"),
        };
        let (ra, dec) = (text(self.ra.cell), text(self.dec.cell));
        format!(
            "identifier {}, position {ra} and {dec}, {magnitude}, {motion}, {epoch}",
            id.join("-")
        )
    }

    /// Where the identifier stands, and its heading.
    pub(super) fn id_place(&self) -> (FaultPlace, String) {
        (
            FaultPlace::Cell(self.id[0] + 1),
            self.texts[self.id[0]].clone(),
        )
    }

    /// Whether right ascensions are all decimal numbers taken for degrees.
    pub(super) fn has_bare_numbers(&self) -> bool {
        let decimal = !self.sixtieths_seen.load(Ordering::Relaxed);
        decimal && matches!(self.ra.unit, None | Some(Unit::Degrees))
    }

    /// The star in a row's cells.
    pub(super) fn parse(&self, line: u64, cells: &[&str]) -> Record {
        let row = Cells {
            columns: self,
            line,
            cells,
        };
        match row.star() {
            Ok((star, name)) => Record::Star(star, name),
            Err(record) => *record,
        }
    }
}

/// Text without the quotes around it.
pub(super) fn unquoted(text: &str) -> &str {
    let text = text.trim();
    let inner = text
        .strip_prefix('"')
        .and_then(|text| text.strip_suffix('"'));
    inner.unwrap_or(text).trim()
}

/// The first of `labels` that is a heading.
fn column(headings: &[Heading], labels: &[&str]) -> Option<usize> {
    let place = |label: &&str| headings.iter().position(|heading| heading.label == **label);
    labels.iter().find_map(place)
}

fn find_position(headings: &[Heading]) -> Option<(AngleColumn, AngleColumn)> {
    let coordinate = |wanted: &str| {
        headings.iter().enumerate().find_map(|(cell, heading)| {
            let unit = heading_unit(&heading.label, wanted)?;
            let unit = Unit::parse(&heading.unit).or(unit);
            Some(AngleColumn { cell, unit })
        })
    };
    POSITIONS.iter().find_map(|(ra, decs)| {
        let dec = decs.iter().find_map(|dec| coordinate(dec))?;
        Some((coordinate(ra)?, dec))
    })
}

/// `None` if `label` is not that of the coordinate `wanted`; else the unit that its end tells, if any.
fn heading_unit(label: &str, wanted: &str) -> Option<Option<Unit>> {
    let ending = label.strip_prefix(wanted)?;
    if ending.is_empty() || FORM_ENDINGS.contains(&ending.trim_start_matches('_')) {
        return Some(None);
    }
    let units = UNIT_ENDINGS.iter();
    let mut units =
        units.filter(|(name, _)| ending == *name || ending.strip_prefix('_') == Some(name));
    units.next().map(|(_, unit)| Some(*unit))
}

fn find_id(headings: &[Heading]) -> Option<(IdKind, Vec<usize>)> {
    let place = |label: &str| column(headings, &[label]);
    if let (Some(region), Some(star), Some(component)) =
        (place("tyc1"), place("tyc2"), place("tyc3"))
    {
        return Some((IdKind::Tycho, vec![region, star, component]));
    }
    let (kind, cell) = IDENTIFIERS
        .iter()
        .find_map(|(label, kind)| Some((*kind, place(label)?)))?;
    // SKY2000's own columns tell it from others: its ID is the Skymap number.
    let is_sky2000 = ["vder", "id_merg", "sky2000"]
        .iter()
        .any(|label| place(label).is_some());
    let is_skymap = is_sky2000 && headings[cell].label == "id";
    Some((if is_skymap { IdKind::Skymap } else { kind }, vec![cell]))
}

fn find_magnitude(headings: &[Heading]) -> Option<Magnitude> {
    if let Some(observed) = column(headings, &JOHNSON_V) {
        let derived = column(headings, &["vder"]);
        return Some(Magnitude::Johnson { observed, derived });
    }
    if let Some(vt) = column(headings, &["vtmag", "vt", "vt_mag"]) {
        let bt = column(headings, &["btmag", "bt", "bt_mag"]);
        return Some(Magnitude::Tycho { bt, vt });
    }
    let near = NEAR_V.iter();
    let mut near = near.filter_map(|&(label, what)| Some((column(headings, &[label])?, what)));
    near.next()
        .map(|(cell, what)| Magnitude::Near { cell, what })
}

fn find_motion(headings: &[Heading]) -> Option<Motion> {
    let (ra, dec) = (
        column(headings, &MOTION_RA)?,
        column(headings, &MOTION_DEC)?,
    );
    // SKY2000's units, which no heading tells.
    let bare_sky2000 = column(headings, &["vder"]).is_some() && headings[ra].unit.is_empty();
    let mas = |cell: usize| {
        let unit = headings[cell].unit.replace(['.', ' '], "/");
        let angle = unit
            .split_once('/')
            .map_or(unit.as_str(), |(angle, _)| angle);
        match angle {
            "" | "mas" => Some((1.0, false)),
            "arcsec" | "as" | "\"" => Some((1000.0, false)),
            "s" => Some((15_000.0, true)),
            // Of another unit nothing is made.
            _ => None,
        }
    };
    let ((ra_mas, ra_at_pole), (dec_mas, _)) = if bare_sky2000 {
        ((15_000.0, true), (1000.0, false))
    } else {
        (mas(ra)?, mas(dec)?)
    };
    Some(Motion {
        ra,
        dec,
        ra_mas,
        ra_at_pole,
        dec_mas,
    })
}

/// The year behind "epoch" or "Ep" in what a file says of a column, as in `at Ep=2016.0` or `Epoch=J1991.25`.
fn epoch_in(note: &str) -> Option<f64> {
    let note = note.to_lowercase();
    let starts = note.match_indices("ep").map(|(at, _)| &note[at + 2..]);
    let mut years = starts.filter_map(|rest| {
        let rest = rest.strip_prefix("och").unwrap_or(rest);
        let rest = rest.trim_start_matches([' ', '=', ':', 'j']);
        let end = rest.find(|c: char| !(c.is_ascii_digit() || c == '.'));
        let year = decimal(rest[..end.unwrap_or(rest.len())].trim_end_matches('.'))?;
        EPOCH_YEARS.contains(&year).then_some(year)
    });
    years.next()
}

/// The cells of one row. What is no star is an error: boxed, since it is rare.
struct Cells<'a> {
    columns: &'a Columns,
    line: u64,
    cells: &'a [&'a str],
}

type Parsed<T> = Result<T, Box<Record>>;

impl Cells<'_> {
    fn star(&self) -> Parsed<(Star, Option<String>)> {
        let columns = self.columns;
        let (id, mut name) = self.id()?;
        let position = self.position()?;
        let magnitude = self.magnitude()?;
        let bv_mag = match (columns.b_less_v, magnitude) {
            (Some(cell), _) => self
                .in_range(cell, MAG_LIMIT, "a colour in magnitudes")?
                .map(mag_on_grid),
            (None, Some((_, bv_mag, _))) => bv_mag,
            (None, None) => None,
        };
        let motion = self.motion(position.map_or(0.0, GridPosition::dec_rad))?;
        let year = self.epoch_year()?;

        let position = position.ok_or_else(|| Box::new(Record::NoPosition))?;
        let (v_mag, _, derived) = magnitude.ok_or_else(|| Box::new(Record::NoMagnitude))?;
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
            star.direction = GridPosition::nearest(&moved).direction();
        }
        if name.is_none() {
            name = columns
                .name
                .and_then(|cell| self.value(cell))
                .map(str::to_owned);
        }
        Ok((star, name.map(shortened)))
    }

    /// The cell's text, or `None` if it says that there is nothing.
    fn value(&self, cell: usize) -> Option<&str> {
        let text = unquoted(self.cells[cell]);
        let nothing = NOTHING.iter().any(|word| text.eq_ignore_ascii_case(word));
        (!nothing).then_some(text)
    }

    /// The identifier, and the name that stands for it where it is no number.
    fn id(&self) -> Parsed<(StarId, Option<String>)> {
        let columns = self.columns;
        let parts: Option<Vec<&str>> = columns.id.iter().map(|&cell| self.value(cell)).collect();
        let first = columns.id[0];
        let text = parts
            .ok_or_else(|| self.fault(first, "an identifier"))?
            .join(" ");
        let number = || whole_number(text.as_bytes());
        let small = || u32::try_from(number()?).ok();
        let known = match columns.id_kind {
            IdKind::Skymap => small().map(StarId::Skymap),
            IdKind::Tycho => TychoId::parse(&text)
                .map(StarId::Tycho)
                .or_else(|| StarId::in_words(&text)),
            IdKind::Hipparcos => HipparcosId::parse(&text)
                .map(StarId::Hipparcos)
                .or_else(|| StarId::in_words(&text)),
            IdKind::Any => StarId::in_words(&text).or_else(|| number().map(StarId::Number)),
            IdKind::In(_) => None,
        };
        match (known, columns.id_kind) {
            (Some(id), _) => Ok((id, None)),
            (None, IdKind::Skymap) => Err(self.fault(first, "a Skymap number")),
            (None, IdKind::Tycho) => Err(self.fault(first, "a TYC number like 1-13-1")),
            (None, IdKind::Hipparcos) => Err(self.fault(first, "a Hipparcos number")),
            (None, kind) => {
                let line =
                    u32::try_from(self.line).map_err(|_| self.fault(first, "fewer lines"))?;
                let name = match kind {
                    IdKind::In(catalog) if number().is_some() => format!("{catalog} {text}"),
                    _ => text,
                };
                Ok((StarId::Named(line), Some(shortened(name))))
            }
        }
    }

    fn position(&self) -> Parsed<Option<GridPosition>> {
        let (ra, dec) = (&self.columns.ra, &self.columns.dec);
        let (ra_deg, dec_deg) = match (
            self.angle(ra, Unit::Hours)?,
            self.angle(dec, Unit::Degrees)?,
        ) {
            (Some(ra_deg), Some(dec_deg)) => (ra_deg, dec_deg),
            (None, None) => return Ok(None),
            (None, _) => {
                return Err(self.fault(ra.cell, "a right ascension, as there is a declination"));
            }
            (_, None) => {
                return Err(self.fault(dec.cell, "a declination, as there is a right ascension"));
            }
        };
        if !RA_RANGE_DEG.contains(&ra_deg) {
            return Err(self.fault(
                ra.cell,
                "a right ascension from 0 to 360 degrees or 0 to 24 hours",
            ));
        }
        let position = GridPosition::from_degrees(ra_deg, dec_deg);
        position
            .map(Some)
            .ok_or_else(|| self.fault(dec.cell, EXPECTED_DEC))
    }

    /// In degrees; sixtieths without a unit are of `sixtieths_of`.
    fn angle(&self, column: &AngleColumn, sixtieths_of: Unit) -> Parsed<Option<f64>> {
        let Some(text) = self.value(column.cell) else {
            return Ok(None);
        };
        let angle = Angle::parse(text);
        if !matches!(angle, Some(Angle::Decimal(_))) {
            let seen = &self.columns.sixtieths_seen;
            seen.fetch_or(angle.is_some(), Ordering::Relaxed);
        }
        let degrees = match angle {
            Some(Angle::Decimal(value)) => column.unit.unwrap_or(Unit::Degrees).to_degrees(value),
            // A heading in degrees does not make `05:34:48` degrees: sixtieths of right ascension are hours.
            Some(Angle::Sexagesimal(value)) => sixtieths_of.to_degrees(value),
            Some(Angle::Hours(value)) if sixtieths_of == Unit::Hours => value * 15.0,
            Some(Angle::Degrees(value)) => value,
            Some(Angle::Hours(_)) | None => {
                let expected = "an angle like 83.7, 05:34:48.0 or -00 24 00";
                return Err(self.fault(column.cell, expected));
            }
        };
        Ok(Some(degrees))
    }

    /// V, the colour where the magnitudes tell it, and whether V is derived.
    fn magnitude(&self) -> Parsed<Option<(f32, Option<f32>, bool)>> {
        let number = |cell: usize| self.in_range(cell, MAG_LIMIT, "a magnitude from -32 to 32");
        let plain = |v_mag: f64, derived: bool| (mag_on_grid(v_mag), None, derived);
        Ok(match self.columns.magnitude {
            Magnitude::Johnson { observed, derived } => {
                let second = derived.map_or(Ok(None), number)?;
                let first = number(observed)?.map(|v_mag| plain(v_mag, false));
                first.or(second.map(|v_mag| plain(v_mag, true)))
            }
            Magnitude::Tycho { bt, vt } => {
                let bt = bt.map_or(Ok(None), number)?;
                johnson(bt, number(vt)?).map(|(v_mag, bv_mag)| (v_mag, bv_mag, true))
            }
            Magnitude::Near { cell, .. } => number(cell)?.map(|v_mag| plain(v_mag, true)),
        })
    }

    /// In mas a year along the circles; `None` unless both are known.
    fn motion(&self, dec_rad: f64) -> Parsed<Option<(f32, f32)>> {
        let Some(motion) = &self.columns.motion else {
            return Ok(None);
        };
        let number = |cell: usize, mas: f64| {
            let limit = PM_LIMIT_MAS_PER_YR / mas as f32;
            self.in_range(cell, limit, "a proper motion within 32.767\" a year")
        };
        let ra_mas = if motion.ra_at_pole {
            motion.ra_mas * dec_rad.cos()
        } else {
            motion.ra_mas
        };
        let (ra, dec) = (
            number(motion.ra, ra_mas)?,
            number(motion.dec, motion.dec_mas)?,
        );
        Ok(ra
            .zip(dec)
            .map(|(ra, dec)| ((ra * ra_mas) as f32, (dec * motion.dec_mas) as f32)))
    }

    fn epoch_year(&self) -> Parsed<f64> {
        match self.columns.epoch {
            Epoch::Year(year) => Ok(year),
            Epoch::Column(cell) => match self.value(cell) {
                None => Ok(J2000_YEAR),
                Some(text) => decimal(text.trim_start_matches(['J', 'j']))
                    .filter(|year| EPOCH_YEARS.contains(year))
                    .ok_or_else(|| self.fault(cell, "a year from 1850 to 2100")),
            },
        }
    }

    /// The number in a cell, `None` if there is none.
    fn in_range(&self, cell: usize, limit: f32, expected: &'static str) -> Parsed<Option<f64>> {
        let Some(text) = self.value(cell) else {
            return Ok(None);
        };
        let number = decimal(text).filter(|number| number.abs() <= f64::from(limit));
        number.map(Some).ok_or_else(|| self.fault(cell, expected))
    }

    fn fault(&self, cell: usize, expected: &'static str) -> Box<Record> {
        Box::new(Record::Unreadable(RecordFault {
            line: self.line,
            place: FaultPlace::Cell(cell + 1),
            label: self.columns.texts[cell].clone(),
            found: quoted(self.cells[cell].as_bytes()),
            expected,
        }))
    }
}

/// What a declination must be; from faults that expect it swapped columns can be told.
pub(super) const EXPECTED_DEC: &str = "a declination from -90 to +90 degrees";

/// A name no longer than the compact form can hold.
fn shortened(mut name: String) -> String {
    while name.len() > super::NAME_BYTES_MAX {
        name.pop();
    }
    name
}
