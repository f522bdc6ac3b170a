//! The command line: everything it does is done by the library.

mod cli;

fn main() -> std::process::ExitCode {
    cli::run()
}
