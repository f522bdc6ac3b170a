//! `serve`: an HTTP server with the protocol of nova.astrometry.net, and one of its own.
//!
//! Requests are answered on one thread (`listen`, `routes`): pages of other sites are refused (`hosts`), what
//! requests bring is limited while it is read (`body`), and a client that reads nothing is given up (`stream`).
//! Frames wait in the `queue`, or in the folder of jobs (`store`), and are solved by threads of their own
//! (`worker`), which make what is wanted of them (`making`).

mod args;
mod body;
mod fetch;
mod hosts;
mod http;
mod keys;
mod listen;
mod making;
mod metrics;
mod nova;
mod page;
mod queue;
mod refusal;
mod routes;
mod server;
mod solve;
mod store;
mod stream;
mod work;
mod worker;

pub(crate) use args::ServeArgs;

use crate::cli::exit::{CommandError, CommandOutput};
use anyhow::Context as _;
use listen::Listening;
use server::Server;
use std::io;
use std::net::TcpListener;
use std::sync::Arc;
use std::thread;
use tracing_subscriber::filter::LevelFilter;
use worker::Solver;

/// `starpipe serve`
pub(crate) fn serve(arguments: &ServeArgs) -> Result<CommandOutput, CommandError> {
    tracing_subscriber::fmt()
        .with_writer(io::stderr)
        .with_ansi(false)
        .with_target(false)
        .with_max_level(LevelFilter::INFO)
        // They would be told on the standard error that is closed.
        .log_internal_errors(false)
        .init();
    let bound = || {
        let listener = TcpListener::bind(arguments.listen)?;
        listener.set_nonblocking(true)?;
        io::Result::Ok(listener)
    };
    let listener = bound().with_context(|| format!("listening on {}", arguments.listen))?;
    arguments.catalog.with_deep(true, |pool, indexed, deep| {
        let jobs = arguments.jobs.unwrap_or(pool.current_num_threads());
        let server = Arc::new(Server::new(arguments, jobs)?);
        let solver = Solver {
            server: &server,
            indexed,
            deep,
            memory: arguments.memory.limit(),
        };
        thread::scope(|scope| {
            for _ in 0..jobs {
                scope.spawn(|| solver.run());
            }
            // However this ends, the workers end, too.
            let _closing = server.queue.closing();
            Listening::new(listener, Arc::clone(&server)).run()
        })
        .context("serving")?;
        tracing::info!("ended");
        Ok(CommandOutput::success(String::new()))
    })
}
