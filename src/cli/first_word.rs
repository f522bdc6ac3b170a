//! The first word of the command line: a command, or frames for `process`.

use clap::Command;
use clap::error::ErrorKind;
use std::ffi::{OsStr, OsString};
use std::path::Path;

/// First words that mean a command, as other programs or people call it.
const SYNONYMS: [(&str, &str); 8] = [
    ("analyze", "process"),
    ("detect", "process"),
    ("measure", "process"),
    ("plate-solve", "process"),
    ("platesolve", "process"),
    ("solve", "process"),
    ("solve-field", "process"),
    ("generate", "simulate"),
];

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
    let Some(first) = words.get(1) else {
        return Ok(words);
    };
    match kind_of(first, program) {
        FirstWord::Command => {}
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
