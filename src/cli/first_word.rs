//! The first word of the command line: a command, or frames for `process`; and which suite `validate` runs. The
//! name by which the program is called may stand for a command, too.

use super::doors::astap;
use clap::Command;
use clap::error::ErrorKind;
use std::ffi::{OsStr, OsString};
use std::path::Path;

/// First words that mean a command, as other programs or people call it.
const SYNONYMS: [(&str, &str); 7] = [
    ("analyze", "process"),
    ("detect", "process"),
    ("measure", "process"),
    ("plate-solve", "process"),
    ("platesolve", "process"),
    ("solve", "process"),
    ("generate", "simulate"),
];

/// Names of other solvers by which the program may be called, and the commands that answer in their place.
const OTHER_PROGRAMS: [(&str, &str); 3] = [
    ("solve-field", "solve-field"),
    ("astap", "astap"),
    ("astap_cli", "astap"),
];

const VALIDATE: &str = "validate";
const SUITE: &str = "--suite";

/// What the first word of a command line is.
#[derive(Debug, PartialEq, Eq)]
enum FirstWord {
    /// A command, or an option of the program.
    Command,
    /// A frame, or an option of `process`.
    Frame,
    /// Another name of this command.
    Synonym(&'static str),
}

/// The words of a command line, the program's name first; with `process` before frames.
///
/// # Errors
/// A first word that is another name of a command.
pub(crate) fn completed(
    words: impl Iterator<Item = OsString>,
    program: &mut Command,
) -> Result<Vec<OsString>, clap::Error> {
    let mut words: Vec<OsString> = words.collect();
    if let Some(command) = words.first().and_then(|name| other_program(name)) {
        words.splice(..1, ["starpipe".into(), command.into()]);
        return Ok(in_own_words(words));
    }
    let Some(first) = words.get(1) else {
        return Ok(words);
    };
    match kind_of(first, program) {
        FirstWord::Command if first == VALIDATE => return Ok(of_suite(words, program)),
        FirstWord::Command => return Ok(in_own_words(words)),
        FirstWord::Frame => words.insert(1, "process".into()),
        FirstWord::Synonym(command) => {
            let message = format!(
                "there is no command '{}'; see 'starpipe {command} --help'",
                first.display()
            );
            return Err(program.error(ErrorKind::InvalidSubcommand, message));
        }
    }
    Ok(words)
}

/// The words of a command whose options are those of another program, as this one has options.
fn in_own_words(words: Vec<OsString>) -> Vec<OsString> {
    if words.get(1).is_some_and(|command| command == astap::NAME) {
        return astap::translated(words);
    }
    words
}

/// The command that answers in place of the solver by whose name the program is called.
fn other_program(called: &OsStr) -> Option<&'static str> {
    let name = Path::new(called).file_stem()?;
    let mut known = OTHER_PROGRAMS.iter();
    known
        .find(|(other, _)| name == *other)
        .map(|(_, command)| *command)
}

/// The words of `validate`; with `--suite NAME` those of `validate-NAME`, which has the suite's own options.
fn of_suite(mut words: Vec<OsString>, program: &Command) -> Vec<OsString> {
    let found = words.iter().enumerate().find_map(|(place, word)| {
        let (end, name) = match word.to_str()?.strip_prefix(SUITE)? {
            "" => (place + 2, words.get(place + 1)?.to_str()?),
            rest => (place + 1, rest.strip_prefix('=')?),
        };
        Some((place..end, format!("{VALIDATE}-{name}")))
    });
    // What is no suite is refused by `validate`.
    if let Some((range, command)) = found
        && program.find_subcommand(&command).is_some()
    {
        words.drain(range);
        words[1] = command.into();
    }
    words
}

fn kind_of(word: &OsStr, program: &Command) -> FirstWord {
    let text = word.to_string_lossy();
    let is_command = program.find_subcommand(&*text).is_some() || text == "help";
    let is_of_program = ["-h", "--help", "-V", "--version"].contains(&&*text);
    if is_command || is_of_program {
        return FirstWord::Command;
    }
    let path = Path::new(word);
    if text.starts_with('-') || path.extension().is_some() || path.exists() {
        return FirstWord::Frame;
    }
    let synonym = SYNONYMS.iter().find(|(name, _)| *name == text);
    synonym.map_or(FirstWord::Command, |(_, command)| {
        FirstWord::Synonym(command)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::command::Arguments;
    use clap::CommandFactory;

    #[test]
    fn frames_and_their_options_are_processed() {
        for word in ["night.tif", "Cargo.toml", "src", "--fov", "-", "*.fits"] {
            assert_eq!(
                kind_of(OsStr::new(word), &Arguments::command()),
                FirstWord::Frame,
                "{word}"
            );
        }
        for word in ["process", "help", "--version", "-h", "proces"] {
            assert_eq!(
                kind_of(OsStr::new(word), &Arguments::command()),
                FirstWord::Command,
                "{word}"
            );
        }
        let words = ["starpipe", "--fov", "20", "a.png"].map(OsString::from);
        let completed = completed(words.into_iter(), &mut Arguments::command()).unwrap();
        assert_eq!(completed[1], "process");
        assert_eq!(completed.len(), 5);
    }

    #[test]
    fn a_suite_is_a_command_of_its_own() {
        let completed = |line: &str| {
            let words = line.split(' ').map(OsString::from);
            let words = completed(words, &mut Arguments::command()).unwrap();
            words.join(OsStr::new(" ")).into_string().unwrap()
        };
        for (line, expected) in [
            ("starpipe validate -h", "starpipe validate -h"),
            (
                "starpipe validate --count 2 --suite hard -o a",
                "starpipe validate-hard --count 2 -o a",
            ),
            (
                "starpipe validate --suite=clutter --kinds sky",
                "starpipe validate-clutter --kinds sky",
            ),
            ("starpipe validate --suite", "starpipe validate --suite"),
            (
                "starpipe validate --suite sea",
                "starpipe validate --suite sea",
            ),
            ("starpipe sky --suite hard", "starpipe sky --suite hard"),
        ] {
            assert_eq!(completed(line), expected);
        }
    }

    #[test]
    fn synonyms_point_to_commands() {
        for (word, command) in SYNONYMS {
            assert_eq!(
                kind_of(OsStr::new(word), &Arguments::command()),
                FirstWord::Synonym(command)
            );
            assert!(
                Arguments::command().find_subcommand(command).is_some(),
                "{command}"
            );
        }
        let words = ["starpipe", "solve"].map(OsString::from);
        let error = completed(words.into_iter(), &mut Arguments::command())
            .unwrap_err()
            .to_string();
        assert!(error.contains("starpipe process --help"), "{error}");
    }
}
