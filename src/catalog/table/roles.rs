//! The columns of a general table by what they hold, found from the headings.

use super::headings::{Heading, HeadingUnit, find_column};
use crate::base::angle::decimal;
use crate::catalog::star::J2000_YEAR;
use crate::catalog::{Band, gaia};
use std::ops::RangeInclusive;

/// The heading of the right ascension that VizieR computes for J2000, at any epoch of the
/// catalogue.
const VIZIER_RA_J2000: &str = "_raj2000";

/// The columns of the identifier.
pub(super) struct IdColumns {
    pub(super) kind: IdKind,
    /// Three for the parts of a TYC number, none where there are none, else one.
    pub(super) cells: Vec<usize>,
}

/// What a column of identifiers holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum IdKind {
    Skymap,
    Tycho,
    Hipparcos,
    /// Gaia's, or text.
    Gaia,
    /// There is none: a star is called by its place.
    Place,
    /// Numbers of this catalogue.
    NumberOf(&'static str),
    /// Numbers or text.
    Any,
}

impl IdColumns {
    /// Where there are none, and there may be none, the place stands for them.
    pub(super) fn find(headings: &[Heading], is_of_gaia: bool, may_lack: bool) -> Option<Self> {
        /// Headings of identifiers, in order of preference.
        const IDENTIFIERS: [(&str, IdKind); 11] = [
            ("skymap skymap_number", IdKind::Skymap),
            ("id star_id starid", IdKind::Any),
            ("source_id", IdKind::Gaia),
            ("source objid", IdKind::Any),
            ("tyc tyc_id tycho tyc2", IdKind::Tycho),
            ("hip", IdKind::Hipparcos),
            ("identifier designation main_id star name", IdKind::Any),
            ("hd", IdKind::NumberOf("HD")),
            ("hr", IdKind::NumberOf("HR")),
            ("sao", IdKind::NumberOf("SAO")),
            ("recno", IdKind::Any),
        ];
        let column = |labels: &str| find_column(headings, labels);
        if let (Some(region), Some(star), Some(component)) =
            (column("tyc1"), column("tyc2"), column("tyc3"))
        {
            return Some(Self {
                kind: IdKind::Tycho,
                cells: vec![region, star, component],
            });
        }
        let places = || Self {
            kind: IdKind::Place,
            cells: Vec::new(),
        };
        if is_of_gaia {
            let source = column("source_id source designation");
            return Some(source.map_or_else(places, |source| Self {
                kind: IdKind::Gaia,
                cells: vec![source],
            }));
        }
        let known = IDENTIFIERS
            .iter()
            .find_map(|(labels, kind)| Some((*kind, column(labels)?)));
        let Some((kind, cell)) = known else {
            return may_lack.then(places);
        };
        // In a table with SKY2000's own columns, `ID` is the Skymap number.
        let is_sky2000 = column("vder id_merg sky2000").is_some();
        let is_skymap = is_sky2000 && headings[cell].label == "id";
        Some(Self {
            kind: if is_skymap { IdKind::Skymap } else { kind },
            cells: vec![cell],
        })
    }
}

/// A column of angles.
pub(super) struct AngleColumn {
    pub(super) cell: usize,
    /// `None` if not given.
    pub(super) unit: Option<HeadingUnit>,
}

/// The columns of right ascension and declination.
pub(super) struct PositionColumns {
    pub(super) ra: AngleColumn,
    pub(super) dec: AngleColumn,
}

