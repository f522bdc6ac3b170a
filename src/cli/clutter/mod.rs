//! `clutter`: frames with more than stars in them, and pictures of no sky.

mod args;
mod pictures;

pub(crate) use args::ClutterArgs;

use super::exit::{CommandError, Outcome};
use super::options::format::Format;
use super::output::rows::{csv_table, json_lines};
use super::progress::frames_bar_with_speed;
use starpipe::study::clutter::{KindResult, Protocol, run};

/// `starpipe clutter`
pub(crate) fn clutter(arguments: &ClutterArgs) -> Result<Outcome, CommandError> {
    let protocol = Protocol {
        setup: arguments.setup.setup()?,
        frames: arguments.frames,
        seed: arguments.seed,
    };
    let kinds = &arguments.kinds.0;
    let rows = arguments.catalog.with_index(|pool, indexed| {
        if let Some(directory) = &arguments.pictures {
            pictures::write(directory, kinds, &protocol, indexed)?;
        }
        let progress = frames_bar_with_speed(protocol.frames * kinds.len() as u64);
        let done = || progress.inc(1);
        let row = |kind: &_| pool.install(|| run(*kind, &protocol, indexed, &done));
        let rows: Result<Vec<KindResult>, _> = kinds.iter().map(row).collect();
        progress.finish_and_clear();
        Ok(rows?)
    })?;
    Ok(Outcome::success(match arguments.format {
        Format::Text => introduction(&protocol) + &KindResult::to_text(&rows),
        Format::Json => json_lines(rows.iter())?,
        Format::Csv => csv_table(rows.iter())?,
    }))
}

fn introduction(protocol: &Protocol) -> String {
    let camera = &protocol.setup.scenario.camera;
    format!(
        "{} frames of each kind, seed {}; {}, {} × {} px; nothing known beforehand.\n\
         wrong frames: another pointing, or no sky at all. false/Mpx: detections without a star, clutter included.\n\
         wrong names: that star is not within 2 px; stated: what the stated probabilities add up to.\n\n",
        protocol.frames, protocol.seed, camera.name, camera.width_px, camera.height_px,
    )
}
