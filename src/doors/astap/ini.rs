//! The text of `.ini`, and why there may be no solution.

use super::plate::Plate;
use crate::base::format::printable;
use crate::identify::SearchFailure;
use crate::identify::diagnosis::Diagnosis;
use crate::solve::Reason;

/// What went wrong. Its number is ASTAP's exit status.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Failure {
    /// The frame is not identified.
    NoSolution = 1,
    /// Nor has it the stars.
    TooFewStars = 2,
    /// There is no frame in the file.
    UnreadableImage = 16,
    /// The header of the frame's file cannot be updated.
    NotUpdated = 34,
}

impl Failure {
    /// That of a frame which is not identified for this reason.
    pub fn of(reason: &Reason) -> Self {
        match reason {
            Reason::Search(SearchFailure::TooFewStars { .. })
            | Reason::Diagnosis(Diagnosis::FewStars { .. }) => Self::TooFewStars,
            _ => Self::NoSolution,
        }
    }

    /// ASTAP's exit status.
    pub const fn status(self) -> u8 {
        self as u8
    }

    /// Its words in the file.
    const fn words(self) -> Option<&'static str> {
        match self {
            Self::TooFewStars => Some("Not enough stars."),
            Self::UnreadableImage => Some("Error reading image file."),
            Self::NoSolution | Self::NotUpdated => None,
        }
    }
}

/// What `.ini` tells.
#[derive(Debug, Clone)]
pub struct Ini<'a> {
    /// The solution, or why there is none.
    pub plate: Result<&'a Plate, Failure>,
    /// The words of the command line.
    pub command_line: &'a str,
    /// Columns and rows, where there is a frame.
    pub size_px: Option<[usize; 2]>,
    /// For people.
    pub warning: Option<&'a str>,
}

impl Ini<'_> {
    /// The file: a key and its value in each line, no key twice.
    pub fn text(&self) -> String {
        let mut lines = match self.plate {
            Ok(plate) => values(plate),
            Err(_) => vec!["PLTSOLVD=F".to_owned()],
        };
        lines.push(format!("CMDLINE={}", printable(self.command_line)));
        let size = self
            .size_px
            .map(|[width, height]| format!("DIMENSIONS={width} x {height}"));
        let error = self.plate.err().and_then(Failure::words);
        lines.extend(size);
        lines.extend(error.map(|words| format!("ERROR={words}")));
        lines.extend(
            self.warning
                .map(|text| format!("WARNING={}", printable(text))),
        );
        lines.join("\n") + "\n"
    }
}

fn values(plate: &Plate) -> Vec<String> {
    let pairs = [
        ("CRPIX", plate.crpix),
        ("CRVAL", plate.crval_deg),
        ("CDELT", plate.cdelt_deg()),
        ("CROTA", plate.crota_deg()),
        ("CD1_", plate.cd_deg[0]),
        ("CD2_", plate.cd_deg[1]),
    ];
    let mut lines = vec!["PLTSOLVD=T".to_owned()];
    for (key, pair) in pairs {
        for (number, value) in pair.into_iter().enumerate() {
            lines.push(format!("{key}{}={}", number + 1, scientific(value)));
        }
    }
    lines
}

/// A number as Pascal writes it: a sign or a blank, 17 digits, and three of the exponent.
fn scientific(value: f64) -> String {
    let text = format!("{value:.16E}");
    let (digits, exponent) = text.split_once('E').unwrap_or((&text, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    format!("{digits:>19}E{exponent:+04}")
}

#[cfg(test)]
mod tests {
    use super::super::plate::tests::turned;
    use super::*;

    #[test]
    fn numbers_are_those_of_pascal() {
        for (value, text) in [
            (-58.859_778_367_665_45, "-5.8859778367665449E+001"),
            (534.0, " 5.3400000000000000E+002"),
            (-0.000_144, "-1.4400000000000000E-004"),
            (0.0, " 0.0000000000000000E+000"),
        ] {
            assert_eq!(scientific(value), text);
        }
    }

    #[test]
    fn a_solution_has_the_keys_of_astap_in_its_order() {
        let plate = turned(false);
        let ini = Ini {
            plate: Ok(&plate),
            command_line: "astap -f a\nb.fits",
            size_px: Some([640, 480]),
            warning: Some("too good"),
        };
        let text = ini.text();
        let keys: Vec<_> = text
            .lines()
            .filter_map(|line| line.split_once('='))
            .collect();
        let names: Vec<_> = keys.iter().map(|(key, _)| *key).collect();
        let expected = "PLTSOLVD CRPIX1 CRPIX2 CRVAL1 CRVAL2 CDELT1 CDELT2 CROTA1 CROTA2 CD1_1 CD1_2 CD2_1 \
                        CD2_2 CMDLINE DIMENSIONS WARNING";
        assert_eq!(names.join(" "), expected);
        assert_eq!(text.lines().count(), names.len());
        assert!(text.contains("\nCRPIX1= 3.2050000000000000E+002\n"));
        assert!(text.contains("\nDIMENSIONS=640 x 480\n"));
    }

    #[test]
    fn without_a_solution_it_says_why() {
        let text = |failure| {
            let ini = Ini {
                plate: Err(failure),
                command_line: "astap -f a.fits",
                size_px: None,
                warning: None,
            };
            ini.text()
        };
        let start = "PLTSOLVD=F\nCMDLINE=astap -f a.fits\n";
        assert_eq!(text(Failure::NoSolution), start);
        let unreadable = format!("{start}ERROR=Error reading image file.\n");
        assert_eq!(text(Failure::UnreadableImage), unreadable);
        assert_eq!(
            text(Failure::TooFewStars),
            format!("{start}ERROR=Not enough stars.\n")
        );
    }
}
