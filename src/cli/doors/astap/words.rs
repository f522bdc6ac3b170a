//! The words of ASTAP's command line, as this program has options.
//!
//! As ASTAP does, it takes what it knows and goes on: an option that it does not know is told of and left out, one
//! whose value is missing too. So no caller meets the exit status of a wrong command line, which would tell it that
//! there are not enough stars.

use crate::cli::output::messages::report_warning;
use std::ffi::{OsStr, OsString};

/// How an option is taken.
#[derive(Clone, Copy)]
enum Kind {
    /// With a value.
    Value,
    /// With a value, or this one.
    ValueOr(&'static str),
    /// Alone, or with `n` for not.
    Flag,
    /// Not needed here, with a value or without.
    NotNeeded,
    /// The same, but someone may miss what it does.
    Missed,
    /// What is to be done in place of solving.
    OtherJob,
}

const OPTIONS: [(&str, Kind); 28] = [
    ("f", Kind::Value),
    ("r", Kind::Value),
    ("fov", Kind::Value),
    ("ra", Kind::Value),
    ("spd", Kind::Value),
    ("o", Kind::Value),
    ("d", Kind::Value),
    ("D", Kind::Value),
    ("analyse", Kind::ValueOr("0")),
    ("extract", Kind::ValueOr("0")),
    ("extract2", Kind::ValueOr("0")),
    ("sip", Kind::Flag),
    ("wcs", Kind::Flag),
    ("update", Kind::Flag),
    ("log", Kind::Flag),
    ("s", Kind::NotNeeded),
    ("t", Kind::NotNeeded),
    ("m", Kind::NotNeeded),
    ("z", Kind::NotNeeded),
    ("check", Kind::NotNeeded),
    ("speed", Kind::NotNeeded),
    ("progress", Kind::NotNeeded),
    ("debug", Kind::NotNeeded),
    ("annotate", Kind::Missed),
    ("tofits", Kind::Missed),
    ("sqm", Kind::Missed),
    ("stack", Kind::OtherJob),
    ("analyse2", Kind::OtherJob),
];

/// `starpipe astap`, and the words after it as this program has options.
pub(crate) fn translated(words: Vec<OsString>) -> Vec<OsString> {
    let mut rest = words.into_iter().peekable();
    let mut own: Vec<OsString> = rest.by_ref().take(2).collect();
    if rest.peek().is_none() {
        own.push("--help".into());
    }
    while let Some(word) = rest.next() {
        let name = match option_name(&word) {
            Some("h" | "help") => {
                own.push("--help".into());
                continue;
            }
            // An option of this program.
            Some(name) if name.starts_with('-') => {
                own.push(word);
                own.extend(rest.next_if(is_value));
                continue;
            }
            Some(name) => name,
            None => {
                report_warning(format_args!("{} is left out", word.display()));
                continue;
            }
        };
        let value = rest.next_if(is_value);
        match (kind_of(name), value) {
            (Some(Kind::Value), Some(value)) => own.push(joined(name, &value)),
            (Some(Kind::ValueOr(usual)), value) => {
                own.push(joined(name, &value.unwrap_or(usual.into())));
            }
            (Some(Kind::Flag), value) if value.as_deref() != Some(OsStr::new("n")) => {
                own.push(format!("--{name}").into());
            }
            (Some(Kind::Flag | Kind::NotNeeded), _) => {}
            (Some(Kind::OtherJob), _) => own.push(joined("other-job", OsStr::new(name))),
            (Some(Kind::Value), None) => {
                report_warning(format_args!("-{name} has no value, and is left out"));
            }
            (Some(Kind::Missed) | None, _) => {
                report_warning(format_args!("-{name} is not known here, and is left out"));
            }
        }
    }
    own
}

fn kind_of(name: &str) -> Option<Kind> {
    if name.starts_with("focus") {
        return Some(Kind::OtherJob);
    }
    let known = OPTIONS.iter().find(|(known, _)| *known == name);
    known.map(|(_, kind)| *kind)
}

/// What is behind the first dash.
fn option_name(word: &OsStr) -> Option<&str> {
    let name = word.to_str()?.strip_prefix('-')?;
    (!name.is_empty()).then_some(name)
}

/// Whether a word is a value: no option, or a number.
fn is_value(word: &OsString) -> bool {
    let is_number =
        |name: &str| name.starts_with(|first: char| first.is_ascii_digit() || first == '.');
    option_name(word).is_none_or(is_number)
}

fn joined(name: &str, value: &OsStr) -> OsString {
    let dashes = if name.len() == 1 { "-" } else { "--" };
    let mut word = OsString::from(format!("{dashes}{name}="));
    word.push(value);
    word
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(line: &str) -> String {
        let words = format!("starpipe astap {line}");
        let own = translated(words.split_whitespace().map(OsString::from).collect());
        own[2..].join(OsStr::new(" ")).into_string().unwrap()
    }

    #[test]
    fn options_of_astap_become_those_of_this_program() {
        for (line, expected) in [
            ("", "--help"),
            ("-h", "--help"),
            ("-f a.fits -fov 1.5 -z 0 -s 500", "-f=a.fits --fov=1.5"),
            ("-ra 5.58 -spd 89.6 -r 10", "--ra=5.58 --spd=89.6 -r=10"),
            ("-ra -1.5 -f -", "--ra=-1.5 -f=-"),
            ("-d /data -D d50", "-d=/data -D=d50"),
            ("-analyse -f a.png", "--analyse=0 -f=a.png"),
            ("-extract2 20", "--extract2=20"),
            ("-sip n -wcs -update y -speed auto -check", "--wcs --update"),
            ("-sip -log -progress", "--sip --log"),
            ("-stack /data", "--other-job=stack"),
            (
                "-focus1 a.fits -focus2 b.fits",
                "--other-job=focus1 --other-job=focus2",
            ),
            ("-f a.fits -new 3 -annotate", "-f=a.fits"),
            ("-f a.fits -fov", "-f=a.fits"),
            (
                "--catalog c.cat --threads 2 -f a.fits",
                "--catalog c.cat --threads 2 -f=a.fits",
            ),
            ("a.fits", ""),
        ] {
            assert_eq!(after(line), expected, "{line}");
        }
    }

    #[test]
    fn every_option_is_one_of_the_command() {
        use crate::cli::command::Arguments;
        use clap::Parser;
        for (name, kind) in OPTIONS {
            let line = match kind {
                Kind::Value | Kind::ValueOr(_) => format!("-{name} 1"),
                _ => format!("-{name}"),
            };
            let words = format!("starpipe astap {line}");
            let own = translated(words.split_whitespace().map(OsString::from).collect());
            assert!(Arguments::try_parse_from(own).is_ok(), "{line}");
        }
    }
}
