//! Which row of a picture comes first in its file?

use serde::Serialize;

/// The order of a file's rows. Frames in memory always begin with the top row of the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum RowOrder {
    /// The first row is the top of the picture, as in all formats but FITS.
    #[default]
    TopDown,
    /// The first row is the bottom of the picture, as in FITS unless the file says otherwise.
    BottomUp,
}

impl RowOrder {
    /// The word for it in the JSON and in tables.
    pub const fn word(self) -> &'static str {
        match self {
            Self::TopDown => "top-down",
            Self::BottomUp => "bottom-up",
        }
    }

    /// The value of the FITS keyword ROWORDER.
    pub const fn keyword_value(self) -> &'static str {
        match self {
            Self::TopDown => "TOP-DOWN",
            Self::BottomUp => "BOTTOM-UP",
        }
    }

    /// The order with this value of ROWORDER, in any case.
    pub(super) fn of_keyword(value: &str) -> Option<Self> {
        let is_it = |order: &Self| value.eq_ignore_ascii_case(order.keyword_value());
        [Self::TopDown, Self::BottomUp].into_iter().find(is_it)
    }
}
