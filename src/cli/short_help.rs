//! What `-h` shows: the options that people use most, on one screen. `--help` shows all.

use clap::Command;

/// The options that `-h` shows, by command; of commands that are not here, it shows all.
const SHOWN: [(&str, &[&str]); 9] = [
    (
        "process",
        &[
            "dark",
            "mask",
            "fov",
            "pixel_scale",
            "near",
            "date",
            "site",
            "camera",
            "format",
            "out",
            "html",
            "draw",
            "quiet",
            "catalog",
            "threads",
        ],
    ),
    (
        "identify",
        &[
            "width",
            "height",
            "fov",
            "pixel_scale",
            "near",
            "date",
            "site",
            "camera",
            "format",
            "out",
            "html",
            "quiet",
            "catalog",
            "threads",
        ],
    ),
    (
        "track",
        &[
            "interval",
            "dark",
            "fov",
            "near",
            "date",
            "site",
            "camera",
            "max_stars",
            "format",
            "catalog",
            "threads",
        ],
    ),
    (
        "calibrate",
        &[
            "output",
            "fov",
            "date",
            "site",
            "camera",
            "plot",
            "opencv",
            "platepar",
            "indi_allsky",
            "format",
            "threads",
        ],
    ),
    ("limit", &STUDY),
    ("defocus", &STUDY),
    ("simulate", &STUDY),
    ("validate", &STUDY),
    ("clutter", &STUDY),
];

/// Those of commands that are given a camera.
const STUDY: [&str; 25] = [
    "camera",
    "preset",
    "exposure",
    "sky_mag_arcsec2",
    "zenith_distance",
    "sweep",
    "plot",
    "figures",
    "format",
    "out",
    "count",
    "seed",
    "random_attitude",
    "ra",
    "dec",
    "date",
    "site",
    "suite",
    "kinds",
    "pictures",
    "vmag",
    "required_error",
    "darks",
    "focal_length_mm",
    "threads",
];

/// The program with help on one screen for `-h`.
pub(super) fn of(mut program: Command) -> Command {
    for (name, shown) in SHOWN {
        program = program.mut_subcommand(name, |command| shortened(command, shown));
    }
    program
}

fn shortened(command: Command, shown: &[&str]) -> Command {
    let examples = command.get_after_help().map(ToString::to_string);
    let command = command.mut_args(|argument| {
        let is_shown = argument.is_positional() || shown.contains(&argument.get_id().as_str());
        argument.hide_short_help(!is_shown)
    });
    let Some(examples) = examples else {
        return command.after_help(MORE);
    };
    let first = examples.split("\n\n").next().unwrap_or_default().to_owned();
    command
        .after_help(format!("{first}\n\n{MORE}"))
        .after_long_help(examples)
}

const MORE: &str = "--help shows all options.";

#[cfg(test)]
mod tests {
    use super::super::command::Arguments;
    use super::*;
    use clap::CommandFactory;
    use std::collections::HashSet;

    /// Rows of a large terminal.
    const SCREEN: usize = 56;

    #[test]
    fn short_help_fits_on_a_screen_and_long_help_has_all() {
        let mut program = of(Arguments::command()).term_width(80);
        program.build();
        for command in program.get_subcommands_mut() {
            let lines = command.render_help().to_string().lines().count();
            assert!(lines <= SCREEN, "{}: {lines} lines", command.get_name());
            let long = command.render_long_help().to_string();
            for argument in command
                .get_opts()
                .filter(|argument| !argument.is_hide_set())
            {
                let name = argument.get_long().unwrap();
                assert!(long.contains(&format!("--{name}")), "{name}");
            }
        }
    }

    #[test]
    fn every_option_that_is_shown_exists() {
        let program = Arguments::command();
        for (name, shown) in SHOWN {
            let command = program.find_subcommand(name).unwrap();
            let known: HashSet<&str> = command
                .get_arguments()
                .map(|a| a.get_id().as_str())
                .collect();
            let missing: Vec<_> = shown.iter().filter(|id| !known.contains(*id)).collect();
            let is_study = shown.len() == STUDY.len();
            assert!(missing.is_empty() || is_study, "{name}: {missing:?}");
        }
    }
}
