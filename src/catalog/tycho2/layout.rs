//! The files of Tycho-2, and the fields of their records.

use crate::catalog::TychoId;

/// A file of Tycho-2.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::catalog) enum Tycho2 {
    Main,
    Supplement1,
    /// Entries of Tycho-1 that are probably not stars, or heavily disturbed.
    Supplement2,
}

/// A field of a record.
#[derive(Clone, Copy)]
pub(super) struct Tycho2Field {
    /// From 0.
    pub(super) index: usize,
    pub(super) label: &'static str,
}

const fn field(index: usize, label: &'static str) -> Tycho2Field {
    Tycho2Field { index, label }
}

/// The fields that differ between the files.
pub(super) struct Tycho2Layout {
    pub(super) field_count: usize,
    pub(super) expected_fields: &'static str,
    pub(super) ra: Tycho2Field,
    pub(super) dec: Tycho2Field,
    pub(super) bt: Tycho2Field,
    pub(super) vt: Tycho2Field,
}

pub(super) const ID: Tycho2Field = field(0, "TYC");
pub(super) const FLAG: Tycho2Field = field(1, "flag");
pub(super) const PM_RA: Tycho2Field = field(4, "pmRA");
pub(super) const PM_DEC: Tycho2Field = field(5, "pmDE");
pub(super) const OBSERVED_RA: Tycho2Field = field(24, "RAdeg");
pub(super) const OBSERVED_DEC: Tycho2Field = field(25, "DEdeg");
pub(super) const OBSERVED_RA_EPOCH: Tycho2Field = field(26, "EpRA-1990");
pub(super) const OBSERVED_DEC_EPOCH: Tycho2Field = field(27, "EpDE-1990");
pub(super) const SUPPLEMENT_HIP: Tycho2Field = field(17, "HIP");

const MAIN: Tycho2Layout = Tycho2Layout {
    field_count: 32,
    expected_fields: "32 fields separated by |",
    ra: field(2, "RAmdeg"),
    dec: field(3, "DEmdeg"),
    bt: field(17, "BTmag"),
    vt: field(19, "VTmag"),
};
const SUPPLEMENT: Tycho2Layout = Tycho2Layout {
    field_count: 18,
    expected_fields: "18 fields separated by |",
    ra: field(2, "RAdeg"),
    dec: field(3, "DEdeg"),
    bt: field(11, "BTmag"),
    vt: field(13, "VTmag"),
};

impl Tycho2 {
    /// The file that begins with `head`, a few hundred bytes; `None` if it is not of Tycho-2.
    pub(in crate::catalog) fn detect(head: &[u8]) -> Option<Self> {
        /// The length of the records of each file, in bytes without the line end.
        const MAIN_BYTES: usize = 206;
        const SUPPLEMENT_1_BYTES: usize = 122;
        const SUPPLEMENT_2_BYTES: usize = 115;
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

    pub(super) fn layout(self) -> &'static Tycho2Layout {
        match self {
            Self::Main => &MAIN,
            Self::Supplement1 | Self::Supplement2 => &SUPPLEMENT,
        }
    }
}
