//! Bayer letters and Flamsteed numbers as people write them: `α CMa`, `24 Tau`.

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

/// The Bayer letter in Greek, or the Flamsteed number, with the constellation: `9 alp CMa` is `α
/// CMa`.
pub(super) fn short(name: &str) -> String {
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
    use crate::catalog::{Catalog, StarIndex};

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
