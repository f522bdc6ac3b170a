//! The lines that callers of `solve-field` read.

use super::c_format::{general, sexagesimal};
use crate::doors::Field;
use crate::solve::Solution;
use std::f64::consts::LN_10;
use std::fmt::{self, Write};

/// Names of files in the lines.
#[derive(Debug, Clone, Copy)]
pub struct Names<'a> {
    /// The image or the list.
    pub input: &'a str,
    /// The file that tells that it is solved, if it is wanted.
    pub solved: Option<&'a str>,
    /// The copy with coordinates, if it is written.
    pub new_fits: Option<&'a str>,
}

/// What is printed of an input after its name.
pub fn lines(solution: &Solution, names: &Names) -> String {
    let mut text = String::new();
    // Writing to a string does not fail.
    let _ = write_lines(&mut text, solution, names);
    text
}

fn write_lines(text: &mut String, solution: &Solution, names: &Names) -> fmt::Result {
    let sources = solution.sources.len();
    if solution.row_order.is_some() {
        writeln!(text, "Extracting sources...")?;
        writeln!(text, "simplexy: found {sources} sources.")?;
    }
    writeln!(text, "Solving...")?;
    let found = solution.outcome.identification();
    let Some((found, field)) = found.zip(Field::new(solution)) else {
        writeln!(text, "Field: {}", names.input)?;
        return writeln!(text, "Did not solve (or no WCS file was written).");
    };
    let [ra, dec] = field.centre_deg;
    let log_odds = -LN_10 * found.log10_false_alarm;
    let stars = found.matches.len();
    writeln!(
        text,
        "  log-odds ratio {} ({}), {stars} match, 0 conflict, {} distractors, {stars} index.",
        general(log_odds),
        general(libm::exp(log_odds)),
        sources.saturating_sub(stars),
    )?;
    writeln!(
        text,
        "  RA,Dec = ({},{}), pixel scale {} arcsec/pix.",
        general(ra),
        general(dec),
        general(field.pixel_scale_arcsec),
    )?;
    writeln!(text, "Field 1: solved with index starpipe.")?;
    if let Some(solved) = names.solved {
        writeln!(
            text,
            "Field 1 solved: writing to file {solved} to indicate this."
        )?;
    }
    writeln!(text, "Field: {}", names.input)?;
    write_field(text, &field)?;
    if let Some(new_fits) = names.new_fits {
        writeln!(text, "Creating new FITS file \"{new_fits}\"...")?;
    }
    Ok(())
}

fn write_field(text: &mut String, field: &Field) -> fmt::Result {
    let [ra, dec] = field.centre_deg;
    writeln!(text, "Field center: (RA,Dec) = ({ra:.6}, {dec:.6}) deg.")?;
    let sign = if dec < 0.0 { '-' } else { '+' };
    writeln!(
        text,
        "Field center: (RA H:M:S, Dec D:M:S) = ({}, {sign}{}).",
        sexagesimal(ra / 15.0),
        sexagesimal(dec.abs()),
    )?;
    let least_deg = field.extent_deg[0].min(field.extent_deg[1]);
    let (per_deg, unit) = match least_deg {
        least if least < 1.0 / 60.0 => (3600.0, "arcseconds"),
        least if least < 1.0 => (60.0, "arcminutes"),
        _ => (1.0, "degrees"),
    };
    let [width, height] = field.extent_deg.map(|deg| general(deg * per_deg));
    writeln!(text, "Field size: {width} x {height} {unit}")?;
    let angle = general(field.orientation_deg);
    writeln!(text, "Field rotation angle: up is {angle} degrees E of N")?;
    let parity = if field.is_mirrored { "neg" } else { "pos" };
    writeln!(text, "Field parity: {parity}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_field_is_described_as_callers_read_it() {
        let field = Field {
            centre_deg: [114.133_515, -0.5],
            size_deg: [0.5, 0.25],
            extent_deg: [0.482_748_3, 0.271_82],
            pixel_scale_arcsec: 0.907_073,
            orientation_deg: 1.760_56,
            is_mirrored: false,
        };
        let mut text = String::new();
        write_field(&mut text, &field).unwrap();
        let expected = "Field center: (RA,Dec) = (114.133515, -0.500000) deg.\n\
                        Field center: (RA H:M:S, Dec D:M:S) = (07:36:32.044, -00:30:00.000).\n\
                        Field size: 28.9649 x 16.3092 arcminutes\n\
                        Field rotation angle: up is 1.76056 degrees E of N\n\
                        Field parity: pos\n";
        assert_eq!(text, expected);
    }
}
