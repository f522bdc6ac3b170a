//! The label of a star: its name and magnitude.

use super::options::LabelKind;
use crate::catalog::{Catalog, StarIndex};
use crate::ephemeris::solar_system::Body;

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
    /// The star's name or number, and its V magnitude: `Sirius −1.4`, `α CMi 0.4`, `HD 12345 7.2`.
    pub(super) text: String,
    /// Its V magnitude.
    pub(super) v_mag: f32,
    /// Whether it has a name or number of the kind that is wanted.
    pub(super) has_name: bool,
}

impl StarLabel {
    /// The label of a star.
    pub(super) fn of_star(catalog: &Catalog, star: StarIndex, kind: LabelKind) -> Self {
        let name = || {
            let proper = catalog.proper_name(star).map(str::to_owned);
            proper.or_else(|| catalog.name_of(star).map(short))
        };
        let numbers = catalog.numbers_of(star);
        let hd = || numbers.hd.map(|number| format!("HD {number}"));
        let hip = || numbers.hip.map(|number| format!("HIP {number}"));
        let wanted = match kind {
            LabelKind::Name => name(),
            LabelKind::Hd => hd(),
            LabelKind::Hip => hip(),
        };
        let has_name = wanted.is_some();
        let called = wanted.or_else(name).or_else(hd).or_else(hip);
        let called = called.unwrap_or_else(|| catalog.designation(star));
        Self::new(&called, catalog.star(star).v_mag, has_name)
    }

    /// The label of the Moon or a planet.
    pub(super) fn of_body(body: &Body) -> Self {
        Self::new(body.kind.name(), body.v_mag as f32, true)
    }

    fn new(called: &str, v_mag: f32, has_name: bool) -> Self {
        let rounded = format!("{v_mag:.1}");
        let rounded = if rounded == "-0.0" { "0.0" } else { &rounded };
        Self {
            text: format!("{called} {}", rounded.replace('-', "−")),
            v_mag,
            has_name,
        }
    }
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
    fn a_star_is_called_by_what_is_wanted_and_else_by_the_next() {
        let catalog = Catalog::built_in();
        let called = |star, kind| StarLabel::of_star(catalog, star, kind);
        let sirius = StarIndex::new(0);
        assert_eq!(called(sirius, LabelKind::Name).text, "Sirius −1.4");
        assert_eq!(called(sirius, LabelKind::Hd).text, "HD 48915 −1.4");
        assert_eq!(called(sirius, LabelKind::Hip).text, "HIP 32349 −1.4");
        let stars = || (0..catalog.stars().len()).map(StarIndex::new);
        let is_lettered = |star: &StarIndex| {
            let letter = catalog
                .name_of(*star)
                .is_some_and(|name| name.contains("gam "));
            letter && catalog.proper_name(*star).is_none()
        };
        let lettered = stars().find(is_lettered).unwrap();
        assert!(called(lettered, LabelKind::Name).text.starts_with('γ'));
        let is_nameless = |star: &StarIndex| {
            let numbers = catalog.numbers_of(*star);
            catalog.name_of(*star).is_none() && numbers.hd.is_some() && numbers.hip.is_none()
        };
        let nameless = called(stars().find(is_nameless).unwrap(), LabelKind::Hip);
        assert!(nameless.text.starts_with("HD ") && !nameless.has_name);
        let without_numbers = |star: &StarIndex| {
            let numbers = catalog.numbers_of(*star);
            catalog.full_name(*star).is_none() && numbers.hd.is_none() && numbers.hip.is_none()
        };
        let last = called(stars().find(without_numbers).unwrap(), LabelKind::Name);
        assert!(last.text.starts_with("SKYMAP "));
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
