//! The V magnitude of a star by the table beside the tree.

use crate::base::fits_tables::{Column, FitsTable};
use crate::catalog::Band;
use crate::catalog::gaia;
use crate::catalog::star::rounded_mag;
use crate::catalog::tycho2::johnson;

/// The columns that tell the brightness of a star.
#[derive(Debug)]
pub enum MagnitudeColumns<'a> {
    /// Of Tycho: BT, and VT.
    Tycho(Option<&'a Column>, Option<&'a Column>),
    /// Of Gaia: G, BP and RP.
    Gaia(&'a Column, Option<[&'a Column; 2]>),
    /// Of 2MASS: J.
    TwoMass(&'a Column),
    /// Of an unknown band.
    Other(&'a Column),
}

impl<'a> MagnitudeColumns<'a> {
    /// The columns of a table beside the tree; `None` where it has no magnitude.
    pub fn find(table: &'a FitsTable) -> Option<Self> {
        let column = |names: &[&str]| names.iter().find_map(|name| table.column(name));
        let (bt, vt) = (column(&["MAG_BT", "BTMAG"]), column(&["MAG_VT", "VTMAG"]));
        if bt.is_some() || vt.is_some() {
            return Some(Self::Tycho(bt, vt));
        }
        let (bp, rp) = (column(&["PHOT_BP_MEAN_MAG"]), column(&["PHOT_RP_MEAN_MAG"]));
        let colors = bp.zip(rp).map(<[_; 2]>::from);
        // Beside the others of Gaia, `mag` is G.
        let mag = || column(&["MAG"]).filter(|_| colors.is_some());
        if let Some(g) = column(&["PHOT_G_MEAN_MAG", "G_MAG"]).or_else(mag) {
            return Some(Self::Gaia(g, colors));
        }
        let j = column(&["J_MAG", "MAG_J", "J"]);
        let other = || column(&["V_MAG", "MAG_V", "VMAG", "R_MAG", "MAG_R", "R", "MAG"]);
        j.map(Self::TwoMass).or_else(|| other().map(Self::Other))
    }

    /// V and B−V of the star in a row; `None` where it has no magnitude.
    pub fn johnson(&self, row: &[u8]) -> Option<(f32, Option<f32>)> {
        /// Median V − J of field stars, most of which are of the spectral types F to K.
        const V_MINUS_J_MAG: f64 = 1.5;
        // Zero and large numbers stand for unknown values.
        let mag = |column: &Column| {
            let mag = column.number(row)?;
            (mag != 0.0 && (-5.0..30.0).contains(&mag)).then_some(mag)
        };
        match self {
            Self::Tycho(bt, vt) => johnson(bt.and_then(mag), vt.and_then(mag)),
            Self::Gaia(g, colors) => {
                let color = colors.and_then(|[bp, rp]| Some(mag(bp)? - mag(rp)?));
                Some(gaia::johnson(mag(g)?, color))
            }
            Self::TwoMass(j) => Some((rounded_mag(mag(j)? + V_MINUS_J_MAG), None)),
            Self::Other(other) => Some((rounded_mag(mag(other)?), None)),
        }
    }

    /// The magnitudes that they hold.
    pub const fn band(&self) -> Band {
        match self {
            Self::Tycho(..) => Band::Tycho,
            Self::Gaia(_, Some(_)) => Band::GaiaColors,
            Self::Gaia(_, None) => Band::GaiaG,
            Self::TwoMass(_) => Band::TwoMassJ,
            Self::Other(_) => Band::Unknown,
        }
    }
}
