//! `flats`: evenly lit frames.

use super::args::{FlatsArgs, Format};
use super::darks::{for_each_frame, header, image, save};
use super::output::{csv_table, print};
use super::resources::thread_pool;
use super::settings::read_master;
use super::{Exit, Fault, chained, complain, input, overwrite, warn};
use anyhow::Context;
use starpipe::calibration::flats::{FlatConfig, FlatStack, Flats};
use starpipe::camera::data_sheet::Sensor;
use starpipe::frame::Buffers;
use std::path::PathBuf;

/// `starpipe flats`
pub(crate) fn flats(arguments: FlatsArgs) -> Result<Exit, Fault> {
    input::check(&arguments.frames)?;
    let (frames, troubles) = input::frames(arguments.frames.clone());
    for trouble in &troubles {
        complain(chained(trouble));
    }
    let output = arguments
        .out
        .as_ref()
        .map(|directory| directory.join("master-flat.fits"));
    if let Some(output) = &output {
        let inputs: Vec<_> = frames.iter().chain(&arguments.dark).cloned().collect();
        overwrite::check_results(&inputs, std::slice::from_ref(output))?;
    }
    let pool = thread_pool(arguments.threads)?;
    let mut stack = FlatStack::new(config(&arguments)?);
    let read = |path: &PathBuf| -> anyhow::Result<_> {
        let frame =
            input::read_frame(path, arguments.page, &mut Buffers::new()).context("reading")?;
        Ok((path.display().to_string(), frame))
    };
    let unread = for_each_frame(&pool, &frames, read, |(name, frame)| {
        Ok(stack.add(&name, &frame)?)
    })?;
    if unread == frames.len() {
        return Ok(Exit::Failure);
    }
    let flats = stack.measure().map_err(anyhow::Error::from)?;
    if let (Some(directory), Some(output)) = (&arguments.out, output) {
        save(directory, &[(output, master(&flats, &arguments)?)])?;
    }
    let text = match arguments.format {
        Format::Text => flats.report().to_text(),
        Format::Json => serde_json::to_string(&flats.report()).context("writing JSON")? + "\n",
        Format::Csv => csv_table(flats.frame_rows())?,
    };
    // Nobody left to read it: nothing is lost.
    let _ = print(&text)?;
    let failed = unread > 0 || !troubles.is_empty();
    Ok(if failed { Exit::Failure } else { Exit::Success })
}

fn config(arguments: &FlatsArgs) -> anyhow::Result<FlatConfig> {
    let sensor = arguments.camera.as_deref().map(Sensor::read).transpose()?;
    let dark = arguments.dark.as_deref().map(read_master).transpose()?;
    if sensor.is_none() && dark.is_none() {
        warn("the level without light is taken to be 0: --dark or --camera says what it is");
    }
    Ok(FlatConfig {
        dark: dark.map(|dark| (dark.name, dark.frame)),
        bias_adu: sensor.as_ref().map_or(0.0, |sensor| sensor.bias_adu),
        read_noise_e: sensor.map(|sensor| sensor.read_noise_e),
    })
}

fn master(flats: &Flats, arguments: &FlatsArgs) -> anyhow::Result<Vec<u8>> {
    let mut header = header("FLAT", flats.frames.len());
    if let Some(gain) = flats.gain {
        header.real("GAIN", gain.e_per_adu, "[e/ADU] by photon transfer");
    }
    header.real("RMS", flats.nonuniformity, "of the response, of its mean");
    let dark = arguments.dark.as_ref();
    header.history(&format!(
        "Mean response of each pixel over {} frames, by starpipe flats {}; dark: {}",
        flats.frames.len(),
        env!("CARGO_PKG_VERSION"),
        dark.map_or("none".to_owned(), |dark| dark.display().to_string())
    ));
    image((flats.width, flats.height), &flats.master, &header)
}
