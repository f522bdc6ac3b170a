//! The label of a star: its name and magnitude.

use crate::sky::catalog::{Catalog, StarIndex};

/// SKY2000's abbreviations of the Greek letters.
const GREEK: [(&str, char); 24] = [
    ("alp", 'α'),
    ("bet", 'β'),
    ("gam", 'γ'),
    ("del", 'δ'),
    ("eps", 'ε'),
    ("zet", 'ζ'),
    ("eta", 'η'),
    ("the", 'θ'),
    ("iot", 'ι'),
    ("kap", 'κ'),
    ("lam", 'λ'),
    ("mu", 'μ'),
    ("nu", 'ν'),
    ("xi", 'ξ'),
    ("omi", 'ο'),
    ("pi", 'π'),
    ("rho", 'ρ'),
    ("sig", 'σ'),
    ("tau", 'τ'),
    ("ups", 'υ'),
    ("phi", 'φ'),
    ("chi", 'χ'),
    ("psi", 'ψ'),
    ("ome", 'ω'),
];

const SUPERSCRIPTS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];

/// What is written beside a star.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct StarLabel {
    /// The star's proper name, else its letter, else its number, and its V magnitude: `Sirius −1.4`, `α CMi
    /// 0.4`.
    pub(super) text: String,
    /// Its V magnitude.
    pub(super) v_mag: f32,
    /// Whether it has more than a number.
    pub(super) has_name: bool,
}

impl StarLabel {
    /// The label of a star.
    pub(super) fn of(catalog: &Catalog, star: StarIndex) -> Self {
        let name = match (catalog.proper_name(star), catalog.name_of(star)) {
            (Some(name), _) => Some(name.to_owned()),
            (None, Some(name)) => Some(short(name)),
            (None, None) => None,
        };
        let has_name = name.is_some();
        let name = name.unwrap_or_else(|| number(&catalog.designation(star)).to_owned());
        let v_mag = catalog.star(star).v_mag;
        let rounded = format!("{v_mag:.1}");
        let rounded = if rounded == "-0.0" { "0.0" } else { &rounded };
        Self {
            text: format!("{name} {}", rounded.replace('-', "−")),
            v_mag,
            has_name,
        }
    }
}

/// A designation without its catalogue, which would be the same for all stars of the picture.
fn number(designation: &str) -> &str {
    designation
        .split_once(' ')
        .map_or(designation, |(_, number)| number)
}

/// The Bayer letter in Greek, or the Flamsteed number, with the constellation: `9 alp CMa` is `α
/// CMa`.
fn short(name: &str) -> String {
    let words: Vec<&str> = name.split_whitespace().collect();
    let greek = |word: &str| {
        let letters = word.trim_end_matches(|c: char| c.is_ascii_digit());
        let (_, letter) = GREEK.iter().find(|(latin, _)| *latin == letters)?;
        let raised = word[letters.len()..].chars().filter_map(|c| c.to_digit(10));
        let mut text = letter.to_string();
        text.extend(raised.map(|digit| SUPERSCRIPTS[digit as usize]));
        Some(text)
    };
    let bayer = words.iter().rev().skip(1).find_map(|word| greek(word));
    match (bayer, words.last()) {
        (Some(letter), Some(constellation)) => format!("{letter} {constellation}"),
        _ => name.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bayer_letters_are_greek_and_go_before_flamsteed_numbers() {
        for (name, expected) in [
            ("9 alp CMa", "α CMa"),
            ("40 phi2 Ori", "φ² Ori"),
            ("tau5 Ser", "τ⁵ Ser"),
            ("the Oct", "θ Oct"),
            ("24 Tau", "24 Tau"),
            ("50 mu Cet", "μ Cet"),
            ("strange", "strange"),
        ] {
            assert_eq!(short(name), expected);
        }
    }

    #[test]
    fn the_brightest_star_is_called_by_its_name_and_the_faintest_by_its_number() {
        let catalog = Catalog::built_in();
        assert_eq!(
            StarLabel::of(catalog, StarIndex::new(0)).text,
            "Sirius −1.4"
        );
        let is_lettered = |star: &StarIndex| {
            let letter = catalog
                .name_of(*star)
                .is_some_and(|name| name.contains("gam "));
            letter && catalog.proper_name(*star).is_none()
        };
        let lettered = (0..500).map(StarIndex::new).find(is_lettered).unwrap();
        assert!(StarLabel::of(catalog, lettered).text.starts_with('γ'));
        let last = StarIndex::new(catalog.stars().len() - 1);
        let designation = catalog.designation(last);
        let (_, number) = designation.split_once(' ').unwrap();
        assert!(StarLabel::of(catalog, last).text.starts_with(number));
    }

    #[test]
    fn every_letter_of_the_catalogue_is_known() {
        let catalog = Catalog::built_in();
        let names = (0..catalog.stars().len()).filter_map(|i| catalog.name_of(StarIndex::new(i)));
        for name in names {
            let short = short(name);
            let flamsteed = short.starts_with(|c: char| c.is_ascii_digit());
            assert!(flamsteed || !short.is_ascii(), "{name}");
        }
    }
}
