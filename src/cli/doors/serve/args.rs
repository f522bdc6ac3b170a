//! The arguments of `serve`.

use crate::cli::exit::CommandError;
use crate::cli::options::catalog::CatalogOptions;
use crate::cli::options::frames::MemoryOption;
use crate::cli::options::stated::{TimeLimitOption, with_stated};
use clap::Args;
use starpipe::base::user_folders;
use starpipe::solve::SolveOptions;
use std::net::SocketAddr;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    starpipe serve\n  \
    starpipe serve --listen 0.0.0.0:8080 --keys keys.txt\n  \
    curl --data-binary @night.tif 'http://127.0.0.1:8080/solve?fov=11.4'\n\n\
    Programs for nova.astrometry.net work with the address http://127.0.0.1:8080 in place of\n\
    http://nova.astrometry.net, and with any key. docs/doors/serve.md shows how to set it.")]
pub(crate) struct ServeArgs {
    /// Address and port to listen on. With an address of this computer alone (127.0.0.1), other computers
    /// are not answered
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1:8080")]
    pub(super) listen: SocketAddr,
    /// Name by which the server may be called, beside addresses and localhost; may be given several times.
    /// It is needed behind a proxy that passes on its own name
    #[arg(long, value_name = "NAME")]
    pub(super) host: Vec<String>,
    /// File with the keys that are accepted, one in each line [default: any key is accepted]
    #[arg(long, value_name = "FILE")]
    pub(super) keys: Option<PathBuf>,
    /// Directory with a page to show at / in place of the built-in form, such as web/dist
    #[arg(long, value_name = "DIR")]
    pub(super) page: Option<PathBuf>,
    /// Directory in which uploads and their results are kept: new, empty, or one of an earlier start
    /// [default: the user's cache directory]
    #[arg(long, value_name = "DIR")]
    folder: Option<PathBuf>,
    /// How much is kept there, in MB; then the oldest results are removed
    #[arg(long, value_name = "MB", default_value_t = 2000, value_parser = clap::value_parser!(u64).range(1..=1_000_000_000))]
    pub(super) folder_limit: u64,
    /// Largest upload, in MB
    #[arg(long, value_name = "MB", default_value_t = 256, value_parser = megabytes)]
    pub(super) max_upload: usize,
    /// Frames that are solved at once, one on each thread [default: --threads]
    #[arg(long, value_name = "NUMBER", value_parser = small_number)]
    pub(super) jobs: Option<usize>,
    /// Frames that may wait; others are refused
    #[arg(long, value_name = "NUMBER", default_value_t = 64, value_parser = small_number)]
    pub(super) queue: usize,
    /// Time in which the head of a request must arrive, and its body beside its length at 50 kB/s. A client
    /// that reads nothing of its answer for so long is given up
    #[arg(long, value_name = "SECONDS", default_value_t = 30, value_parser = clap::value_parser!(u64).range(1..=3600))]
    pub(super) send_time: u64,
    /// Also fetch pictures by their address, from public addresses alone (http)
    #[arg(long)]
    pub(super) allow_url: bool,
    #[command(flatten)]
    limit: TimeLimitOption,
    #[command(flatten)]
    pub(super) memory: MemoryOption,
    #[command(flatten)]
    pub(super) catalog: CatalogOptions,
}

fn small_number(text: &str) -> Result<usize, String> {
    let number = text
        .parse()
        .ok()
        .filter(|number| (1..=1024).contains(number));
    number.ok_or_else(|| "must be a whole number from 1 to 1024".to_owned())
}

fn megabytes(text: &str) -> Result<usize, String> {
    let number = text
        .parse()
        .ok()
        .filter(|number| (1..=4000).contains(number));
    number.ok_or_else(|| "must be a whole number from 1 to 4000".to_owned())
}

impl ServeArgs {
    /// What every frame is solved with.
    pub(super) fn options(&self) -> Result<SolveOptions, CommandError> {
        with_stated(SolveOptions::default(), &self.limit)
    }

    /// Where jobs are kept.
    pub(super) fn folder(&self) -> Result<PathBuf, CommandError> {
        let of_user = || Some(user_folders::cache()?.join("starpipe").join("jobs"));
        let folder = self.folder.clone().or_else(of_user);
        folder.ok_or_else(|| CommandError::usage("no directory for jobs is known; give --folder"))
    }
}
