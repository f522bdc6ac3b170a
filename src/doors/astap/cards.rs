//! The cards of a solution, as ASTAP has them.

use super::plate::Plate;
use crate::frame::{FitsHeader, RowOrder};
use crate::report::wcs;
use crate::solve::Solution;

/// The cards of a solution: linear, or with the distortion of the lens as `SIP` has it.
pub fn solved_cards(
    plate: &Plate,
    solution: &Solution,
    rows: RowOrder,
    with_distortion: bool,
    warning: Option<&str>,
) -> FitsHeader {
    let mut header = FitsHeader::default();
    let found = solution.outcome.identification();
    match found.filter(|_| with_distortion) {
        Some(found) => {
            wcs::add_projection(&mut header, &found.view(), rows);
        }
        None => add_plane(&mut header, plate),
    }
    let [[x, y], [turn_x, turn_y]] = [plate.cdelt_deg(), plate.crota_deg()];
    header.real("CDELT1", x, "X pixel size (deg)");
    header.real("CDELT2", y, "Y pixel size (deg)");
    header.real("CROTA1", turn_x, "Image twist of X axis (deg)");
    header.real("CROTA2", turn_y, "Image twist of Y axis (deg)");
    let program = concat!("solved by starpipe ", env!("CARGO_PKG_VERSION"));
    header.logical("PLTSOLVD", true, program);
    if let Some(warning) = warning {
        header.text("WARNING", warning, "");
    }
    header
}

fn add_plane(header: &mut FitsHeader, plate: &Plate) {
    header.text("CTYPE1", "RA---TAN", "");
    header.text("CTYPE2", "DEC--TAN", "");
    header.text("CUNIT1", "deg", "");
    header.text("CUNIT2", "deg", "");
    header.real("EQUINOX", 2000.0, "");
    for (axis, name) in [(0, "X"), (1, "Y")] {
        let (number, pixel) = (axis + 1, plate.crpix[axis]);
        header.real(
            &format!("CRPIX{number}"),
            pixel,
            &format!("{name} of reference pixel"),
        );
    }
    header.real("CRVAL1", plate.crval_deg[0], "RA of reference pixel (deg)");
    header.real("CRVAL2", plate.crval_deg[1], "DEC of reference pixel (deg)");
    for (row, column) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        let keyword = format!("CD{}_{}", row + 1, column + 1);
        header.real(&keyword, plate.cd_deg[row][column], "degrees a pixel");
    }
}