impl PositionColumns {
    pub(super) fn find(headings: &[Heading]) -> Option<Self> {
        /// Headings of right ascension and declination, without a unit at their end, in order of
        /// preference.
        const POSITIONS: [(&str, &[&str]); 13] = [
            (VIZIER_RA_J2000, &["_dej2000"]),
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
        let coordinate = |wanted: &str| {
            headings.iter().enumerate().find_map(|(cell, heading)| {
                let unit = heading_unit(&heading.label, wanted)?;
                let unit = HeadingUnit::parse(&heading.unit).or(unit);
                Some(AngleColumn { cell, unit })
            })
        };
        POSITIONS.iter().find_map(|(ra, decs)| {
            let dec = decs.iter().find_map(|dec| coordinate(dec))?;
            let ra = coordinate(ra)?;
            Some(Self { ra, dec })
        })
    }
}

/// The unit that the ending of `label` gives, if any; `None` if it is not a label of the coordinate
/// `wanted`.
fn heading_unit(label: &str, wanted: &str) -> Option<Option<HeadingUnit>> {
    /// Endings of the headings of coordinates that give a unit.
    const UNIT_ENDINGS: [(&str, HeadingUnit); 9] = [
        ("degrees", HeadingUnit::Degrees),
        ("degree", HeadingUnit::Degrees),
        ("deg", HeadingUnit::Degrees),
        ("hours", HeadingUnit::Hours),
        ("hour", HeadingUnit::Hours),
        ("_hr", HeadingUnit::Hours),
        ("_h", HeadingUnit::Hours),
        ("_rad", HeadingUnit::Radians),
        ("rad", HeadingUnit::Radians),
    ];
    /// Endings of the headings of coordinates whose cells are sexagesimal.
    const FORM_ENDINGS: [&str; 4] = ["hms", "dms", "sexagesimal", "sex"];
    let ending = label.strip_prefix(wanted)?;
    if ending.is_empty() || FORM_ENDINGS.contains(&ending.trim_start_matches('_')) {
        return Some(None);
    }
    let units = UNIT_ENDINGS.iter();
    let mut units =
        units.filter(|(name, _)| ending == *name || ending.strip_prefix('_') == Some(name));
    units.next().map(|(_, unit)| Some(*unit))
}

/// The columns of magnitudes.
pub(super) enum MagnitudeColumns {
    /// Johnson V, and a derived V that replaces it where missing.
    Johnson {
        observed: usize,
        derived: Option<usize>,
    },
    /// Tycho VT, and BT for the color.
    Tycho { bt: Option<usize>, vt: usize },
    /// Gaia's G, and BP−RP for the color.
    Gaia { g: usize, color: ColorColumns },
    /// A magnitude that approximates V.
    Approximate { cell: usize, band: &'static str },
}

/// The columns of Gaia's color BP−RP.
#[derive(Debug, Clone, Copy)]
pub(super) enum ColorColumns {
    /// None.
    Unknown,
    /// The color.
    Color(usize),
    /// BP and RP.
    Magnitudes { bp: usize, rp: usize },
}

impl ColorColumns {
    fn find(headings: &[Heading]) -> Self {
        let column = |labels: &str| find_column(headings, labels);
        if let Some(color) = column("bp_rp bp-rp") {
            return Self::Color(color);
        }
        match (
            column("phot_bp_mean_mag bpmag bp_mag"),
            column("phot_rp_mean_mag rpmag rp_mag"),
        ) {
            (Some(bp), Some(rp)) => Self::Magnitudes { bp, rp },
            _ => Self::Unknown,
        }
    }

    /// The columns used.
    pub(super) fn cells(self) -> Vec<usize> {
        match self {
            Self::Unknown => Vec::new(),
            Self::Color(color) => vec![color],
            Self::Magnitudes { bp, rp } => vec![bp, rp],
        }
    }
}

impl MagnitudeColumns {
    pub(super) fn find(headings: &[Heading]) -> Option<Self> {
        const JOHNSON_V: &str =
            "vmag v v_mag mag_v vjmag v_johnson johnson_v vmag_johnson mag_johnson_v";
        /// Headings of approximate V magnitudes, with the band, in order of preference.
        const APPROXIMATE_V: [(&str, &str); 5] = [
            ("mag magnitude", "magnitude"),
            ("hpmag hp", "Hipparcos Hp"),
            ("gmag g_mag g", "magnitude g"),
            ("vder", "derived V"),
            ("phot_visual_mag", "visual magnitude"),
        ];
        let column = |labels: &str| find_column(headings, labels);
        if let Some(observed) = column(JOHNSON_V) {
            let derived = column("vder");
            return Some(Self::Johnson { observed, derived });
        }
        if let Some(vt) = column("vtmag vt vt_mag") {
            let bt = column("btmag bt bt_mag");
            return Some(Self::Tycho { bt, vt });
        }
        let g = column("phot_g_mean_mag").or_else(|| column("gmag g_mag"));
        let color = ColorColumns::find(headings);
        let is_of_vizier = column("source").is_some() && column("ra_icrs").is_some();
        let has_color = !matches!(color, ColorColumns::Unknown);
        let is_gaia = column("phot_g_mean_mag").is_some() || has_color || is_of_vizier;
        if let Some(g) = g.filter(|_| is_gaia) {
            return Some(Self::Gaia { g, color });
        }
        APPROXIMATE_V.iter().find_map(|&(labels, band)| {
            let cell = column(labels)?;
            Some(Self::Approximate { cell, band })
        })
    }

