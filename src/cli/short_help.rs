//! What `-h` shows: the options that people use most, on one screen. `--help` shows all.

use clap::Command;

/// The options that `-h` shows, by command, in lists that several share; of commands that are not here, it
/// shows all.
const SHOWN: [(&str, [&[&str]; 2]); 16] = [
    ("process", [&["dark", "mask", "draw"], &SOLVING]),
    ("sky", [&["dark", "flat", "mask"], &SOLVING]),
    (
        "night",
        [
            &[
                "out",
                "html",
                "dark",
                "flat",
                "mask",
                "utc_offset",
                "quiet",
                "fov",
            ],
            &["site", "camera", "format", "threads", "catalog"],
        ],
    ),
    ("identify", [&["width", "height"], &SOLVING]),
    (
        "track",
        [
            &["interval", "dark", "max_stars", "fov", "near", "catalog"],
            &FRAMES,
        ],
    ),
    (
        "calibrate",
        [
            &["out", "fov", "plot", "opencv", "platepar", "indi_allsky"],
            &FRAMES,
        ],
    ),
    (
        "validate-robustness",
        [
            &["count", "seed", "stars", "missing", "sweep", "plot"],
            &["format", "threads"],
        ],
    ),
    (
        "solve-field",
        [
            &[
                "dir",
                "out",
                "wcs",
                "new_fits",
                "overwrite",
                "scale_low",
                "scale_high",
            ],
            &[
                "scale_units",
                "ra",
                "dec",
                "radius",
                "cpulimit",
                "width",
                "height",
                "catalog",
            ],
        ],
    ),
    (
        "serve",
        [
            &[
                "listen",
                "keys",
                "page",
                "folder",
                "max_upload",
                "allow_url",
            ],
            &["jobs", "catalog", "threads"],
        ],
    ),
    ("limit", [&[], &STUDY]),
    ("defocus", [&[], &STUDY]),
    ("simulate", [&[], &STUDY]),
    ("validate", [&[], &STUDY]),
    ("validate-hard", [&[], &STUDY]),
    ("validate-sky", [&[], &STUDY]),
    ("validate-clutter", [&[], &STUDY]),
];

/// Those of commands that read frames.
const FRAMES: [&str; 5] = ["date", "site", "camera", "format", "threads"];

/// Those of commands that identify stars one frame after the other.
const SOLVING: [&str; 12] = [
    "date",
    "site",
    "camera",
    "format",
    "threads",
    "fov",
    "pixel_scale",
    "near",
    "out",
    "html",
    "quiet",
    "catalog",
];

/// Those of commands that are given a camera.
const STUDY: [&str; 25] = [
    "camera",
    "preset",
    "exposure_s",
    "sky_mag_arcsec2",
    "zenith_distance_deg",
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

/// The program with help on one screen for `-h`. A command is changed when it is called: to change all
/// takes longer than a frame.
pub(super) fn apply(program: Command) -> Command {
    let names: Vec<String> = program
        .get_subcommands()
        .map(|c| c.get_name().to_owned())
        .collect();
    names.into_iter().fold(program, |program, name| {
        program.mut_subcommand(name, |command| command.defer(shortened))
    })
}

/// The command with its short help.
fn shortened(command: Command) -> Command {
    let shown = SHOWN.iter().find(|(name, _)| *name == command.get_name());
    let command = match shown {
        Some((_, shown)) => with_options(command, &shown.concat()),
        None => command,
    };
    with_few_examples(command)
}

/// The command with these options alone, and the beginning of what is said of each.
fn with_options(command: Command, shown: &[&str]) -> Command {
    command.mut_args(|argument| {
        let is_shown = argument.is_positional() || shown.contains(&argument.get_id().as_str());
        let argument = argument.hide_short_help(!is_shown);
        match (
            argument.get_help().map(ToString::to_string),
            argument.get_long_help(),
        ) {
            (Some(help), None) => argument.help(beginning(&help).to_owned()).long_help(help),
            _ => argument,
        }
    })
}

/// What stands before the first aside.
fn beginning(help: &str) -> &str {
    let ends = ["; ", ": ", ". ", " ["].into_iter();
    let end = ends.filter_map(|mark| help.find(mark)).min();
    &help[..end.unwrap_or(help.len())]
}

/// The command with two examples, and without what is said after them.
fn with_few_examples(command: Command) -> Command {
    /// The heading and two examples.
    const LINES: usize = 3;
    let Some(all) = command.get_after_help().map(ToString::to_string) else {
        return command;
    };
    let examples = all.split("\n\n").next().unwrap_or_default();
    let first: Vec<&str> = examples.lines().take(LINES).collect();
    command
        .after_help(format!("{}\n\n--help shows all.", first.join("\n")))
        .after_long_help(all)
}

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
        let mut program = apply(Arguments::command()).term_width(80);
        program.build();
        for command in program.get_subcommands_mut() {
            let lines = command.render_help().to_string().lines().count();
            assert!(lines <= SCREEN, "{}: {lines} lines", command.get_name());
            let long = command.render_long_help().to_string();
            for argument in command
                .get_opts()
                .filter(|argument| !argument.is_hide_set())
            {
                let name = match (argument.get_long(), argument.get_short()) {
                    (Some(long), _) => format!("--{long}"),
                    (None, short) => format!("-{}", short.unwrap()),
                };
                assert!(long.contains(&name), "{name}");
            }
        }
    }

    #[test]
    fn every_option_that_is_shown_exists() {
        let program = Arguments::command();
        let mut of_no_study: Vec<&str> = STUDY.to_vec();
        for (name, [own, shared]) in SHOWN {
            let command = program.find_subcommand(name).unwrap();
            let known: HashSet<&str> = command
                .get_arguments()
                .map(|a| a.get_id().as_str())
                .collect();
            if shared == STUDY {
                of_no_study.retain(|id| !known.contains(id));
                continue;
            }
            let shown = own.iter().chain(shared);
            let missing: Vec<_> = shown.filter(|id| !known.contains(*id)).collect();
            assert!(missing.is_empty(), "{name}: {missing:?}");
        }
        assert!(of_no_study.is_empty(), "{of_no_study:?}");
    }
}
