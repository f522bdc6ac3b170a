//! The suite of clutter: frames with more than stars in them, and pictures of no sky.

mod args;
mod pictures;

pub(crate) use args::ClutterArgs;

use crate::cli::exit::{CommandError, CommandOutput};
use crate::cli::progress::frames_bar_with_speed;
use starpipe::lab::clutter::{ClutterProtocol, KindResult, run};
use starpipe::lab::simulate::Setup;

/// `starpipe validate --suite clutter`
pub(crate) fn clutter(arguments: &ClutterArgs) -> Result<CommandOutput, CommandError> {
    let kinds = &arguments.kinds.0;
    let setups = arguments.setup.setups()?;
    let mut all_written = true;
    let tables = arguments.catalog.with_index(|pool, indexed| {
        let progress = frames_bar_with_speed(arguments.count * (setups.len() * kinds.len()) as u64);
        let done = || progress.inc(1);
        let mut table = |(camera, setup): &(String, Setup)| {
            let protocol = ClutterProtocol {
                setup: setup.clone(),
                frames: arguments.count,
                seed: arguments.seed,
            };
            if let Some(directory) = &arguments.pictures {
                let of_many = (setups.len() > 1).then(|| directory.join(camera));
                let directory = of_many.as_ref().unwrap_or(directory);
                all_written &= pictures::write(directory, kinds, &protocol, indexed)?;
            }
            let row = |kind: &_| {
                let row = pool.install(|| run(*kind, &protocol, indexed, &done))?;
                let camera = camera.clone();
                Ok(KindResult { camera, ..row })
            };
            let rows: Result<Vec<_>, CommandError> = kinds.iter().map(row).collect();
            Ok(Table {
                rows: rows?,
                protocol,
            })
        };
        let tables: Result<Vec<Table>, CommandError> = setups.iter().map(&mut table).collect();
        progress.finish_and_clear();
        tables
    })?;
    let text = || {
        let texts: Vec<String> = tables.iter().map(Table::to_text).collect();
        texts.join("\n")
    };
    let rows = tables.iter().flat_map(|table| &table.rows);
    let text = arguments.format.of_rows(text, rows)?;
    Ok(CommandOutput::success(text).if_written(all_written))
}

/// The results of one camera.
struct Table {
    protocol: ClutterProtocol,
    rows: Vec<KindResult>,
}

impl Table {
    fn to_text(&self) -> String {
        introduction(&self.protocol) + &KindResult::to_text(&self.rows)
    }
}

fn introduction(protocol: &ClutterProtocol) -> String {
    let camera = &protocol.setup.scenario.camera;
    format!(
        "{} frames of each kind, seed {}; {}, {} × {} px; no hints.\n\
         wrong frames: wrong pointing, or a picture without sky. false/Mpx: detections without a star, clutter included.\n\
         wrong names: no star is there, or a brighter one is nearer; stated: sum of the stated \
         probabilities.\n\n",
        protocol.frames, protocol.seed, camera.name, camera.width_px, camera.height_px,
    )
}
