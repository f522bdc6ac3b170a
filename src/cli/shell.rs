//! `completions` and `man`: what shells and manuals say of the command line.

use super::exit::{CommandError, CommandOutput};
use clap::{Args, Command};
use clap_complete::Shell;
use clap_mangen::Man;

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    starpipe completions bash > ~/.local/share/bash-completion/completions/starpipe\n  \
    starpipe completions zsh > ~/.zfunc/_starpipe\n  \
    starpipe completions fish > ~/.config/fish/completions/starpipe.fish")]
pub(crate) struct CompletionsArgs {
    /// Shell
    shell: Shell,
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    starpipe man process | man -l -\n  \
    starpipe man > ~/.local/share/man/man1/starpipe.1")]
pub(crate) struct ManArgs {
    /// Command [default: starpipe itself]
    command: Option<String>,
}

/// `starpipe completions`
pub(crate) fn completions(
    arguments: &CompletionsArgs,
    mut program: Command,
) -> Result<CommandOutput, CommandError> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut program, "starpipe", &mut script);
    Ok(CommandOutput::success(String::from_utf8(script)?))
}

/// `starpipe man`
pub(crate) fn man(
    arguments: &ManArgs,
    mut program: Command,
) -> Result<CommandOutput, CommandError> {
    program.build();
    let command = match &arguments.command {
        None => program,
        Some(name) => program
            .find_subcommand(name)
            .cloned()
            .ok_or_else(|| CommandError::usage(format!("there is no command '{name}'")))?,
    };
    let name = command
        .get_bin_name()
        .unwrap_or("starpipe")
        .replace(' ', "-");
    let mut page = Vec::new();
    Man::new(command.name(name)).render(&mut page)?;
    Ok(CommandOutput::success(String::from_utf8(page)?))
}