    /// The bands that they hold.
    pub(super) const fn band(&self) -> Band {
        match self {
            Self::Johnson { .. } => Band::JohnsonV,
            Self::Tycho { .. } => Band::Tycho,
            Self::Gaia {
                color: ColorColumns::Unknown,
                ..
            } => Band::GaiaG,
            Self::Gaia { .. } => Band::GaiaColors,
            Self::Approximate { .. } => Band::Unknown,
        }
    }

    /// Whether they are Gaia's.
    pub(super) const fn are_of_gaia(&self) -> bool {
        matches!(self, Self::Gaia { .. })
    }

    /// The columns used, for people; `text` gives their headings.
    pub(super) fn description<'a>(&self, text: impl Fn(usize) -> &'a str) -> String {
        match *self {
            Self::Johnson {
                observed,
                derived: None,
            } => format!("V {}", text(observed)),
            Self::Johnson {
                observed,
                derived: Some(derived),
            } => format!("V {}, else {}", text(observed), text(derived)),
            Self::Tycho { bt: Some(bt), vt } => format!("V from {} and {}", text(vt), text(bt)),
            Self::Tycho { bt: None, vt } => format!("V from {}", text(vt)),
            Self::Gaia { g, color } => {
                let used = [vec![g], color.cells()].concat();
                let used: Vec<&str> = used.into_iter().map(text).collect();
                format!("V from {}", used.join(", "))
            }
            Self::Approximate { cell, band } => format!("{band} {} for V", text(cell)),
        }
    }
}

/// The columns of proper motions, and their units in mas a year.
pub(super) struct MotionColumns {
    pub(super) ra: usize,
    pub(super) dec: usize,
    pub(super) ra_unit_mas: f64,
    /// The motion in right ascension is still to be multiplied by cos(declination).
    pub(super) ra_needs_cos_dec: bool,
    pub(super) dec_unit_mas: f64,
}

impl MotionColumns {
    /// `None` also for unknown units.
    pub(super) fn find(headings: &[Heading]) -> Option<Self> {
        const MOTION_RA: &str = "pmra pm_ra pmra* pm_ra_cosdec pmra_cosdec mu_alpha_star mu_alpha";
        let column = |labels: &str| find_column(headings, labels);
        let ra = column(MOTION_RA)?;
        let dec = column("pmde pmdec pm_de pm_dec mu_delta")?;
        // SKY2000's units are not in its headings.
        let bare_sky2000 = column("vder").is_some() && headings[ra].unit.is_empty();
        let mas = |cell: usize| match headings[cell].unit.split(['/', '.', ' ']).next() {
            Some("" | "mas") => Some((1.0, false)),
            Some("arcsec" | "as" | "\"") => Some((1000.0, false)),
            Some("s") => Some((15_000.0, true)),
            _ => None,
        };
        let ((ra_unit_mas, ra_needs_cos_dec), (dec_unit_mas, _)) = if bare_sky2000 {
            ((15_000.0, true), (1000.0, false))
        } else {
            (mas(ra)?, mas(dec)?)
        };
        Some(Self {
            ra,
            dec,
            ra_unit_mas,
            ra_needs_cos_dec,
            dec_unit_mas,
        })
    }
}

/// The epoch of the positions.
pub(super) enum Epoch {
    Column(usize),
    Year(f64),
}

/// The accepted epochs of positions, as Julian years.
pub(super) const EPOCH_YEARS: RangeInclusive<f64> = 1850.0..=2100.0;

impl Epoch {
    /// The epoch of the right ascensions under `ra`; `note` is what the file says about that
    /// column.
    pub(super) fn find(headings: &[Heading], ra: &Heading, note: &str, is_of_gaia: bool) -> Self {
        // A table of Gaia at VizieR has its stars at two epochs.
        let is_at_j2000 = ra.label == VIZIER_RA_J2000 || (is_of_gaia && ra.label == "raj2000");
        let column = find_column(headings, "ref_epoch epoch ep").filter(|_| !is_at_j2000);
        match (column, epoch_in(note)) {
            (Some(cell), _) => Self::Column(cell),
            (None, Some(year)) => Self::Year(year),
            (None, None) if is_of_gaia && !is_at_j2000 => Self::Year(gaia::EPOCH_YEAR),
            (None, None) => Self::Year(J2000_YEAR),
        }
    }
}

/// The year after "epoch" or "Ep" in a note, as in `at Ep=2016.0` or `Epoch=J1991.25`.
pub(super) fn epoch_in(note: &str) -> Option<f64> {
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
